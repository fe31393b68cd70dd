//! Described shapes.

use crate::arrays::{same_bytes, view};
use crate::errors::{Failure, io_error};
use fmnet::pipeline::DescribedShape;
use fmnet::shape::Context;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A shape that was processed and described by :meth:`Matcher.describe`, ready to be matched many times.
///
/// It can be pickled, and written to a file by :meth:`Matcher.save`. Arrays are read-only; ``n`` counts the vertices of the
/// working mesh, which is repaired and, where it was large, decimated, or where it was small, subdivided.
#[pyclass(frozen, module = "fmnet")]
pub(crate) struct Shape {
    pub(crate) inner: Arc<DescribedShape>,
}

impl Shape {
    pub(crate) fn decode(bytes: &[u8], path: &Path) -> PyResult<Self> {
        let inner = DescribedShape::decode(bytes, path).map_err(io_error)?;
        Ok(Self { inner: Arc::new(inner) })
    }
}

#[pymethods]
impl Shape {
    /// str : The name in messages.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.shape.name
    }

    /// int : Number of vertices of the mesh that was given.
    #[getter]
    fn n_input(&self) -> usize {
        self.inner.shape.n_input()
    }

    /// float : Area that counts as 1: that of the working mesh, or of the whole that this is a part of.
    #[getter]
    fn area(&self) -> f64 {
        self.inner.shape.unit_area()
    }

    /// float or None : For a part, the area of the whole.
    #[getter]
    fn whole_area(&self) -> Option<f64> {
        self.inner.shape.whole_area
    }

    /// ndarray of float64, [n, 3] : Vertices of the working mesh.
    #[getter]
    fn vertices<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mesh = slf.get().inner.shape.mesh();
        view(slf.as_any(), (mesh.n_vertices(), 3), same_bytes(mesh.vertices()))
    }

    /// ndarray of uint32, [m, 3] : Triangles of the working mesh.
    #[getter]
    fn faces<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let mesh = slf.get().inner.shape.mesh();
        view(slf.as_any(), (mesh.n_faces(), 3), same_bytes(mesh.faces()))
    }

    /// ndarray of int32, [n] : For each vertex of the working mesh, the vertex of the mesh that was given; the nearest one
    /// where it was inserted.
    #[getter]
    fn input_vertices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        let shape = &self.inner.shape;
        let of = |v| shape.way_back.input_of_work(v) as i32;
        PyArray1::from_vec(py, (0..shape.n() as u32).map(of).collect())
    }

    /// ndarray of float32, [n, d] : Descriptors.
    #[getter]
    fn descriptors<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let descriptors = &slf.get().inner.descriptors;
        view(slf.as_any(), (descriptors.rows(), descriptors.cols()), descriptors.data())
    }

    /// Eigenbasis of the working mesh at unit area.
    ///
    /// Parameters
    /// ----------
    /// k : int
    ///     Number of eigenpairs.
    ///
    /// Returns
    /// -------
    /// Eigenbasis
    ///     Eigenvalues [k], eigenvectors [n, k], mass [n].
    fn eigenbasis<'py>(&self, py: Python<'py>, k: usize) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.inner.clone();
        let basis = crate::run::run(py, None, move |observer| {
            let context = Context { cache: None, observer };
            inner.shape.unit_basis(k, context).map_err(Failure::from)
        })?;
        crate::stages::out_basis(py, basis)
    }

    fn __repr__(&self) -> String {
        let shape = &self.inner.shape;
        format!("<fmnet.Shape {:?}, {} vertices, described on {}>", shape.name, shape.n_input(), shape.n())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let make = slf.get_type().getattr("_from_bytes")?;
        Ok((make, (PyBytes::new(slf.py(), &slf.get().inner.encode()),)))
    }

    #[staticmethod]
    fn _from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Self::decode(bytes, &PathBuf::from("pickled shape"))
    }
}
