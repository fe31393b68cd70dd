//! What training needs of each shape, computed once and kept on disk: eigenbasis, gradients, SHOT, the points of its
//! group and the geodesic distances between a pool of them.
//!
//! Only points, pools and the place of the arrays stay in memory; a minibatch reads the arrays of its two shapes
//! ([`PreparedShape::arrays`]), so that there may be more shapes than memory.
//!
//! A full matrix of distances would take 900 MB at 15K vertices. The loss only compares points of a minibatch, so
//! each group of shapes gets a random pool of points, from which its minibatches are drawn. Distances are kept as
//! 16-bit numbers, in steps of 1/16384 of sqrt(area): 12 MB a shape for a pool of 2500.

use crate::dataset::{Correspondence, DatasetError, MISSING, ShapeEntry};
use fmnet::cache::{Cache, CacheKey, Decoder, Encoder};
use fmnet::descriptor::ShotOptions;
use fmnet::events::{Observer, timed};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use fmnet::mesh::{SurfacePoint, Topology, carried_points, nearest_k_vertices, nearest_vertices};
use fmnet::shape::{Context, Shape, ShapeOptions, WayBack};
use fmnet::{Error, Matrix, Mesh};
use rand::SeedableRng;
use rand::seq::index;
use std::collections::BTreeMap;
use thiserror::Error;

/// Settings of [`prepare`].
#[derive(Clone, Debug, PartialEq)]
pub struct PrepareOptions {
    /// Decimation.
    pub shape: ShapeOptions,
    /// Eigenpairs of each shape.
    pub k: usize,
    /// Eigenfunctions whose gradients are computed, at most as many as the shape has; 0: none.
    pub gradients: usize,
    /// SHOT descriptors; `None`: no network takes them.
    pub shot: Option<ShotOptions>,
    /// Whether geodesic distances between the points of the pools are computed.
    pub distances: bool,
    /// Points in the pool of a group. Range 100 and up.
    pub pool: usize,
    /// Seed of the pools.
    pub seed: u64,
}

/// A shape as the runtime processes it, and where the points of its group lie on it.
#[derive(Clone, Debug)]
pub struct ProcessedShape {
    /// Where it comes from.
    pub entry: ShapeEntry,
    /// Mesh and quantities.
    pub shape: Shape,
    /// Vertex of the working mesh of every point of the group, `[points]`, [`MISSING`] where the shape lacks it.
    pub points: Vec<u32>,
    /// Where the points lie on the triangles of the working mesh; `None` where they are vertices.
    pub places: Option<Places>,
}

/// Points on triangles: the three corners of each and their weights. Of a point that the shape lacks both are 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// Vertices, `[points]`, three times.
    pub corners: [Vec<u32>; 3],
    /// Barycentric weights, `[points]`, three times.
    pub weights: [Vec<f32>; 3],
}

impl Places {
    fn new(points: &[Option<SurfacePoint>], mesh: &Mesh) -> Self {
        let corner = |at: usize| {
            let vertex = |p: &Option<SurfacePoint>| p.map_or(0, |p| mesh.faces()[p.face as usize][at]);
            points.iter().map(vertex).collect()
        };
        let weight = |at: usize| points.iter().map(|p| p.map_or(0.0, |p| p.weights[at] as f32)).collect();
        Self { corners: [0, 1, 2].map(corner), weights: [0, 1, 2].map(weight) }
    }

    /// Those of some points, 0-based, in that order.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn select(&self, points: &[u32]) -> Self {
        fn pick<T: Copy>(all: &[T], points: &[u32]) -> Vec<T> {
            points.iter().map(|&p| all[p as usize]).collect()
        }
        let [a, b, c] = &self.corners;
        let [u, v, w] = &self.weights;
        Self {
            corners: [a, b, c].map(|all| pick(all, points)),
            weights: [u, v, w].map(|all| pick(all, points)),
        }
    }
}

/// A shape ready for training.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedShape {
    /// Where it comes from.
    pub entry: ShapeEntry,
    /// Vertex of the working mesh of every point of the group, `[points]`, [`MISSING`] where the shape lacks it.
    pub points: Vec<u32>,
    /// Where the points lie on the triangles of the working mesh; `None` where they are vertices.
    pub places: Option<Places>,
    /// Distances between the points of its pool.
    pub pool: Pool,
    /// For each point the working vertices nearest to its own, `[points, jitter]`; empty where there is no jitter.
    pub jitter: Vec<u32>,
    cache: Cache,
    key: CacheKey,
}

