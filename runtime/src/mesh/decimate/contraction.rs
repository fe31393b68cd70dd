//! The contractions themselves: in passes, each the cheapest of all edges that do not touch.

use super::DecimateOptions;
use super::quadric::Quadric;
use crate::mesh::{Mesh, NONE, Topology, vec3};
use rayon::prelude::*;

/// Weight of the planes that hold a boundary edge in place, against the faces around it.
const BOUNDARY_WEIGHT: f64 = 10.0;

/// What a contraction may do to the faces around the vertex that goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Least cosine of the angle by which a face may turn.
    turn: f64,
    /// Least height of a face, relative to its longest side, unless it was lower before.
    height: f64,
}

impl Limits {
    /// From what makes good triangles to whatever reaches the target.
    pub(super) const LEVELS: [Self; 3] = [
        Self { turn: 0.5, height: 0.1 },
        Self { turn: 0.0, height: 0.01 },
        Self { turn: -1.0, height: 1e-4 },
    ];
}

/// A contraction: cost as the bits of a non-negative f32 (which order like the number), the vertex that goes, the one
/// that stays.
type Candidate = (u32, u32, u32);

/// A mesh in the course of decimation.
pub(super) struct Contraction {
    /// Positions relative to the centroid and the square root of the area.
    positions: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    /// The faces around each vertex, none for a vertex that is gone.
    around: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    on_boundary: Vec<bool>,
    lock_boundary: bool,
    remaining: usize,
    ring: Ring,
}

