//! `fmnet-train export`.

use crate::args::{Common, ExportArgs};
use anyhow::Result;
use candle_core::Device;
use fmnet::network::contract::{FORMAT_VERSION, ModelMetadata};
use fmnet_trainer::checkpoint::Checkpoint;
use fmnet_trainer::export::export;
use fmnet_trainer::network::Normalization;
use fmnet_trainer::train::{BEST, LAST};
use serde_json::json;
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &ExportArgs, common: &Common) -> Result<()> {
    let path = checkpoint_path(&args.checkpoint);
    let checkpoint = Checkpoint::read(&path)?;
    let metadata = metadata(args, &checkpoint);
    export(&checkpoint.network(&Device::Cpu)?, &metadata, &args.output)?;
    if !common.quiet {
        eprintln!("{} -> {} ({} minibatches)", path.display(), args.output.display(), checkpoint.step);
    }
    if common.json {
        println!("{:#}", json!({ "checkpoint": path, "model": args.output, "metadata": metadata }));
    }
    Ok(())
}

fn checkpoint_path(given: &Path) -> PathBuf {
    match (given.is_dir(), given.join(BEST)) {
        (true, best) if best.is_file() => best,
        (true, _) => given.join(LAST),
        (false, _) => given.to_path_buf(),
    }
}

fn metadata(args: &ExportArgs, checkpoint: &Checkpoint) -> ModelMetadata {
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
        solver: config.runtime_solver(),
        decimate: shape.decimate,
        per_shape_statistics: config.normalization == Normalization::PerShape,
        training_set: args.training_set.clone().unwrap_or_else(datasets),
        seed: config.seed,
        steps: checkpoint.step,
        commit: args.commit.clone(),
        license: args.license.clone(),
    }
}