/// What a network and a functional map need of a shape, at unit area.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeArrays {
    /// Vertex areas, `[n]`.
    pub mass: Vec<f32>,
    /// Eigenvalues, `[k]`.
    pub eigenvalues: Vec<f64>,
    /// Eigenvectors, `[n, k]`.
    pub eigenvectors: Matrix<f32>,
    /// Gradients of the first eigenvectors, `[n, gradients]`.
    pub gradients_x: Matrix<f32>,
    /// Along the second axis.
    pub gradients_y: Matrix<f32>,
    /// SHOT, `[n, 352]`; empty where no network takes it.
    pub shot: Matrix<f32>,
}

/// Why a shape could not be prepared.
#[derive(Debug, Error)]
pub enum PrepareError {
    /// The dataset's files are wrong.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The mesh could not be processed.
    #[error(transparent)]
    Shape(#[from] Error),
    /// What was prepared is not there any more.
    #[error(
        "{shape}: its entry in the cache, {path}, is gone or damaged; run the same command again, which prepares it anew"
    )]
    Gone {
        /// Name of the shape.
        shape: String,
        /// The entry's file.
        path: String,
    },
}

/// Reads and processes one shape; results are looked up in the cache and left there.
///
/// # Errors
/// If the shape's files cannot be read or do not fit together, it cannot be processed, or the cache cannot be written.
pub fn process(
    entry: &ShapeEntry,
    options: &ShapeOptions,
    context: Context,
) -> Result<ProcessedShape, PrepareError> {
    let mesh = entry.read()?;
    let mut options = options.clone();
    options.whole_area = entry.whole_area()?;
    let shape = Shape::new(&entry.name, &mesh, &options, context)?;
    let (points, places) = match &entry.correspondence {
        Correspondence::Surface(_) => {
            let on_input = entry.surface_points(&mesh)?;
            let carried = carried_points(&on_input, &mesh, shape.mesh(), CARRIED_WITHIN);
            let vertex = |p: &Option<SurfacePoint>| p.map_or(MISSING, |p| p.nearest_vertex(shape.mesh()));
            (carried.iter().map(vertex).collect(), Some(Places::new(&carried, shape.mesh())))
        }
        _ => (work_points(&shape, &mesh, &entry.points(&mesh)?), None),
    };
    Ok(ProcessedShape { entry: entry.clone(), shape, points, places })
}

/// [`process`], and everything that minibatches need, which goes to the cache.
///
/// # Errors
/// As [`process`].
pub fn prepare(
    entry: &ShapeEntry,
    options: &PrepareOptions,
    jitter: usize,
    cache: &Cache,
    observer: Observer,
) -> Result<PreparedShape, PrepareError> {
    let processed = process(entry, &options.shape, Context { cache: None, observer })?;
    let mesh_key = processed.shape.key();
    let key = CacheKey::of(&[mesh_key.as_bytes(), bytemuck::cast_slice(&processed.points)]);
    let sizes = [options.k as u64, options.gradients as u64, ARRAYS_VERSION];
    let shot = serde_json::to_vec(&options.shot).unwrap_or_default();
    let arrays_key = CacheKey::of(&[mesh_key.as_bytes(), bytemuck::cast_slice(&sizes), &shot]);
    // Not read here: the arrays of all shapes together are large.
    if !cache.path(ARRAYS, arrays_key).is_file() {
        // The arrays hold all that is needed of the quantities: those are not kept a second time.
        let arrays = ShapeArrays::of(&processed.shape, options, Context { cache: None, observer })?;
        cache.put(ARRAYS, arrays_key, &arrays.encode()).map_err(Error::from)?;
    }
    let pool = Pool::cached(&processed, key, options, cache, observer)?;
    let jitter = jitter_neighbors(&processed, jitter);
    let ProcessedShape { entry, points, places, .. } = processed;
    Ok(PreparedShape { entry, points, places, pool, jitter, cache: cache.clone(), key: arrays_key })
}

/// A point of a decimated mesh is not farther from where it was than this, relative to sqrt(area).
const CARRIED_WITHIN: f64 = 0.05;

/// Kind of the cache's entries of [`ShapeArrays`].
const ARRAYS: &str = "arrays";
/// Raise where the arrays of the same shape change.
const ARRAYS_VERSION: u64 = 1;

