//! Connectivity of a triangle mesh as geodesics need it: what lies across an edge, and directions at a vertex.
//!
//! Side `h = 3 f + i` is the edge of face `f` opposite its corner `i`, seen from inside `f`; it runs from corner
//! `i + 1` to corner `i + 2`. No consistent orientation is assumed: unfolding a face over an edge and the angle
//! between two directions at a vertex need none.

use std::f64::consts::PI;

use crate::mesh::{Mesh, repeated_faces, vec3};

/// How the faces around a vertex hang together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fan {
    /// One closed ring of faces with this total angle; directions are angles modulo it.
    Closed(f64),
    /// One open strip of faces with this total angle: a vertex of the boundary.
    Open(f64),
    /// Anything else (non-manifold, isolated): directions have no order.
    Irregular,
}

impl Fan {
    /// Total angle, 1 where directions have no meaning.
    pub(super) fn total_angle(self) -> f64 {
        match self {
            Fan::Closed(total) | Fan::Open(total) => total,
            Fan::Irregular => 1.0,
        }
    }

    /// Whether a shortest path can bend at such a vertex.
    pub(super) fn bends_paths(self) -> bool {
        match self {
            Fan::Closed(total) => total > 2.0 * PI,
            Fan::Open(total) => total > PI,
            Fan::Irregular => true,
        }
    }
}

/// One corner of a face, in the fan of its vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Corner {
    /// Direction of the edge the corner starts with.
    start: f64,
    /// Angle of the corner.
    angle: f64,
    /// Whether the corner starts with the edge to corner `i + 2` rather than `i + 1`.
    reversed: bool,
}

/// Position of the apex of a side relative to it, in units of its length, measured from its first end.
#[derive(Clone, Copy, Debug, Default)]
struct Apex {
    along: f64,
    height: f64,
}

/// A mesh with its sides glued and its vertex fans laid out.
pub(super) struct Surface {
    faces: Vec<[u32; 3]>,
    /// Next side of the same edge, in a ring: itself at a boundary, the twin where two faces meet.
    next_at_edge: Vec<u32>,
    lengths: Vec<f64>,
    apexes: Vec<Apex>,
    corners: Vec<Corner>,
    fans: Vec<Fan>,
    corners_of: Vec<Vec<u32>>,
    /// Edges of faces that name a vertex twice: (end, end, length).
    loose_edges: Vec<(u32, u32, f64)>,
}

