//! Errors, seconds and peak memory of upscaling from 15K vertices, with 30 % of the matches wrong.
//!
//! Two poses of one connectivity are subdivided twice and displaced along their normals, so that vertex i corresponds
//! with vertex i; each is decimated as the pipeline does, and the true map of the decimated meshes, with random
//! targets for 30 % of its vertices, is upscaled by the l2,1 problem and by least squares. Errors are mean geodesic x
//! 100, relative to sqrt(area).
//!
//! `cargo bench --workspace --bench upscale -- [SOURCE TARGET] [--subdivisions N] [--vertices N]`: mesh files of one
//! connectivity; without them a body of the demo and a bent copy of it. Options of every bench: `-- --help`.

mod support;

use fmnet::Mesh;
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::mesh::{DecimateOptions, Decimated, decimate, nearest_vertices, shapes};
use fmnet::point_map::{PointMap, recover};
use fmnet::spectral::{EigenOptions, Eigenbasis, Laplacian, eigenbasis};
use fmnet::upscale::{
    AdmmOptions, delta_coefficients, full_point_map, l21_functional_map, least_squares_functional_map,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::path::Path;
use support::report::{Report, measured};
use support::shapes::{demo_body, displaced};

/// Eigenfunctions of the full meshes, as in the pipeline.
const K: usize = 100;
/// Vertices that the error is measured at.
const SAMPLES: usize = 4000;

fn main() {
    let report = Report::from_arguments("upscale");
    let arguments = &report.words;
    let number = |flag: &str, default: usize| {
        let at = arguments.iter().position(|a| a == flag);
        at.and_then(|i| arguments.get(i + 1)?.parse().ok()).unwrap_or(default)
    };
    let files: Vec<&String> = arguments.iter().filter(|a| Path::new(a).is_file()).collect();
    let pair = match files[..] {
        [source, target] => {
            [source, target].map(|f| fmnet::io::read_mesh(Path::new(f)).expect("a mesh file").mesh)
        }
        _ => generated(),
    };
    assert_eq!(pair[0].faces(), pair[1].faces(), "the meshes must have one connectivity");
    let (subdivisions, n_work) = if report.is_quick() { (0, 3000) } else { (2, 15_000) };
    let mut seed = 0;
    let [source, target] = pair.map(|mesh| {
        seed += 1;
        displaced(
            (0..number("--subdivisions", subdivisions)).fold(mesh, |mesh, _| shapes::subdivide(&mesh)),
            seed,
        )
    });
    report.say(&format!("{} vertices", source.n_vertices()));
    measure(&report, &source, &target, number("--vertices", n_work));
}

/// A body, and the same bent about its height.
fn generated() -> [Mesh; 2] {
    let mesh = demo_body("source");
    let bend = |&[x, y, z]: &[f64; 3]| {
        let (sin, cos) = (0.4 * y).sin_cos();
        [x * cos - z * sin, y, x * sin + z * cos + 0.1 * y * y]
    };
    let bent = Mesh::new(mesh.vertices().iter().map(bend).collect(), mesh.faces().to_vec());
    [mesh, bent.expect("bending keeps vertices finite")]
}

fn measure(report: &Report, source: &Mesh, target: &Mesh, n_work: usize) {
    let reduce =
        |mesh: &Mesh| decimate(mesh, n_work, &DecimateOptions::default()).expect("bodies are manifold");
    let [work_source, work_target] = [source, target].map(|mesh| timed(report, "decimate", || reduce(mesh)));
    let [basis_source, basis_target] =
        [source, target].map(|mesh| timed(report, "full eigenbasis", || basis_of(mesh)));
    let mut options = GeodesicOptions::default();
    options.n_neighbors = 40;
    let solver = timed(report, "geodesic solver", || GeodesicSolver::new(target, &options));
    let error = |pairs: &[(u32, u32)]| {
        let step = pairs.len().div_ceil(SAMPLES);
        let sample: Vec<(u32, u32)> = pairs.iter().copied().step_by(step).collect();
        let sum: f64 = solver.pair_distances(&sample).iter().map(|&d| f64::from(d)).sum();
        100.0 * sum / sample.len() as f64 / target.area().sqrt()
    };
    let whole_map =
        |map: &PointMap| (0..map.len() as u32).zip(map.targets.iter().copied()).collect::<Vec<_>>();
    for wrong in [0.0, 0.3] {
        let matches = true_matches(target, &work_source, &work_target, wrong);
        let error_decimated = error(&matches);
        report.say(&format!(
            "\n{:.0} % wrong matches: error of the decimated map {error_decimated:.3}",
            100.0 * wrong
        ));
        let (phi, psi) = delta_coefficients(&basis_source, &basis_target, &matches);
        let robust = timed(report, "l2,1", || {
            l21_functional_map(&phi, &psi, &AdmmOptions::default()).expect("enough matches").0
        });
        let plain = least_squares_functional_map(&phi, &psi).expect("enough matches");
        let say = |report: &Report, name: &str, full: &PointMap| {
            let error = error(&whole_map(full));
            let figures = json!({
                "vertices": source.n_vertices(), "wrong": wrong, "error": error, "error_decimated": error_decimated
            });
            let line = format!("  {name}: error of the full map {error:.3}");
            report.figure(&line, &format!("upscale-error-{name}-{wrong}"), figures);
        };
        for (name, map) in [("l2,1", &robust), ("least squares", &plain)] {
            let full = timed(report, "nearest neighbours", || {
                recover(map, &basis_source, &basis_target).expect("the map fits its bases")
            });
            say(report, name, &full);
        }
        let full = timed(report, "full point map", || {
            full_point_map(&robust, &basis_source, &basis_target, source.vertices(), &matches)
                .expect("the map fits its bases")
        });
        say(report, "l2,1 and residuals", &full);
    }
}

fn basis_of(mesh: &Mesh) -> Eigenbasis {
    let (basis, _) = eigenbasis(&Laplacian::new(mesh), K, &EigenOptions::default()).expect("100 eigenpairs");
    basis.at_unit_area(K)
}

/// The decimated source's vertices with the nearest of the decimated target's to their true target, a share of them
/// with random ones, in the vertices of the full meshes.
fn true_matches(
    target: &Mesh,
    work_source: &Decimated,
    work_target: &Decimated,
    wrong: f64,
) -> Vec<(u32, u32)> {
    let truth: Vec<[f64; 3]> = work_source.injection.iter().map(|&v| target.vertices()[v as usize]).collect();
    let nearest = nearest_vertices(work_target.mesh.vertices(), &truth);
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let n = work_target.injection.len() as u32;
    let mut chosen = |right: u32| if rng.random_bool(wrong) { rng.random_range(0..n) } else { right };
    let matched = |(&v, right): (&u32, u32)| (v, work_target.injection[chosen(right) as usize]);
    work_source.injection.iter().zip(nearest).map(matched).collect()
}

fn timed<T>(report: &Report, name: &str, work: impl FnOnce() -> T) -> T {
    let (cost, result) = measured(work);
    let line = format!("  {name}: {:.2} s, peak memory {:.0} MB", cost.seconds, cost.peak_mb);
    report.figure(&line, &format!("upscale-{name}"), cost.figures());
    result
}
