//! A part of a body matched to the whole.

use fmnet::Mesh;
use fmnet::eval::{GroundTruth, geodesic_errors};
use fmnet::events::ignore;
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::io::read_mesh;
use fmnet::pipeline::{DescribedShape, Effort, MatchOptions, Matcher};
use fmnet::point_map::PointMap;
use std::path::Path;

/// What is left of a mesh without its highest fifth along an axis; the vertices there are no longer in any face.
fn cut(mesh: &Mesh, axis: usize) -> Mesh {
    let heights = || mesh.vertices().iter().map(|p| p[axis]);
    let (lowest, highest) =
        (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let limit = highest - 0.2 * (highest - lowest);
    let faces = mesh.faces().iter().copied();
    let kept = faces.filter(|face| face.iter().all(|&i| mesh.vertices()[i as usize][axis] < limit));
    Mesh::new(mesh.vertices().to_vec(), kept.collect()).expect("faces of a valid mesh")
}

/// The axis along which a body is longest.
fn long_axis(mesh: &Mesh) -> usize {
    let extent = |axis: usize| {
        let heights = || mesh.vertices().iter().map(|p| p[axis]);
        heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min)
    };
    (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).expect("three axes")
}

#[test]
fn a_part_described_as_such_finds_its_place() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo/source.ply");
    let whole = &read_mesh(&file).unwrap().mesh;
    let part = cut(whole, long_axis(whole));
    let matcher = Matcher::new(&MatchOptions::default()).unwrap();
    let target = matcher.describe("whole", whole, &ignore).unwrap();
    let solver = GeodesicSolver::new(whole, &GeodesicOptions::default());
    let mean_error = |part: &DescribedShape| {
        let found = matcher.match_shapes(part, &target, &ignore).unwrap().map;
        let matched = |i: usize| if found.get(i).is_some() { i as u32 } else { PointMap::UNMATCHED };
        let kept = PointMap::new((0..found.len()).map(matched).collect(), whole.n_vertices());
        let truth = GroundTruth::from_map(&kept).unwrap();
        let errors = geodesic_errors(&found, &truth, &solver, whole.area()).unwrap();
        errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64
    };
    let as_part = mean_error(&matcher.describe_part("part", &part, whole.area(), &ignore).unwrap());
    let as_whole = mean_error(&matcher.describe("part", &part, &ignore).unwrap());
    assert!(as_part < 0.05, "{as_part}");
    assert!(as_part < 0.8 * as_whole, "{as_part}, as a whole {as_whole}");
}

#[test]
fn other_ways_are_tried_for_parts_too() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo/source.ply");
    let whole = &read_mesh(&file).unwrap().mesh;
    let part = cut(whole, long_axis(whole));
    let mut options = MatchOptions::default();
    options.effort = Effort::High;
    let matcher = Matcher::new(&options).unwrap();
    let [part, whole] = matcher.describe_pair(("part", &part), ("whole", whole), true, &ignore).unwrap();
    let found = matcher.match_shapes(&part, &whole, &ignore).unwrap();
    let names: Vec<&str> = found.candidates.iter().map(|candidate| candidate.name.as_str()).collect();
    assert_eq!(names, ["default", "features alone", "k = 50", "strong mask"]);
    assert_eq!(found.candidates.iter().filter(|candidate| candidate.taken).count(), 1);
}
