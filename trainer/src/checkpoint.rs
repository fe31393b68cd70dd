//! Checkpoints: everything that a run needs to go on exactly where it was.
//!
//! A safetensors file with every parameter under its name, Adam's two moments under `adam.first.NAME` and
//! `adam.second.NAME`, and the running statistics; its metadata holds the configuration, the number of minibatches
//! done and the best validation. Minibatches are a function of seed and number, so no generator needs saving. Written
//! to a temporary name and renamed.

use crate::config::TrainConfig;
use crate::network::{BatchMoments, Network, Statistics, parameter_values, set_parameter_values};
use crate::optimizer::AdamState;
use crate::step::StepRunner;
use candle_core::Device;
use fmnet::diffusion_net::Parameter;
use fmnet::io::{IoError, write_atomically};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use thiserror::Error;

const FORMAT: &str = "2";
/// The format of earlier versions: three flat tensors.
const FLAT_FORMAT: &str = "1";

/// A saved state of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The run's configuration.
    pub config: TrainConfig,
    /// Minibatches done.
    pub step: u64,
    /// Best validated mean error over sqrt(area), times 100, so far; infinite before the first validation.
    pub best_error: f64,
    /// Flat parameters, `[p]`.
    pub parameters: Vec<f32>,
    /// The optimiser's state.
    pub adam: AdamState,
    /// Running statistics of the two normalisations of each block, `[blocks, 2]`; none where the network keeps none.
    pub running: Statistics,
}

/// Why a checkpoint cannot be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is not a checkpoint of this version.
    #[error("{path}: {reason}; it is no checkpoint of this version")]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Candle failed.
    #[error(transparent)]
    Tensor(#[from] candle_core::Error),
}

impl Checkpoint {
    /// The state of a runner after `step` minibatches.
    ///
    /// # Errors
    /// If the parameters cannot be read from the device.
    pub fn of(
        runner: &StepRunner,
        config: &TrainConfig,
        step: u64,
        best_error: f64,
    ) -> Result<Self, CheckpointError> {
        Ok(Self {
            config: config.clone(),
            step,
            best_error,
            parameters: parameter_values(runner.network.as_ref())?,
            adam: runner.adam.state()?,
            running: runner.network.statistics(),
        })
    }

    /// A runner in this state.
    ///
    /// # Errors
    /// If the state does not fit the configuration's network.
    pub fn into_runner(self, device: &Device) -> Result<StepRunner, CheckpointError> {
        let network = self.network(device)?;
        let mut runner = StepRunner::new(network, self.config.step_options())
            .map_err(|e| candle_core::Error::msg(e.to_string()))?;
        runner.adam.restore(self.adam)?;
        Ok(runner)
    }

    /// The network in this state.
    ///
    /// # Errors
    /// If the state does not fit the configuration's network.
    pub fn network(&self, device: &Device) -> Result<Box<dyn Network>, CheckpointError> {
        let mut network = self.config.network.build(self.config.seed, device)?;
        set_parameter_values(network.as_ref(), &self.parameters)?;
        network.set_statistics(self.running.clone())?;
        Ok(network)
    }

