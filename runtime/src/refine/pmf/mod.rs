//! The product manifold filter (Vestner, Litman, Rodolà, Bronstein and Cremers 2017; Vestner et al. 2017, "Efficient
//! deformable shape correspondence via kernel matching").
//!
//! A map is a set of points `(x, T(x))` of the product of both shapes. The filter estimates their density with a
//! kernel on each shape, `sum_x' K_source(x, x') K_target(T(x'), y)`, and takes the assignment of vertices to
//! vertices that is densest in sum, a linear assignment problem; then again, with narrower kernels. Wrong matches
//! that do not agree with their surroundings vanish, and the map becomes smooth and injective.
//!
//! With `K_target` the heat kernel, `K_target(y, y') = b(y) . b(y')`, `b(y) = exp(-t Lambda / 2) psi(y)`, the density
//! is the inner product of `b(y)` with the average of `b(T(x'))` by `K_source`; for a bijection, maximising it is
//! minimising the squared distance between the two, which is what is done here. That makes two things possible that a
//! dense payoff matrix does not: only the targets nearest to the average take part in the assignment, so that no
//! multiscale scheme is needed; and the last rounds can average by an affine fit in the tangent plane instead of a
//! positive kernel, which is not drawn towards densely sampled or shrunk regions and leaves a correct map as it is.
//!
//! Where the meshes are given and turn out to be triangulated alike, the map follows the triangulation in the end.

mod assignment;
mod auction;
mod neighborhood;
mod smooth;
#[cfg(test)]
mod tests;
mod triangulation;

use super::{RefineError, Refined, check_bases};
use crate::fmap::functional_map_of;
use crate::point_map::{PointMap, cosines, transport};
use crate::spectral::Eigenbasis;
use crate::{Matrix, Mesh};
use assignment::{Assigner, DescriptorTerm};
use neighborhood::Neighborhoods;
use smooth::LocalCharts;
use triangulation::carried_on;

/// Options of [`pmf`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PmfOptions {
    /// Diffusion time of the source's heat kernel in the first round, relative to the area. Above 0, default 3e-3: a
    /// kernel as wide as a body's trunk. Wide kernels straighten a map that is wrong by smooth shifts.
    pub time_start: f64,
    /// Diffusion time in the last round with a heat kernel, and that of the embeddings `b` in which neighbours are
    /// looked for and the rounds without one compare. Above 0, at most `time_start`; default 3e-4.
    pub time_end: f64,
    /// Rounds with a heat kernel, of the same time on both shapes, the times in even steps of their logarithm. Range
    /// 0 and up, 1 and up without `local_rounds`; default 6.
    pub heat_rounds: usize,
    /// Rounds that average by an affine fit to the nearest vertices. Range 0 and up, default 3.
    pub local_rounds: usize,
    /// Vertices in an affine fit in the first of these rounds. Range 4 and up, default 20.
    pub neighbors_start: usize,
    /// Vertices in an affine fit in the last of these rounds. Range 4 to `neighbors_start`, default 10.
    pub neighbors_end: usize,
    /// Targets that a source vertex can be assigned to besides its present match: those nearest to where its
    /// surroundings go. Range 1 and up, default 128; wide kernels need many.
    pub candidates: usize,
    /// Weight of the descriptors, where there are any: that of the squared distance that is usual between the
    /// descriptors of neighbours, against one squared distance between neighbours. Range 0 and up, default 0.5.
    pub descriptor_weight: f64,
    /// Where the meshes are given: they are taken to be triangulated alike, as registrations of one template are, if
    /// the map can be carried on from triangle to triangle so that at least this share of the source's edges goes to
    /// edges. That map then is the result, exact whatever the shapes; it comes from the triangulation and says
    /// nothing about the filter. Range 0 to 1, default 0.95.
    pub alike: f64,
    /// The source is a part of the target, in one unit: times are then relative to the area of the target for both.
    /// Default false: to the area of each.
    pub part: bool,
}

impl Default for PmfOptions {
    fn default() -> Self {
        Self {
            time_start: 3e-3,
            time_end: 3e-4,
            heat_rounds: 6,
            local_rounds: 3,
            neighbors_start: 20,
            neighbors_end: 10,
            candidates: 128,
            descriptor_weight: 0.5,
            alike: 0.95,
            part: false,
        }
    }
}

