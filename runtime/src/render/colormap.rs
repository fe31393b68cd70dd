//! Colours that show a map: every target vertex gets the colour of its position, every source vertex that of its match.

use crate::Mesh;
use crate::point_map::PointMap;

/// Colour of vertices without a match: grey.
pub const UNMATCHED_COLOR: [u8; 4] = [128, 128, 128, 255];

/// A colour for each vertex that varies smoothly with its position in the bounding box, `[n]` RGBA.
///
/// The longest axis runs from red over green and blue to magenta, the others shade it, so that left and right, front
/// and back differ.
pub fn position_colors(mesh: &Mesh) -> Vec<[u8; 4]> {
    let (low, high) = bounds(mesh);
    let extent: Vec<f64> = (0..3).map(|i| high[i] - low[i]).collect();
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| extent[b].total_cmp(&extent[a]));
    let unit = |p: &[f64; 3], axis: usize| {
        if extent[axis] > 0.0 { (p[axis] - low[axis]) / extent[axis] } else { 0.5 }
    };
    mesh.vertices().iter().map(|p| hue(unit(p, axes[0]), unit(p, axes[1]), unit(p, axes[2]))).collect()
}

/// The colours of the matched vertices, `[n_source]` RGBA; [`UNMATCHED_COLOR`] where there is none among
/// `colors_target`, `[n_target]`.
pub fn map_colors(map: &PointMap, colors_target: &[[u8; 4]]) -> Vec<[u8; 4]> {
    let color = |matched: Option<u32>| colors_target.get(matched? as usize).copied();
    map.iter().map(|matched| color(matched).unwrap_or(UNMATCHED_COLOR)).collect()
}

fn bounds(mesh: &Mesh) -> ([f64; 3], [f64; 3]) {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in mesh.vertices() {
        for i in 0..3 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    (low, high)
}

/// Hue by the first coordinate, from 0 to 300 degrees; saturation and lightness by the others, all in 0..1.
fn hue(first: f64, second: f64, third: f64) -> [u8; 4] {
    let saturation = 0.45 + 0.5 * third;
    let value = 0.55 + 0.43 * second;
    let sector = first * 5.0;
    let channel = |offset: f64| {
        let k = (offset + sector) % 6.0;
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    let byte = |x: f64| (x * 255.0).round().clamp(0.0, 255.0) as u8;
    [byte(channel(5.0)), byte(channel(3.0)), byte(channel(1.0)), 255]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    #[test]
    fn antipodes_differ_in_colour_and_matches_agree() {
        let mesh = icosphere(2);
        let colors = position_colors(&mesh);
        let far = |a: [u8; 4], b: [u8; 4]| a.iter().zip(b).any(|(x, y)| x.abs_diff(y) > 20);
        for (v, p) in mesh.vertices().iter().enumerate() {
            let opposite = mesh.vertices().iter().position(|q| (0..3).all(|i| (p[i] + q[i]).abs() < 1e-9));
            assert!(far(colors[v], colors[opposite.unwrap()]), "vertex {v} and its antipode look alike");
        }
        let targets = vec![5, PointMap::UNMATCHED];
        let map = PointMap::new(targets, mesh.n_vertices());
        assert_eq!(map_colors(&map, &colors), vec![colors[5], UNMATCHED_COLOR]);
    }
}
