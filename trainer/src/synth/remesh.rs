//! Independent triangulations of one dense surface: half-edge collapses (Hoppe 1996; quadrics of Garland and Heckbert
//! 1997) keep a subset of its vertices, then flips make the triangles Delaunay where the surface is flat.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rand::Rng;

use fmnet::mesh::vec3;

use super::flip::delaunay_flips;
use super::math::{Vec3, unit};
use super::random::{normal, permutation, uniform};

/// A triangulation of part of a dense surface's vertices.
pub(super) struct Remeshed {
    /// For each vertex the dense vertex it is, in random order.
    pub(super) dense: Vec<u32>,
    pub(super) faces: Vec<[u32; 3]>,
}

/// Reduces a closed dense mesh to `target` vertices, or to as few as its topology and `keep` allow; `keep[i]` says
/// that dense vertex `i` must stay. Where the other vertices are, and their density, is random.
pub(super) fn remesh(
    points: &[Vec3],
    faces: &[[u32; 3]],
    keep: &[bool],
    target: usize,
    rng: &mut impl Rng,
) -> Remeshed {
    let mut collapser = Collapser::new(points, faces, keep, target, rng);
    collapser.run(target);
    let order = permutation(rng, points.len());
    let dense: Vec<u32> = order.into_iter().filter(|&i| !collapser.rings[i as usize].is_empty()).collect();
    let mut place = vec![u32::MAX; points.len()];
    for (new, &old) in dense.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    let kept: Vec<[u32; 3]> = collapser.faces.iter().filter(|face| face[0] != GONE).copied().collect();
    let shuffled =
        permutation(rng, kept.len()).into_iter().map(|f| kept[f as usize].map(|i| place[i as usize]));
    let mut faces: Vec<[u32; 3]> = shuffled.collect();
    let positions: Vec<Vec3> = dense.iter().map(|&i| points[i as usize]).collect();
    delaunay_flips(&positions, &mut faces);
    for face in &mut faces {
        face.rotate_left(rng.random_range(0..3));
    }
    Remeshed { dense, faces }
}

/// Collapses that make a triangle thinner than this, and than the triangles there were, are refused. Thinness is 1 for
/// an equilateral triangle.
const THINNEST: f64 = 6.0;
/// A triangle thinner than this is a sliver, which a fold of the skin may leave.
const SLIVER: f64 = 8.0;
/// Marks a face that was collapsed.
const GONE: u32 = u32::MAX;

struct Collapser<'a> {
    points: &'a [Vec3],
    keep: &'a [bool],
    faces: Vec<[u32; 3]>,
    /// Faces around each vertex; empty once the vertex is gone.
    rings: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// Wanted edge length at each vertex.
    sizes: Vec<f64>,
    /// Squared distance to the surface that doubles the cost of a collapse.
    tolerance: f64,
    /// Vertices whose cost in the queue is out of date. Costs mostly grow, so it is corrected when its turn comes.
    dirty: Vec<bool>,
    /// Cost, vertex, and the neighbour it is moved onto.
    queue: BinaryHeap<Reverse<(u64, u32, u32)>>,
    alive: usize,
}

impl<'a> Collapser<'a> {
    fn new(
        points: &'a [Vec3],
        faces: &[[u32; 3]],
        keep: &'a [bool],
        target: usize,
        rng: &mut impl Rng,
    ) -> Self {
        let mut rings = vec![Vec::with_capacity(8); points.len()];
        let mut quadrics = vec![Quadric::default(); points.len()];
        let mut area = 0.0;
        for (f, face) in faces.iter().enumerate() {
            let [a, b, c] = face.map(|i| points[i as usize]);
            let normal = vec3::cross(vec3::sub(b, a), vec3::sub(c, a));
            let weight = 0.5 * vec3::norm(normal);
            area += weight;
            let plane = Quadric::of_plane(unit(normal), a, weight / 3.0);
            for &i in face {
                rings[i as usize].push(f as u32);
                quadrics[i as usize].add(&plane);
            }
        }
        // An even triangulation by equilateral triangles of side s has 2 / (sqrt(3) s^2) vertices per area.
        let size = (2.0 * area / (3f64.sqrt() * target as f64)).sqrt();
        let sizes = random_sizes(points, size, rng);
        let n = points.len();
        let tolerance = (0.035 * size).powi(2);
        Self {
            points,
            keep,
            faces: faces.to_vec(),
            rings,
            quadrics,
            sizes,
            tolerance,
            dirty: vec![false; n],
            queue: BinaryHeap::with_capacity(2 * n),
            alive: n,
        }
    }

