//! Milliseconds of the functional map solves, of reading the point map off and of the refinements.
//!
//! Two generated people of 6890 vertices, their learned descriptors, 200 eigenfunctions. `cargo bench --workspace --bench fmap`;
//! options of every bench (`-- --help`); `RAYON_NUM_THREADS` sets the threads. `benches/peers/fmap.py` does the same in NumPy and
//! pyFM on what `--export` wrote.

mod support;

use fmnet::descriptor::{ShotOptions, shot};
use fmnet::fmap::{FmapSolver, functional_map};
use fmnet::io::{IoError, write_matrix, write_vector};
use fmnet::network::{Backend, DescriptorNetwork};
use fmnet::point_map::{PointMap, recover};
use fmnet::refine::{IcpOptions, ZoomOutOptions, ZoomOutSamples, icp, zoomout};
use fmnet::spectral::{EigenOptions, Eigenbasis, Laplacian, eigenbasis};
use fmnet::{Matrix, Mesh};
use std::path::Path;
use support::report::{Report, least};
use support::shapes::bodies;

const VERTICES: usize = 6890;
const K: usize = 200;
/// Eigenfunctions of the map that is read off and refined.
const K_MAP: usize = 120;

fn main() {
    let report = Report::from_arguments("fmap");
    let [(basis_source, f_hat), (basis_target, g_hat)] = described(bodies(VERTICES));
    let bases = [&basis_source, &basis_target];
    let inputs = [("source", &basis_source, &f_hat), ("target", &basis_target, &g_hat)];
    report.export("fmap", |folder| {
        inputs.into_iter().try_for_each(|(name, basis, hat)| write_basis(folder, name, basis, hat))
    });
    for k in [70, K_MAP, K] {
        solve(&report, "least-squares", k, FmapSolver::LeastSquares, bases, [&f_hat, &g_hat]);
        let regularized = FmapSolver::Regularized { weight: FmapSolver::DEFAULT_MASK_WEIGHT };
        solve(&report, "regularised", k, regularized, bases, [&f_hat, &g_hat]);
    }
    refine(&report, bases, [&f_hat, &g_hat]);
}

/// The bases at unit area and the coefficients of the learned descriptors, `[k, 352]`.
fn described(meshes: [Mesh; 2]) -> [(Eigenbasis, Matrix); 2] {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("model.onnx");
    let network = DescriptorNetwork::load(&model, Backend::Tract).expect("the built-in model");
    meshes.map(|mesh| {
        let (basis, _) =
            eigenbasis(&Laplacian::new(&mesh), K, &EigenOptions::default()).expect("a clean mesh");
        let (shot, _) = shot(&mesh, &ShotOptions::default()).expect("a mesh with an area");
        let descriptors =
            network.descriptors(mesh.n_vertices(), &[shot.data()]).expect("rows of the right width");
        let basis = basis.at_unit_area(K);
        let coefficients = basis.project(&descriptors);
        (basis, coefficients)
    })
}

/// The first `k` rows.
fn first(coefficients: &Matrix, k: usize) -> Matrix {
    Matrix::from_fn(k, coefficients.cols(), |i, j| coefficients[(i, j)])
}

fn solve(
    report: &Report,
    name: &str,
    k: usize,
    solver: FmapSolver,
    bases: [&Eigenbasis; 2],
    hats: [&Matrix; 2],
) -> Matrix {
    let [basis_source, basis_target] = bases.map(|basis| basis.truncated(k));
    let [f_hat, g_hat] = hats.map(|hat| first(hat, k));
    let run =
        || functional_map(&basis_source, &basis_target, &f_hat, &g_hat, solver).expect("a finite system");
    let (cost, (c, _)) = least(report.runs(5), run);
    tell(report, &format!("{name}-{k}"), cost);
    report.export("fmap", |folder| write_matrix(&folder.join(format!("{name}-{k}.npy")), &c));
    c
}

fn refine(report: &Report, bases: [&Eigenbasis; 2], hats: [&Matrix; 2]) {
    let solver = FmapSolver::Regularized { weight: FmapSolver::DEFAULT_MASK_WEIGHT };
    let [source, target] = bases.map(|basis| basis.truncated(K_MAP));
    let [f_hat, g_hat] = hats.map(|hat| first(hat, K_MAP));
    let (c, _) = functional_map(&source, &target, &f_hat, &g_hat, solver).expect("a finite system");
    let (cost, map) = least(report.runs(5), || recover(&c, &source, &target).expect("a map of the shapes"));
    tell(report, "point-map", cost);
    report.export("fmap", |folder| write_targets(&folder.join("point-map.npy"), &map));
    let mut rounds = IcpOptions::default();
    rounds.max_iterations = 3;
    let (cost, _) =
        least(report.runs(3), || icp(&c, &source, &target, &rounds).expect("a map of the shapes"));
    tell(report, "icp-3-rounds", cost);
    let mut paper = ZoomOutOptions::default();
    paper.bidirectional = false;
    let mut samples = paper.clone();
    samples.samples = ZoomOutSamples::Farthest(1000);
    for (name, options) in [
        ("zoomout", paper),
        ("zoomout-1000-samples", samples),
        ("zoomout-bidirectional", ZoomOutOptions::default()),
    ] {
        let run = || zoomout(&map, bases[0], bases[1], &options).expect("a map of the shapes").map;
        let (cost, refined) = least(report.runs(3), run);
        tell(report, name, cost);
        report.export("fmap", |folder| write_targets(&folder.join(format!("{name}.npy")), &refined));
    }
}

fn tell(report: &Report, name: &str, cost: support::report::Cost) {
    let mut figures = cost.figures();
    figures["vertices"] = VERTICES.into();
    report.figure(&format!("{name:<24} {:>9.2} ms", 1e3 * cost.seconds), &format!("fmap-{name}"), figures);
}

fn write_basis(folder: &Path, name: &str, basis: &Eigenbasis, coefficients: &Matrix) -> Result<(), IoError> {
    let file = |what: &str| folder.join(format!("{name}-{what}.npy"));
    write_vector(&file("eigenvalues"), &basis.eigenvalues)?;
    write_matrix(&file("eigenvectors"), &basis.eigenvectors)?;
    write_vector(&file("mass"), &basis.mass)?;
    write_matrix(&file("coefficients"), coefficients)
}

fn write_targets(path: &Path, map: &PointMap) -> Result<(), IoError> {
    write_vector(path, &map.targets.iter().map(|&target| target as i32).collect::<Vec<_>>())
}
