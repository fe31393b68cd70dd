//! The correspondences of a family: landmarks of its base body, found again on the body of every breed.

use rayon::prelude::*;

use fmnet::mesh::vec3;

use super::carry::Carriers;
use super::implicit::{Part, field};
use super::math::{Vec3, perpendicular, unit};
use super::mirror::Symmetry;
use super::recipe::Recipe;

/// Newton steps that bring a carried point onto the surface.
const STEPS: usize = 14;
/// Cosine between the normal that a landmark is carried with and the one it finds, below which it is covered by
/// something else.
const AGREEMENT: f64 = 0.35;
/// Two landmarks closer than this share of their distance on the base have run into one place.
const CROWDED: f64 = 0.2;

/// Points of a body's modelled side, each with its unit normal, and the solids they go with.
pub(super) struct Landmarks {
    parts: Vec<Part>,
    pub(super) points: Vec<Vec3>,
    normals: Vec<Vec3>,
    carriers: Vec<Carriers>,
    /// Of every landmark the nearest other one, and how far it is.
    nearest: Vec<(u32, f64)>,
    cell: f64,
    symmetry: Symmetry,
}

impl Landmarks {
    /// Landmarks at `points` on the surface of the base body.
    pub(super) fn new(base: &Recipe, points: Vec<Vec3>, normals: Vec<Vec3>) -> Self {
        let (parts, cell, symmetry) = (base.parts.clone(), base.cell, base.symmetry);
        let carriers = points.par_iter().map(|&p| Carriers::of(&parts, p, 1.5 * cell)).collect();
        let distance = |i: usize, j: usize| vec3::distance(points[i], points[j]);
        let others = |i: usize| (0..points.len()).filter(move |&j| j != i);
        let nearest = (0..points.len()).into_par_iter().map(|i| {
            let nearest = others(i).min_by(|&a, &b| distance(i, a).total_cmp(&distance(i, b)));
            nearest.map_or((i as u32, 0.0), |j| (j as u32, distance(i, j)))
        });
        let nearest = nearest.collect();
        Self { parts, points, normals, carriers, nearest, cell, symmetry }
    }

    /// Where the landmarks are on the surface of `parts`, whose first ones are those of the base body in other
    /// proportions: `None` where another part covers them.
    ///
    /// Each landmark goes with the solids it is on, then straight to the surface. It is lost where the surface there
    /// looks elsewhere, or where it runs into its neighbour.
    pub(super) fn on(&self, parts: &[Part], scale: f64) -> Vec<Option<Vec3>> {
        let cell = scale * self.cell;
        let found: Vec<Option<Vec3>> = (0..self.points.len())
            .into_par_iter()
            .map(|i| {
                let carry = |p: Vec3| self.carriers[i].carry(&self.parts, parts, p);
                let (p, normal) = (self.points[i], self.normals[i]);
                let depth = perpendicular(
                    normal,
                    if normal[2].abs() < 0.8 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] },
                );
                let place = carry(p);
                let tangent =
                    |along: Vec3| vec3::sub(carry(vec3::add(p, vec3::scale(along, 0.2 * self.cell))), place);
                let carried = vec3::cross(tangent(vec3::cross(depth, normal)), tangent(depth));
                settle(parts, self.symmetry, place, cell)
                    .filter(|&(_, found)| vec3::dot(unit(carried), found) > AGREEMENT)
                    .map(|(q, _)| q)
            })
            .collect();
        let crowded = |i: usize, q: Vec3| {
            let (j, before) = self.nearest[i];
            found[j as usize].is_some_and(|other| vec3::distance(q, other) < CROWDED * scale * before)
        };
        found.iter().enumerate().map(|(i, q)| q.filter(|&q| !crowded(i, q))).collect()
    }
}

/// The point of the surface that is found straight from `p`, and the unit normal there.
fn settle(parts: &[Part], symmetry: Symmetry, mut p: Vec3, cell: f64) -> Option<(Vec3, Vec3)> {
    let reach = 8.0 * cell;
    let near: Vec<&Part> =
        parts.iter().filter(|part| !part.is_beyond(symmetry.folded(p), 3.0 * reach + part.blend)).collect();
    let value = |p: Vec3| field(near.iter().copied(), symmetry.folded(p));
    let delta = 0.05 * cell;
    let mut gradient = [0.0; 3];
    for _ in 0..STEPS {
        let here = value(p);
        gradient = std::array::from_fn(|axis| {
            let mut q = p;
            q[axis] += delta;
            (value(q) - here) / delta
        });
        let step = (here / vec3::dot(gradient, gradient).max(0.05)).clamp(-1.5 * cell, 1.5 * cell);
        p = vec3::sub(p, vec3::scale(gradient, step));
    }
    (value(p).abs() < 0.1 * cell).then(|| (p, unit(gradient)))
}
