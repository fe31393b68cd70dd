//! Simulated scans in the layout of FAUST: `scans/tr_scan_NNN.ply`, `registrations/tr_reg_NNN.ply`.

use super::folder::{claim, save};
use super::{ScanOptions, SimulateError, SimulateProgress, simulate_scan};
use crate::dataset::{Correspondence, Dataset, ShapeEntry, Split, faust_numbers};
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Writes a scan of every shape of the given splits, beside its registration, and says how many there are.
///
/// The dataset must be one group of closed shapes in vertex to vertex correspondence, as the registrations of FAUST
/// or SCAPE. A shape named `tr_reg_NNN` keeps its number; others are numbered so that they stay in their split.
///
/// # Errors
/// If an option is out of range, the dataset does not fit, the folder holds another simulation, a shape cannot be
/// read or scanned, or a file cannot be written.
pub fn write_scans(
    dataset: &Dataset,
    splits: &[Split],
    out: &Path,
    options: &ScanOptions,
    progress: SimulateProgress,
) -> Result<usize, SimulateError> {
    options.check()?;
    let shapes = numbered(dataset, splits)?;
    claim(out, &["scans", "registrations"], "scans", &dataset.folder, options)?;
    let done = AtomicUsize::new(0);
    shapes.par_iter().try_for_each(|&(number, shape)| {
        let name = format!("tr_scan_{number:03}");
        let scan_path = out.join("scans").join(format!("{name}.ply"));
        // The scan is written last, so that one that is there is complete.
        if !scan_path.is_file() {
            let registration = shape.read()?;
            let scan =
                simulate_scan(&registration, options, number as u64).map_err(|e| e.in_shape(&shape.name))?;
            save(&out.join("registrations").join(format!("tr_reg_{number:03}.ply")), &registration)?;
            save(&scan_path, &scan)?;
        }
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, shapes.len(), &name);
        Ok::<(), SimulateError>(())
    })?;
    Ok(shapes.len())
}

/// The shapes with their numbers in the layout.
fn numbered<'a>(
    dataset: &'a Dataset,
    splits: &[Split],
) -> Result<Vec<(usize, &'a ShapeEntry)>, SimulateError> {
    let unfit = |reason: String| SimulateError::Unfit { folder: dataset.folder.clone(), reason };
    let shapes: Vec<&ShapeEntry> = dataset.shapes.iter().filter(|s| splits.contains(&s.split)).collect();
    let Some(first) = shapes.first() else {
        return Err(unfit("no shapes in these splits".into()));
    };
    if let Some(other) = shapes.iter().find(|s| s.group != first.group) {
        return Err(unfit(format!(
            "{} and {} are not of one group, but the layout of the FAUST scans has only one; choose a dataset of one group",
            first.name, other.name
        )));
    }
    if let Some(other) = shapes.iter().find(|s| s.correspondence != Correspondence::Identity) {
        return Err(unfit(format!(
            "{} does not correspond with the others vertex by vertex, as registrations do; choose registrations",
            other.name
        )));
    }
    let own = |shape: &ShapeEntry| shape.name.strip_prefix("tr_reg_").and_then(|n| n.parse().ok());
    if let Some(numbers) = shapes.iter().map(|s| own(s)).collect::<Option<Vec<usize>>>() {
        return Ok(numbers.into_iter().zip(shapes).collect());
    }
    let mut result = Vec::new();
    for split in [Split::Train, Split::Validation, Split::Test] {
        let of_split: Vec<_> = shapes.iter().filter(|s| s.split == split).copied().collect();
        let numbers = faust_numbers(split);
        if of_split.len() > numbers.len() {
            let (count, most) = (of_split.len(), numbers.len());
            return Err(unfit(format!(
                "{count} shapes of the split {split:?}, but FAUST numbers have place for {most}"
            )));
        }
        result.extend(numbers.zip(of_split));
    }
    Ok(result)
}
