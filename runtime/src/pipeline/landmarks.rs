//! Landmarks: matches that are given, kept exactly, and pull the rest of the map.
//!
//! Around a landmark heat spreads as far on both shapes. How warm a vertex is from each landmark, at a few times, is
//! set beside its descriptors in the functional map's system, and beside its row in the embedding in every round of
//! refinement.

use super::pair::Pair;
use crate::Matrix;
use crate::error::Error;
use crate::mesh::{SurfacePoint, vertices_on_surface};
use crate::point_map::PointMap;
use crate::shape::{Shape, WayBack};
use crate::spectral::Eigenbasis;
use std::collections::BTreeMap;
use thiserror::Error;

/// Times of the heat at unit area: from a hand to a limb.
const TIMES: [f64; 3] = [0.003, 0.01, 0.03];
/// Weight of the landmarks against the descriptors in the functional map's system, by squared norms.
const IN_SYSTEM: f64 = 1.0;
/// The same against the embedding's rows.
const IN_EMBEDDING: f64 = 0.25;

/// Why landmarks cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum LandmarkError {
    /// A vertex does not exist.
    #[error("landmark {index} is {side} vertex {vertex}, but there are only {n_vertices} (0-based)")]
    NoVertex {
        /// The landmark, from 0.
        index: usize,
        /// `source` or `target`.
        side: &'static str,
        /// The vertex.
        vertex: u32,
        /// How many there are.
        n_vertices: usize,
    },
    /// A vertex is on no surface, so that nothing can spread from it.
    #[error("landmark {index} is {side} vertex {vertex}, which no triangle uses; choose one on the surface")]
    NoSurface {
        /// The landmark, from 0.
        index: usize,
        /// `source` or `target`.
        side: &'static str,
        /// The vertex.
        vertex: u32,
    },
    /// A source vertex has two images, and a map can keep only one.
    #[error(
        "landmarks {first} and {second} match source vertex {vertex} with different target vertices; keep one of them"
    )]
    TwoImages {
        /// The one landmark, from 0.
        first: usize,
        /// The other.
        second: usize,
        /// The source vertex.
        vertex: u32,
    },
}

