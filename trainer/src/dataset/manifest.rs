//! `dataset.toml`: a dataset of your own.
//!
//! ```toml
//! format = 1
//! [[shape]]
//! name = "horse_03"
//! mesh = "horse/horse_03.ply"            # relative to the manifest
//! group = "horse"                        # shapes of one group correspond with each other
//! correspondence = "horse/horse_03.vts"  # line i: 1-based vertex of point i, 0 where missing; absent: vertex i is point i
//! split = "train"                        # train | validation | test
//! partial = false                        # a part of a whole: a source only
//! ```

use super::{Correspondence, DatasetError, ShapeEntry, Split};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The manifest's name in a dataset's folder.
pub const FILE_NAME: &str = "dataset.toml";
const FORMAT: u32 = 1;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    format: u32,
    #[serde(default)]
    shape: Vec<ManifestShape>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestShape {
    name: String,
    mesh: String,
    group: String,
    correspondence: Option<String>,
    split: Split,
    #[serde(default)]
    partial: bool,
}

/// Reads a manifest; paths are relative to its folder.
pub(super) fn read(path: &Path) -> Result<Vec<ShapeEntry>, DatasetError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| DatasetError::Folder { path: path.to_path_buf(), source })?;
    let wrong = |reason: String| DatasetError::Manifest { path: path.to_path_buf(), reason };
    let manifest: Manifest = toml::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    if manifest.format != FORMAT {
        return Err(wrong(format!("format = {}, but this version reads {FORMAT}", manifest.format)));
    }
    if manifest.shape.is_empty() {
        return Err(wrong("no [[shape]] in it".into()));
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut names = BTreeSet::new();
    let wholes: BTreeMap<String, PathBuf> = (manifest.shape.iter().rev().filter(|shape| !shape.partial))
        .map(|shape| (shape.group.clone(), folder.join(&shape.mesh)))
        .collect();
    let mut shapes = Vec::with_capacity(manifest.shape.len());
    for shape in manifest.shape {
        if !names.insert(shape.name.clone()) {
            return Err(wrong(format!("two shapes are named {:?}; names must differ", shape.name)));
        }
        let correspondence = match shape.correspondence {
            Some(file) => Correspondence::Vts(folder.join(file)),
            None => Correspondence::Identity,
        };
        let whole = if shape.partial { wholes.get(&shape.group).cloned() } else { None };
        if shape.partial && whole.is_none() {
            return Err(wrong(format!(
                "{:?} is partial, but its group {:?} has no whole shape",
                shape.name, shape.group
            )));
        }
        shapes.push(ShapeEntry {
            name: shape.name,
            mesh: folder.join(shape.mesh),
            group: shape.group,
            correspondence,
            split: shape.split,
            whole,
        });
    }
    Ok(shapes)
}
