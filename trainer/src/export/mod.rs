//! The network as an ONNX model file, by the contract of [`fmnet::network::contract`].
//!
//! Standard operators of opset 17, which onnxruntime, tract and onnxruntime-web all take.

mod graph;

pub use graph::GraphBuilder;
pub(crate) use graph::{axis, float, integer, integers};

use crate::checkpoint::Checkpoint;
use crate::network::{Network, NetworkOptions, Normalization, parameter_values};
use fmnet::diffusion_net::Parameter;
use fmnet::io::{IoError, write_atomically};
use fmnet::network::contract::{FORMAT_VERSION, ModelMetadata};
use fmnet::quality::Calibration;
use prost::Message;
use std::path::Path;
use thiserror::Error;

/// Why a network cannot be exported.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The parameters cannot be read from the device.
    #[error(transparent)]
    Tensor(#[from] candle_core::Error),
}

/// Where a model comes from, for its metadata.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelOrigin {
    /// What it was trained on; `None`, the default: the names of the dataset folders.
    pub training_set: Option<String>,
    /// Licence of the weights. Default `unspecified`.
    pub license: String,
    /// Revision of the source. Default: the version of this crate.
    pub commit: String,
    /// What turns the measures of its maps into an estimate of their error. Default: none, and the library's own is
    /// used.
    pub calibration: Option<Calibration>,
}

impl Default for ModelOrigin {
    fn default() -> Self {
        Self {
            training_set: None,
            license: "unspecified".into(),
            commit: env!("CARGO_PKG_VERSION").into(),
            calibration: None,
        }
    }
}

/// The metadata of a checkpoint's model.
pub fn metadata(checkpoint: &Checkpoint, origin: &ModelOrigin) -> ModelMetadata {
    let config = &checkpoint.config;
    let shape = config.shape_options();
    let folder_name = |folder: &String| {
        Path::new(folder).file_name().map_or(folder.clone(), |name| name.to_string_lossy().into_owned())
    };
    let datasets = || config.dataset.0.iter().map(folder_name).collect::<Vec<_>>().join(", ");
    ModelMetadata {
        format_version: FORMAT_VERSION,
        shot: config.shot_options(),
        k: config.k,
        solver: config.fmap_solver(),
        decimate: shape.decimate,
        per_shape_statistics: match &config.network {
            NetworkOptions::Residual(options) => options.normalization == Normalization::PerShape,
            NetworkOptions::Diffusion(_) => false,
        },
        training_set: origin.training_set.clone().unwrap_or_else(datasets),
        seed: config.seed,
        steps: checkpoint.step,
        commit: origin.commit.clone(),
        license: origin.license.clone(),
        calibration: origin.calibration,
    }
}

/// Writes a model file.
///
/// # Errors
/// As [`to_onnx`], and if the file cannot be written.
pub fn export(network: &dyn Network, metadata: &ModelMetadata, path: &Path) -> Result<(), ExportError> {
    let bytes = to_onnx(network, metadata)?;
    Ok(write_atomically(path, |out| out.write_all(&bytes))?)
}

/// The content of a model file.
///
/// # Errors
/// If the parameters cannot be read from the device.
pub fn to_onnx(network: &dyn Network, metadata: &ModelMetadata) -> Result<Vec<u8>, ExportError> {
    let parameters = Parameters { values: parameter_values(network)?, infos: network.parameters() };
    let mut graph = GraphBuilder::default();
    let output = network.graph(&mut graph, &parameters);
    Ok(graph.finish(&output, network.n_outputs(), &metadata.to_pairs()).encode_to_vec())
}

/// The parameters of a network by name.
pub struct Parameters {
    values: Vec<f32>,
    infos: Vec<Parameter>,
}

impl Parameters {
    pub(crate) fn get(&self, name: &str) -> &[f32] {
        let info = self.infos.iter().find(|info| info.name == name).expect("the network has this parameter");
        &self.values[info.offset..info.offset + info.len()]
    }

    /// Weight and bias of a linear layer.
    pub(crate) fn linear(&self, name: &str) -> (&[f32], &[f32]) {
        (self.get(&format!("{name}.weight")), self.get(&format!("{name}.bias")))
    }
}
