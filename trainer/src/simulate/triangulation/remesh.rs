//! Triangulations of a surface with edges as long as wanted: long edges are split, short ones collapsed, edges
//! flipped until the triangles are Delaunay, and vertices moved along the surface (Botsch and Kobbelt, A remeshing
//! approach to multiresolution modeling, 2004), all in the metric that is asked for.

use super::metric::Metric;
use super::sheet::{Diamond, Sheet, cross};
use super::surface::{Place, Surface};
use crate::simulate::visibility::unit;
use fmnet::Mesh;
use fmnet::mesh::vec3;

type Vec3 = [f64; 3];

/// Edges longer than this, relative to what is wanted, are split.
const LONG: f64 = 4.0 / 3.0;
/// Edges shorter than this are collapsed.
const SHORT: f64 = 4.0 / 5.0;
/// Cosine of the largest angle between a triangle and the surface at its corners that a change may make.
const UPRIGHT: f64 = 0.3;
/// Edges whose two triangles are bent by more than 30 degrees are not flipped: the cosine.
const FLAT: f64 = 0.866;
/// Share of the way to the middle of the triangles around it that a vertex goes in each round.
const STEP: f64 = 0.7;

/// A triangulation of about `target` vertices by the wanted edge lengths, relative to each other, at the surface's
/// vertices; it begins with another triangulation.
pub(super) fn remesh(
    surface: &Surface,
    metrics: &[Metric],
    start: &Mesh,
    target: usize,
    rounds: usize,
) -> Mesh {
    let (sheet, places) = (Sheet::new(start), surface.places(start));
    let mut work = Work { surface, metrics, factor: 1.0, sheet, places };
    for round in 0..rounds {
        work.split_long();
        work.collapse_short();
        work.flip();
        work.relax();
        if round + 1 < rounds {
            work.factor *= (work.sheet.n_vertices() as f64 / target as f64).sqrt().clamp(0.8, 1.25);
        }
    }
    work.flip();
    work.sheet.into_mesh()
}

struct Work<'a> {
    surface: &'a Surface<'a>,
    /// Of each vertex of the surface.
    metrics: &'a [Metric],
    /// What all wanted lengths are multiplied by, for the wanted number of vertices.
    factor: f64,
    sheet: Sheet,
    /// Where on the surface each vertex is.
    places: Vec<Place>,
}

