//! Parts of shapes that have triangulations of their own: `shapes/NAME.ply` and `shapes/NAME_KIND.ply` with `.corr`,
//! and `dataset.toml`.

use super::folder::{SHAPES, check_names, claim, save_with_points, surface_entry};
use super::{Part, PartOptions, SimulateError, SimulateProgress, cut_part};
use crate::dataset::{Dataset, ShapeEntry, manifest};
use fmnet::Mesh;
use fmnet::mesh::SurfacePoint;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

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
    check_names(dataset, wholes.iter().copied())?;
    claim(out, &[SHAPES], "parts", &dataset.folder, options)?;
    let named = |name: &str| wholes.iter().any(|whole| whole.name == name);
    if let Some(name) = wholes.iter().flat_map(|whole| part_names(whole, options)).find(|name| named(name)) {
        return Err(unfit(format!("a part would be named {name} like a whole; rename that shape")));
    }
    let done = AtomicUsize::new(0);
    let make = |(number, whole): (usize, &&ShapeEntry)| {
        let mesh = whole.read()?;
        let points = whole.surface_points(&mesh)?;
        let mut entries = vec![surface_entry(whole, out, whole.name.clone())];
        if !entries[0].mesh.is_file() {
            save_with_points(&entries[0], &mesh, &points)?;
        }
        for (&kind, name) in options.kinds.iter().zip(part_names(whole, options)) {
            let unit = Some(entries[0].mesh.clone());
            let part = ShapeEntry { whole: unit, ..surface_entry(whole, out, name) };
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(count, wholes.len() * options.kinds.len(), &part.name);
            if !part.mesh.is_file() {
                let made =
                    cut_part(&mesh, kind, options, number as u64).map_err(|e| e.in_shape(&whole.name))?;
                if made.mesh.n_vertices() < options.min_vertices {
                    continue;
                }
                save_with_points(&part, &made.mesh, &points_of_part(&made, &mesh, &points))?;
            }
            entries.push(part);
        }
        Ok::<Vec<ShapeEntry>, SimulateError>(entries)
    };
    let entries: Vec<Vec<ShapeEntry>> = wholes.par_iter().enumerate().map(make).collect::<Result<_, _>>()?;
    let entries = entries.concat();
    manifest::write(out, &entries)?;
    Ok(entries.len() - wholes.len())
}

/// The names of a shape's parts, by kind.
fn part_names(whole: &ShapeEntry, options: &PartOptions) -> impl Iterator<Item = String> {
    options.kinds.iter().map(|kind| format!("{}_{}", whole.name, kind.name()))
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
