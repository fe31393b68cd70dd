//! One training step: network, projection, functional maps, losses, gradient, Adam.

use crate::fm_layer::functional_map;
use crate::losses::{
    LossOptions, SoftAssignment, bijectivity, contrastive, coupling, orthogonality, siamese, spectral,
};
use crate::network::{Network, NetworkInput, Statistics};
use crate::optimizer::{Adam, AdamOptions};
use crate::precompute::Places;
use crate::projection::{WeightedBasis, project};
use crate::soft_map::{SoftErrorInput, soft_error};
use candle_core::{DType, Tensor, backprop::GradStore};
use fmnet::Matrix;
use fmnet::fmap::{FmapSolver, resolvent_mask};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// One shape of a pair: the `r` vertices that the network runs on, and which of them are points of the pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeBatch {
    /// What the network is given, `r` rows: sampled points, or the whole mesh.
    pub input: NetworkInput,
    /// Eigenfunctions on these vertices `[r, k]`, for a shape scaled to unit area.
    pub basis: Matrix<f32>,
    /// Vertex areas `[r]`, for a shape scaled to unit area.
    pub mass: Vec<f32>,
    /// Eigenvalues `[k]`, for a shape scaled to unit area.
    pub eigenvalues: Vec<f64>,
    /// The row of every point of the pair, `[m]`.
    pub points: Vec<u32>,
    /// Where the points lie between vertices, for the contrastive loss; `None` where they are vertices.
    pub places: Option<Places>,
    /// Geodesic distances between the points `[m, m]` in units of sqrt(area), for the soft error. Needed of the
    /// target; given of the source too, the pair is used in both directions at once, at the cost of little more than
    /// one.
    pub distances: Option<Matrix<f32>>,
}

/// A pair of which point `i` of the source corresponds to point `i` of the target. Where the source is a part of the
/// target, the target has further points, those that the part lacks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairBatch {
    /// The shape that is mapped.
    pub source: ShapeBatch,
    /// The shape that it is mapped to.
    pub target: ShapeBatch,
    /// Whether the source is a part of the target: the functional map is then solved for from the whole to the part,
    /// and only used from the part to the whole (see [`fmnet::fmap::part`]).
    pub source_is_part: bool,
    /// Pairs (source point, target point) that do not correspond, for the siamese loss.
    pub negatives: Vec<(u32, u32)>,
    /// The functional maps of the ground truth, `[k_target, k_source]` and `[k_source, k_target]`, for the spectral
    /// loss.
    pub ground_truth: Option<[Matrix; 2]>,
    /// Points between which soft assignments are made, for the coupling: for the map from the source to the target,
    /// and back.
    pub assignment: Option<[AssignmentPoints; 2]>,
}

/// Points of a soft assignment for one direction, from the shape `from` to the shape `to`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AssignmentPoints {
    /// Rows of the shape that the functional map comes from, `[m']`.
    pub from: Vec<u32>,
    /// Rows of the shape that it goes to, `[m]`.
    pub to: Vec<u32>,
    /// Eigenfunctions of the former on its points, `[m', k]`.
    pub basis_from: Matrix<f32>,
    /// The pseudo-inverse of those of the latter, `[k, m]`.
    pub inverse_to: Matrix<f32>,
}

/// What a step minimises and how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StepOptions {
    /// How the functional map is solved for; default regularised.
    pub functional_map: FmapSolver,
    /// What is minimised.
    pub loss: LossOptions,
    /// The optimiser.
    pub adam: AdamOptions,
    /// Largest norm of the gradient, which is scaled down to it; above 0, default none.
    pub clip: Option<f64>,
}

/// What a step came to, the mean over its pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepStats {
    /// The loss.
    pub loss: f64,
    /// Mean geodesic error over sqrt(area) on the samples of the match by the soft map's largest entry; NaN without
    /// the soft error.
    pub hard_error: f64,
    /// Largest condition number of `F F^T` of all pairs and directions (1 without functional maps).
    pub condition: f64,
    /// Norm of the gradient before clipping.
    pub gradient_norm: f64,
}

