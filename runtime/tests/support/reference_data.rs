//! The meshes and descriptors of `shared/reference`, where that folder exists.

#![allow(clippy::unwrap_used)] // The bench, which is no test to clippy, shares this file.

use std::{
    fs,
    path::{Path, PathBuf},
};

#[path = "skipped.rs"]
mod skip;

use fmnet::{Matrix, Mesh};
use skip::skipped;

/// The folder of the data, `FMNET_DATA` or `../shared/data` next to the repository.
fn data() -> PathBuf {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    std::env::var_os("FMNET_DATA").map_or(beside, PathBuf::from)
}

fn reference() -> PathBuf {
    data().join("../reference")
}

/// Radius relative to sqrt(area) that the reference for mesh `name` was computed with.
pub(crate) fn reference_radius(name: &str) -> f64 {
    description(name)["shot_radius_over_sqrt_area"].as_f64().unwrap()
}

fn description(name: &str) -> serde_json::Value {
    let text = fs::read_to_string(reference().join("reference.json")).unwrap();
    serde_json::from_str::<serde_json::Value>(&text).unwrap()[name].take()
}

/// A mesh, the vertices that have a reference descriptor, and these descriptors; `None` with a message where the
/// data is absent.
pub(crate) fn reference_rows(name: &str) -> Option<(Mesh, Vec<i32>, Matrix<f32>)> {
    let path = reference().join(format!("{name}_shot.npz"));
    if !path.exists() {
        skipped(format!("{} is absent; set FMNET_DATA to the data folder", path.display()));
        return None;
    }
    let mut archive = npyz::npz::NpzArchive::open(&path).unwrap();
    let vertices: Vec<i32> = archive.by_name("vertices").unwrap().unwrap().into_vec().unwrap();
    let rows: Vec<f32> = archive.by_name("shot").unwrap().unwrap().into_vec().unwrap();
    let mesh = data().join("..").join(description(name)["mesh"].as_str().unwrap());
    let width = rows.len() / vertices.len();
    Some((read_mesh(&mesh), vertices.clone(), Matrix::from_vec(vertices.len(), width, rows)))
}

fn read_mesh(path: &Path) -> Mesh {
    match path.extension().and_then(|e| e.to_str()) {
        Some("ply") => read_binary_ply(&fs::read(path).unwrap()),
        _ => read_off(&fs::read_to_string(path).unwrap()),
    }
}

fn read_off(text: &str) -> Mesh {
    let mut numbers = text.split_whitespace().skip(1).map(|t| t.parse::<f64>().unwrap());
    let mut next = || numbers.next().unwrap();
    let [n, m, _] = [next(), next(), next()].map(|x| x as usize);
    let vertices = (0..n).map(|_| [next(), next(), next()]).collect();
    let faces =
        (0..m).map(|_| [next(), next(), next(), next()]).map(|[_, a, b, c]| [a, b, c].map(|i| i as u32));
    Mesh::new(vertices, faces.collect()).unwrap()
}

/// Little endian, float coordinates, triangles of ints.
fn read_binary_ply(bytes: &[u8]) -> Mesh {
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..body]).unwrap();
    let count = |element: &str| -> usize {
        let line = header.lines().find_map(|l| l.strip_prefix(element)).unwrap();
        line.trim().parse().unwrap()
    };
    let (vertices, faces) = bytes[body..].split_at(12 * count("element vertex"));
    let word = |bytes: &[u8], at: usize| -> [u8; 4] { bytes[at..at + 4].try_into().unwrap() };
    let vertex = |v: &[u8]| [0, 4, 8].map(|at| f64::from(f32::from_le_bytes(word(v, at))));
    let face = |f: &[u8]| [1, 5, 9].map(|at| u32::from_le_bytes(word(f, at)));
    let vertices = vertices.chunks_exact(12).map(vertex).collect();
    Mesh::new(vertices, faces.chunks_exact(13).take(count("element face")).map(face).collect()).unwrap()
}
