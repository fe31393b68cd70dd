//! Single stages on plain arrays.

use crate::arrays::{integers, matrix, out_matrix, reals};
use crate::errors::wrong;
use crate::input::Input;
use crate::options::{named, weight};
use crate::run::run;
use fmnet::descriptor::{ShotOptions, shot as compute_shot};
use fmnet::fmap::{FmapSolver, SolverKind, functional_map as solve};
use fmnet::memory::{self, Remedy};
use fmnet::point_map::{Comparison, PointMap, recover_by};
use fmnet::refine::{ZoomOutOptions, zoomout as refine};
use fmnet::spectral::{EigenOptions, Eigenbasis, Laplacian, eigenbasis as compute_eigenbasis};
use numpy::PyArray1;
use pyo3::prelude::*;

/// The first `k` eigenpairs of the Laplace-Beltrami operator of a mesh as it is, without repair.
///
/// Parameters
/// ----------
/// mesh : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     Vertices [n, 3] of float32 or float64, faces [m, 3] of integers.
/// k : int
///     Number of eigenpairs: at most all of up to 3000 vertices, a sixth of more.
/// unit_area : bool
///     Scale the mesh to area 1 first, as the pipeline does, so that results have no unit. Else they are in the mesh's own.
///
/// Returns
/// -------
/// Eigenbasis
///     Eigenvalues [k], ascending; eigenvectors [n, k], with ``eigenvectors.T @ (mass[:, None] * eigenvectors)`` the identity;
///     mass [n], the area of each vertex.
#[pyfunction]
#[pyo3(signature = (mesh, k, *, unit_area=true))]
pub(crate) fn eigenbasis<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyAny>,
    k: usize,
    unit_area: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let input = Input::mesh(mesh, "mesh")?;
    let basis = run(py, None, move |observer| {
        let mesh = input.load_mesh("mesh", observer)?;
        let needed = memory::eigenbasis_bytes(mesh.n_vertices(), k);
        let _reserved = memory::reserve(
            "the eigenbasis",
            needed,
            Remedy::Other("ask for fewer pairs, or decimate the mesh"),
        )?;
        let (basis, info) = compute_eigenbasis(&Laplacian::new(&mesh), k, &EigenOptions::default())?;
        if info.complete == Some(false) {
            let text = format!(
                "the eigenbasis of {k} pairs lacks some eigenvalue below its last one; try another k"
            );
            observer(fmnet::events::Event::Warning(text));
        }
        Ok(if unit_area { basis.at_unit_area(k) } else { basis })
    })?;
    out_basis(py, basis)
}

/// SHOT descriptors of a mesh as it is, without repair.
///
/// Parameters
/// ----------
/// mesh : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     Vertices [n, 3] of float32 or float64, faces [m, 3] of integers.
/// radius : float
///     Radius of the support relative to sqrt(area), above 0.
/// bins : int
///     Intervals of the histograms, 1 to 100.
/// min_neighbors : int
///     Vertices with fewer neighbours get a zero row. At least 1.
///
/// Returns
/// -------
/// ndarray of float32, [n, 32 * (bins + 1)]
#[pyfunction]
#[pyo3(signature = (mesh, *, radius=0.067, bins=10, min_neighbors=5))]
pub(crate) fn shot<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyAny>,
    radius: f64,
    bins: usize,
    min_neighbors: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let input = Input::mesh(mesh, "mesh")?;
    let mut options = ShotOptions::default();
    (options.radius, options.bins, options.min_neighbors) = (radius, bins, min_neighbors);
    let descriptors = run(py, None, move |observer| {
        let mesh = input.load_mesh("mesh", observer)?;
        let _reserved = memory::reserve(
            "SHOT",
            memory::descriptor_bytes(mesh.n_vertices(), 0),
            Remedy::Other("decimate the mesh"),
        )?;
        Ok(compute_shot(&mesh, &options)?.0)
    })?;
    Ok(out_matrix(py, descriptors)?.into_any())
}

