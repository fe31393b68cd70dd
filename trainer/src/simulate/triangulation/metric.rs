//! How long an edge is wanted to be, at each place and in each direction.

use crate::simulate::carve::spread;
use crate::simulate::random::{direction, uniform};
use crate::simulate::triangulation::surface::Surface;
use crate::simulate::visibility::unit;
use fmnet::mesh::{Adjacency, Topology, farthest_point_sampling_by, vec3};
use rand::Rng;
use std::f64::consts::TAU;

type Vec3 = [f64; 3];

/// Wanted edge lengths at a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Metric {
    /// Across the direction, in the mesh's unit.
    pub(super) size: f64,
    /// Unit vector along which edges are longer.
    pub(super) direction: Vec3,
    /// How many times longer, 1 or more.
    pub(super) stretch: f64,
}

impl Metric {
    /// A vector in the space where every edge is wanted to have the length 1.
    pub(super) fn to_unit(self, v: Vec3) -> Vec3 {
        let along = vec3::dot(v, self.direction) * (1.0 - 1.0 / self.stretch);
        vec3::scale(vec3::sub(v, vec3::scale(self.direction, along)), 1.0 / self.size)
    }

    /// Length of an edge relative to what is wanted.
    pub(super) fn length(self, edge: Vec3) -> f64 {
        vec3::norm(self.to_unit(edge))
    }
}

/// The same everywhere.
pub(super) fn even(surface: &Surface, target: usize) -> Vec<Metric> {
    fitted(surface, vec![1.0; surface.normals.len()], None, target)
}

/// Shorter edges where the surface bends.
pub(super) fn curved(surface: &Surface, target: usize) -> Vec<Metric> {
    let topology = Topology::new(surface.mesh);
    let bends = bends(surface, &topology);
    let mut sizes: Vec<f64> = bends.iter().map(|t| 1.0 / (t[0] + t[3] + t[5]).max(1e-12).sqrt()).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
    sizes.iter_mut().for_each(|s| *s = (*s / median).clamp(0.45, 2.2).ln());
    smooth(&mut sizes, &topology.adjacency(), 6);
    fitted(surface, sizes.into_iter().map(f64::exp).collect(), None, target)
}

/// Edges up to `stretch` times longer along limbs and folds (`bent`), or along a direction that turns slowly in space.
pub(super) fn stretched(
    surface: &Surface,
    bent: bool,
    stretch: f64,
    target: usize,
    rng: &mut impl Rng,
) -> Vec<Metric> {
    let tensors: Vec<[f64; 6]> = if bent {
        bends(surface, &Topology::new(surface.mesh))
    } else {
        let (a, b, wave) = (direction(rng), direction(rng), direction(rng));
        let (phase, turns) = (uniform(rng, 0.0, TAU), uniform(rng, 0.3, 1.0) * TAU / surface.mesh.scale());
        let along = |p: &Vec3| {
            let (sin, cos) = (phase + turns * vec3::dot(wave, *p)).sin_cos();
            square(vec3::add(vec3::scale(a, cos), vec3::scale(b, sin)))
        };
        surface.mesh.vertices().iter().map(along).collect()
    };
    let directions: Vec<(Vec3, f64)> = tensors
        .iter()
        .zip(&surface.normals)
        .map(|(tensor, &normal)| {
            let (direction, coherence) = strongest(tensor, normal);
            (direction, 1.0 + (stretch - 1.0) * coherence)
        })
        .collect();
    fitted(surface, vec![1.0; directions.len()], Some(directions), target)
}

/// Edges `ratio` times shorter on one side of a plane through the middle than on the other.
pub(super) fn half(surface: &Surface, ratio: f64, target: usize, rng: &mut impl Rng) -> Vec<Metric> {
    let normal = direction(rng);
    let vertices = surface.mesh.vertices();
    let height: Vec<f64> = vertices.iter().map(|p| vec3::dot(*p, normal)).collect();
    let middle = height.iter().sum::<f64>() / height.len().max(1) as f64;
    let width = uniform(rng, 0.05, 0.3) * surface.mesh.scale();
    let share = |h: &f64| smoothstep((h - middle) / width + 0.5);
    let sizes = height.iter().map(|h| ratio.powf(share(h))).collect();
    fitted(surface, sizes, None, target)
}

/// Edges `ratio` times shorter around some of the extremities, such as head and hands.
pub(super) fn ends(surface: &Surface, ratio: f64, target: usize, rng: &mut impl Rng) -> Vec<Metric> {
    let adjacency = Topology::new(surface.mesh).adjacency();
    let scale = surface.mesh.scale();
    let radius = scale * uniform(rng, 0.15, 0.35);
    let mut nearness = vec![0.0f64; surface.normals.len()];
    for end in extremities(surface.mesh, &adjacency, 5, rng) {
        if rng.random::<f64>() < 0.6 {
            spread(surface.mesh, &adjacency, end, |vertex, distance| {
                let near = smoothstep(2.0 - 2.0 * distance / radius);
                let slot = &mut nearness[vertex as usize];
                *slot = slot.max(near);
                distance < radius
            });
        }
    }
    let sizes = nearness.into_iter().map(|near| ratio.powf(1.0 - near)).collect();
    fitted(surface, sizes, None, target)
}

/// Vertices far from each other along the surface: heads, hands, feet, tails.
pub(in crate::simulate) fn extremities(
    mesh: &fmnet::Mesh,
    adjacency: &Adjacency,
    count: usize,
    rng: &mut impl Rng,
) -> Vec<u32> {
    if mesh.n_vertices() == 0 {
        return Vec::new();
    }
    let start = rng.random_range(0..mesh.n_vertices()) as u32;
    let mut found = farthest_point_sampling_by(mesh.n_vertices(), count + 1, start, |source, distances| {
        distances.fill(f64::INFINITY);
        spread(mesh, adjacency, source, |vertex, distance| {
            distances[vertex as usize] = distance;
            true
        });
    });
    // The start lies anywhere.
    found.remove(0);
    found
}

