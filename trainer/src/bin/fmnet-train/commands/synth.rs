//! `fmnet-train synth`.

use crate::args::{Common, SynthArgs};
use crate::progress::Progress;
use anyhow::Result;
use fmnet_trainer::events::TrainEvent;
use fmnet_trainer::synth::{DEMO_LANDMARKS, DatasetOptions, SynthOptions, write_dataset, write_demo};
use serde_json::json;

pub(crate) fn run(args: &SynthArgs, common: &Common) -> Result<()> {
    let body = SynthOptions {
        min_vertices: args.min_vertices,
        max_vertices: args.max_vertices,
        holes: args.holes,
        cuts: args.cuts,
        noise: args.noise,
        ..SynthOptions::default()
    };
    let options = DatasetOptions {
        per_species: args.count as usize,
        seed: args.seed,
        body,
        ..DatasetOptions::default()
    };
    let progress = Progress::new(common);
    if args.demo {
        write_demo(&args.folder)?;
        progress.say(&format!(
            "two bodies with {DEMO_LANDMARKS} corresponding vertices in {}",
            args.folder.display()
        ));
        return Ok(());
    }
    write_dataset(&args.folder, &options, &|done, total| {
        progress.event(TrainEvent::Prepared { done, total, shape: "body".into() });
    })?;
    let shapes = options.per_species * options.species.len();
    progress.say(&format!(
        "{shapes} bodies of {} species in {}",
        options.species.len(),
        args.folder.display()
    ));
    if common.json {
        println!("{:#}", json!({ "folder": args.folder, "shapes": shapes }));
    }
    Ok(())
}
