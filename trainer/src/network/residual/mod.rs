//! The paper's network: residual blocks on SHOT descriptors (section "Implementation details").
//!
//! Each block is `y = act(norm1(x W1))`, `out = act(x + norm2(y W2))`, with `x` `[n, width]` and weights
//! `[width in, width out]`; there are no biases, which a normalisation would cancel. A normalisation maps each
//! channel to mean 0 and variance 1, then multiplies it by a learnable scale and adds a learnable shift.
//!
//! All parameters live in one flat variable, in the order of [`Network::parameters`]; on the CPU the network is one
//! fused op, elsewhere it is composed of Candle's ops.

mod block;
mod composed;
mod export;
mod fused;
mod init;
mod norm;
mod pool;

pub use init::WeightInit;

use super::Statistics;
use super::{Network, NetworkInput};
use candle_core::{DType, Device, Result, Tensor, Var, bail};
use fmnet::diffusion_net::Parameter;
use fused::{FusedNetwork, SavedActivations, StatisticsOf};
use norm::Moments;
use pool::BufferPool;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Activation between the layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// `x` above 0, `exp(x) - 1` below (the paper).
    #[default]
    Elu,
    /// `max(x, 0)` (the authors' code).
    Relu,
}

/// Over which rows a normalisation takes its statistics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Normalization {
    /// Over the vertices of each shape, in training and at test time, as the authors' code has it in effect.
    #[default]
    PerShape,
    /// Over both shapes of a pair in training; at test time exponential averages of those, which an export folds into
    /// the linear layers.
    Running,
}

/// What the network looks like and how it starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct ResidualOptions {
    /// Number of residual blocks; at least 1, default 7.
    pub blocks: usize,
    /// Number of channels; default 352, that of SHOT.
    pub width: usize,
    /// Activation; default ELU.
    pub activation: Activation,
    /// Statistics of the normalisations; default per shape.
    pub normalization: Normalization,
    /// Added to variances; above 0, default 1e-5.
    pub epsilon: f64,
    /// Share of the new value in a running statistic; 0 to 1, default 0.01.
    pub momentum: f64,
    /// Distribution of the initial weights; default Xavier.
    pub weight_init: WeightInit,
    /// Initial scale of each block's second normalisation; 0 starts at the identity; default 1.
    pub residual_scale: f64,
}

impl Default for ResidualOptions {
    fn default() -> Self {
        Self {
            blocks: 7,
            width: 352,
            activation: Activation::Elu,
            normalization: Normalization::PerShape,
            epsilon: 1e-5,
            momentum: 0.01,
            weight_init: WeightInit::Xavier,
            residual_scale: 1.0,
        }
    }
}

/// Mean and variance, `[width]` each, that a normalisation uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatchMoments {
    /// Mean of each channel.
    pub mean: Vec<f64>,
    /// Biased variance of each channel.
    pub variance: Vec<f64>,
}

impl BatchMoments {
    fn to_moments(&self) -> Moments {
        Moments { count: 1.0, mean: self.mean.clone(), variance: self.variance.clone() }
    }

    fn to_tensors(&self, like: &Tensor) -> Result<(Tensor, Tensor)> {
        let row = |v: &[f64]| Tensor::new(v, &Device::Cpu)?.to_dtype(like.dtype())?.to_device(like.device());
        Ok((row(&self.mean)?.unsqueeze(0)?, row(&self.variance)?.unsqueeze(0)?))
    }

    fn from_tensors((mean, variance): &(Tensor, Tensor)) -> Result<Self> {
        let row = |t: &Tensor| t.flatten_all()?.to_dtype(DType::F64)?.to_vec1();
        Ok(Self { mean: row(mean)?, variance: row(variance)? })
    }
}

/// The network with its parameters and running statistics.
pub struct ResidualNetwork {
    options: ResidualOptions,
    flat: Var,
    running: Vec<[BatchMoments; 2]>,
    pool: Arc<BufferPool<f32>>,
}

