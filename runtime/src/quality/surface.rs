//! Measures of how a map bends, stretches, tears and turns the surface.

use super::Side;
use crate::mesh::{Mesh, Topology, vec3};
use crate::point_map::PointMap;

/// An edge that becomes so many times longer is torn.
pub(super) const TORN: f64 = 5.0;

/// What the measures take of a surface: computed once for a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceFrame {
    /// Area-weighted normals of the vertices, `[n]`; zero where there is no surface.
    pub normals: Vec<[f64; 3]>,
    /// `sqrt(area)` of the mesh.
    pub unit: f64,
    /// Each edge once, as a pair of vertices, in ascending order.
    pub edges: Vec<[u32; 2]>,
}

impl SurfaceFrame {
    /// The frame of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let mut normals = vec![[0.0; 3]; mesh.n_vertices()];
        for (face, corners) in mesh.faces().iter().enumerate() {
            let cross = mesh.face_cross(face);
            for &v in corners {
                normals[v as usize] = vec3::add(normals[v as usize], cross);
            }
        }
        Self { normals, unit: mesh.scale(), edges: Topology::new(mesh).edges().to_vec() }
    }
}

pub(super) struct Surface {
    pub(super) dirichlet: f64,
    pub(super) stretched: f64,
    pub(super) reversed: f64,
    pub(super) coverage: f64,
}

pub(super) fn measure(map: &PointMap, source: Side, target: Side) -> Surface {
    let stretches: Vec<f64> =
        source.frame.edges.iter().filter_map(|edge| stretch(map, *edge, source, target)).collect();
    let torn = stretches.iter().filter(|&&stretch| stretch > TORN).count();
    let (mut reversed, mut oriented) = (0.0, 0.0);
    for face in 0..source.mesh.n_faces() {
        if let Some(keeps) = keeps_orientation(map, face, source, target) {
            let area = source.mesh.face_area(face);
            oriented += area;
            reversed += if keeps { 0.0 } else { area };
        }
    }
    let mut matched = vec![false; map.n_target];
    map.iter().flatten().for_each(|y| matched[y as usize] = true);
    let covered: f64 =
        target.basis.mass.iter().zip(&matched).map(|(area, &is)| if is { *area } else { 0.0 }).sum();
    Surface {
        dirichlet: dirichlet(map, source, target),
        stretched: torn as f64 / stretches.len().max(1) as f64,
        reversed: if oriented > 0.0 { reversed / oriented } else { 0.0 },
        coverage: covered / target.basis.area(),
    }
}

/// `sum_edges w_ij |y(T(i)) - y(T(j))|^2` with the source's cotangent weights and the target at unit area.
fn dirichlet(map: &PointMap, source: Side, target: Side) -> f64 {
    let squared = 1.0 / (target.frame.unit * target.frame.unit);
    let of_row = |i: usize| -> f64 {
        let Some(a) = map.get(i) else { return 0.0 };
        let a = target.mesh.vertices()[a as usize];
        let later = source.laplacian.stiffness.row(i).filter(|&(j, _)| j > i);
        later
            .filter_map(|(j, value)| {
                let offset = vec3::sub(a, target.mesh.vertices()[map.get(j)? as usize]);
                Some(-value * vec3::dot(offset, offset))
            })
            .sum()
    };
    (0..map.len()).map(of_row).sum::<f64>() * squared
}

/// How many times longer an edge of the source becomes, both shapes at unit area; none without matches at both ends,
/// or for an edge without length.
pub(super) fn stretch(map: &PointMap, [i, j]: [u32; 2], source: Side, target: Side) -> Option<f64> {
    let at = |side: Side, v: u32| side.mesh.vertices()[v as usize];
    let before = vec3::distance(at(source, i), at(source, j)) / source.frame.unit;
    let [a, b] = [map.get(i as usize)?, map.get(j as usize)?];
    let after = vec3::distance(at(target, a), at(target, b)) / target.frame.unit;
    (before > 0.0).then(|| after / before)
}

/// Whether a triangle of the source is the same way round on the target; none where its corners do not span a
/// triangle there.
pub(super) fn keeps_orientation(map: &PointMap, face: usize, source: Side, target: Side) -> Option<bool> {
    let mut corners = [0u32; 3];
    for (corner, &v) in corners.iter_mut().zip(&source.mesh.faces()[face]) {
        *corner = map.get(v as usize)?;
    }
    let [a, b, c] = corners.map(|y| target.mesh.vertices()[y as usize]);
    let cross = vec3::cross(vec3::sub(b, a), vec3::sub(c, a));
    let normal = corners.iter().fold([0.0; 3], |sum, &y| {
        let normal = target.frame.normals[y as usize];
        vec3::add(sum, vec3::scale(normal, 1.0 / vec3::norm(normal).max(f64::MIN_POSITIVE)))
    });
    let side = vec3::dot(cross, normal);
    // Seen nearly from the edge, or collapsed, a triangle tells nothing.
    (side.abs() > 0.1 * vec3::norm(cross) * vec3::norm(normal)).then_some(side > 0.0)
}

/// Mean over the source's area of the distance from a vertex to where it comes back to, relative to `sqrt(area)`.
pub(super) fn cycle(map: &PointMap, back: &PointMap, source: Side) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for (x, mass) in source.basis.mass.iter().enumerate() {
        if let Some(distance) = cycle_at(map, back, x, source) {
            sum += mass * distance;
            area += mass;
        }
    }
    if area > 0.0 { sum / area } else { 0.0 }
}

/// How far vertex `x` comes back from itself, relative to `sqrt(area)`.
pub(super) fn cycle_at(map: &PointMap, back: &PointMap, x: usize, source: Side) -> Option<f64> {
    let returned = back.get(map.get(x)? as usize)?;
    let vertices = source.mesh.vertices();
    Some(vec3::distance(vertices[x], vertices[returned as usize]) / source.frame.unit)
}
