//! The finely triangulated surface of a recipe, with its skin weights, and the landmarks of a family.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use fmnet::mesh::{nearest_k_vertices, vec3};

use super::UNMATCHED;
use super::adjacency::{Adjacency, components};
use super::correspond::Landmarks;
use super::math::Vec3;
use super::mirror::{Symmetry, opposite_bones};
use super::polygonize::polygonize;
use super::random::permutation;
use super::recipe::Recipe;
use super::shape::BodyShape;
use super::skinning::{Influences, diffused_weights, scale_bones};
use super::template::vertex_normals;
use rand::Rng;

/// Landmarks aimed at, on both sides together.
const LANDMARKS: f64 = 3000.0;

/// A closed surface, fine detail enlarged.
pub(super) struct Surface {
    pub(super) points: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Of every vertex the one at its image.
    pub(super) twins: Vec<u32>,
    symmetry: Symmetry,
    pub(super) influences: Vec<Influences>,
}

impl Surface {
    pub(super) fn of(recipe: &Recipe) -> Self {
        let symmetry = recipe.symmetry;
        let surface = polygonize(&recipe.parts, recipe.cell, symmetry);
        let (points, faces, twins) = (surface.vertices, surface.faces, surface.twins);
        let bone = |i: usize| {
            // Blocks on the right name the parts of the left, which the body there is the image of.
            let p = symmetry.folded(points[i]);
            let active = &surface.active[surface.block_of[i] as usize];
            let solids = active.iter().map(|&part| &recipe.parts[part as usize]).filter(|part| !part.carve);
            let nearest = solids.min_by(|a, b| a.solid.distance(p).total_cmp(&b.solid.distance(p)));
            nearest.map_or(0, |part| recipe.skeleton.nearest(&part.bones, p))
        };
        let bones: Vec<usize> = (0..points.len()).into_par_iter().map(bone).collect();
        let opposite = opposite_bones(&recipe.skeleton);
        let of_side = |(i, bone): (usize, usize)| {
            (if symmetry.folded(points[i]) != points[i] { opposite[bone] } else { bone }) as u8
        };
        let bone_of: Vec<u8> = bones.into_iter().enumerate().map(of_side).collect();
        let mut influences =
            diffused_weights(&recipe.skeleton, &bone_of, &Adjacency::new(points.len(), &faces));
        for i in (0..points.len()).filter(|&i| symmetry.holds(points[i])) {
            let mut image = influences[i];
            image.bones.iter_mut().for_each(|bone| *bone = opposite[*bone as usize] as u8);
            influences[twins[i] as usize] = image;
        }
        Self { points, faces, twins, symmetry, influences }
    }

    /// Whether it is one closed piece without handles.
    pub(super) fn is_sphere(&self) -> bool {
        let pieces = components(self.points.len(), &self.faces);
        self.points.len() == self.faces.len() / 2 + 2 && pieces.iter().all(|&piece| piece == 0)
    }

    /// Moves a vertex to each place of the modelled side, and its twin to the image: the vertices of each place, or
    /// [`UNMATCHED`].
    pub(super) fn snap_to(&mut self, places: &[Option<Vec3>]) -> Vec<u32> {
        let known: Vec<Vec3> = places.iter().flatten().copied().collect();
        let nearest = nearest_k_vertices(&self.points, &known, 8);
        let mut taken = HashSet::new();
        let mut candidates = nearest.chunks(8).zip(&known).map(|(near, &place)| {
            let free = |&&i: &&u32| self.symmetry.holds(self.points[i as usize]) && taken.insert(i);
            let chosen = near.iter().find(free).copied();
            (chosen.unwrap_or(UNMATCHED), place)
        });
        let mut chosen = Vec::with_capacity(2 * places.len());
        for place in places {
            let found = place.and_then(|_| candidates.next()).filter(|&(i, _)| i != UNMATCHED);
            chosen.push(found);
        }
        let mut landmarks = Vec::with_capacity(2 * places.len());
        for found in chosen {
            let Some((i, place)) = found else {
                landmarks.extend(self.symmetry.both(UNMATCHED, UNMATCHED));
                continue;
            };
            let twin = self.twins[i as usize];
            self.points[i as usize] = place;
            self.points[twin as usize] = self.symmetry.image(place);
            landmarks.extend(self.symmetry.both(i, twin));
        }
        landmarks
    }

    /// Landmarks spread evenly over the typical body: random vertices of the modelled side, none nearer to another or
    /// to its image than a fixed distance, or half of it where the two look in opposite directions (as on both sides
    /// of a finger).
    pub(super) fn landmarks(&self, recipe: &Recipe, rng: &mut impl Rng) -> Landmarks {
        let typical = BodyShape::typical(recipe);
        let rest = scale_bones(&recipe.skeleton, &self.influences, &self.points, &typical.scales);
        let rest_normals = vertex_normals(&rest, &self.faces);
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|i| rest[i as usize]);
            0.5 * vec3::norm(vec3::cross(vec3::sub(b, a), vec3::sub(c, a)))
        };
        // Dart throwing packs about 0.7 points per squared radius.
        let radius = (0.7 * self.faces.iter().map(area).sum::<f64>() / LANDMARKS).sqrt();
        let cell_of = |p: Vec3| p.map(|x| (x / radius).floor() as i64);
        let mut grid: HashMap<[i64; 3], Vec<(Vec3, Vec3)>> = HashMap::new();
        let mut chosen = Vec::new();
        for i in permutation(rng, rest.len()) {
            let (p, normal) = (rest[i as usize], rest_normals[i as usize]);
            let image = self.symmetry.image(p);
            if !self.symmetry.holds(p) || (image != p && vec3::distance(p, image) < 0.5 * radius) {
                continue;
            }
            let [x, y, z] = cell_of(p);
            let clash = |&(q, other): &(Vec3, Vec3)| {
                let limit = if vec3::dot(normal, other) > 0.0 { radius } else { 0.5 * radius };
                vec3::distance(p, q) < limit
            };
            let around = (0..27).map(|c| [x + c % 3 - 1, y + (c / 3) % 3 - 1, z + c / 9 - 1]);
            if !around.into_iter().any(|cell| grid.get(&cell).is_some_and(|list| list.iter().any(clash))) {
                let other = (image, self.symmetry.image(normal));
                for (p, normal) in self.symmetry.both((p, normal), other) {
                    grid.entry(cell_of(p)).or_default().push((p, normal));
                }
                chosen.push(i as usize);
            }
        }
        let normals = vertex_normals(&self.points, &self.faces);
        let points = chosen.iter().map(|&i| self.points[i]).collect();
        let normals = chosen.iter().map(|&i| normals[i]).collect();
        Landmarks::new(recipe, points, normals)
    }
}