/// The functional map between two bases from descriptors.
///
/// Parameters
/// ----------
/// source_basis, target_basis : Eigenbasis, or (eigenvalues, eigenvectors, mass)
///     [k], [n, k] and [n] of float32 or float64.
/// source_descriptors : ndarray, [n_source, d]
///     Functions on the source.
/// target_descriptors : ndarray, [n_target, d]
///     The same functions on the target.
/// fm : {"least-squares", "regularized", "bidirectional", "joint", "part"}
///     Solver.
/// mask_weight : float, optional
///     Weight of the resolvent mask, 0 and up. Default: 0.03 for bidirectional, else 0.1.
///
/// Returns
/// -------
/// ndarray of float64, [k_target, k_source]
///     Takes coefficients of a function on the source to those of the function on the target.
#[pyfunction]
#[pyo3(signature = (source_basis, target_basis, source_descriptors, target_descriptors, *, fm="bidirectional", mask_weight=None))]
pub(crate) fn functional_map<'py>(
    py: Python<'py>,
    source_basis: &Bound<'py, PyAny>,
    target_basis: &Bound<'py, PyAny>,
    source_descriptors: &Bound<'py, PyAny>,
    target_descriptors: &Bound<'py, PyAny>,
    fm: &str,
    mask_weight: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let (source, target) = (in_basis(source_basis, "source_basis")?, in_basis(target_basis, "target_basis")?);
    let solver = FmapSolver::new(named::<SolverKind>("fm", fm)?, weight(mask_weight)?);
    let single = |object, n, what| Ok::<_, PyErr>(matrix(object, [Some(n), None], what)?.map(|x| x as f32));
    let f = single(source_descriptors, source.n(), "source_descriptors")?;
    let g = single(target_descriptors, target.n(), "target_descriptors")?;
    let map = run(py, None, move |_| {
        Ok(solve(&source, &target, &source.project(&f), &target.project(&g), solver)?.0)
    })?;
    Ok(out_matrix(py, map)?.into_any())
}

/// The point map of a functional map.
///
/// Parameters
/// ----------
/// functional_map : ndarray, [k_target, k_source]
/// source_basis, target_basis : Eigenbasis, or (eigenvalues, eigenvectors, mass)
///     [k], [n, k] and [n] of float32 or float64.
/// comparison : {"distance", "adjoint", "joint"}
///     Where points are compared: on the target by the map, on the source by its adjoint, or both.
///
/// Returns
/// -------
/// PointMap
///     targets [n_source] of int32, confidence [n_source] of float32.
#[pyfunction]
#[pyo3(signature = (functional_map, source_basis, target_basis, *, comparison="adjoint"))]
pub(crate) fn point_map<'py>(
    py: Python<'py>,
    functional_map: &Bound<'py, PyAny>,
    source_basis: &Bound<'py, PyAny>,
    target_basis: &Bound<'py, PyAny>,
    comparison: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let (source, target) = (in_basis(source_basis, "source_basis")?, in_basis(target_basis, "target_basis")?);
    let map = matrix(functional_map, [None, None], "functional_map")?;
    let comparison = match comparison {
        "distance" => Comparison::Distance,
        "adjoint" => Comparison::Adjoint,
        "joint" => Comparison::Joint,
        other => {
            return Err(wrong(format!(
                "comparison is {other:?}, expected \"distance\", \"adjoint\" or \"joint\""
            )));
        }
    };
    let (source, target) =
        (first(source, map.cols(), "source_basis")?, first(target, map.rows(), "target_basis")?);
    let found = run(py, None, move |_| Ok(recover_by(comparison, &map, &source, &target)?))?;
    named_tuple(py, "PointMap", (out_targets(py, &found), out_confidence(py, &found)))
}

/// Refines a point map by ZoomOut.
///
/// Parameters
/// ----------
/// targets : ndarray of integers, [n_source], or an object with ``.targets``
///     The map: for each source vertex a target vertex, -1 where there is none.
/// source_basis, target_basis : Eigenbasis, or (eigenvalues, eigenvectors, mass)
///     [k], [n, k] and [n] of float32 or float64.
/// k_start, k_step, k_max : int
///     Eigenfunctions in the first round, those added from round to round, those of the last round at most.
/// bidirectional : bool
///     Take the mean of the functional maps of both directions in each round.
///
/// Returns
/// -------
/// Refined
///     targets [n_source] of int32, confidence [n_source] of float32, functional_map [k, k] of float64.
#[pyfunction]
#[pyo3(signature = (targets, source_basis, target_basis, *, k_start=60, k_step=20, k_max=200, bidirectional=true))]
#[allow(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn zoomout<'py>(
    py: Python<'py>,
    targets: &Bound<'py, PyAny>,
    source_basis: &Bound<'py, PyAny>,
    target_basis: &Bound<'py, PyAny>,
    k_start: usize,
    k_step: usize,
    k_max: usize,
    bidirectional: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let (source, target) = (in_basis(source_basis, "source_basis")?, in_basis(target_basis, "target_basis")?);
    let map = in_map(targets, source.n(), target.n(), "targets")?;
    let mut options = ZoomOutOptions::default();
    (options.k_start, options.k_step, options.k_max) = (k_start, k_step, k_max);
    options.bidirectional = bidirectional;
    let found = run(py, None, move |_| Ok(refine(&map, &source, &target, &options)?))?;
    let functional_map = out_matrix(py, found.functional_map)?;
    named_tuple(py, "Refined", (out_targets(py, &found.map), out_confidence(py, &found.map), functional_map))
}