impl Contraction {
    pub(super) fn new(mesh: &Mesh, topology: &Topology, options: &DecimateOptions) -> Self {
        let positions = normalized(mesh);
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); mesh.n_vertices()];
        for half_edge in (0..3 * mesh.n_faces() as u32).filter(|&h| topology.edge_of(h) != NONE) {
            around[topology.ends(half_edge)[0] as usize].push(half_edge / 3);
        }
        let mut on_boundary = vec![false; mesh.n_vertices()];
        for edge in topology.boundary_edges() {
            topology.edges()[edge as usize].iter().for_each(|&v| on_boundary[v as usize] = true);
        }
        Self {
            quadrics: quadrics(&positions, mesh.faces(), topology, options.evenness),
            remaining: around.iter().filter(|faces| !faces.is_empty()).count(),
            positions,
            faces: mesh.faces().to_vec(),
            around,
            on_boundary,
            lock_boundary: options.lock_boundary,
            ring: Ring { marks: vec![0; mesh.n_vertices()], tick: 0 },
        }
    }

    /// Contracts until `target` vertices are left or hardly an edge remains that may be contracted.
    pub(super) fn run(&mut self, target: usize, limits: Limits) {
        while self.remaining > target {
            let before = self.remaining;
            self.pass(target, limits);
            if before - self.remaining <= (before - target) / 200 {
                return;
            }
        }
    }

    /// One pass over all edges by cost. The costs of edges at a vertex that took part in a contraction are out of
    /// date, so these wait for the next pass; and so do the dear ones, so that the order is nearly that of a queue.
    fn pass(&mut self, target: usize, limits: Limits) {
        let mut candidates = self.candidates();
        candidates.sort_unstable();
        let wanted = (self.remaining - target).min(self.remaining / 2);
        let Some(&(dear, ..)) = candidates.get(wanted).or(candidates.last()) else { return };
        let enough = self.remaining - wanted.div_ceil(10);
        let mut touched = vec![false; self.positions.len()];
        for (cost, from, to) in candidates {
            if self.remaining <= target || (cost > dear && self.remaining <= enough) {
                return;
            }
            if touched[from as usize] || touched[to as usize] {
                continue;
            }
            let (from, to) = if self.may_contract(from, to, limits) {
                (from, to)
            } else if self.cost(to, from).is_some_and(|cost| cost <= dear)
                && self.may_contract(to, from, limits)
            {
                (to, from)
            } else {
                continue;
            };
            self.contract(from, to);
            touched[from as usize] = true;
            touched[to as usize] = true;
        }
    }

    /// The faces that are left, in their old order.
    pub(super) fn into_faces(self) -> Vec<[u32; 3]> {
        let around = &self.around;
        let alive = |(f, face): &(usize, [u32; 3])| around[face[0] as usize].contains(&(*f as u32));
        self.faces.iter().copied().enumerate().filter(alive).map(|(_, face)| face).collect()
    }

    /// Every edge in its cheaper direction.
    fn candidates(&self) -> Vec<Candidate> {
        let of_chunk = |vertices: std::ops::Range<usize>| {
            let mut candidates = Vec::with_capacity(3 * vertices.len());
            let mut neighbors: Vec<u32> = Vec::new();
            for v in vertices.map(|v| v as u32) {
                neighbors.clear();
                for &x in self.around[v as usize].iter().flat_map(|&f| &self.faces[f as usize]) {
                    if x > v && !neighbors.contains(&x) {
                        neighbors.push(x);
                        candidates.extend(self.cheaper(v, x));
                    }
                }
            }
            candidates
        };
        let n = self.positions.len();
        let starts: Vec<usize> = (0..n).step_by(4096).collect();
        let chunks: Vec<_> = starts.par_iter().map(|&s| of_chunk(s..n.min(s + 4096))).collect();
        chunks.concat()
    }

    fn cheaper(&self, i: u32, j: u32) -> Option<Candidate> {
        let there = self.cost(i, j).map(|cost| (cost, i, j));
        let back = self.cost(j, i).map(|cost| (cost, j, i));
        there.into_iter().chain(back).min()
    }

    /// Cost of contracting `from` into `to`; none where the boundary forbids it.
    fn cost(&self, from: u32, to: u32) -> Option<u32> {
        let position = self.positions[to as usize];
        let error = self.quadrics[from as usize].at(position) + self.quadrics[to as usize].at(position);
        self.boundary_allows(from, to).then(|| (error.max(0.0) as f32).to_bits())
    }

    fn boundary_allows(&self, from: u32, to: u32) -> bool {
        !self.on_boundary[from as usize] || (self.on_boundary[to as usize] && !self.lock_boundary)
    }

    fn may_contract(&mut self, from: u32, to: u32, limits: Limits) -> bool {
        !self.around[from as usize].is_empty()
            && !self.around[to as usize].is_empty()
            && self.keeps_topology(from, to)
            && self.keeps_shape(from, to, limits)
    }

    /// The link condition: the ends of the edge have no neighbour in common but the apexes of the edge's faces, and no
    /// two triangles would become one. On a boundary it holds with a point outside joined to all its edges.
    fn keeps_topology(&mut self, from: u32, to: u32) -> bool {
        let mut apexes = [0; 2];
        let mut n_apexes = 0;
        self.ring.start();
        for &f in &self.around[from as usize] {
            let face = self.faces[f as usize];
            face.iter().for_each(|&x| {
                self.ring.mark(x);
            });
            if face.contains(&to) {
                let Some(slot) = apexes.get_mut(n_apexes) else { return false };
                *slot = apex(face, from, to);
                n_apexes += 1;
            }
        }
        if n_apexes == 0
            || (n_apexes == 2 && self.on_boundary[from as usize] && self.on_boundary[to as usize])
        {
            return false;
        }
        let around = &self.around[to as usize];
        let mut common = [NONE; 2];
        let mut n_common = 0;
        for &f in around {
            for x in self.faces[f as usize] {
                if x != from && x != to && self.ring.has(x) && !common.contains(&x) {
                    let Some(slot) = common.get_mut(n_common) else { return false };
                    *slot = x;
                    n_common += 1;
                }
            }
        }
        let folds = match n_apexes {
            // A lone triangle.
            1 => self.around[from as usize].len() == 1 && self.n_shared_faces(to, apexes[0]) == 1,
            // A tetrahedron.
            _ => {
                around.iter().any(|&f| apexes.iter().all(|a| self.faces[f as usize].contains(a))) && {
                    self.around[from as usize]
                        .iter()
                        .any(|&f| apexes.iter().all(|a| self.faces[f as usize].contains(a)))
                }
            }
        };
        n_common == n_apexes && !folds
    }

    fn n_shared_faces(&self, i: u32, j: u32) -> usize {
        self.around[i as usize].iter().filter(|&&f| self.faces[f as usize].contains(&j)).count()
    }

    /// Whether the faces that stay turn and flatten within the limits.
    fn keeps_shape(&self, from: u32, to: u32, limits: Limits) -> bool {
        let stay =
            self.around[from as usize].iter().map(|&f| self.faces[f as usize]).filter(|f| !f.contains(&to));
        stay.into_iter().all(|face| {
            let before = Triangle::new(face.map(|i| self.positions[i as usize]));
            let after = Triangle::new(face.map(|i| self.positions[if i == from { to } else { i } as usize]));
            let turn = vec3::dot(before.cross, after.cross);
            turn >= limits.turn * vec3::norm(before.cross) * vec3::norm(after.cross)
                && after.height >= limits.height.min(before.height)
        })
    }

    fn contract(&mut self, from: u32, to: u32) {
        for f in std::mem::take(&mut self.around[from as usize]) {
            let face = self.faces[f as usize];
            if face.contains(&to) {
                for x in [to, apex(face, from, to)] {
                    self.around[x as usize].retain(|&g| g != f);
                }
            } else {
                self.faces[f as usize] = face.map(|i| if i == from { to } else { i });
                self.around[to as usize].push(f);
            }
        }
        let quadric = self.quadrics[from as usize];
        self.quadrics[to as usize].add(&quadric);
        self.remaining -= 1;
    }
}