/// Why a step failed.
#[derive(Debug, Error)]
pub enum StepError {
    /// The batch does not fit together.
    #[error("the batch of pair {pair} does not fit together: {reason}")]
    Batch {
        /// Index of the pair in the step.
        pair: usize,
        /// What does not fit, expected and found.
        reason: String,
    },
    /// The loss or its gradient is not a number; the parameters were left as they were.
    #[error(
        "the loss is {loss} and the norm of its gradient {gradient_norm}; the parameters were left as they were: \
         lower the learning rate or clip the gradient"
    )]
    NotFinite {
        /// The loss.
        loss: f64,
        /// The norm of its gradient.
        gradient_norm: f64,
    },
    /// Candle or one of the layers failed.
    #[error(transparent)]
    Tensor(#[from] candle_core::Error),
}

/// The network with its optimiser.
pub struct StepRunner {
    /// The network.
    pub network: Box<dyn Network>,
    /// Its optimiser.
    pub adam: Adam,
    options: StepOptions,
}

/// Gradient of the mean loss of some pairs, and what came with it.
pub struct StepGradient {
    /// The stats, but for the norm of the gradient, which is NaN.
    pub stats: StepStats,
    /// The gradient, `[p]`.
    pub gradient: Tensor,
    statistics: Vec<Statistics>,
}

/// Loss of a pair before the backward pass.
struct PairLoss {
    loss: Tensor,
    hard_error: f64,
    condition: f64,
    statistics: Statistics,
}

impl StepRunner {
    /// A fresh optimiser for `network`.
    ///
    /// # Errors
    /// If Candle cannot make the optimiser's state.
    pub fn new(network: Box<dyn Network>, options: StepOptions) -> Result<Self, StepError> {
        let adam = Adam::new(network.variable(), options.adam.clone())?;
        Ok(Self { network, adam, options })
    }

    /// The options.
    pub fn options(&self) -> &StepOptions {
        &self.options
    }

    /// Takes a step on the mean loss of `pairs` (at least one).
    ///
    /// # Errors
    /// If a batch does not fit together, a layer fails, or loss or gradient are not finite; parameters and running
    /// statistics then stay as they were.
    pub fn step(&mut self, pairs: &[PairBatch], learning_rate: f64) -> Result<StepStats, StepError> {
        let StepGradient { mut stats, gradient, statistics } = self.gradient(pairs)?;
        stats.gradient_norm = norm(&gradient)?;
        if !stats.loss.is_finite() || !stats.gradient_norm.is_finite() {
            return Err(StepError::NotFinite { loss: stats.loss, gradient_norm: stats.gradient_norm });
        }
        let gradient = match self.options.clip {
            Some(clip) if stats.gradient_norm > clip => (gradient * (clip / stats.gradient_norm))?,
            _ => gradient,
        };
        self.adam.update(self.network.variable(), &gradient, learning_rate)?;
        statistics.into_iter().for_each(|statistics| self.network.accept(statistics));
        Ok(stats)
    }

    /// The mean loss of `pairs` and its gradient, without a step.
    ///
    /// # Errors
    /// If there is no pair, a batch does not fit together, or a layer fails.
    pub fn gradient(&mut self, pairs: &[PairBatch]) -> Result<StepGradient, StepError> {
        let share = 1.0 / pairs.len() as f64;
        let mut stats = StepStats { loss: 0.0, hard_error: 0.0, condition: 1.0, gradient_norm: f64::NAN };
        let mut sum: Option<Tensor> = None;
        let mut all_statistics = Vec::new();
        for (index, pair) in pairs.iter().enumerate() {
            check(pair, self.network.n_inputs(), &self.options.loss)
                .map_err(|reason| StepError::Batch { pair: index, reason })?;
            let PairLoss { loss, hard_error, condition, statistics } = self.pair_loss(pair)?;
            stats.loss += share * loss.to_dtype(DType::F64)?.to_scalar::<f64>()?;
            stats.hard_error += share * hard_error;
            stats.condition = stats.condition.max(condition);
            all_statistics.push(statistics);
            let gradient = take_gradient(&loss.backward()?, self.network.as_ref())?;
            sum = Some(match sum {
                Some(sum) => (sum + gradient)?,
                None => gradient,
            });
        }
        let sum = sum.ok_or(StepError::Batch { pair: 0, reason: "a step needs at least one pair".into() })?;
        let gradient = if pairs.len() > 1 { (sum * share)? } else { sum };
        Ok(StepGradient { stats, gradient, statistics: all_statistics })
    }

