//! A self-contained HTML page with both shapes of a pair, coloured by the map: turn and zoom with the mouse, hover a
//! point to see its match. It opens from disk and needs no network.

use super::error::{RenderError, check_map};
use super::facing::facing_alike;
use super::{map_colors, position_colors};
use crate::Mesh;
use crate::mesh::vec3;
use crate::point_map::PointMap;
use serde_json::json;

const TEMPLATE: &str = include_str!("viewer.html");

/// What the viewer shows.
#[derive(Clone, Debug)]
pub struct ViewerPair<'a> {
    /// Title of the page.
    pub title: &'a str,
    /// Name under the source.
    pub name_source: &'a str,
    /// Name under the target.
    pub name_target: &'a str,
    /// The source.
    pub source: &'a Mesh,
    /// The target.
    pub target: &'a Mesh,
    /// Source to target.
    pub map: &'a PointMap,
    /// A line under the title, such as the error.
    pub caption: &'a str,
}

/// The whole page. The target is turned by quarter turns about the axes where it faces another way than the source.
///
/// # Errors
/// If the map is not one of these meshes.
pub fn viewer_html(pair: &ViewerPair) -> Result<String, RenderError> {
    check_map(pair.map, pair.source, pair.target)?;
    let facing = facing_alike(pair.source, pair.target, pair.map)?;
    let colors_target = position_colors(&facing);
    let colors_source = map_colors(pair.map, &colors_target);
    let targets: Vec<i32> = (0..pair.map.len()).map(|i| pair.map.get(i).map_or(-1, |t| t as i32)).collect();
    let doubt = pair.map.confidence.as_ref().map(|confidence| {
        let colors: Vec<[u8; 4]> = confidence.iter().map(|&c| doubt_color(1.0 - c)).collect();
        base64(bytemuck::cast_slice(&colors))
    });
    let data = json!({
        "doubt": doubt,
        "confidence": pair.map.confidence.as_ref().map(|values| base64(bytemuck::cast_slice(values))),
        "title": pair.title,
        "caption": pair.caption,
        "source": shape(pair.name_source, pair.source, &colors_source),
        "target": shape(pair.name_target, &facing, &colors_target),
        "map": base64(bytemuck::cast_slice(&targets)),
    });
    // "</" would end the script element early.
    let data = data.to_string().replace("</", "<\\/");
    Ok(TEMPLATE.replace("__TITLE__", &escaped(pair.title)).replace("__DATA__", &data))
}

/// From light grey, no doubt, by yellow to red.
fn doubt_color(doubt: f32) -> [u8; 4] {
    let stops = [[225.0, 225.0, 220.0], [250.0, 200.0, 60.0], [200.0, 30.0, 30.0]];
    let at = 2.0 * doubt.clamp(0.0, 1.0);
    let (low, share) = if at < 1.0 { (0, at) } else { (1, at - 1.0) };
    let mix = |i: usize| (stops[low][i] + share * (stops[low + 1][i] - stops[low][i])) as u8;
    [mix(0), mix(1), mix(2), 255]
}

fn shape(name: &str, mesh: &Mesh, colors: &[[u8; 4]]) -> serde_json::Value {
    let positions = local_positions(mesh);
    json!({
        "name": name,
        "positions": base64(bytemuck::cast_slice(&positions)),
        "faces": base64(bytemuck::cast_slice(mesh.faces())),
        "colors": base64(bytemuck::cast_slice(colors)),
    })
}

/// Positions relative to the middle of the bounding box: single precision is for the shape alone, not for where it is.
fn local_positions(mesh: &Mesh) -> Vec<[f32; 3]> {
    let range = |axis: usize| {
        let coordinates = mesh.vertices().iter().map(|p| p[axis]);
        coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let middle = [0, 1, 2].map(|axis| 0.5 * range(axis).0 + 0.5 * range(axis).1);
    mesh.vertices().iter().map(|p| vec3::sub(*p, middle).map(|x| x as f32)).collect()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// Standard base64 with padding (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word =
            chunk.iter().enumerate().fold(0u32, |word, (i, &byte)| word | u32::from(byte) << (16 - 8 * i));
        for i in 0..4 {
            let used = i <= chunk.len();
            text.push(if used { ALPHABET[(word >> (18 - 6 * i) & 63) as usize] as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    #[test]
    fn base64_of_the_rfc() {
        for (plain, encoded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), encoded);
        }
    }

    #[test]
    fn doubt_goes_from_grey_to_red() {
        assert_eq!(doubt_color(0.0), [225, 225, 220, 255]);
        assert_eq!(doubt_color(0.5), [250, 200, 60, 255]);
        assert_eq!(doubt_color(1.5), [200, 30, 30, 255]);
    }

    #[test]
    fn a_mesh_far_from_the_origin_keeps_its_shape() {
        let (near, at) = (icosphere(1), [512_345.678, 5_412_345.678, 123.0]);
        let vertices = near.vertices().iter().map(|p| vec3::add(*p, at)).collect();
        let far = Mesh::new(vertices, near.faces().to_vec()).unwrap();
        let (near, far) = (local_positions(&near), local_positions(&far));
        let pairs = near.as_flattened().iter().zip(far.as_flattened());
        pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-6, "{a} {b}"));
    }

    #[test]
    fn the_page_is_complete_and_names_cannot_break_it() {
        let mesh = icosphere(1);
        let n = mesh.n_vertices();
        let map = PointMap::new((0..n as u32).collect(), n);
        let page = viewer_html(&ViewerPair {
            title: "a <b> & c",
            name_source: "</script>",
            name_target: "target",
            source: &mesh,
            target: &mesh,
            map: &map,
            caption: "",
        })
        .unwrap();
        assert!(!page.contains("__DATA__") && !page.contains("__TITLE__"));
        assert!(page.contains("<title>a &lt;b> &amp; c</title>"));
        assert_eq!(page.matches("</script>").count(), 1);
        assert!(!page.contains("http://") && !page.contains("https://"));
    }
}
