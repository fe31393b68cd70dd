//! The signed distance to a closed surface on a regular grid, in a band around it.
//!
//! The surface may pass through itself, as registrations do where skin touches skin: inside is where it winds around
//! a point at least once, so that the outside is what a scanner would see.

use super::polygonize::crossings;
use fmnet::Mesh;
use fmnet::mesh::{closest_weights, vec3};
use rayon::prelude::*;

type Vec3 = [f64; 3];

/// Planes of the grid that one task fills.
const PLANES: usize = 4;

/// Distances at the nodes of a grid, negative inside, cut at `band`.
pub(super) struct Volume {
    pub(super) origin: Vec3,
    /// Distance of neighbouring nodes.
    pub(super) cell: f64,
    /// Nodes along each axis.
    pub(super) size: [usize; 3],
    /// Values, the last axis fastest.
    pub(super) values: Vec<f32>,
    band: f64,
}

impl Volume {
    /// Samples the distance to `mesh` at the grid spacing `cell`, up to `band` on both sides.
    pub(super) fn new(mesh: &Mesh, cell: f64, band: f64) -> Self {
        let [low, high] = mesh.bounding_box().unwrap_or_default();
        let margin = band + 2.0 * cell;
        let origin = low.map(|x| x - margin);
        let size = [0, 1, 2].map(|a| ((high[a] - low[a] + 2.0 * margin) / cell).ceil() as usize + 1);
        let mut volume = Self { origin, cell, size, values: vec![band as f32; size.iter().product()], band };
        let triangles: Vec<[Vec3; 3]> = (0..mesh.n_faces()).map(|f| mesh.corners(f)).collect();
        let mut values = std::mem::take(&mut volume.values);
        values.par_chunks_mut(PLANES * size[1] * size[2]).enumerate().for_each(|(slab, values)| {
            let first = slab * PLANES;
            volume.measure(&triangles, first, values);
            volume.sign(&triangles, first, values);
        });
        volume.values = values;
        volume
    }

    /// The position of a node.
    pub(super) fn position(&self, [i, j, k]: [usize; 3]) -> Vec3 {
        [0, 1, 2].map(|a| self.origin[a] + self.cell * [i, j, k][a] as f64)
    }

    /// The nodes along `axis` between two coordinates, at most `end`.
    fn nodes(&self, axis: usize, from: f64, to: f64, begin: usize, end: usize) -> std::ops::Range<usize> {
        let at = |x: f64| (x - self.origin[axis]) / self.cell;
        let first = at(from).ceil().max(begin as f64) as usize;
        first..((at(to).floor() + 1.0).max(0.0) as usize).clamp(first, end.max(first))
    }

    /// Unsigned distances in the planes from `first` on.
    fn measure(&self, triangles: &[[Vec3; 3]], first: usize, values: &mut [f32]) {
        let [_, ny, nz] = self.size;
        let end = first + values.len() / (ny * nz);
        for triangle in triangles {
            let range = |axis: usize, begin: usize, end: usize| {
                let [a, b, c] = triangle.map(|p| p[axis]);
                self.nodes(axis, a.min(b).min(c) - self.band, a.max(b).max(c) + self.band, begin, end)
            };
            for i in range(0, first, end) {
                for j in range(1, 0, ny) {
                    for k in range(2, 0, nz) {
                        let value = &mut values[((i - first) * ny + j) * nz + k];
                        *value = value.min(distance_to_triangle(self.position([i, j, k]), triangle) as f32);
                    }
                }
            }
        }
    }