/// A set of vertices that is emptied at no cost.
struct Ring {
    marks: Vec<u32>,
    tick: u32,
}

impl Ring {
    fn start(&mut self) {
        self.tick = self.tick.wrapping_add(1);
        if self.tick == 0 {
            self.marks.fill(0);
            self.tick = 1;
        }
    }

    /// Adds a vertex; false if it is there already.
    fn mark(&mut self, v: u32) -> bool {
        std::mem::replace(&mut self.marks[v as usize], self.tick) != self.tick
    }

    fn has(&self, v: u32) -> bool {
        self.marks[v as usize] == self.tick
    }
}

struct Triangle {
    cross: [f64; 3],
    /// Height on the longest side, relative to that side.
    height: f64,
}

impl Triangle {
    fn new([a, b, c]: [[f64; 3]; 3]) -> Self {
        let (ab, ac, bc) = (vec3::sub(b, a), vec3::sub(c, a), vec3::sub(c, b));
        let cross = vec3::cross(ab, ac);
        let longest = vec3::dot(ab, ab).max(vec3::dot(ac, ac)).max(vec3::dot(bc, bc));
        Self { cross, height: if longest > 0.0 { vec3::norm(cross) / longest } else { 0.0 } }
    }
}

fn apex(face: [u32; 3], i: u32, j: u32) -> u32 {
    face.into_iter().find(|&x| x != i && x != j).expect("a proper face has a third corner")
}

/// Positions relative to the mean vertex and the square root of the area.
fn normalized(mesh: &Mesh) -> Vec<[f64; 3]> {
    let sum = mesh.vertices().iter().fold([0.0; 3], |sum, &p| vec3::add(sum, p));
    let center = vec3::scale(sum, 1.0 / mesh.n_vertices() as f64);
    let scale = 1.0 / mesh.scale();
    mesh.vertices().iter().map(|&p| vec3::scale(vec3::sub(p, center), scale)).collect()
}

/// For every vertex the planes of its faces, weighted by a third of the area, those of its boundary edges and itself.
fn quadrics(positions: &[[f64; 3]], faces: &[[u32; 3]], topology: &Topology, evenness: f64) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); positions.len()];
    let mut areas = vec![0.0; positions.len()];
    for (f, face) in faces.iter().enumerate() {
        let corners = face.map(|i| positions[i as usize]);
        let cross = vec3::cross(vec3::sub(corners[1], corners[0]), vec3::sub(corners[2], corners[0]));
        let twice_area = vec3::norm(cross);
        if twice_area == 0.0 || topology.edge_of(3 * f as u32) == NONE {
            continue;
        }
        let normal = vec3::scale(cross, 1.0 / twice_area);
        let plane = Quadric::of_plane(normal, corners[0], twice_area / 6.0);
        for (k, &i) in face.iter().enumerate() {
            quadrics[i as usize].add(&plane);
            areas[i as usize] += twice_area / 6.0;
            if topology.n_faces_of(topology.edge_of((3 * f + k) as u32) as usize) == 1 {
                let along = vec3::sub(corners[(k + 1) % 3], corners[k]);
                let length = vec3::norm(along);
                let outward = vec3::scale(vec3::cross(along, normal), 1.0 / length);
                let wall = Quadric::of_plane(outward, corners[k], BOUNDARY_WEIGHT * length * length);
                quadrics[i as usize].add(&wall);
                quadrics[face[(k + 1) % 3] as usize].add(&wall);
            }
        }
    }
    for ((quadric, &position), area) in quadrics.iter_mut().zip(positions).zip(areas) {
        quadric.add(&Quadric::of_point(position, evenness * area));
    }
    quadrics
}
