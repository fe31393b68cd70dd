//! `Matcher` and `match`.

use crate::arrays::integers;
use crate::errors::{Failure, io_error, said, wrong};
use crate::input::{Input, Loaded};
use crate::options::Given;
use crate::result::Match;
use crate::run::run;
use crate::shape::Shape;
use fmnet::batch::MapKeys;
use fmnet::cache::CacheKey;
use fmnet::events::Observer;
use fmnet::pipeline::{DescribedShape, MatchOptions, Matcher as Inner};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Matches shapes; loads the model once.
///
/// Parameters
/// ----------
/// model : path-like, optional
///     Model file (``.onnx``). Default: the one that is built in.
/// descriptor : {"learned", "shot"}
///     Learned descriptors, or SHOT without a network.
/// k : int, optional
///     Eigenfunctions of the functional map, 1 to 500. Default: the model's; 120 with SHOT.
/// fm : {"least-squares", "regularized", "bidirectional", "joint", "part"}, optional
///     Solver of the functional map. Default: what suits the model.
/// mask_weight : float, optional
///     Weight of the mask of the regularised solvers, 0 and up.
/// refine : {"none", "icp", "zoomout", "wavelet", "pmf", "shared-triangulation"}, optional
///     Refinement of the map. Default: what suits the solver; none with SHOT.
/// upscale : {"surface", "l21", "least-squares"}
///     How the map of decimated meshes becomes one of the full meshes.
/// effort : {"low", "normal", "high"}
///     How many ways to a map are tried: one, others where the first looks doubtful, or all.
/// adapt : int, optional
///     Adapt the network to the pair by so many steps, 0 to 100, about half a second each; the map is taken if it looks better.
///     Default: 10 where the first map is doubtful, else 0.
/// decimate : int or "off", optional
///     Meshes of more vertices are decimated to so many, 100 and up. Default: the model's; 15000 with SHOT.
/// subdivide : int or "off", optional
///     Meshes of fewer vertices are subdivided inside to so many, 100 and up; results stay in the mesh's vertices. Default: 2000; off for
///     the refinements pmf and shared-triangulation.
/// shot_radius : float, optional
///     SHOT radius relative to sqrt(area), between 0 and 1. Default: the model's; 0.067 with SHOT.
/// cache : path-like, optional
///     Folder in which what is computed of each shape is kept and found again.
/// backend : {"native", "tract"}
///     What computes the network.
///
/// Notes
/// -----
/// The same options give the same bytes as ``fmnet-infer match``. All methods release the interpreter's lock.
#[pyclass(frozen, module = "fmnet")]
pub(crate) struct Matcher {
    inner: Arc<Inner>,
    options: MatchOptions,
}

fn load(py: Python<'_>, options: MatchOptions) -> PyResult<Matcher> {
    let wanted = options.clone();
    let inner = run(py, None, move |_| Ok(Inner::new(&wanted)?))?;
    Ok(Matcher { inner: Arc::new(inner), options })
}

