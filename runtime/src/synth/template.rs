//! The template of a species: its surface at rest, finely triangulated, and all that makes individuals of it.

use crate::Mesh;
use crate::mesh::vec3;

use super::adjacency::Adjacency;
use super::collision::Proxies;
use super::math::{Quat, Vec3};
use super::polygonize::polygonize;
use super::random::{Purpose, generator, permutation, uniform};
use super::recipe::Recipe;
use super::shape::{BodyShape, reach_of};
use super::skinning::{Influences, diffused_weights, pose_skin, scale_bones, scaled_joints};
use super::species::Species;
use super::{gait, pose};

/// Landmarks aimed at; the exact number depends on the species.
const LANDMARKS: f64 = 3000.0;
/// Poses tried before the one with the least self-penetration is taken.
const POSE_TRIALS: usize = 24;
/// Self-penetration, relative to the thinner limb's radius, that a pose may have.
const PENETRATION: f64 = 0.4;

/// The body all individuals of a species are made from. Building one takes some tenths of a second, an individual
/// less; so build it once for many individuals.
pub struct Template {
    pub(super) species: Species,
    pub(super) recipe: Recipe,
    /// Surface as polygonised, fine detail enlarged.
    pub(super) points: Vec<Vec3>,
    normals: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) neighbors: Adjacency,
    pub(super) influences: Vec<Influences>,
    reaches: Vec<Vec<(u32, f32)>>,
    proxies: Proxies,
    /// The typical individual at rest: where distances between points of the species are measured.
    pub(super) rest: Vec<Vec3>,
    pub(super) landmarks: Vec<u32>,
}

impl Template {
    /// Builds the template of a species.
    pub fn new(species: Species) -> Self {
        let recipe = species.recipe();
        let surface = polygonize(&recipe.parts, recipe.cell);
        let nearest_part = |i: usize| {
            let p = surface.vertices[i];
            let parts =
                surface.active[surface.block_of[i] as usize].iter().map(|&part| &recipe.parts[part as usize]);
            parts
                .filter(|part| !part.carve)
                .min_by(|a, b| a.solid.distance(p).total_cmp(&b.solid.distance(p)))
        };
        let bone_of: Vec<u8> = (0..surface.vertices.len())
            .map(|i| {
                nearest_part(i)
                    .map_or(0, |part| recipe.skeleton.nearest(&part.bones, surface.vertices[i]) as u8)
            })
            .collect();
        let (points, faces) = (surface.vertices, surface.faces);
        let normals = vertex_normals(&points, &faces);
        let neighbors = Adjacency::new(points.len(), &faces);
        let influences = diffused_weights(&recipe.skeleton, &bone_of, &neighbors);
        let typical = BodyShape::typical(&recipe);
        let rest = scale_bones(&recipe.skeleton, &influences, &points, &typical.scales);
        let rest_normals = vertex_normals(&rest, &faces);
        let landmarks = landmarks(species, &rest, &rest_normals, &faces);
        let reaches = recipe.features.iter().map(|feature| reach_of(feature, &points, &normals)).collect();
        let proxies = Proxies::new(&recipe, &typical);
        Self {
            species,
            recipe,
            points,
            normals,
            faces,
            neighbors,
            influences,
            reaches,
            proxies,
            rest,
            landmarks,
        }
    }

    /// The species it is the template of.
    pub fn species(&self) -> Species {
        self.species
    }

    /// Number of landmarks: points of the species that every undamaged individual has a vertex at.
    pub fn n_landmarks(&self) -> usize {
        self.landmarks.len()
    }

    /// The typical individual at rest, in metres, as finely triangulated as the template itself.
    pub fn rest_mesh(&self) -> Mesh {
        Mesh::new(self.rest.clone(), self.faces.clone()).expect("a template's faces name its own vertices")
    }

