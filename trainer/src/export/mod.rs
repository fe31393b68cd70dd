//! The network as an ONNX model file, by the contract of [`fmnet::network::contract`].
//!
//! Standard operators of opset 17, which onnxruntime, tract and onnxruntime-web all take. Statistics of each shape stay in the
//! graph, as `ReduceMean` over the vertices; trained statistics are folded into the linear layers.

mod graph;

use crate::checkpoint::Checkpoint;
use crate::network::{Network, Normalization};
use fmnet::io::{IoError, write_atomically};
use fmnet::network::contract::{FORMAT_VERSION, ModelMetadata, WIDTH};
use graph::GraphBuilder;
use prost::Message;
use std::path::Path;
use thiserror::Error;

/// Why a network cannot be exported.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The network has another width than the contract.
    #[error("the network is {width} wide, but a model file is {WIDTH} wide")]
    Width {
        /// Its width.
        width: usize,
    },
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
}

impl Default for ModelOrigin {
    fn default() -> Self {
        Self { training_set: None, license: "unspecified".into(), commit: env!("CARGO_PKG_VERSION").into() }
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
        shot: shape.shot,
        k: shape.k,
        solver: config.fmap_solver(),
        decimate: shape.decimate,
        per_shape_statistics: config.normalization == Normalization::PerShape,
        training_set: origin.training_set.clone().unwrap_or_else(datasets),
        seed: config.seed,
        steps: checkpoint.step,
        commit: origin.commit.clone(),
        license: origin.license.clone(),
    }
}

/// Writes a model file.
///
/// # Errors
/// As [`to_onnx`], and if the file cannot be written.
pub fn export(network: &Network, metadata: &ModelMetadata, path: &Path) -> Result<(), ExportError> {
    let bytes = to_onnx(network, metadata)?;
    Ok(write_atomically(path, |out| out.write_all(&bytes))?)
}

/// The content of a model file.
///
/// # Errors
/// If the network is not 352 wide, or its parameters cannot be read from the device.
pub fn to_onnx(network: &Network, metadata: &ModelMetadata) -> Result<Vec<u8>, ExportError> {
    let options = network.options();
    if options.width != WIDTH {
        return Err(ExportError::Width { width: options.width });
    }
    let parameters = Parameters { values: network.parameter_values()?, infos: network.parameters() };
    let mut graph = GraphBuilder::new(WIDTH, options.activation, options.epsilon as f32);
    let mut x = graph.input();
    for block in 0..options.blocks {
        let half = |graph: &mut GraphBuilder, input: &str, half: usize| {
            let part = |name: &str| parameters.get(&format!("blocks.{block}.{name}"));
            let weight = part(&format!("linear{half}.weight"));
            let (scale, shift) = (part(&format!("norm{half}.scale")), part(&format!("norm{half}.shift")));
            let name = format!("block{block}.{half}");
            match options.normalization {
                Normalization::PerShape => graph.normalized_linear(&name, input, weight, scale, shift),
                Normalization::Running => {
                    let moments = &network.running_statistics()[block][half - 1];
                    let (weight, bias) =
                        folded(weight, scale, shift, &moments.mean, &moments.variance, options.epsilon);
                    graph.linear(&name, input, &weight, &bias)
                }
            }
        };
        let inner = half(&mut graph, &x, 1);
        let inner = graph.activation(&format!("block{block}.1.activation"), &inner);
        let outer = half(&mut graph, &inner, 2);
        let sum = graph.add(&format!("block{block}.sum"), &x, &outer);
        x = graph.activation(&format!("block{block}.activation"), &sum);
    }
    Ok(graph.finish(&x, &metadata.to_pairs()).encode_to_vec())
}

struct Parameters {
    values: Vec<f32>,
    infos: Vec<crate::network::ParameterInfo>,
}

impl Parameters {
    fn get(&self, name: &str) -> &[f32] {
        let info = self.infos.iter().find(|info| info.name == name).expect("the network has this parameter");
        &self.values[info.offset..info.offset + info.len()]
    }
}

/// A linear layer and the normalisation after it as one linear layer: `scale (x W - mean) / sqrt(variance + epsilon) + shift`.
fn folded(
    weight: &[f32],
    scale: &[f32],
    shift: &[f32],
    mean: &[f64],
    variance: &[f64],
    epsilon: f64,
) -> (Vec<f32>, Vec<f32>) {
    let width = scale.len();
    let factor: Vec<f64> = (0..width).map(|j| f64::from(scale[j]) / (variance[j] + epsilon).sqrt()).collect();
    let bias = (0..width).map(|j| (f64::from(shift[j]) - mean[j] * factor[j]) as f32).collect();
    let weight = weight.iter().enumerate().map(|(i, &w)| (f64::from(w) * factor[i % width]) as f32).collect();
    (weight, bias)
}
