//! `dataset.toml`: a dataset of your own.
//!
//! ```toml
//! format = 1
//! [[shape]]
//! name = "horse_03"
//! mesh = "horse/horse_03.ply"            # relative to the manifest
//! group = "horse"                        # shapes of one group correspond with each other
//! correspondence = "horse/horse_03.vts"  # line i: 1-based vertex of point i, 0 where missing; absent: vertex i is point i
//!                                        # a .corr file: line i: 1-based triangle of point i and three weights, -1 where missing
//! split = "train"                        # train | validation | test
//! partial = false                        # a part of a whole: a source only
//! whole = "horse/horse_03.ply"           # of a part: the mesh whose area is its unit; absent: the group's first whole
//! ```

use super::{Correspondence, DatasetError, ShapeEntry, Split};
use fmnet::io::write_atomically;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The manifest's name in a dataset's folder.
pub const FILE_NAME: &str = "dataset.toml";
const FORMAT: u32 = 1;

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    format: u32,
    #[serde(default)]
    shape: Vec<ManifestShape>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct ManifestShape {
    name: String,
    mesh: String,
    group: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    correspondence: Option<String>,
    split: Split,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    partial: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    whole: Option<String>,
}

/// Writes the manifest of shapes whose files are in `folder`. Their correspondences are files, or by vertices.
///
/// # Errors
/// If a file is not in the folder, a correspondence is of another kind, or the manifest cannot be written.
pub(crate) fn write(folder: &Path, shapes: &[ShapeEntry]) -> Result<(), DatasetError> {
    let path = folder.join(FILE_NAME);
    let wrong = |reason: String| DatasetError::Manifest { path: path.clone(), reason };
    let relative = |file: &Path| match file.strip_prefix(folder).map(Path::to_str) {
        Ok(Some(inner)) => Ok(inner.replace(std::path::MAIN_SEPARATOR, "/")),
        _ => Err(wrong(format!("{} is not in its folder, or its name is not UTF-8", file.display()))),
    };
    let entry = |shape: &ShapeEntry| {
        let correspondence = match &shape.correspondence {
            Correspondence::Identity => None,
            Correspondence::Vts(file) | Correspondence::Surface(file) => Some(relative(file)?),
            other => return Err(wrong(format!("{}: {other:?} has no place in a manifest", shape.name))),
        };
        Ok(ManifestShape {
            name: shape.name.clone(),
            mesh: relative(&shape.mesh)?,
            group: shape.group.clone(),
            correspondence,
            split: shape.split,
            partial: shape.is_part(),
            // Of one that is elsewhere, the group's first whole stands in.
            whole: shape.whole.as_deref().and_then(|whole| relative(whole).ok()),
        })
    };
    let shape = shapes.iter().map(entry).collect::<Result<_, DatasetError>>()?;
    let text = toml::to_string(&Manifest { format: FORMAT, shape }).map_err(|e| wrong(e.to_string()))?;
    Ok(write_atomically(&path, |file| file.write_all(text.as_bytes()))?)
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
            Some(file) if Path::new(&file).extension().is_some_and(|e| e.eq_ignore_ascii_case("corr")) => {
                Correspondence::Surface(folder.join(file))
            }
            Some(file) => Correspondence::Vts(folder.join(file)),
            None => Correspondence::Identity,
        };
        if shape.whole.is_some() && !shape.partial {
            return Err(wrong(format!(
                "{:?} has a whole, but is not partial; add partial = true",
                shape.name
            )));
        }
        let own = shape.whole.map(|whole| folder.join(whole));
        let whole = if shape.partial { own.or_else(|| wholes.get(&shape.group).cloned()) } else { None };
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
