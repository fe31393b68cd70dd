//! The rules of `fmnet-infer batch`, for programs that share its work out.

use crate::errors::{Failure, wrong};
use crate::input::Input;
use crate::run::run;
use fmnet::batch::{MapKeys, PairsError, read_pairs as read};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Reads a list of pairs as ``fmnet-infer batch`` does.
///
/// Parameters
/// ----------
/// pairs : path-like
///     A pair of mesh files a line.
/// out : path-like
///     Folder of the maps.
/// root : path-like, optional
///     Folder that mesh files are relative to. Default: that of the list.
/// format : {"txt", "vts", "npy", "csv", "npz"}
///     Format of the maps.
///
/// Returns
/// -------
/// list of (Path, Path, Path)
///     Source file, target file and map file of each pair.
#[pyfunction]
#[pyo3(signature = (pairs, out, *, root=None, format="txt"))]
pub(crate) fn read_pairs(
    pairs: PathBuf,
    out: PathBuf,
    root: Option<PathBuf>,
    format: &str,
) -> PyResult<Vec<(PathBuf, PathBuf, PathBuf)>> {
    if !["txt", "vts", "npy", "csv", "npz"].contains(&format) {
        return Err(wrong(format!(
            "format is {format:?}, expected \"txt\", \"vts\", \"npy\", \"csv\" or \"npz\""
        )));
    }
    let pairs = read(&pairs, root.as_deref(), &out, format).map_err(|error| match error {
        PairsError::Io(error) => Failure::from(error).into(),
        other => wrong(other),
    })?;
    Ok(pairs.into_iter().map(|pair| (pair.source, pair.target, pair.out)).collect())
}

/// The hash of a mesh's vertices and faces, for :meth:`Matcher.map_key`.
///
/// Parameters
/// ----------
/// mesh : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///
/// Returns
/// -------
/// str
#[pyfunction]
pub(crate) fn mesh_hash(py: Python<'_>, mesh: &Bound<'_, PyAny>) -> PyResult<String> {
    let input = Input::mesh(mesh, "mesh")?;
    run(py, None, move |observer| Ok(MapKeys::of_mesh(&input.load_mesh("mesh", observer)?).to_hex()))
}
