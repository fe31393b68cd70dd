//! What belongs to one mesh, carried over a map to the other.

use crate::arrays::{as_array, check_shape, integers, kind, matrix, out_matrix, reals};
use crate::errors::{Failure, said, warn, wrong};
use crate::input::Input;
use crate::result::Match;
use crate::run::run;
use crate::stages::in_map;
use fmnet::Mesh;
use fmnet::io::Attributes;
use fmnet::point_map::PointMap;
use fmnet::render::{Donors, transfer_attributes, transfer_landmarks as carry_landmarks, transfer_values};
use numpy::{PyArray1, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Both meshes of a map, and what each vertex of the receiver takes.
struct Way {
    giver: Mesh,
    receiver: Mesh,
    donors: Donors,
}

/// Reads both meshes, checks the map against them and finds the donors.
fn way(
    py: Python<'_>,
    targets: &Bound<'_, PyAny>,
    source: &Bound<'_, PyAny>,
    target: &Bound<'_, PyAny>,
    to: &str,
) -> PyResult<Way> {
    let to_source = match to {
        "source" => true,
        "target" => false,
        other => return Err(wrong(format!("to is {other:?}, expected \"source\" or \"target\""))),
    };
    let (source, target) = (Input::mesh(source, "source")?, Input::mesh(target, "target")?);
    let (source, target) = run(py, None, move |observer| {
        Ok((source.load_mesh("source", observer)?, target.load_mesh("target", observer)?))
    })?;
    let map = in_map(targets, source.n_vertices(), target.n_vertices(), "targets")?;
    let points = targets.cast::<Match>().ok().and_then(|found| found.get().inner.map.points.clone());
    let n_faces = target.n_faces();
    if points.iter().flatten().flatten().any(|point| point.face as usize >= n_faces) {
        return Err(wrong(
            "targets: a point of the map is on no triangle of the target; pass the meshes of the map",
        ));
    }
    let map = PointMap { points, ..map };
    run(py, None, move |_| Way::new(&map, source, target, to_source))
}

impl Way {
    fn new(map: &PointMap, source: Mesh, target: Mesh, to_source: bool) -> Result<Self, Failure> {
        let donors = match to_source {
            true => Donors::of_source(map),
            false => Donors::of_target(map, &target).map_err(said)?,
        };
        let is_finer = to_source && map.points.is_some();
        let (giver, receiver) = if to_source { (target, source) } else { (source, target) };
        let donors = match is_finer {
            true => donors.on_surface(map, &giver),
            false => donors.interpolated(&receiver, &giver),
        };
        let donors = donors.map_err(said)?;
        Ok(Self { giver, receiver, donors })
    }
}

/// Carries values of the vertices of one mesh over a map to the other.
///
/// Parameters
/// ----------
/// values : ndarray, [n_giver] or [n_giver, q]
///     Of the target's vertices, or with ``to="target"`` of the source's. float32 or float64 are mixed between neighbours;
///     integers and bools are labels, of which each vertex takes one.
/// targets : ndarray of integers, [n_source], or an object with ``.targets``
///     The map: for each source vertex a target vertex, -1 where there is none.
/// source, target : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     The meshes of the map.
/// to : {"source", "target"}
///     Which mesh receives.
///
/// Returns
/// -------
/// ndarray, [n_receiver] or [n_receiver, q]
///     Of the type of ``values``. Without a match: NaN, -1, or 0 where the type has no sign.
#[pyfunction]
#[pyo3(signature = (values, targets, source, target, *, to="source"))]
pub(crate) fn transfer<'py>(
    py: Python<'py>,
    values: &Bound<'py, PyAny>,
    targets: &Bound<'py, PyAny>,
    source: &Bound<'py, PyAny>,
    target: &Bound<'py, PyAny>,
    to: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let way = way(py, targets, source, target, to)?;
    let array = as_array(values, "values")?;
    let n = way.giver.n_vertices();
    let shape = [Some(n), None];
    check_shape(&array, if array.ndim() == 1 { &shape[..1] } else { &shape }, "values")?;
    match kind(&array) {
        b'i' | b'u' | b'b' => labels(py, &array, &way.donors),
        _ => numbers(py, &array, way.donors),
    }
}

fn numbers<'py>(
    py: Python<'py>,
    array: &Bound<'py, PyUntypedArray>,
    donors: Donors,
) -> PyResult<Bound<'py, PyAny>> {
    let columns = array.call_method1("reshape", (array.shape()[0], -1))?;
    let values = matrix(&columns, [None, None], "values")?;
    let moved = run(py, None, move |_| transfer_values(&values, &donors).map_err(said))?;
    let n = moved.rows();
    let moved = out_matrix(py, moved)?;
    let moved = if array.ndim() == 1 { moved.reshape([n])?.into_any() } else { moved.into_any() };
    moved.call_method1("astype", (array.dtype(),))
}

