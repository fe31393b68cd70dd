//! One training step: network, projection, functional map, loss, gradient, Adam.

use crate::fm_layer::{FunctionalMap, functional_map};
use crate::loss::{LossOptions, siamese};
use crate::network::Network;
use crate::optimizer::{Adam, AdamOptions};
use crate::projection::{WeightedBasis, project};
use crate::soft_map::{SoftErrorInput, soft_error};
use candle_core::{DType, Tensor, backprop::GradStore};
use fmnet::Matrix;
use fmnet::fmap::{ColumnNorm, FmapSolver, resolvent_mask};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// One shape of a pair on its sampled points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeBatch {
    /// SHOT descriptors `[m, 352]`.
    pub shot: Matrix<f32>,
    /// Eigenfunctions on the samples `[m, k]`, for a shape scaled to unit area.
    pub basis: Matrix<f32>,
    /// Vertex areas `[m]`, for a shape scaled to unit area.
    pub mass: Vec<f32>,
    /// Eigenvalues `[k]`, for a shape scaled to unit area.
    pub eigenvalues: Vec<f64>,
    /// Geodesic distances between the samples `[m, m]` in units of sqrt(area). Needed of the target; given of the source
    /// too, the pair is used in both directions at once, at the cost of little more than one.
    pub distances: Option<Matrix<f32>>,
}

/// A pair on `m` sampled points, of which row `i` of the source corresponds to row `i` of the target. Where the source is a part
/// of the target, the target has further points, those that the part lacks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairBatch {
    /// The shape that is mapped.
    pub source: ShapeBatch,
    /// The shape that it is mapped to.
    pub target: ShapeBatch,
    /// Whether the source is a part of the target: the functional map is then solved for from the whole to the part, and only
    /// used from the part to the whole (see [`fmnet::fmap::part`]).
    pub source_is_part: bool,
    /// Pairs (source row, target row) that do not correspond, for the siamese loss.
    pub negatives: Vec<(u32, u32)>,
}

/// What a step minimises and how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StepOptions {
    /// How the functional map is solved for; default regularised.
    pub functional_map: FmapSolver,
    /// What is minimised; default the soft error.
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
    /// Mean geodesic error over sqrt(area) on the samples of the match by the soft map's largest entry; NaN for the
    /// siamese loss.
    pub hard_error: f64,
    /// Largest condition number of `F F^T` of all pairs and directions (1 for the siamese loss).
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
    pub network: Network,
    /// Its optimiser.
    pub adam: Adam,
    options: StepOptions,
}

/// Loss of a pair before the backward pass.
struct PairLoss {
    loss: Tensor,
    hard_error: f64,
    condition: f64,
}