fn smoothstep(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Relative sizes, scaled so that about `target` vertices come out.
fn fitted(
    surface: &Surface,
    sizes: Vec<f64>,
    directions: Option<Vec<(Vec3, f64)>>,
    target: usize,
) -> Vec<Metric> {
    let directions = directions.unwrap_or_else(|| vec![([1.0, 0.0, 0.0], 1.0); sizes.len()]);
    let areas = surface.mesh.vertex_areas();
    let terms = areas.iter().zip(&sizes).zip(&directions);
    let sum: f64 = terms.map(|((area, size), (_, stretch))| area / (size * size * stretch)).sum();
    // An even triangulation by equilateral triangles of side s has 2 / (sqrt(3) s^2) vertices per area.
    let factor = (2.0 / 3f64.sqrt() * sum / target as f64).sqrt();
    let metric = |(size, (direction, stretch)): (f64, (Vec3, f64))| Metric {
        size: (factor * size).max(f64::MIN_POSITIVE),
        direction,
        stretch,
    };
    sizes.into_iter().zip(directions).map(metric).collect()
}

/// How much the surface bends around each direction, as a tensor `xx, xy, xz, yy, yz, zz` at each vertex, averaged
/// around it. On a cylinder of radius r it is `a a^T / r`, a the axis (Cohen-Steiner and Morvan 2003, with the
/// angles' absolute values).
fn bends(surface: &Surface, topology: &Topology) -> Vec<[f64; 6]> {
    let mesh = surface.mesh;
    let mut tensors = vec![[0.0; 6]; mesh.n_vertices()];
    for (e, &[i, j]) in topology.edges().iter().enumerate() {
        let &[left, right] = topology.half_edges(e) else { continue };
        let [left, right] = [left, right].map(|h| unit(mesh.face_cross(h as usize / 3)));
        let angle = vec3::norm(vec3::cross(left, right)).atan2(vec3::dot(left, right));
        let edge = vec3::sub(mesh.vertices()[j as usize], mesh.vertices()[i as usize]);
        let length = vec3::norm(edge);
        if length > 0.0 {
            for vertex in [i, j] {
                let term = square(vec3::scale(edge, 1.0 / length));
                tensors[vertex as usize]
                    .iter_mut()
                    .zip(term)
                    .for_each(|(t, x)| *t += 0.5 * angle * length * x);
            }
        }
    }
    for (tensor, area) in tensors.iter_mut().zip(mesh.vertex_areas()) {
        tensor.iter_mut().for_each(|x| *x /= area.max(f64::MIN_POSITIVE));
    }
    let adjacency = topology.adjacency();
    for component in 0..6 {
        let mut values: Vec<f64> = tensors.iter().map(|t| t[component]).collect();
        smooth(&mut values, &adjacency, 4);
        tensors.iter_mut().zip(values).for_each(|(t, x)| t[component] = x);
    }
    tensors
}

/// Replaces each value by the mean of itself and the mean of its neighbours.
fn smooth(values: &mut Vec<f64>, adjacency: &Adjacency, rounds: usize) {
    for _ in 0..rounds {
        let mean = |i: usize| {
            let around = adjacency.of(i);
            let sum: f64 = around.iter().map(|&j| values[j as usize]).sum();
            if around.is_empty() { values[i] } else { 0.5 * (values[i] + sum / around.len() as f64) }
        };
        *values = (0..values.len()).map(mean).collect();
    }
}

fn square([x, y, z]: Vec3) -> [f64; 6] {
    [x * x, x * y, x * z, y * y, y * z, z * z]
}

/// The tangent direction of the largest eigenvalue, and how far it stands out, from 0 to 1.
fn strongest(&[xx, xy, xz, yy, yz, zz]: &[f64; 6], normal: Vec3) -> (Vec3, f64) {
    let least = if normal[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let u = unit(vec3::cross(normal, least));
    let w = vec3::cross(normal, u);
    let times = |v: Vec3| [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| vec3::dot(row, v));
    let (a, b, d) = (vec3::dot(u, times(u)), vec3::dot(u, times(w)), vec3::dot(w, times(w)));
    // Eigenvalues of [[a, b], [b, d]]: the mean plus and minus the radius.
    let (mean, radius) = (0.5 * (a + d), (0.25 * (a - d) * (a - d) + b * b).sqrt());
    let (sin, cos) = (0.5 * (2.0 * b).atan2(a - d)).sin_cos();
    let coherence = if mean > 0.0 { (radius / mean).clamp(0.0, 1.0) } else { 0.0 };
    (vec3::add(vec3::scale(u, cos), vec3::scale(w, sin)), coherence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmnet::mesh::shapes::torus;

    #[test]
    fn a_torus_is_stretched_along_its_ring() {
        let mesh = torus(96, 24, 0.15);
        let surface = Surface::new(&mesh);
        let mut rng = crate::simulate::random::generator(0, 0);
        let metrics = stretched(&surface, true, 3.0, 1000, &mut rng);
        for (metric, p) in metrics.iter().zip(mesh.vertices()) {
            let along = unit([-p[1], p[0], 0.0]);
            assert!(vec3::dot(metric.direction, along).abs() > 0.95, "{metric:?} at {p:?}");
            assert!(metric.stretch > 2.0 && metric.stretch <= 3.0);
            let edge = vec3::scale(along, metric.size * metric.stretch);
            assert!((metric.length(edge) - 1.0).abs() < 0.2);
        }
    }
}