#[pymethods]
impl Matcher {
    #[new]
    #[pyo3(signature = (model=None, *, descriptor="learned", k=None, fm=None, mask_weight=None, refine=None, upscale="surface",
                        effort="normal", adapt=None, decimate=None, subdivide=None, shot_radius=None, cache=None,
                        backend="native"))]
    #[allow(clippy::too_many_arguments, reason = "they are keywords")]
    fn new(
        py: Python<'_>,
        model: Option<PathBuf>,
        descriptor: &str,
        k: Option<usize>,
        fm: Option<&str>,
        mask_weight: Option<f64>,
        refine: Option<&str>,
        upscale: &str,
        effort: &str,
        adapt: Option<usize>,
        decimate: Option<Bound<'_, PyAny>>,
        subdivide: Option<Bound<'_, PyAny>>,
        shot_radius: Option<f64>,
        cache: Option<PathBuf>,
        backend: &str,
    ) -> PyResult<Self> {
        let given = Given {
            model,
            descriptor,
            k,
            fm,
            mask_weight,
            refine,
            upscale,
            effort,
            adapt,
            decimate,
            subdivide,
            shot_radius,
            cache,
            backend,
        };
        load(py, given.options()?)
    }

    /// int : Eigenfunctions of the functional map.
    #[getter]
    fn k(&self) -> usize {
        self.inner.k()
    }

    /// Processes a mesh and computes its descriptors, once for many matches.
    ///
    /// Parameters
    /// ----------
    /// mesh : path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
    ///     Vertices [n, 3] of float32 or float64, faces [m, 3] of integers.
    /// name : str, optional
    ///     For messages. Default: the file's name, or "mesh".
    /// whole_area : float, optional
    ///     For a part of a shape: the area of the whole, in squared units of the mesh.
    /// progress : callable, optional
    ///     Called as ``progress(subject, stage, seconds)`` where a stage begins (``seconds`` is None) and ends.
    ///
    /// Returns
    /// -------
    /// Shape
    #[pyo3(signature = (mesh, *, name=None, whole_area=None, progress=None))]
    fn describe(
        &self,
        py: Python<'_>,
        mesh: &Bound<'_, PyAny>,
        name: Option<String>,
        whole_area: Option<f64>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Shape> {
        let (input, matcher) = (Input::mesh(mesh, "mesh")?, self.inner.clone());
        let inner = run(py, progress, move |observer| {
            let mut loaded = input.load("mesh", observer)?;
            if let (Loaded::Mesh(own, _), Some(name)) = (&mut loaded, name) {
                *own = name;
            }
            described(&matcher, loaded, whole_area, observer)
        })?;
        Ok(Shape { inner })
    }

    /// Matches two shapes.
    ///
    /// Parameters
    /// ----------
    /// source, target : Shape, path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
    ///     The shape whose vertices are matched, and the one that they are matched to.
    /// partial : bool
    ///     The source is a part of the target, in whatever pose and the same unit of length.
    /// landmarks : ndarray of integers, [q, 2], optional
    ///     Matches that are known, a source vertex and a target vertex each: kept exactly, they pull the rest of the map.
    /// progress : callable, optional
    ///     Called as ``progress(subject, stage, seconds)`` where a stage begins (``seconds`` is None) and ends.
    ///
    /// Returns
    /// -------
    /// Match
    #[pyo3(name = "match", signature = (source, target, *, partial=false, landmarks=None, progress=None))]
    fn match_(
        &self,
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        target: &Bound<'_, PyAny>,
        partial: bool,
        landmarks: Option<&Bound<'_, PyAny>>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Match> {
        let (source, target) = (Input::new(source, "source")?, Input::new(target, "target")?);
        let landmarks = landmarks.map_or(Ok(Vec::new()), in_landmarks)?;
        let matcher = self.inner.clone();
        let inner = run(py, progress, move |observer| {
            let (source, target) = (source.load("source", observer)?, target.load("target", observer)?);
            let [source, target] = pair(&matcher, source, target, partial, observer)?;
            Ok(matcher.match_with_landmarks(&source, &target, &landmarks, observer)?)
        })?;
        Ok(Match { inner })
    }

    /// Writes a described shape to a file, whole or not at all.
    ///
    /// Parameters
    /// ----------
    /// shape : Shape
    /// path : path-like
    fn save(&self, py: Python<'_>, shape: &Bound<'_, Shape>, path: PathBuf) -> PyResult<()> {
        let inner = &shape.get().inner;
        self.check(inner)?;
        py.detach(|| inner.write(&path)).map_err(io_error)
    }

    /// Reads a shape that was written by :meth:`save` of a matcher with the same model.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///
    /// Returns
    /// -------
    /// Shape
    fn load(&self, py: Python<'_>, path: PathBuf) -> PyResult<Shape> {
        let inner = py.detach(|| DescribedShape::read(&path)).map_err(io_error)?;
        self.check(&inner).map_err(|e| wrong(format!("{}: {}", path.display(), e.value(py))))?;
        Ok(Shape { inner: Arc::new(inner) })
    }

    /// What a map is made from, as ``fmnet-infer batch`` writes it beside a map and looks for it before it makes one anew.
    ///
    /// Parameters
    /// ----------
    /// source_hash, target_hash : str
    ///     :func:`mesh_hash` of both meshes.
    /// partial : bool
    ///     Whether the source is matched as a part of the target.
    ///
    /// Returns
    /// -------
    /// str
    #[pyo3(signature = (source_hash, target_hash, *, partial=false))]
    fn map_key(&self, source_hash: &str, target_hash: &str, partial: bool) -> PyResult<String> {
        let keys = MapKeys::new(&self.inner, &self.options, partial);
        let hash = |text| {
            CacheKey::from_hex(text)
                .ok_or_else(|| wrong(format!("{text:?} is no hash of a mesh; see fmnet.mesh_hash")))
        };
        Ok(keys.of_meshes(hash(source_hash)?, hash(target_hash)?))
    }

    fn __repr__(&self) -> String {
        let model =
            self.inner.network().map_or("SHOT".to_owned(), |network| network.path().display().to_string());
        format!("<fmnet.Matcher, {model}, k = {}>", self.inner.k())
    }
}