impl Surface {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let (faces, loose_edges) = split_collapsed_faces(mesh);
        let mut surface = Self {
            next_at_edge: glue_sides(&faces),
            lengths: vec![0.0; 3 * faces.len()],
            apexes: vec![Apex::default(); 3 * faces.len()],
            corners: vec![Corner::default(); 3 * faces.len()],
            fans: vec![Fan::Irregular; mesh.n_vertices()],
            corners_of: vec![Vec::new(); mesh.n_vertices()],
            faces,
            loose_edges,
        };
        surface.measure(mesh);
        for v in 0..mesh.n_vertices() as u32 {
            surface.lay_out_fan(v);
        }
        for &(a, b, _) in &surface.loose_edges {
            surface.fans[a as usize] = Fan::Irregular;
            surface.fans[b as usize] = Fan::Irregular;
        }
        surface
    }

    pub(super) fn n_vertices(&self) -> usize {
        self.fans.len()
    }

    /// Number of sides, three a face.
    pub(super) fn n_sides(&self) -> u32 {
        3 * self.faces.len() as u32
    }

    /// Vertex at the given corner, `3 f + i`.
    pub(super) fn vertex(&self, corner: u32) -> u32 {
        self.faces[corner as usize / 3][corner as usize % 3]
    }

    /// First and second end of a side.
    pub(super) fn ends(&self, side: u32) -> [u32; 2] {
        let face = self.faces[side as usize / 3];
        let i = side as usize % 3;
        [face[(i + 1) % 3], face[(i + 2) % 3]]
    }

    pub(super) fn length(&self, side: u32) -> f64 {
        self.lengths[side as usize]
    }

    /// The other sides of the same edge: none at a boundary, several where the edge is non-manifold.
    pub(super) fn across(&self, side: u32) -> impl Iterator<Item = u32> + '_ {
        std::iter::successors(Some(self.next_at_edge[side as usize]), |&h| {
            Some(self.next_at_edge[h as usize])
        })
        .take_while(move |&h| h != side)
    }

    /// Apex of the side as (fraction along the side from `first`, height), both in units of its length.
    pub(super) fn apex(&self, side: u32, from_second: bool) -> (f64, f64) {
        let apex = self.apexes[side as usize];
        (if from_second { 1.0 - apex.along } else { apex.along }, apex.height)
    }

    pub(super) fn fan(&self, vertex: u32) -> Fan {
        self.fans[vertex as usize]
    }

    pub(super) fn corners_of(&self, vertex: u32) -> &[u32] {
        &self.corners_of[vertex as usize]
    }

    pub(super) fn loose_edges(&self) -> &[(u32, u32, f64)] {
        &self.loose_edges
    }

    /// Start direction and angle of a corner, and the two sides that bound it in the order of the fan.
    pub(super) fn corner(&self, corner: u32) -> (f64, f64, [u32; 2]) {
        let Corner { start, angle, reversed } = self.corners[corner as usize];
        // The edge to corner i + 1 is the side opposite corner i + 2.
        let [to_next, to_previous] = [rotate(corner, 2), rotate(corner, 1)];
        (start, angle, if reversed { [to_previous, to_next] } else { [to_next, to_previous] })
    }

    /// Direction at the corner's vertex that is `angle` away from the edge to `neighbor`, within the corner.
    pub(super) fn direction(&self, corner: u32, neighbor: u32, angle: f64) -> f64 {
        let Corner { start, angle: total, reversed } = self.corners[corner as usize];
        let starts_at = self.vertex(rotate(corner, if reversed { 2 } else { 1 }));
        if starts_at == neighbor { start + angle } else { start + total - angle }
    }

    fn measure(&mut self, mesh: &Mesh) {
        for side in 0..3 * self.faces.len() as u32 {
            let apex = mesh.vertices()[self.vertex(side) as usize];
            let [p, q] = self.ends(side).map(|v| mesh.vertices()[v as usize]);
            let (edge, to_apex) = (vec3::sub(q, p), vec3::sub(apex, p));
            let squared = vec3::dot(edge, edge);
            let twice_area = vec3::norm(vec3::cross(edge, to_apex));
            let h = side as usize;
            self.lengths[h] = squared.sqrt();
            if squared > 0.0 {
                self.apexes[h] =
                    Apex { along: vec3::dot(edge, to_apex) / squared, height: twice_area / squared };
            }
            let (to_p, to_q) = (vec3::sub(p, apex), vec3::sub(q, apex));
            self.corners[h].angle = twice_area.atan2(vec3::dot(to_p, to_q));
            let v = self.vertex(side) as usize;
            self.corners_of[v].push(side);
        }
    }

    /// Walks from face to face around `vertex` and accumulates the directions of its edges.
    fn lay_out_fan(&mut self, vertex: u32) {
        let corners = std::mem::take(&mut self.corners_of[vertex as usize]);
        self.fans[vertex as usize] = self.walk_fan(vertex, &corners);
        self.corners_of[vertex as usize] = corners;
    }

    fn walk_fan(&mut self, vertex: u32, corners: &[u32]) -> Fan {
        let is_boundary = |s: &Self, side: u32| s.next_at_edge[side as usize] == side;
        // (corner, side through which the walk enters it)
        let entries = |&c: &u32| [(c, rotate(c, 1)), (c, rotate(c, 2))];
        let Some(&first) = corners.first() else { return Fan::Irregular };
        let (start, entry) = corners
            .iter()
            .flat_map(entries)
            .find(|&(_, side)| is_boundary(self, side))
            .unwrap_or((first, rotate(first, 2)));

        let (mut corner, mut entry, mut total) = (start, entry, 0.0);
        for visited in 1..=corners.len() {
            let reversed = entry == rotate(corner, 1);
            let slot = &mut self.corners[corner as usize];
            (slot.start, slot.reversed) = (total, reversed);
            total += slot.angle;
            let exit = rotate(corner, if reversed { 2 } else { 1 });
            let next = self.next_at_edge[exit as usize];
            let closes = next == exit || self.next_at_edge[next as usize] != exit;
            if closes {
                let is_strip = next == exit && visited == corners.len();
                return if is_strip && total > 0.0 { Fan::Open(total) } else { Fan::Irregular };
            }
            // Of the next face, the corner at this vertex is one of the two ends of the side just crossed.
            let candidate = rotate(next, 1);
            corner = if self.vertex(candidate) == vertex { candidate } else { rotate(next, 2) };
            entry = next;
            if corner == start {
                let is_ring = visited == corners.len() && total > 0.0;
                return if is_ring { Fan::Closed(total) } else { Fan::Irregular };
            }
        }
        Fan::Irregular
    }
}

