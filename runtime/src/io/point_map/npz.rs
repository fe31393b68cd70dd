//! `.npz`: the same as `.csv`, as arrays for NumPy.

use super::{finish, point, targets_of};
use crate::io::error::{ParseError, Parsed};
use crate::io::{IoError, matrix};
use crate::mesh::SurfacePoint;
use crate::point_map::PointMap;
use std::path::Path;

/// `targets` int32 `[n]`, `confidence` float32 `[n]`, `faces` int32 `[n]`, `weights` float64 `[n, 3]`, `followers`
/// int32 `[m]`: what the map has of them.
pub(super) fn encode(path: &Path, map: &PointMap) -> Result<Vec<u8>, IoError> {
    let index = |value: Option<u32>| value.map_or(Some(-1), |value| i32::try_from(value).ok());
    let faces =
        |points: &Vec<Option<SurfacePoint>>| points.iter().map(|p| index(p.map(|p| p.face))).collect();
    let targets: Option<Vec<i32>> = map.iter().map(index).collect();
    let faces: Option<Option<Vec<i32>>> = map.points.as_ref().map(faces);
    let (Some(targets), Some(faces)) = (targets, faces.map_or(Some(None), |faces| faces.map(Some))) else {
        return Err(IoError::Unwritable {
            path: path.into(),
            problem: "an index does not fit int32".into(),
            remedy: "write a .csv file",
        });
    };
    let n = map.len();
    let mut arrays = vec![("targets", matrix::encode(&[n], &targets))];
    arrays.extend(map.confidence.as_ref().map(|values| ("confidence", matrix::encode(&[n], values))));
    arrays.extend(faces.map(|faces| ("faces", matrix::encode(&[n], &faces))));
    arrays.extend(map.points.as_ref().map(|points| {
        let weights: Vec<f64> = points.iter().flat_map(|p| p.map_or([0.0; 3], |p| p.weights)).collect();
        ("weights", matrix::encode(&[n, 3], &weights))
    }));
    if !map.followers.is_empty() {
        // They are below the number of targets' entries, which fit.
        let followers: Vec<i32> = map.followers.iter().map(|&v| v as i32).collect();
        arrays.push(("followers", matrix::encode(&[followers.len()], &followers)));
    }
    matrix::npz(path, &arrays)
}

/// The map of an archive that has at least `targets`, as [`encode`] or NumPy's `savez` writes it.
pub(super) fn decode(bytes: &[u8], n_target: Option<usize>) -> Parsed<PointMap> {
    let arrays = matrix::read_npz(bytes, &["targets", "confidence", "faces", "weights", "followers"])?;
    let [targets, confidence, faces, weights, followers] = arrays.each_ref().map(|array| array.as_deref());
    let Some(targets) = targets else {
        return Err(ParseError::part("file", "the archive has no array `targets`"));
    };
    let targets = targets_of(&in_array("targets", matrix::decode(targets))?, n_target)?;
    let n = targets.len();
    let confidence = confidence.map(|bytes| sized::<f32>("confidence", bytes, [n, 1])).transpose()?;
    let faces = faces.map(|bytes| sized::<i64>("faces", bytes, [n, 1])).transpose()?;
    let weights = weights.map(|bytes| sized::<f64>("weights", bytes, [n, 3])).transpose()?;
    let points = match (faces, weights) {
        (Some(faces), Some(weights)) => Some(points(&faces, &weights)?),
        (None, None) => None,
        _ => {
            return Err(ParseError::part(
                "file",
                "of the arrays `faces` and `weights` the archive has one alone",
            ));
        }
    };
    let followers = match followers {
        Some(bytes) => in_array("followers", matrix::decode::<i64>(bytes))?.into_data(),
        None => Vec::new(),
    };
    let mut followers: Vec<u32> = followers
        .into_iter()
        .map(|v| usize::try_from(v).ok().filter(|&v| v < n).map(|v| v as u32).ok_or(v))
        .collect::<Result<_, i64>>()
        .map_err(|v| {
            ParseError::part("followers", format!("source vertex {v} does not exist: there are {n}"))
        })?;
    followers.sort_unstable();
    followers.dedup();
    Ok(PointMap { points, followers, ..finish(targets, confidence, n_target) })
}

/// An error of an array, with its name.
fn in_array<T>(name: &str, array: Parsed<T>) -> Parsed<T> {
    array.map_err(|error| error.within(name))
}

/// The numbers of an array of these dimensions.
fn sized<T: matrix::NpyNumber>(name: &str, bytes: &[u8], [rows, cols]: [usize; 2]) -> Parsed<Vec<T>> {
    let array = in_array(name, matrix::decode(bytes))?;
    if (array.rows(), array.cols()) != (rows, cols) {
        let problem = format!("the array is [{}, {}], not [{rows}, {cols}]", array.rows(), array.cols());
        return Err(ParseError::part(name, problem));
    }
    Ok(array.into_data())
}

fn points(faces: &[i64], weights: &[f64]) -> Parsed<Vec<Option<SurfacePoint>>> {
    let rows = faces.iter().zip(weights.chunks_exact(3)).enumerate();
    rows.map(|(row, (&face, weights))| {
        point(face, [weights[0], weights[1], weights[2]])
            .map_err(|problem| ParseError::part(format!("faces and weights, entry {row}"), problem))
    })
    .collect()
}
