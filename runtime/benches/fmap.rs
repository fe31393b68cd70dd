//! Milliseconds of the functional map solves, of reading the point map off and of the refinements.
//!
//! Two generated people of 6890 vertices, described by the built-in model, 200 eigenfunctions.
//! `cargo bench --workspace --bench fmap`; options of every bench (`-- --help`); `RAYON_NUM_THREADS` sets the
//! threads. `benches/peers/fmap.py` does the same in NumPy and pyFM on what `--export` wrote.

mod support;

use fmnet::fmap::{FmapSolver, functional_map, functional_maps};
use fmnet::io::{IoError, write_matrix, write_vector};
use fmnet::pipeline::{DescribedShape, MatchOptions, Matcher, Resize};
use fmnet::point_map::{Comparison, PointMap, recover};
use fmnet::refine::{WaveletHints, WaveletOptions, ZoomOutOptions, wavelet, zoomout};
use fmnet::shape::Context;
use fmnet::spectral::Eigenbasis;
use fmnet::{Matrix, Mesh};
use std::path::Path;
use support::report::{Cost, Report, least};
use support::shapes::bodies;

const VERTICES: usize = 6890;
/// Eigenfunctions that refinement goes up to.
const K: usize = 200;
/// Eigenfunctions of the map that is read off and refined, those of the built-in model.
const K_MAP: usize = 100;
const SOLVES: [usize; 2] = [70, K_MAP];
/// Length of the descriptors beside the rows of the wavelet filter's embeddings, as in matching.
const BESIDE: f64 = 10.0;

/// A shape with what is computed of it before the maps.
struct Side {
    mesh: Mesh,
    /// At unit area, `[n, K]`.
    basis: Eigenbasis,
    /// The descriptors' coefficients, `[K, d]`.
    coefficients: Matrix,
    /// The descriptors, with rows of the length [`BESIDE`], `[n, d]`.
    descriptors: Matrix,
}

impl Side {
    fn new(DescribedShape { shape, descriptors, .. }: DescribedShape) -> Self {
        let basis = shape.unit_basis(K, Context::SILENT).expect("a clean mesh");
        let coefficients = basis.project(&descriptors);
        let mut beside = descriptors.map(f64::from);
        for i in 0..beside.rows() {
            let row = beside.row_mut(i);
            let length = row.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            row.iter_mut().for_each(|x| *x *= BESIDE / length);
        }
        Self { mesh: shape.mesh().clone(), basis, coefficients, descriptors: beside }
    }

    /// The basis and the coefficients of the first `k` eigenfunctions.
    fn first(&self, k: usize) -> (Eigenbasis, Matrix) {
        let rows: Vec<u32> = (0..k as u32).collect();
        (self.basis.truncated(k), self.coefficients.select_rows(&rows))
    }

    fn write(&self, folder: &Path, name: &str) -> Result<(), IoError> {
        let file = |what: &str| folder.join(format!("{name}-{what}.npy"));
        write_vector(&file("eigenvalues"), &self.basis.eigenvalues)?;
        write_matrix(&file("eigenvectors"), &self.basis.eigenvectors)?;
        write_vector(&file("mass"), &self.basis.mass)?;
        write_matrix(&file("coefficients"), &self.coefficients)
    }
}

fn main() {
    let report = Report::from_arguments("fmap");
    let options = MatchOptions::default().decimate(Resize::Never).subdivide(Resize::Never);
    let matcher = Matcher::new(&options).expect("the built-in model");
    let sides = bodies(VERTICES).map(|mesh| {
        Side::new(matcher.describe("body", &mesh, &fmnet::events::ignore).expect("a clean mesh"))
    });
    report.export("fmap", |folder| {
        sides[0].write(folder, "source").and_then(|()| sides[1].write(folder, "target"))
    });
    for k in SOLVES {
        solve(&report, "least squares", k, FmapSolver::LeastSquares, &sides);
        solve(&report, "regularised", k, FmapSolver::default(), &sides);
    }
    refine_one_way(&report, &sides);
    refine_both_ways(&report, &sides);
}

fn solve(report: &Report, name: &str, k: usize, solver: FmapSolver, [source, target]: &[Side; 2]) {
    let ((source, f_hat), (target, g_hat)) = (source.first(k), target.first(k));
    let run = || functional_map(&source, &target, &f_hat, &g_hat, solver).expect("a finite system");
    let (cost, (c, _)) = least(report.runs(5), run);
    tell(report, &format!("{name}-{k}"), cost);
    report.export("fmap", |folder| write_matrix(&folder.join(format!("{name}-{k}.npy")), &c));
}

/// The point map by one functional map, and ZoomOut as in the paper.
fn refine_one_way(report: &Report, sides: &[Side; 2]) {
    let [(source, f_hat), (target, g_hat)] = sides.each_ref().map(|side| side.first(K_MAP));
    let solver = FmapSolver::default();
    let (c, _) = functional_map(&source, &target, &f_hat, &g_hat, solver).expect("a finite system");
    let (cost, map) = least(report.runs(5), || recover(&c, &source, &target).expect("a map of the shapes"));
    tell(report, "point map", cost);
    report.export("fmap", |folder| write_targets(&folder.join("point map.npy"), &map));
    let mut options = ZoomOutOptions::default();
    options.bidirectional = false;
    let run = || zoomout(&map, &sides[0].basis, &sides[1].basis, &options).expect("a map of the shapes").map;
    let (cost, refined) = least(report.runs(3), run);
    tell(report, "zoomout", cost);
    report.export("fmap", |folder| write_targets(&folder.join("zoomout.npy"), &refined));
}

/// What `match` does: functional maps and point maps of both directions, refined together by the wavelet filter.
fn refine_both_ways(report: &Report, sides: &[Side; 2]) {
    let [(source, f_hat), (target, g_hat)] = sides.each_ref().map(|side| side.first(K_MAP));
    let solver = FmapSolver::Joint { weight: FmapSolver::DEFAULT_MASK_WEIGHT };
    let run = || functional_maps(&source, &target, &f_hat, &g_hat, solver).expect("a finite system").0;
    let (cost, maps) = least(report.runs(5), run);
    tell(report, "functional maps of both directions", cost);
    let embedding = maps.embedding(Comparison::Joint, &source, &target).expect("maps of the shapes");
    let maps = embedding.both().expect("finite rows");
    let anchors = sides.each_ref().map(|side| side.descriptors.clone());
    let meshes = sides.each_ref().map(|side| &side.mesh);
    let hints = WaveletHints { anchors: Some(&anchors), meshes: Some(meshes) };
    let options = WaveletOptions::coarse_to_fine(K_MAP, K);
    let run = || {
        wavelet(maps.each_ref(), &sides[0].basis, &sides[1].basis, hints, &options)
            .expect("maps of the shapes")
    };
    let (cost, _) = least(report.runs(3), run);
    tell(report, "wavelet filter, both directions", cost);
}

fn tell(report: &Report, name: &str, cost: Cost) {
    let mut figures = cost.figures();
    figures["vertices"] = VERTICES.into();
    report.figure(&format!("{name:<36} {:>9.2} ms", 1e3 * cost.seconds), &format!("fmap-{name}"), figures);
}

fn write_targets(path: &Path, map: &PointMap) -> Result<(), IoError> {
    write_vector(path, &map.targets.iter().map(|&target| target as i32).collect::<Vec<_>>())
}
