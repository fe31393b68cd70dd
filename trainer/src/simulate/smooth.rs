//! A finer triangulation of a smooth surface through the vertices of a mesh.

use super::visibility::vertex_normals;
use fmnet::Mesh;
use fmnet::mesh::vec3;
use std::collections::HashMap;

/// The middle of an edge moves by at most this share of the edge's length; where normals say more there is a crease.
const MOST: f64 = 0.15;

/// Splits every triangle in four. The new vertices lie on curves through the old ones, perpendicular to their normals
/// (Vlachos et al. 2001, Curved PN triangles: the middle of a cubic edge), so that the facets of the mesh, which
/// would tell where its vertices were, turn into a rounded surface of no smaller volume.
pub(super) fn refine(mesh: &Mesh) -> Mesh {
    let normals = vertex_normals(mesh);
    let mut vertices = mesh.vertices().to_vec();
    let mut middles: HashMap<(u32, u32), u32> = HashMap::with_capacity(3 * mesh.n_faces() / 2);
    let mut faces = Vec::with_capacity(4 * mesh.n_faces());
    for &[a, b, c] in mesh.faces() {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
            let (i, j) = (i.min(j), i.max(j));
            *middles.entry((i, j)).or_insert_with(|| {
                let ends = [i, j].map(|v| (mesh.vertices()[v as usize], normals[v as usize]));
                vertices.push(middle(ends));
                vertices.len() as u32 - 1
            })
        });
        faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    Mesh::new(vertices, faces).expect("middles of finite vertices are finite")
}

fn middle([(p, normal_p), (q, normal_q)]: [([f64; 3], [f64; 3]); 2]) -> [f64; 3] {
    let edge = vec3::sub(q, p);
    let bend = vec3::sub(
        vec3::scale(normal_q, vec3::dot(edge, normal_q)),
        vec3::scale(normal_p, vec3::dot(edge, normal_p)),
    );
    let (length, most) = (vec3::norm(bend) / 8.0, MOST * vec3::norm(edge));
    let factor = if length > most { most / length } else { 1.0 };
    vec3::add(vec3::scale(vec3::add(p, q), 0.5), vec3::scale(bend, factor / 8.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmnet::mesh::shapes::{grid, icosphere};

    #[test]
    fn refined_ball_is_rounder_and_a_plane_stays_flat() {
        let (ball, fine) = (icosphere(2), refine(&icosphere(2)));
        let lowest = |mesh: &Mesh| {
            let centroids = (0..mesh.n_faces()).map(|f| {
                let [a, b, c] = mesh.corners(f);
                vec3::norm(vec3::scale(vec3::add(a, vec3::add(b, c)), 1.0 / 3.0))
            });
            1.0 - centroids.fold(f64::INFINITY, f64::min)
        };
        assert_eq!(fine.n_faces(), 4 * ball.n_faces());
        assert!(lowest(&fine) < 0.4 * lowest(&ball));
        assert!(refine(&grid(4, 3)).vertices().iter().all(|p| p[2] == 0.0));
    }
}
