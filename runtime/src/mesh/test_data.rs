//! Research meshes for tests, where they are at hand.

use super::Mesh;
use std::path::{Path, PathBuf};

/// The mesh at `path` in the data folder; `None`, with a message, where there is none.
pub(crate) fn load(path: &str) -> Option<Mesh> {
    let folder = std::env::var_os("FMNET_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let file = folder.join(path);
    if !file.exists() {
        crate::skip::skipped(format!("{path} is not in {}", folder.display()));
        return None;
    }
    Some(crate::io::read_mesh(&file).unwrap().mesh)
}
