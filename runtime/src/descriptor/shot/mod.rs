//! SHOT: Signature of Histograms of OrienTations (Tombari, Salti, Di Stefano, "Unique signatures of histograms
//! for local surface description", ECCV 2010), as Litany et al. 2017 computed it for their network.
//!
//! A sphere around each vertex is oriented by a local frame ([`frame`]) and cut into 32 volumes: 8 sectors of
//! azimuth, 2 halves of elevation, 2 shells of distance. Each volume holds a histogram of the cosine between the
//! normals in it and the frame's z axis, filled with interpolation between adjacent volumes and bins ([`histogram`]).
//!
//! The result agrees with the authors' implementation, which departs from the paper in places; each is stated
//! where it is computed. One of them makes the descriptor depend on the unit of length, so everything here happens in
//! the unit in which the radius is 9, as it was for the authors, who had bodies in centimetres. With the radius
//! given relative to the size of the mesh, the descriptor then depends on neither unit nor scale.

mod eigen;
mod frame;
mod histogram;
mod neighborhood;
mod normals;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{Matrix, Mesh, mesh::vec3};
use frame::Frame;
use histogram::Histogram;
use neighborhood::{Grid, Neighborhood};

/// Radius of the support in the unit in which everything is computed.
const RADIUS: f64 = 9.0;

/// Neighbours closer than this to a plane of the local frame are in it: on which side they are is a matter of rounding.
const IN_PLANE: f64 = 1e-8 * RADIUS;

/// Vertices that one parallel task describes.
const TASK_VERTICES: usize = 32;

/// How [`shot`] describes the neighbourhood of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct ShotOptions {
    /// Radius of the support, relative to the square root of the mesh's area. Above 0; 0.067 by default: 9 cm on a
    /// human body, as in the paper's experiments (0.061 to 0.071 on the FAUST registrations, 0.066 in the mean).
    ///
    /// The cost grows with the square of the number of vertices within it.
    pub radius: f64,
    /// Number of intervals of the cosine; a volume has one bin more, a descriptor `32 * (bins + 1)` values.
    /// From 1 to 100; 10 by default, which gives 352 values.
    pub bins: usize,
    /// Vertices with fewer neighbours than this get a zero descriptor. At least 1; 5 by default, as in the
    /// authors' implementation.
    pub min_neighbors: usize,
}

impl Default for ShotOptions {
    fn default() -> Self {
        Self { radius: 0.067, bins: 10, min_neighbors: 5 }
    }
}

impl ShotOptions {
    /// Width of the descriptor: `32 * (bins + 1)`.
    pub fn width(&self) -> usize {
        histogram::VOLUMES * (self.bins + 1)
    }

    fn validate(&self) -> Result<(), ShotError> {
        if !(self.radius.is_finite() && self.radius > 0.0) {
            return Err(ShotError::Radius { radius: self.radius });
        }
        if !(1..=100).contains(&self.bins) {
            return Err(ShotError::Bins { bins: self.bins });
        }
        if self.min_neighbors == 0 {
            return Err(ShotError::MinNeighbors);
        }
        Ok(())
    }
}

/// What [`shot`] met on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShotInfo {
    /// Radius of the support in the unit of the mesh.
    pub radius: f64,
    /// Vertices with a zero descriptor: on no face with an area, or with too few neighbours.
    pub zero_rows: usize,
    /// Vertices where the majority that gives an axis its sign was tied, so that the secondary rules decided.
    pub tied_votes: usize,
    /// Number of neighbours of a vertex, in the mean over all vertices.
    pub mean_neighbors: f64,
    /// Largest number of neighbours of a vertex.
    pub max_neighbors: usize,
}

/// Why [`shot`] could not describe a mesh.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ShotError {
    /// The radius is not a positive number.
    #[error(
        "the SHOT radius is {radius}; it must be a positive number, relative to sqrt(area), such as 0.067"
    )]
    Radius {
        /// The radius asked for.
        radius: f64,
    },
    /// The number of bins is out of range.
    #[error("SHOT with {bins} bins was asked for; the range is 1 to 100, and 10 gives the usual 352 values")]
    Bins {
        /// The number asked for.
        bins: usize,
    },
    /// No neighbour at all would be enough.
    #[error("the least number of SHOT neighbours is 0; it must be 1 or more, and 5 is usual")]
    MinNeighbors,
    /// The radius is relative to the area, and there is none, or it overflows.
    #[error(
        "the mesh's area is {area}, so no SHOT radius can be derived from it; use a mesh with faces of finite area"
    )]
    Area {
        /// Area of the mesh, in squared units of its file.
        area: f64,
    },
}

