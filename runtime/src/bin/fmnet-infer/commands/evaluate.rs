//! `fmnet-infer evaluate`: maps against ground truth.

use super::matching::read;
use super::output::file_name;
use crate::args::EvaluateArgs;
use crate::console::Console;
use anyhow::{Result, bail};
use fmnet::Mesh;
use fmnet::eval::{
    Block, ErrorCurve, ErrorSummary, GroundTruth, GroundTruthSource, HtmlReport, LineChart, Section,
    curves_csv, geodesic_errors, symmetric_geodesic_errors,
};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::io::{read_point_map, write_atomically};
use fmnet::point_map::PointMap;
use fmnet::render::pair_picture;
use serde_json::{Value, json};
use std::path::Path;

/// Columns of a picture in a report.
const PICTURE_WIDTH: usize = 900;

/// One map with what came of it.
struct Evaluated {
    name: String,
    map: PointMap,
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
        } else if has_extension(path, "html") {
            report(&results, &curves, (&args.source, &source), (&args.target, &target))?
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
    Ok(Evaluated { name: file_name(path), map, curve, summary, mirrored })
}

/// A page with the figures, the curves and a picture of each map.
fn report(
    results: &[Evaluated],
    curves: &[(&str, &ErrorCurve)],
    (path_source, source): (&Path, &Mesh),
    (path_target, target): (&Path, &Mesh),
) -> Result<String> {
    let header = ["map", "mean x 100", "exact %", "within 0.05 %", "AUC", "worst x 100", "coverage %"];
    let row = |r: &Evaluated| {
        let s = &r.summary;
        let shares = [s.mean, s.exact, s.within_005].map(|x| format!("{:.2}", 100.0 * x));
        let rest = [
            format!("{:.4}", s.auc),
            format!("{:.1}", 100.0 * s.worst),
            format!("{:.1}", 100.0 * s.coverage),
        ];
        std::iter::once(r.name.clone()).chain(shares).chain(rest).collect()
    };
    let mut blocks = vec![
        Block::Table { header: header.map(String::from).to_vec(), rows: results.iter().map(row).collect() },
        Block::Svg(LineChart::error_curves("", curves).to_svg()),
    ];
    for result in results {
        let picture = pair_picture(source, target, &result.map, PICTURE_WIDTH)?;
        let caption = format!("{}: each source vertex (left) has the colour of its match", result.name);
        blocks.push(Block::Image { media_type: "image/png".into(), bytes: picture.to_png(), caption });
    }
    let title = format!("{} → {}", file_name(path_source), file_name(path_target));
    Ok(HtmlReport { sections: vec![Section { title: title.clone(), blocks }], title }.to_html())
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
        if !["csv", "svg", "html"].iter().any(|e| has_extension(path, e)) {
            bail!(
                "{}: unknown kind of output; use .csv for the curve, .svg for the plot or .html for a report",
                path.display()
            );
        }
    }
    Ok(())
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}