    /// Makes the values negative where the surface winds around a node, by its crossings of each grid line of the
    /// last axis.
    fn sign(&self, triangles: &[[Vec3; 3]], first: usize, values: &mut [f32]) {
        let [_, ny, nz] = self.size;
        let end = first + values.len() / (ny * nz);
        let mut lines: Vec<Vec<(f64, i32)>> = vec![Vec::new(); (end - first) * ny];
        for triangle in triangles {
            // Wider than the triangle, as rounding must not lose a line through one of its corners.
            let range = |axis: usize, begin: usize, end: usize| {
                let [a, b, c] = triangle.map(|p| p[axis]);
                let slack = 0.5 * self.cell;
                self.nodes(axis, a.min(b).min(c) - slack, a.max(b).max(c) + slack, begin, end)
            };
            for i in range(0, first, end) {
                for j in range(1, 0, ny) {
                    let [x, y, _] = self.position([i, j, 0]);
                    lines[(i - first) * ny + j].extend(crossing(triangle, x, y));
                }
            }
        }
        for (line, values) in lines.iter_mut().zip(values.chunks_mut(nz)) {
            line.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (mut next, mut winding) = (0, 0);
            for (k, value) in values.iter_mut().enumerate() {
                let z = self.origin[2] + self.cell * k as f64;
                while let Some(&(_, turn)) = line.get(next).filter(|c| c.0 <= z) {
                    winding += turn;
                    next += 1;
                }
                if winding > 0 {
                    *value = -*value;
                }
            }
        }
    }

    /// Fills what is outside but out of reach for a ball of the given radius: the morphological closing. Two surfaces
    /// that come nearer than twice the radius grow together; elsewhere nothing changes.
    pub(super) fn close(&mut self, radius: f64) {
        // The ball's centre may be wherever the distance is at least the radius; the shape closed is what is farther
        // than the radius from all such places. Only the nearest of them matter, those on the level set itself.
        let reach = radius + 2.0 * self.cell;
        let centers = crossings(self, radius as f32);
        let [_, ny, nz] = self.size;
        let mut values = std::mem::take(&mut self.values);
        // The sampling of the level set makes distances to it a little too long.
        let slack = 0.1 * self.cell;
        values.par_chunks_mut(PLANES * ny * nz).enumerate().for_each(|(slab, values)| {
            let first = slab * PLANES;
            let end = first + values.len() / (ny * nz);
            let mut nearest = vec![reach as f32; values.len()];
            for center in &centers {
                let range = |axis: usize, begin: usize, end: usize| {
                    self.nodes(axis, center[axis] - reach, center[axis] + reach, begin, end)
                };
                for i in range(0, first, end) {
                    for j in range(1, 0, ny) {
                        for k in range(2, 0, nz) {
                            let distance = vec3::distance(self.position([i, j, k]), *center) as f32;
                            let slot = &mut nearest[((i - first) * ny + j) * nz + k];
                            *slot = slot.min(distance);
                        }
                    }
                }
            }
            for (value, nearest) in values.iter_mut().zip(nearest) {
                if *value > 0.0 && f64::from(*value) < radius {
                    *value = value.min((radius + slack) as f32 - nearest);
                }
            }
        });
        self.values = values;
    }
}

/// Where the line along the last axis through `(x, y)` crosses a triangle, and whether it goes in (1) or out (-1).
fn crossing([a, b, c]: &[Vec3; 3], x: f64, y: f64) -> Option<(f64, i32)> {
    let [u, v, w] = [side(b, c, x, y), side(c, a, x, y), side(a, b, x, y)];
    let turns = [u.1, v.1, w.1];
    let sum = u.0 + v.0 + w.0;
    if turns.contains(&0) || turns[0] != turns[1] || turns[1] != turns[2] || sum == 0.0 {
        return None;
    }
    // Counter-clockwise seen from above: the outside is above, the line leaves.
    Some(((u.0 * a[2] + v.0 * b[2] + w.0 * c[2]) / sum, -turns[0]))
}

/// Twice the signed area of `p`, `q` and `(x, y)`, and its sign: 1 where the point is on the left of the edge. A
/// point on the edge counts as moved a little along the first axis, and less along the second, so that a line through
/// an edge or a vertex crosses exactly one of the triangles there (Edelsbrunner and Muecke 1990, Simulation of
/// simplicity).
fn side(p: &Vec3, q: &Vec3, x: f64, y: f64) -> (f64, i32) {
    // Taken from the edge's lower end, so that the two triangles at it compute the same number.
    if (p[0], p[1]) > (q[0], q[1]) {
        let (area, sign) = side(q, p, x, y);
        return (-area, -sign);
    }
    let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
    let area = dx * (y - p[1]) - dy * (x - p[0]);
    let sign = [area, -dy, dx]
        .into_iter()
        .find(|&term| term != 0.0)
        .map_or(0, |term| if term > 0.0 { 1 } else { -1 });
    (area, sign)
}

