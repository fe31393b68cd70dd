//! Which matches are right.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::EvalError;
use crate::Mesh;
use crate::io::{path_from_bytes, read_point_map, read_surface_points};
use crate::mesh::{SurfacePoint, vec3, vertices_on_surface};
use crate::point_map::PointMap;

/// Correct matches between a source and a target, as pairs of 0-based vertices.
///
/// Source vertices may be missing (they are left out of every figure) and may occur more than once, as in the
/// remeshed datasets, where several vertices of the common template fall on one vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundTruth {
    pairs: Vec<(u32, u32)>,
    /// The right point on the target's surface of each pair, whose target vertex then is the corner of largest weight.
    points: Option<Vec<SurfacePoint>>,
    n_source: usize,
    n_target: usize,
}

/// Where a [`GroundTruth`] comes from: what `--ground-truth` takes.
#[derive(Clone, Debug, PartialEq)]
pub enum GroundTruthSource {
    /// `identity`: vertex i corresponds with vertex i.
    Identity,
    /// `identity:N`: the first N vertices correspond, vertex i with vertex i.
    FirstVertices(usize),
    /// `FILE`: a map file from source to target, or points on the target's surface, one for each source vertex
    /// (`.corr`, `.baryc_gt`).
    Map(PathBuf),
    /// `A,B`: two lists; line i of A (a source vertex) corresponds with line i of B (a target vertex). Where one has
    /// points on a surface (`.corr`), each source point counts at its nearest vertex, and of several at one vertex
    /// the nearest.
    Lists(PathBuf, PathBuf),
}

impl FromStr for GroundTruthSource {
    type Err = EvalError;

    fn from_str(text: &str) -> Result<Self, EvalError> {
        let bad = || EvalError::BadGroundTruth(text.into());
        if text == "identity" {
            return Ok(Self::Identity);
        }
        if let Some(count) = text.strip_prefix("identity:") {
            return count.parse().map(Self::FirstVertices).map_err(|_| bad());
        }
        match text.split(',').collect::<Vec<_>>()[..] {
            [file] if !file.is_empty() => Ok(Self::Map(file.into())),
            [source, target] if !source.is_empty() && !target.is_empty() => {
                Ok(Self::Lists(source.into(), target.into()))
            }
            _ => Err(bad()),
        }
    }
}

impl GroundTruthSource {
    /// As [`str::parse`], of a text that may hold names of files which are no Unicode. A file that is called so is a
    /// map, whatever commas are in its name.
    ///
    /// # Errors
    /// As [`str::parse`].
    pub fn from_os_str(text: &OsStr) -> Result<Self, EvalError> {
        if Path::new(text).is_file() {
            return Ok(Self::Map(text.into()));
        }
        if let Some(text) = text.to_str() {
            return text.parse();
        }
        let parts: Vec<PathBuf> =
            text.as_encoded_bytes().split(|&b| b == b',').map(path_from_bytes).collect();
        match <[PathBuf; 2]>::try_from(parts) {
            Ok([source, target]) => Ok(Self::Lists(source, target)),
            Err(parts) if parts.len() == 1 => Ok(Self::Map(text.into())),
            Err(_) => Err(EvalError::BadGroundTruth(text.to_string_lossy().into_owned())),
        }
    }

    /// The correct matches between two meshes.
    ///
    /// # Errors
    /// If a file cannot be read, or what it says does not fit the meshes.
    pub fn load(&self, source: &Mesh, target: &Mesh) -> Result<GroundTruth, EvalError> {
        match self {
            Self::Map(file) if holds_points(file) => {
                let points = read_surface_points(file, target.n_faces())?;
                super::check_size("the ground truth", points.len(), "the source", source.n_vertices())?;
                Ok(GroundTruth::of_points(&points, target))
            }
            Self::Lists(of_source, of_target) if holds_points(of_source) || holds_points(of_target) => {
                let from = read_points(of_source, source)?;
                let to = read_points(of_target, target)?;
                check_lists([of_source, of_target], [from.len(), to.len()])?;
                Ok(GroundTruth::of_points(&at_nearest_vertices(&from, &to, source), target))
            }
            _ => self.load_vertices(source.n_vertices(), target.n_vertices()),
        }
    }

    fn load_vertices(&self, n_source: usize, n_target: usize) -> Result<GroundTruth, EvalError> {
        match self {
            Self::Identity if n_source != n_target => Err(EvalError::NoIdentity { n_source, n_target }),
            Self::Identity => GroundTruth::first_vertices(n_source, n_source, n_target),
            Self::FirstVertices(count) => GroundTruth::first_vertices(*count, n_source, n_target),
            Self::Map(file) => {
                let map = read_point_map(file, Some(n_target))?;
                super::check_size("the ground truth map", map.len(), "the source", n_source)?;
                GroundTruth::from_map(&map)
            }
            Self::Lists(source_file, target_file) => {
                let source = read_point_map(source_file, Some(n_source))?;
                let target = read_point_map(target_file, Some(n_target))?;
                check_lists([source_file, target_file], [source.len(), target.len()])?;
                let pairs = source.iter().zip(target.iter()).filter_map(|(s, t)| Some((s?, t?)));
                GroundTruth::new(pairs.collect(), n_source, n_target)
            }
        }
    }
}

