//! The closest points on the surface of a mesh, by a tree of boxes around its triangles.

use super::{Mesh, SurfacePoint, triangle, vec3};
use rayon::prelude::*;

type Vec3 = [f64; 3];

/// Triangles in a leaf, at most.
const LEAF: usize = 4;
/// The tree halves its triangles at each level, so that it is never deeper than this.
const DEPTH: usize = 64;

/// A mesh made ready for many queries. Building takes `O(m log m)`; a query takes `O(log m)` where the mesh is well
/// spread.
#[derive(Clone, Debug)]
pub struct ClosestPoint<'a> {
    mesh: &'a Mesh,
    /// Depth first: the first child of an inner node follows it.
    nodes: Vec<Node>,
    /// Triangles, those of a leaf together.
    faces: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Of a leaf the first place in `faces`, of an inner node the second child.
    next: u32,
    /// Number of triangles of a leaf, 0 for an inner node.
    count: u32,
}

/// For each query the closest point on the mesh, `[q]`, `None` where the mesh has no triangle. Of several triangles
/// at the same distance any may be given, but always the same.
pub fn closest_points(mesh: &Mesh, queries: &[[f64; 3]]) -> Vec<Option<SurfacePoint>> {
    let tree = ClosestPoint::new(mesh);
    queries.par_iter().map(|&query| tree.find(query)).collect()
}

/// Takes points on one mesh to another one of the same surface in the same place, such as the repaired or the
/// decimated mesh: each goes to the closest point of a triangle that faces the same way, so that none changes over to
/// skin that touches skin. `None` stays `None`, and so becomes a point that has no such triangle within `limit`
/// sqrt(area) of `from`.
///
/// Whether `to` as a whole looks the same way as `from` or was turned round is found out from the points themselves.
///
/// # Panics
/// If `from` has no such triangle as a point names.
pub fn carried_points(
    points: &[Option<SurfacePoint>],
    from: &Mesh,
    to: &Mesh,
    limit: f64,
) -> Vec<Option<SurfacePoint>> {
    let tree = ClosestPoint::new(to);
    let placed: Vec<Option<(Vec3, Vec3)>> = points
        .par_iter()
        .map(|point| point.map(|p| (p.position(from), from.face_cross(p.face as usize))))
        .collect();
    let facing = |&(position, normal): &(Vec3, Vec3)| {
        let found = tree.find(position)?;
        Some(vec3::dot(to.face_cross(found.face as usize), normal))
    };
    let agreeing: i64 = (placed.par_iter().flatten())
        .map(|placed| facing(placed).map_or(0, |dot| i64::from(dot > 0.0) - i64::from(dot < 0.0)))
        .sum();
    let turn = if agreeing < 0 { -1.0 } else { 1.0 };
    let limit = limit * from.scale();
    let carry = |&(position, normal): &(Vec3, Vec3)| {
        tree.find_facing(position, vec3::scale(normal, turn))
            .filter(|found| vec3::distance(found.position(to), position) <= limit)
    };
    placed.par_iter().map(|placed| placed.as_ref().and_then(carry)).collect()
}

impl<'a> ClosestPoint<'a> {
    /// Builds the tree.
    pub fn new(mesh: &'a Mesh) -> Self {
        let boxes: Vec<[Vec3; 2]> = (0..mesh.n_faces()).map(|f| bounds(mesh.corners(f))).collect();
        let mut faces: Vec<u32> = (0..mesh.n_faces() as u32).collect();
        let mut nodes = Vec::with_capacity(mesh.n_faces() / 2 + 1);
        if !faces.is_empty() {
            build(&boxes, &mut faces, 0, &mut nodes);
        }
        Self { mesh, nodes, faces }
    }

    /// The closest point, `None` where the mesh has no triangle.
    pub fn find(&self, query: [f64; 3]) -> Option<SurfacePoint> {
        self.search(query, |_| true)
    }

    /// The closest point on a triangle whose normal has an angle below 90 degrees to `normal`, of any length; `None`
    /// where there is none.
    pub fn find_facing(&self, query: [f64; 3], normal: [f64; 3]) -> Option<SurfacePoint> {
        self.search(query, |face| vec3::dot(self.mesh.face_cross(face as usize), normal) > 0.0)
    }

    fn search(&self, query: Vec3, allowed: impl Fn(u32) -> bool) -> Option<SurfacePoint> {
        let mut best = (f64::INFINITY, None);
        let mut stack = [(0.0, 0); DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let (distance, at) = stack[height];
            if distance >= best.0 {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                let first = node.next as usize;
                for &face in &self.faces[first..first + node.count as usize] {
                    let corners = self.mesh.corners(face as usize);
                    let weights = triangle::closest_weights(query, corners);
                    let away = vec3::sub(triangle::weighted(corners, weights), query);
                    let square = vec3::dot(away, away);
                    if square < best.0 && allowed(face) {
                        best = (square, Some(SurfacePoint { face, weights }));
                    }
                }
                continue;
            }
            let [near, far] = {
                let children = [at + 1, node.next].map(|c| (self.nodes[c as usize].distance(query), c));
                if children[0].0 <= children[1].0 { children } else { [children[1], children[0]] }
            };
            stack[height] = far;
            stack[height + 1] = near;
            height += 2;
        }
        best.1
    }
}

impl Node {
    /// Squared distance from a point to the box.
    fn distance(&self, p: Vec3) -> f64 {
        let outside = |axis: usize| (self.low[axis] - p[axis]).max(p[axis] - self.high[axis]).max(0.0);
        (0..3).map(|axis| outside(axis).powi(2)).sum()
    }
}

