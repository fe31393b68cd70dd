//! Descriptor networks with gradients: the paper's residual network and DiffusionNet.
//!
//! A network maps what it is given of a shape ([`NetworkInput`]) to descriptors `[n, d]`. All its parameters live in
//! one flat variable; [`Network::parameters`] names its parts. On the CPU a network is one fused op with a backward
//! pass written by hand; elsewhere it is composed of Candle's ops.

pub mod diffusion;
pub mod residual;

pub use diffusion::{DiffusionNetwork, DiffusionOptions};
pub use residual::{Activation, BatchMoments, Normalization, ResidualNetwork, ResidualOptions, WeightInit};

use candle_core::{DType, Device, Result, Tensor, Var};
use fmnet::Matrix;
use fmnet::diffusion_net::{Operators, Parameter};
use serde::{Deserialize, Serialize};

/// What a network is given of a shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NetworkInput {
    /// Functions on the shape, `[n, inputs]`.
    pub features: Matrix<f32>,
    /// The shape's operators at unit area, for networks that see the surface; without eigenpairs for others.
    pub operators: Operators<f32>,
}

impl NetworkInput {
    /// The functions as a tensor.
    fn features_tensor(&self, device: &Device) -> Result<Tensor> {
        let shape = (self.features.rows(), self.features.cols());
        Tensor::from_slice(self.features.data(), shape, device)
    }
}

/// Running statistics of normalisations, `[blocks, 2]`; none where a network keeps none.
pub type Statistics = Vec<[BatchMoments; 2]>;

/// A network with its parameters.
pub trait Network: Send {
    /// All parameters, flat, in the order of [`Network::parameters`].
    fn variable(&self) -> &Var;

    /// Names, shapes and places of the parameters.
    fn parameters(&self) -> Vec<Parameter>;

    /// Width of the input functions.
    fn n_inputs(&self) -> usize;

    /// Width of the descriptors.
    fn n_outputs(&self) -> usize;

    /// Descriptors of each shape at test time, `[n, d]`; no gradient.
    ///
    /// # Errors
    /// If an input does not fit the network.
    fn forward(&self, shapes: &[&NetworkInput]) -> Result<Vec<Tensor>>;

    /// Descriptors of the shapes of a training step, `[n, d]` each, differentiable by [`Network::variable`] once, and
    /// the statistics of the step, for [`Network::accept`].
    ///
    /// # Errors
    /// If an input does not fit the network.
    fn forward_train(&mut self, shapes: &[&NetworkInput]) -> Result<(Vec<Tensor>, Statistics)>;

    /// Averages the statistics of a step that was taken into the running ones.
    fn accept(&mut self, _statistics: Statistics) {}

    /// The running statistics.
    fn statistics(&self) -> Statistics {
        Vec::new()
    }

    /// Replaces the running statistics.
    ///
    /// # Errors
    /// If they do not fit the network.
    fn set_statistics(&mut self, statistics: Statistics) -> Result<()> {
        match statistics.len() {
            0 => Ok(()),
            n => candle_core::bail!("running statistics of {n} blocks for a network that keeps none"),
        }
    }

    /// Adds the network to an ONNX graph; returns the name of its output, `[d, n]`, a channel a row.
    fn graph(
        &self,
        graph: &mut crate::export::GraphBuilder,
        parameters: &crate::export::Parameters,
    ) -> String;
}

/// Copies the flat parameters out, `[p]`.
///
/// # Errors
/// If they cannot be read from the device.
pub fn parameter_values(network: &dyn Network) -> Result<Vec<f32>> {
    network.variable().as_tensor().to_dtype(DType::F32)?.to_vec1()
}

/// Replaces the flat parameters, `[p]`.
///
/// # Errors
/// If there are more or fewer.
pub fn set_parameter_values(network: &dyn Network, values: &[f32]) -> Result<()> {
    network.variable().set(&Tensor::from_slice(values, values.len(), network.variable().device())?)
}

/// Which network, and what it looks like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NetworkOptions {
    /// The paper's, on SHOT descriptors point by point.
    Residual(ResidualOptions),
    /// DiffusionNet, which sees the surface.
    Diffusion(DiffusionOptions),
}

impl Default for NetworkOptions {
    fn default() -> Self {
        Self::Diffusion(DiffusionOptions::default())
    }
}

impl NetworkOptions {
    /// Says which option is out of its range.
    ///
    /// # Errors
    /// Its name, value and range.
    pub fn check(&self) -> std::result::Result<(), String> {
        match self {
            Self::Residual(options) => options.check(),
            Self::Diffusion(options) => options.check(),
        }
    }

    /// Names, shapes and places of the network's parameters.
    pub fn parameters(&self) -> Vec<Parameter> {
        match self {
            Self::Residual(options) => options.parameters(),
            Self::Diffusion(options) => options.parameters(),
        }
    }

    /// A network with seeded initial parameters.
    ///
    /// # Errors
    /// If an option is out of its range.
    pub fn build(&self, seed: u64, device: &Device) -> Result<Box<dyn Network>> {
        Ok(match self {
            Self::Residual(options) => Box::new(ResidualNetwork::new(options.clone(), seed, device)?),
            Self::Diffusion(options) => Box::new(DiffusionNetwork::new(options.clone(), seed, device)?),
        })
    }
}