impl Matcher {
    /// Refuses shapes of another matcher's descriptors.
    fn check(&self, shape: &DescribedShape) -> PyResult<()> {
        self.inner.check(shape).map_err(|e| Failure::from(e).into())
    }
}

/// Matches two meshes: one pair, everything computed anew.
///
/// Parameters
/// ----------
/// source, target : Shape, path-like, (vertices, faces), or an object with ``.vertices`` and ``.faces``
///     Vertices [n, 3] of float32 or float64, faces [m, 3] of integers.
/// partial : bool
///     The source is a part of the target, in whatever pose and the same unit of length.
/// landmarks : ndarray of integers, [q, 2], optional
///     Matches that are known, a source vertex and a target vertex each: kept exactly, they pull the rest of the map.
/// progress : callable, optional
///     Called as ``progress(subject, stage, seconds)`` where a stage begins (``seconds`` is None) and ends.
/// model, descriptor, k, fm, mask_weight, refine, upscale, effort, adapt, decimate, subdivide, shot_radius, cache, backend
///     As of :class:`Matcher`.
///
/// Returns
/// -------
/// Match
///
/// Examples
/// --------
/// >>> match = fmnet.match("man.obj", "woman.glb")
/// >>> match.targets  # for every vertex of man.obj the vertex of woman.glb
#[pyfunction]
#[pyo3(name = "match", signature = (source, target, *, partial=false, landmarks=None, progress=None, model=None, descriptor="learned", k=None, fm=None,
                    mask_weight=None, refine=None, upscale="surface", effort="normal", adapt=None, decimate=None, subdivide=None, shot_radius=None, cache=None,
                        backend="native"))]
#[allow(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn match_(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    target: &Bound<'_, PyAny>,
    partial: bool,
    landmarks: Option<&Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
    model: Option<PathBuf>,
    descriptor: &str,
    k: Option<usize>,
    fm: Option<&str>,
    mask_weight: Option<f64>,
    refine: Option<&str>,
    upscale: &str,
    effort: &str,
    adapt: Option<usize>,
    decimate: Option<Bound<'_, PyAny>>,
    subdivide: Option<Bound<'_, PyAny>>,
    shot_radius: Option<f64>,
    cache: Option<PathBuf>,
    backend: &str,
) -> PyResult<Match> {
    let given = Given {
        model,
        descriptor,
        k,
        fm,
        mask_weight,
        refine,
        upscale,
        effort,
        adapt,
        decimate,
        subdivide,
        shot_radius,
        cache,
        backend,
    };
    load(py, given.options()?)?.match_(py, source, target, partial, landmarks, progress)
}

/// A loaded input, described; with the area of the whole, as a part.
pub(crate) fn described(
    matcher: &Inner,
    loaded: Loaded,
    whole_area: Option<f64>,
    observer: Observer,
) -> Result<Arc<DescribedShape>, Failure> {
    let (name, mesh) = match loaded {
        Loaded::Shape(shape) => return Ok(shape),
        Loaded::Mesh(name, mesh) => (name, mesh),
    };
    Ok(Arc::new(match whole_area {
        Some(area) => matcher.describe_part(&name, &mesh, area, observer)?,
        None => matcher.describe(&name, &mesh, observer)?,
    }))
}

/// Both shapes of a pair.
fn pair(
    matcher: &Inner,
    source: Loaded,
    target: Loaded,
    partial: bool,
    observer: Observer,
) -> Result<[Arc<DescribedShape>; 2], Failure> {
    if let (true, Loaded::Shape(shape)) = (partial, &source)
        && shape.shape.whole_area.is_none()
    {
        let name = Path::new(&shape.shape.name).display();
        return Err(said(format!(
            "{name} was described as a whole shape; describe it with whole_area=, the area of the target, to match it as a part"
        )));
    }
    if let (Loaded::Mesh(source_name, source), Loaded::Mesh(target_name, target)) = (&source, &target) {
        let pair = matcher.describe_pair((source_name, source), (target_name, target), partial, observer)?;
        return Ok(pair.map(Arc::new));
    }
    let target = described(matcher, target, None, observer)?;
    let whole_area = partial.then(|| target.shape.full_mesh.area());
    Ok([described(matcher, source, whole_area, observer)?, target])
}

/// Pairs of vertices.
fn in_landmarks(object: &Bound<'_, PyAny>) -> PyResult<Vec<(u32, u32)>> {
    let (vertices, _) = integers(object, &[None, Some(2)], "landmarks")?;
    let vertex = |v: i64| u32::try_from(v).map_err(|_| wrong(format!("landmarks: there is no vertex {v}")));
    vertices.chunks_exact(2).map(|pair| Ok((vertex(pair[0])?, vertex(pair[1])?))).collect()
}
