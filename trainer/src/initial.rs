//! The network that a new run begins with: random weights, those of a checkpoint, or those of a model file.
//!
//! A model file has all that a DiffusionNet computes with, so that who has no checkpoint, as nobody has of the
//! built-in model, can train it on. Adam begins anew in each case.

use crate::checkpoint::Checkpoint;
use crate::config::TrainConfig;
use crate::network::{DiffusionOptions, Network, NetworkOptions, set_parameter_values};
use crate::train::TrainError;
use candle_core::Device;
use fmnet::network::NativeNetwork;
use fmnet::pipeline::{MatchOptions, Matcher, ModelSource};
use std::path::Path;

/// What stands for the built-in model.
const EMBEDDED: &str = "embedded";
/// What a model file's name ends with.
const MODEL: &str = "onnx";

/// The network that a new run begins with.
///
/// # Errors
/// If the file cannot be read, or holds the weights of another network than the run's.
pub(crate) fn initial_network(config: &TrainConfig, device: &Device) -> Result<Box<dyn Network>, TrainError> {
    let path = &config.initial;
    if path.as_os_str().is_empty() {
        return Ok(config.network.build(config.seed, device)?);
    }
    let embedded = path.as_os_str() == EMBEDDED;
    if embedded || path.extension().is_some_and(|end| end.eq_ignore_ascii_case(MODEL)) {
        let source = if embedded { ModelSource::Embedded } else { ModelSource::File(path.clone()) };
        return of_model(source, path, config, device);
    }
    let checkpoint = Checkpoint::read(path)?;
    check(path, &checkpoint.config.network, &config.network)?;
    Ok(checkpoint.network(device)?)
}

fn of_model(
    source: ModelSource,
    path: &Path,
    config: &TrainConfig,
    device: &Device,
) -> Result<Box<dyn Network>, TrainError> {
    let matcher = Matcher::new(&MatchOptions::default().model(source))
        .map_err(|source| TrainError::InitialModel { source: Box::new(source) })?;
    let model = matcher.network().and_then(|network| network.native());
    let model = model.ok_or_else(|| TrainError::NoDiffusionNet { path: path.to_path_buf() })?;
    // The scale of SHOT is in the file's weights, whatever it was.
    let scale = match &config.network {
        NetworkOptions::Diffusion(options) if options.takes_shot() => options.shot_scale,
        _ => 1.0,
    };
    let options = options_of(model, if model.takes_shot() { scale } else { 0.0 });
    let mut weights = model.parameters().to_vec();
    // Empty where it takes no SHOT.
    let of_shot = options.wks_energies * options.width..options.inputs() * options.width;
    weights[of_shot].iter_mut().for_each(|weight| *weight /= scale as f32);
    let found = NetworkOptions::Diffusion(options);
    check(path, &found, &config.network)?;
    let network = found.build(config.seed, device)?;
    set_parameter_values(network.as_ref(), &weights)?;
    Ok(network)
}

fn options_of(model: &NativeNetwork, shot_scale: f64) -> DiffusionOptions {
    let (architecture, wks) = (model.architecture(), model.wks());
    DiffusionOptions {
        blocks: architecture.blocks,
        width: architecture.width,
        outputs: architecture.outputs,
        eigenfunctions: model.eigenpairs(),
        wks_energies: wks.energies,
        wks_eigenfunctions: wks.k,
        shot_scale,
    }
}

fn check(path: &Path, found: &NetworkOptions, wanted: &NetworkOptions) -> Result<(), TrainError> {
    if found == wanted {
        return Ok(());
    }
    Err(TrainError::OtherNetwork {
        path: path.display().to_string(),
        found: format!("{found:?}"),
        wanted: format!("{wanted:?}"),
    })
}
