//! `fmnet-train simulate`.

use crate::args::{Common, SimulateArgs, Simulated};
use crate::progress::{Progress, print_summary, shown};
use anyhow::Result;
use fmnet_trainer::dataset::Dataset;
use fmnet_trainer::events::TrainEvent;
use fmnet_trainer::simulate::{write_parts, write_scans, write_triangulations};
use serde_json::json;

pub(crate) fn run(args: &SimulateArgs, common: &Common) -> Result<()> {
    let progress = Progress::new(common);
    let tell = |done, total, name: &str| {
        progress.event(TrainEvent::Prepared { done, total, shape: name.into() });
    };
    let (out, what, count) = match &args.what {
        Simulated::Scans { dataset, out, splits, options } => {
            (out, "scans", write_scans(&Dataset::open(dataset)?, splits, out, options, &tell)?)
        }
        Simulated::Parts { dataset, out, options } => {
            (out, "parts", write_parts(&Dataset::open(dataset)?, out, options, &tell)?)
        }
        Simulated::Triangulations { dataset, out, splits, options } => {
            let dataset = Dataset::open(dataset)?;
            (out, "triangulations", write_triangulations(&dataset, splits, out, options, &tell)?)
        }
    };
    progress.say(&format!("{count} {what} in {}", out.display()));
    if common.json {
        print_summary(&json!({ "folder": shown(out), what: count }))?;
    }
    Ok(())
}
