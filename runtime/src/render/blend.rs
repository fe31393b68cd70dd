//! Places within triangles: what a vertex map says where several neighbours share a match.

use super::Donors;
use crate::Mesh;
use crate::mesh::{Topology, vec3};

/// Rounds of averaging: enough to level the steps of a giver four times as coarse as the receiver.
const ROUNDS: usize = 4;

/// A point of the giver's surface: a triangle and barycentric weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Blend {
    pub(super) face: u32,
    pub(super) weights: [f64; 3],
}

/// For each receiving vertex that shares its donor with a neighbour the place within the giver's triangles where it
/// belongs.
///
/// Neighbours that share a donor are steps: the receiver is finer than the giver, or the map blurred. Their places
/// are averaged with those of the neighbours whose donors are the same or adjacent, a few times, and put back on the
/// surface around the donor. Vertices with a donor of their own stay where they are, so an exact map is not touched.
pub(super) fn blends(donors: &Donors, receiver: &Mesh, giver: &Mesh) -> Vec<Option<Blend>> {
    let donor: Vec<Option<u32>> = donors.iter().collect();
    let (of_receiver, topology) = (Topology::new(receiver).adjacency(), Topology::new(giver));
    let of_giver = topology.adjacency();
    let shares =
        |v: usize| donor[v].is_some() && of_receiver.of(v).iter().any(|&w| donor[w as usize] == donor[v]);
    let sharing: Vec<usize> = (0..donor.len()).filter(|&v| shares(v)).collect();
    let near = |v: usize, w: usize| {
        let (Some(a), Some(b)) = (donor[v], donor[w]) else { return false };
        a == b || of_giver.of(a as usize).contains(&b)
    };
    let place = |d: &Option<u32>| d.map_or([0.0; 3], |d| giver.vertices()[d as usize]);
    let mut places: Vec<[f64; 3]> = donor.iter().map(place).collect();
    for _ in 0..ROUNDS {
        let mean = |&v: &usize| {
            let around = of_receiver.of(v).iter().map(|&w| w as usize).filter(|&w| near(v, w));
            let (sum, count) = around.fold((places[v], 1.0), |(s, n), w| (vec3::add(s, places[w]), n + 1.0));
            vec3::scale(sum, 1.0 / count)
        };
        let moved: Vec<[f64; 3]> = sharing.iter().map(mean).collect();
        sharing.iter().zip(moved).for_each(|(&v, place)| places[v] = place);
    }
    let faces_of = faces_around(giver);
    let mut blends = vec![None; donor.len()];
    for v in sharing {
        let Some(d) = donor[v].map(|d| d as usize) else { continue };
        let around = std::iter::once(d as u32).chain(of_giver.of(d).iter().copied());
        let candidates = around.flat_map(|w| faces_of[w as usize].iter().copied());
        let on = |face: u32| {
            let corners = giver.corners(face as usize);
            let weights = closest_point(places[v], corners);
            (vec3::distance(combine(weights, corners), places[v]), Blend { face, weights })
        };
        blends[v] = candidates.map(on).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, blend)| blend);
    }
    blends
}

pub(super) fn faces_around(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut faces = vec![Vec::new(); mesh.n_vertices()];
    for (f, face) in mesh.faces().iter().enumerate() {
        face.iter().for_each(|&v| faces[v as usize].push(f as u32));
    }
    faces
}

pub(super) fn combine(weights: [f64; 3], corners: [[f64; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = [0, 1, 2].map(|i| vec3::scale(corners[i], weights[i]));
    vec3::add(vec3::add(a, b), c)
}

/// Barycentric weights of the point of a triangle that is closest to `p`: inside, or on the closest side.
pub(super) fn closest_point(p: [f64; 3], corners: [[f64; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = corners;
    let normal = vec3::cross(vec3::sub(b, a), vec3::sub(c, a));
    let squared = vec3::dot(normal, normal);
    let share = |from: [f64; 3], to: [f64; 3]| {
        vec3::dot(vec3::cross(vec3::sub(to, from), vec3::sub(p, from)), normal) / squared
    };
    let inside = [share(b, c), share(c, a), share(a, b)];
    if squared > 0.0 && inside.iter().all(|w| *w >= 0.0) {
        let sum: f64 = inside.iter().sum();
        return inside.map(|w| w / sum);
    }
    let on_side = |i: usize| {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        let (edge, length) = (vec3::sub(to, from), vec3::distance(from, to));
        let t = if length > 0.0 { vec3::dot(vec3::sub(p, from), edge) / (length * length) } else { 0.0 };
        let t = t.clamp(0.0, 1.0);
        let mut weights = [0.0; 3];
        (weights[i], weights[(i + 1) % 3]) = (1.0 - t, t);
        (vec3::distance(combine(weights, corners), p), weights)
    };
    let sides = [on_side(0), on_side(1), on_side(2)];
    sides.into_iter().min_by(|x, y| x.0.total_cmp(&y.0)).map_or([1.0, 0.0, 0.0], |(_, weights)| weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::mesh::nearest_vertices;
    use crate::mesh::shapes::icosphere;
    use crate::point_map::PointMap;
    use crate::render::transfer_values;

    #[test]
    fn closest_points_of_a_triangle() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(closest_point([0.25, 0.25, 3.0], corners), [0.5, 0.25, 0.25]);
        assert_eq!(closest_point([-1.0, -1.0, 0.0], corners), [1.0, 0.0, 0.0]);
        assert_eq!(closest_point([0.5, -2.0, 0.0], corners), [0.5, 0.5, 0.0]);
        assert_eq!(closest_point([0.0, 0.5, -1.0], corners), [0.5, 0.0, 0.5]);
        assert_eq!(closest_point([2.0, 0.0, 0.0], [[1.0, 0.0, 0.0]; 3]), [1.0, 0.0, 0.0]);
    }

    /// The coordinates of a coarse sphere on a fine one: interpolated, they are much nearer to the fine one's own.
    #[test]
    fn steps_of_a_coarse_giver_are_levelled() {
        let (fine, coarse) = (icosphere(4), icosphere(2));
        let nearest = nearest_vertices(coarse.vertices(), fine.vertices());
        let donors = Donors::of_source(&PointMap::new(nearest, coarse.n_vertices()));
        let values = Matrix::from_fn(coarse.n_vertices(), 3, |i, j| coarse.vertices()[i][j]);
        let error = |donors: &Donors| {
            let moved = transfer_values(&values, donors).unwrap();
            let squared =
                |v: usize| (0..3).map(|j| (moved[(v, j)] - fine.vertices()[v][j]).powi(2)).sum::<f64>();
            ((0..fine.n_vertices()).map(squared).sum::<f64>() / fine.n_vertices() as f64).sqrt()
        };
        let (steps, smooth) = (error(&donors), error(&donors.clone().interpolated(&fine, &coarse).unwrap()));
        assert!(smooth < 0.5 * steps, "{smooth} interpolated, {steps} from the nearest vertex");
    }

    #[test]
    fn an_exact_map_is_not_touched() {
        let mesh = icosphere(2);
        let donors = Donors::of_source(&PointMap::new((0..162).collect(), 162));
        assert_eq!(donors.clone().interpolated(&mesh, &mesh).unwrap(), donors);
    }
}
