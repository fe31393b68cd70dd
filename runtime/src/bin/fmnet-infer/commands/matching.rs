//! `fmnet-infer match`: the map of one pair.

use super::output::{self, Inputs, MapOutput, file_name};
use crate::args::MatchArgs;
use crate::console::{Console, shown};
use anyhow::{Result, bail};
use fmnet::io::{MeshFile, read_landmarks, read_mesh, write_matrix};
use fmnet::pipeline::{Match, Matcher};
use fmnet::quality::{Estimate, Quality};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

pub(crate) fn run(args: &MatchArgs, console: &Console) -> Result<()> {
    let outputs = outputs(args)?;
    let start = Instant::now();
    let observer = |event| console.event(event);
    let landmarks = args.landmarks.as_deref().map(read_landmarks).transpose()?.unwrap_or_default();
    let matcher = Matcher::new(&args.pipeline.to_options())?;
    let (source, target) = (read(&args.source, console)?, read(&args.target, console)?);
    let mut inputs = Inputs::of_model(&args.pipeline.shape);
    args.landmarks.iter().for_each(|path| inputs.add(path, "the landmarks"));
    inputs.add_mesh(&args.source, &source);
    inputs.add_mesh(&args.target, &target);
    inputs.check(&outputs)?;
    let (source, target) = (source.mesh, target.mesh);
    let (name_source, name_target) = (file_name(&args.source), file_name(&args.target));
    let [described_source, described_target] =
        matcher.describe_pair((&name_source, &source), (&name_target, &target), args.partial, &observer)?;
    let result = matcher.match_with_landmarks(&described_source, &described_target, &landmarks, &observer)?;
    let text = summary_text(&result, start.elapsed().as_secs_f64());
    for path in &args.outputs {
        let (map, caption) = (&result.map, text.as_str());
        let (source, target) = (&source, &target);
        let (name_source, name_target) = (name_source.as_str(), name_target.as_str());
        output::write(path, &MapOutput { source, target, name_source, name_target, map, caption })?;
    }
    if let Some(path) = &args.save_functional_map {
        write_matrix(path, &result.functional_map)?;
    }
    let mut summary = summary(&matcher, &result);
    summary["source"] =
        json!({ "file": shown(&args.source), "vertices": source.n_vertices(), "faces": source.n_faces() });
    summary["target"] =
        json!({ "file": shown(&args.target), "vertices": target.n_vertices(), "faces": target.n_faces() });
    summary["outputs"] = args.outputs.iter().map(|path| shown(path)).collect();
    summary["seconds"] = json!(start.elapsed().as_secs_f64());
    console.result(&text, summary)?;
    match args.strict && (result.estimate.doubtful || result.quality.is_mirrored()) {
        true => Err(Doubtful { expected_error: result.estimate.expected_error }.into()),
        false => Ok(()),
    }
}

/// A map that `--strict` does not let pass.
#[derive(Debug, thiserror::Error)]
#[error(
    "the map is doubtful, expected mean error {expected_error:.1} % of sqrt(area) (--strict); it was written"
)]
pub(crate) struct Doubtful {
    expected_error: f64,
}

/// All outputs; refuses those that could not be written.
fn outputs(args: &MatchArgs) -> Result<Vec<PathBuf>> {
    let matrix = args.save_functional_map.iter();
    let is_npy = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    if let Some(path) = matrix.clone().find(|path| !is_npy(path)) {
        bail!("--save-functional-map {}: the matrix is written as .npy; name the file so", path.display());
    }
    output::check(&args.outputs)?;
    let all: Vec<PathBuf> = args.outputs.iter().chain(matrix).cloned().collect();
    output::check_places(&all)?;
    Ok(all)
}

/// Reads a mesh and passes on what its reader has to say about the geometry.
pub(super) fn read(path: &Path, console: &Console) -> Result<MeshFile> {
    let file = read_mesh(path)?;
    for warning in &file.info.warnings {
        console.warn(&format!("{}: {warning}", path.display()));
    }
    Ok(file)
}

fn summary_text(result: &Match, seconds: f64) -> String {
    let matched = result.map.iter().flatten().count();
    let origin = match result.pmf_info.as_ref().and_then(|info| info.edges_kept) {
        Some(_) => "; both meshes are triangulated alike, and the map follows the triangulation",
        None => "",
    };
    let trust = if result.estimate.doubtful || result.quality.is_mirrored() { ", DOUBTFUL" } else { "" };
    format!(
        "{matched} of {} source vertices matched in {seconds:.2} s{origin}; expected mean error {:.1} % of sqrt(area){trust}",
        result.map.len(),
        result.estimate.expected_error
    )
}

/// Settings and outcome of a match, for scripts.
pub(super) fn summary(matcher: &Matcher, result: &Match) -> Value {
    let info = &result.functional_map_info;
    let upscale = result.upscale_info.as_ref().map(|info| {
        json!({ "iterations": info.iterations, "converged": info.converged, "objective": info.objective,
                "initial_objective": info.initial_objective })
    });
    let filter = result.pmf_info.as_ref().map(
        |info| json!({ "changed": info.changed, "left_over": info.left_over, "edges_kept": info.edges_kept }),
    );
    json!({
        "matched": result.map.iter().flatten().count(),
        "n_source": result.map.len(),
        "n_target": result.map.n_target,
        "k": matcher.k(),
        "shape_options": matcher.shape_options(),
        "model": matcher.network().map(|n| n.metadata()),
        "backend": matcher.network().map(|n| n.backend()),
        "functional_map": { "rank": info.rank, "condition": info.condition },
        "pmf": filter,
        "upscale": upscale,
        "quality": quality(&result.quality, &result.estimate),
        "candidates": result.candidates.iter().map(|candidate| {
            let mut value = quality(&candidate.quality, &candidate.estimate);
            value["name"] = json!(candidate.name);
            value["taken"] = json!(candidate.taken);
            value
        }).collect::<Vec<_>>(),
    })
}

/// Measures of a map and what they say of its error, which is in units of sqrt(area), times 100.
pub(super) fn quality(quality: &Quality, estimate: &Estimate) -> Value {
    let mut value = json!(quality);
    value["expected_error"] = json!(estimate.expected_error);
    value["probability_bad"] = json!(estimate.bad);
    value["doubtful"] = json!(estimate.doubtful || quality.is_mirrored());
    value["mirrored"] = json!(quality.is_mirrored());
    value
}
