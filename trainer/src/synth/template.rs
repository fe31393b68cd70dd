//! The template of a breed: its surface at rest, finely triangulated, and all that makes individuals of it.

use fmnet::Mesh;
use fmnet::mesh::vec3;
use rand::Rng;

use super::collision::Proxies;
use super::math::{Quat, Vec3};
use super::random::{Purpose, generator, uniform};
use super::recipe::Recipe;
use super::shape::{BodyShape, reach_of};
use super::skinning::{Influences, pose_skin, scale_bones, scaled_joints};
use super::species::Species;
use super::surface::Surface;

/// Proportions tried before a body that is no sphere is taken as it is.
const BREED_TRIALS: u8 = 12;
/// Poses tried before the one with the least self-penetration is taken.
const POSE_TRIALS: usize = 24;
/// Self-penetration, relative to the thinner limb's radius, that a pose may have.
const PENETRATION: f64 = 0.4;
/// Angle from rest, in radians, that clothes leave to the bones they bind.
const FREE: f64 = 0.7;

/// The body that individuals of one breed of a species are made from. Building one takes about a second, an individual
/// less; so build it once for several individuals.
pub struct Template {
    pub(super) species: Species,
    pub(super) recipe: Recipe,
    /// Surface as polygonised, fine detail enlarged.
    pub(super) points: Vec<Vec3>,
    normals: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) influences: Vec<Influences>,
    reaches: Vec<Vec<(u32, f32)>>,
    proxies: Proxies,
    /// The typical individual at rest.
    pub(super) rest: Vec<Vec3>,
    /// Of every landmark of the family its vertex, or [`UNMATCHED`] where the breed does not have it.
    pub(super) landmarks: Vec<u32>,
}

impl Template {
    /// Builds the template of a breed: breed 0 has the typical proportions of the species, others differ from it.
    pub fn new(species: Species, breed: u64) -> Self {
        let (recipe, mut surface) = sound_body(species, breed);
        let places = species.family().landmarks().on(&recipe.parts, recipe.scale);
        let landmarks = surface.snap_to(&places);
        let Surface { points, faces, twins, influences, .. } = surface;
        let mut normals = vertex_normals(&points, &faces);
        for (i, &twin) in twins.iter().enumerate() {
            if recipe.symmetry.holds(points[i]) {
                normals[twin as usize] = recipe.symmetry.image(normals[i]);
            }
        }
        let typical = BodyShape::typical(&recipe);
        let rest = scale_bones(&recipe.skeleton, &influences, &points, &typical.scales);
        let reaches = recipe.features.iter().map(|feature| reach_of(feature, &points, &normals)).collect();
        let proxies = Proxies::new(&recipe, &typical);
        Self { species, recipe, points, normals, faces, influences, reaches, proxies, rest, landmarks }
    }

    /// The species it is the template of.
    pub fn species(&self) -> Species {
        self.species
    }

    /// Number of landmarks: points that the bodies of all species of the family have in common.
    pub fn n_landmarks(&self) -> usize {
        self.landmarks.len()
    }

    /// The typical individual at rest, in metres, as finely triangulated as the template itself.
    pub fn rest_mesh(&self) -> Mesh {
        Mesh::new(self.rest.clone(), self.faces.clone()).expect("a template's faces name its own vertices")
    }

    /// The dense surface of the individual with the given seed, in its own pose; it stands on y = 0.
    pub(super) fn individual(&self, seed: u64) -> Vec<Vec3> {
        let mut points = self.unturned(seed);
        let mut rng = generator(self.species.index(), seed, Purpose::Heading);
        let heading = Quat::y(uniform(&mut rng, 0.0, 360.0));
        points.iter_mut().for_each(|p| *p = heading.rotate(*p));
        let ground = points.iter().fold(f64::MAX, |low, p| low.min(p[1]));
        points.iter_mut().for_each(|p| p[1] -= ground);
        points
    }

    /// [`Template::individual`] before it is turned and put on the ground: one at rest may be its own mirror image.
    pub(super) fn unturned(&self, seed: u64) -> Vec<Vec3> {
        let stance = Stance::of(self.species, seed);
        let mut rng = generator(self.species.index(), seed, Purpose::Shape);
        let shape = BodyShape::random(&self.recipe, stance == Stance::Symmetric, &mut rng);
        let rotations = self.pose(seed, stance, &shape);
        let skeleton = &self.recipe.skeleton;
        let skin = scale_bones(skeleton, &self.influences, &self.fleshed(&shape), &shape.scales);
        let joints = scaled_joints(skeleton, &shape.scales);
        let mut posed = pose_skin(skeleton, &self.influences, &skin, &joints, &rotations);
        posed.iter_mut().for_each(|p| *p = vec3::scale(*p, shape.size));
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

    /// A rest pose, or a random one in which the body hardly penetrates itself.
    fn pose(&self, seed: u64, stance: Stance, shape: &BodyShape) -> Vec<Quat> {
        let mut rng = generator(self.species.index(), seed, Purpose::Pose);
        let (plan, skeleton) = (self.species.family().plan(), &self.recipe.skeleton);
        let mut best = (f64::INFINITY, Vec::new());
        for _ in 0..POSE_TRIALS {
            let rotations = if stance == Stance::Posed {
                (plan.pose)(skeleton, &mut rng)
            } else {
                (plan.rest)(skeleton, &mut rng)
            };
            let strain = self.recipe.bound.iter().map(|&bone| (rotations[bone].angle() - FREE).max(0.0));
            let fault = self.proxies.penetration(skeleton, shape, &rotations) + 2.0 * strain.sum::<f64>();
            if fault < best.0 {
                best = (fault, rotations);
            }
            if best.0 < PENETRATION {
                break;
            }
        }
        best.1
    }
}

/// A breed's body without handles and loose pieces, which some proportions give; they are drawn anew then.
fn sound_body(species: Species, breed: u64) -> (Recipe, Surface) {
    let mut trial = 0;
    loop {
        let recipe = species.recipe(breed, trial);
        let surface = Surface::of(&recipe);
        trial += 1;
        if trial == BREED_TRIALS || surface.is_sphere() {
            return (recipe, surface);
        }
    }
}

/// How an individual stands. Nearly symmetric bodies at rest are where left and right are hardest to tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stance {
    /// In a random pose.
    Posed,
    /// In a rest pose.
    Resting,
    /// In a rest pose, and its own mirror image.
    Symmetric,
}

impl Stance {
    /// Of every eight individuals one rests and one is symmetric.
    pub(super) fn of(species: Species, seed: u64) -> Self {
        match generator(species.index(), seed, Purpose::Stance).random_range(0..8) {
            0 => Self::Resting,
            1 => Self::Symmetric,
            _ => Self::Posed,
        }
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
