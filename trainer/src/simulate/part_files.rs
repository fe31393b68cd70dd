//! Parts in the layout of SHREC'16: `null/CLASS.off`, `holes/holes_CLASS_shape_N.off` with `.baryc_gt`, likewise
//! `cuts`.

use super::folder::{claim, save};
use super::surface_part_files::write_surface_parts;
use super::{Part, PartKind, PartOptions, SimulateError, SimulateProgress, cut_part};
use crate::dataset::{Correspondence, Dataset, ShapeEntry, TRAINING_PARTS};
use fmnet::Mesh;
use fmnet::io::write_atomically;
use rayon::prelude::*;
use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A part to be made.
struct Job<'a> {
    class: &'a str,
    kind: PartKind,
    /// Its number in the class and kind, from 1.
    number: usize,
    pose: &'a ShapeEntry,
    whole: &'a ShapeEntry,
}

/// Writes parts of the shapes of a dataset, and says how many there are.
///
/// Where shapes share a triangulation, in the layout of SHREC'16: each group is a class, with at least three shapes
/// in vertex to vertex correspondence, as in TOSCA: the first by name is the whole, in its pose; the first half of
/// the others gives the 10 training parts, which come first, and the second half the test parts, so that these share
/// neither pose nor cut with the training parts. Other shapes are written as they are with a part of each kind beside
/// them, `shapes/NAME.ply` and `shapes/NAME_KIND.ply` with `.corr`, and a manifest that keeps groups and splits.
///
/// # Errors
/// If an option is out of range, the dataset does not fit, the folder holds another simulation, a shape cannot be
/// read or cut, or a file cannot be written.
pub fn write_parts(
    dataset: &Dataset,
    out: &Path,
    options: &PartOptions,
    progress: SimulateProgress,
) -> Result<usize, SimulateError> {
    options.check()?;
    if dataset.shapes.iter().any(|shape| shape.correspondence != Correspondence::Identity) {
        return write_surface_parts(dataset, out, options, progress);
    }
    let jobs = jobs(dataset, options)?;
    let folders: Vec<&str> = options.kinds.iter().map(|k| k.name()).chain(["null"]).collect();
    claim(out, &folders, "parts", &dataset.folder, options)?;
    for chunk in jobs.chunk_by(|a, b| a.class == b.class) {
        let path = out.join("null").join(format!("{}.off", chunk[0].class));
        if !path.is_file() {
            save(&path, &chunk[0].whole.read()?)?;
        }
    }
    let done = AtomicUsize::new(0);
    jobs.par_iter().enumerate().try_for_each(|(index, job)| {
        let name = format!("{}_{}_shape_{}", job.kind.name(), job.class, job.number);
        let path = out.join(job.kind.name()).join(format!("{name}.off"));
        // The mesh is written last, so that one that is there is complete.
        if !path.is_file() {
            let (whole, pose) = (job.whole.read()?, job.pose.read()?);
            let part =
                cut_part(&pose, job.kind, options, index as u64).map_err(|e| e.in_shape(&job.pose.name))?;
            let truth = ground_truth(&part, &whole).ok_or_else(|| SimulateError::Unfit {
                folder: dataset.folder.clone(),
                reason: format!("a vertex of {} is in no face of {}", job.pose.name, job.whole.name),
            })?;
            write_atomically(&path.with_extension("baryc_gt"), |file| file.write_all(truth.as_bytes()))?;
            save(&path, &part.mesh)?;
        }
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len(), &name);
        Ok::<(), SimulateError>(())
    })?;
    Ok(jobs.len())
}

/// All parts, those of one class together.
fn jobs<'a>(dataset: &'a Dataset, options: &PartOptions) -> Result<Vec<Job<'a>>, SimulateError> {
    let unfit = |reason: String| SimulateError::Unfit { folder: dataset.folder.clone(), reason };
    let mut classes: Vec<&str> = dataset.shapes.iter().map(|s| s.group.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    let mut jobs = Vec::new();
    for class in classes {
        let shapes: Vec<&ShapeEntry> = dataset.shapes.iter().filter(|s| s.group == class).collect();
        let [whole, poses @ ..] = shapes.as_slice() else { continue };
        if poses.len() < 2 {
            return Err(unfit(format!(
                "class {class} has {} shapes, but needs 3: the whole, a pose for training parts, one for test parts",
                shapes.len()
            )));
        }
        let (training, test) = poses.split_at(poses.len().div_ceil(2));
        for &kind in &options.kinds {
            jobs.extend((0..TRAINING_PARTS + options.test_parts).map(|part| {
                let pose = match part.checked_sub(TRAINING_PARTS) {
                    None => training[part % training.len()],
                    Some(part) => test[part % test.len()],
                };
                Job { class, kind, number: part + 1, pose, whole }
            }));
        }
    }
    Ok(jobs)
}

/// For each vertex of the part, a face of the whole (1-based) with it, and the weights of its corners; `None` where a
/// vertex is in no face of the whole.
fn ground_truth(part: &Part, whole: &Mesh) -> Option<String> {
    let mut face_of = vec![None; whole.n_vertices()];
    for (f, face) in whole.faces().iter().enumerate() {
        for (corner, &i) in face.iter().enumerate() {
            face_of[i as usize].get_or_insert((f + 1, corner));
        }
    }
    let mut text = String::new();
    for &vertex in &part.origin {
        let (face, corner) = (*face_of.get(vertex as usize)?)?;
        let weight = |c: usize| u8::from(c == corner);
        let _ = writeln!(text, "{face} {} {} {}", weight(0), weight(1), weight(2));
    }
    Some(text)
}
