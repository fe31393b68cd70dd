//! `fmnet-train synth`.

use crate::args::{Common, SynthArgs};
use crate::progress::{Progress, print_summary, shown};
use anyhow::{Result, bail};
use fmnet_trainer::events::TrainEvent;
use fmnet_trainer::synth::{
    DEMO_LANDMARKS, DatasetOptions, Family, Species, SynthOptions, write_dataset, write_demo,
};
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
        species: chosen(&args.species)?,
        per_species: args.count as usize,
        validation: args.validation,
        seed: args.seed,
        body,
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
        print_summary(&json!({ "folder": shown(&args.folder), "shapes": shapes }))?;
    }
    Ok(())
}

/// The species of the given names, and those of the given families; all where there are none.
fn chosen(names: &[String]) -> Result<Vec<Species>> {
    let all = Species::all();
    let known =
        |name: &str| Family::ALL.iter().any(|f| f.name() == name) || all.iter().any(|s| s.name() == name);
    if let Some(name) = names.iter().find(|name| !known(name)) {
        let mut list: Vec<&str> = Family::ALL.iter().map(|family| family.name()).collect();
        list.extend(all.iter().map(|species| species.name()));
        bail!("--species: there is no {name}; there are {}", list.join(", "));
    }
    let wanted =
        |s: &Species| names.iter().any(|name| [s.name(), s.family().name()].contains(&name.as_str()));
    Ok(all.iter().copied().filter(|species| names.is_empty() || wanted(species)).collect())
}
