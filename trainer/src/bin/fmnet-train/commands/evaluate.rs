//! `fmnet-train evaluate`.

use crate::args::{Common, EvaluateArgs};
use crate::progress::{Progress, print_summary, shown};
use anyhow::{Context, Result, bail};
use fmnet::eval::{ErrorCurve, curves_from_csv};
use fmnet::fmap::FmapSolver;
use fmnet::pipeline::{DescriptorKind, MatchOptions, ModelSource, Refinement};
use fmnet_trainer::dataset::Dataset;
use fmnet_trainer::evaluate::report::{Chapter, write_html};
use fmnet_trainer::evaluate::{
    EvaluateOptions, MapSource, Method, MethodResult, evaluate, listed_pairs, random_pairs,
};
use serde_json::{Value, json};
use std::path::Path;

pub(crate) fn run(args: &EvaluateArgs, common: &Common) -> Result<()> {
    let methods = methods(args);
    if methods.is_empty() {
        bail!("nothing to evaluate: give --model FILE (or `embedded`), --shot or --maps NAME=DIR");
    }
    let references = args.curves.as_deref().map(read_curves).transpose()?.unwrap_or_default();
    let dataset = Dataset::open(&args.dataset)?;
    let pairs = match args.pairs.parse::<usize>() {
        Ok(count) => random_pairs(&dataset, &args.splits, count, args.seed),
        Err(_) => listed_pairs(&dataset, Path::new(&args.pairs))?,
    };
    let options = EvaluateOptions { symmetric: args.symmetric, ..EvaluateOptions::default() };
    let progress = Progress::new(common);
    let total = pairs.len() * methods.len();
    let results = evaluate(&dataset, &pairs, &methods, &options, &progress.counting(total))?;
    let text = format!("{} pairs of {}, {}.", pairs.len(), args.dataset.display(), dataset.layout);
    let chapter = Chapter {
        title: "Evaluation",
        text: &text,
        dataset: &dataset,
        results: &results,
        references: &references,
    };
    chapter.write_files(&args.out)?;
    write_html(&args.out.join("report.html"), "Evaluation", vec![chapter.section()?])?;
    progress.finish();
    for result in &results {
        progress.say(&line(result));
    }
    progress.say(&format!("report: {}", args.out.join("report.html").display()));
    if common.json {
        let records: Vec<Value> = results.iter().map(record).collect();
        print_summary(&json!({ "dataset": shown(&args.dataset), "pairs": pairs.len(), "methods": records }))?;
    }
    Ok(())
}

/// Every model and SHOT with every refinement, then the methods given by map files.
fn methods(args: &EvaluateArgs) -> Vec<Method> {
    let mut descriptors: Vec<(String, DescriptorKind, ModelSource)> = Vec::new();
    for model in &args.models {
        let (name, file) = model.split_once('=').unwrap_or((model, model));
        let source = if file == "embedded" { ModelSource::Embedded } else { ModelSource::File(file.into()) };
        descriptors.push((name.into(), DescriptorKind::Learned, source));
    }
    if args.shot {
        descriptors.push(("SHOT".into(), DescriptorKind::Shot, ModelSource::Embedded));
    }
    let mut methods = Vec::new();
    for (name, descriptor, model) in descriptors {
        for &refinement in &args.refine {
            let options = MatchOptions::default()
                .descriptor(descriptor)
                .model(model.clone())
                .k(args.k.map(usize::from))
                .solver(FmapSolver::chosen(args.fm, args.mask_weight))
                .refinement(refinement)
                .cache(args.cache.clone());
            let maps = MapSource::Computed(Box::new(options));
            methods.push(Method { label: format!("{name}{}", suffix(refinement)), maps });
        }
    }
    let files = args.maps.iter();
    methods.extend(
        files.map(|(name, folder)| Method { label: name.clone(), maps: MapSource::Files(folder.clone()) }),
    );
    methods
}

/// What labels call a refinement.
fn suffix(refinement: Refinement) -> String {
    let name = match refinement {
        Refinement::None => return String::new(),
        Refinement::Icp => "ICP",
        Refinement::Zoomout => "ZoomOut",
        Refinement::Wavelet => "wavelet filter",
        Refinement::Pmf => "PMF",
        Refinement::SharedTriangulation => "PMF, shared triangulation",
        other => return format!(" + {other:?}"),
    };
    format!(" + {name}")
}

fn read_curves(path: &Path) -> Result<Vec<(String, ErrorCurve)>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let curves = curves_from_csv(&text).map_err(|reason| anyhow::anyhow!("{}: {reason}", path.display()))?;
    let file = path.file_stem().unwrap_or_default().to_string_lossy();
    Ok(curves.into_iter().map(|(name, curve)| (format!("{name} ({file})"), curve)).collect())
}

fn line(result: &MethodResult) -> String {
    let mean = result.mean();
    format!(
        "{}: {} pairs, mean error x 100 {:.3} (median {:.3}), exact {:.1} %, within 0.05 {:.1} %, AUC {:.4}, {:.2} s a pair",
        result.label,
        result.pairs.len(),
        100.0 * mean.mean,
        100.0 * mean.median,
        100.0 * mean.exact,
        100.0 * mean.within_005,
        mean.auc,
        mean.seconds
    )
}

fn record(result: &MethodResult) -> Value {
    let mean = result.mean();
    json!({
        "method": result.label,
        "mean": mean.mean,
        "median": mean.median,
        "exact": mean.exact,
        "within_005": mean.within_005,
        "auc": mean.auc,
        "coverage": mean.coverage,
        "worst": mean.worst,
        "seconds": mean.seconds,
    })
}
