//! What came of a pair.

use crate::arrays::{out_matrix, same_bytes, view};
use crate::errors::io_error;
use crate::stages::named_tuple;
use fmnet::Matrix;
use fmnet::batch::write_map;
use fmnet::io::write_point_map;
use fmnet::pipeline::Match as Found;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;

/// The map of a pair, from the vertices of the source to those of the target. Arrays are read-only.
#[pyclass(frozen, module = "fmnet")]
pub(crate) struct Match {
    pub(crate) inner: Found,
}

#[pymethods]
impl Match {
    /// ndarray of int32, [n_source] : For each source vertex the matching target vertex, -1 where there is none.
    #[getter]
    fn targets<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<i32>>> {
        // The mark of unmatched vertices, all bits set, is -1.
        let targets = &slf.get().inner.map.targets;
        view(slf.as_any(), targets.len(), same_bytes(targets))
    }

    /// ndarray of float32, [n_source], or None : How far each match can be trusted, from 0 to 1.
    #[getter]
    fn confidence<'py>(slf: Bound<'py, Self>) -> PyResult<Option<Bound<'py, PyArray1<f32>>>> {
        let confidence = slf.get().inner.map.confidence.as_ref();
        confidence.map(|values| view(slf.as_any(), values.len(), values)).transpose()
    }

    /// ndarray of float64, [k_target, k_source] : The functional map before refinement, between bases at unit area.
    #[getter]
    fn functional_map<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let matrix = &slf.get().inner.functional_map;
        view(slf.as_any(), (matrix.rows(), matrix.cols()), matrix.data())
    }

    /// Barycentric or None : The point on the target's surface that each source vertex goes to, finer than its vertex.
    #[getter]
    fn barycentric<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(points) = &self.inner.map.points else { return Ok(None) };
        let faces = points.iter().map(|point| point.map_or(-1, |point| point.face as i32)).collect();
        let weights = Matrix::from_vec(
            points.len(),
            3,
            points.iter().flat_map(|point| point.map_or([0.0; 3], |point| point.weights)).collect(),
        );
        named_tuple(py, "Barycentric", (PyArray1::from_vec(py, faces), out_matrix(py, weights)?)).map(Some)
    }

    /// ndarray of int32, [m] : Source vertices, ascending, that repair left out, of small pieces and of faces without area: each
    /// has the match of the nearest vertex that it kept.
    #[getter]
    fn followers<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<i32>>> {
        let followers = &slf.get().inner.map.followers;
        view(slf.as_any(), followers.len(), same_bytes(followers))
    }

    /// Quality : How good the map is, told without ground truth.
    #[getter]
    fn quality<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (quality, estimate) = (&self.inner.quality, &self.inner.estimate);
        let mirrored = quality.is_mirrored();
        let values = (
            estimate.expected_error,
            estimate.bad,
            estimate.doubtful || mirrored,
            mirrored,
            quality.commutativity,
            quality.orthogonality,
            quality.dirichlet,
            quality.stretched,
            quality.reversed,
            quality.cycle,
            quality.coverage,
            quality.agreement,
        );
        named_tuple(py, "Quality", values)
    }

    /// int : Number of source vertices.
    #[getter]
    fn n_source(&self) -> usize {
        self.inner.map.len()
    }

    /// int : Number of target vertices.
    #[getter]
    fn n_target(&self) -> usize {
        self.inner.map.n_target
    }

    /// Writes the map to a file, whole or not at all.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     ``.txt`` (a 0-based target vertex a line, -1 where unmatched), ``.vts`` (1-based), ``.npy`` (int32), ``.csv``
    ///     (with confidences and points) or ``.npz`` (the same as arrays): the same bytes as the program writes.
    /// key : str, optional
    ///     What the map was made from (:meth:`Matcher.map_key`), written beside it as ``fmnet-infer batch`` does.
    #[pyo3(signature = (path, *, key=None))]
    fn save(&self, py: Python<'_>, path: PathBuf, key: Option<&str>) -> PyResult<()> {
        let map = &self.inner.map;
        let written = py.detach(|| match key {
            Some(key) => write_map(&path, map, key),
            None => write_point_map(&path, map),
        });
        written.map_err(io_error)
    }

    fn __repr__(&self) -> String {
        let map = &self.inner.map;
        let matched = map.iter().flatten().count();
        let doubt =
            if self.inner.estimate.doubtful || self.inner.quality.is_mirrored() { ", DOUBTFUL" } else { "" };
        format!("<fmnet.Match, {matched} of {} source vertices matched{doubt}>", map.len())
    }
}