/// Distance of a point to a triangle.
fn distance_to_triangle(p: Vec3, &[a, b, c]: &[Vec3; 3]) -> f64 {
    let [u, v, w] = closest_weights(p, [a, b, c]);
    vec3::distance(p, vec3::add(vec3::scale(a, u), vec3::add(vec3::scale(b, v), vec3::scale(c, w))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmnet::mesh::shapes::{icosphere, joined, transformed};

    const STRAIGHT: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn distances_of_a_ball_are_those_of_a_ball() {
        let volume = Volume::new(&icosphere(4), 0.06, 0.3);
        let [nx, ny, nz] = volume.size;
        for i in 0..nx {
            for j in 0..ny {
                for k in 0..nz {
                    let exact = (vec3::norm(volume.position([i, j, k])) - 1.0).clamp(-0.3, 0.3);
                    let found = f64::from(volume.values[(i * ny + j) * nz + k]);
                    assert!((found - exact).abs() < 3e-3, "{found} instead of {exact}");
                }
            }
        }
    }

    #[test]
    fn overlapping_balls_have_no_surface_inside() {
        let ball = icosphere(3);
        let pair = joined(&[&ball, &transformed(&ball, STRAIGHT, 1.0, [1.0, 0.1, 0.05])]);
        let volume = Volume::new(&pair, 0.1, 0.25);
        let at = |axis: usize, x: f64| ((x - volume.origin[axis]) / volume.cell).round() as usize;
        let [_, ny, nz] = volume.size;
        let overlap = (at(0, 0.5) * ny + at(1, 0.05)) * nz + at(2, 0.02);
        assert!(volume.values[overlap] < 0.0, "the overlap is inside");
    }

    #[test]
    fn closing_fills_a_narrow_gap_and_nothing_else() {
        let ball = icosphere(4);
        let gap = 0.1;
        let pair = joined(&[&ball, &transformed(&ball, STRAIGHT, 1.0, [2.0 + gap, 0.0, 0.0])]);
        let mut volume = Volume::new(&pair, 0.04, 0.3);
        let before = volume.values.clone();
        volume.close(0.15);
        let [_, ny, nz] = volume.size;
        let mut filled = 0;
        for (at, (&value, before)) in volume.values.iter().zip(before).enumerate() {
            let p = volume.position([at / (ny * nz), at / nz % ny, at % nz]);
            if before > 0.01 && value < 0.0 {
                filled += 1;
                let around = (p[1] * p[1] + p[2] * p[2]).sqrt();
                assert!((p[0] - 1.0 - gap / 2.0).abs() < 0.25 && around < 0.6, "{p:?} was filled");
            }
        }
        assert!(filled > 20, "{filled} nodes were filled");
    }

    #[test]
    fn a_line_through_an_edge_or_a_vertex_crosses_once() {
        // Four triangles around the origin, seen from above; with the two of each neighbour they tile a square.
        let ring = [[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [-1.0, 0.0, 0.5], [0.0, -1.0, 0.5]];
        let fan: Vec<[Vec3; 3]> = (0..4).map(|i| [[0.0, 0.0, 0.5], ring[i], ring[(i + 1) % 4]]).collect();
        for (x, y) in [(0.0, 0.0), (0.5, 0.0), (0.0, -0.25), (0.1, 0.2), (-0.5, 0.0)] {
            let found: Vec<_> = fan.iter().filter_map(|triangle| crossing(triangle, x, y)).collect();
            assert!(matches!(found[..], [(z, -1)] if (z - 0.5).abs() < 1e-15), "{x} {y}: {found:?}");
        }
    }
}