impl ResidualOptions {
    /// Says which option is out of its range.
    ///
    /// # Errors
    /// Its name, value and range.
    pub fn check(&self) -> std::result::Result<(), String> {
        match () {
            () if !(1..=64).contains(&self.blocks) => {
                Err(format!("blocks is {}, but must be from 1 to 64", self.blocks))
            }
            () if self.width == 0 => Err("width is 0, but must be 1 or more".into()),
            () if !(self.epsilon > 0.0) => Err(format!("epsilon is {}, but must be above 0", self.epsilon)),
            () => Ok(()),
        }
    }

    /// Names, shapes and places of the parameters: block by block, weight, scale and shift of its two halves.
    pub fn parameters(&self) -> Vec<Parameter> {
        let width = self.width;
        let mut offset = 0;
        let mut parameters = Vec::new();
        for block in 0..self.blocks {
            for half in 1..=2 {
                let parts = [
                    (format!("linear{half}.weight"), vec![width, width]),
                    (format!("norm{half}.scale"), vec![width]),
                    (format!("norm{half}.shift"), vec![width]),
                ];
                for (name, shape) in parts {
                    let parameter = Parameter { name: format!("blocks.{block}.{name}"), shape, offset };
                    offset += parameter.len();
                    parameters.push(parameter);
                }
            }
        }
        parameters
    }
}

impl ResidualNetwork {
    /// A network with seeded initial parameters; fails where `blocks`, `width` or `epsilon` is out of range.
    pub fn new(options: ResidualOptions, seed: u64, device: &Device) -> Result<Self> {
        if let Err(reason) = options.check() {
            bail!("network: {reason}");
        }
        let ResidualOptions { blocks, width, weight_init, residual_scale, .. } = options;
        let flat = init::initialize(blocks, width, weight_init, residual_scale, seed);
        let len = flat.len();
        let fresh = BatchMoments { mean: vec![0.0; width], variance: vec![1.0; width] };
        Ok(Self {
            flat: Var::from_vec(flat, len, device)?,
            running: vec![[fresh.clone(), fresh]; blocks],
            pool: Arc::default(),
            options,
        })
    }

    /// What the network looks like.
    pub fn options(&self) -> &ResidualOptions {
        &self.options
    }

    /// The running statistics, `[blocks, 2]`: of each block, its two normalisations. Used with
    /// [`Normalization::Running`] only.
    pub fn running_statistics(&self) -> &[[BatchMoments; 2]] {
        &self.running
    }

    /// Replaces the running statistics; fails where they are not of as many blocks or of another width.
    pub fn set_running_statistics(&mut self, statistics: Vec<[BatchMoments; 2]>) -> Result<()> {
        let fits =
            |m: &BatchMoments| m.mean.len() == self.options.width && m.variance.len() == self.options.width;
        if statistics.len() != self.options.blocks || !statistics.iter().flatten().all(fits) {
            bail!(
                "running statistics do not fit {} blocks of width {}",
                self.options.blocks,
                self.options.width
            );
        }
        self.running = statistics;
        Ok(())
    }

    /// Averages the moments of a training step into the running statistics.
    fn blend(&mut self, moments: &[[BatchMoments; 2]]) {
        let momentum = self.options.momentum;
        let blend = |old: &mut [f64], new: &[f64]| {
            old.iter_mut().zip(new).for_each(|(old, new)| *old += momentum * (new - *old));
        };
        for (running, batch) in self.running.iter_mut().flatten().zip(moments.iter().flatten()) {
            blend(&mut running.mean, &batch.mean);
            blend(&mut running.variance, &batch.variance);
        }
    }

