//! Texture coordinates over a map, with no triangle across a seam.
//!
//! A texture's coordinates belong to corners, not to vertices: along a seam a vertex has one for each side. A
//! receiving triangle must take all three of its own from one side, or the whole of the image between both sides is
//! squeezed into it.

use super::Donors;
use super::blend::{Blend, closest_point, combine, faces_around};
use crate::Mesh;
use crate::mesh::vec3;

type Uv = [f32; 2];

/// A triangle may be stretched so much more than the giver's there (squared: four times in length) before it counts
/// as across a seam.
const MOST_STRETCHED: f64 = 16.0;

/// A place with weights as near to 0 or 1 as this is on an edge or at a corner.
const AT: f64 = 1e-6;

/// Texture coordinates `[m_receiver, 3, 2]` from the giver's `[m_giver, 3, 2]`.
///
/// Triangles whose donors are the corners of a giver's triangle take its coordinates as they are. Others take those
/// that their corners have in one chart of the texture, if that does not lead across a seam within the chart; else
/// the closest ones on the side of the seam that their middle is on. Corners without a match take another corner's,
/// triangles without any are at the origin.
pub(super) fn corner_uvs(giver: &Mesh, uvs: &[[Uv; 3]], receiver: &Mesh, donors: &Donors) -> Vec<[Uv; 3]> {
    let giver = Giver::new(giver, uvs);
    let spots: Vec<Option<Spot>> = (0..donors.len()).map(|v| giver.spot(donors, v)).collect();
    let triangle = |face: &[u32; 3]| {
        let found = face.map(|v| spots[v as usize]);
        match found.iter().flatten().next() {
            Some(&any) => giver.triangle(found.map(|spot| spot.unwrap_or(any))),
            None => [[0.0; 2]; 3],
        }
    };
    receiver.faces().iter().map(triangle).collect()
}

/// Where a receiving vertex lies on the giver.
#[derive(Clone, Copy)]
struct Spot {
    point: [f64; 3],
    /// The giver's vertex nearby.
    vertex: u32,
    /// The place within a triangle, where it is not the vertex itself.
    blend: Option<Blend>,
}

struct Giver<'a> {
    mesh: &'a Mesh,
    uvs: &'a [[Uv; 3]],
    faces_of: Vec<Vec<u32>>,
    /// The coordinates of each vertex, and which chart they are in.
    of_vertex: Vec<Vec<(Uv, u32)>>,
    chart_of_face: Vec<u32>,
    /// For each vertex how much its triangles are stretched at most: squared sides in the texture over those on the
    /// surface.
    stretch: Vec<f64>,
}

impl<'a> Giver<'a> {
    fn new(mesh: &'a Mesh, uvs: &'a [[Uv; 3]]) -> Self {
        let chart_of_face = charts(mesh, uvs);
        let mut of_vertex: Vec<Vec<(Uv, u32)>> = vec![Vec::new(); mesh.n_vertices()];
        let mut stretch = vec![0.0f64; mesh.n_vertices()];
        for (f, (face, corners)) in mesh.faces().iter().zip(uvs).enumerate() {
            let size = sides(mesh.corners(f));
            for (&v, &uv) in face.iter().zip(corners) {
                let known = &mut of_vertex[v as usize];
                if !known.iter().any(|(other, _)| *other == uv) {
                    known.push((uv, chart_of_face[f]));
                }
                if size > 0.0 {
                    stretch[v as usize] = stretch[v as usize].max(extent(*corners) / size);
                }
            }
        }
        Self { mesh, uvs, faces_of: faces_around(mesh), of_vertex, chart_of_face, stretch }
    }

    fn spot(&self, donors: &Donors, receiving: usize) -> Option<Spot> {
        let mut vertex = donors.vertex(receiving)?;
        let mut blend = donors.blend(receiving);
        // A place at a corner is that vertex, with the coordinates of all sides of a seam.
        if let Some((corner, face)) = blend.and_then(|b| Some((corner_of(b.weights)?, b.face))) {
            vertex = self.mesh.faces()[face as usize][corner];
            blend = None;
        }
        let point = match blend {
            Some(blend) => combine(blend.weights, self.mesh.corners(blend.face as usize)),
            None => self.mesh.vertices()[vertex as usize],
        };
        Some(Spot { point, vertex, blend })
    }

