//! `fmnet-infer evaluate`: maps against ground truth.

use super::matching::read;
use super::output::file_name;
use crate::args::EvaluateArgs;
use crate::console::Console;
use anyhow::{Result, bail};
use fmnet::Mesh;
use fmnet::eval::{
    ErrorCurve, ErrorSummary, GroundTruth, GroundTruthSource, LineChart, curves_csv, geodesic_errors,
    symmetric_geodesic_errors,
};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::io::{read_point_map, write_atomically};
use serde_json::{Value, json};
use std::path::Path;

/// One map with what came of it.
struct Evaluated {
    name: String,
    curve: ErrorCurve,
    summary: ErrorSummary,
    mirrored: bool,
}

pub(crate) fn run(args: &EvaluateArgs, console: &Console) -> Result<()> {
    check_outputs(args)?;
    let (source, target) = (read(&args.source, console)?, read(&args.target, console)?);
    let truth = load(&args.ground_truth, &source, &target)?;
    let mirrored =
        args.symmetric_ground_truth.as_deref().map(|text| load(text, &source, &target)).transpose()?;
    let solver = GeodesicSolver::new(&target, &GeodesicOptions::default());
    let mut results = Vec::new();
    for path in &args.maps {
        results.push(evaluate(path, &truth, mirrored.as_ref(), &target, &solver)?);
    }
    let curves: Vec<(&str, &ErrorCurve)> = results.iter().map(|r| (r.name.as_str(), &r.curve)).collect();
    for path in &args.outputs {
        let text = if has_extension(path, "svg") {
            LineChart::error_curves("", &curves).to_svg()
        } else {
            curves_csv(&curves)
        };
        write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    }
    let lines: Vec<String> = results.iter().map(line).collect();
    let maps: Vec<Value> = results.iter().map(record).collect();
    console.result(&lines.join("\n"), json!({ "source": args.source, "target": args.target, "maps": maps }));
    Ok(())
}

fn evaluate(
    path: &Path,
    truth: &GroundTruth,
    mirrored: Option<&GroundTruth>,
    target: &Mesh,
    solver: &GeodesicSolver,
) -> Result<Evaluated> {
    let map = read_point_map(path, Some(target.n_vertices()))?;
    let area = target.area();
    let (errors, mirrored) = match mirrored {
        None => (geodesic_errors(&map, truth, solver, area)?, false),
        Some(mirrored) => {
            let found = symmetric_geodesic_errors(&map, truth, mirrored, solver, area)?;
            (found.errors, found.is_mirrored)
        }
    };
    let (curve, summary) = (ErrorCurve::princeton(&errors), ErrorSummary::new(&errors, area));
    Ok(Evaluated { name: file_name(path), curve, summary, mirrored })
}

fn load(text: &str, source: &Mesh, target: &Mesh) -> Result<GroundTruth> {
    let parsed: GroundTruthSource = text.parse()?;
    Ok(parsed.load(source.n_vertices(), target.n_vertices())?)
}

fn line(result: &Evaluated) -> String {
    format!("{}: {}{}", result.name, result.summary, if result.mirrored { " (mirrored)" } else { "" })
}

fn record(result: &Evaluated) -> Value {
    json!({ "map": result.name, "summary": result.summary, "auc": result.curve.auc(), "mirrored": result.mirrored })
}

fn check_outputs(args: &EvaluateArgs) -> Result<()> {
    for path in &args.outputs {
        if !has_extension(path, "svg") && !has_extension(path, "csv") {
            bail!("{}: unknown kind of output; use .csv for the curve or .svg for the plot", path.display());
        }
    }
    Ok(())
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}