    /// Runs the network; returns the batch's moments too where the running statistics want them.
    fn run(
        &self,
        shapes: &[Tensor],
        fixed: Option<&[[BatchMoments; 2]]>,
        train: bool,
    ) -> Result<(Tensor, Vec<[BatchMoments; 2]>)> {
        let rows = shapes.iter().map(|shape| Ok(shape.dims2()?.0)).collect::<Result<Vec<_>>>()?;
        let per_shape = self.options.normalization == Normalization::PerShape;
        let groups = if per_shape { rows.clone() } else { vec![rows.iter().sum()] };
        let input = Tensor::cat(shapes, 0)?;
        if input.dims2()?.1 != self.options.width || rows.contains(&0) {
            bail!("the network takes shapes [n, {}] with n >= 1; got rows {rows:?}", self.options.width);
        }
        let track = !per_shape && train;
        if input.device().is_cpu() {
            return self.run_fused(&input, groups, fixed, train, track);
        }
        let out = composed::forward(&self.options, self.flat.as_tensor(), &input, &groups, fixed)?;
        let read = |[first, second]: &[(Tensor, Tensor); 2]| {
            Ok([BatchMoments::from_tensors(first)?, BatchMoments::from_tensors(second)?])
        };
        let tracked = if track { out.moments.as_slice() } else { &[] };
        Ok((out.descriptors, tracked.iter().map(read).collect::<Result<_>>()?))
    }

    fn run_fused(
        &self,
        input: &Tensor,
        groups: Vec<usize>,
        fixed: Option<&[[BatchMoments; 2]]>,
        train: bool,
        track: bool,
    ) -> Result<(Tensor, Vec<[BatchMoments; 2]>)> {
        let statistics = match fixed {
            Some(blocks) => StatisticsOf::Fixed { rows: input.dims2()?.0, blocks: blocks.to_vec() },
            None => StatisticsOf::Groups(groups),
        };
        let saved = SavedActivations::<f32>::default();
        let op = FusedNetwork {
            input: input.flatten_all()?.to_vec1()?,
            width: self.options.width,
            blocks: self.options.blocks,
            epsilon: self.options.epsilon,
            activation: self.options.activation,
            statistics,
            train,
            pool: self.pool.clone(),
            saved: saved.clone(),
        };
        let out = self.flat.as_tensor().apply_op1(op)?;
        let moments = if track { fused::batch_moments(&saved) } else { Vec::new() };
        Ok((out, moments))
    }
}

impl Network for ResidualNetwork {
    fn variable(&self) -> &Var {
        &self.flat
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.options.parameters()
    }

    fn n_inputs(&self) -> usize {
        self.options.width
    }

    fn n_outputs(&self) -> usize {
        self.options.width
    }

    fn forward(&self, shapes: &[&NetworkInput]) -> Result<Vec<Tensor>> {
        let running = self.options.normalization == Normalization::Running;
        let tensors = tensors(shapes, self.flat.device())?;
        let (out, _) = self.run(&tensors, running.then_some(self.running.as_slice()), false)?;
        split(&out.detach(), &tensors)
    }

    fn forward_train(&mut self, shapes: &[&NetworkInput]) -> Result<(Vec<Tensor>, Statistics)> {
        let tensors = tensors(shapes, self.flat.device())?;
        let (out, moments) = self.run(&tensors, None, true)?;
        Ok((split(&out, &tensors)?, moments))
    }

    fn accept(&mut self, statistics: Statistics) {
        self.blend(&statistics);
    }

    fn statistics(&self) -> Statistics {
        self.running.clone()
    }

    fn set_statistics(&mut self, statistics: Statistics) -> Result<()> {
        self.set_running_statistics(statistics)
    }

    fn graph(
        &self,
        graph: &mut crate::export::GraphBuilder,
        parameters: &crate::export::Parameters,
    ) -> String {
        export::graph(self, graph, parameters)
    }
}

fn tensors(shapes: &[&NetworkInput], device: &Device) -> Result<Vec<Tensor>> {
    shapes.iter().map(|shape| shape.features_tensor(device)).collect()
}

/// The rows of each shape of `out`, one below the other.
fn split(out: &Tensor, shapes: &[Tensor]) -> Result<Vec<Tensor>> {
    let mut start = 0;
    let part = |shape: &Tensor| {
        let rows = shape.dims2()?.0;
        start += rows;
        out.narrow(0, start - rows, rows)
    };
    shapes.iter().map(part).collect()
}

#[cfg(test)]
mod tests;
