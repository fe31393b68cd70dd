//! Research meshes for tests, where they are at hand.

use super::Mesh;
use std::path::{Path, PathBuf};

/// The mesh at `path` in the data folder; `None`, with a message, where there is no such folder.
pub(crate) fn load(path: &str) -> Option<Mesh> {
    let folder = std::env::var_os("FMNET_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let Ok(text) = std::fs::read_to_string(folder.join(path)) else {
        eprintln!("skipped: {path} is not in {}", folder.display());
        return None;
    };
    let mut numbers = text.split_ascii_whitespace().skip(1);
    let mut next = || numbers.next().unwrap();
    let (n, m) = (next().parse().unwrap(), next().parse().unwrap());
    next();
    let vertices = (0..n).map(|_| [(); 3].map(|()| next().parse().unwrap())).collect();
    let faces = (0..m).map(|_| {
        assert_eq!(next(), "3");
        [(); 3].map(|()| next().parse().unwrap())
    });
    Some(Mesh::new(vertices, faces.collect()).unwrap())
}
