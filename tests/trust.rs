//! Maps say what they are worth: by exit status, summary and warning, on the demo's bodies and copies of them; by the
//! doubt of their vertices, on people of the research data, where that is at hand.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::Mesh;
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::io::{read_mesh, read_point_map};
use fmnet::mesh::nearest_vertices;
use fmnet::mesh::shapes::{bumpy_sphere, permuted};
use fmnet::pipeline::{MatchOptions, Matcher};
use fmnet::point_map::PointMap;
use fmnet::quality::{Calibration, Quality, Side, SurfaceFrame, displaced_regions, doubt};
use fmnet::spectral::{EigenOptions, Eigenbasis, Laplacian, eigenbasis};
use fmnet_tests::{Workplace, infer, research_data, root, targets};
use serde_json::Value;
use std::path::Path;

fn man() -> Mesh {
    read_mesh(&root().join("runtime/demo/source.ply")).unwrap().mesh
}

fn quality(work: &Workplace, arguments: &[&str]) -> Value {
    let summary: Value = serde_json::from_str(&work.succeed(arguments)).unwrap();
    summary["quality"].clone()
}

#[test]
fn an_inside_out_mesh_is_turned_and_a_mirrored_one_matched_without_reversal() {
    let work = Workplace::new();
    let man = man();
    let (copy, _) = permuted(&man, 5);
    let inside_out = copy.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inside_out = Mesh::new(copy.vertices().to_vec(), inside_out).unwrap();
    let mirrored = copy.vertices().iter().map(|&[x, y, z]| [-x, y, z]).collect();
    let mirrored = Mesh::new(mirrored, copy.faces().to_vec()).unwrap();
    work.mesh("man.ply", &man);
    work.mesh("copy.ply", &copy);
    work.mesh("inside_out.ply", &inside_out);
    work.mesh("mirrored.ply", &mirrored);
    let right = quality(&work, &["match", "man.ply", "copy.ply", "-o", "copy.txt", "--json"]);
    assert!(right["expected_error"].as_f64().unwrap() < 3.0 && right["doubtful"] == false, "{right}");
    work.succeed(&["match", "man.ply", "inside_out.ply", "-o", "inside_out.txt", "--strict"]);
    let same = targets(&work.path("copy.txt"))
        .iter()
        .zip(targets(&work.path("inside_out.txt")))
        .filter(|(a, b)| **a == *b)
        .count();
    assert!(same as f64 > 0.99 * man.n_vertices() as f64, "{same} of {}", man.n_vertices());
    let other = quality(&work, &["match", "man.ply", "mirrored.ply", "-o", "mirrored.csv", "--json"]);
    // Left goes to left: nothing is reversed, or it is said.
    assert!(other["reversed"].as_f64().unwrap() < 0.2 || other["mirrored"] == true, "{other}");
}

#[test]
fn unlike_shapes_are_doubtful_and_strict_says_so() {
    let work = Workplace::new();
    work.mesh("man.ply", &man());
    work.mesh("ball.ply", &bumpy_sphere(4, 1));
    let arguments =
        ["match", "ball.ply", "man.ply", "-o", "map.csv", "--effort", "low", "--strict", "--json"];
    let output = infer().args(arguments).current_dir(work.folder()).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{errors}");
    assert!(errors.contains("doubtful") && errors.contains("expected mean error"), "{errors}");
    let map = read_point_map(&work.path("map.csv"), None).unwrap();
    let confidence = map.confidence.unwrap();
    assert!(confidence.iter().sum::<f32>() < 0.7 * confidence.len() as f32);
    assert!(map.points.unwrap().iter().all(Option::is_some));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["quality"]["doubtful"], true);
    assert_eq!(summary["candidates"].as_array().unwrap().len(), 1);
}

/// The built-in model carries the calibration beside it, and its descriptors agree on bodies, not on a ball and a man.
#[test]
fn descriptors_agree_where_the_model_knows_the_shapes() {
    let own = Matcher::new(&MatchOptions::default()).unwrap().calibration(false);
    let text = std::fs::read_to_string(root().join("models/bodies/calibration.json")).unwrap();
    assert_eq!(Calibration::from_json(&text), Ok(own));
    let limit = own.agreement.unwrap();
    let work = Workplace::new();
    work.mesh("man.ply", &man());
    work.mesh("copy.ply", &permuted(&man(), 2).0);
    work.mesh("ball.ply", &bumpy_sphere(4, 1));
    let agreement = |source: &str| {
        let found =
            quality(&work, &["match", source, "man.ply", "-o", "map.txt", "--effort", "low", "--json"]);
        found["agreement"].as_f64().unwrap()
    };
    let (copy, ball) = (agreement("copy.ply"), agreement("ball.ply"));
    assert!(copy > 0.99 && ball < limit, "{copy} {ball}");
}