/// What [`pmf`] may know of the shapes besides their bases; source first.
#[derive(Clone, Copy, Debug, Default)]
pub struct PmfHints<'a> {
    /// Pointwise descriptors, `[n_source, d]` and `[n_target, d]`.
    pub descriptors: Option<[&'a Matrix<f32>; 2]>,
    /// The meshes, of `n_source` and `n_target` vertices.
    pub meshes: Option<[&'a Mesh; 2]>,
}

/// What [`pmf`] did.
#[derive(Clone, Debug, PartialEq)]
pub struct PmfInfo {
    /// The share of source vertices whose match changed in each round.
    pub changed: Vec<f64>,
    /// Vertices without a match after the last round, as no candidate was left for them or a triangulation that was
    /// followed does not reach them. They got what was free (source no larger than the target), or the nearest
    /// target, taken or not (source larger).
    pub left_over: usize,
    /// The share of the source's edges that go to edges of the target, where the map follows a triangulation that
    /// both meshes have; `None` where they have none in common, or are not given.
    pub edges_kept: Option<f64>,
}

/// Refines a point map by the product manifold filter.
///
/// Where the source has no more vertices than the target the result is injective, hence a bijection where they have
/// equally many. A larger source has the target's vertices assigned to its own instead, and its others go to the
/// nearest target, taken or not. Source vertices without a match in `map` have one afterwards. The confidence is the
/// cosine of the angle between `b(T(x))` and the last round's average around `x`.
///
/// Needs a map that is right on the whole, such as ZoomOut's: the filter is local. 200 eigenfunctions are enough for
/// shapes of 7000 vertices.
///
/// # Errors
/// If an option is out of range, a basis has no eigenfunctions, descriptors or meshes are not those of the shapes,
/// the map does not fit the bases or it matches nothing.
pub fn pmf(
    map: &PointMap,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    hints: PmfHints,
    options: &PmfOptions,
) -> Result<Refined<PmfInfo>, RefineError> {
    check(options)?;
    check_bases(basis_source, basis_target)?;
    check_hints(hints, basis_source.n(), basis_target.n())?;
    // Checks the point map.
    functional_map_of(map, &basis_source.truncated(1), &basis_target.truncated(1))?;
    if map.targets.iter().all(|&target| target == PointMap::UNMATCHED) {
        return Err(RefineError::NothingMatched);
    }
    let areas = [if options.part { basis_target.area() } else { basis_source.area() }, basis_target.area()];
    let source = Embedding::new(basis_source, options.time_end * areas[0], options.neighbors_start);
    let target = Embedding::new(basis_target, options.time_end * areas[1], options.candidates);
    let term = || {
        hints.descriptors.map(|d| DescriptorTerm::new(d, &target.neighborhoods, options.descriptor_weight))
    };
    let around = &source.neighborhoods;
    let mut filter =
        Filter { targets: map.targets.clone(), averages: Matrix::default(), changed: Vec::new() };
    for time in log_steps(options.time_start, options.time_end, options.heat_rounds) {
        filter.averages = heat_average(&filter.targets, basis_source, basis_target, time * areas[0])?;
        let blurred = scaled(&basis_target.eigenvectors, &decay(basis_target, time * areas[1]));
        filter.assign(&Assigner::new(&blurred, &target.neighborhoods, options.candidates, term()), around);
    }
    let assigner = Assigner::new(&target.rows, &target.neighborhoods, options.candidates, term());
    let (first, last) = (options.neighbors_start as f64, options.neighbors_end as f64);
    for size in log_steps(first, last, options.local_rounds) {
        let charts = LocalCharts::new(&source.rows, around, size.round() as usize);
        filter.averages = charts.average(&target.rows, &filter.targets, PointMap::UNMATCHED);
        filter.assign(&assigner, around);
    }
    let carried = hints.meshes.map(|meshes| carried_on(meshes, &filter.targets));
    let carried = carried.filter(|&(_, share)| share >= options.alike);
    let edges_kept = carried.as_ref().map(|carried| carried.1);
    filter.targets = carried.map_or(filter.targets, |carried| carried.0);
    let left_over = filter.complete(&assigner, around);
    let confidence = Some(cosines(&filter.averages, &target.rows, &filter.targets));
    let map = PointMap { confidence, ..PointMap::new(filter.targets, basis_target.n()) };
    let functional_map = functional_map_of(&map, basis_source, basis_target)?;
    Ok(Refined { map, functional_map, info: PmfInfo { changed: filter.changed, left_over, edges_kept } })
}

/// A shape in the coordinates in which heat kernels are inner products.
struct Embedding {
    /// `b(x) = exp(-t Lambda / 2) phi(x)`, `[n, k]`.
    rows: Matrix,
    neighborhoods: Neighborhoods,
}

impl Embedding {
    fn new(basis: &Eigenbasis, time: f64, neighbors: usize) -> Self {
        let rows = scaled(&basis.eigenvectors, &decay(basis, 0.5 * time));
        let neighborhoods = Neighborhoods::new(&rows, neighbors);
        Self { rows, neighborhoods }
    }
}

/// The map between rounds.
struct Filter {
    targets: Vec<u32>,
    /// The average around each source vertex of `b(T(x'))`, in rounds with a heat kernel of `psi(T(x'))`,
    /// `[n_source, k_target]`.
    averages: Matrix,
    changed: Vec<f64>,
}

impl Filter {
    fn assign(&mut self, assigner: &Assigner, around: &Neighborhoods) {
        let targets = assigner.assign(&self.averages, around, &self.targets);
        let changed = targets.iter().zip(&self.targets).filter(|(new, old)| new != old).count();
        self.changed.push(changed as f64 / targets.len() as f64);
        self.targets = targets;
    }

    /// Matches what is left without; returns how many those were.
    fn complete(&mut self, assigner: &Assigner, around: &Neighborhoods) -> usize {
        let left_over = self.targets.iter().filter(|&&target| target == PointMap::UNMATCHED).count();
        if assigner.is_injective(self.targets.len()) {
            assigner.fill(&self.averages, &mut self.targets);
        } else {
            assigner.complete(&self.averages, around, &mut self.targets);
        }
        left_over
    }
}

/// The average of `psi(T(x'))` around each `x` by the source's heat kernel, over the vertices that have a match,
/// `[n_source, k_target]`.
fn heat_average(
    targets: &[u32],
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    time: f64,
) -> Result<Matrix, RefineError> {
    let map = PointMap::new(targets.to_vec(), basis_target.n());
    let c = functional_map_of(&map, basis_source, basis_target)?;
    let heat = decay(basis_source, time);
    let mut averages = transport(&basis_source.eigenvectors, &scaled(&c, &heat));
    let is_matched = |x: usize, _| if targets[x] == PointMap::UNMATCHED { 0.0 } else { 1.0 };
    let matched = basis_source.project(&Matrix::from_fn(basis_source.n(), 1, is_matched));
    let share = transport(&basis_source.eigenvectors, &scaled(&matched.transposed(), &heat));
    for x in 0..averages.rows() {
        // A vertex far from every match has nothing to average.
        let share = share[(x, 0)].max(0.05);
        averages.row_mut(x).iter_mut().for_each(|a| *a /= share);
    }
    Ok(averages)
}

/// The matrix with column `j` times `factors[j]`.
fn scaled(matrix: &Matrix, factors: &[f64]) -> Matrix {
    Matrix::from_fn(matrix.rows(), matrix.cols(), |i, j| matrix[(i, j)] * factors[j])
}

/// `exp(-t lambda)` of each eigenvalue.
fn decay(basis: &Eigenbasis, time: f64) -> Vec<f64> {
    basis.eigenvalues.iter().map(|lambda| (-time * lambda).exp()).collect()
}

/// `count` numbers from `from` to `to` in even steps of the logarithm; only `to`, if it is one.
fn log_steps(from: f64, to: f64, count: usize) -> Vec<f64> {
    let at = |i: usize| (i + 1) as f64 / count as f64;
    let ratio = to / from;
    if count < 2 {
        return vec![to; count];
    }
    (0..count).map(|i| from * ratio.powf((at(i) - at(0)) / (1.0 - at(0)))).collect()
}

fn check_hints(hints: PmfHints, n_source: usize, n_target: usize) -> Result<(), RefineError> {
    if let Some([source, target]) = hints.meshes
        && (source.n_vertices(), target.n_vertices()) != (n_source, n_target)
    {
        let found = [source.n_vertices(), target.n_vertices()];
        return Err(RefineError::Meshes { found, n_source, n_target });
    }
    let Some([source, target]) = hints.descriptors else { return Ok(()) };
    if source.rows() != n_source || target.rows() != n_target || source.cols() != target.cols() {
        let found = [source.rows(), source.cols(), target.rows(), target.cols()];
        return Err(RefineError::Descriptors { found, n_source, n_target });
    }
    Ok(())
}

fn check(options: &PmfOptions) -> Result<(), RefineError> {
    let bad = |option, value: f64, range: String| Err(RefineError::RealOption { option, value, range });
    if !(options.time_end > 0.0 && options.time_end.is_finite()) {
        return bad("time_end", options.time_end, "above 0".into());
    }
    if !(options.time_start >= options.time_end && options.time_start.is_finite()) {
        return bad("time_start", options.time_start, format!("at least time_end, {}", options.time_end));
    }
    if !(options.descriptor_weight >= 0.0 && options.descriptor_weight.is_finite()) {
        return bad("descriptor_weight", options.descriptor_weight, "0 or more".into());
    }
    if !(0.0..=1.0).contains(&options.alike) {
        return bad("alike", options.alike, "from 0 to 1".into());
    }
    let sizes = [
        ("neighbors_end", options.neighbors_end, 4),
        ("neighbors_start", options.neighbors_start, options.neighbors_end),
        ("candidates", options.candidates, 1),
        ("heat_rounds", options.heat_rounds, usize::from(options.local_rounds == 0)),
    ];
    for (option, value, least) in sizes {
        if value < least {
            return Err(RefineError::Option { option, value, range: format!("at least {least}") });
        }
    }
    Ok(())
}
