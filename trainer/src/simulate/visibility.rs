//! What a ring of cameras around a person sees: everything but soles, insides of fists and the like.

use fmnet::Mesh;
use fmnet::mesh::vec3;
use rayon::prelude::*;

type Vec3 = [f64; 3];

/// Pixels along each side of a camera's image.
const PIXELS: usize = 384;
/// Cameras around the shape, at each of the heights.
const AROUND: usize = 8;
/// Heights of the cameras above the floor, relative to the shape's.
const HEIGHTS: [f64; 3] = [0.05, 0.6, 1.6];
/// Distance of the cameras from the shape's axis, relative to the diagonal of its box.
const DISTANCE: f64 = 1.0;
/// Cosine of the steepest angle between normal and line of sight at which stereo still measures.
const GRAZING: f64 = 0.2;
/// How far behind the front a vertex may lie and still be seen, relative to sqrt(area).
const DEPTH: f64 = 0.006;

/// Whether each vertex is seen by some camera, `[n]`. The floor is the plane below the lowest vertex; `turn`
/// (radians) turns the cameras about the axis `up`, a unit vector.
pub(super) fn seen(mesh: &Mesh, normals: &[Vec3], up: Vec3, turn: f64) -> Vec<bool> {
    let cameras = cameras(mesh, up, turn);
    let per_camera: Vec<Vec<bool>> = cameras.par_iter().map(|camera| camera.sees(mesh, normals)).collect();
    (0..mesh.n_vertices()).map(|v| per_camera.iter().any(|seen| seen[v])).collect()
}

