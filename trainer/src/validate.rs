//! The network tried on held-out pairs, through the runtime's own functional map and point map, without refinement.

use crate::config::TrainConfig;
use crate::dataset::{MISSING, ShapeEntry, check_groups};
use crate::events::{TrainEvent, TrainObserver};
use crate::network::{Network, NetworkInput, NetworkOptions};
use crate::precompute::{PrepareError, ProcessedShape, ShapeArrays, process};
use crate::sampler::diffusion_input;
use crate::train::{TrainError, prepare_options};
use candle_core::Device;
use fmnet::Matrix;
use fmnet::cache::Cache;
use fmnet::diffusion_net::Operators;
use fmnet::events::Event;
use fmnet::fmap::{FmapSolver, functional_maps};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::shape::Context;
use fmnet::spectral::Eigenbasis;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use std::collections::{BTreeMap, BTreeSet};

/// Points of a pair whose error is measured, at most.
const POINTS: usize = 1000;

/// A held-out shape.
struct HeldOut {
    processed: ProcessedShape,
    input: NetworkInput,
    /// At unit area.
    basis: Eigenbasis,
    /// Geodesic distances, of targets.
    solver: Option<GeodesicSolver>,
}

/// Held-out pairs with what their evaluation needs.
pub struct Validation {
    shapes: Vec<HeldOut>,
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

impl Validation {
    /// Draws at most `config.validation_pairs` pairs of corresponding shapes, as many of each group as can be, and
    /// processes their shapes. A part is a source only, so its group needs a whole among the shapes.
    ///
    /// # Errors
    /// If a shape cannot be read or processed, or the cache cannot be written.
    pub fn new(
        entries: &[ShapeEntry],
        config: &TrainConfig,
        observer: TrainObserver,
    ) -> Result<Self, TrainError> {
        let drawn = draw_pairs(entries, config.validation_pairs, config.seed);
        let used: BTreeSet<usize> = drawn.iter().flat_map(|&(s, t)| [s, t]).collect();
        let position: BTreeMap<usize, usize> =
            used.iter().enumerate().map(|(i, &entry)| (entry, i)).collect();
        let cache = Cache::open(&config.cache_folder())?;
        let options = prepare_options(config);
        let warn = |event| {
            if let Event::Warning(text) = event {
                observer(TrainEvent::Warning { text });
            }
        };
        let mut shapes = Vec::with_capacity(used.len());
        for &entry in &used {
            let context = Context { cache: Some(&cache), observer: &warn };
            let processed = process(&entries[entry], &options.shape, context)?;
            let arrays = ShapeArrays::of(&processed.shape, &options, context).map_err(PrepareError::from)?;
            let input = network_input(&config.network, arrays);
            let basis = processed.shape.unit_basis(config.k, context).map_err(PrepareError::from)?;
            let is_target = drawn.iter().any(|&(_, t)| t == entry);
            let solver =
                is_target.then(|| GeodesicSolver::new(processed.shape.mesh(), &GeodesicOptions::default()));
            shapes.push(HeldOut { processed, input, basis, solver });
        }
        check_groups(shapes.iter().map(|shape| (&shape.processed.entry, shape.processed.points.len())))?;
        let pairs = drawn.iter().map(|(s, t)| (position[s], position[t])).collect();
        Ok(Self { shapes, pairs })
    }

    /// Whether there are no pairs.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Matches every pair as the runtime would with a model of this run, parts with [`FmapSolver::Part`]. NaN where
    /// there are no pairs.
    ///
    /// # Errors
    /// If the network, a functional map or a point map fails.
    pub fn run(&self, network: &dyn Network, config: &TrainConfig) -> anyhow::Result<ValidationResult> {
        let mut errors = Vec::new();
        for &(source, target) in &self.pairs {
            errors.extend(self.pair_errors(source, target, network, config)?);
        }
        let share = |limit: f32| errors.iter().filter(|&&e| e <= limit).count() as f64 / errors.len() as f64;
        let mean = errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64;
        Ok(ValidationResult { mean_error: 100.0 * mean, exact: share(0.0), within_5: share(0.05) })
    }

    fn pair_errors(
        &self,
        source: usize,
        target: usize,
        network: &dyn Network,
        config: &TrainConfig,
    ) -> anyhow::Result<Vec<f32>> {
        let (source, target) = (&self.shapes[source], &self.shapes[target]);
        let (s, t) = (&source.processed, &target.processed);
        let (basis_source, basis_target) = (&source.basis, &target.basis);
        let f = basis_source.project(&descriptors(network, &source.input)?);
        let g = basis_target.project(&descriptors(network, &target.input)?);
        let solver = config.fmap_solver().for_matching();
        let solver = if s.entry.is_part() { FmapSolver::for_part(None, solver) } else { solver };
        let (maps, _) = functional_maps(basis_source, basis_target, &f, &g, solver)?;
        let map = maps.point_map(solver.comparison(), basis_source, basis_target)?;
        let common: Vec<(u32, u32)> = (s.points.iter().zip(&t.points))
            .filter(|&(&a, &b)| a != MISSING && b != MISSING)
            .map(|(&a, &b)| (a, b))
            .collect();
        let stride = common.len().div_ceil(POINTS).max(1);
        let queries: Vec<(u32, u32)> =
            common.iter().step_by(stride).filter_map(|&(a, b)| Some((b, map.get(a as usize)?))).collect();
        let solver = target.solver.as_ref().expect("every target has a solver");
        let unit = t.shape.mesh().scale() as f32;
        // A match on another component is as far away as can be.
        let farthest = t.shape.mesh().diagonal() as f32;
        Ok(solver.pair_distances(&queries).iter().map(|d| d.min(farthest) / unit).collect())
    }
}

/// Pairs of corresponding shapes, group by group in turn, each in random order.
fn draw_pairs(entries: &[ShapeEntry], count: usize, seed: u64) -> Vec<(usize, usize)> {
    let mut groups: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
    for (s, source) in entries.iter().enumerate() {
        for (t, target) in entries.iter().enumerate() {
            if s != t && source.group == target.group && !target.is_part() {
                groups.entry(&source.group).or_default().push((s, t));
            }
        }
    }
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    groups.values_mut().for_each(|pairs| pairs.shuffle(&mut rng));
    let longest = groups.values().map(Vec::len).max().unwrap_or(0);
    let turn = |i: usize| groups.values().filter_map(move |pairs| pairs.get(i).copied());
    (0..longest).flat_map(turn).take(count).collect()
}

/// What a network is given of a whole shape.
pub fn network_input(network: &NetworkOptions, arrays: ShapeArrays) -> NetworkInput {
    match network {
        NetworkOptions::Residual(_) => {
            NetworkInput { features: arrays.shot, operators: Operators::default() }
        }
        NetworkOptions::Diffusion(options) => diffusion_input(options, arrays),
    }
}

/// Descriptors `[n, d]` of a shape; fails where the network does.
pub fn descriptors(network: &dyn Network, input: &NetworkInput) -> candle_core::Result<Matrix<f32>> {
    let output = network.forward(&[input])?[0].to_device(&Device::Cpu)?;
    Ok(Matrix::from_vec(input.features.rows(), network.n_outputs(), output.flatten_all()?.to_vec1()?))
}
