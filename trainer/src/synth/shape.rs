//! Body shape: how one individual differs from its species, in the lengths and girths of bones and in its flesh.

use rand::Rng;
use rayon::prelude::*;

use fmnet::mesh::vec3;

use super::math::Vec3;
use super::random::normal;
use super::recipe::{Feature, FeatureKind, Recipe};

/// An individual's body: what its template is scaled and displaced by.
#[derive(Clone, Debug)]
pub(super) struct BodyShape {
    /// Scale of every bone along itself, sideways and in depth.
    pub(super) scales: Vec<Vec3>,
    /// Displacement at the centre of every feature, as a share of the feature's radius.
    pub(super) flesh: Vec<f64>,
    /// Size of the whole.
    pub(super) size: f64,
}

impl BodyShape {
    /// The typical individual of a species.
    pub(super) fn typical(recipe: &Recipe) -> Self {
        let scales = recipe.magnified.iter().map(|m| [1.0 / m; 3]).collect();
        Self { scales, flesh: vec![0.0; recipe.features.len()], size: 1.0 }
    }

    /// A random individual: weight and muscles change girths together, limbs of both sides have almost the same
    /// length, and every bone has a little variation of its own, unless both sides are `symmetric`.
    pub(super) fn random(recipe: &Recipe, symmetric: bool, rng: &mut impl Rng) -> Self {
        let mut shape = Self::typical(recipe);
        let (weight, muscle) = (normal(rng, 0.0, 1.0), normal(rng, 0.0, 1.0));
        shape.size = normal(rng, 0.0, 0.05).exp();
        // Left and right bones share the draw of their common name.
        let mut drawn: Vec<(String, [f64; 3])> = Vec::new();
        for (bone, scale) in recipe.skeleton.bones.iter().zip(&mut shape.scales) {
            let name = bone.name.trim_end_matches("_left").trim_end_matches("_right");
            if !drawn.iter().any(|(known, _)| known == name) {
                let rigid = matches!(name, "head" | "fingers" | "thumb" | "toes" | "fore_toes" | "hind_toes");
                let spread = if rigid { 0.03 } else { 0.045 };
                let build = if rigid { 0.01 * weight } else { 0.04 * weight + 0.015 * muscle };
                let own = [normal(rng, 0.0, spread), normal(rng, build, spread), normal(rng, build, spread)];
                drawn.push((name.to_owned(), own));
            }
            let own = drawn.iter().find(|(known, _)| known == name).map_or([0.0; 3], |(_, own)| *own);
            for axis in 0..3 {
                scale[axis] *= (own[axis] + if symmetric { 0.0 } else { normal(rng, 0.0, 0.006) }).exp();
            }
        }
        let mut common: Vec<(FeatureKind, f64)> = Vec::new();
        for (feature, flesh) in recipe.features.iter().zip(&mut shape.flesh) {
            let kind = feature.kind;
            if !common.iter().any(|(known, _)| *known == kind) {
                common.push((kind, normal(rng, 0.0, 0.05)));
            }
            let own = common.iter().find(|(known, _)| *known == kind).map_or(0.0, |(_, own)| *own);
            let driven = match kind {
                FeatureKind::Belly => 0.12 * weight,
                FeatureKind::Hips | FeatureKind::Chest => 0.06 * weight,
                FeatureKind::Muscle => 0.06 * muscle,
                FeatureKind::Face => 0.0,
            };
            let own = own + if symmetric { 0.0 } else { normal(rng, 0.0, 0.025) };
            *flesh = (driven + own).clamp(-0.2, 0.35);
        }
        shape
    }
}

/// Where a feature acts: `(vertex, share)` of its displacement, for skin that is near and faces its direction.
pub(super) fn reach_of(feature: &Feature, points: &[Vec3], normals: &[Vec3]) -> Vec<(u32, f32)> {
    let share = |i: usize| {
        let distance = vec3::distance(points[i], feature.center) / feature.radius;
        let facing = vec3::dot(normals[i], feature.direction).max(0.0);
        (-distance * distance).exp() * facing.sqrt()
    };
    let near = |&i: &usize| vec3::distance(points[i], feature.center) < 2.2 * feature.radius;
    let shares = (0..points.len()).into_par_iter().filter(near).map(|i| (i as u32, share(i) as f32));
    shares.filter(|(_, share)| *share > 0.004).collect()
}
