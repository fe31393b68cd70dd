//! Both shapes of a pair in one mesh, side by side, coloured by the map.

use super::error::{RenderError, check_map};
use super::facing::facing_alike;
use super::{map_colors, position_colors};
use crate::Mesh;
use crate::io::Attributes;
use crate::point_map::PointMap;

/// The source to the left of the target, brought to the same size, matches in the same colour.
///
/// Vertices and faces of the source come first, each shape with a largest extent of 1. The target is turned by quarter
/// turns about the axes where its matches face another way otherwise.
///
/// # Errors
/// If the map is not one of these meshes, a coordinate overflows, or both together have more vertices than 32-bit
/// indices can name.
pub fn side_by_side(source: &Mesh, target: &Mesh, map: &PointMap) -> Result<(Mesh, Attributes), RenderError> {
    check_map(map, source, target)?;
    beside(source, &facing_alike(source, target, map)?, map)
}

/// [`side_by_side`], each shape as it is turned.
pub(super) fn beside(
    source: &Mesh,
    target: &Mesh,
    map: &PointMap,
) -> Result<(Mesh, Attributes), RenderError> {
    let colors_target = position_colors(target);
    let mut colors = map_colors(map, &colors_target);
    colors.extend(colors_target);
    let (mut vertices, right) = (placed(source, -0.65), placed(target, 0.65));
    let offset = vertices.len() as u32;
    vertices.extend(right);
    let mut faces = source.faces().to_vec();
    faces.extend(target.faces().iter().map(|f| f.map(|i| i + offset)));
    let attributes = Attributes { vertex_colors: Some(colors), ..Attributes::default() };
    Ok((Mesh::new(vertices, faces)?, attributes))
}

/// The vertices centred on the given place of the x axis, their largest extent 1.
fn placed(mesh: &Mesh, x: f64) -> Vec<[f64; 3]> {
    let range = |axis: usize| {
        let coordinates = mesh.vertices().iter().map(|p| p[axis]);
        coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)))
    };
    let ranges = [range(0), range(1), range(2)];
    let extent = ranges.iter().map(|(low, high)| high - low).fold(f64::MIN_POSITIVE, f64::max);
    let center = ranges.map(|(low, high)| 0.5 * (low + high));
    let place = |p: &[f64; 3]| {
        let moved = [0, 1, 2].map(|i| (p[i] - center[i]) / extent);
        [moved[0] + x, moved[1], moved[2]]
    };
    mesh.vertices().iter().map(place).collect()
}
