//! The network tried on held-out pairs, through the runtime's own functional map and point map, without refinement.

use crate::dataset::MISSING;
use crate::network::Network;
use crate::precompute::PreparedShape;
use candle_core::{Device, Tensor};
use fmnet::Matrix;
use fmnet::fmap::{FmapSolver, functional_maps};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use rand::SeedableRng;
use rand::seq::SliceRandom;

/// Points of a pair whose error is measured, at most.
const POINTS: usize = 1000;

/// Held-out pairs with what their evaluation needs.
pub struct Validation<'a> {
    shapes: &'a [PreparedShape],
    solvers: Vec<Option<GeodesicSolver>>,
    pairs: Vec<(usize, usize)>,
}

/// How the raw maps of the held-out pairs are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidationResult {
    /// Mean geodesic error over sqrt(area), times 100.
    pub mean_error: f64,
    /// Share of exact matches, from 0 to 1.
    pub exact: f64,
    /// Share of matches within 0.05 sqrt(area), from 0 to 1.
    pub within_5: f64,
}

impl<'a> Validation<'a> {
    /// Draws at most `count` pairs of corresponding shapes. A part is a source only, so its group needs a whole among the
    /// shapes.
    pub fn new(shapes: &'a [PreparedShape], count: usize, seed: u64) -> Self {
        let all = (0..shapes.len()).flat_map(|s| (0..shapes.len()).map(move |t| (s, t)));
        let fits = |&(s, t): &(usize, usize)| {
            s != t && shapes[s].entry.group == shapes[t].entry.group && !shapes[t].entry.is_part()
        };
        let mut pairs: Vec<(usize, usize)> = all.filter(fits).collect();
        pairs.shuffle(&mut rand_chacha::ChaCha8Rng::seed_from_u64(seed));
        pairs.truncate(count);
        let is_target = |shape: usize| pairs.iter().any(|&(_, t)| t == shape);
        let solver = |i: usize| {
            is_target(i).then(|| GeodesicSolver::new(shapes[i].shape.mesh(), &GeodesicOptions::default()))
        };
        let solvers = (0..shapes.len()).map(solver).collect();
        Self { shapes, solvers, pairs }
    }

    /// Whether there are no pairs.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Matches every pair with `k` eigenfunctions and `solver`, parts with [`FmapSolver::Part`]. NaN where there are no
    /// pairs.
    ///
    /// # Errors
    /// If the network, a functional map or a point map fails.
    ///
    /// # Panics
    /// If a shape was prepared with fewer than `k` eigenfunctions.
    pub fn run(&self, network: &Network, k: usize, solver: FmapSolver) -> anyhow::Result<ValidationResult> {
        let mut errors = Vec::new();
        for &(source, target) in &self.pairs {
            errors.extend(self.pair_errors(source, target, network, k, solver)?);
        }
        let share = |limit: f32| errors.iter().filter(|&&e| e <= limit).count() as f64 / errors.len() as f64;
        let mean = errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64;
        Ok(ValidationResult { mean_error: 100.0 * mean, exact: share(0.0), within_5: share(0.05) })
    }

    fn pair_errors(
        &self,
        source: usize,
        target: usize,
        network: &Network,
        k: usize,
        solver: FmapSolver,
    ) -> anyhow::Result<Vec<f32>> {
        let (s, t) = (&self.shapes[source], &self.shapes[target]);
        let (basis_source, basis_target) = (s.shape.basis.truncated(k), t.shape.basis.truncated(k));
        let f = basis_source.project(&descriptors(network, &s.shape.shot)?);
        let g = basis_target.project(&descriptors(network, &t.shape.shot)?);
        let solver = if s.entry.is_part() { FmapSolver::for_part(None) } else { solver };
        let (maps, _) = functional_maps(&basis_source, &basis_target, &f, &g, solver)?;
        let map = maps.point_map(solver.comparison(), &basis_source, &basis_target)?;
        let common: Vec<(u32, u32)> = (s.points.iter().zip(&t.points))
            .filter(|&(&a, &b)| a != MISSING && b != MISSING)
            .map(|(&a, &b)| (a, b))
            .collect();
        let stride = common.len().div_ceil(POINTS).max(1);
        let queries: Vec<(u32, u32)> =
            common.iter().step_by(stride).filter_map(|&(a, b)| Some((b, map.get(a as usize)?))).collect();
        let solver = self.solvers[target].as_ref().expect("every target has a solver");
        let unit = t.shape.mesh().scale() as f32;
        // A match on another component is as far away as can be.
        let farthest = t.shape.mesh().diagonal() as f32;
        Ok(solver.pair_distances(&queries).iter().map(|d| d.min(farthest) / unit).collect())
    }
}

/// Descriptors `[n, 352]` of a shape's SHOT descriptors `[n, 352]`; fails where the network does.
pub fn descriptors(network: &Network, shot: &Matrix<f32>) -> candle_core::Result<Matrix<f32>> {
    let device = network.variable().device();
    let input = Tensor::from_slice(shot.data(), (shot.rows(), shot.cols()), device)?;
    let output = network.forward(&[input])?.to_device(&Device::Cpu)?;
    Ok(Matrix::from_vec(shot.rows(), shot.cols(), output.flatten_all()?.to_vec1()?))
}