/// Index `3 f + (i + by) mod 3` for `corner = 3 f + i`.
pub(super) fn rotate(corner: u32, by: u32) -> u32 {
    corner - corner % 3 + (corner % 3 + by) % 3
}

type LooseEdge = (u32, u32, f64);

fn split_collapsed_faces(mesh: &Mesh) -> (Vec<[u32; 3]>, Vec<LooseEdge>) {
    let is_proper = |f: &[u32; 3]| f[0] != f[1] && f[1] != f[2] && f[2] != f[0];
    let (proper, collapsed): (Vec<_>, Vec<_>) = mesh.faces().iter().copied().partition(is_proper);
    let proper = without_copies(proper);
    let loose = collapsed
        .iter()
        .flat_map(|f| [(f[0], f[1]), (f[1], f[2])])
        .filter(|(a, b)| a != b)
        .map(|(a, b)| (a, b, vec3::distance(mesh.vertices()[a as usize], mesh.vertices()[b as usize])))
        .collect();
    (proper, loose)
}

/// The first of all faces with the same vertices: the others change no distance, and at each a search would double
/// its lines.
fn without_copies(faces: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    let keyed: Vec<(u32, [u32; 3])> = (0..).zip(faces.iter().copied()).collect();
    let copies = repeated_faces(&keyed);
    keyed.into_iter().filter(|(f, _)| copies.binary_search(f).is_err()).map(|(_, face)| face).collect()
}

/// Links the sides of every edge in a ring.
fn glue_sides(faces: &[[u32; 3]]) -> Vec<u32> {
    let mut keyed: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * faces.len());
    for (f, face) in faces.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (face[(i + 1) % 3], face[(i + 2) % 3]);
            keyed.push(([a.min(b), a.max(b)], (3 * f + i) as u32));
        }
    }
    keyed.sort_unstable();
    let mut next = vec![0; keyed.len()];
    for ring in keyed.chunk_by(|x, y| x.0 == y.0) {
        for (i, &(_, side)) in ring.iter().enumerate() {
            next[side as usize] = ring[(i + 1) % ring.len()].1;
        }
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesic::zoo;

    #[test]
    fn total_angle_of_cube_grid_and_book() {
        let cube = Surface::new(&zoo::cube(2));
        let right_angle = PI / 2.0;
        assert!(matches!(cube.fan(0), Fan::Closed(t) if (t - 3.0 * right_angle).abs() < 1e-12));
        let grid = Surface::new(&zoo::grid(3, 3));
        assert!(matches!(grid.fan(4), Fan::Closed(t) if (t - 2.0 * PI).abs() < 1e-12));
        assert!(matches!(grid.fan(0), Fan::Open(t) if (t - right_angle).abs() < 1e-12));
        let book = Surface::new(&zoo::book());
        assert_eq!(book.fan(0), Fan::Irregular);
        assert_eq!(book.across(2).count(), 2);
    }

    #[test]
    fn directions_do_not_depend_on_the_orientation_of_faces() {
        let grid = zoo::grid(3, 3);
        let mut faces = grid.faces().to_vec();
        for face in faces.iter_mut().step_by(2) {
            face.swap(1, 2);
        }
        let flipped = Surface::new(&Mesh::new(grid.vertices().to_vec(), faces).unwrap());
        assert!(matches!(flipped.fan(4), Fan::Closed(t) if (t - 2.0 * PI).abs() < 1e-12));
    }
}
