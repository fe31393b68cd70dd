//! Agreement with another implementation of the exact algorithm on real meshes, where these are at hand.

use std::path::PathBuf;

use super::{GeodesicOptions, GeodesicSolver, exact};
use crate::io::read_mesh;

/// The folder with the research data, and the reference outputs beside it.
fn data_folder() -> PathBuf {
    let default = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    std::env::var_os("FMNET_DATA").map_or_else(default, PathBuf::from)
}

fn check(mesh_file: &str, reference: &str) {
    let data = data_folder();
    let reference = data.join("../reference").join(format!("{reference}_spectrum_geodesics.npz"));
    if !data.join(mesh_file).exists() || !reference.exists() {
        crate::skip::skipped(format!(
            "{mesh_file} or its reference is not at hand; set FMNET_DATA to the data's folder"
        ));
        return;
    }
    let mesh = read_mesh(&data.join(mesh_file)).unwrap().mesh;
    let mut arrays = npyz::npz::NpzArchive::open(reference).unwrap();
    let sources: Vec<i32> = arrays.by_name("geodesic_sources").unwrap().unwrap().into_vec().unwrap();
    let expected: Vec<f32> = arrays.by_name("geodesics").unwrap().unwrap().into_vec().unwrap();
    let (scale, solver) = (mesh.scale(), GeodesicSolver::new(&mesh, &GeodesicOptions::default()));
    // Sums of relative errors and counts, at all and at short range.
    let mut errors = [(0.0, 0usize); 2];
    for (row, &source) in expected.chunks(mesh.n_vertices()).zip(&sources) {
        let (ours, fast) = (exact(&mesh, source as u32), solver.from_source(source as u32));
        for v in (0..mesh.n_vertices()).filter(|&v| v != source as usize) {
            let expected = f64::from(row[v]);
            assert!((ours[v] - expected).abs() < 1e-6 * scale, "{source} to {v}: {} for {expected}", ours[v]);
            let error = (f64::from(fast[v]) - ours[v]) / ours[v];
            assert!((-1e-5..0.02).contains(&error), "{source} to {v}: off by {error}");
            let ranges = if ours[v] < 0.05 * scale { 0..2 } else { 0..1 };
            errors[ranges].iter_mut().for_each(|(sum, count)| (*sum, *count) = (*sum + error, *count + 1));
        }
    }
    let [overall, short] = errors.map(|(sum, count)| sum / count as f64);
    assert!(overall < 5e-4 && short < 1e-4, "mean error {overall} overall, {short} at short range");
}

#[test]
fn faust_registration() {
    check("faust/registrations/tr_reg_060.ply", "faust_tr_reg_060");
}

#[test]
fn faust_remeshed() {
    check("faust/remeshed_5k/tr_reg_060.off", "faust_5k_tr_reg_060");
}