    fn pair_loss(&mut self, pair: &PairBatch) -> Result<PairLoss, candle_core::Error> {
        let (descriptors, statistics) =
            self.network.forward_train(&[&pair.source.input, &pair.target.input])?;
        let pass = Pass { options: &self.options, pair, descriptors: [&descriptors[0], &descriptors[1]] };
        let mut sum = WeightedSum { statistics, ..WeightedSum::default() };
        let loss = &self.options.loss;
        if loss.needs_maps() {
            pass.map_losses(&mut sum)?;
        }
        if loss.contrastive > 0.0 {
            let [source, target] = pass.common_points()?;
            sum.add(loss.contrastive, contrastive(&source, &target, loss.temperature)?)?;
        }
        if loss.siamese > 0.0 {
            let [source, target] = pass.common_points()?;
            sum.add(loss.siamese, siamese(&source, &target, &pair.negatives, loss.gamma, loss.margin)?)?;
        }
        sum.finish()
    }
}

/// Losses added up.
struct WeightedSum {
    total: Option<Tensor>,
    hard_error: f64,
    condition: f64,
    statistics: Statistics,
}

impl Default for WeightedSum {
    fn default() -> Self {
        Self { total: None, hard_error: f64::NAN, condition: 1.0, statistics: Vec::new() }
    }
}

impl WeightedSum {
    fn add(&mut self, weight: f64, loss: Tensor) -> Result<(), candle_core::Error> {
        let weighted = if weight == 1.0 { loss } else { (loss * weight)? };
        self.total = Some(match self.total.take() {
            Some(total) => (total + weighted)?,
            None => weighted,
        });
        Ok(())
    }

    fn finish(self) -> Result<PairLoss, candle_core::Error> {
        let Self { total, hard_error, condition, statistics } = self;
        let loss = total.ok_or_else(|| candle_core::Error::msg("all losses have weight 0"))?;
        Ok(PairLoss { loss, hard_error, condition, statistics })
    }
}

/// The descriptors of a pair on their way to the losses.
struct Pass<'a> {
    options: &'a StepOptions,
    pair: &'a PairBatch,
    /// `[r, d]` of source and target.
    descriptors: [&'a Tensor; 2],
}

