//! `fmnet-train calibrate`.

use crate::args::{CalibrateArgs, Common};
use crate::progress::{Progress, print_summary};
use anyhow::Result;
use fmnet::fmap::{FmapSolver, SolverKind};
use fmnet::io::write_atomically;
use fmnet::pipeline::{DescriptorKind, Effort, MatchOptions, ModelSource, Refinement};
use fmnet::quality::Quality;
use fmnet_trainer::calibrate::{BAD, calibrate};
use fmnet_trainer::dataset::Dataset;
use fmnet_trainer::evaluate::{EvaluateOptions, MapSource, Method, evaluate, random_pairs};
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &CalibrateArgs, common: &Common) -> Result<()> {
    let methods = methods(args);
    let progress = Progress::new(common);
    let options = EvaluateOptions { ranks: 0, ..EvaluateOptions::default() };
    let mut maps: Vec<(Quality, f64)> = Vec::new();
    for folder in &args.datasets {
        let dataset = Dataset::open(Path::new(folder))?;
        let pairs = random_pairs(&dataset, &args.splits, args.pairs, args.seed);
        let counting = progress.counting(pairs.len() * methods.len());
        for result in evaluate(&dataset, &pairs, &methods, &options, &counting)? {
            let known = result.pairs.iter().filter_map(|pair| Some((pair.quality?, pair.summary.mean)));
            maps.extend(known.filter(|(_, error)| error.is_finite()));
        }
    }
    progress.finish();
    let calibration = calibrate(&maps)?;
    let text = calibration.to_json();
    write_atomically(&args.output, |out| writeln!(out, "{text}"))?;
    let is_bad = |error: f64| error > BAD;
    let called = |bad: bool| {
        let of = maps.iter().filter(|(_, error)| is_bad(*error) == bad);
        let (mut all, mut doubtful) = (0, 0);
        of.for_each(|(quality, _)| {
            all += 1;
            doubtful += usize::from(calibration.estimate(quality).doubtful);
        });
        (all, doubtful)
    };
    let [(good, alarms), (bad, found)] = [called(false), called(true)];
    progress.say(&format!(
        "{}: {found} of {bad} bad maps are called doubtful, and {alarms} of {good} others",
        args.output.display()
    ));
    if common.json {
        let summary = json!({ "calibration": calibration, "maps": maps.len(), "bad": bad, "found": found, "good": good,
                              "false_alarms": alarms });
        print_summary(&summary)?;
    }
    Ok(())
}

/// Ways to good and to bad maps: the model as it is and without refinement, and SHOT, which sees the triangulation.
fn methods(args: &CalibrateArgs) -> Vec<Method> {
    let model = match args.model.as_os_str() == "embedded" {
        true => ModelSource::Embedded,
        false => ModelSource::File(args.model.clone()),
    };
    let method = |label: &str, descriptor: DescriptorKind, k: Option<usize>, refinement: Refinement| {
        let options = MatchOptions::default()
            .descriptor(descriptor)
            .model(model.clone())
            .k(k)
            .solver(FmapSolver::new(SolverKind::Joint, None))
            .refinement(refinement)
            .effort(Effort::Low)
            .cache(args.cache.clone());
        Method { label: label.into(), maps: MapSource::Computed(Box::new(options)) }
    };
    let (learned, shot) = (DescriptorKind::Learned, DescriptorKind::Shot);
    vec![
        method("model", learned, None, Refinement::Wavelet),
        method("model, raw", learned, None, Refinement::None),
        method("model, k = 15", learned, Some(15), Refinement::None),
        method("SHOT", shot, Some(100), Refinement::Wavelet),
        method("SHOT, raw", shot, Some(100), Refinement::None),
    ]
}
