//! Comparison with the eigenvalues that scipy finds for real meshes, where these are at hand.

use super::{EigenOptions, eigenbasis};
use crate::io::read_mesh;
use crate::spectral::Laplacian;
use std::path::{Path, PathBuf};

/// The folder of the data, and next to it that of the reference outputs.
fn folders() -> (PathBuf, PathBuf) {
    let data = std::env::var_os("FMNET_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let reference = data.join("../reference");
    (data, reference)
}

fn array(npz: &Path, name: &str) -> Vec<f64> {
    let mut archive = npyz::npz::NpzArchive::open(npz).unwrap();
    archive.by_name(name).unwrap().unwrap().into_vec().unwrap()
}

fn largest_relative_difference(ours: &[f64], reference: &[f64], floor: f64) -> f64 {
    let difference = |(a, b): (&f64, &f64)| (a - b).abs() / b.abs().max(floor);
    ours.iter().zip(reference).map(difference).fold(0.0, f64::max)
}

#[test]
fn eigenvalues_and_mass_agree_with_scipy() {
    let (data, reference) = folders();
    for (name, mesh) in [
        ("faust_tr_reg_060", "faust/registrations/tr_reg_060.ply"),
        ("faust_5k_tr_reg_060", "faust/remeshed_5k/tr_reg_060.off"),
        ("scan_7k_000", "faust/scans_7k/test_scan_000.off"),
    ] {
        let npz = reference.join(format!("{name}_spectrum_geodesics.npz"));
        let mesh = data.join(mesh);
        if !(npz.exists() && mesh.exists()) {
            crate::skip::skipped(format!("{} or {} is absent", npz.display(), mesh.display()));
            continue;
        }
        let (mass, eigenvalues) = (array(&npz, "mass"), array(&npz, "eigenvalues"));
        let laplacian = Laplacian::new(&read_mesh(&mesh).unwrap().mesh);
        let (basis, info) = eigenbasis(&laplacian, eigenvalues.len(), &EigenOptions::default()).unwrap();
        let floor = 1e-6 * eigenvalues[eigenvalues.len() - 1];
        let difference = largest_relative_difference(&basis.eigenvalues, &eigenvalues, floor);
        assert!(difference < 1e-6, "{name}: eigenvalues differ by {difference:.1e}");
        let mean = mass.iter().sum::<f64>() / mass.len() as f64;
        let difference = largest_relative_difference(&basis.mass, &mass, mean);
        assert!(difference < 1e-6, "{name}: masses differ by {difference:.1e} of their mean");
        assert_eq!(info.complete, Some(true), "{name}");
        assert!(info.max_residual < 1e-8, "{name}: residual {:.1e}", info.max_residual);
    }
}