    fn run(&mut self, target: usize) {
        for vertex in 0..self.points.len() as u32 {
            self.enqueue(vertex);
        }
        while self.alive > target {
            let Some(Reverse((_, vertex, into))) = self.queue.pop() else { return };
            // Collapses two edges away do not change the cost, but may change what the topology allows.
            if std::mem::take(&mut self.dirty[vertex as usize]) || !self.keeps_topology(vertex, into) {
                self.enqueue(vertex);
            } else {
                self.collapse(vertex, into);
            }
        }
    }

    fn enqueue(&mut self, vertex: u32) {
        if let Some((cost, into)) = self.cheapest(vertex) {
            // Non-negative costs compare like their bits.
            self.queue.push(Reverse((cost.to_bits(), vertex, into)));
        }
    }

    /// The neighbour that `vertex` is best moved onto, and what that costs.
    fn cheapest(&self, vertex: u32) -> Option<(f64, u32)> {
        if self.keep[vertex as usize] {
            return None;
        }
        let mut options: Vec<(f64, u32)> = self
            .neighbors(vertex)
            .into_iter()
            .filter_map(|into| Some((self.cost(vertex, into)?, into)))
            .collect();
        options.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        options.into_iter().find(|&(_, into)| self.keeps_topology(vertex, into))
    }

    fn neighbors(&self, vertex: u32) -> Vec<u32> {
        // On a closed manifold each neighbour follows the vertex in exactly one face.
        let ring = &self.rings[vertex as usize];
        ring.iter().map(|&f| follower(self.faces[f as usize], vertex)).collect()
    }

    /// The link condition: exactly two vertices neighbour both, and neither of them is left with two faces.
    fn keeps_topology(&self, vertex: u32, into: u32) -> bool {
        let (around, beyond) = (self.neighbors(vertex), self.neighbors(into));
        let mut common = around.iter().filter(|i| beyond.contains(i));
        let both = [common.next().copied(), common.next().copied()];
        common.next().is_none()
            && both.into_iter().all(|shared| shared.is_some_and(|i| self.rings[i as usize].len() > 3))
    }

    /// Squared length in units of the wanted one, dearer where the surface bends or triangles get thin; `None` where a
    /// triangle would turn over or get too thin.
    fn cost(&self, vertex: u32, into: u32) -> Option<f64> {
        let (from, to) = (self.points[vertex as usize], self.points[into as usize]);
        let size = 0.5 * (self.sizes[vertex as usize] + self.sizes[into as usize]);
        let (mut thin_before, mut thin_after): (f64, f64) = (1.0, 1.0);
        let mut longest: f64 = 0.0;
        for &f in &self.rings[vertex as usize] {
            let face = self.faces[f as usize];
            let next = follower(face, vertex);
            let (q, r) = (self.points[next as usize], self.points[follower(face, next) as usize]);
            let (before, thin) = normal_and_thinness(from, q, r);
            thin_before = thin_before.max(thin);
            if face.contains(&into) {
                continue;
            }
            let (after, thin_then) = normal_and_thinness(to, q, r);
            // The direction of a sliver says nothing.
            if thin < SLIVER && vec3::dot(before, after) < 0.4 {
                return None;
            }
            thin_after = thin_after.max(thin_then);
            let (a, b) = (vec3::sub(to, q), vec3::sub(to, r));
            longest = longest.max(vec3::dot(a, a)).max(vec3::dot(b, b));
        }
        if thin_after > THINNEST.max(thin_before) {
            return None;
        }
        let length = vec3::sub(to, from);
        let bend = self.quadrics[vertex as usize].mean_square_distance(to) / self.tolerance;
        let spread = (vec3::dot(length, length) + 0.3 * longest) / (size * size);
        Some(spread * (1.0 + bend) * thin_after * thin_after / thin_before)
    }

