//! A folder of triangulations with correspondences: `shapes/NAME.ply`, `shapes/NAME.corr`, `dataset.toml`.

use super::folder::{SHAPES, check_names, claim, save_with_points, surface_entry};
use super::{SimulateError, SimulateProgress, TriangulationOptions, triangulated};
use crate::dataset::{Dataset, ShapeEntry, Split, manifest};
use fmnet::Mesh;
use fmnet::mesh::{SurfacePoint, farthest_point_sampling_by, vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which of a group's points correspond in what is written.
struct Landmarks {
    /// Number of points of every shape of the group.
    of: usize,
    /// Those chosen, ascending.
    chosen: Vec<u32>,
    /// The shape they were chosen on.
    shape: String,
}

/// Writes a triangulation, or several, of every shape of the given splits, and says how many there are. Groups and
/// splits are kept.
///
/// Points are the dataset's own: all vertices where shapes share a triangulation, else its landmarks; of more than
/// [`TriangulationOptions::landmarks`], as many are chosen, evenly over the group's first shape. The manifest is
/// written last.
///
/// # Errors
/// If an option is out of range, the dataset does not fit, the folder holds another simulation, a shape cannot be
/// read or triangulated, or a file cannot be written.
pub fn write_triangulations(
    dataset: &Dataset,
    splits: &[Split],
    out: &Path,
    options: &TriangulationOptions,
    progress: SimulateProgress,
) -> Result<usize, SimulateError> {
    options.check()?;
    let unfit = |reason: String| SimulateError::Unfit { folder: dataset.folder.clone(), reason };
    let entries = || dataset.shapes.iter().enumerate().filter(|(_, s)| splits.contains(&s.split));
    if entries().next().is_none() {
        return Err(unfit("no shapes in these splits".into()));
    }
    check_names(dataset, entries().map(|(_, shape)| shape))?;
    claim(out, &[SHAPES], "triangulations", &dataset.folder, options)?;
    let mut landmarks = BTreeMap::new();
    for (_, entry) in entries() {
        if !landmarks.contains_key(&entry.group) {
            landmarks.insert(entry.group.clone(), Landmarks::choose(entry, options.landmarks)?);
        }
    }
    let jobs: Vec<(usize, ShapeEntry)> = entries()
        .flat_map(|(number, entry)| (0..options.copies).map(move |copy| (number, copy, entry)))
        .map(|(number, copy, entry)| (number * options.copies + copy, renamed(entry, copy, options, out)))
        .collect();
    let done = AtomicUsize::new(0);
    jobs.par_iter().try_for_each(|(index, new)| {
        let entry = &dataset.shapes[index / options.copies];
        let said = make(entry, new, &landmarks[&entry.group], options, *index as u64)
            .map_err(|e| e.in_shape(&new.name))?;
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len(), &said);
        Ok::<(), SimulateError>(())
    })?;
    let written: Vec<ShapeEntry> = jobs.into_iter().map(|(_, entry)| entry).collect();
    manifest::write(out, &written)?;
    Ok(written.len())
}

/// The entry of what is made of a shape.
fn renamed(entry: &ShapeEntry, copy: usize, options: &TriangulationOptions, out: &Path) -> ShapeEntry {
    let name = match options.copies {
        1 => entry.name.clone(),
        _ => format!("{}_{copy}", entry.name),
    };
    surface_entry(entry, out, name)
}

/// Makes one shape, unless it is there, and says what it is.
fn make(
    entry: &ShapeEntry,
    new: &ShapeEntry,
    landmarks: &Landmarks,
    options: &TriangulationOptions,
    index: u64,
) -> Result<String, SimulateError> {
    if new.mesh.is_file() {
        return Ok(new.name.clone());
    }
    let mesh = entry.read()?;
    let points = landmarks.of(entry, &mesh)?;
    let made = triangulated(&mesh, &points, options, index)?;
    save_with_points(new, &made.mesh, &made.points)?;
    Ok(format!("{} ({})", new.name, made.plan))
}

impl Landmarks {
    fn choose(entry: &ShapeEntry, most: usize) -> Result<Self, SimulateError> {
        let mesh = entry.read()?;
        let points = entry.surface_points(&mesh)?;
        let n = points.len();
        let mut chosen: Vec<u32> = (0..n as u32).collect();
        if n > most {
            let positions: Vec<Option<[f64; 3]>> =
                points.iter().map(|point| point.map(|p| p.position(&mesh))).collect();
            // A point that this shape lacks is as far away as the nearest, so that it comes last.
            let start = positions.iter().position(Option::is_some).unwrap_or(0);
            chosen = farthest_point_sampling_by(n, most, start as u32, |source, distances| {
                for (distance, &position) in distances.iter_mut().zip(&positions) {
                    let ends = position.zip(positions[source as usize]);
                    *distance = ends.map_or(0.0, |(p, q)| vec3::distance(p, q));
                }
            });
            chosen.sort_unstable();
        }
        Ok(Self { of: n, chosen, shape: entry.name.clone() })
    }

    /// Where the landmarks lie on a shape.
    fn of(&self, entry: &ShapeEntry, mesh: &Mesh) -> Result<Vec<Option<SurfacePoint>>, SimulateError> {
        let points = entry.surface_points(mesh)?;
        if points.len() != self.of {
            return Err(SimulateError::Unfit {
                folder: entry.mesh.clone(),
                reason: format!(
                    "{} points, but {} of the same group has {}; give the shapes one set of correspondences",
                    points.len(),
                    self.shape,
                    self.of
                ),
            });
        }
        Ok(self.chosen.iter().map(|&i| points[i as usize]).collect())
    }
}
