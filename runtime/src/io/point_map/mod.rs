//! Point maps in files.
//!
//! | | content | unmatched |
//! |---|---|---|
//! | `.txt` | one 0-based target index a line, as `numpy.loadtxt` takes it | -1 |
//! | `.vts` | one 1-based target index a line, as in the FAUST and TOSCA correspondences | 0 |
//! | `.npy` | int32 `[n_source]`, 0-based | -1 |
//! | `.csv` | a comment with direction, base and sizes, then `source,target,confidence`, where the map is finer than a vertex `face,u,v,w`, and where there are followers `follows` | -1 |
//! | `.npz` | arrays `targets`, `confidence`, `faces`, `weights`, `followers` for NumPy | -1 |

mod csv;
mod npz;
#[cfg(test)]
mod tests;

use std::path::Path;

use super::error::{ParseError, Parsed};
use super::text::{Lines, decode_text, quote};
use super::{IoError, matrix, write_atomically};
use crate::Matrix;
use crate::mesh::SurfacePoint;
use crate::point_map::PointMap;

/// A format of point map files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PointMapFormat {
    /// `.txt`
    Txt,
    /// `.vts`
    Vts,
    /// `.npy`
    Npy,
    /// `.csv`
    Csv,
    /// `.npz`
    Npz,
}

impl PointMapFormat {
    /// The extensions of point maps.
    pub const EXTENSIONS: &'static str = ".txt, .vts, .npy, .csv, .npz";

    /// The format that the extension of `path` names, whatever its case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "txt" => Some(Self::Txt),
            "vts" => Some(Self::Vts),
            "npy" => Some(Self::Npy),
            "csv" => Some(Self::Csv),
            "npz" => Some(Self::Npz),
            _ => None,
        }
    }

    /// [`PointMapFormat::from_path`], or an error that lists what there is.
    fn of(path: &Path) -> Result<Self, IoError> {
        Self::from_path(path)
            .ok_or_else(|| IoError::UnknownFormat { path: path.into(), known: Self::EXTENSIONS })
    }
}

/// Reads a point map; the extension decides on the format, but NumPy's `.npy` is known by its first bytes. Text may
/// be in UTF-8 or UTF-16.
///
/// `n_target` is the number of target vertices, against which every index is checked; where it is `None` it is
/// what the file states (`.csv`), else one more than the largest index.
///
/// # Errors
/// If the file cannot be read, its extension is none of [`PointMapFormat::EXTENSIONS`], a line or entry is no index
/// of a target vertex, or a `.csv` states another number of targets than `n_target`.
pub fn read_point_map(path: &Path, n_target: Option<usize>) -> Result<PointMap, IoError> {
    let format = PointMapFormat::of(path)?;
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    decode(&bytes, format, n_target).map_err(|e| e.in_file(path))
}

/// Writes a point map; the extension decides on the format. Confidences, points and followers are kept by `.csv` and
/// `.npz` only.
///
/// # Errors
/// If the extension is none of [`PointMapFormat::EXTENSIONS`], the file cannot be written, or an index does not fit
/// `.npy`'s int32.
pub fn write_point_map(path: &Path, map: &PointMap) -> Result<(), IoError> {
    let bytes = encode_point_map(path, map)?;
    write_atomically(path, |w| w.write_all(&bytes))
}

/// The bytes that [`write_point_map`] writes; `path` gives the format and the name in errors.
///
/// # Errors
/// As [`write_point_map`], but for those of the file.
pub fn encode_point_map(path: &Path, map: &PointMap) -> Result<Vec<u8>, IoError> {
    match PointMapFormat::of(path)? {
        PointMapFormat::Txt => Ok(lines(map.iter().map(|target| target.map_or(-1, i64::from)))),
        PointMapFormat::Vts => Ok(lines(map.iter().map(|target| target.map_or(0, |t| i64::from(t) + 1)))),
        PointMapFormat::Npy => {
            let targets: Option<Vec<i32>> =
                map.iter().map(|target| target.map_or(Some(-1), |t| i32::try_from(t).ok())).collect();
            let targets = targets.ok_or_else(|| IoError::Unwritable {
                path: path.into(),
                problem: "a target index does not fit int32".into(),
                remedy: "write a .txt file",
            })?;
            Ok(matrix::encode(&[targets.len()], &targets))
        }
        PointMapFormat::Csv => Ok(csv::encode(map)),
        PointMapFormat::Npz => npz::encode(path, map),
    }
}

