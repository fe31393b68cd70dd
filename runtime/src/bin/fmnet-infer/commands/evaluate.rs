//! `fmnet-infer evaluate`: maps against ground truth.

use super::matching::read;
use super::output::{Inputs, check_places, file_name};
use crate::args::EvaluateArgs;
use crate::console::{Console, shown};
use anyhow::{Context, Result, bail};
use fmnet::Mesh;
use fmnet::eval::{
    Block, ErrorCurve, ErrorSummary, GroundTruth, GroundTruthSource, HtmlReport, LineChart, Section,
    curves_csv, geodesic_errors, surface_errors, symmetric_geodesic_errors,
};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::io::{MeshFile, read_point_map, write_atomically};
use fmnet::point_map::PointMap;
use fmnet::render::pair_picture;
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Columns of a picture in a report.
const PICTURE_WIDTH: usize = 900;

/// One map with what came of it.
struct Evaluated {
    name: String,
    map: PointMap,
    curve: ErrorCurve,
    summary: ErrorSummary,
    /// Of the points on the surface, where the map or the ground truth knows them finer than a vertex.
    on_surface: Option<ErrorSummary>,
    mirrored: bool,
    /// How many matches are on another component of the target than the right one.
    n_elsewhere: usize,
}

pub(crate) fn run(args: &EvaluateArgs, console: &Console) -> Result<()> {
    check_outputs(args)?;
    let (source, target) = (read(&args.source, console)?, read(&args.target, console)?);
    check_inputs(args, &source, &target)?;
    let pair = Pair { source: (&args.source, &source.mesh), target: (&args.target, &target.mesh) };
    let truth = pair.truth("--ground-truth", &args.ground_truth)?;
    let mirrored = args.symmetric_ground_truth.as_deref();
    let mirrored = mirrored.map(|text| pair.truth("--symmetric-ground-truth", text)).transpose()?;
    let solver = GeodesicSolver::new(&target.mesh, &GeodesicOptions::default());
    let mut results = Vec::new();
    for (path, name) in args.maps.iter().zip(distinct_names(&args.maps)) {
        results.push(pair.evaluate(path, name, &truth, mirrored.as_ref(), &solver)?);
    }
    let curves: Vec<(&str, &ErrorCurve)> = results.iter().map(|r| (r.name.as_str(), &r.curve)).collect();
    for path in &args.outputs {
        let text = if has_extension(path, "svg") {
            LineChart::error_curves("", &curves).to_svg()
        } else if has_extension(path, "html") {
            report(&results, &curves, &pair)?
        } else {
            curves_csv(&curves)
        };
        write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    }
    let lines: Vec<String> = results.iter().map(line).collect();
    let maps: Vec<Value> = results.iter().map(record).collect();
    let summary = json!({ "source": shown(&args.source), "target": shown(&args.target), "maps": maps });
    Ok(console.result(&lines.join("\n"), summary)?)
}

/// Both meshes with their files.
struct Pair<'a> {
    source: (&'a Path, &'a Mesh),
    target: (&'a Path, &'a Mesh),
}

impl Pair<'_> {
    fn truth(&self, option: &str, text: &OsStr) -> Result<GroundTruth> {
        let load = || {
            let truth = GroundTruthSource::from_os_str(text)?.load(self.source.1, self.target.1)?;
            if truth.pairs().is_empty() {
                bail!("it has no matches, so there is nothing to measure; name a file with some");
            }
            Ok(truth)
        };
        load().with_context(|| format!("{option} {}", Path::new(text).display()))
    }

    fn evaluate(
        &self,
        path: &Path,
        name: String,
        truth: &GroundTruth,
        mirrored: Option<&GroundTruth>,
        solver: &GeodesicSolver,
    ) -> Result<Evaluated> {
        let (source, target) = (self.source, self.target.1);
        let map = read_point_map(path, Some(target.n_vertices()))?;
        if map.len() != source.1.n_vertices() {
            bail!(
                "{} has {} lines, but {} has {} vertices; pass maps from this source to this target",
                path.display(),
                map.len(),
                source.0.display(),
                source.1.n_vertices()
            );
        }
        let area = target.area();
        let (errors, mirrored) = match mirrored {
            None => (geodesic_errors(&map, truth, solver, area)?, false),
            Some(mirrored) => {
                let found = symmetric_geodesic_errors(&map, truth, mirrored, solver, area)?;
                (found.errors, found.is_mirrored)
            }
        };
        let n_elsewhere = truth
            .pairs()
            .iter()
            .filter(|(x, right)| map.get(*x as usize).is_some_and(|y| !solver.are_connected(y, *right)))
            .count();
        let (curve, summary) = (ErrorCurve::princeton(&errors), ErrorSummary::new(&errors, area));
        let finer = !mirrored && (map.points.is_some() || truth.points().is_some());
        let on_surface = match finer {
            true => Some(ErrorSummary::new(&surface_errors(&map, truth, target, solver)?, area)),
            false => None,
        };
        Ok(Evaluated { name, map, curve, summary, on_surface, mirrored, n_elsewhere })
    }
}

