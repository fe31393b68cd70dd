//! `fmnet-train reproduce`.

use super::train::device;
use crate::args::{Common, ReproduceArgs};
use crate::interrupt;
use crate::progress::{Progress, print_summary, shown};
use anyhow::{Context, Result};
use fmnet::events::Event;
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
    // A training stops in order by itself; the other stages tell of each piece of work that is done.
    let rest = |event: Event| {
        progress.stage(event);
        interrupt::end_if_asked();
    };
    let observers = Observers { training: &|event| progress.event(event), rest: &rest };
    let report = run_experiment(&experiment, &settings, &device(args.cuda)?, observers, interrupt::stop())?;
    progress.say(&format!("report: {}", report.display()));
    if common.json {
        print_summary(&json!({ "experiment": experiment.name, "report": shown(&report) }))?;
    }
    Ok(())
}