    fn triangle(&self, spots: [Spot; 3]) -> [Uv; 3] {
        if let Some(uvs) = self.own_triangle(&spots) {
            return uvs;
        }
        let choices = [0, 1, 2].map(|i| self.choices(&spots[i]));
        let chosen = closest_together([&choices[0], &choices[1], &choices[2]]);
        chosen.filter(|uvs| self.fits(*uvs, &spots)).unwrap_or_else(|| self.on_one_side(&spots))
    }

    /// The coordinates of the giver's triangle that has the three spots as its corners.
    fn own_triangle(&self, spots: &[Spot; 3]) -> Option<[Uv; 3]> {
        if spots.iter().any(|spot| spot.blend.is_some()) {
            return None;
        }
        let around = &self.faces_of[spots[0].vertex as usize];
        around.iter().find_map(|&f| {
            let face = self.mesh.faces()[f as usize];
            let corner = |spot: &Spot| face.iter().position(|&v| v == spot.vertex);
            let [a, b, c] = [corner(&spots[0])?, corner(&spots[1])?, corner(&spots[2])?];
            (a != b && b != c && c != a).then(|| [a, b, c].map(|i| self.uvs[f as usize][i]))
        })
    }

    /// The coordinates that a spot may have: one within a triangle, on an edge or at a vertex one for each side of a
    /// seam.
    fn choices(&self, spot: &Spot) -> Vec<(Uv, u32)> {
        let Some(blend) = spot.blend else { return self.of_vertex[spot.vertex as usize].clone() };
        let on = |blend: Blend| (self.within(blend), self.chart_of_face[blend.face as usize]);
        std::iter::once(blend).chain(self.across_the_edge(blend)).map(on).collect()
    }

    /// The same place in the other triangles of the edge that it is on.
    fn across_the_edge(&self, Blend { face, weights }: Blend) -> Vec<Blend> {
        let Some(outer) = weights.iter().position(|&w| w < AT) else { return Vec::new() };
        let [a, b] = [(outer + 1) % 3, (outer + 2) % 3];
        let corners = self.mesh.faces()[face as usize];
        let in_other = |&other: &u32| {
            let there = self.mesh.faces()[other as usize];
            let at = |corner: usize| there.iter().position(|&v| v == corners[corner]);
            let mut moved = [0.0; 3];
            (moved[at(a)?], moved[at(b)?]) = (weights[a], weights[b]);
            Some(Blend { face: other, weights: moved })
        };
        let around = &self.faces_of[corners[a] as usize];
        around.iter().filter(|&&other| other != face).filter_map(in_other).collect()
    }

    fn within(&self, blend: Blend) -> Uv {
        let corners = self.uvs[blend.face as usize];
        [0, 1].map(|c| (0..3).map(|i| blend.weights[i] * f64::from(corners[i][c])).sum::<f64>() as f32)
    }

    /// Whether coordinates that far from each other belong to places that near to each other.
    fn fits(&self, uvs: [Uv; 3], spots: &[Spot; 3]) -> bool {
        let stretch = spots.iter().map(|spot| self.stretch[spot.vertex as usize]).fold(0.0, f64::max);
        extent(uvs) <= MOST_STRETCHED * stretch * sides(spots.map(|spot| spot.point))
    }

    /// Coordinates from the triangles around that are on one side of the seam, the one that the middle of the spots
    /// is on.
    fn on_one_side(&self, spots: &[Spot; 3]) -> [Uv; 3] {
        let mut around: Vec<u32> =
            spots.iter().flat_map(|spot| self.faces_of[spot.vertex as usize].iter().copied()).collect();
        around.sort_unstable();
        around.dedup();
        let [a, b, c] = spots.map(|spot| spot.point);
        let middle = vec3::scale(vec3::add(vec3::add(a, b), c), 1.0 / 3.0);
        let Some(anchor) = self.closest(middle, &around) else { return [[0.0; 2]; 3] };
        let side = self.side_of(anchor.face, around);
        let from = |faces: &[u32]| spots.map(|s| self.within(self.closest(s.point, faces).unwrap_or(anchor)));
        let uvs = from(&side);
        // Around a pole both sides of a seam hang together.
        if self.fits(uvs, spots) { uvs } else { from(&[anchor.face]) }
    }

