//! What `fmnet-infer features` writes, as arrays.

use crate::arrays::out_matrix;
use crate::input::Input;
use crate::matcher::described;
use crate::options::Given;
use crate::run::run;
use fmnet::Matrix;
use fmnet::network::contract::{ModelInput, Quantity};
use fmnet::pipeline::{DescribedShape, Matcher, Resize};
use fmnet::spectral::Eigenbasis;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Arc;

/// What was computed of a mesh.
struct Found {
    shape: Arc<DescribedShape>,
    basis: Eigenbasis,
    inputs: Vec<(ModelInput, Vec<f32>)>,
    is_learned: bool,
}

/// Eigenbasis, areas, the inputs of the model and its descriptors, all at unit area.
///
/// Parameters
/// ----------
/// mesh : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     Vertices [n_input, 3] of float32 or float64, faces [m, 3] of integers.
/// progress : callable, optional
///     Called as ``progress(subject, stage, seconds)`` where a stage begins (``seconds`` is None) and ends.
/// model, descriptor, k, decimate, shot_radius, cache, backend
///     As of :class:`Matcher`.
///
/// Returns
/// -------
/// dict of str to ndarray
///     ``eigenvalues`` [k], ``eigenvectors`` [n, k], ``mass`` [n]; the model's other inputs by name, such as ``gradients_x``
///     [n, k]; ``descriptors`` [n, d], or ``shot`` [n, 352]; ``vertices`` [n]: the mesh's vertex of each row.
#[pyfunction]
#[pyo3(signature = (mesh, *, progress=None, model=None, descriptor="learned", k=None, decimate=None, shot_radius=None, cache=None,
                    backend="native"))]
#[allow(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn features<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyAny>,
    progress: Option<&Bound<'py, PyAny>>,
    model: Option<PathBuf>,
    descriptor: &str,
    k: Option<usize>,
    decimate: Option<Bound<'py, PyAny>>,
    shot_radius: Option<f64>,
    cache: Option<PathBuf>,
    backend: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let given = Given {
        model,
        descriptor,
        k,
        fm: None,
        mask_weight: None,
        refine: None,
        upscale: "surface",
        effort: "normal",
        adapt: None,
        backend,
        decimate,
        subdivide: None,
        shot_radius,
        cache,
    };
    // A row for each vertex of the mesh.
    let options = given.options()?.subdivide(Resize::Never);
    let input = Input::mesh(mesh, "mesh")?;
    let found = run(py, progress, move |observer| {
        let matcher = Matcher::new(&options)?;
        let loaded = input.load("mesh", observer)?;
        let shape = described(&matcher, loaded, None, observer)?;
        let context = matcher.context(observer);
        let described_k = matcher.descriptor().eigenpairs().min(shape.shape.max_eigenpairs());
        let basis = shape.shape.unit_basis(matcher.k().max(described_k), context)?;
        let inputs = match matcher.network_descriptor() {
            Some(network) => network.inputs(&shape.shape, context)?,
            None => Vec::new(),
        };
        Ok(Found { shape, basis, inputs, is_learned: matcher.network().is_some() })
    })?;
    found.arrays(py)
}

impl Found {
    fn arrays<'py>(self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let arrays = PyDict::new(py);
        let shape = &self.shape.shape;
        arrays.set_item(Quantity::Eigenvalues.name(), PyArray1::from_vec(py, self.basis.eigenvalues))?;
        arrays.set_item(Quantity::Eigenvectors.name(), out_matrix(py, self.basis.eigenvectors)?)?;
        arrays.set_item(Quantity::Mass.name(), PyArray1::from_vec(py, self.basis.mass))?;
        for (input, values) in self.inputs {
            // The first three are there already, in double precision.
            if !arrays.contains(input.quantity.name())? {
                let values = Matrix::from_vec(shape.n(), input.width, values);
                arrays.set_item(input.quantity.name(), out_matrix(py, values)?)?;
            }
        }
        let name = if self.is_learned { "descriptors" } else { Quantity::Shot.name() };
        arrays.set_item(name, out_matrix(py, self.shape.descriptors.clone())?)?;
        let vertices = (0..shape.n() as u32).map(|v| shape.way_back.input_of_work(v) as i32).collect();
        arrays.set_item("vertices", PyArray1::from_vec(py, vertices))?;
        Ok(arrays)
    }
}