/// The points of a mesh that a file lists, by triangles or by vertices; a vertex of no face is none.
fn read_points(file: &Path, mesh: &Mesh) -> Result<Vec<Option<SurfacePoint>>, EvalError> {
    if holds_points(file) {
        return Ok(read_surface_points(file, mesh.n_faces())?);
    }
    let vertices = read_point_map(file, Some(mesh.n_vertices()))?;
    let on_surface = vertices_on_surface(mesh);
    Ok(vertices.iter().map(|vertex| on_surface[vertex? as usize]).collect())
}

fn check_lists([source, target]: [&PathBuf; 2], [n_source, n_target]: [usize; 2]) -> Result<(), EvalError> {
    if n_source == n_target {
        return Ok(());
    }
    let (source_file, target_file) = (source.display().to_string(), target.display().to_string());
    Err(EvalError::ListMismatch { source_file, n_source, target_file, n_target })
}

/// For every vertex of `mesh` the point of `to` whose fellow in `from` lies nearest to it, among those that lie
/// nearest to no other vertex.
fn at_nearest_vertices(
    from: &[Option<SurfacePoint>],
    to: &[Option<SurfacePoint>],
    mesh: &Mesh,
) -> Vec<Option<SurfacePoint>> {
    let mut at_vertex = vec![None; mesh.n_vertices()];
    let mut distances = vec![f64::INFINITY; mesh.n_vertices()];
    for (point, fellow) in from.iter().zip(to) {
        let (Some(point), Some(fellow)) = (point, fellow) else { continue };
        let vertex = point.nearest_vertex(mesh) as usize;
        let distance = vec3::distance(point.position(mesh), mesh.vertices()[vertex]);
        if distance < distances[vertex] {
            (distances[vertex], at_vertex[vertex]) = (distance, Some(*fellow));
        }
    }
    at_vertex
}

/// Whether a file is a list of points on a surface.
fn holds_points(file: &Path) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case("corr") || e.eq_ignore_ascii_case("baryc_gt"))
}

impl GroundTruth {
    /// Correct matches as (source vertex, target vertex).
    ///
    /// # Errors
    /// If a vertex does not exist.
    pub fn new(pairs: Vec<(u32, u32)>, n_source: usize, n_target: usize) -> Result<Self, EvalError> {
        let what = "the ground truth";
        for &(source, target) in &pairs {
            for (side, index, n_vertices) in [("source", source, n_source), ("target", target, n_target)] {
                if index as usize >= n_vertices {
                    return Err(EvalError::IndexOutOfRange { what, side, index, n_vertices });
                }
            }
        }
        Ok(Self { pairs, points: None, n_source, n_target })
    }

    /// Source vertex i corresponds with point i on the target, where there is one.
    ///
    /// # Panics
    /// If the target has no such triangle.
    pub fn of_points(points: &[Option<SurfacePoint>], target: &Mesh) -> Self {
        let known = || points.iter().enumerate().filter_map(|(x, point)| Some((x as u32, (*point)?)));
        Self {
            pairs: known().map(|(x, point)| (x, point.nearest_vertex(target))).collect(),
            points: Some(known().map(|(_, point)| point).collect()),
            n_source: points.len(),
            n_target: target.n_vertices(),
        }
    }

    /// The right points on the target's surface, one for each of [`GroundTruth::pairs`], where they are known finer
    /// than a vertex.
    pub fn points(&self) -> Option<&[SurfacePoint]> {
        self.points.as_deref()
    }

    /// Vertex i corresponds with vertex i, for all `n` vertices of both meshes.
    pub fn identity(n: usize) -> Self {
        Self { pairs: (0..n as u32).map(|i| (i, i)).collect(), points: None, n_source: n, n_target: n }
    }

    /// The correct matches that a point map states.
    ///
    /// # Errors
    /// If the map names a target vertex that does not exist.
    pub fn from_map(map: &PointMap) -> Result<Self, EvalError> {
        let pairs = map.iter().enumerate().filter_map(|(s, t)| Some((s as u32, t?)));
        Self::new(pairs.collect(), map.len(), map.n_target)
    }

    fn first_vertices(count: usize, n_source: usize, n_target: usize) -> Result<Self, EvalError> {
        // One beyond the smaller mesh is enough to be told what is wrong.
        let count = count.min(n_source.min(n_target) + 1) as u32;
        Self::new((0..count).map(|i| (i, i)).collect(), n_source, n_target)
    }

    /// The correct matches, (source vertex, target vertex).
    pub fn pairs(&self) -> &[(u32, u32)] {
        &self.pairs
    }