impl Pass<'_> {
    /// Descriptors of the points that both shapes have, `[m, d]` each.
    fn common_points(&self) -> Result<[Tensor; 2], candle_core::Error> {
        let count = self.pair.source.points.len().min(self.pair.target.points.len());
        let rows = |shape: &ShapeBatch, descriptors: &Tensor| match &shape.places {
            None => descriptors.index_select(&indices(&shape.points[..count], descriptors)?, 0),
            Some(places) => interpolated(places, count, descriptors),
        };
        Ok([rows(&self.pair.source, self.descriptors[0])?, rows(&self.pair.target, self.descriptors[1])?])
    }

    /// The losses of the functional maps: source to target, and back.
    fn map_losses(&self, sum: &mut WeightedSum) -> Result<(), candle_core::Error> {
        let loss = &self.options.loss;
        let PairBatch { source, target, source_is_part, .. } = self.pair;
        let spectral_of = |shape: &ShapeBatch, descriptors| {
            project(descriptors, WeightedBasis::<f32>::new(shape.basis.data(), &shape.mass))
        };
        let f = spectral_of(source, self.descriptors[0])?;
        let g = spectral_of(target, self.descriptors[1])?;
        let both = loss.needs_both_maps();
        // Of a part and its whole, only the equation from the whole to the part holds.
        let forth = match !source_is_part && (both || target.distances.is_some()) {
            true => Some(self.solve(sum, (source, &f), (target, &g))?),
            false => None,
        };
        let back = match *source_is_part || both || source.distances.is_some() {
            true => Some(self.solve(sum, (target, &g), (source, &f))?),
            false => None,
        };
        if loss.soft_error > 0.0 {
            self.soft_error(sum, forth.as_ref(), back.as_ref())?;
        }
        let directions = [(0, &forth, [0, 1]), (1, &back, [1, 0])];
        for (direction, map, [from, to]) in directions {
            let Some(map) = map else { continue };
            if let (true, Some(truth)) = (loss.spectral > 0.0, &self.pair.ground_truth) {
                sum.add(loss.spectral, spectral(map, &truth[direction])?)?;
            }
            if loss.orthogonality > 0.0 {
                sum.add(loss.orthogonality, orthogonality(map)?)?;
            }
            if let (true, Some(points)) = (loss.coupling > 0.0, &self.pair.assignment) {
                let points = &points[direction];
                let assignment = SoftAssignment {
                    rows_source: indices(&points.from, map)?,
                    rows_target: indices(&points.to, map)?,
                    inverse_target: points.inverse_to.clone(),
                    basis_source: points.basis_from.clone(),
                };
                let (from, to) = (self.descriptors[from], self.descriptors[to]);
                sum.add(loss.coupling, coupling(map, from, to, &assignment, loss.temperature)?)?;
            }
        }
        if let (true, Some(forth), Some(back)) = (loss.bijectivity > 0.0, &forth, &back) {
            sum.add(loss.bijectivity, bijectivity(forth, back)?)?;
        }
        Ok(())
    }

    /// The functional map from one shape to another.
    fn solve(
        &self,
        sum: &mut WeightedSum,
        (from, spectral_from): (&ShapeBatch, &Tensor),
        (to, spectral_to): (&ShapeBatch, &Tensor),
    ) -> Result<Tensor, candle_core::Error> {
        let mask = resolvent_mask(&from.eigenvalues, &to.eigenvalues);
        let solved = functional_map(spectral_from, spectral_to, self.options.functional_map, &mask)?;
        sum.condition = sum.condition.max(solved.condition);
        Ok(solved.map)
    }

    /// The soft error, the mean over both directions where the source has distances too.
    fn soft_error(
        &self,
        sum: &mut WeightedSum,
        forth: Option<&Tensor>,
        back: Option<&Tensor>,
    ) -> Result<(), candle_core::Error> {
        let PairBatch { source, target, source_is_part, .. } = self.pair;
        let transposed = |map: Option<&Tensor>| map.map(Tensor::t).transpose();
        let to_target = if *source_is_part { transposed(back)? } else { forth.cloned() };
        let mut errors = Vec::new();
        for (from, to, map) in [(source, target, to_target), (target, source, back.cloned())] {
            let (Some(distances), Some(map)) = (&to.distances, map) else { continue };
            let matched = from.points.len() * to.points.len();
            errors.push(soft_error(
                &map,
                SoftErrorInput {
                    basis_source: from.basis.select_rows(&from.points).into_data(),
                    basis_target: to.basis.select_rows(&to.points).into_data(),
                    distances: distances.data()[..matched].to_vec(),
                    norm: self.options.loss.column_norm,
                },
            )?);
        }
        sum.hard_error = errors.iter().map(|error| error.hard_error).sum::<f64>() / errors.len() as f64;
        let weight = self.options.loss.soft_error;
        let mut losses = errors.into_iter().map(|error| error.loss);
        match (losses.next(), losses.next()) {
            (Some(one), None) => sum.add(weight, one),
            (Some(one), Some(other)) => sum.add(weight, ((one + other)? * 0.5)?),
            _ => candle_core::bail!("the soft error needs the distances of the target"),
        }
    }
}