    fn collapse(&mut self, vertex: u32, into: u32) {
        let ring = std::mem::take(&mut self.rings[vertex as usize]);
        for &f in &ring {
            let face = self.faces[f as usize];
            if face.contains(&into) {
                for i in face.into_iter().filter(|&i| i != vertex) {
                    self.rings[i as usize].retain(|&other| other != f);
                }
                self.faces[f as usize] = [GONE; 3];
            } else {
                self.faces[f as usize] = face.map(|i| if i == vertex { into } else { i });
                self.rings[into as usize].push(f);
            }
        }
        let quadric = self.quadrics[vertex as usize];
        self.quadrics[into as usize].add(&quadric);
        self.alive -= 1;
        for i in self.neighbors(into) {
            self.dirty[i as usize] = true;
        }
        self.dirty[into as usize] = true;
    }
}

/// Unit normal of a triangle, and the sum of its squared sides over that of an equilateral triangle of the same area.
fn normal_and_thinness(p: Vec3, q: Vec3, r: Vec3) -> (Vec3, f64) {
    let (a, b, c) = (vec3::sub(q, p), vec3::sub(r, p), vec3::sub(r, q));
    let cross = vec3::cross(a, b);
    let double = vec3::norm(cross).max(1e-300);
    let squares = vec3::dot(a, a) + vec3::dot(b, b) + vec3::dot(c, c);
    (vec3::scale(cross, 1.0 / double), squares / (2.0 * 3f64.sqrt() * double))
}

/// The vertex after `vertex` in a face that has it.
fn follower(face: [u32; 3], vertex: u32) -> u32 {
    match face {
        [a, b, _] if a == vertex => b,
        [_, b, c] if b == vertex => c,
        [a, ..] => a,
    }
}

/// A wanted edge length for every point: `size` times a smooth random field and a little noise, so that the density
/// of vertices says little about where on the body they are.
fn random_sizes(points: &[Vec3], size: f64, rng: &mut impl Rng) -> Vec<f64> {
    let waves: Vec<(Vec3, f64)> = (0..6)
        .map(|_| {
            let direction = unit(std::array::from_fn(|_| normal(rng, 0.0, 1.0)));
            // Wave lengths of 16 to 60 edges: from a head's width to a trunk's.
            let frequency = std::f64::consts::TAU / (size * uniform(rng, 16.0, 60.0));
            (vec3::scale(direction, frequency), uniform(rng, 0.0, std::f64::consts::TAU))
        })
        .collect();
    let field = |p: Vec3| waves.iter().map(|&(wave, phase)| (vec3::dot(wave, p) + phase).sin()).sum::<f64>();
    points.iter().map(|&p| size * (0.07 * field(p) + normal(rng, 0.0, 0.08)).exp()).collect()
}

/// Sum of weighted squared distances to planes: upper triangle of a symmetric 4 x 4 matrix, and the weight.
#[derive(Clone, Copy, Default)]
struct Quadric {
    matrix: [f64; 10],
    weight: f64,
}

impl Quadric {
    fn of_plane(normal: Vec3, point: Vec3, weight: f64) -> Self {
        let [a, b, c] = normal;
        let d = -vec3::dot(normal, point);
        let matrix = [a * a, a * b, a * c, a * d, b * b, b * c, b * d, c * c, c * d, d * d];
        Self { matrix: matrix.map(|x| weight * x), weight }
    }

    fn add(&mut self, other: &Self) {
        self.matrix.iter_mut().zip(other.matrix).for_each(|(x, y)| *x += y);
        self.weight += other.weight;
    }

    fn mean_square_distance(&self, [x, y, z]: Vec3) -> f64 {
        let [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd] = self.matrix;
        let sum = x * (aa * x + 2.0 * (ab * y + ac * z + ad)) + y * (bb * y + 2.0 * (bc * z + bd));
        ((sum + z * (cc * z + 2.0 * cd) + dd) / self.weight.max(1e-300)).max(0.0)
    }
}