    /// The dense surface of the individual with the given seed, in its own pose; it stands on y = 0.
    pub(super) fn individual(&self, seed: u64) -> Vec<Vec3> {
        let mut rng = generator(self.species.index(), seed, Purpose::Shape);
        let shape = BodyShape::random(&self.recipe, &mut rng);
        let rotations = self.pose(seed, &shape);
        let skeleton = &self.recipe.skeleton;
        let skin = scale_bones(skeleton, &self.influences, &self.fleshed(&shape), &shape.scales);
        let joints = scaled_joints(skeleton, &shape.scales);
        let mut posed = pose_skin(skeleton, &self.influences, &skin, &joints, &rotations);
        let mut rng = generator(self.species.index(), seed, Purpose::Heading);
        let heading = Quat::y(uniform(&mut rng, 0.0, 360.0));
        posed.iter_mut().for_each(|p| *p = vec3::scale(heading.rotate(*p), shape.size));
        let ground = posed.iter().fold(f64::MAX, |low, p| low.min(p[1]));
        posed.iter_mut().for_each(|p| p[1] -= ground);
        posed
    }

    /// The template with the flesh of an individual added along the features' directions.
    fn fleshed(&self, shape: &BodyShape) -> Vec<Vec3> {
        let mut points = self.points.clone();
        for ((feature, reach), &flesh) in self.recipe.features.iter().zip(&self.reaches).zip(&shape.flesh) {
            for &(i, share) in reach {
                let along = vec3::add(feature.direction, self.normals[i as usize]);
                let step = 0.5 * flesh * feature.radius * f64::from(share);
                points[i as usize] = vec3::add(points[i as usize], vec3::scale(along, step));
            }
        }
        points
    }

    /// A random pose in which the body hardly penetrates itself.
    fn pose(&self, seed: u64, shape: &BodyShape) -> Vec<Quat> {
        let mut rng = generator(self.species.index(), seed, Purpose::Pose);
        let mut best = (f64::INFINITY, Vec::new());
        for _ in 0..POSE_TRIALS {
            let rotations = if self.species.is_biped() {
                pose::random_biped(&self.recipe.skeleton, &mut rng)
            } else {
                gait::random_quadruped(&mut rng)
            };
            let penetration = self.proxies.penetration(&self.recipe.skeleton, shape, &rotations);
            if penetration < best.0 {
                best = (penetration, rotations);
            }
            if best.0 < PENETRATION {
                break;
            }
        }
        best.1
    }
}

/// Unit vertex normals, weighted by area.
pub(super) fn vertex_normals(points: &[Vec3], faces: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![[0.0; 3]; points.len()];
    for face in faces {
        let [a, b, c] = face.map(|i| points[i as usize]);
        let normal = vec3::cross(vec3::sub(b, a), vec3::sub(c, a));
        for &i in face {
            normals[i as usize] = vec3::add(normals[i as usize], normal);
        }
    }
    normals.into_iter().map(super::math::unit).collect()
}

/// Vertices spread evenly over the body at rest: random ones, none nearer to another than a fixed distance, or half
/// of it where the two look in opposite directions (as on both sides of a finger).
fn landmarks(species: Species, rest: &[Vec3], normals: &[Vec3], faces: &[[u32; 3]]) -> Vec<u32> {
    let area: f64 = faces
        .iter()
        .map(|face| {
            let [a, b, c] = face.map(|i| rest[i as usize]);
            0.5 * vec3::norm(vec3::cross(vec3::sub(b, a), vec3::sub(c, a)))
        })
        .sum();
    // Dart throwing packs about 0.7 points per squared radius.
    let radius = (0.7 * area / LANDMARKS).sqrt();
    let cell_of = |p: Vec3| p.map(|x| (x / radius).floor() as i64);
    let mut grid: std::collections::HashMap<[i64; 3], Vec<u32>> = std::collections::HashMap::new();
    let mut rng = generator(species.index(), 0, Purpose::Landmarks);
    let mut chosen = Vec::new();
    for i in permutation(&mut rng, rest.len()) {
        let (p, normal) = (rest[i as usize], normals[i as usize]);
        let [x, y, z] = cell_of(p);
        let clash = |&j: &u32| {
            let (q, other) = (rest[j as usize], normals[j as usize]);
            let limit = if vec3::dot(normal, other) > 0.0 { radius } else { 0.5 * radius };
            vec3::distance(p, q) < limit
        };
        let around = (0..27).map(|c| [x + c % 3 - 1, y + (c / 3) % 3 - 1, z + c / 9 - 1]);
        if !around.into_iter().any(|cell| grid.get(&cell).is_some_and(|list| list.iter().any(clash))) {
            grid.entry([x, y, z]).or_default().push(i);
            chosen.push(i);
        }
    }
    chosen
}