#[test]
fn every_candidate_is_listed_and_one_is_taken() {
    let work = Workplace::new();
    work.mesh("man.ply", &man());
    work.mesh("copy.ply", &permuted(&man(), 2).0);
    let arguments =
        ["match", "man.ply", "copy.ply", "-o", "map.txt", "--effort", "high", "--adapt", "1", "--json"];
    let summary: Value = serde_json::from_str(&work.succeed(&arguments)).unwrap();
    let candidates = summary["candidates"].as_array().unwrap();
    let names: Vec<&str> = candidates.iter().map(|c| c["name"].as_str().unwrap()).collect();
    for name in ["default", "without descriptors beside", "features alone", "adapted"] {
        assert!(names.contains(&name), "{names:?}");
    }
    let taken: Vec<&Value> = candidates.iter().filter(|c| c["taken"] == true).collect();
    assert_eq!(taken.len(), 1);
    let least =
        candidates.iter().map(|c| c["expected_error"].as_f64().unwrap()).fold(f64::INFINITY, f64::min);
    assert!(taken[0]["expected_error"].as_f64().unwrap() <= least / 0.9);
    assert_eq!(summary["quality"]["expected_error"], taken[0]["expected_error"]);
}

/// What the measures need of a person, and where the points of the template are: line `i` of the ground truth of each
/// person is the same point, and its mirror image.
struct Person {
    mesh: Mesh,
    laplacian: Laplacian,
    basis: Eigenbasis,
    frame: SurfaceFrame,
    points: Vec<u32>,
    mirrored: Vec<u32>,
}

impl Person {
    fn read(folder: &Path, number: &str) -> Self {
        let mesh = read_mesh(&folder.join(format!("tr_reg_{number}.off"))).unwrap().mesh;
        let laplacian = Laplacian::new(&mesh);
        let basis = eigenbasis(&laplacian, 30, &EigenOptions::default()).unwrap().0.at_unit_area(30);
        let frame = SurfaceFrame::new(&mesh);
        let vertices = |ending: &str| {
            let path = folder.join(format!("corres/tr_reg_{number}.{ending}"));
            read_point_map(&path, None).unwrap().targets
        };
        Self { mesh, laplacian, basis, frame, points: vertices("vts"), mirrored: vertices("sym.vts") }
    }

    fn side(&self) -> Side<'_> {
        Side { mesh: &self.mesh, laplacian: &self.laplacian, basis: &self.basis, frame: &self.frame }
    }

    /// The point of the template at, or next to, each vertex.
    fn nearest_points(&self) -> Vec<u32> {
        let places: Vec<[f64; 3]> = self.points.iter().map(|&v| self.mesh.vertices()[v as usize]).collect();
        nearest_vertices(&places, self.mesh.vertices())
    }

    /// Whether each vertex is on one leg, up to the thigh, and whether on the other.
    fn legs(&self) -> [Vec<bool>; 2] {
        let height = |point: usize| self.mesh.vertices()[self.points[point] as usize][1];
        let toe = (0..self.points.len()).min_by(|&a, &b| height(a).total_cmp(&height(b))).unwrap();
        let solver = GeodesicSolver::new(&self.mesh, &GeodesicOptions::default());
        let reach = 0.45 * self.mesh.area().sqrt();
        [self.points[toe], self.mirrored[toe]]
            .map(|toe| solver.from_source(toe).iter().map(|&d| f64::from(d) < reach).collect())
    }
}

/// The share of pairs of a vertex inside and one outside of which the one inside has the larger value.
fn area_under_curve(values: &[f32], inside: &[bool]) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let (mut outside, mut pairs) = (0.0, 0.0);
    for equal in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let n_inside = equal.iter().filter(|&&v| inside[v]).count() as f64;
        let n_outside = equal.len() as f64 - n_inside;
        pairs += n_inside * (outside + n_outside / 2.0);
        outside += n_outside;
    }
    pairs / (outside * (values.len() as f64 - outside))
}

/// Legs of right maps between four pairs of people are sent to the other side: the map is doubtful, and the doubt of
/// the vertices says which ones were sent.
#[test]
fn doubt_finds_the_vertices_of_exchanged_legs() {
    let Some(data) = research_data() else { return };
    let data = data.join("faust/remeshed_5k");
    for [a, b] in [["061", "074"], ["063", "072"], ["071", "073"], ["079", "076"]] {
        let (source, target) = (Person::read(&data, a), Person::read(&data, b));
        let (points, [one, other]) = (source.nearest_points(), source.legs());
        let both = one.iter().zip(&other).map(|(a, b)| a | b).collect();
        for (name, leg) in [("no leg", vec![false; one.len()]), ("one leg", one), ("both legs", both)] {
            let image = |(&point, &is_sent): (&u32, &bool)| {
                if is_sent { target.mirrored[point as usize] } else { target.points[point as usize] }
            };
            let targets = points.iter().zip(&leg).map(image).collect();
            let map = PointMap::new(targets, target.mesh.n_vertices());
            let quality = Quality::measure(&map, None, source.side(), target.side()).unwrap();
            let estimate = Calibration::default().estimate(&quality);
            let n_regions = displaced_regions(&map, source.side(), target.side()).len();
            let is_doubted = estimate.doubtful || n_regions > 0;
            let auc = area_under_curve(&doubt(&map, None, source.side(), target.side()), &leg);
            eprintln!("{a}-{b}, {name}: {n_regions} regions, AUC {auc:.3}, {estimate:?}");
            match name {
                "no leg" => assert!(!is_doubted),
                _ => assert!(is_doubted && auc > 0.95),
            }
        }
    }
}