/// A tuple of the package with names.
pub(crate) fn named_tuple<'py>(
    py: Python<'py>,
    name: &str,
    values: impl pyo3::call::PyCallArgs<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import("fmnet")?.getattr(name)?.call1(values)
}

pub(crate) fn out_basis(py: Python<'_>, basis: Eigenbasis) -> PyResult<Bound<'_, PyAny>> {
    let (values, mass) = (PyArray1::from_vec(py, basis.eigenvalues), PyArray1::from_vec(py, basis.mass));
    named_tuple(py, "Eigenbasis", (values, out_matrix(py, basis.eigenvectors)?, mass))
}

fn out_targets<'py>(py: Python<'py>, map: &PointMap) -> Bound<'py, PyArray1<i32>> {
    PyArray1::from_slice(py, crate::arrays::same_bytes(&map.targets))
}

fn out_confidence<'py>(py: Python<'py>, map: &PointMap) -> Option<Bound<'py, PyArray1<f32>>> {
    map.confidence.as_ref().map(|values| PyArray1::from_slice(py, values))
}

/// A basis of three arrays that fit together.
fn in_basis(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Eigenbasis> {
    let parts: Vec<Bound<'_, PyAny>> = object.try_iter()?.collect::<PyResult<_>>()?;
    let [eigenvalues, eigenvectors, mass] = &parts[..] else {
        return Err(wrong(format!(
            "{what}: {} parts, expected three: (eigenvalues, eigenvectors, mass)",
            parts.len()
        )));
    };
    let eigenvectors = matrix(eigenvectors, [None, None], &format!("{what}, eigenvectors"))?;
    let sizes = [eigenvectors.cols(), eigenvectors.rows()];
    let (eigenvalues, _) = reals(eigenvalues, &[Some(sizes[0])], &format!("{what}, eigenvalues"))?;
    let (mass, _) = reals(mass, &[Some(sizes[1])], &format!("{what}, mass"))?;
    Ok(Eigenbasis { eigenvalues, eigenvectors, mass })
}

/// The first `k` pairs.
fn first(basis: Eigenbasis, k: usize, what: &str) -> PyResult<Eigenbasis> {
    match basis.k() {
        found if found < k => {
            Err(wrong(format!("{what}: {found} eigenpairs, but the functional map has {k}")))
        }
        found if found == k => Ok(basis),
        _ => Ok(basis.truncated(k)),
    }
}

/// A point map of integers, or of an object that has one.
pub(crate) fn in_map(
    object: &Bound<'_, PyAny>,
    n_source: usize,
    n_target: usize,
    what: &str,
) -> PyResult<PointMap> {
    let own = object.getattr_opt("targets")?;
    let (targets, _) = integers(own.as_ref().unwrap_or(object), &[Some(n_source)], what)?;
    let vertex = |(source, &target): (usize, &i64)| match u32::try_from(target) {
        Ok(vertex) if (vertex as usize) < n_target => Ok(vertex),
        Err(_) if target == -1 => Ok(PointMap::UNMATCHED),
        _ => Err(wrong(format!(
            "{what}: source vertex {source} is matched to target vertex {target}, but the target has {n_target} vertices \
             (0-based; -1 where unmatched)"
        ))),
    };
    let targets = targets.iter().enumerate().map(vertex).collect::<PyResult<Vec<u32>>>()?;
    Ok(PointMap::new(targets, n_target))
}