    /// Writes the file.
    ///
    /// # Errors
    /// If the file cannot be written, or the state does not fit the configuration's network.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let running: Vec<f64> =
            self.running.iter().flatten().flat_map(|m| m.mean.iter().chain(&m.variance).copied()).collect();
        let metadata = HashMap::from([
            ("format".to_string(), FORMAT.to_string()),
            ("config".to_string(), self.config.to_toml()),
            ("step".to_string(), self.step.to_string()),
            ("adam_step".to_string(), self.adam.step.to_string()),
            ("best_error".to_string(), self.best_error.to_string()),
        ]);
        let content = |reason: safetensors::SafeTensorError| self.error(path, reason.to_string());
        let mut tensors = Vec::new();
        let all = [("", &self.parameters), (FIRST, &self.adam.first), (SECOND, &self.adam.second)];
        for parameter in self.config.network.parameters() {
            for (prefix, values) in all {
                let Some(values) = values.get(parameter.offset..parameter.offset + parameter.len()) else {
                    let reason = format!("{} numbers end before {}", values.len(), parameter.name);
                    return Err(self.error(path, reason));
                };
                let bytes = bytemuck::cast_slice(values);
                let view = TensorView::new(Dtype::F32, parameter.shape.clone(), bytes).map_err(content)?;
                tensors.push((format!("{prefix}{}", parameter.name), view));
            }
        }
        let bytes = bytemuck::cast_slice(&running);
        let view = TensorView::new(Dtype::F64, vec![running.len()], bytes).map_err(content)?;
        tensors.push((RUNNING.to_string(), view));
        let bytes = safetensors::serialize(tensors, Some(metadata)).map_err(content)?;
        Ok(write_atomically(path, |out| out.write_all(&bytes))?)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If the file cannot be read or is not a checkpoint of this version or an earlier one.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let bytes = std::fs::read(path)
            .map_err(|source| CheckpointError::Read { path: path.to_path_buf(), source })?;
        Self::decode(&bytes).map_err(|reason| CheckpointError::Content { path: path.to_path_buf(), reason })
    }

    fn decode(bytes: &[u8]) -> Result<Self, String> {
        let text = |e: safetensors::SafeTensorError| e.to_string();
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(text)?;
        let metadata = header.metadata().clone().unwrap_or_default();
        let value = |key: &str| metadata.get(key).cloned().ok_or_else(|| format!("no {key} in its metadata"));
        let config = TrainConfig::parse(&value("config")?)?;
        config.network.check()?;
        let tensors = SafeTensors::deserialize(bytes).map_err(text)?;
        let [parameters, first, second] = match value("format")?.as_str() {
            FLAT_FORMAT => ["parameters", "adam.first", "adam.second"].map(|name| array(&tensors, name)),
            FORMAT => {
                let infos = config.network.parameters();
                ["", FIRST, SECOND].map(|prefix| flat(&tensors, prefix, &infos))
            }
            other => return Err(format!("format {other}")),
        };
        let running: Vec<f64> = bytemuck::pod_collect_to_vec(tensors.tensor(RUNNING).map_err(text)?.data());
        let blocks = match &config.network {
            crate::network::NetworkOptions::Residual(options) => options.blocks,
            crate::network::NetworkOptions::Diffusion(_) => 0,
        };
        Ok(Self {
            running: moments(&running, blocks)?,
            config,
            step: number(&value("step")?)?,
            best_error: number(&value("best_error")?)?,
            parameters: parameters?,
            adam: AdamState { step: number(&value("adam_step")?)?, first: first?, second: second? },
        })
    }

    fn error(&self, path: &Path, reason: String) -> CheckpointError {
        CheckpointError::Content { path: path.to_path_buf(), reason }
    }
}

/// Names of Adam's moments begin so.
const FIRST: &str = "adam.first.";
const SECOND: &str = "adam.second.";
/// Name of the running statistics.
const RUNNING: &str = "running";

fn array(tensors: &SafeTensors, name: &str) -> Result<Vec<f32>, String> {
    let tensor = tensors.tensor(name).map_err(|e| format!("{name}: {e}"))?;
    Ok(bytemuck::pod_collect_to_vec(tensor.data()))
}

/// The named parameters one after another.
fn flat(tensors: &SafeTensors, prefix: &str, parameters: &[Parameter]) -> Result<Vec<f32>, String> {
    let mut values = Vec::new();
    for parameter in parameters {
        let name = format!("{prefix}{}", parameter.name);
        let part = array(tensors, &name)?;
        if part.len() != parameter.len() {
            return Err(format!("{name} has {} numbers instead of {:?}", part.len(), parameter.shape));
        }
        values.extend(part);
    }
    Ok(values)
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{text:?} is no number"))
}

fn moments(values: &[f64], blocks: usize) -> Result<Statistics, String> {
    if blocks == 0 && values.is_empty() {
        return Ok(Vec::new());
    }
    let width = values.len() / (4 * blocks.max(1));
    if width == 0 || values.len() != width * 4 * blocks {
        return Err(format!("{} running statistics for {blocks} blocks", values.len()));
    }
    let one = |part: &[f64]| BatchMoments { mean: part[..width].to_vec(), variance: part[width..].to_vec() };
    let block = |part: &[f64]| [one(&part[..2 * width]), one(&part[2 * width..])];
    Ok(values.chunks(4 * width).map(block).collect())
}
