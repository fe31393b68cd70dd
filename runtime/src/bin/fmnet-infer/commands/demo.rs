//! `fmnet-infer demo`: two built-in shapes, matched with the built-in model.

use super::output::{self, MapOutput};
use crate::args::DemoArgs;
use crate::console::{Console, shown};
use anyhow::Result;
use fmnet::eval::{ErrorSummary, GroundTruth, geodesic_errors};
use fmnet::events::timed;
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::io::decode_mesh;
use fmnet::pipeline::{MatchOptions, Matcher};
use serde_json::json;
use std::path::Path;
use std::slice;
use std::time::Instant;

/// A man and an ape in different poses, made by `fmnet-train synth --demo`; vertex i of one is the same point of the
/// body as vertex i of the other, for i below [`CORRESPONDING`].
const BODIES: [&[u8]; 2] =
    [include_bytes!("../../../../demo/source.ply"), include_bytes!("../../../../demo/target.ply")];
const CORRESPONDING: u32 = 1000;

pub(crate) fn run(args: &DemoArgs, console: &Console) -> Result<()> {
    output::check(slice::from_ref(&args.out))?;
    let observer = |event| console.event(event);
    let start = Instant::now();
    let source = decode_mesh(BODIES[0], Path::new("source.ply"))?.mesh;
    let target = decode_mesh(BODIES[1], Path::new("target.ply"))?.mesh;
    let matcher = Matcher::new(&MatchOptions::default())?;
    let match_start = Instant::now();
    let [described_source, described_target] =
        matcher.describe_pair(("source", &source), ("target", &target), false, &observer)?;
    let result = matcher.match_shapes(&described_source, &described_target, &observer)?;
    let match_seconds = match_start.elapsed().as_secs_f64();
    let pairs = (0..CORRESPONDING).map(|i| (i, i)).collect();
    let truth = GroundTruth::new(pairs, source.n_vertices(), target.n_vertices())?;
    let summary = timed(&observer, "demo", "evaluate", || -> Result<_> {
        let solver = GeodesicSolver::new(&target, &GeodesicOptions::default());
        let area = target.area();
        Ok(ErrorSummary::new(&geodesic_errors(&result.map, &truth, &solver, area)?, area))
    })?;
    let text = format!(
        "Two bodies that the model never saw, of {} and {} vertices, matched in {match_seconds:.2} s.\n{summary}\nViewer: {}",
        source.n_vertices(),
        target.n_vertices(),
        args.out.display()
    );
    output::write(
        &args.out,
        &MapOutput {
            source: &source,
            target: &target,
            name_source: "source",
            name_target: "target",
            map: &result.map,
            caption: &summary.to_string(),
        },
    )?;
    let seconds = start.elapsed().as_secs_f64();
    console.result(
        &text,
        json!({ "summary": summary, "match_seconds": match_seconds, "seconds": seconds, "viewer": shown(&args.out) }),
    )?;
    Ok(())
}
