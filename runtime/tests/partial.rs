//! A part of a body matched to the whole.

use fmnet::Mesh;
use fmnet::eval::{GroundTruth, geodesic_errors};
use fmnet::events::{Event, ignore};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::io::read_mesh;
use fmnet::pipeline::{DescribedShape, Effort, MatchOptions, Matcher};
use fmnet::point_map::PointMap;
use std::path::Path;
use std::sync::Mutex;

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

/// The mean distance of each match from the vertex of the same number, relative to sqrt(area).
fn error_of_identity(found: &PointMap, whole: &Mesh) -> f64 {
    let matched = |i: usize| if found.get(i).is_some() { i as u32 } else { PointMap::UNMATCHED };
    let kept = PointMap::new((0..found.len()).map(matched).collect(), whole.n_vertices());
    let truth = GroundTruth::from_map(&kept).expect("every vertex exists");
    let solver = GeodesicSolver::new(whole, &GeodesicOptions::default());
    let errors = geodesic_errors(found, &truth, &solver, whole.area()).expect("the map is of this mesh");
    errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64
}

fn body() -> Mesh {
    read_mesh(&Path::new(env!("CARGO_MANIFEST_DIR")).join("demo/source.ply"))
        .expect("a mesh of the demo")
        .mesh
}

#[test]
fn a_part_described_as_such_finds_its_place() {
    let whole = &body();
    let part = cut(whole, long_axis(whole));
    let matcher = Matcher::new(&MatchOptions::default()).unwrap();
    let target = matcher.describe("whole", whole, &ignore).unwrap();
    let mean_error = |part: &DescribedShape| {
        error_of_identity(&matcher.match_shapes(part, &target, &ignore).unwrap().map, whole)
    };
    let as_part = mean_error(&matcher.describe_part("part", &part, whole.area(), &ignore).unwrap());
    let as_whole = mean_error(&matcher.describe("part", &part, &ignore).unwrap());
    assert!(as_part < 0.05, "{as_part}");
    assert!(as_part < 0.8 * as_whole, "{as_part}, as a whole {as_whole}");
}

#[test]
fn a_part_of_another_size_finds_its_place_and_that_is_said() {
    let whole = &body();
    let part = cut(whole, long_axis(whole));
    let smaller = part.vertices().iter().map(|p| p.map(|x| 0.6 * x)).collect();
    let part = Mesh::new(smaller, part.faces().to_vec()).unwrap();
    let warnings = Mutex::new(Vec::new());
    let observer = |event: Event| {
        if let Event::Warning(text) = event {
            warnings.lock().unwrap().push(text);
        }
    };
    let matcher = Matcher::new(&MatchOptions::default()).unwrap();
    let pair = matcher.describe_pair(("part", &part), ("whole", whole), true, &observer).unwrap();
    let found = matcher.match_shapes(&pair[0], &pair[1], &observer).unwrap();
    let taken = found.candidates.iter().find(|candidate| candidate.taken).unwrap();
    assert!(
        taken.name == "part 2.83 times as large" || taken.name == "part 2.00 times as large",
        "{taken:?}"
    );
    let error = error_of_identity(&found.map, whole);
    assert!(error < 0.05, "{error}");
    let warnings = warnings.into_inner().unwrap();
    assert!(warnings.iter().any(|text| text.contains("one unit of length?")), "{warnings:?}");
}

#[test]
fn other_ways_are_tried_for_parts_too() {
    let whole = &body();
    let part = cut(whole, long_axis(whole));
    let mut options = MatchOptions::default();
    options.effort = Effort::High;
    let matcher = Matcher::new(&options).unwrap();
    let [part, whole] = matcher.describe_pair(("part", &part), ("whole", whole), true, &ignore).unwrap();
    let found = matcher.match_shapes(&part, &whole, &ignore).unwrap();
    let names: Vec<&str> = found.candidates.iter().map(|candidate| candidate.name.as_str()).collect();
    assert_eq!(names[..4], ["default", "features alone", "k = 50", "strong mask"]);
    // Nine tenths of the whole cannot be larger.
    assert_eq!(names[4..], ["part 0.71 times as large"]);
    assert_eq!(found.candidates.iter().filter(|candidate| candidate.taken).count(), 1);
}
