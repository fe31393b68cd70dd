//! Minibatches: which pair, which points.
//!
//! The residual network sees points one by one, so a minibatch is one index set of points of a pair, the same for
//! both shapes. A network that sees the surface gets whole meshes, and points are drawn from its output. Either way
//! point `i` of the source corresponds with point `i` of the target; where the source is a part, the target has
//! further points. Losses without ground truth take no points of whole meshes. Minibatch `b` of a run depends on the
//! seed and on `b` alone, so a resumed run draws what the uninterrupted one would have.

use crate::config::{Sampling, TrainConfig};
use crate::dataset::MISSING;
use crate::network::{DiffusionOptions, NetworkInput};
use crate::precompute::{Places, PrepareError, PreparedShape, ShapeArrays};
use crate::step::{AssignmentPoints, PairBatch, ShapeBatch};
use fmnet::Matrix;
use fmnet::diffusion_net::Operators;
use fmnet::fmap::{FmapError, pseudo_inverse};
use rand::seq::{IndexedRandom, index};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use thiserror::Error;

/// Draws minibatches from prepared shapes.
pub struct Sampler<'a> {
    shapes: &'a [PreparedShape],
    /// Source and target of every pair that corresponds, both directions, of each group; a group is drawn as often as
    /// it has shapes.
    pairs: Vec<Vec<(usize, usize)>>,
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
    /// The arrays of a shape cannot be read.
    #[error(transparent)]
    Arrays(#[from] PrepareError),
    /// The functional map of the ground truth cannot be computed.
    #[error("{pair}: {source}")]
    GroundTruth {
        /// The shapes' names.
        pair: String,
        /// Why.
        source: FmapError,
    },
}

/// Fewer common points than this, or than the eigenfunctions that they must tell apart, do not make a pair.
const MIN_COMMON_POINTS: usize = 50;
/// A minibatch needs so many, as there are no pairs of different rows of fewer.
const MIN_DRAWN_POINTS: usize = 2;
/// Vertices of each shape in a soft assignment of the coupling loss, at most.
const ASSIGNED: usize = 1500;

impl<'a> Sampler<'a> {
    /// Lists the pairs.
    ///
    /// # Errors
    /// If no two shapes of a group share enough points (of the pool, where distances between them are needed), the
    /// larger of 50 and `k`; where no loss needs points, if no group has two shapes.
    pub fn new(shapes: &'a [PreparedShape], config: &'a TrainConfig) -> Result<Self, SamplerError> {
        let sampler = Self { shapes, pairs: Vec::new(), config };
        let least = MIN_COMMON_POINTS.max(config.k);
        let mut pairs: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
        for (source, s) in shapes.iter().enumerate() {
            for (target, t) in shapes.iter().enumerate() {
                let corresponds = source != target && s.entry.group == t.entry.group && !t.entry.is_part();
                let enough = || !config.needs_points() || sampler.common_points(s, t).len() >= least;
                if corresponds && enough() {
                    pairs.entry(&s.entry.group).or_default().push((source, target));
                }
            }
        }
        match pairs.is_empty() {
            true => Err(SamplerError::NoPairs { shapes: shapes.len(), points: least }),
            false => Ok(Self { pairs: pairs.into_values().collect(), ..sampler }),
        }
    }

    /// Number of ordered pairs.
    pub fn n_pairs(&self) -> usize {
        self.pairs.iter().map(Vec::len).sum()
    }

