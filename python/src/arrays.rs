//! Arrays in, checked with messages that name them; arrays out, without copies where the data lives on.

use crate::errors::wrong;
use bytemuck::Pod;
use fmnet::Matrix;
use numpy::ndarray::{ArrayView, Dimension, IntoDimension};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;

/// Anything that NumPy takes for an array.
pub(crate) fn as_array<'py>(object: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    let numpy = object.py().import(intern!(object.py(), "numpy"))?;
    let array = numpy.call_method1(intern!(object.py(), "asarray"), (object,))?;
    array.cast_into().map_err(|_| wrong(format!("{what}: not an array")))
}

/// The letter of NumPy for the kind of the numbers.
pub(crate) fn kind(array: &Bound<'_, PyUntypedArray>) -> u8 {
    array.dtype().getattr("kind").and_then(|k| k.extract::<String>()).map_or(b'?', |k| k.as_bytes()[0])
}

fn dtype_name(array: &Bound<'_, PyUntypedArray>) -> String {
    array.dtype().str().map_or_else(|_| "?".into(), |name| name.to_string())
}

/// Checks the shape; `None` stands for any size.
pub(crate) fn check_shape(
    array: &Bound<'_, PyUntypedArray>,
    wanted: &[Option<usize>],
    what: &str,
) -> PyResult<()> {
    let fits = |(&found, wanted): (&usize, &Option<usize>)| wanted.is_none_or(|wanted| wanted == found);
    if array.ndim() == wanted.len() && array.shape().iter().zip(wanted).all(fits) {
        return Ok(());
    }
    let size = |size: &Option<usize>| size.map_or("any".to_owned(), |size| size.to_string());
    let wanted = wanted.iter().map(size).collect::<Vec<_>>().join(", ");
    Err(wrong(format!("{what}: the shape is {:?}, expected [{wanted}]", array.shape())))
}

/// The numbers as `T`, row-major, whatever the strides.
fn cast<T: Element + Copy>(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<T>> {
    let py = array.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    let contiguous = numpy.call_method1(intern!(py, "ascontiguousarray"), (array, numpy::dtype::<T>(py)))?;
    let contiguous = contiguous.cast_into::<numpy::PyArrayDyn<T>>().map_err(wrong)?;
    Ok(contiguous.readonly().as_slice().map_err(wrong)?.to_vec())
}

fn check_real(array: &Bound<'_, PyUntypedArray>, what: &str) -> PyResult<()> {
    if kind(array) == b'f' && matches!(array.dtype().itemsize_or_zero(), 4 | 8) {
        return Ok(());
    }
    let name = dtype_name(array);
    Err(wrong(format!(
        "{what}: the type is {name}, expected float32 or float64; convert it with .astype(\"float64\")"
    )))
}

trait ItemSize {
    fn itemsize_or_zero(&self) -> usize;
}

impl ItemSize for Bound<'_, numpy::PyArrayDescr> {
    fn itemsize_or_zero(&self) -> usize {
        self.getattr("itemsize").and_then(|size| size.extract()).unwrap_or(0)
    }
}

/// Real numbers of a shape, f32 or f64, row-major as f64; and the shape.
pub(crate) fn reals(
    object: &Bound<'_, PyAny>,
    wanted: &[Option<usize>],
    what: &str,
) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array = as_array(object, what)?;
    check_real(&array, what)?;
    check_shape(&array, wanted, what)?;
    Ok((cast(&array)?, array.shape().to_vec()))
}

/// A matrix of real numbers.
pub(crate) fn matrix(object: &Bound<'_, PyAny>, wanted: [Option<usize>; 2], what: &str) -> PyResult<Matrix> {
    let (data, shape) = reals(object, &wanted, what)?;
    Ok(Matrix::from_vec(shape[0], shape[1], data))
}

/// Integers of any width of a shape, row-major.
pub(crate) fn integers(
    object: &Bound<'_, PyAny>,
    wanted: &[Option<usize>],
    what: &str,
) -> PyResult<(Vec<i64>, Vec<usize>)> {
    let array = as_array(object, what)?;
    if !matches!(kind(&array), b'i' | b'u') && array.len() > 0 {
        let name = dtype_name(&array);
        return Err(wrong(format!("{what}: the type is {name}, expected integers")));
    }
    check_shape(&array, wanted, what)?;
    Ok((cast(&array)?, array.shape().to_vec()))
}

/// An array `[n]` that lives in `owner`, which must not change it; read-only.
pub(crate) fn view<'py, T: Element, D: Dimension>(
    owner: &Bound<'py, PyAny>,
    shape: impl IntoDimension<Dim = D>,
    data: &[T],
) -> PyResult<Bound<'py, PyArray<T, D>>> {
    let view = ArrayView::from_shape(shape.into_dimension(), data).map_err(wrong)?;
    // SAFETY: `owner` is a frozen class that holds `data`, and the array holds `owner`.
    let array = unsafe { PyArray::borrow_from_array(&view, owner.clone()) };
    array.readwrite().make_nonwriteable();
    Ok(array)
}

/// A matrix as an array of its own.
pub(crate) fn out_matrix<T: Element + Copy>(
    py: Python<'_>,
    matrix: Matrix<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let shape = [matrix.rows(), matrix.cols()];
    PyArray1::from_vec(py, matrix.into_data()).reshape(shape)
}

/// Numbers of the same size and layout as others, without a copy.
pub(crate) fn same_bytes<A: Pod, B: Pod>(values: &[A]) -> &[B] {
    bytemuck::cast_slice(values)
}
