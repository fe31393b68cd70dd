//! `fmnet-train reproduce`.

use super::train::device;
use crate::args::{Common, ReproduceArgs};
use crate::interrupt;
use crate::progress::Progress;
use anyhow::{Context, Result};
use fmnet_trainer::reproduce::{Observers, Settings, experiment, run as run_experiment};
use serde_json::json;

pub(crate) fn run(args: &ReproduceArgs, common: &Common) -> Result<()> {
    let settings = Settings {
        data: args.data.clone(),
        out: args.out.clone(),
        steps: args.steps,
        pairs: args.pairs,
        curves: args.curves.clone(),
    };
    let experiment = experiment(&args.experiment, &settings).context("no experiment of this name")?;
    let progress = Progress::new(common);
    let observers =
        Observers { training: &|event| progress.event(event), rest: &|event| progress.stage(event) };
    let report = run_experiment(&experiment, &settings, &device(args.cuda)?, observers, interrupt::stop())?;
    progress.say(&format!("report: {}", report.display()));
    if common.json {
        println!("{:#}", json!({ "experiment": experiment.name, "report": report }));
    }
    Ok(())
}