/// Adds the nodes of the triangles `faces`, which begin at place `first` of all.
fn build(boxes: &[[Vec3; 2]], faces: &mut [u32], first: usize, nodes: &mut Vec<Node>) {
    let whole = faces.iter().map(|&f| boxes[f as usize]).reduce(union).unwrap_or_default();
    let at = nodes.len();
    let [low, high] = whole;
    nodes.push(Node { low, high, next: first as u32, count: faces.len() as u32 });
    if faces.len() <= LEAF {
        return;
    }
    let center = |f: u32, axis: usize| boxes[f as usize][0][axis] + boxes[f as usize][1][axis];
    let spread = |axis: usize| {
        let centers = faces.iter().map(|&f| center(f, axis));
        let (low, high) =
            centers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
        high - low
    };
    let spreads = [spread(0), spread(1), spread(2)];
    let axis = (0..3).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0);
    let middle = faces.len() / 2;
    faces
        .select_nth_unstable_by(middle, |&a, &b| center(a, axis).total_cmp(&center(b, axis)).then(a.cmp(&b)));
    let (left, right) = faces.split_at_mut(middle);
    build(boxes, left, first, nodes);
    nodes[at].next = nodes.len() as u32;
    nodes[at].count = 0;
    build(boxes, right, first + middle, nodes);
}

fn bounds([a, b, c]: [Vec3; 3]) -> [Vec3; 2] {
    [union([a, a], [b, b]), [c, c]].into_iter().reduce(union).unwrap_or_default()
}

fn union([low, high]: [Vec3; 2], [other_low, other_high]: [Vec3; 2]) -> [Vec3; 2] {
    [[0, 1, 2].map(|i| low[i].min(other_low[i])), [0, 1, 2].map(|i| high[i].max(other_high[i]))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{bumpy_sphere, icosphere, joined, permuted, rotation, transformed, zoo};
    use crate::mesh::{DecimateOptions, decimate, vertices_on_surface};

    const STRAIGHT: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// Points in and around the box of a mesh, some on its vertices.
    fn queries(mesh: &Mesh) -> Vec<Vec3> {
        let turn = rotation([1.0, 2.0, 0.5], 1.0);
        let around = mesh.vertices().iter().enumerate().map(|(i, p)| {
            vec3::scale(turn.map(|row| vec3::dot(row, *p)), 0.2 + 1.7 * (i % 17) as f64 / 17.0)
        });
        around.chain(mesh.vertices().iter().copied().step_by(3)).collect()
    }

    fn brute_force(mesh: &Mesh, query: Vec3, allowed: impl Fn(usize) -> bool) -> f64 {
        let distances = (0..mesh.n_faces()).filter(|&f| allowed(f)).map(|f| {
            let weights = triangle::closest_weights(query, mesh.corners(f));
            vec3::distance(query, triangle::weighted(mesh.corners(f), weights))
        });
        distances.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        let large = bumpy_sphere(4, 3);
        for (name, mesh) in zoo().into_iter().chain([("large", large)]) {
            let queries = queries(&mesh);
            let found = closest_points(&mesh, &queries);
            for (&query, point) in queries.iter().zip(found) {
                let point = point.unwrap();
                let distance = vec3::distance(query, point.position(&mesh));
                assert_eq!(distance, brute_force(&mesh, query, |_| true), "{name}: {query:?}");
            }
        }
    }

    #[test]
    fn triangles_that_face_the_other_way_are_passed_over() {
        let mesh = bumpy_sphere(3, 2);
        let tree = ClosestPoint::new(&mesh);
        for &query in &queries(&mesh) {
            let normal = [query[1], -query[2], 0.3];
            let facing = |f: usize| vec3::dot(mesh.face_cross(f), normal) > 0.0;
            let point = tree.find_facing(query, normal).unwrap();
            assert!(facing(point.face as usize));
            assert_eq!(
                vec3::distance(query, point.position(&mesh)),
                brute_force(&mesh, query, facing),
                "{query:?}"
            );
        }
        assert_eq!(ClosestPoint::new(&mesh).find_facing([0.0; 3], [0.0; 3]), None);
        assert_eq!(closest_points(&Mesh::default(), &[[0.0; 3]]), [None]);
    }

    #[test]
    fn points_are_carried_to_the_same_skin() {
        // Two balls that nearly touch: the closest point of the one may be on the other.
        let ball = icosphere(4);
        let pair = joined(&[&ball, &transformed(&ball, STRAIGHT, 1.0, [2.02, 0.0, 0.0])]);
        let coarse = decimate(&pair, 400, &DecimateOptions::default()).unwrap().mesh;
        let (shuffled, _) = permuted(&coarse, 3);
        let turned = Mesh::new(
            shuffled.vertices().to_vec(),
            shuffled.faces().iter().map(|&[a, b, c]| [a, c, b]).collect(),
        );
        let points = vertices_on_surface(&pair);
        for to in [&coarse, &shuffled, &turned.unwrap()] {
            let carried = carried_points(&points, &pair, to, 0.05);
            for (i, point) in carried.iter().enumerate() {
                let position = point.unwrap().position(to);
                assert!(vec3::distance(position, pair.vertices()[i]) < 0.06);
                let left = i < ball.n_vertices();
                assert_eq!(position[0] < 1.01, left, "point {i} at {position:?}");
            }
        }
        // The right ball is missing: its points have nowhere to go.
        let carried = carried_points(&points, &pair, &ball, 0.02);
        let (left, right) = carried.split_at(ball.n_vertices());
        assert!(left.iter().all(Option::is_some) && right.iter().all(Option::is_none));
    }
}