impl PreparedShape {
    /// Reads the arrays from the cache.
    ///
    /// # Errors
    /// If they are not there any more.
    pub fn arrays(&self) -> Result<ShapeArrays, PrepareError> {
        let bytes = self.cache.fetch(ARRAYS, self.key, &fmnet::events::ignore);
        bytes.and_then(|bytes| ShapeArrays::decode(&bytes)).ok_or_else(|| {
            // If it is damaged, the next run makes it anew.
            let _ = std::fs::remove_file(self.cache.path(ARRAYS, self.key));
            PrepareError::Gone {
                shape: self.entry.name.clone(),
                path: self.cache.path(ARRAYS, self.key).display().to_string(),
            }
        })
    }
}

impl ShapeArrays {
    /// The arrays of a shape.
    ///
    /// # Errors
    /// If a quantity cannot be computed.
    pub fn of(shape: &Shape, options: &PrepareOptions, context: Context) -> Result<Self, Error> {
        let basis = shape.unit_basis(options.k, context)?;
        let single = |matrix: &Matrix| matrix.map(|x| x as f32);
        let (mut gradients_x, mut gradients_y) = (Matrix::default(), Matrix::default());
        if options.gradients > 0 {
            let gradients = shape.gradients(options.gradients, context)?;
            (gradients_x, gradients_y) = (single(&gradients.x), single(&gradients.y));
        }
        let shot = match &options.shot {
            Some(shot) => shape.shot(shot, context)?.as_ref().clone(),
            None => Matrix::default(),
        };
        Ok(Self {
            mass: basis.mass.iter().map(|&m| m as f32).collect(),
            eigenvectors: single(&basis.eigenvectors),
            eigenvalues: basis.eigenvalues,
            gradients_x,
            gradients_y,
            shot,
        })
    }

    /// Number of vertices.
    pub fn n(&self) -> usize {
        self.mass.len()
    }

    fn encode(&self) -> Vec<u8> {
        let mut out = Encoder::default();
        out.slice(&self.mass).slice(&self.eigenvalues);
        out.matrix(&self.eigenvectors).matrix(&self.gradients_x).matrix(&self.gradients_y).matrix(&self.shot);
        out.finish()
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut input = Decoder::new(bytes);
        Some(Self {
            mass: input.slice()?,
            eigenvalues: input.slice()?,
            eigenvectors: input.matrix()?,
            gradients_x: input.matrix()?,
            gradients_y: input.matrix()?,
            shot: input.matrix()?,
        })
    }
}

/// For each point the vertices nearest to its own, `[points, jitter]`; empty where there is no jitter.
fn jitter_neighbors(processed: &ProcessedShape, jitter: usize) -> Vec<u32> {
    if jitter <= 1 {
        return Vec::new();
    }
    let vertices = processed.shape.mesh().vertices();
    let position = |&v: &u32| vertices[if v == MISSING { 0 } else { v as usize }];
    let positions: Vec<[f64; 3]> = processed.points.iter().map(position).collect();
    nearest_k_vertices(vertices, &positions, jitter)
}

/// The points of its group's pool that a shape has, and the geodesic distances between them.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Pool {
    /// The points, ascending, `[m]`; all on one component of the shape.
    pub points: Vec<u32>,
    /// Row by row, `[m, m]`; empty where no loss needs them, and for a part of a shape, whose distances go
    /// around its holes.
    distances: Vec<u16>,
}

/// Takes the points from input vertices to the working mesh: to the vertex itself where it survived, else to the
/// nearest.
fn work_points(shape: &Shape, mesh: &Mesh, input_points: &[u32]) -> Vec<u32> {
    let work_of_input = shape.way_back.work_of_input();
    let lost: Vec<u32> = input_points
        .iter()
        .copied()
        .filter(|&v| v != MISSING && work_of_input[v as usize] == WayBack::NONE)
        .filter(|&v| shape.way_back.full_of_input[v as usize] != WayBack::NONE)
        .collect();
    let positions: Vec<[f64; 3]> = lost.iter().map(|&v| mesh.vertices()[v as usize]).collect();
    let nearest: BTreeMap<u32, u32> =
        lost.iter().copied().zip(nearest_vertices(shape.mesh().vertices(), &positions)).collect();
    let work = |v: u32| nearest.get(&v).copied().unwrap_or_else(|| work_of_input[v as usize]);
    input_points.iter().map(|&v| if v == MISSING { MISSING } else { work(v) }).collect()
}

