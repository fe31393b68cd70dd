//! Edge flips towards a Delaunay triangulation, on nearly flat parts only, so that the surface stays where it is.

use std::collections::HashMap;

use fmnet::mesh::vec3;

use super::math::{Vec3, unit};

/// Edges whose two triangles are bent by more than this are kept: cosine of 30 degrees.
const FLAT: f64 = 0.866;
/// Most flips per face; stops cycles on surfaces that are not flat.
const FLIPS_PER_FACE: usize = 4;

/// Flips the edges of a closed manifold mesh whose opposite angles sum to more than pi.
pub(super) fn delaunay_flips(points: &[Vec3], faces: &mut [[u32; 3]]) {
    let mut face_of: HashMap<(u32, u32), u32> = HashMap::with_capacity(3 * faces.len());
    for (f, &[a, b, c]) in faces.iter().enumerate() {
        for edge in [(a, b), (b, c), (c, a)] {
            face_of.insert(edge, f as u32);
        }
    }
    let mut queue: Vec<(u32, u32)> =
        faces.iter().rev().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).filter(|(a, b)| a < b).collect();
    let mut budget = FLIPS_PER_FACE * faces.len();
    while let Some((a, b)) = queue.pop() {
        let (Some(&left), Some(&right)) = (face_of.get(&(a, b)), face_of.get(&(b, a))) else { continue };
        let (c, d) = (opposite(faces[left as usize], a, b), opposite(faces[right as usize], a, b));
        if budget == 0 || face_of.contains_key(&(c, d)) || face_of.contains_key(&(d, c)) {
            continue;
        }
        if !better_flipped([a, b, c, d].map(|i| points[i as usize])) {
            continue;
        }
        budget -= 1;
        faces[left as usize] = [c, a, d];
        faces[right as usize] = [d, b, c];
        face_of.remove(&(a, b));
        face_of.remove(&(b, a));
        for (edge, f) in [
            ((c, a), left),
            ((a, d), left),
            ((d, c), left),
            ((d, b), right),
            ((b, c), right),
            ((c, d), right),
        ] {
            face_of.insert(edge, f);
        }
        queue.extend([(a, c), (a, d), (b, c), (b, d)].map(|(i, j)| (i.min(j), i.max(j))));
    }
}

fn opposite(face: [u32; 3], a: u32, b: u32) -> u32 {
    face.into_iter().find(|&i| i != a && i != b).unwrap_or(a)
}

/// Whether the edge `a b` of the triangles `a b c` and `b a d` should become `c d`.
fn better_flipped([a, b, c, d]: [Vec3; 4]) -> bool {
    let normal = |p: Vec3, q: Vec3, r: Vec3| vec3::cross(vec3::sub(q, p), vec3::sub(r, p));
    let (left, right) = (normal(a, b, c), normal(b, a, d));
    let cotangent =
        |apex: Vec3, area: Vec3| vec3::dot(vec3::sub(a, apex), vec3::sub(b, apex)) / vec3::norm(area);
    if cotangent(c, left) + cotangent(d, right) >= -1e-9 || vec3::dot(unit(left), unit(right)) < FLAT {
        return false;
    }
    let mean = unit(vec3::add(unit(left), unit(right)));
    let flipped = [normal(c, a, d), normal(d, b, c)];
    flipped.iter().all(|&n| vec3::dot(unit(n), mean) > FLAT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_diagonal_of_a_flat_quadrilateral_is_flipped() {
        let points = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, -0.3, 0.0]];
        let mut faces = [[0, 1, 2], [1, 0, 3]];
        delaunay_flips(&points, &mut faces);
        assert!(faces.iter().all(|face| face.contains(&2) && face.contains(&3)));
    }
}
