//! Parts of shapes that have triangulations of their own: `shapes/NAME.ply` and `shapes/NAME_KIND.ply` with `.corr`, and
//! `dataset.toml`.

use super::folder::{claim, save};
use super::{Part, PartKind, PartOptions, SimulateError, SimulateProgress, cut_part};
use crate::dataset::{Correspondence, Dataset, ShapeEntry, manifest};
use fmnet::Mesh;
use fmnet::io::write_surface_points;
use fmnet::mesh::SurfacePoint;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The folder of the meshes.
const SHAPES: &str = "shapes";

/// Writes every whole shape with a part of each kind, and says how many parts there are; see
/// [`write_parts`](super::write_parts()).
pub(super) fn write_surface_parts(
    dataset: &Dataset,
    out: &Path,
    options: &PartOptions,
    progress: SimulateProgress,
) -> Result<usize, SimulateError> {
    let wholes: Vec<&ShapeEntry> = dataset.shapes.iter().filter(|shape| !shape.is_part()).collect();
    let unfit = |reason: String| SimulateError::Unfit { folder: dataset.folder.clone(), reason };
    if wholes.is_empty() {
        return Err(unfit("no whole shapes to cut".into()));
    }
    claim(out, &[SHAPES], "parts", &dataset.folder, options)?;
    let named = |name: &str| wholes.iter().any(|whole| whole.name == name);
    if let Some(name) = wholes.iter().flat_map(|whole| part_names(whole, options)).find(|name| named(name)) {
        return Err(unfit(format!("a part would be named {name} like a whole; rename that shape")));
    }
    let done = AtomicUsize::new(0);
    let make = |(number, whole): (usize, &&ShapeEntry)| {
        let mesh = whole.read()?;
        let points = whole.surface_points(&mesh)?;
        let written = written(whole, out, &whole.name, None);
        save_with_points(&written, &mesh, &points)?;
        let mut entries = vec![written];
        for (&kind, name) in options.kinds.iter().zip(part_names(whole, options)) {
            let part = written_part(&entries[0], out, &name);
            // The mesh is written last, so that one that is there is complete.
            if !part.mesh.is_file() {
                cut(&part, &mesh, &points, kind, options, number).map_err(|e| e.in_shape(&whole.name))?;
            }
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, wholes.len() * options.kinds.len(), &name);
            entries.push(part);
        }
        Ok::<Vec<ShapeEntry>, SimulateError>(entries)
    };
    let entries: Vec<Vec<ShapeEntry>> = wholes.par_iter().enumerate().map(make).collect::<Result<_, _>>()?;
    manifest::write(out, &entries.concat())?;
    Ok(wholes.len() * options.kinds.len())
}

/// The names of a shape's parts, by kind.
fn part_names(whole: &ShapeEntry, options: &PartOptions) -> impl Iterator<Item = String> {
    options.kinds.iter().map(|kind| format!("{}_{}", whole.name, kind.name()))
}

/// The entry of a shape that is written as `name`.
fn written(entry: &ShapeEntry, out: &Path, name: &str, whole: Option<PathBuf>) -> ShapeEntry {
    let file = |extension: &str| out.join(SHAPES).join(format!("{name}.{extension}"));
    let (mesh, correspondence) = (file("ply"), Correspondence::Surface(file("corr")));
    ShapeEntry { name: name.to_string(), mesh, correspondence, whole, ..entry.clone() }
}

fn written_part(whole: &ShapeEntry, out: &Path, name: &str) -> ShapeEntry {
    written(whole, out, name, Some(whole.mesh.clone()))
}

fn cut(
    part: &ShapeEntry,
    whole: &Mesh,
    points: &[Option<SurfacePoint>],
    kind: PartKind,
    options: &PartOptions,
    number: usize,
) -> Result<(), SimulateError> {
    let made = cut_part(whole, kind, options, number as u64)?;
    let points = points_of_part(&made, whole, points);
    save_with_points(part, &made.mesh, &points)
}

fn save_with_points(
    entry: &ShapeEntry,
    mesh: &Mesh,
    points: &[Option<SurfacePoint>],
) -> Result<(), SimulateError> {
    if let Correspondence::Surface(path) = &entry.correspondence {
        write_surface_points(path, points)?;
    }
    save(&entry.mesh, mesh)
}

/// Where points of the whole lie on the part, `None` where their triangle was cut away.
fn points_of_part(part: &Part, whole: &Mesh, points: &[Option<SurfacePoint>]) -> Vec<Option<SurfacePoint>> {
    let of_whole = |face: &[u32; 3]| face.map(|corner| part.origin[corner as usize]);
    let faces: HashMap<[u32; 3], u32> = part.mesh.faces().iter().map(of_whole).zip(0..).collect();
    let on_part = |point: SurfacePoint| {
        let face = *faces.get(&whole.faces()[point.face as usize])?;
        Some(SurfacePoint { face, ..point })
    };
    points.iter().map(|point| point.and_then(on_part)).collect()
}
