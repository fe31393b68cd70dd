//! `fmnet-train preprocess`.

use crate::args::{Common, PreprocessArgs};
use crate::progress::{Progress, print_summary, shown};
use anyhow::Result;
use fmnet_trainer::config::{List, TrainConfig};
use fmnet_trainer::dataset::Split;
use fmnet_trainer::train::prepare_splits;
use serde_json::json;

pub(crate) fn run(args: &PreprocessArgs, common: &Common) -> Result<()> {
    let mut config = match &args.config {
        Some(path) => TrainConfig::read(path)?,
        None => TrainConfig::default(),
    };
    config.dataset = List(args.datasets.clone());
    config.cache = args.cache.clone();
    config.check()?;
    let progress = Progress::new(common);
    let splits = [Split::Train, Split::Validation, Split::Test];
    let shapes = prepare_splits(&config, &splits, &|event| progress.event(event))?;
    progress.say(&format!("{} shapes are ready in {}", shapes.len(), args.cache.display()));
    if common.json {
        let names: Vec<&str> = shapes.iter().map(|s| s.entry.name.as_str()).collect();
        print_summary(&json!({ "cache": shown(&args.cache), "shapes": names }))?;
    }
    Ok(())
}
