//! Turns the target so that both shapes of a picture are seen from the same side.

use crate::Mesh;
use crate::mesh::MeshError;
use crate::mesh::vec3;
use crate::point_map::PointMap;

/// A rotation by quarter turns about the axes: coordinate `i` becomes `sign[i]` times coordinate `axis[i]`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct QuarterTurn {
    axis: [usize; 3],
    sign: [f64; 3],
}

type Vec3 = [f64; 3];

/// A vertex of the source and its match.
struct Match {
    weight: f64,
    source: Vec3,
    target: Vec3,
}

/// Another side than the file's must match better by this share of what would be a perfect match.
const CLEARLY: f64 = 0.05;

/// The target turned by quarter turns about the axes, so that its vertices lie in the same directions from the middle
/// as the vertices of the source that they match. Files differ in which axis is up and which is to the front. The
/// target itself, if no turn is clearly better.
pub(super) fn facing_alike(source: &Mesh, target: &Mesh, map: &PointMap) -> Result<Mesh, MeshError> {
    let turn = quarter_turn(&covariance(source, target, map));
    Mesh::new(target.vertices().iter().map(|&p| turn.apply(p)).collect(), target.faces().to_vec())
}

/// Sum over the matches of the products of coordinates, source by target, both from their means; weighted by the
/// areas of the source, as if each shape's coordinates had deviation 1.
fn covariance(source: &Mesh, target: &Mesh, map: &PointMap) -> [Vec3; 3] {
    let areas = source.vertex_areas();
    let matches: Vec<Match> = (0..map.len())
        .filter_map(|i| {
            let place = target.vertices()[map.get(i)? as usize];
            Some(Match { weight: areas[i], source: source.vertices()[i], target: place })
        })
        .collect();
    let total: f64 = matches.iter().map(|m| m.weight).sum::<f64>().max(f64::MIN_POSITIVE);
    let mean = |of: fn(&Match) -> Vec3| {
        let sum = matches.iter().fold([0.0; 3], |sum, m| vec3::add(sum, vec3::scale(of(m), m.weight)));
        vec3::scale(sum, 1.0 / total)
    };
    let middles = [mean(|m| m.source), mean(|m| m.target)];
    let mut products = [[0.0; 3]; 3];
    let mut squares = [0.0; 2];
    for Match { weight, source, target } in matches {
        let (p, q) = (vec3::sub(source, middles[0]), vec3::sub(target, middles[1]));
        squares[0] += weight * vec3::dot(p, p);
        squares[1] += weight * vec3::dot(q, q);
        for (row, x) in products.iter_mut().zip(p) {
            row.iter_mut().zip(q).for_each(|(sum, y)| *sum += weight * x * y);
        }
    }
    let scale = (squares[0] * squares[1]).sqrt().max(f64::MIN_POSITIVE);
    products.map(|row| row.map(|sum| sum / scale))
}

/// The quarter turn of the target that a covariance of source and target asks for.
fn quarter_turn(covariance: &[Vec3; 3]) -> QuarterTurn {
    let gain =
        |turn: &QuarterTurn| -> f64 { (0..3).map(|i| turn.sign[i] * covariance[i][turn.axis[i]]).sum() };
    let all = QuarterTurn::all();
    let best = all.iter().fold(all[0], |best, turn| if gain(turn) > gain(&best) { *turn } else { best });
    if gain(&best) > gain(&all[0]) + CLEARLY { best } else { all[0] }
}

impl QuarterTurn {
    /// All 24, the identity first.
    fn all() -> Vec<Self> {
        let axes = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let mut turns = Vec::new();
        for (i, axis) in axes.into_iter().enumerate() {
            let parity = if i < 3 { 1.0 } else { -1.0 };
            for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                turns.push(Self { axis, sign: [a, b, parity * a * b] });
            }
        }
        turns
    }

    fn apply(&self, p: Vec3) -> Vec3 {
        [0, 1, 2].map(|i| self.sign[i] * p[self.axis[i]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    /// An ellipsoid with a bump, so that no two of its sides are alike.
    fn lopsided() -> Mesh {
        let sphere = icosphere(2);
        let stretch =
            |p: &[f64; 3]| [3.0 * p[0] + p[1] * p[1], 2.0 * p[1] + 0.5 * p[2] * p[2], p[2] + 0.3 * p[0]];
        Mesh::new(sphere.vertices().iter().map(stretch).collect(), sphere.faces().to_vec()).unwrap()
    }

    #[test]
    fn quarter_turns_are_the_24_rotations() {
        let all = QuarterTurn::all();
        assert_eq!(all.len(), 24);
        for (i, turn) in all.iter().enumerate() {
            assert!(!all[..i].contains(turn));
            let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|p| turn.apply(p));
            assert_eq!(vec3::dot(vec3::cross(x, y), z), 1.0, "{turn:?}");
        }
        assert_eq!(all[0].apply([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn every_quarter_turn_is_undone() {
        let mesh = lopsided();
        let n = mesh.n_vertices();
        let map = PointMap::new((0..n as u32).collect(), n);
        for turn in QuarterTurn::all() {
            let vertices = mesh.vertices().iter().map(|&p| vec3::scale(turn.apply(p), 7.0)).collect();
            let turned = Mesh::new(vertices, mesh.faces().to_vec()).unwrap();
            let back = facing_alike(&mesh, &turned, &map).unwrap();
            for (p, q) in mesh.vertices().iter().zip(back.vertices()) {
                assert!(vec3::distance(vec3::scale(*p, 7.0), *q) < 1e-12, "{turn:?}");
            }
        }
    }

    /// A tilt by less than an eighth of a turn, a map onto one vertex and one without any match turn nothing.
    #[test]
    fn a_tilt_or_an_empty_map_turns_nothing() {
        let mesh = lopsided();
        let n = mesh.n_vertices();
        let (sine, cosine) = 0.5f64.sin_cos();
        let tilt = |p: &[f64; 3]| [cosine * p[0] - sine * p[1], sine * p[0] + cosine * p[1], p[2]];
        let tilted = Mesh::new(mesh.vertices().iter().map(tilt).collect(), mesh.faces().to_vec()).unwrap();
        let identity = PointMap::new((0..n as u32).collect(), n);
        let collapsed = PointMap::new(vec![3; n], n);
        let empty = PointMap::new(vec![u32::MAX; n], n);
        for map in [identity, collapsed, empty] {
            assert_eq!(facing_alike(&mesh, &tilted, &map).unwrap().vertices(), tilted.vertices());
        }
    }
}