/// Labels by NumPy, whatever their type.
fn labels<'py>(
    py: Python<'py>,
    array: &Bound<'py, PyUntypedArray>,
    donors: &Donors,
) -> PyResult<Bound<'py, PyAny>> {
    let nearest: Vec<Option<usize>> = donors.nearest_vertices().collect();
    let rows: Vec<i64> = nearest.iter().map(|v| v.map_or(0, |v| v as i64)).collect();
    let moved = array.call_method1("take", (PyArray1::from_vec(py, rows), 0))?;
    let missing: Vec<bool> = nearest.iter().map(Option::is_none).collect();
    let count = missing.iter().filter(|&&is_missing| is_missing).count();
    if count > 0 {
        let sign = if kind(array) == b'i' { -1 } else { 0 };
        moved.set_item(PyArray1::from_vec(py, missing), sign)?;
        if sign == 0 {
            warn(
                py,
                &format!("{count} vertices without a match have 0, as the type has no other sign for them"),
            )?;
        }
    }
    Ok(moved)
}

/// Carries landmarks over a map.
///
/// Parameters
/// ----------
/// landmarks : ndarray of integers, [q]
///     Vertices of the giving mesh.
/// targets : ndarray of integers, [n_source], or an object with ``.targets``
///     The map: for each source vertex a target vertex, -1 where there is none.
/// source, target : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     The meshes of the map.
/// to : {"source", "target"}
///     Which mesh receives.
///
/// Returns
/// -------
/// ndarray of int32, [q]
///     The receiving vertex of each landmark, -1 where there is none.
#[pyfunction]
#[pyo3(signature = (landmarks, targets, source, target, *, to="source"))]
pub(crate) fn transfer_landmarks<'py>(
    py: Python<'py>,
    landmarks: &Bound<'py, PyAny>,
    targets: &Bound<'py, PyAny>,
    source: &Bound<'py, PyAny>,
    target: &Bound<'py, PyAny>,
    to: &str,
) -> PyResult<Bound<'py, PyArray1<i32>>> {
    let way = way(py, targets, source, target, to)?;
    let (landmarks, _) = integers(landmarks, &[None], "landmarks")?;
    let n = way.giver.n_vertices();
    let vertex = |&v: &i64| u32::try_from(v).ok().filter(|&v| (v as usize) < n).ok_or(v);
    let landmarks: Result<Vec<u32>, i64> = landmarks.iter().map(vertex).collect();
    let landmarks = landmarks.map_err(|v| {
        wrong(format!("landmarks: there is no vertex {v}; the giving mesh has {n} (0-based)"))
    })?;
    let moved = run(py, None, move |_| {
        carry_landmarks(&landmarks, &way.giver, &way.receiver, &way.donors).map_err(said)
    })?;
    Ok(PyArray1::from_vec(py, moved.iter().map(|v| v.map_or(-1, |v| v as i32)).collect()))
}

/// Carries texture coordinates over a map, with no triangle across a seam.
///
/// Parameters
/// ----------
/// corner_uvs : ndarray, [m_giver, 3, 2]
///     Texture coordinates of the corners of the giving mesh's triangles.
/// targets : ndarray of integers, [n_source], or an object with ``.targets``
///     The map: for each source vertex a target vertex, -1 where there is none.
/// source, target : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     The meshes of the map.
/// to : {"source", "target"}
///     Which mesh receives.
///
/// Returns
/// -------
/// ndarray of float32, [m_receiver, 3, 2]
///     Texture coordinates of the corners of the receiving mesh's triangles.
#[pyfunction]
#[pyo3(signature = (corner_uvs, targets, source, target, *, to="source"))]
pub(crate) fn transfer_uvs<'py>(
    py: Python<'py>,
    corner_uvs: &Bound<'py, PyAny>,
    targets: &Bound<'py, PyAny>,
    source: &Bound<'py, PyAny>,
    target: &Bound<'py, PyAny>,
    to: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let way = way(py, targets, source, target, to)?;
    let wanted = [Some(way.giver.n_faces()), Some(3), Some(2)];
    let (uvs, _) = reals(corner_uvs, &wanted, "corner_uvs")?;
    let uvs: Vec<f32> = uvs.iter().map(|&x| x as f32).collect();
    let attributes = Attributes { corner_uvs: Some(uvs_of(&uvs)), ..Attributes::default() };
    let moved = run(py, None, move |_| {
        let moved = transfer_attributes(&way.giver, &attributes, &way.receiver, &way.donors).map_err(said)?;
        moved.corner_uvs.ok_or_else(|| said("no texture coordinates came of the transfer"))
    })?;
    let m = moved.len();
    let flat: Vec<f32> = moved.into_iter().flatten().flatten().collect();
    Ok(PyArray1::from_vec(py, flat).reshape([m, 3, 2])?.into_any())
}

fn uvs_of(flat: &[f32]) -> Vec<[[f32; 2]; 3]> {
    bytemuck::cast_slice::<f32, [[f32; 2]; 3]>(flat).to_vec()
}
