//! The geodesic error of a point map (Kim, Lipman and Funkhouser 2011, "Blended intrinsic maps").

use super::{ErrorSummary, EvalError, GroundTruth, check_size};
use crate::geodesic::GeodesicSolver;
use crate::mesh::{Mesh, SurfacePoint, vec3, vertices_on_surface};
use crate::point_map::PointMap;

/// Normalised geodesic error `d_Y(y, y*) / sqrt(area(Y))` of each correct match `(x, y*)` of the ground truth, in its
/// order, where the map sends `x` to `y`.
///
/// `solver` and `area`, in squared units, belong to the target mesh. The error is NaN where the map leaves `x`
/// unmatched; [`ErrorSummary`] and [`ErrorCurve`](super::ErrorCurve) say how they count these. Vertices at one place
/// are one vertex, so a match on a duplicate of the right vertex is exact. Where `y` and `y*` are on different
/// components, no path leads from one to the other, and the straight line through space counts.
///
/// # Errors
/// If the map, the ground truth and the solver are not for the same meshes, or the map names a vertex that does not
/// exist.
pub fn geodesic_errors(
    map: &PointMap,
    ground_truth: &GroundTruth,
    solver: &GeodesicSolver,
    area: f64,
) -> Result<Vec<f32>, EvalError> {
    check_size("the map", map.len(), "the source of the ground truth", ground_truth.n_source())?;
    check_size("the target of the map", map.n_target, "the target mesh", solver.n_vertices())?;
    check_size(
        "the target of the ground truth",
        ground_truth.n_target(),
        "the target mesh",
        solver.n_vertices(),
    )?;
    let n_vertices = solver.n_vertices();
    if let Some(index) = map.iter().flatten().find(|&y| y as usize >= n_vertices) {
        return Err(EvalError::IndexOutOfRange { what: "the map", side: "target", index, n_vertices });
    }
    let matches = || ground_truth.pairs().iter().map(|&(x, y_true)| (map.get(x as usize), y_true));
    let found: Vec<(u32, u32)> = matches().filter_map(|(y, y_true)| Some((y?, y_true))).collect();
    let mut distances = solver.pair_distances(&found).into_iter();
    let scale = area.sqrt();
    let error = |distance: f32| (f64::from(distance) / scale) as f32;
    Ok(matches().map(|(y, _)| y.and_then(|_| distances.next()).map_or(f32::NAN, error)).collect())
}

/// As [`geodesic_errors`], of the points on the target's surface that the map and the ground truth name; where one
/// knows vertices only, of these.
///
/// Within a triangle the distance is the straight line; else it is the mean over the corners of both by their
/// weights, which overrates short distances by less than an edge. `mesh` is the target.
///
/// # Errors
/// As [`geodesic_errors`], and if a point names a triangle that does not exist.
pub fn surface_errors(
    map: &PointMap,
    ground_truth: &GroundTruth,
    mesh: &Mesh,
    solver: &GeodesicSolver,
) -> Result<Vec<f32>, EvalError> {
    check_size("the map", map.len(), "the source of the ground truth", ground_truth.n_source())?;
    check_size("the target of the map", map.n_target, "the target mesh", mesh.n_vertices())?;
    let beyond = |point: &&SurfacePoint| point.face as usize >= mesh.n_faces();
    if let Some(point) = map.points.iter().flatten().flatten().find(beyond) {
        let (index, n_vertices) = (point.face, mesh.n_faces());
        return Err(EvalError::IndexOutOfRange {
            what: "a point of the map",
            side: "face of the target",
            index,
            n_vertices,
        });
    }
    let vertices = vertices_on_surface(mesh);
    let found = |x: u32| match &map.points {
        Some(points) => points[x as usize],
        None => map.get(x as usize).and_then(|y| vertices[y as usize]),
    };
    let right = |i: usize, y: u32| match ground_truth.points() {
        Some(points) => Some(points[i]),
        None => vertices[y as usize],
    };
    let measured: Vec<Option<Between>> = ground_truth
        .pairs()
        .iter()
        .enumerate()
        .map(|(i, &(x, y))| Some(Between::new(found(x)?, right(i, y)?, mesh)))
        .collect();
    let asked: Vec<(u32, u32)> = measured.iter().flatten().flat_map(|between| between.pairs()).collect();
    let mut distances = solver.pair_distances(&asked).into_iter();
    let unit = mesh.scale();
    let error = |between: &Option<Between>| match between {
        None => f32::NAN,
        Some(between) => (between.distance(&mut distances) / unit) as f32,
    };
    Ok(measured.iter().map(error).collect())
}