/// Which of the group's points are in its pool: a random choice that all shapes of the group share, ascending.
fn group_pool(group: &str, n_points: usize, options: &PrepareOptions) -> Vec<u32> {
    let seed = CacheKey::of(&[&options.seed.to_le_bytes(), group.as_bytes()]);
    let mut rng = rand_chacha::ChaCha8Rng::from_seed(*seed.as_bytes());
    let chosen = index::sample(&mut rng, n_points, options.pool.min(n_points));
    let mut chosen: Vec<u32> = chosen.iter().map(|i| i as u32).collect();
    chosen.sort_unstable();
    chosen
}

/// Drops the points that do not lie on the component with the most of them: no distance leads there.
fn keep_main_component(mesh: &Mesh, points: &[u32], chosen: &mut Vec<u32>) {
    let components = Topology::new(mesh).components();
    let component = |&point: &u32| components.of_vertex[points[point as usize] as usize];
    let mut counts = BTreeMap::new();
    chosen.iter().for_each(|point| *counts.entry(component(point)).or_insert(0usize) += 1);
    let main = counts.into_iter().max_by_key(|&(label, count)| (count, std::cmp::Reverse(label)));
    chosen.retain(|point| main.is_some_and(|(label, _)| component(point) == label));
}

impl Pool {
    /// Steps of the stored distances for one unit, sqrt(area).
    const STEPS: f32 = 16_384.0;

    fn cached(
        processed: &ProcessedShape,
        shape_key: CacheKey,
        options: &PrepareOptions,
        cache: &Cache,
        observer: Observer,
    ) -> Result<Self, PrepareError> {
        let numbers = [options.pool as u64, options.seed, u64::from(options.distances)];
        let key = CacheKey::of(&[
            shape_key.as_bytes(),
            bytemuck::cast_slice(&numbers),
            processed.entry.group.as_bytes(),
        ]);
        if let Some(pool) = cache.fetch("pool", key, observer).and_then(|bytes| Self::decode(&bytes)) {
            return Ok(pool);
        }
        let ProcessedShape { entry, shape, points, .. } = processed;
        let pool = timed(observer, &entry.name, "pool", || Self::compute(entry, shape, points, options));
        cache.put("pool", key, &pool.encode()).map_err(Error::from)?;
        Ok(pool)
    }

    fn compute(entry: &ShapeEntry, shape: &Shape, points: &[u32], options: &PrepareOptions) -> Self {
        let has = |&point: &u32| points[point as usize] != MISSING;
        let mut chosen: Vec<u32> =
            group_pool(&entry.group, points.len(), options).into_iter().filter(has).collect();
        keep_main_component(shape.mesh(), points, &mut chosen);
        if entry.is_part() || !options.distances {
            return Self { points: chosen, distances: Vec::new() };
        }
        let vertices: Vec<u32> = chosen.iter().map(|&p| points[p as usize]).collect();
        let solver = GeodesicSolver::new(shape.mesh(), &GeodesicOptions::default());
        let unit = shape.mesh().scale() as f32;
        let distances = solver.distances_between(&vertices);
        let quantised =
            distances.data().iter().map(|d| (d / unit * Self::STEPS).min(65_535.0).round() as u16);
        Self { points: chosen, distances: quantised.collect() }
    }

    /// Number of points `m`.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Distances between some points of the pool, `[q]`, as `[q, q]` in units of sqrt(area), at most 4; none where
    /// they were not computed.
    ///
    /// # Panics
    /// If a point is not in the pool.
    pub fn distances(&self, points: &[u32]) -> Option<Matrix<f32>> {
        if self.distances.is_empty() {
            return None;
        }
        let position = |point: &u32| self.points.binary_search(point).expect("the point is in the pool");
        let positions: Vec<usize> = points.iter().map(position).collect();
        let at = |i: usize, j: usize| self.distances[positions[i] * self.len() + positions[j]];
        Some(Matrix::from_fn(points.len(), points.len(), |i, j| f32::from(at(i, j)) / Self::STEPS))
    }

    fn encode(&self) -> Vec<u8> {
        let mut out = Encoder::default();
        out.slice(&self.points).slice(&self.distances);
        out.finish()
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut input = Decoder::new(bytes);
        let pool = Self { points: input.slice()?, distances: input.slice()? };
        let complete = pool.distances.is_empty() || pool.distances.len() == pool.len() * pool.len();
        complete.then_some(pool)
    }
}
