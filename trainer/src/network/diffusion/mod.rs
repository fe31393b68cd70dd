//! DiffusionNet (Sharp et al. 2022) as a Candle network; the equations stand in [`fmnet::diffusion_net`].

mod composed;
mod export;
mod op;
#[cfg(test)]
mod tests;

use super::{Network, NetworkInput, Statistics};
use candle_core::{Device, Result, Tensor, Var, bail};
use fmnet::diffusion_net::{Architecture, Parameter};
use fmnet::spectral::WksOptions;
use op::DiffusionOp;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Width of SHOT.
const SHOT_WIDTH: usize = 352;

/// What the network looks like and what it is fed with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct DiffusionOptions {
    /// Residual blocks; 1 to 64, default 4.
    pub blocks: usize,
    /// Channels; 1 to 1024, default 128.
    pub width: usize,
    /// Descriptors; 1 to 1024, default 128.
    pub outputs: usize,
    /// Eigenpairs of the diffusion; 1 to 500, default 128.
    pub eigenfunctions: usize,
    /// Energies of the wave kernel signature among the inputs; 0 (none) to 512, default 128.
    pub wks_energies: usize,
    /// Eigenpairs that it is computed from; 3 to 500, default 200.
    pub wks_eigenfunctions: usize,
    /// SHOT descriptors among the inputs are multiplied by this; 0 (no SHOT) to 1000, default 5.
    pub shot_scale: f64,
}

impl Default for DiffusionOptions {
    fn default() -> Self {
        let WksOptions { energies, k, .. } = WksOptions::default();
        Self {
            blocks: 4,
            width: 128,
            outputs: 128,
            eigenfunctions: 128,
            wks_energies: energies,
            wks_eigenfunctions: k,
            shot_scale: 5.0,
        }
    }
}

impl DiffusionOptions {
    /// Says which option is out of its range.
    ///
    /// # Errors
    /// Its name, value and range.
    pub fn check(&self) -> std::result::Result<(), String> {
        let range = |name: &str, value: usize, low: usize, high: usize| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(format!("{name} is {value}, but must be {low} to {high}")),
        };
        range("blocks", self.blocks, 1, 64)?;
        range("width", self.width, 1, 1024)?;
        range("outputs", self.outputs, 1, 1024)?;
        range("eigenfunctions", self.eigenfunctions, 1, 500)?;
        range("wks-energies", self.wks_energies, 0, 512)?;
        range("wks-eigenfunctions", self.wks_eigenfunctions, 3, 500)?;
        if !(0.0..=1000.0).contains(&self.shot_scale) {
            return Err(format!("shot-scale is {}, but must be 0 (no SHOT) to 1000", self.shot_scale));
        }
        match self.inputs() {
            0 => Err("the network has no inputs; set wks-energies or shot-scale above 0".into()),
            _ => Ok(()),
        }
    }

    /// Whether SHOT is among the inputs.
    pub fn takes_shot(&self) -> bool {
        self.shot_scale > 0.0
    }

    /// Width of the input functions: the wave kernel signature, then SHOT.
    pub fn inputs(&self) -> usize {
        self.wks_energies + if self.takes_shot() { SHOT_WIDTH } else { 0 }
    }

    /// Eigenpairs that the network needs of a shape.
    pub fn eigenpairs(&self) -> usize {
        if self.wks_energies > 0 {
            self.eigenfunctions.max(self.wks_eigenfunctions)
        } else {
            self.eigenfunctions
        }
    }

    /// Names, shapes and places of the parameters.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.architecture().parameters()
    }

    fn architecture(&self) -> Architecture {
        Architecture { inputs: self.inputs(), blocks: self.blocks, width: self.width, outputs: self.outputs }
    }
}

/// The network with its parameters.
pub struct DiffusionNetwork {
    options: DiffusionOptions,
    flat: Var,
}

impl DiffusionNetwork {
    /// A network with seeded initial parameters: linear layers uniform in `+- 1 / sqrt(inputs)`, as PyTorch has them,
    /// diffusion times at their lower bound.
    ///
    /// # Errors
    /// If an option is out of its range.
    pub fn new(options: DiffusionOptions, seed: u64, device: &Device) -> Result<Self> {
        if let Err(reason) = options.check() {
            bail!("network: {reason}");
        }
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        let mut flat = Vec::new();
        let mut fan_in = 1;
        for parameter in options.parameters() {
            if let [inputs, _] = parameter.shape[..] {
                fan_in = inputs;
            }
            let bound = 1.0 / (fan_in as f64).sqrt();
            match parameter.name.ends_with("time") {
                true => flat.extend(std::iter::repeat_n(0.0, parameter.len())),
                false => {
                    flat.extend((0..parameter.len()).map(|_| generator.random_range(-bound..bound) as f32))
                }
            }
        }
        let len = flat.len();
        Ok(Self { options, flat: Var::from_vec(flat, len, device)? })
    }

    /// What the network looks like.
    pub fn options(&self) -> &DiffusionOptions {
        &self.options
    }

    fn run(&self, shape: &NetworkInput, train: bool) -> Result<Tensor> {
        let k = shape.operators.k();
        if k != self.options.eigenfunctions {
            bail!("operators of {k} eigenpairs for a network of {}", self.options.eigenfunctions);
        }
        let architecture = self.options.architecture();
        if self.flat.device().is_cpu() {
            let (features, operators) = (shape.features.data().to_vec(), shape.operators.clone());
            return self.flat.as_tensor().apply_op1(DiffusionOp::new(
                architecture,
                features,
                operators,
                train,
            ));
        }
        composed::forward(&architecture, self.flat.as_tensor(), shape)
    }
}

impl Network for DiffusionNetwork {
    fn variable(&self) -> &Var {
        &self.flat
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.options.parameters()
    }

    fn n_inputs(&self) -> usize {
        self.options.inputs()
    }

    fn n_outputs(&self) -> usize {
        self.options.outputs
    }

    fn forward(&self, shapes: &[&NetworkInput]) -> Result<Vec<Tensor>> {
        shapes.iter().map(|shape| Ok(self.run(shape, false)?.detach())).collect()
    }

    fn forward_train(&mut self, shapes: &[&NetworkInput]) -> Result<(Vec<Tensor>, Statistics)> {
        let out = shapes.iter().map(|shape| self.run(shape, true)).collect::<Result<_>>()?;
        Ok((out, Vec::new()))
    }

    fn graph(
        &self,
        graph: &mut crate::export::GraphBuilder,
        parameters: &crate::export::Parameters,
    ) -> String {
        export::graph(&self.options, graph, parameters)
    }
}
