//! Distances on a mesh, and maps against ground truth.

use crate::arrays::{integers, out_matrix, view};
use crate::errors::{said, wrong};
use crate::input::Input;
use crate::result::Match;
use crate::run::run;
use crate::stages::in_map;
use fmnet::eval::{ErrorSummary, GroundTruth, geodesic_errors, surface_errors, symmetric_geodesic_errors};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::memory::{self, Remedy};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

/// Geodesic distances on a mesh: exact at short range, within 0.03 % of exact in the mean beyond it.
///
/// Parameters
/// ----------
/// mesh : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     Vertices [n, 3] of float32 or float64, faces [m, 3] of integers.
/// sources : int, or ndarray of integers, [s], optional
///     Vertices from which distances are taken. Default: all, which takes ``4 n^2`` bytes.
///
/// Returns
/// -------
/// ndarray of float32, [s, n], or [n] of one source
///     In the mesh's unit; infinite where no path leads.
#[pyfunction]
#[pyo3(signature = (mesh, sources=None))]
pub(crate) fn geodesic_distances<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyAny>,
    sources: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let input = Input::mesh(mesh, "mesh")?;
    let is_one = sources.is_some_and(|sources| sources.extract::<i64>().is_ok());
    let sources = match sources {
        Some(one) if is_one => Some(vec![one.extract::<i64>()?]),
        Some(many) => Some(integers(many, &[None], "sources")?.0),
        None => None,
    };
    let distances = run(py, None, move |observer| {
        let mesh = input.load_mesh("mesh", observer)?;
        let n = mesh.n_vertices();
        let vertex = |&v: &i64| u32::try_from(v).ok().filter(|&v| (v as usize) < n).ok_or(v);
        let sources = sources.map_or(Ok((0..n as u32).collect()), |s| s.iter().map(vertex).collect());
        let sources: Vec<u32> = sources
            .map_err(|v| said(format!("sources: there is no vertex {v}; the mesh has {n} (0-based)")))?;
        let needed = 4 * n as u64 * sources.len() as u64;
        let _reserved = memory::reserve(
            "the distances",
            needed,
            Remedy::Other("ask for those from fewer sources at a time"),
        )?;
        Ok(GeodesicSolver::new(&mesh, &GeodesicOptions::default()).from_sources(&sources))
    })?;
    let n = distances.cols();
    let distances = out_matrix(py, distances)?;
    Ok(if is_one { distances.reshape([n])?.into_any() } else { distances.into_any() })
}

/// The geodesic errors of a map, in lengths over sqrt(area) of the target.
///
/// Unmatched vertices are left out of ``mean`` and ``worst``, but count as wrong in the shares. What cannot be measured is NaN.
#[pyclass(frozen, module = "fmnet")]
pub(crate) struct Evaluation {
    errors: Vec<f32>,
    summary: ErrorSummary,
    on_surface: Option<f64>,
    mirrored: bool,
}

#[pymethods]
impl Evaluation {
    /// ndarray of float32, [n_source] : Error of each source vertex; NaN where it is unmatched or no truth is known.
    #[getter]
    fn errors<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let errors = &slf.get().errors;
        view(slf.as_any(), errors.len(), errors)
    }

    /// int : Number of correct matches known.
    #[getter]
    fn count(&self) -> usize {
        self.summary.count
    }

    /// float : Mean error, relative to sqrt(area); papers give it times 100.
    #[getter]
    fn mean(&self) -> f64 {
        self.summary.mean
    }

    /// float or None : Mean error of the points on the surface that a :class:`Match` has (``barycentric``), finer than its vertices; None
    /// for plain arrays, and where the mirrored truth counts.
    #[getter]
    fn mean_on_surface(&self) -> Option<f64> {
        self.on_surface
    }

    /// float : Largest error.
    #[getter]
    fn worst(&self) -> f64 {
        self.summary.worst
    }

    /// float : Area under the error curve from 0 to 0.10, as a share of the best possible.
    #[getter]
    fn auc(&self) -> f64 {
        self.summary.auc
    }

    /// float : Share of exact matches.
    #[getter]
    fn exact(&self) -> f64 {
        self.summary.exact
    }

    /// float : Share of matches with an error of at most 0.05.
    #[getter]
    fn within_005(&self) -> f64 {
        self.summary.within_005
    }

    /// float : Share of the correct matches known whose source vertex is matched at all.
    #[getter]
    fn coverage(&self) -> f64 {
        self.summary.coverage
    }

    /// bool : Whether the mirrored truth was the better one.
    #[getter]
    fn mirrored(&self) -> bool {
        self.mirrored
    }

    fn __repr__(&self) -> String {
        format!("<fmnet.Evaluation, {}>", self.summary)
    }
}