/// SHOT descriptors of all vertices, `[n, 32 * (bins + 1)]`: `[n, 352]` by default. A row has unit l2 norm, or
/// is zero where the vertex is on no face with an area or has fewer neighbours than asked for.
///
/// Rigid motion and scaling of the mesh, and the order of its vertices, change nothing but rounding; where the
/// neighbourhood has no unique frame (a perfectly regular or symmetric one), rounding decides. Vertices on no face
/// with an area are nobody's neighbour. The result does not depend on the number of threads.
///
/// # Errors
/// If an option is out of range, or the mesh has no area, or one that is not finite.
pub fn shot(mesh: &Mesh, options: &ShotOptions) -> Result<(Matrix<f32>, ShotInfo), ShotError> {
    options.validate()?;
    let area = mesh.area();
    let radius = options.radius * area.sqrt();
    let to_unit = RADIUS / radius;
    if !(to_unit.is_finite() && to_unit > 0.0) {
        return Err(ShotError::Area { area });
    }
    let positions: Vec<_> = mesh.vertices().iter().map(|&p| vec3::scale(p, to_unit)).collect();
    let grid = Grid::new(&positions, &normals::vertex_normals(mesh), RADIUS);

    let width = options.width();
    let mut descriptors = Matrix::zeros(mesh.n_vertices(), width);
    let totals = descriptors
        .data_mut()
        .par_chunks_mut(width * TASK_VERTICES)
        .enumerate()
        .map_init(
            || Extractor::new(&grid, options),
            |extractor, (task, rows)| {
                let vertices = task * TASK_VERTICES..;
                let outcomes =
                    rows.chunks_exact_mut(width).zip(vertices).map(|(row, v)| extractor.describe(v, row));
                outcomes.fold(Totals::default(), |totals, outcome| totals.with(outcome))
            },
        )
        .reduce(Totals::default, Totals::merge);
    Ok((descriptors, totals.info(radius, mesh.n_vertices())))
}

/// Describes one vertex after the other, with buffers that are used again.
struct Extractor<'a> {
    grid: &'a Grid,
    min_neighbors: usize,
    neighborhood: Neighborhood,
    histogram: Histogram,
}

/// What became of one vertex.
struct Outcome {
    n_neighbors: usize,
    zero: bool,
    tied: bool,
}

impl<'a> Extractor<'a> {
    fn new(grid: &'a Grid, options: &ShotOptions) -> Self {
        Self {
            grid,
            min_neighbors: options.min_neighbors,
            neighborhood: Neighborhood::default(),
            histogram: Histogram::new(options.bins, RADIUS),
        }
    }

    /// Writes the descriptor of `vertex` to `row`, which is all zero.
    fn describe(&mut self, vertex: usize, row: &mut [f32]) -> Outcome {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the feature.
            return unsafe { self.describe_avx2(vertex, row) };
        }
        self.describe_portable(vertex, row)
    }

    /// The same code as [`Self::describe_portable`], which everything below is inlined into, and hence the same
    /// bits, compiled for wider registers.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn describe_avx2(&mut self, vertex: usize, row: &mut [f32]) -> Outcome {
        self.describe_portable(vertex, row)
    }

    #[inline(always)]
    fn describe_portable(&mut self, vertex: usize, row: &mut [f32]) -> Outcome {
        let neighbors = &mut self.neighborhood;
        self.grid.gather(vertex, neighbors);
        let n_neighbors = neighbors.len();
        if n_neighbors < self.min_neighbors {
            return Outcome { n_neighbors, zero: true, tied: false };
        }
        let Frame { z_axis, tied } = frame::local_frame(self.grid, neighbors);
        let filled = self.histogram.fill(self.grid, neighbors, z_axis, row);
        Outcome { n_neighbors, zero: !filled, tied }
    }
}

/// Sums over vertices; integers, so that the order of summation does not matter.
#[derive(Default)]
struct Totals {
    neighbors: u64,
    max_neighbors: usize,
    zero: usize,
    tied: usize,
}

impl Totals {
    fn with(self, outcome: Outcome) -> Self {
        self.merge(Self {
            neighbors: outcome.n_neighbors as u64,
            max_neighbors: outcome.n_neighbors,
            zero: usize::from(outcome.zero),
            tied: usize::from(outcome.tied),
        })
    }

    fn merge(self, other: Self) -> Self {
        Self {
            neighbors: self.neighbors + other.neighbors,
            max_neighbors: self.max_neighbors.max(other.max_neighbors),
            zero: self.zero + other.zero,
            tied: self.tied + other.tied,
        }
    }

    fn info(&self, radius: f64, n_vertices: usize) -> ShotInfo {
        ShotInfo {
            radius,
            zero_rows: self.zero,
            tied_votes: self.tied,
            mean_neighbors: self.neighbors as f64 / n_vertices as f64,
            max_neighbors: self.max_neighbors,
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn wider_registers_do_not_change_a_bit() {
        if !is_x86_feature_detected!("avx2") {
            crate::skip::skipped("this processor has no AVX2");
            return;
        }
        let mesh =
            shapes::transformed(&shapes::bumpy_sphere(4, 1), shapes::rotation([1.0; 3], 1.0), 20.0, [5.0; 3]);
        let grid = Grid::new(mesh.vertices(), &normals::vertex_normals(&mesh), RADIUS);
        let options = ShotOptions::default();
        let mut extractor = Extractor::new(&grid, &options);
        for vertex in 0..mesh.n_vertices() {
            let mut rows = [vec![0.0; options.width()], vec![0.0; options.width()]];
            extractor.describe_portable(vertex, &mut rows[0]);
            // SAFETY: the processor has the feature.
            unsafe { extractor.describe_avx2(vertex, &mut rows[1]) };
            assert!(rows[0].iter().any(|&x| x > 0.0));
            assert_eq!(rows[0], rows[1], "vertex {vertex}");
        }
    }
}
