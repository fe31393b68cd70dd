//! Individuals: their meshes, and which points of two of them correspond.

use rand::Rng;
use rayon::prelude::*;

use crate::Mesh;
use crate::mesh::vec3;

use super::adjacency::Adjacency;
use super::damage::Draft;
use super::math::Vec3;
use super::random::{Purpose, generator};
use super::remesh::remesh;
use super::template::Template;
use super::{SynthError, SynthOptions, UNMATCHED};

/// An individual of a species: its mesh, in metres, standing on y = 0 with y upwards, and its place on the template.
///
/// The order of vertices and faces, the connectivity, and all vertices but the landmarks are the individual's own.
#[derive(Clone, Debug)]
pub struct Body {
    /// The surface, closed unless damaged.
    pub mesh: Mesh,
    /// Of every landmark of the species its vertex, `[n_landmarks]`, or [`UNMATCHED`] where damage took it away.
    pub landmarks: Vec<u32>,
    /// Of every vertex the vertex of the template's dense surface ([`Template::rest_mesh`]) it is, `[n]`.
    pub template_vertices: Vec<u32>,
}

impl Template {
    /// The individual with the given seed: body, pose, triangulation and damage are all drawn from it. The same seed
    /// and options give the same bytes, whatever the number of threads.
    ///
    /// # Errors
    /// If an option is out of range.
    pub fn body(&self, seed: u64, options: &SynthOptions) -> Result<Body, SynthError> {
        options.check()?;
        let dense = self.individual(seed);
        let mut keep = vec![false; dense.len()];
        self.landmarks.iter().for_each(|&i| keep[i as usize] = true);
        let mut rng = generator(self.species.index(), seed, Purpose::Remesh);
        let target = rng.random_range(options.min_vertices..=options.max_vertices);
        let remeshed = remesh(&dense, &self.faces, &keep, target, &mut rng);
        let points = remeshed.dense.iter().map(|&i| dense[i as usize]).collect();
        let mut draft = Draft { points, faces: remeshed.faces, dense: remeshed.dense };
        draft.damage(self, options, &mut generator(self.species.index(), seed, Purpose::Damage));
        let mut vertex_of = vec![UNMATCHED; dense.len()];
        draft.dense.iter().enumerate().for_each(|(vertex, &i)| vertex_of[i as usize] = vertex as u32);
        let landmarks = self.landmarks.iter().map(|&i| vertex_of[i as usize]).collect();
        let mesh = Mesh::new(draft.points, draft.faces).expect("remeshing keeps indices in range");
        Ok(Body { mesh, landmarks, template_vertices: draft.dense })
    }

    /// For every vertex of `source` the vertex of `target` nearest to it on the species' surface at rest, or
    /// [`UNMATCHED`] where damage took that part of the target away, `[n_source]`. At landmarks the two points are the same.
    ///
    /// # Panics
    /// If a body is of another species and names template vertices that this one does not have.
    pub fn ground_truth(&self, source: &Body, target: &Body) -> Vec<u32> {
        let limit = 2.5 * self.mean_rest_edge(target);
        let paths = self.neighbors.nearest_sources(&self.rest, &target.template_vertices, limit);
        // Paths along edges overestimate distances; the straight ones decide between the vertices they lead to.
        let nearest = |&vertex: &u32| {
            let place = self.rest[vertex as usize];
            let around = self.neighbors.of(vertex as usize).iter().chain([&vertex]);
            let candidates = around.filter_map(|&i| paths[i as usize].1);
            let distance =
                |i: u32| vec3::distance(place, self.rest[target.template_vertices[i as usize] as usize]);
            paths[vertex as usize].1?;
            candidates.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
        };
        source.template_vertices.par_iter().map(|vertex| nearest(vertex).unwrap_or(UNMATCHED)).collect()
    }

    /// For every vertex of `source` the same point of `target`'s surface: a face and its barycentric coordinates, or
    /// `None` where damage took it away, `[n_source]`. The point is found on the species' surface at rest.
    ///
    /// # Panics
    /// As [`Template::ground_truth`].
    pub fn ground_truth_points(&self, source: &Body, target: &Body) -> Vec<Option<(u32, [f64; 3])>> {
        let nearest = self.ground_truth(source, target);
        let n_target = target.mesh.n_vertices();
        let around = Adjacency::new(n_target, target.mesh.faces());
        let mut faces_of = vec![Vec::new(); n_target];
        for (f, face) in target.mesh.faces().iter().enumerate() {
            face.iter().for_each(|&i| faces_of[i as usize].push(f as u32));
        }
        let rest = |i: u32| self.rest[target.template_vertices[i as usize] as usize];
        let locate = |(&vertex, &near): (&u32, &u32)| {
            (near != UNMATCHED).then_some(())?;
            let p = self.rest[vertex as usize];
            let ring = around.of(near as usize).iter().chain([&near]).flat_map(|&i| &faces_of[i as usize]);
            let candidates = ring.map(|&f| {
                let weights = nearest_in_triangle(p, target.mesh.faces()[f as usize].map(rest));
                let corners = target.mesh.faces()[f as usize].map(rest);
                let q: Vec3 = std::array::from_fn(|i| (0..3).map(|c| weights[c] * corners[c][i]).sum());
                (vec3::distance(p, q), f, weights)
            });
            let best = candidates.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
            Some((best.1, best.2))
        };
        source.template_vertices.par_iter().zip(&nearest).map(locate).collect()
    }

    fn mean_rest_edge(&self, body: &Body) -> f64 {
        let rest = |i: u32| self.rest[body.template_vertices[i as usize] as usize];
        let edges = body.mesh.faces().iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let sum: f64 = edges.map(|(i, j)| vec3::distance(rest(i), rest(j))).sum();
        sum / (3 * body.mesh.n_faces().max(1)) as f64
    }
}

/// Barycentric coordinates of the point of a triangle nearest to `p`.
fn nearest_in_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (vec3::sub(b, a), vec3::sub(c, a), vec3::sub(p, a));
    let (uu, uv, vv) = (vec3::dot(ab, ab), vec3::dot(ab, ac), vec3::dot(ac, ac));
    let (up, vp) = (vec3::dot(ab, ap), vec3::dot(ac, ap));
    let determinant = uu * vv - uv * uv;
    if determinant > 0.0 {
        let (s, t) = ((vv * up - uv * vp) / determinant, (uu * vp - uv * up) / determinant);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return [1.0 - s - t, s, t];
        }
    }
    // Outside: the nearest point is on an edge.
    let on_edge = |from: Vec3, to: Vec3| {
        let (along, offset) = (vec3::sub(to, from), vec3::sub(p, from));
        let t = (vec3::dot(along, offset) / vec3::dot(along, along).max(1e-300)).clamp(0.0, 1.0);
        (vec3::norm(vec3::sub(offset, vec3::scale(along, t))), t)
    };
    let edges = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    let nearest = (0..3).min_by(|&i, &j| edges[i].0.total_cmp(&edges[j].0)).unwrap_or(0);
    let t = edges[nearest].1;
    let mut weights = [0.0; 3];
    weights[nearest] = 1.0 - t;
    weights[(nearest + 1) % 3] = t;
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_point_of_a_triangle_inside_and_outside() {
        let triangle = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(nearest_in_triangle([0.25, 0.25, 1.0], triangle), [0.5, 0.25, 0.25]);
        assert_eq!(nearest_in_triangle([0.5, -1.0, 0.0], triangle), [0.5, 0.5, 0.0]);
        assert_eq!(nearest_in_triangle([-1.0, 3.0, 0.0], triangle), [0.0, 0.0, 1.0]);
    }
}