/// Refuses landmarks that contradict each other.
fn check_images(pairs: &[(u32, u32)]) -> Result<(), LandmarkError> {
    let mut known = BTreeMap::new();
    for (second, &(vertex, image)) in pairs.iter().enumerate() {
        match known.insert(vertex, (second, image)) {
            Some((first, other)) if other != image => {
                return Err(LandmarkError::TwoImages { first, second, vertex });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Landmarks of a pair, on the working meshes.
pub(super) struct Landmarks {
    /// In the inputs' vertices.
    pairs: Vec<(u32, u32)>,
    /// How warm each vertex of source and target is, `[n, landmarks x times]`.
    warmth: [Matrix; 2],
}

impl Landmarks {
    /// The same landmarks of another pair.
    pub(super) fn of(&self, pair: &Pair) -> Result<Self, Error> {
        Self::new(pair, &self.pairs)
    }

    /// Finds matches of the inputs' vertices on the working meshes.
    pub(super) fn new(pair: &Pair, pairs: &[(u32, u32)]) -> Result<Self, Error> {
        check_images(pairs)?;
        let bases = pair.bases(pair.matcher.k)?;
        let shapes = [&pair.source.shape, &pair.target.shape];
        let mut warmth = Vec::with_capacity(2);
        for (i, side) in ["source", "target"].into_iter().enumerate() {
            let vertices: Vec<u32> = pairs.iter().map(|p| if i == 0 { p.0 } else { p.1 }).collect();
            warmth.push(self::warmth(&bases[i], &on_work(shapes[i], side, &vertices)?));
        }
        let warmth = warmth.try_into().expect("two shapes");
        Ok(Self { pairs: pairs.to_vec(), warmth })
    }

    /// The coefficients of both shapes with those of the landmarks beside them, `[k, q + q']`.
    pub(super) fn beside_coefficients(&self, hats: [Matrix; 2], bases: &[Eigenbasis; 2]) -> [Matrix; 2] {
        let own: [Matrix; 2] = std::array::from_fn(|i| bases[i].project(&self.warmth[i].map(|x| x as f32)));
        let factor = (IN_SYSTEM * (squares(&hats[0]) + squares(&hats[1]))
            / (squares(&own[0]) + squares(&own[1])))
        .sqrt();
        std::array::from_fn(|i| Matrix::beside(&[&hats[i], &own[i].map(|x| factor * x)]))
    }

    /// Columns to be set beside the rows of embeddings whose rows have a squared length of `mean_square` in the mean.
    pub(super) fn anchors(&self, mean_square: f64) -> [Matrix; 2] {
        let rows = (self.warmth[0].rows() + self.warmth[1].rows()) as f64;
        let own = (squares(&self.warmth[0]) + squares(&self.warmth[1])) / rows;
        let factor = (IN_EMBEDDING * mean_square / own).sqrt();
        std::array::from_fn(|i| self.warmth[i].map(|x| factor * x))
    }

    /// Sets the landmarks' matches exactly.
    pub(super) fn keep(&self, map: &mut PointMap, target: &Shape) {
        let places = vertices_on_surface(target.input_mesh());
        for &(x, y) in &self.pairs {
            map.targets[x as usize] = y;
            if let Some(confidence) = &mut map.confidence {
                confidence[x as usize] = 1.0;
            }
            if let Some(points) = &mut map.points {
                points[x as usize] = places[y as usize];
            }
        }
    }
}

/// The working mesh's vertices at or next to vertices of the input.
fn on_work(shape: &Shape, side: &'static str, vertices: &[u32]) -> Result<Vec<u32>, Error> {
    let places: Vec<Option<SurfacePoint>> = shape.full_on_work();
    let mut found = Vec::with_capacity(vertices.len());
    for (index, &vertex) in vertices.iter().enumerate() {
        let n_vertices = shape.n_input();
        let Some(&full) = shape.way_back.full_of_input.get(vertex as usize) else {
            return Err(LandmarkError::NoVertex { index, side, vertex, n_vertices }.into());
        };
        let place = if full == WayBack::NONE { None } else { places[full as usize] };
        let place = place.ok_or(LandmarkError::NoSurface { index, side, vertex })?;
        found.push(place.nearest_vertex(shape.mesh()));
    }
    Ok(found)
}

/// Of each vertex, how warm it is from each landmark at each time, `[n, landmarks x times]`; 1 at the landmark itself.
fn warmth(basis: &Eigenbasis, landmarks: &[u32]) -> Matrix {
    let mut weights = Matrix::zeros(basis.k(), landmarks.len() * TIMES.len());
    for (l, &landmark) in landmarks.iter().enumerate() {
        let phi = basis.eigenvectors.row(landmark as usize);
        for (t, time) in TIMES.iter().enumerate() {
            let decayed = |i: usize| phi[i] * (-basis.eigenvalues[i] * time).exp();
            let own: f64 = (0..basis.k()).map(|i| phi[i] * decayed(i)).sum();
            for i in 0..basis.k() {
                weights[(i, l * TIMES.len() + t)] = decayed(i) / own.max(f64::MIN_POSITIVE);
            }
        }
    }
    crate::fmap::multiply(basis.eigenvectors.as_faer(), weights.as_faer())
}

fn squares(matrix: &Matrix) -> f64 {
    matrix.data().iter().map(|x| x * x).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn landmarks_may_agree_but_not_contradict_each_other() {
        assert_eq!(check_images(&[(3, 7), (4, 7), (3, 7)]), Ok(()));
        let error = check_images(&[(3, 7), (5, 1), (3, 8)]).unwrap_err();
        assert_eq!(error, LandmarkError::TwoImages { first: 0, second: 2, vertex: 3 });
        assert!(error.to_string().starts_with("landmarks 0 and 2 match source vertex 3"));
    }
}
