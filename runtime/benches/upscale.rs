//! Error, seconds and peak memory of upscaling from 15K vertices, with 30 % of the matches wrong.
//!
//! Two poses of one connectivity are subdivided twice and displaced along their normals, so that vertex i corresponds with
//! vertex i; each is decimated as the pipeline does, and the true map of the decimated meshes, with random targets for 30 % of
//! its vertices, is upscaled by the l2,1 problem and by least squares. Errors are mean geodesic x 100, relative to sqrt(area).
//!
//! `cargo bench --bench upscale -- [SOURCE TARGET] [--subdivisions N] [--vertices N]`: mesh files of one connectivity; without
//! them a generated body and a bent copy of it.

use fmnet::Mesh;
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::mesh::{DecimateOptions, Decimated, decimate, nearest_vertices, shapes};
use fmnet::point_map::{PointMap, recover};
use fmnet::spectral::{EigenOptions, Eigenbasis, Laplacian, eigenbasis};
use fmnet::synth::{Species, demo_pair};
use fmnet::upscale::{
    AdmmOptions, delta_coefficients, full_point_map, l21_functional_map, least_squares_functional_map,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::time::Instant;

/// Eigenfunctions of the full meshes, as in the pipeline.
const K: usize = 100;
/// Vertices that the error is measured at.
const SAMPLES: usize = 4000;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
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
    let mut seed = 0;
    let [source, target] = pair.map(|mesh| {
        seed += 1;
        displaced((0..number("--subdivisions", 2)).fold(mesh, |mesh, _| shapes::subdivide(&mesh)), seed)
    });
    println!("{} vertices", source.n_vertices());
    measure(&source, &target, number("--vertices", 15_000));
    println!("peak memory {:.2} GB", peak_memory_gb());
}

/// A body, and the same bent about its height.
fn generated() -> [Mesh; 2] {
    let mesh = demo_pair(Species::Man, 0).source.mesh;
    let bend = |&[x, y, z]: &[f64; 3]| {
        let (sin, cos) = (0.4 * y).sin_cos();
        [x * cos - z * sin, y, x * sin + z * cos + 0.1 * y * y]
    };
    let bent = Mesh::new(mesh.vertices().iter().map(bend).collect(), mesh.faces().to_vec());
    [mesh, bent.expect("bending keeps vertices finite")]
}

/// Every vertex moved along its normal by up to a tenth of the mean edge.
fn displaced(mesh: Mesh, seed: u64) -> Mesh {
    let mut normals = vec![[0.0; 3]; mesh.n_vertices()];
    for (f, face) in mesh.faces().iter().enumerate() {
        let cross = mesh.face_cross(f);
        for &v in face {
            (0..3).for_each(|d| normals[v as usize][d] += cross[d]);
        }
    }
    let amplitude = 0.1 * (mesh.area() / mesh.n_vertices() as f64).sqrt();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let moved = mesh.vertices().iter().zip(&normals).map(|(p, n)| {
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let step = amplitude * rng.random_range(-1.0..1.0) / length;
        [p[0] + step * n[0], p[1] + step * n[1], p[2] + step * n[2]]
    });
    Mesh::new(moved.collect(), mesh.faces().to_vec()).expect("small steps keep vertices finite")
}

fn measure(source: &Mesh, target: &Mesh, n_work: usize) {
    let reduce =
        |mesh: &Mesh| decimate(mesh, n_work, &DecimateOptions::default()).expect("bodies are manifold");
    let [work_source, work_target] = [source, target].map(|mesh| timed("decimate", || reduce(mesh)));
    let [basis_source, basis_target] =
        [source, target].map(|mesh| timed("full eigenbasis", || basis_of(mesh)));
    let solver =
        GeodesicSolver::new(target, &GeodesicOptions { n_neighbors: 40, ..GeodesicOptions::default() });
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
        println!("\n{:.0} % wrong matches: error of the decimated map {:.3}", 100.0 * wrong, error(&matches));
        let (phi, psi) = delta_coefficients(&basis_source, &basis_target, &matches);
        let robust = timed("l2,1", || {
            l21_functional_map(&phi, &psi, &AdmmOptions::default()).expect("enough matches").0
        });
        let plain = least_squares_functional_map(&phi, &psi).expect("enough matches");
        for (name, map) in [("l2,1", &robust), ("least squares", &plain)] {
            let full = timed("nearest neighbours", || {
                recover(map, &basis_source, &basis_target).expect("the map fits its bases")
            });
            println!("  {name}: error of the full map {:.3}", error(&whole_map(&full)));
        }
        let full = timed("full point map", || {
            full_point_map(&robust, &basis_source, &basis_target, source.vertices(), &matches)
                .expect("the map fits its bases")
        });
        println!("  l2,1 and residuals: error of the full map {:.3}", error(&whole_map(&full)));
    }
}

fn basis_of(mesh: &Mesh) -> Eigenbasis {
    let (basis, _) = eigenbasis(&Laplacian::new(mesh), K, &EigenOptions::default()).expect("100 eigenpairs");
    basis.at_unit_area(K)
}

/// The decimated source's vertices with the nearest of the decimated target's to their true target, a share of them with
/// random ones, in the vertices of the full meshes.
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

fn timed<T>(name: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    println!("  {name}: {:.2} s", start.elapsed().as_secs_f64());
    result
}

/// The largest resident size so far; 0 where the system does not say.
fn peak_memory_gb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1e6
}
