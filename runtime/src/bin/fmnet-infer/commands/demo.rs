//! `fmnet-infer demo`: two built-in shapes, matched with the built-in model.

use super::output::{self, MapOutput};
use crate::args::DemoArgs;
use crate::console::{Console, shown};
use anyhow::Result;
use fmnet::eval::{ErrorSummary, GroundTruth, geodesic_errors};
use fmnet::events::timed;
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::pipeline::{MatchOptions, Matcher};
use fmnet::point_map::PointMap;
use fmnet::synth::{DemoPair, Species, demo_pair};
use serde_json::json;
use std::slice;
use std::time::Instant;

pub(crate) fn run(args: &DemoArgs, console: &Console) -> Result<()> {
    output::check(slice::from_ref(&args.out))?;
    let observer = |event| console.event(event);
    let start = Instant::now();
    let DemoPair { source, target, ground_truth } =
        timed(&observer, "demo", "build two bodies", || demo_pair(Species::Man, 0));
    let matcher = Matcher::new(&MatchOptions::default())?;
    let match_start = Instant::now();
    let (described_source, described_target) = rayon::join(
        || matcher.describe("source", &source.mesh, &observer),
        || matcher.describe("target", &target.mesh, &observer),
    );
    let result = matcher.match_shapes(&described_source?, &described_target?, &observer)?;
    let match_seconds = match_start.elapsed().as_secs_f64();
    let truth = GroundTruth::from_map(&PointMap::new(ground_truth, target.mesh.n_vertices()))?;
    let summary = timed(&observer, "demo", "evaluate", || -> Result<_> {
        let solver = GeodesicSolver::new(&target.mesh, &GeodesicOptions::default());
        let area = target.mesh.area();
        Ok(ErrorSummary::new(&geodesic_errors(&result.map, &truth, &solver, area)?, area))
    })?;
    let text = format!(
        "Two bodies that the model never saw, of {} and {} vertices, matched in {match_seconds:.2} s.\n{summary}\nViewer: {}",
        source.mesh.n_vertices(),
        target.mesh.n_vertices(),
        args.out.display()
    );
    output::write(
        &args.out,
        &MapOutput {
            source: &source.mesh,
            target: &target.mesh,
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