impl Work<'_> {
    fn metric(&self, vertex: u32) -> Metric {
        self.metrics[self.places[vertex as usize].vertex as usize]
    }

    fn vector(&self, a: u32, b: u32) -> Vec3 {
        vec3::sub(self.sheet.points[b as usize], self.sheet.points[a as usize])
    }

    /// Length relative to what is wanted, the mean of both ends.
    fn length(&self, a: u32, b: u32) -> f64 {
        let edge = self.vector(a, b);
        0.5 * (self.metric(a).length(edge) + self.metric(b).length(edge)) / self.factor
    }

    /// The edges whose length is in question, with their lengths.
    fn edges_where(&self, wanted: impl Fn(f64) -> bool) -> Vec<(f64, [u32; 2])> {
        let edges = self.sheet.edges().into_iter().map(|[a, b]| (self.length(a, b), [a, b]));
        edges.filter(|(length, _)| wanted(*length)).collect()
    }

    fn split_long(&mut self) {
        let mut edges = self.edges_where(|length| length > LONG);
        edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, [a, b]) in edges {
            let Some(edge) = self.sheet.diamond(a, b) else { continue };
            let Some(place) = self.middle(a, b) else { continue };
            // A chord across a fold has its middle off the surface, or on another part of it.
            if vec3::distance(place.position, self.halfway(a, b)) > 0.5 * vec3::norm(self.vector(a, b)) {
                continue;
            }
            self.sheet.split(&edge, place.position);
            self.places.push(place);
        }
    }

    fn halfway(&self, a: u32, b: u32) -> Vec3 {
        vec3::scale(vec3::add(self.sheet.points[a as usize], self.sheet.points[b as usize]), 0.5)
    }

    fn middle(&self, a: u32, b: u32) -> Option<Place> {
        self.surface.middle(&[self.places[a as usize], self.places[b as usize]])
    }

    fn collapse_short(&mut self) {
        let mut edges = self.edges_where(|length| length < SHORT);
        edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, [a, b]) in edges {
            // The end on the boundary stays.
            let (from, into) = if self.sheet.is_fixed(a) { (b, a) } else { (a, b) };
            let Some(edge) = self.sheet.diamond(from, into) else { continue };
            if self.length(from, into) >= SHORT || !self.sheet.may_collapse(&edge) {
                continue;
            }
            let place = match self.sheet.is_fixed(into) {
                true => Some(self.places[into as usize]),
                false => self.middle(from, into),
            };
            if let Some(place) = place.filter(|place| self.collapses_well(&edge, place)) {
                self.sheet.collapse(&edge, place.position);
                self.places[into as usize] = place;
            }
        }
    }

    /// Whether a collapse to the place turns no triangle over and makes no edge that would be split again.
    fn collapses_well(&self, edge: &Diamond, place: &Place) -> bool {
        let metric = self.metrics[place.vertex as usize];
        [(edge.a, edge.b), (edge.b, edge.a)].into_iter().all(|(vertex, other)| {
            self.sheet.ring(vertex).filter(|face| !face.contains(&other)).all(|face| {
                let [q, r] = [face[1], face[2]].map(|i| self.sheet.points[i as usize]);
                metric.length(vec3::sub(q, place.position)) < LONG * self.factor
                    && self.stands(face, place, q, r)
            })
        })
    }

    /// Whether the triangle with its first corner moved to the place faces the way of the surface, or no worse than
    /// it did.
    fn stands(&self, face: [u32; 3], place: &Place, q: Vec3, r: Vec3) -> bool {
        let least = |normal: Vec3, at: [Vec3; 3]| {
            at.into_iter().map(|n| vec3::dot(normal, n)).fold(f64::INFINITY, f64::min)
        };
        let [old, second, third] = face.map(|i| self.places[i as usize].normal);
        let after = least(unit(cross([place.position, q, r])), [place.normal, second, third]);
        let before = || least(unit(self.sheet.normal(face)), [old, second, third]);
        after > UPRIGHT || (after > 0.0 && after >= before())
    }

    /// Flips edges until the triangles are Delaunay in the metric, where the surface is flat enough.
    fn flip(&mut self) {
        let mut queue = self.sheet.edges();
        queue.reverse();
        // Stops cycles on surfaces that are not flat.
        let mut left = 4 * queue.len();
        while let Some([a, b]) = queue.pop() {
            let Some(edge) = self.sheet.diamond(a, b).filter(|edge| self.sheet.may_flip(edge)) else {
                continue;
            };
            if left > 0 && self.better_flipped(&edge) {
                left -= 1;
                self.sheet.flip(&edge);
                let around = [(a, edge.left), (a, edge.right), (b, edge.left), (b, edge.right)];
                queue.extend(around.map(|(i, j)| [i.min(j), i.max(j)]));
            }
        }
    }

    fn better_flipped(&self, &Diamond { a, b, left, right, .. }: &Diamond) -> bool {
        let points = [a, b, left, right].map(|i| self.sheet.points[i as usize]);
        let metrics = [self.metric(a), self.metric(b)];
        // The angles at the corners opposite the edge, in the metric at its ends.
        let excess: f64 = metrics
            .iter()
            .map(|metric| {
                let [a, b, c, d] = points.map(|p| metric.to_unit(vec3::sub(p, points[0])));
                let cotangent = |apex: Vec3| {
                    let (u, v) = (vec3::sub(a, apex), vec3::sub(b, apex));
                    vec3::dot(u, v) / vec3::norm(vec3::cross(u, v)).max(f64::MIN_POSITIVE)
                };
                cotangent(c) + cotangent(d)
            })
            .sum();
        excess < -1e-9 && flips_flat(points)
    }

    fn relax(&mut self) {
        for vertex in 0..self.sheet.points.len() as u32 {
            if self.sheet.is_fixed(vertex) || self.sheet.ring(vertex).next().is_none() {
                continue;
            }
            let Some(place) = self.relaxed(vertex) else { continue };
            let stands = |face: [u32; 3]| {
                let [q, r] = [face[1], face[2]].map(|i| self.sheet.points[i as usize]);
                self.stands(face, &place, q, r)
            };
            if self.sheet.ring(vertex).all(stands) {
                self.sheet.points[vertex as usize] = place.position;
                self.places[vertex as usize] = place;
            }
        }
    }

    /// A part of the way to the middle of the triangles around a vertex, by their areas in the metric.
    fn relaxed(&self, vertex: u32) -> Option<Place> {
        let (p, normal) = (self.sheet.points[vertex as usize], self.places[vertex as usize].normal);
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for face in self.sheet.ring(vertex) {
            let [_, q, r] = face;
            let wanted: f64 = face.iter().map(|&i| self.metric(i)).map(|m| m.size * m.size * m.stretch).sum();
            let area = vec3::norm(self.sheet.normal(face)) / wanted;
            let middle = vec3::scale(vec3::add(self.vector(vertex, q), self.vector(vertex, r)), 1.0 / 3.0);
            sum = vec3::add(sum, vec3::scale(middle, area));
            weight += area;
        }
        if !(weight > 0.0) {
            return None;
        }
        let step = vec3::scale(sum, STEP / weight);
        let along = vec3::sub(step, vec3::scale(normal, vec3::dot(step, normal)));
        self.surface.closest(vec3::add(p, along), normal)
    }
}

/// Whether the edge `a b` of the triangles `a b left` and `b a right` may become `left right` without changing the
/// surface.
pub(super) fn flips_flat([a, b, left, right]: [Vec3; 4]) -> bool {
    let before = [[a, b, left], [b, a, right]].map(|t| unit(cross(t)));
    let after = [[left, a, right], [right, b, left]].map(|t| unit(cross(t)));
    let mean = unit(vec3::add(before[0], before[1]));
    vec3::dot(before[0], before[1]) > FLAT && after.iter().all(|&n| vec3::dot(n, mean) > FLAT)
}