impl StepRunner {
    /// A fresh optimiser for `network`.
    ///
    /// # Errors
    /// If Candle cannot make the optimiser's state.
    pub fn new(network: Network, options: StepOptions) -> Result<Self, StepError> {
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
    /// If a batch does not fit together, a layer fails, or loss or gradient are not finite; the parameters then stay as
    /// they were.
    pub fn step(&mut self, pairs: &[PairBatch], learning_rate: f64) -> Result<StepStats, StepError> {
        let (mut stats, gradient) = self.gradient(pairs)?;
        stats.gradient_norm = norm(&gradient)?;
        if !stats.loss.is_finite() || !stats.gradient_norm.is_finite() {
            return Err(StepError::NotFinite { loss: stats.loss, gradient_norm: stats.gradient_norm });
        }
        let gradient = match self.options.clip {
            Some(clip) if stats.gradient_norm > clip => (gradient * (clip / stats.gradient_norm))?,
            _ => gradient,
        };
        self.adam.update(self.network.variable(), &gradient, learning_rate)?;
        Ok(stats)
    }

    /// The mean loss of `pairs` and its gradient `[p]`, without a step; running statistics are updated. The norm of the
    /// gradient is left NaN.
    ///
    /// # Errors
    /// If there is no pair, a batch does not fit together, or a layer fails.
    pub fn gradient(&mut self, pairs: &[PairBatch]) -> Result<(StepStats, Tensor), StepError> {
        let share = 1.0 / pairs.len() as f64;
        let mut stats = StepStats { loss: 0.0, hard_error: 0.0, condition: 1.0, gradient_norm: f64::NAN };
        let mut sum: Option<Tensor> = None;
        for (index, pair) in pairs.iter().enumerate() {
            check(pair, self.network.options().width, &self.options.loss)
                .map_err(|reason| StepError::Batch { pair: index, reason })?;
            let PairLoss { loss, hard_error, condition } = self.pair_loss(pair)?;
            stats.loss += share * loss.to_dtype(DType::F64)?.to_scalar::<f64>()?;
            stats.hard_error += share * hard_error;
            stats.condition = stats.condition.max(condition);
            let gradient = take_gradient(&loss.backward()?, &self.network)?;
            sum = Some(match sum {
                Some(sum) => (sum + gradient)?,
                None => gradient,
            });
        }
        let sum = sum.ok_or(StepError::Batch { pair: 0, reason: "a step needs at least one pair".into() })?;
        let mean = if pairs.len() > 1 { (sum * share)? } else { sum };
        Ok((stats, mean))
    }

    fn pair_loss(&mut self, pair: &PairBatch) -> Result<PairLoss, candle_core::Error> {
        let device = self.network.variable().device().clone();
        let input = |shape: &ShapeBatch| {
            let shot = &shape.shot;
            Tensor::from_slice(shot.data(), (shot.rows(), shot.cols()), &device)
        };
        let descriptors = self.network.forward_train(&[input(&pair.source)?, input(&pair.target)?])?;
        match self.options.loss {
            LossOptions::SoftError { norm } => self.soft_error(&descriptors, pair, norm),
            LossOptions::Siamese { gamma, margin } => {
                let points = pair.source.shot.rows();
                let (source, target) =
                    (descriptors.narrow(0, 0, points)?, descriptors.narrow(0, points, points)?);
                let loss = siamese(&source, &target, &pair.negatives, gamma, margin)?;
                Ok(PairLoss { loss, hard_error: f64::NAN, condition: 1.0 })
            }
        }
    }

    /// The soft error of the pair, the mean over both directions where the source has distances too.
    fn soft_error(
        &self,
        descriptors: &Tensor,
        pair: &PairBatch,
        norm: ColumnNorm,
    ) -> Result<PairLoss, candle_core::Error> {
        let bases = [&pair.source, &pair.target].map(|s| WeightedBasis::<f32>::new(s.basis.data(), &s.mass));
        let (k_source, k_target) = (bases[0].k, bases[1].k);
        let spectral = project(descriptors, bases)?;
        let spectral_source = spectral.narrow(0, 0, k_source)?;
        let spectral_target = spectral.narrow(0, k_source, k_target)?;
        let mut total: Option<PairLoss> = None;
        let forward = (&pair.source, &spectral_source, &pair.target, &spectral_target);
        let backward = (&pair.target, &spectral_target, &pair.source, &spectral_source);
        for (source, spectral_source, target, spectral_target) in [forward, backward] {
            let Some(distances) = &target.distances else { continue };
            let mut solved = match pair.source_is_part {
                true => self.functional_map((target, spectral_target), (source, spectral_source))?,
                false => self.functional_map((source, spectral_source), (target, spectral_target))?,
            };
            if pair.source_is_part {
                solved.map = solved.map.t()?;
            }
            let matched = source.basis.rows() * target.basis.rows();
            let input = SoftErrorInput {
                basis_source: source.basis.data().to_vec(),
                basis_target: target.basis.data().to_vec(),
                distances: distances.data()[..matched].to_vec(),
                norm,
            };
            let error = soft_error(&solved.map, input)?;
            total = Some(match total {
                None => {
                    PairLoss { loss: error.loss, hard_error: error.hard_error, condition: solved.condition }
                }
                Some(other) => PairLoss {
                    loss: ((other.loss + error.loss)? * 0.5)?,
                    hard_error: 0.5 * (other.hard_error + error.hard_error),
                    condition: other.condition.max(solved.condition),
                },
            });
        }
        total.ok_or_else(|| candle_core::Error::msg("the soft error needs the distances of the target"))
    }
}

impl StepRunner {
    fn functional_map(
        &self,
        (from, spectral_from): (&ShapeBatch, &Tensor),
        (to, spectral_to): (&ShapeBatch, &Tensor),
    ) -> Result<FunctionalMap, candle_core::Error> {
        let mask = resolvent_mask(&from.eigenvalues, &to.eigenvalues);
        functional_map(spectral_from, spectral_to, self.options.functional_map, &mask)
    }
}

fn take_gradient(gradients: &GradStore, network: &Network) -> Result<Tensor, candle_core::Error> {
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
    let points = pair.source.shot.rows();
    for (name, shape) in [("source", &pair.source), ("target", &pair.target)] {
        let expect = |what: &str, found: (usize, usize), expected: (usize, usize)| {
            if found == expected {
                Ok(())
            } else {
                Err(format!("{what} of the {name} {found:?}, expected {expected:?}"))
            }
        };
        let (rows, k) = (shape.shot.rows(), shape.eigenvalues.len());
        let expected = if pair.source_is_part { rows.max(points) } else { points };
        expect("descriptors", (rows, shape.shot.cols()), (expected.max(1), width))?;
        if matches!(loss, LossOptions::SoftError { .. }) {
            expect("eigenfunctions", (shape.basis.rows(), shape.basis.cols()), (rows, k.max(1)))?;
            expect("vertex areas", (shape.mass.len(), 1), (rows, 1))?;
            if let Some(distances) = &shape.distances {
                expect("distances", (distances.rows(), distances.cols()), (rows, rows))?;
            }
        }
    }
    let soft = matches!(loss, LossOptions::SoftError { .. });
    if soft && pair.target.distances.is_none() {
        return Err("the soft error needs the distances of the target".into());
    }
    let outside = |&&(i, j): &&(u32, u32)| i as usize >= points || j as usize >= points;
    if let Some((i, j)) = pair.negatives.iter().find(outside) {
        return Err(format!("negative pair ({i}, {j}) of {points} points"));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