/// A number a line.
fn lines(numbers: impl Iterator<Item = i64>) -> Vec<u8> {
    numbers.flat_map(|number| format!("{number}\n").into_bytes()).collect()
}

pub(super) fn decode(bytes: &[u8], format: PointMapFormat, n_target: Option<usize>) -> Parsed<PointMap> {
    if matrix::is_npy(bytes) {
        return decode_npy(bytes, n_target);
    }
    if format == PointMapFormat::Npz {
        return npz::decode(bytes, n_target);
    }
    let bytes = &*decode_text(bytes);
    match format {
        PointMapFormat::Txt => decode_lines(bytes, 0, n_target),
        PointMapFormat::Vts => decode_lines(bytes, 1, n_target),
        PointMapFormat::Npy | PointMapFormat::Npz => decode_npy(bytes, n_target),
        PointMapFormat::Csv => csv::decode(bytes, n_target),
    }
}

/// One index a line; `base` is that of the first vertex, `base - 1` stands for none.
fn decode_lines(bytes: &[u8], base: i64, n_target: Option<usize>) -> Parsed<PointMap> {
    let mut lines = Lines::new(bytes);
    let mut targets = Vec::new();
    while let Some(mut words) = lines.next_data() {
        let index = words.integer("the target")?;
        if let Some(word) = words.next() {
            return Err(
                words.error(format!("{} follows the target; one index a line is expected", quote(word)))
            );
        }
        targets.push(
            target(index - base, n_target)
                .ok_or_else(|| words.error(no_such_target(index, base, n_target)))?,
        );
    }
    Ok(finish(targets, None, n_target))
}

fn decode_npy(bytes: &[u8], n_target: Option<usize>) -> Parsed<PointMap> {
    Ok(finish(targets_of(&matrix::decode(bytes)?, n_target)?, None, n_target))
}

/// The targets that an array of one row or column holds.
fn targets_of(array: &Matrix<i64>, n_target: Option<usize>) -> Parsed<Vec<u32>> {
    if array.rows() != 1 && array.cols() != 1 {
        let problem = format!("the array is [{}, {}], not a vector", array.rows(), array.cols());
        return Err(ParseError::part("header", problem));
    }
    let checked = array.data().iter().enumerate().map(|(source, &index)| {
        target(index, n_target)
            .ok_or_else(|| ParseError::part(format!("entry {source}"), no_such_target(index, 0, n_target)))
    });
    checked.collect()
}

/// The target vertex of a 0-based index, where -1 stands for none; `None` where there is no such vertex.
fn target(index: i64, n_target: Option<usize>) -> Option<u32> {
    if index == -1 {
        return Some(PointMap::UNMATCHED);
    }
    let target = u32::try_from(index).ok().filter(|&t| t != PointMap::UNMATCHED)?;
    n_target.is_none_or(|n| (target as usize) < n).then_some(target)
}

fn no_such_target(index: i64, base: i64, n_target: Option<usize>) -> String {
    let count = n_target.map_or(String::new(), |n| format!(": there are {n}, counted from {base}"));
    format!("target vertex {index} does not exist{count}")
}

fn finish(targets: Vec<u32>, confidence: Option<Vec<f32>>, n_target: Option<usize>) -> PointMap {
    let largest = targets.iter().filter(|&&t| t != PointMap::UNMATCHED).max();
    let n_target = n_target.unwrap_or(largest.map_or(0, |&t| t as usize + 1));
    PointMap { confidence, ..PointMap::new(targets, n_target) }
}

/// The point on a triangle, none for a face of -1, or what is wrong with it.
fn point(face: i64, weights: [f64; 3]) -> Result<Option<SurfacePoint>, String> {
    if face == -1 {
        return Ok(None);
    }
    let face = u32::try_from(face).map_err(|_| format!("face {face} does not exist"))?;
    let all = weights.iter().all(|w| (0.0..=1.0).contains(w));
    if !all || (weights.iter().sum::<f64>() - 1.0).abs() >= 1e-3 {
        return Err("the weights u, v, w are not three numbers from 0 to 1 that sum to 1".into());
    }
    Ok(Some(SurfacePoint { face, weights }))
}