    /// Minibatch number `index` of the run, from 0: one pair or several.
    ///
    /// # Errors
    /// If fewer than 2 of the points drawn on a whole are on its part, the arrays of a shape cannot be read, or the
    /// ground truth does not make a functional map.
    pub fn batch(&self, index: u64) -> Result<Vec<PairBatch>, SamplerError> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        rng.set_stream(index + 1);
        (0..self.config.pairs).map(|_| self.pair(&mut rng)).collect()
    }

    fn pair(&self, rng: &mut ChaCha8Rng) -> Result<PairBatch, SamplerError> {
        let group = self.draw_group(rng);
        let &(source, target) = group.choose(rng).expect("a group has pairs");
        let (source, target) = (&self.shapes[source], &self.shapes[target]);
        let target_arrays = target.arrays()?;
        let (common, all) = match self.config.needs_points() {
            true => self.draw(source, target, &target_arrays.mass, rng),
            false => (Vec::new(), Vec::new()),
        };
        if self.config.needs_points() && common.len() < MIN_DRAWN_POINTS {
            let (source_name, target_name) = (source.entry.name.clone(), target.entry.name.clone());
            let (common, drawn) = (common.len(), all.len());
            return Err(SamplerError::TooFewCommon { source_name, target_name, common, drawn });
        }
        let source_arrays = source.arrays()?;
        let loss = &self.config.loss;
        let negatives = if loss.siamese > 0.0 { negatives(common.len(), rng) } else { Vec::new() };
        let ground_truth = match loss.spectral > 0.0 {
            true => Some(self.ground_truth([(source, &source_arrays), (target, &target_arrays)])?),
            false => None,
        };
        let source_is_part = source.entry.is_part();
        let source = self.shape_batch(source, source_arrays, &common, rng);
        let target = self.shape_batch(target, target_arrays, &all, rng);
        let assignment = match loss.coupling > 0.0 {
            true => Some([assignment(&source, &target, rng)?, assignment(&target, &source, rng)?]),
            false => None,
        };
        Ok(PairBatch { source, target, source_is_part, negatives, ground_truth, assignment })
    }

    /// The pairs of a group. `m` shapes make about `m^2` pairs.
    fn draw_group(&self, rng: &mut ChaCha8Rng) -> &[(usize, usize)] {
        let [one] = &self.pairs[..] else {
            let shapes = |pairs: &Vec<(usize, usize)>| (pairs.len() as f64).sqrt();
            let total: f64 = self.pairs.iter().map(shapes).sum();
            let mut left = rng.random_range(0.0..total);
            for pairs in &self.pairs {
                left -= shapes(pairs);
                if left < 0.0 {
                    return pairs;
                }
            }
            return &self.pairs[self.pairs.len() - 1];
        };
        one
    }

    /// Points that both shapes have, ascending; of their pools, where distances between them are needed or points are
    /// all that the network sees.
    fn common_points(&self, source: &PreparedShape, target: &PreparedShape) -> Vec<u32> {
        if self.of_pool() {
            let in_target = |point: &&u32| target.pool.points.binary_search(point).is_ok();
            return source.pool.points.iter().filter(in_target).copied().collect();
        }
        let both = source.points.iter().zip(&target.points).enumerate();
        both.filter(|(_, (s, t))| **s != MISSING && **t != MISSING).map(|(point, _)| point as u32).collect()
    }

    fn of_pool(&self) -> bool {
        self.config.diffusion().is_none() || self.config.loss.soft_error > 0.0
    }

    /// Draws points of the target without replacement: those that the source has too, ascending, and all, the same
    /// ones first. Only a part lacks some: its whole is sampled everywhere, or its descriptors would be compared with
    /// those of a part.
    fn draw(
        &self,
        source: &PreparedShape,
        target: &PreparedShape,
        mass: &[f32],
        rng: &mut ChaCha8Rng,
    ) -> (Vec<u32>, Vec<u32>) {
        let common = match source.entry.is_part() && self.of_pool() {
            true => target.pool.points.clone(),
            false => self.common_points(source, target),
        };
        let count = self.config.points.min(common.len());
        let area = |&point: &u32| mass[target.points[point as usize] as usize];
        let mut points: Vec<u32> = match self.config.sampling {
            Sampling::Uniform => common.choose_multiple(rng, count).copied().collect(),
            Sampling::Area => common
                .choose_multiple_weighted(rng, count, area)
                .expect("areas are positive and finite")
                .copied()
                .collect(),
        };
        points.sort_unstable();
        let in_source = |point: &u32| {
            source.points[*point as usize] != MISSING
                && (!self.of_pool() || source.pool.points.binary_search(point).is_ok())
        };
        let (common, others): (Vec<u32>, Vec<u32>) = points.into_iter().partition(in_source);
        let all = [&common[..], &others].concat();
        (common, all)
    }

    fn shape_batch(
        &self,
        prepared: &PreparedShape,
        arrays: ShapeArrays,
        points: &[u32],
        rng: &mut ChaCha8Rng,
    ) -> ShapeBatch {
        let jitter = self.config.jitter.max(1);
        let vertices: Vec<u32> = points
            .iter()
            .map(|&point| match jitter {
                1 => prepared.points[point as usize],
                _ => prepared.jitter[point as usize * jitter + rng.random_range(0..jitter)],
            })
            .collect();
        let k = self.config.k;
        let eigenvalues = arrays.eigenvalues[..k].to_vec();
        let distances =
            if self.config.loss.soft_error > 0.0 { prepared.pool.distances(points) } else { None };
        match self.config.diffusion() {
            Some(options) => ShapeBatch {
                places: prepared.places.as_ref().map(|places| places.select(points)),
                basis: arrays.eigenvectors.first_cols(k),
                mass: arrays.mass.clone(),
                input: diffusion_input(options, arrays),
                eigenvalues,
                points: vertices,
                distances,
            },
            None => ShapeBatch {
                input: NetworkInput {
                    features: arrays.shot.select_rows(&vertices),
                    operators: Operators::default(),
                },
                basis: arrays.eigenvectors.first_cols(k).select_rows(&vertices),
                mass: vertices.iter().map(|&v| arrays.mass[v as usize]).collect(),
                eigenvalues,
                points: (0..vertices.len() as u32).collect(),
                places: None,
                distances,
            },
        }
    }

    /// The least-squares functional maps of all points that both shapes have, source to target and back.
    fn ground_truth(&self, shapes: [(&PreparedShape, &ShapeArrays); 2]) -> Result<[Matrix; 2], SamplerError> {
        let [(source, _), (target, _)] = shapes;
        let points = self.common_points(source, target);
        let functions = shapes.map(|(prepared, arrays)| {
            let value = |vertex: u32, j: usize| f64::from(arrays.eigenvectors[(vertex as usize, j)]);
            let at = |i: usize, j: usize| match &prepared.places {
                None => value(prepared.points[points[i] as usize], j),
                Some(Places { corners, weights }) => {
                    let point = points[i] as usize;
                    (0..3).map(|c| f64::from(weights[c][point]) * value(corners[c][point], j)).sum()
                }
            };
            Matrix::from_fn(points.len(), self.config.k, at)
        });
        let wrong = |error| SamplerError::GroundTruth {
            pair: format!("{} -> {}", source.entry.name, target.entry.name),
            source: error,
        };
        let [phi, psi] = &functions;
        let forth = fmnet::fmap::from_points(phi, psi).map_err(wrong)?;
        let back = match source.entry.is_part() {
            // What lies outside the part says nothing of its functions: the restriction to the part, see
            // `fmnet::fmap::part`.
            true => forth.transposed(),
            false => fmnet::fmap::from_points(psi, phi).map_err(wrong)?,
        };
        Ok([forth, back])
    }
}