/// The names of the files, with as many of their folders as tell them apart; numbered where one is given twice.
fn distinct_names(paths: &[PathBuf]) -> Vec<String> {
    let with_folders = |path: &Path, n: usize| -> PathBuf {
        let parts: Vec<_> = path.components().collect();
        parts[parts.len().saturating_sub(n + 1)..].iter().collect()
    };
    let name = |path: &PathBuf| {
        let most = path.components().count();
        let is_alone = |n: &usize| {
            let same = |other: &&PathBuf| *other != path && with_folders(other, *n) == with_folders(path, *n);
            !paths.iter().any(|other| same(&other))
        };
        let n = (0..most).find(is_alone).unwrap_or(most);
        shown(&with_folders(path, n))
    };
    let mut names: Vec<String> = Vec::new();
    for path in paths {
        let plain = name(path);
        let numbered = (2..).map(|i| format!("{plain} ({i})"));
        let free = std::iter::once(plain.clone()).chain(numbered).find(|name| !names.contains(name));
        names.push(free.unwrap_or(plain));
    }
    names
}

/// A page with the figures, the curves and a picture of each map.
fn report(results: &[Evaluated], curves: &[(&str, &ErrorCurve)], pair: &Pair) -> Result<String> {
    let number = |x: f64, places: usize| if x.is_nan() { "none".to_owned() } else { format!("{x:.places$}") };
    let header = ["map", "mean x 100", "exact %", "within 0.05 %", "AUC", "worst x 100", "coverage %"];
    let row = |r: &Evaluated| {
        let s = &r.summary;
        let shares = [s.mean, s.exact, s.within_005].map(|x| number(100.0 * x, 2));
        let rest = [number(s.auc, 4), number(100.0 * s.worst, 1), number(100.0 * s.coverage, 1)];
        std::iter::once(r.name.clone()).chain(shares).chain(rest).collect()
    };
    let mut blocks = vec![
        Block::Table { header: header.map(String::from).to_vec(), rows: results.iter().map(row).collect() },
        Block::Svg(LineChart::error_curves("", curves).to_svg()),
    ];
    for result in results {
        let picture = pair_picture(pair.source.1, pair.target.1, &result.map, PICTURE_WIDTH)?;
        let caption = format!("{}: each source vertex (left) has the colour of its match", result.name);
        blocks.push(Block::Image { media_type: "image/png".into(), bytes: picture.to_png(), caption });
    }
    let title = format!("{} → {}", file_name(pair.source.0), file_name(pair.target.0));
    Ok(HtmlReport { sections: vec![Section { title: title.clone(), blocks }], title }.to_html())
}

fn line(result: &Evaluated) -> String {
    let elsewhere = match result.n_elsewhere {
        0 => String::new(),
        n => format!(", {n} on another component"),
    };
    let mirrored = if result.mirrored { " (mirrored)" } else { "" };
    let on_surface = result
        .on_surface
        .as_ref()
        .map_or(String::new(), |s| format!("; on the surface mean error x 100: {:.3}", 100.0 * s.mean));
    format!("{}: {}{on_surface}{elsewhere}{mirrored}", result.name, result.summary)
}

fn record(result: &Evaluated) -> Value {
    json!({ "map": result.name, "summary": result.summary, "on_surface": result.on_surface, "auc": result.curve.auc(), "mirrored": result.mirrored,
            "on_another_component": result.n_elsewhere })
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
    check_places(&args.outputs)
}

/// Refuses outputs that would replace what the command reads.
fn check_inputs(args: &EvaluateArgs, source: &MeshFile, target: &MeshFile) -> Result<()> {
    let mut inputs = Inputs::default();
    inputs.add_mesh(&args.source, source);
    inputs.add_mesh(&args.target, target);
    args.maps.iter().for_each(|path| inputs.add(path, "a map to evaluate"));
    for text in [Some(&args.ground_truth), args.symmetric_ground_truth.as_ref()].into_iter().flatten() {
        match GroundTruthSource::from_os_str(text)? {
            GroundTruthSource::Map(path) => inputs.add(&path, "the ground truth"),
            GroundTruthSource::Lists(a, b) => {
                [a, b].iter().for_each(|path| inputs.add(path, "the ground truth"))
            }
            _ => {}
        }
    }
    inputs.check(&args.outputs)
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_names_of_their_own() {
        let names = |paths: &[&str]| distinct_names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(names(&["a/x.txt", "b/y.txt"]), ["x.txt", "y.txt"]);
        assert_eq!(
            names(&["run1/map.txt", "run2/map.txt", "other.txt"]),
            ["run1/map.txt", "run2/map.txt", "other.txt"]
        );
        assert_eq!(names(&["a/1/m.txt", "b/1/m.txt", "m.txt"]), ["a/1/m.txt", "b/1/m.txt", "m.txt"]);
        assert_eq!(names(&["m.txt", "m.txt"]), ["m.txt", "m.txt (2)"]);
    }
}
