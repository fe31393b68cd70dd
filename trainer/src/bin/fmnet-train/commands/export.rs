//! `fmnet-train export`.

use crate::args::{Common, ExportArgs};
use crate::progress::{print_summary, shown};
use anyhow::{Context, Result, anyhow, bail};
use candle_core::Device;
use fmnet::io::print_error_line;
use fmnet::quality::Calibration;
use fmnet_trainer::checkpoint::Checkpoint;
use fmnet_trainer::export::{ModelOrigin, export, metadata};
use fmnet_trainer::train::best_checkpoint;
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &ExportArgs, common: &Common) -> Result<()> {
    let path =
        if args.checkpoint.is_dir() { best_checkpoint(&args.checkpoint) } else { args.checkpoint.clone() };
    let checkpoint = Checkpoint::read(&path)?;
    let origin = ModelOrigin {
        training_set: args.training_set.clone(),
        license: args.license.clone(),
        commit: args.commit.clone(),
        calibration: args.calibration.as_deref().map(read_calibration).transpose()?,
    };
    let mut metadata = metadata(&checkpoint, &origin);
    metadata.k = args.k.map_or(metadata.k, usize::from);
    match args.decimate {
        Some(n @ 1..100) => bail!("--decimate is {n}, but must be 100 or more, or 0 (never)"),
        Some(n) => metadata.decimate = Some(n).filter(|&n| n > 0),
        None => {}
    }
    export(checkpoint.network(&Device::Cpu)?.as_ref(), &metadata, &args.output)?;
    if !common.quiet {
        print_error_line(&format!(
            "{} -> {} ({} minibatches)",
            path.display(),
            args.output.display(),
            checkpoint.step
        ));
    }
    if common.json {
        print_summary(
            &json!({ "checkpoint": shown(&path), "model": shown(&args.output), "metadata": metadata }),
        )?;
    }
    Ok(())
}

fn read_calibration(path: &Path) -> Result<Calibration> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    Calibration::from_json(&text).map_err(|reason| {
        anyhow!("{}: the calibration {reason}; make it anew by fmnet-train calibrate", path.display())
    })
}