    /// The closest place in some triangles; of equally close ones in the first.
    fn closest(&self, point: [f64; 3], faces: &[u32]) -> Option<Blend> {
        let on = |&face: &u32| {
            let corners = self.mesh.corners(face as usize);
            let weights = closest_point(point, corners);
            (vec3::distance(combine(weights, corners), point), Blend { face, weights })
        };
        faces.iter().map(on).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, blend)| blend)
    }

    /// Those of some triangles that hang together with one of them in the texture.
    fn side_of(&self, first: u32, mut others: Vec<u32>) -> Vec<u32> {
        let mut side = vec![first];
        others.retain(|&f| f != first);
        let mut next = 0;
        while let Some(&face) = side.get(next) {
            let (joined, rest) = others.into_iter().partition(|&f| self.share_an_edge(face, f));
            side.extend::<Vec<u32>>(joined);
            others = rest;
            next += 1;
        }
        side
    }

    /// Whether two triangles share two vertices with the same coordinates.
    fn share_an_edge(&self, face: u32, other: u32) -> bool {
        let corners = |f: u32| self.mesh.faces()[f as usize].into_iter().zip(self.uvs[f as usize]);
        corners(face).filter(|a| corners(other).any(|b| *a == b)).count() >= 2
    }
}

/// The chart of each triangle: those hang together that share a vertex with the same coordinates.
fn charts(mesh: &Mesh, uvs: &[[Uv; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..mesh.n_faces() as u32).collect();
    let root = |parent: &mut Vec<u32>, mut f: u32| {
        while parent[f as usize] != f {
            parent[f as usize] = parent[parent[f as usize] as usize];
            f = parent[f as usize];
        }
        f
    };
    let mut first_with = std::collections::HashMap::new();
    for (f, (face, corners)) in mesh.faces().iter().zip(uvs).enumerate() {
        for (&v, uv) in face.iter().zip(corners) {
            let first = *first_with.entry((v, uv.map(f32::to_bits))).or_insert(f as u32);
            let (a, b) = (root(&mut parent, first), root(&mut parent, f as u32));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    (0..mesh.n_faces() as u32).map(|f| root(&mut parent, f)).collect()
}

/// The corner that a place is at.
fn corner_of(weights: [f64; 3]) -> Option<usize> {
    weights.iter().position(|&w| w > 1.0 - AT)
}

/// Sum of the squared sides of a triangle in the texture.
fn extent([a, b, c]: [Uv; 3]) -> f64 {
    let distance = |p: Uv, q: Uv| f64::from(p[0] - q[0]).powi(2) + f64::from(p[1] - q[1]).powi(2);
    distance(a, b) + distance(b, c) + distance(c, a)
}

/// Sum of the squared sides of a triangle in space.
fn sides([a, b, c]: [[f64; 3]; 3]) -> f64 {
    [(a, b), (b, c), (c, a)].into_iter().map(|(p, q)| vec3::distance(p, q).powi(2)).sum()
}

/// Of each corner's choices the ones of one chart that make the smallest triangle in the texture.
fn closest_together(choices: [&[(Uv, u32)]; 3]) -> Option<[Uv; 3]> {
    let mut best: Option<([Uv; 3], f64)> = None;
    for &(a, chart) in choices[0] {
        for &(b, _) in choices[1].iter().filter(|b| b.1 == chart) {
            for &(c, _) in choices[2].iter().filter(|c| c.1 == chart) {
                let size = extent([a, b, c]);
                if best.is_none_or(|(_, smallest)| size < smallest) {
                    best = Some(([a, b, c], size));
                }
            }
        }
    }
    best.map(|(uvs, _)| uvs)
}

#[cfg(test)]
mod tests;