/// What a DiffusionNet is given of a shape: the wave kernel signature beside the scaled SHOT descriptors, and the
/// operators.
pub fn diffusion_input(options: &DiffusionOptions, arrays: ShapeArrays) -> NetworkInput {
    let n = arrays.n();
    let mut features = Matrix::zeros(n, options.inputs());
    let energies = options.wks_energies;
    if energies > 0 {
        let k = options.wks_eigenfunctions;
        let signature =
            fmnet::spectral::wks_of(&arrays.eigenvalues[..k], &arrays.eigenvectors.first_cols(k), energies);
        (0..n).for_each(|v| features.row_mut(v)[..energies].copy_from_slice(signature.row(v)));
    }
    if options.takes_shot() {
        let scale = options.shot_scale as f32;
        for v in 0..n {
            let row = features.row_mut(v)[energies..].iter_mut();
            row.zip(arrays.shot.row(v)).for_each(|(to, shot)| *to = scale * shot);
        }
    }
    let k = options.eigenfunctions;
    let operators = Operators {
        eigenvalues: arrays.eigenvalues[..k].iter().map(|&x| x as f32).collect(),
        eigenvectors: arrays.eigenvectors.first_cols(k).into_data(),
        gradients_x: arrays.gradients_x.into_data(),
        gradients_y: arrays.gradients_y.into_data(),
        mass: arrays.mass,
    };
    NetworkInput { features, operators }
}