    /// Number of source vertices.
    pub fn n_source(&self) -> usize {
        self.n_source
    }

    /// Number of target vertices.
    pub fn n_target(&self) -> usize {
        self.n_target
    }

    /// As a point map; of several targets of one source vertex it has the last.
    pub fn to_map(&self) -> PointMap {
        let mut targets = vec![PointMap::UNMATCHED; self.n_source];
        for &(source, target) in &self.pairs {
            targets[source as usize] = target;
        }
        PointMap::new(targets, self.n_target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<GroundTruthSource, EvalError> {
        text.parse()
    }

    #[test]
    fn text_says_where_from() {
        assert_eq!(parse("identity").unwrap(), GroundTruthSource::Identity);
        assert_eq!(parse("identity:7").unwrap(), GroundTruthSource::FirstVertices(7));
        assert_eq!(parse("a/map.txt").unwrap(), GroundTruthSource::Map("a/map.txt".into()));
        assert_eq!(parse("a.vts,b.vts").unwrap(), GroundTruthSource::Lists("a.vts".into(), "b.vts".into()));
        for bad in ["", "a,", ",b", "a,b,c", "identity:x"] {
            assert!(matches!(parse(bad), Err(EvalError::BadGroundTruth(_))), "{bad}");
        }
    }

    #[test]
    fn identity_needs_one_size() {
        assert_eq!(GroundTruthSource::Identity.load_vertices(3, 3).unwrap(), GroundTruth::identity(3));
        assert!(matches!(GroundTruthSource::Identity.load_vertices(3, 4), Err(EvalError::NoIdentity { .. })));
        assert_eq!(
            GroundTruthSource::FirstVertices(2).load_vertices(3, 4).unwrap().pairs(),
            &[(0, 0), (1, 1)]
        );
        assert!(matches!(
            GroundTruthSource::FirstVertices(4).load_vertices(3, 4),
            Err(EvalError::IndexOutOfRange { side: "source", index: 3, .. })
        ));
    }

    #[test]
    fn points_on_both_surfaces_count_at_the_nearest_vertex_of_the_source() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = crate::mesh::shapes::icosphere(0);
        let [a, b, c] = mesh.faces()[0];
        let corners = [2, 5].map(|face: usize| mesh.faces()[face]);
        let file = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).unwrap();
            folder.path().join(name)
        };
        // Two points near the first corner, the second nearer; one near the second; one that the target lacks.
        let source = file("a.corr", "1 0.8 0.2 0\n1 0.9 0.1 0\n1 0.1 0.9 0\n1 0 0 1\n");
        let target = file("b.corr", "3 1 0 0\n3 0.2 0.8 0\n6 0 0 1\n-1\n");
        let lists =
            |target: &PathBuf| GroundTruthSource::Lists(source.clone(), target.clone()).load(&mesh, &mesh);
        let truth = lists(&target).unwrap();
        let mut expected = vec![(a, corners[0][1]), (b, corners[1][2])];
        expected.sort_unstable();
        assert_eq!(truth.pairs(), expected);
        assert!(truth.points().unwrap().iter().any(|point| point.weights[1] == 0.8));
        assert!(truth.pairs().iter().all(|pair| pair.0 != c));
        // Vertices of the target instead, counted from 1.
        let vertices = file("b.vts", &format!("{}\n{}\n{}\n0\n", b + 1, c + 1, a + 1));
        let mut expected = vec![(a, c), (b, a)];
        expected.sort_unstable();
        assert_eq!(lists(&vertices).unwrap().pairs(), expected);
        let short = file("c.corr", "3 1 0 0\n");
        assert!(matches!(lists(&short), Err(EvalError::ListMismatch { n_source: 4, n_target: 1, .. })));
    }

    #[test]
    fn lists_and_maps_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).unwrap();
            folder.path().join(name)
        };
        let (a, b) = (file("a.vts", "3\n1\n3\n"), file("b.vts", "1\n2\n2\n"));
        let lists = GroundTruthSource::Lists(a.clone(), b).load_vertices(3, 2).unwrap();
        assert_eq!(lists.pairs(), &[(2, 0), (0, 1), (2, 1)]);
        assert_eq!(lists.to_map().targets, [1, PointMap::UNMATCHED, 1]);
        let short = file("c.vts", "1\n");
        assert!(matches!(
            GroundTruthSource::Lists(a, short).load_vertices(3, 2),
            Err(EvalError::ListMismatch { n_source: 3, n_target: 1, .. })
        ));
        let map = GroundTruthSource::Map(file("map.txt", "1\n-1\n0\n"));
        assert_eq!(map.load_vertices(3, 2).unwrap().pairs(), &[(0, 1), (2, 0)]);
        assert!(matches!(
            map.load_vertices(4, 2),
            Err(EvalError::SizeMismatch { found: 3, expected: 4, .. })
        ));
    }
}