/// The descriptors at the first `count` places, `[count, d]`.
fn interpolated(places: &Places, count: usize, descriptors: &Tensor) -> Result<Tensor, candle_core::Error> {
    let corner = |at: usize| {
        let rows = descriptors.index_select(&indices(&places.corners[at][..count], descriptors)?, 0)?;
        let weights = Tensor::from_slice(&places.weights[at][..count], (count, 1), descriptors.device())?;
        rows.broadcast_mul(&weights)
    };
    (corner(0)? + corner(1)?)? + corner(2)?
}

fn indices(rows: &[u32], like: &Tensor) -> Result<Tensor, candle_core::Error> {
    Tensor::from_slice(rows, rows.len(), like.device())
}

fn take_gradient(gradients: &GradStore, network: &dyn Network) -> Result<Tensor, candle_core::Error> {
    let gradient = gradients.get(network.variable().as_tensor());
    gradient.cloned().ok_or_else(|| candle_core::Error::msg("the loss does not depend on the network"))
}

/// Euclidean norm in double precision.
fn norm(gradient: &Tensor) -> Result<f64, candle_core::Error> {
    if gradient.device().is_cpu() {
        return crate::device::with_slice(gradient, |data: &[f32]| {
            let part =
                |chunk: &[f32]| chunk.iter().map(|&value| f64::from(value) * f64::from(value)).sum::<f64>();
            Ok(data.chunks(1024).map(part).sum::<f64>().sqrt())
        });
    }
    gradient.sqr()?.sum_all()?.to_dtype(DType::F64)?.to_scalar::<f64>().map(f64::sqrt)
}

/// Says what does not fit together.
fn check(pair: &PairBatch, width: usize, loss: &LossOptions) -> Result<(), String> {
    let common = pair.source.points.len();
    for (name, shape) in [("source", &pair.source), ("target", &pair.target)] {
        let expect = |what: &str, found: (usize, usize), expected: (usize, usize)| match found == expected {
            true => Ok(()),
            false => Err(format!("{what} of the {name} {found:?}, expected {expected:?}")),
        };
        let features = &shape.input.features;
        let (rows, k, points) = (features.rows(), shape.eigenvalues.len(), shape.points.len());
        expect("input functions", (rows, features.cols()), (rows.max(1), width))?;
        if loss.needs_points() {
            let expected = if pair.source_is_part { points.max(common) } else { common };
            expect("points", (points, 1), (expected.max(1), 1))?;
            if let Some(row) = shape.points.iter().find(|&&row| row as usize >= rows) {
                return Err(format!("point at row {row} of the {name}, which has {rows} rows"));
            }
        }
        if loss.needs_maps() {
            expect("eigenfunctions", (shape.basis.rows(), shape.basis.cols()), (rows, k.max(1)))?;
            expect("vertex areas", (shape.mass.len(), 1), (rows, 1))?;
        }
        if let Some(distances) = &shape.distances {
            expect("distances", (distances.rows(), distances.cols()), (points, points))?;
        }
    }
    let (k_source, k_target) = (pair.source.eigenvalues.len(), pair.target.eigenvalues.len());
    if let Some([forth, back]) = &pair.ground_truth {
        let expected = [(k_target, k_source), (k_source, k_target)];
        let found = [forth, back].map(|map| (map.rows(), map.cols()));
        if found != expected {
            return Err(format!("ground-truth maps {found:?}, expected {expected:?}"));
        }
    }
    if loss.spectral > 0.0 && pair.ground_truth.is_none() {
        return Err("the spectral loss needs the functional maps of the ground truth".into());
    }
    if loss.soft_error > 0.0 && pair.target.distances.is_none() {
        return Err("the soft error needs the distances of the target".into());
    }
    let outside = |&&(i, j): &&(u32, u32)| i as usize >= common || j as usize >= common;
    if let Some((i, j)) = pair.negatives.iter().find(outside) {
        return Err(format!("negative pair ({i}, {j}) of {common} points"));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
