//! Minibatches: which pair, which points.
//!
//! A minibatch is one index set of points of a pair, the same for both shapes, so that row `i` of the source corresponds with
//! row `i` of the target; where the source is a part, the target has further rows. Minibatch `b` of a run depends on the seed and on `b` alone, so a resumed run draws what the
//! uninterrupted one would have.

use crate::config::{LossKind, Sampling, TrainConfig};
use crate::dataset::MISSING;
use crate::precompute::PreparedShape;
use crate::step::{PairBatch, ShapeBatch};
use fmnet::Matrix;
use fmnet::mesh::nearest_k_vertices;
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

/// Draws minibatches from prepared shapes.
pub struct Sampler<'a> {
    shapes: &'a [PreparedShape],
    /// Source and target of every pair that corresponds, both directions.
    pairs: Vec<(usize, usize)>,
    /// For each shape, the vertices among which each point is jittered, `[points, jitter]`.
    jitter: Vec<Vec<u32>>,
    config: &'a TrainConfig,
}

/// Why no minibatch can be drawn.
#[derive(Debug, Error)]
pub enum SamplerError {
    /// No two shapes correspond.
    #[error(
        "none of the {shapes} training shapes share a group and {points} points; a group needs two shapes, one of them whole, \
         and a part needs enough points of the pool: raise the pool, or lower k"
    )]
    NoPairs {
        /// Number of training shapes.
        shapes: usize,
        /// Points that a pair must share.
        points: usize,
    },
    /// Too few of the points drawn are on both shapes of a pair.
    #[error(
        "{source_name} -> {target_name}: {common} of {drawn} points drawn are on both shapes, too few for a minibatch; raise the \
         points, or leave out so small a part"
    )]
    TooFewCommon {
        /// Name of the source, a part.
        source_name: String,
        /// Name of the target.
        target_name: String,
        /// Points on both.
        common: usize,
        /// Points drawn.
        drawn: usize,
    },
}

/// Fewer common points than this, or than the eigenfunctions that they must tell apart, do not make a pair.
const MIN_COMMON_POINTS: usize = 50;
/// A minibatch needs so many, as there are no pairs of different rows of fewer.
const MIN_DRAWN_POINTS: usize = 2;

impl<'a> Sampler<'a> {
    /// Lists the pairs and prepares the jitter.
    ///
    /// # Errors
    /// If no two shapes of a group share enough points of the pool, the larger of 50 and `k`.
    pub fn new(shapes: &'a [PreparedShape], config: &'a TrainConfig) -> Result<Self, SamplerError> {
        let mut pairs = Vec::new();
        for (source, s) in shapes.iter().enumerate() {
            for (target, t) in shapes.iter().enumerate() {
                let corresponds = source != target && s.entry.group == t.entry.group && !t.entry.is_part();
                if corresponds && common_points(s, t).len() >= MIN_COMMON_POINTS.max(config.k) {
                    pairs.push((source, target));
                }
            }
        }
        if pairs.is_empty() {
            let points = MIN_COMMON_POINTS.max(config.k);
            return Err(SamplerError::NoPairs { shapes: shapes.len(), points });
        }
        let jitter = shapes.iter().map(|shape| jitter_neighbors(shape, config.jitter)).collect();
        Ok(Self { shapes, pairs, jitter, config })
    }

    /// Number of ordered pairs.
    pub fn n_pairs(&self) -> usize {
        self.pairs.len()
    }

