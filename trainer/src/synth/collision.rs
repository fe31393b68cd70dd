//! Whether a pose makes the body penetrate itself, judged by spheres inside its limbs.

use fmnet::mesh::vec3;

use super::implicit::Solid;
use super::math::{Quat, Vec3, lerp};
use super::recipe::Recipe;
use super::shape::BodyShape;
use super::skeleton::Skeleton;
use super::skinning::{scale_about, scaled_joints};

/// Spheres along the solids of a body, each moved by one bone.
pub(super) struct Proxies {
    spheres: Vec<Sphere>,
    /// Pairs apart at rest: only these can collide.
    pairs: Vec<(u16, u16)>,
}

struct Sphere {
    bone: usize,
    center: Vec3,
    /// Radius of the typical individual.
    radius: f64,
}

impl Proxies {
    pub(super) fn new(recipe: &Recipe, typical: &BodyShape) -> Self {
        let mut spheres = Vec::new();
        for part in recipe.parts.iter().filter(|part| !part.carve) {
            let mut add = |center: Vec3, radius: f64| {
                let bone = recipe.skeleton.nearest(&part.bones, center);
                spheres.push(Sphere { bone, center, radius: radius / recipe.magnified[bone] });
            };
            match part.solid {
                Solid::Tube(ref loft) => {
                    for station in &loft.stations {
                        add(station.center, station.side.min(station.front).min(station.back));
                    }
                }
                Solid::Spindle { a, b, ra, rb, flatten, .. } => {
                    for t in [0.0, 0.33, 0.67, 1.0] {
                        add(lerp(a, b, t), (ra + t * (rb - ra)) * flatten.min(1.0));
                    }
                }
                Solid::Ellipsoid { center, radii, .. } => {
                    add(center, radii.iter().fold(f64::MAX, |least, &r| least.min(r)));
                }
            }
        }
        let largest = spheres.iter().fold(0.0, |most: f64, sphere| most.max(sphere.radius));
        spheres.retain(|sphere| sphere.radius > 0.06 * largest);
        let mut proxies = Self { spheres, pairs: Vec::new() };
        let rest = proxies.places(&recipe.skeleton, typical, &vec![Quat::IDENTITY; recipe.skeleton.len()]);
        for i in 0..rest.len() {
            for j in 0..i {
                let sum = proxies.spheres[i].radius + proxies.spheres[j].radius;
                let moves = proxies.spheres[i].bone != proxies.spheres[j].bone;
                if moves && vec3::distance(rest[i], rest[j]) > 1.25 * sum {
                    proxies.pairs.push((i as u16, j as u16));
                }
            }
        }
        proxies
    }

    /// The deepest penetration between two spheres in a pose, relative to the smaller radius.
    pub(super) fn penetration(&self, skeleton: &Skeleton, shape: &BodyShape, rotations: &[Quat]) -> f64 {
        let places = self.places(skeleton, shape, rotations);
        let depth = |&(i, j): &(u16, u16)| {
            let (i, j) = (i as usize, j as usize);
            let (a, b) = (self.spheres[i].radius, self.spheres[j].radius);
            (a + b - vec3::distance(places[i], places[j])) / a.min(b)
        };
        self.pairs.iter().map(depth).fold(0.0, f64::max)
    }

    fn places(&self, skeleton: &Skeleton, shape: &BodyShape, rotations: &[Quat]) -> Vec<Vec3> {
        let joints = scaled_joints(skeleton, &shape.scales);
        let motions = skeleton.motions(&joints, rotations);
        let place = |sphere: &Sphere| {
            let b = sphere.bone;
            motions[b].apply(scale_about(skeleton, b, joints[b], shape.scales[b], sphere.center))
        };
        self.spheres.iter().map(place).collect()
    }
}