/// Random vertices of both shapes for the soft assignment of a map from one to the other.
fn assignment(
    from: &ShapeBatch,
    to: &ShapeBatch,
    rng: &mut ChaCha8Rng,
) -> Result<AssignmentPoints, SamplerError> {
    let mut rows = |shape: &ShapeBatch| -> Vec<u32> {
        let n = shape.mass.len();
        let mut rows: Vec<u32> =
            index::sample(rng, n, n.min(ASSIGNED)).into_iter().map(|i| i as u32).collect();
        rows.sort_unstable();
        rows
    };
    let (rows_from, rows_to) = (rows(from), rows(to));
    let basis_to = to.basis.select_rows(&rows_to).map(f64::from);
    let wrong = |source| SamplerError::GroundTruth { pair: "a soft assignment".into(), source };
    let inverse_to = pseudo_inverse(&basis_to).map_err(wrong)?.map(|x| x as f32);
    Ok(AssignmentPoints {
        basis_from: from.basis.select_rows(&rows_from),
        from: rows_from,
        to: rows_to,
        inverse_to,
    })
}

/// As many pairs of different rows as there are rows, of which there must be 2 at least.
fn negatives(rows: usize, rng: &mut ChaCha8Rng) -> Vec<(u32, u32)> {
    let other = |row: usize, rng: &mut ChaCha8Rng| (row + rng.random_range(1..rows)) % rows;
    (0..rows).map(|row| (row as u32, other(row, rng) as u32)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Correspondence, ShapeEntry, Split};
    use crate::losses::LossOptions;
    use crate::network::NetworkOptions;
    use crate::precompute::prepare;
    use crate::step::StepRunner;
    use crate::train::prepare_options;
    use fmnet::Mesh;
    use fmnet::cache::Cache;
    use fmnet::io::{Attributes, write_mesh};
    use fmnet::mesh::shapes::bumpy_sphere;
    use std::path::{Path, PathBuf};

    fn entry(name: &str, mesh: PathBuf) -> ShapeEntry {
        ShapeEntry {
            name: name.into(),
            mesh,
            group: "sphere".into(),
            correspondence: Correspondence::Identity,
            split: Split::Train,
            whole: None,
        }
    }

    /// A sphere and, after it, its first 400 faces, which are a part of it.
    fn whole_and_part(folder: &Path, config: &TrainConfig) -> [PreparedShape; 2] {
        let whole = bumpy_sphere(3, 1);
        let part = Mesh::new(whole.vertices().to_vec(), whole.faces()[..400].to_vec()).unwrap();
        let cache = Cache::open(&folder.join("cache")).unwrap();
        let shape = |(name, mesh, is_part): (&str, &Mesh, bool)| {
            let path = folder.join(format!("{name}.off"));
            write_mesh(&path, mesh, &Attributes::default()).unwrap();
            let whole = is_part.then(|| folder.join("whole.off"));
            let entry = ShapeEntry { whole, ..entry(name, path) };
            prepare(&entry, &prepare_options(config), 1, &cache, &fmnet::events::ignore).unwrap()
        };
        [("whole", &whole, false), ("part", &part, true)].map(shape)
    }

    #[test]
    fn functions_on_the_whole_go_to_their_restrictions_to_a_part() {
        let folder = tempfile::tempdir().unwrap();
        let loss = LossOptions { spectral: 1.0, siamese: 1.0, ..LossOptions::none() };
        let config = TrainConfig { k: 10, points: 500, pool: 1000, loss, ..TrainConfig::paper() };
        let shapes = whole_and_part(folder.path(), &config);
        let pair = Sampler::new(&shapes, &config).unwrap().batch(0).unwrap().remove(0);
        let [_, back] = pair.ground_truth.unwrap();
        let [whole, part] = [0, 1].map(|i| shapes[i].arrays().unwrap());
        let shared: Vec<[usize; 2]> = std::iter::zip(&shapes[0].points, &shapes[1].points)
            .filter(|(_, on_part)| **on_part != MISSING)
            .map(|(&on_whole, &on_part)| [on_whole as usize, on_part as usize])
            .collect();
        let inner = |i: usize, j: usize| {
            let term =
                |&[w, p]: &[usize; 2]| part.mass[p] * part.eigenvectors[(p, i)] * whole.eigenvectors[(w, j)];
            f64::from(shared.iter().map(term).sum::<f32>())
        };
        let restriction = Matrix::from_fn(10, 10, inner);
        let norm = |matrix: &Matrix| matrix.data().iter().map(|x| x * x).sum::<f64>().sqrt();
        let difference = Matrix::from_fn(10, 10, |i, j| back[(i, j)] - restriction[(i, j)]);
        assert!(norm(&difference) < 0.05 * norm(&restriction), "{difference:?}");
    }

    #[test]
    fn without_ground_truth_shapes_need_no_common_points() {
        let folder = tempfile::tempdir().unwrap();
        let loss = LossOptions { bijectivity: 1.0, orthogonality: 1.0, coupling: 1.0, ..LossOptions::none() };
        let network = NetworkOptions::Diffusion(DiffusionOptions {
            blocks: 1,
            width: 8,
            outputs: 8,
            eigenfunctions: 10,
            wks_eigenfunctions: 10,
            ..DiffusionOptions::default()
        });
        let config = TrainConfig { k: 10, loss, network, ..TrainConfig::default() };
        let cache = Cache::open(&folder.path().join("cache")).unwrap();
        let shapes = [("coarse", bumpy_sphere(2, 1)), ("fine", bumpy_sphere(3, 2))].map(|(name, mesh)| {
            let path = folder.path().join(format!("{name}.off"));
            write_mesh(&path, &mesh, &Attributes::default()).unwrap();
            let entry = entry(name, path);
            prepare(&entry, &prepare_options(&config), 1, &cache, &fmnet::events::ignore).unwrap()
        });
        let batch = Sampler::new(&shapes, &config).unwrap().batch(0).unwrap();
        assert!(batch[0].source.points.is_empty() && batch[0].target.points.is_empty());
        let network = config.network.build(1, &candle_core::Device::Cpu).unwrap();
        let mut runner = StepRunner::new(network, config.step_options()).unwrap();
        assert!(runner.step(&batch, 1e-3).unwrap().loss > 0.0);
    }

    #[test]
    fn a_part_with_too_few_of_the_points_drawn_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let loss = LossOptions::siamese();
        let config = TrainConfig { k: 5, pool: 1000, loss, ..TrainConfig::paper() };
        let shapes = whole_and_part(folder.path(), &config);
        let batch = |points: usize| {
            Sampler::new(&shapes, &TrainConfig { points, ..config.clone() }).unwrap().batch(0)
        };
        let pair = &batch(1000).unwrap()[0];
        let rows = pair.source.points.len();
        assert!(rows > 50 && rows < pair.target.points.len() && pair.negatives.len() == rows);
        let error = batch(1).unwrap_err().to_string();
        assert!(error.starts_with("part -> whole: ") && error.contains(" of 1 points drawn"), "{error}");
    }
}