/// Compares a map with ground truth (Princeton protocol).
///
/// Parameters
/// ----------
/// targets : ndarray of integers, [n_source], or an object with ``.targets``
///     The map: for each source vertex a target vertex, -1 where there is none.
/// truth : ndarray of integers, [n_source]
///     The right target vertex of each source vertex, -1 where it is not known.
/// target : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     The target mesh.
/// symmetric_truth : ndarray of integers, [n_source], optional
///     The left-right mirrored truth; the better of the two counts.
///
/// Returns
/// -------
/// Evaluation
#[pyfunction]
#[pyo3(signature = (targets, truth, target, *, symmetric_truth=None))]
pub(crate) fn evaluate(
    py: Python<'_>,
    targets: &Bound<'_, PyAny>,
    truth: &Bound<'_, PyAny>,
    target: &Bound<'_, PyAny>,
    symmetric_truth: Option<&Bound<'_, PyAny>>,
) -> PyResult<Evaluation> {
    let input = Input::mesh(target, "target")?;
    let target = run(py, None, move |observer| input.load_mesh("target", observer))?;
    let n_target = target.n_vertices();
    let own = targets.getattr_opt("targets")?;
    let n_source = own.as_ref().unwrap_or(targets).len()?;
    let mut map = in_map(targets, n_source, n_target, "targets")?;
    map.points = targets.cast::<Match>().ok().and_then(|found| found.get().inner.map.points.clone());
    let truth = in_map(truth, n_source, n_target, "truth")?;
    let mirrored =
        symmetric_truth.map(|truth| in_map(truth, n_source, n_target, "symmetric_truth")).transpose()?;
    if truth.iter().flatten().next().is_none() {
        return Err(wrong("truth: no vertex has a match, so there is nothing to measure"));
    }
    run(py, None, move |_| {
        let solver = GeodesicSolver::new(&target, &GeodesicOptions::default());
        let area = target.area();
        let known = GroundTruth::from_map(&truth).map_err(said)?;
        let (errors, is_mirrored, pairs) = match &mirrored {
            None => (geodesic_errors(&map, &known, &solver, area).map_err(said)?, false, known),
            Some(mirrored) => {
                let other = GroundTruth::from_map(mirrored).map_err(said)?;
                let found = symmetric_geodesic_errors(&map, &known, &other, &solver, area).map_err(said)?;
                (found.errors, found.is_mirrored, if found.is_mirrored { other } else { known })
            }
        };
        let mut of_vertex = vec![f32::NAN; n_source];
        pairs
            .pairs()
            .iter()
            .zip(&errors)
            .for_each(|(&(source, _), &error)| of_vertex[source as usize] = error);
        let on_surface = match map.points.is_some() && !is_mirrored {
            true => {
                let errors = surface_errors(&map, &pairs, &target, &solver).map_err(said)?;
                Some(ErrorSummary::new(&errors, area).mean)
            }
            false => None,
        };
        let summary = ErrorSummary::new(&errors, area);
        Ok(Evaluation { summary, on_surface, errors: of_vertex, mirrored: is_mirrored })
    })
}