    /// Minibatch number `index` of the run, from 0: one pair or several.
    ///
    /// # Errors
    /// If fewer than 2 of the points drawn on a whole are on its part.
    pub fn batch(&self, index: u64) -> Result<Vec<PairBatch>, SamplerError> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        rng.set_stream(index + 1);
        (0..self.config.pairs).map(|_| self.pair(&mut rng)).collect()
    }

    fn pair(&self, rng: &mut ChaCha8Rng) -> Result<PairBatch, SamplerError> {
        let &(source, target) = self.pairs.choose(rng).expect("there are pairs");
        let (common, all) = self.draw(&self.shapes[source], &self.shapes[target], rng);
        if common.len() < MIN_DRAWN_POINTS {
            let name = |shape: usize| self.shapes[shape].entry.name.clone();
            let (source_name, target_name) = (name(source), name(target));
            let (common, drawn) = (common.len(), all.len());
            return Err(SamplerError::TooFewCommon { source_name, target_name, common, drawn });
        }
        let negatives =
            if self.config.loss == LossKind::Siamese { negatives(common.len(), rng) } else { Vec::new() };
        Ok(PairBatch {
            source: self.sample(source, &common, rng),
            target: self.sample(target, &all, rng),
            source_is_part: self.shapes[source].entry.is_part(),
            negatives,
        })
    }

    /// Draws points of the target's pool without replacement: those that the source has too, ascending, and all, the same ones
    /// first. Only a part lacks some: its whole is sampled everywhere, or its descriptors would be compared with those of
    /// a part.
    fn draw(
        &self,
        source: &PreparedShape,
        target: &PreparedShape,
        rng: &mut ChaCha8Rng,
    ) -> (Vec<u32>, Vec<u32>) {
        let common = match source.entry.is_part() {
            true => target.pool.points.clone(),
            false => common_points(source, target),
        };
        let count = self.config.points.min(common.len());
        let area = |&point: &u32| target.shape.basis.mass[target.points[point as usize] as usize];
        let mut points: Vec<u32> = match self.config.sampling {
            Sampling::Uniform => common.choose_multiple(rng, count).copied().collect(),
            Sampling::Area => common
                .choose_multiple_weighted(rng, count, area)
                .expect("areas are positive and finite")
                .copied()
                .collect(),
        };
        points.sort_unstable();
        let in_source = |point: &u32| source.pool.points.binary_search(point).is_ok();
        let (common, others): (Vec<u32>, Vec<u32>) = points.into_iter().partition(in_source);
        let all = [&common[..], &others].concat();
        (common, all)
    }

    fn sample(&self, shape: usize, points: &[u32], rng: &mut ChaCha8Rng) -> ShapeBatch {
        let prepared = &self.shapes[shape];
        let jitter = self.config.jitter.max(1);
        let vertices: Vec<u32> = points
            .iter()
            .map(|&point| match jitter {
                1 => prepared.points[point as usize],
                _ => self.jitter[shape][point as usize * jitter + rng.random_range(0..jitter)],
            })
            .collect();
        let basis = &prepared.shape.basis;
        let k = self.config.k;
        let rows = |i: usize, j: usize| basis.eigenvectors[(vertices[i] as usize, j)] as f32;
        ShapeBatch {
            shot: prepared.shape.shot.select_rows(&vertices),
            basis: Matrix::from_fn(vertices.len(), k, rows),
            mass: vertices.iter().map(|&v| basis.mass[v as usize] as f32).collect(),
            eigenvalues: basis.eigenvalues[..k].to_vec(),
            distances: prepared.pool.distances(points),
        }
    }
}

/// Points that are in the pools of both shapes, ascending.
fn common_points(source: &PreparedShape, target: &PreparedShape) -> Vec<u32> {
    let in_target = |point: &&u32| target.pool.points.binary_search(point).is_ok();
    source.pool.points.iter().filter(in_target).copied().collect()
}

/// As many pairs of different rows as there are rows, of which there must be 2 at least.
fn negatives(rows: usize, rng: &mut ChaCha8Rng) -> Vec<(u32, u32)> {
    let other = |row: usize, rng: &mut ChaCha8Rng| (row + rng.random_range(1..rows)) % rows;
    (0..rows).map(|row| (row as u32, other(row, rng) as u32)).collect()
}

/// For each point the vertices nearest to its own, `[points, jitter]`; empty where there is no jitter.
fn jitter_neighbors(shape: &PreparedShape, jitter: usize) -> Vec<u32> {
    if jitter <= 1 {
        return Vec::new();
    }
    let vertices = shape.shape.mesh().vertices();
    let positions: Vec<[f64; 3]> =
        shape.points.iter().map(|&v| vertices[if v == MISSING { 0 } else { v as usize }]).collect();
    nearest_k_vertices(vertices, &positions, jitter)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Correspondence, ShapeEntry, Split};
    use crate::precompute::{PrepareOptions, prepare};
    use fmnet::Mesh;
    use fmnet::io::{Attributes, write_mesh};
    use fmnet::mesh::shapes::bumpy_sphere;

    #[test]
    fn a_part_with_too_few_of_the_points_drawn_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let whole = bumpy_sphere(3, 1);
        let part = Mesh::new(whole.vertices().to_vec(), whole.faces()[..400].to_vec()).unwrap();
        let config = TrainConfig { k: 5, pool: 1000, loss: LossKind::Siamese, ..TrainConfig::default() };
        let shape = |(name, mesh, is_part): (&str, &Mesh, bool)| {
            let path = folder.path().join(format!("{name}.off"));
            write_mesh(&path, mesh, &Attributes::default()).unwrap();
            let entry = ShapeEntry {
                name: name.into(),
                mesh: path,
                group: "sphere".into(),
                correspondence: Correspondence::Identity,
                split: Split::Train,
                whole: is_part.then(|| folder.path().join("whole.off")),
            };
            let options = PrepareOptions { shape: config.shape_options(), pool: config.pool, seed: 1 };
            prepare(&entry, &options, None, &fmnet::events::ignore).unwrap()
        };
        let shapes = [("whole", &whole, false), ("part", &part, true)].map(shape);
        let batch = |points: usize| {
            Sampler::new(&shapes, &TrainConfig { points, ..config.clone() }).unwrap().batch(0)
        };
        let pair = &batch(1000).unwrap()[0];
        let rows = pair.source.shot.rows();
        assert!(rows > 50 && rows < pair.target.shot.rows() && pair.negatives.len() == rows);
        let error = batch(1).unwrap_err().to_string();
        assert!(error.starts_with("part -> whole: ") && error.contains(" of 1 points drawn"), "{error}");
    }
}