fn cameras(mesh: &Mesh, up: Vec3, turn: f64) -> Vec<Camera> {
    let along = |p: &Vec3| vec3::dot(*p, up);
    let floor = mesh.vertices().iter().map(along).fold(f64::INFINITY, f64::min);
    let top = mesh.vertices().iter().map(along).fold(f64::NEG_INFINITY, f64::max);
    let n = mesh.n_vertices().max(1) as f64;
    let center = vec3::scale(mesh.vertices().iter().fold([0.0; 3], |sum, p| vec3::add(sum, *p)), 1.0 / n);
    let least = if up[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let aside = unit(vec3::cross(up, least));
    let ahead = vec3::cross(up, aside);
    let at = |height: f64| vec3::add(center, vec3::scale(up, height - along(&center)));
    let middle = at(0.5 * (floor + top));
    let mut cameras = Vec::new();
    for height in HEIGHTS {
        for i in 0..AROUND {
            let (sin, cos) = (turn + std::f64::consts::TAU * i as f64 / AROUND as f64).sin_cos();
            let out = vec3::add(vec3::scale(aside, cos), vec3::scale(ahead, sin));
            let axis = at(floor + height * (top - floor));
            let place = vec3::add(axis, vec3::scale(out, DISTANCE * mesh.diagonal()));
            cameras.push(Camera::looking(place, middle, up, mesh.scale()));
        }
    }
    cameras
}

struct Camera {
    place: Vec3,
    right: Vec3,
    upward: Vec3,
    forward: Vec3,
    /// Unit of length, sqrt(area).
    unit: f64,
}

impl Camera {
    fn looking(place: Vec3, to: Vec3, up: Vec3, scale: f64) -> Self {
        let forward = unit(vec3::sub(to, place));
        let right = unit(vec3::cross(forward, up));
        Self { place, right, upward: vec3::cross(right, forward), forward, unit: scale }
    }

    /// Pixel coordinates and depth; the view is 90 degrees wide.
    fn project(&self, p: Vec3) -> (f64, f64, f64) {
        let q = vec3::sub(p, self.place);
        let depth = vec3::dot(q, self.forward).max(1e-3 * self.unit);
        let pixel = |axis: Vec3| 0.5 * PIXELS as f64 * (1.0 + vec3::dot(q, axis) / depth);
        (pixel(self.right), pixel(self.upward), depth)
    }

    fn sees(&self, mesh: &Mesh, normals: &[Vec3]) -> Vec<bool> {
        let projected: Vec<(f64, f64, f64)> = mesh.vertices().iter().map(|&p| self.project(p)).collect();
        let front = front(mesh, &projected);
        let vertices = mesh.vertices().iter().zip(normals).zip(&projected);
        let seen = vertices.map(|((&p, &normal), &(x, y, depth))| {
            let line = unit(vec3::sub(self.place, p));
            let cosine = vec3::dot(line, normal);
            let [column, row] = [x, y].map(|v| v.clamp(0.0, PIXELS as f64 - 1.0) as usize);
            // A pixel's depth varies by its width times the surface's slope.
            let slope = 2.0 * depth / PIXELS as f64 / cosine.max(GRAZING);
            cosine > GRAZING && depth <= front[row * PIXELS + column] + DEPTH * self.unit + slope
        });
        seen.collect()
    }
}

/// Least depth at the centre of every pixel.
fn front(mesh: &Mesh, projected: &[(f64, f64, f64)]) -> Vec<f64> {
    let mut image = vec![f64::INFINITY; PIXELS * PIXELS];
    for face in mesh.faces() {
        let [a, b, c] = face.map(|i| projected[i as usize]);
        let range = |a: f64, b: f64, c: f64| {
            let from = a.min(b).min(c).ceil().max(0.0) as usize;
            from..((a.max(b).max(c).floor() + 1.0).clamp(0.0, PIXELS as f64) as usize).max(from)
        };
        let area = (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
        if area == 0.0 {
            continue;
        }
        for row in range(a.1, b.1, c.1) {
            for column in range(a.0, b.0, c.0) {
                let (x, y) = (column as f64, row as f64);
                let v = ((x - a.0) * (c.1 - a.1) - (y - a.1) * (c.0 - a.0)) / area;
                let w = ((b.0 - a.0) * (y - a.1) - (b.1 - a.1) * (x - a.0)) / area;
                if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
                    // The inverse depth is linear on the screen.
                    let depth = 1.0 / ((1.0 - v - w) / a.2 + v / b.2 + w / c.2);
                    let slot = &mut image[row * PIXELS + column];
                    *slot = slot.min(depth);
                }
            }
        }
    }
    image
}

/// Unit normals of the vertices, weighted by the areas of their faces; zero for a vertex of no face.
pub(super) fn vertex_normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = vec![[0.0; 3]; mesh.n_vertices()];
    for (f, face) in mesh.faces().iter().enumerate() {
        let cross = mesh.face_cross(f);
        for &i in face {
            normals[i as usize] = vec3::add(normals[i as usize], cross);
        }
    }
    normals.into_iter().map(unit).collect()
}

pub(super) fn unit(p: Vec3) -> Vec3 {
    let norm = vec3::norm(p);
    if norm > 0.0 { vec3::scale(p, 1.0 / norm) } else { p }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmnet::mesh::shapes::{icosphere, joined, transformed};

    const STRAIGHT: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn of_a_ball_only_the_bottom_is_hidden() {
        let ball = icosphere(4);
        let seen = seen(&ball, &vertex_normals(&ball), [0.0, 0.0, 1.0], 0.3);
        for (p, seen) in ball.vertices().iter().zip(seen) {
            if p[2] > -0.5 {
                assert!(seen, "{p:?} is open to the cameras");
            } else if p[2] < -0.985 {
                assert!(!seen, "{p:?} lies on the floor");
            }
        }
    }

    #[test]
    fn a_ball_inside_another_is_hidden() {
        let ball = icosphere(3);
        let pair = joined(&[&ball, &transformed(&ball, STRAIGHT, 0.7, [0.0; 3])]);
        let seen = seen(&pair, &vertex_normals(&pair), [0.0, 1.0, 0.0], 0.0);
        assert!(seen[ball.n_vertices()..].iter().all(|seen| !seen));
    }
}
