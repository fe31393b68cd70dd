//! An output folder that knows what is written into it, so that an interrupted run can go on.

use super::SimulateError;
use crate::dataset::{Correspondence, Dataset, ShapeEntry};
use fmnet::Mesh;
use fmnet::io::{Attributes, IoError, write_atomically, write_mesh, write_surface_points};
use fmnet::mesh::SurfacePoint;
use serde::Serialize;
use std::fs;
use std::path::Path;

/// The folder of the meshes that a manifest lists.
pub(super) const SHAPES: &str = "shapes";

/// Tells what was simulated, and how.
const RECORD: &str = "simulation.toml";

#[derive(Serialize)]
struct Record<'a, O> {
    kind: &'a str,
    dataset: String,
    options: &'a O,
}

/// Makes the folder with its subfolders, or goes on in one that was begun with the same dataset and options.
pub(super) fn claim<O: Serialize>(
    out: &Path,
    subfolders: &[&str],
    kind: &str,
    dataset: &Path,
    options: &O,
) -> Result<(), SimulateError> {
    let dataset = fs::canonicalize(dataset).unwrap_or_else(|_| dataset.to_path_buf());
    let dataset = dataset.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let record = toml::to_string(&Record { kind, dataset, options }).expect("plain data serialises");
    let path = out.join(RECORD);
    match fs::read_to_string(&path) {
        Ok(found) if found != record => return Err(SimulateError::OtherSimulation { path }),
        _ => {}
    }
    for subfolder in subfolders {
        let folder = out.join(subfolder);
        fs::create_dir_all(&folder).map_err(|source| IoError::Write { path: folder, source })?;
    }
    Ok(write_atomically(&path, |file| file.write_all(record.as_bytes()))?)
}

/// Writes a mesh without attributes.
pub(super) fn save(path: &Path, mesh: &Mesh) -> Result<(), SimulateError> {
    Ok(write_mesh(path, mesh, &Attributes::default())?)
}

/// The entry of a shape that is written to the folder `out` as `name`, with points on its surface.
pub(super) fn surface_entry(entry: &ShapeEntry, out: &Path, name: String) -> ShapeEntry {
    let file = |extension: &str| out.join(SHAPES).join(format!("{name}.{extension}"));
    let (mesh, correspondence) = (file("ply"), Correspondence::Surface(file("corr")));
    ShapeEntry { name, mesh, correspondence, ..entry.clone() }
}

/// Writes the files of such an entry.
pub(super) fn save_with_points(
    entry: &ShapeEntry,
    mesh: &Mesh,
    points: &[Option<SurfacePoint>],
) -> Result<(), SimulateError> {
    if let Correspondence::Surface(path) = &entry.correspondence {
        write_surface_points(path, points)?;
    }
    // The mesh is written last, so that one that is there is complete.
    save(&entry.mesh, mesh)
}

/// Refuses names that are no names for files.
pub(super) fn check_names<'a>(
    dataset: &Dataset,
    mut shapes: impl Iterator<Item = &'a ShapeEntry>,
) -> Result<(), SimulateError> {
    match shapes.find(|shape| shape.name.contains(['/', '\\']) || shape.name.starts_with('.')) {
        None => Ok(()),
        Some(shape) => Err(SimulateError::Unfit {
            folder: dataset.folder.clone(),
            reason: format!("the name {:?} is no name for a file; choose another one", shape.name),
        }),
    }
}