/// The distance of two points on a mesh, given those of vertices.
enum Between {
    Straight(f64),
    /// Pairs of corners and the weight of each.
    ByCorners(Vec<((u32, u32), f64)>),
}

impl Between {
    fn new(a: SurfacePoint, b: SurfacePoint, mesh: &Mesh) -> Self {
        let corners = |point: SurfacePoint| -> Vec<(u32, f64)> {
            let corners = mesh.faces()[point.face as usize];
            corners.into_iter().zip(point.weights).filter(|(_, w)| *w > 0.0).collect()
        };
        let (from, to) = (corners(a), corners(b));
        let within = |corners: &[(u32, f64)], face: u32| {
            corners.iter().all(|(v, _)| mesh.faces()[face as usize].contains(v))
        };
        if within(&from, b.face) || within(&to, a.face) {
            return Self::Straight(vec3::distance(a.position(mesh), b.position(mesh)));
        }
        let pairs = from.iter().flat_map(|&(v, p)| to.iter().map(move |&(w, q)| ((v, w), p * q)));
        Self::ByCorners(pairs.collect())
    }

    fn pairs(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let pairs: &[((u32, u32), f64)] = match self {
            Self::Straight(_) => &[],
            Self::ByCorners(pairs) => pairs,
        };
        pairs.iter().map(|(pair, _)| *pair)
    }

    /// Takes the distances of its pairs from the front of all.
    fn distance(&self, distances: &mut impl Iterator<Item = f32>) -> f64 {
        match self {
            Self::Straight(distance) => *distance,
            Self::ByCorners(pairs) => {
                pairs.iter().zip(distances).map(|((_, weight), d)| weight * f64::from(d)).sum()
            }
        }
    }
}

/// The errors under the better of two ground truths.
#[derive(Clone, Debug, PartialEq)]
pub struct SymmetricErrors {
    /// Errors under the better one, in the order of its pairs.
    pub errors: Vec<f32>,
    /// Whether that is the mirrored one.
    pub is_mirrored: bool,
}

/// Errors of a map between shapes with a symmetry, for which the mirrored map is as good: those under whichever of the
/// two ground truths has the smaller mean error, chosen once for the whole map.
///
/// # Errors
/// As [`geodesic_errors`].
pub fn symmetric_geodesic_errors(
    map: &PointMap,
    ground_truth: &GroundTruth,
    mirrored: &GroundTruth,
    solver: &GeodesicSolver,
    area: f64,
) -> Result<SymmetricErrors, EvalError> {
    let direct = geodesic_errors(map, ground_truth, solver, area)?;
    let flipped = geodesic_errors(map, mirrored, solver, area)?;
    let mean = |errors: &[f32]| ErrorSummary::new(errors, area).mean;
    // Without any match the mean is NaN, which is no better than a number.
    let is_mirrored = mean(&flipped).total_cmp(&mean(&direct)).is_lt();
    Ok(SymmetricErrors { errors: if is_mirrored { flipped } else { direct }, is_mirrored })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesic::GeodesicOptions;

    /// Two unit squares side by side, and a triangle apart: vertices 0-5 and 6-8.
    fn target() -> (GeodesicSolver, f64) {
        let mut vertices: Vec<[f64; 3]> = (0..6).map(|i| [f64::from(i % 3), f64::from(i / 3), 0.0]).collect();
        vertices.extend([[9.0, 0.0, 0.0], [11.0, 0.0, 0.0], [9.0, 2.0, 0.0]]);
        let faces = vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [6, 7, 8]];
        let mesh = Mesh::new(vertices, faces).unwrap();
        (GeodesicSolver::new(&mesh, &GeodesicOptions::default()), mesh.area())
    }

    #[test]
    fn points_on_the_surface_are_measured_on_it() {
        let vertices = (0..6).map(|i| [f64::from(i % 3), f64::from(i / 3), 0.0]).collect();
        let mesh = Mesh::new(vertices, vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]).unwrap();
        let solver = GeodesicSolver::new(&mesh, &GeodesicOptions::default());
        let unit = 2f64.sqrt();
        let middle = SurfacePoint { face: 0, weights: [0.5, 0.5, 0.0] };
        let far = SurfacePoint { face: 2, weights: [0.0, 1.0, 0.0] };
        let truth = GroundTruth::of_points(&[Some(middle), Some(middle), None, Some(far)], &mesh);
        assert_eq!(truth.pairs(), [(0, 0), (1, 0), (3, 2)]);
        let points = vec![Some(middle), Some(SurfacePoint::at_corner(0, 1)), Some(far), Some(middle)];
        let map = PointMap { points: Some(points), ..PointMap::new(vec![0, 1, 2, 0], 6) };
        let errors = surface_errors(&map, &truth, &mesh, &solver).unwrap();
        for (error, expected) in errors.iter().zip([0.0, 0.5, 1.5]) {
            assert!((f64::from(*error) * unit - expected).abs() < 1e-6, "{errors:?}");
        }
        // By its vertices the same map is half an edge off.
        let coarse = PointMap { points: None, ..map.clone() };
        let errors = surface_errors(&coarse, &truth, &mesh, &solver).unwrap();
        assert!((f64::from(errors[0]) * unit - 0.5).abs() < 1e-6);
        let beyond = PointMap { points: Some(vec![Some(SurfacePoint::at_corner(4, 0)); 4]), ..map };
        assert!(surface_errors(&beyond, &truth, &mesh, &solver).is_err());
    }

    #[test]
    fn errors_are_distances_over_root_area() {
        let (solver, area) = target();
        assert_eq!(area, 4.0);
        let map = PointMap::new(vec![0, 2, 5, PointMap::UNMATCHED, 6], 9);
        let truth = GroundTruth::new(vec![(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (2, 5)], 5, 9).unwrap();
        let errors = geodesic_errors(&map, &truth, &solver, area).unwrap();
        assert_eq!(errors[..2], [0.0, 1.0]);
        assert!((f64::from(errors[2]) - 5f64.sqrt() / 2.0).abs() < 1e-6);
        // Vertex 6 is on the triangle apart, 9 from vertex 0 through space.
        assert!(errors[3].is_nan() && errors[4] == 4.5);
        assert_eq!(errors[5], 0.0);
    }

    /// The same square twice, as two meshes in one file, and as triangles that share no vertex.
    #[test]
    fn duplicates_of_a_vertex_are_that_vertex() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let soup = [0, 1, 2, 0, 2, 3].map(|v: usize| square[v]).to_vec();
        let mesh = Mesh::new(soup, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let solver = GeodesicSolver::new(&mesh, &GeodesicOptions::default());
        let map = PointMap::new(vec![3, 1, 4, 0, 2, 1], 6);
        let errors = geodesic_errors(&map, &GroundTruth::identity(6), &solver, 1.0).unwrap();
        assert_eq!(errors[..5], [0.0; 5]);
        assert!((errors[5] - 2f32.sqrt()).abs() < 1e-6, "through both triangles: {}", errors[5]);
    }

    #[test]
    fn sizes_and_indices_are_checked() {
        let (solver, area) = target();
        let truth = GroundTruth::identity(9);
        let errors = |targets, n| geodesic_errors(&PointMap::new(targets, n), &truth, &solver, area);
        assert!(matches!(errors(vec![0; 8], 9), Err(EvalError::SizeMismatch { found: 8, .. })));
        assert!(matches!(errors(vec![0; 9], 8), Err(EvalError::SizeMismatch { found: 8, .. })));
        assert!(matches!(errors(vec![9; 9], 9), Err(EvalError::IndexOutOfRange { index: 9, .. })));
    }

    #[test]
    fn mirrored_map_is_as_good() {
        let (solver, area) = target();
        let direct = GroundTruth::new((0..6).map(|i| (i, i)).collect(), 6, 9).unwrap();
        let mirrored =
            GroundTruth::new((0..6).map(|i| (i, 3 * (i / 3) + 2 - i % 3)).collect(), 6, 9).unwrap();
        let mut map = mirrored.to_map();
        map.targets[0] = PointMap::UNMATCHED;
        let best = symmetric_geodesic_errors(&map, &direct, &mirrored, &solver, area).unwrap();
        assert!(best.is_mirrored && best.errors[0].is_nan());
        assert_eq!(best.errors[1..], [0.0; 5]);
        let best = symmetric_geodesic_errors(&direct.to_map(), &direct, &mirrored, &solver, area).unwrap();
        assert!(!best.is_mirrored);
    }
}
