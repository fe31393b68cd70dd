//! Attributes carried over a map.
//!
//! A map gives each source vertex a target vertex, so the source can take whatever the target has, vertex by vertex.
//! The other way round each target vertex takes from the source vertex whose match is nearest on the target. Where
//! neighbours share a match, [`Donors::interpolated`] finds places within the giver's triangles.

use super::blend::{Blend, blends};
use super::error::{RenderError, check_target};
use super::uv::corner_uvs;
use crate::io::{Attributes, IntegerField, Skin};
use crate::mesh::{Topology, vec3};
use crate::point_map::PointMap;
use crate::{Matrix, Mesh};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// For each receiving vertex the giving vertex, if it has one, and where it was interpolated the place near it.
#[derive(Clone, Debug, PartialEq)]
pub struct Donors {
    nearest: Vec<Option<u32>>,
    /// The giver's corners and their weights, where they are not one vertex.
    places: Vec<Option<Place>>,
}

/// A place in a triangle of the giver.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    blend: Blend,
    corners: [u32; 3],
}

impl Donors {
    /// The source receives: each vertex from its match.
    pub fn of_source(map: &PointMap) -> Self {
        Self::new(map.iter().collect())
    }

    /// The target receives: each vertex from the source vertex whose match is nearest along the edges; of several
    /// that match the same vertex, from the one of the lowest index.
    ///
    /// # Errors
    /// If a match is no vertex of the target.
    pub fn of_target(map: &PointMap, target: &Mesh) -> Result<Self, RenderError> {
        check_target(map, target)?;
        let mut donor: Vec<Option<u32>> = vec![None; target.n_vertices()];
        let mut distance = vec![f64::INFINITY; target.n_vertices()];
        let mut queue = BinaryHeap::new();
        for (source, matched) in map.iter().enumerate() {
            if let Some(vertex) = matched.filter(|&t| donor[t as usize].is_none()) {
                donor[vertex as usize] = Some(source as u32);
                distance[vertex as usize] = 0.0;
                queue.push(Reverse((Ordered(0.0), vertex)));
            }
        }
        let adjacency = Topology::new(target).adjacency();
        while let Some(Reverse((Ordered(d), v))) = queue.pop() {
            if d > distance[v as usize] {
                continue;
            }
            for &w in adjacency.of(v as usize) {
                let edge = vec3::distance(target.vertices()[v as usize], target.vertices()[w as usize]);
                if d + edge < distance[w as usize] {
                    distance[w as usize] = d + edge;
                    donor[w as usize] = donor[v as usize];
                    queue.push(Reverse((Ordered(d + edge), w)));
                }
            }
        }
        Ok(Self::new(donor))
    }

    fn new(nearest: Vec<Option<u32>>) -> Self {
        Self { places: vec![None; nearest.len()], nearest }
    }

    /// The same with places within the giver's triangles where neighbouring vertices share a donor: the receiver is
    /// finer than the giver, or the map is blurred, and values would come out in steps. Vertices with a donor of
    /// their own keep it.
    ///
    /// # Errors
    /// If the meshes are not those of the donors.
    pub fn interpolated(self, receiver: &Mesh, giver: &Mesh) -> Result<Self, RenderError> {
        self.check(receiver, giver)?;
        let place = |blend: Blend| Place { blend, corners: giver.faces()[blend.face as usize] };
        let places = blends(&self, receiver, giver).into_iter().map(|blend| blend.map(place)).collect();
        Ok(Self { places, ..self })
    }

    /// The same with the places on the target's surface that the map itself names ([`PointMap::points`]), where the
    /// source receives; as it is for a map without.
    ///
    /// # Errors
    /// If a place is on no triangle of the target.
    pub fn on_surface(mut self, map: &PointMap, target: &Mesh) -> Result<Self, RenderError> {
        let n_faces = target.n_faces();
        let named = map.points.iter().flatten().flatten().map(|point| point.face);
        if let Some(face) = named.into_iter().find(|&face| face as usize >= n_faces) {
            return Err(RenderError::Face { face, n_faces });
        }
        for (place, point) in self.places.iter_mut().zip(map.points.iter().flatten()) {
            *place = point.map(|point| Place {
                blend: Blend { face: point.face, weights: point.weights },
                corners: target.faces()[point.face as usize],
            });
        }
        Ok(self)
    }

    /// Checks that the donors are of these meshes.
    pub(super) fn check(&self, receiver: &Mesh, giver: &Mesh) -> Result<(), RenderError> {
        if self.len() != receiver.n_vertices() {
            return Err(RenderError::Receiver { found: self.len(), n_receiver: receiver.n_vertices() });
        }
        self.check_giver(giver.n_vertices())
    }

    /// Checks that so many vertices are enough to give from.
    fn check_giver(&self, n_giver: usize) -> Result<(), RenderError> {
        let corners = self.places.iter().flatten().flat_map(|place| place.corners);
        let vertices = self.nearest.iter().flatten().copied().chain(corners).map(|v| v as usize);
        match vertices.max().filter(|&vertex| vertex >= n_giver) {
            Some(vertex) => Err(RenderError::Giver { vertex, n_giver }),
            None => Ok(()),
        }
    }

    /// Number of receiving vertices.
    pub fn len(&self) -> usize {
        self.nearest.len()
    }

    /// Whether there are no receiving vertices.
    pub fn is_empty(&self) -> bool {
        self.nearest.is_empty()
    }

    /// The giving vertex of each receiving vertex in turn.
    pub fn iter(&self) -> impl Iterator<Item = Option<u32>> + '_ {
        self.nearest.iter().copied()
    }

    /// The giving vertex of a receiving one.
    pub(super) fn vertex(&self, receiving: usize) -> Option<u32> {
        self.nearest[receiving]
    }

    /// The place that a receiving vertex takes from, where it was interpolated.
    pub(super) fn blend(&self, receiving: usize) -> Option<Blend> {
        self.places[receiving].map(|place| place.blend)
    }

    /// The vertex that each receiving vertex takes values from that cannot be mixed: the corner of the largest weight.
    pub fn nearest_vertices(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        self.shares().map(|shares| {
            let largest = |[a, b, c]: [(usize, f64); 3]| {
                let first = if b.1 > a.1 { b } else { a };
                if c.1 > first.1 { c.0 } else { first.0 }
            };
            shares.map(largest)
        })
    }

    /// Vertices and weights that each receiving vertex takes from; `None` without a match.
    fn shares(&self) -> impl Iterator<Item = Option<[(usize, f64); 3]>> + '_ {
        self.nearest.iter().zip(&self.places).map(|(nearest, place)| match place {
            Some(Place { blend, corners }) => {
                Some([0, 1, 2].map(|i| (corners[i] as usize, blend.weights[i])))
            }
            None => nearest.map(|d| [(d as usize, 1.0), (d as usize, 0.0), (d as usize, 0.0)]),
        })
    }
}

/// `sum w value`, where vertices without weight do not count, whatever their value.
fn weighted(shares: [(usize, f64); 3], value: impl Fn(usize) -> f64) -> f64 {
    shares.into_iter().filter(|&(_, w)| w > 0.0).map(|(v, w)| w * value(v)).sum()
}

/// A distance, never NaN, as a key of the queue.
#[derive(PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Rows of `values`, `[n_giver, q]`, for the receiving vertices, `[n_receiver, q]`; NaN where there is no match.
/// Labels want [`Donors::nearest_vertices`] instead.
///
/// # Errors
/// If a donor has no row.
pub fn transfer_values(values: &Matrix, donors: &Donors) -> Result<Matrix, RenderError> {
    donors.check_giver(values.rows())?;
    let shares: Vec<_> = donors.shares().collect();
    Ok(Matrix::from_fn(shares.len(), values.cols(), |i, j| {
        shares[i].map_or(f64::NAN, |shares| weighted(shares, |v| values[(v, j)]))
    }))
}

/// For each landmark of the giver the receiving vertex that takes from nearest to it, if any does.
///
/// # Errors
/// If a landmark is no vertex of the giver, or the donors are not those of both meshes.
pub fn transfer_landmarks(
    landmarks: &[u32],
    giver: &Mesh,
    receiver: &Mesh,
    donors: &Donors,
) -> Result<Vec<Option<u32>>, RenderError> {
    donors.check(receiver, giver)?;
    let n_giver = giver.n_vertices();
    if let Some(vertex) = landmarks.iter().map(|&l| l as usize).find(|&l| l >= n_giver) {
        return Err(RenderError::Giver { vertex, n_giver });
    }
    let place = |landmark: u32| {
        let at = giver.vertices()[landmark as usize];
        let candidates = (0..receiver.n_vertices() as u32).zip(donors.iter());
        candidates
            .filter_map(|(v, donor)| Some((vec3::distance(giver.vertices()[donor? as usize], at), v)))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, v)| v)
    };
    Ok(landmarks.iter().map(|&l| place(l)).collect())
}

/// Colours, texture coordinates, scalar fields and skin weights of the giver, for the receiver's vertices and corners.
///
/// Vertices without a match are grey, NaN, -1 (0 where the type has no sign) and without weights, triangles without
/// any at the texture's origin. At a seam of the giver's texture a vertex has several coordinates; each receiving
/// triangle takes those of one side, so that no triangle spans the seam.
///
/// # Errors
/// If the attributes are not those of the giver, or the donors not those of both meshes.
pub fn transfer_attributes(
    giver: &Mesh,
    attributes: &Attributes,
    receiver: &Mesh,
    donors: &Donors,
) -> Result<Attributes, RenderError> {
    donors.check(receiver, giver)?;
    attributes.check(giver).map_err(|(problem, remedy)| RenderError::Attributes { problem, remedy })?;
    let color = |colors: &[[u8; 4]], shares: Option<[(usize, f64); 3]>| {
        let mixed = |shares| [0, 1, 2, 3].map(|c| weighted(shares, |v| colors[v][c].into()).round() as u8);
        shares.map_or(super::UNMATCHED_COLOR, mixed)
    };
    let scalar = |values: &[f64], shares: Option<[(usize, f64); 3]>| {
        shares.map_or(f64::NAN, |shares| weighted(shares, |v| values[v]))
    };
    let scalars = attributes.vertex_scalars.iter();
    Ok(Attributes {
        vertex_colors: attributes
            .vertex_colors
            .as_ref()
            .map(|c| donors.shares().map(|s| color(c, s)).collect()),
        corner_uvs: attributes.corner_uvs.as_ref().map(|uvs| corner_uvs(giver, uvs, receiver, donors)),
        texture: attributes.texture.clone(),
        vertex_scalars: scalars
            .map(|(name, values)| (name.clone(), donors.shares().map(|s| scalar(values, s)).collect()))
            .collect(),
        vertex_integers: attributes
            .vertex_integers
            .iter()
            .map(|field| transfer_integers(field, donors))
            .collect(),
        skin: attributes.skin.as_ref().map(|skin| transfer_skin(skin, donors)),
    })
}

/// Integers are names, not quantities: each vertex takes those of the nearest giving vertex; `missing` without a match.
fn transfer_integers(field: &IntegerField, donors: &Donors) -> IntegerField {
    let values = donors.nearest_vertices().map(|v| v.map_or(field.kind.missing(), |v| field.values[v]));
    IntegerField { name: field.name.clone(), kind: field.kind, values: values.collect() }
}

/// The four largest of the weights that come together at each vertex, with the same sum.
fn transfer_skin(skin: &Skin, donors: &Donors) -> Skin {
    let of_vertex = |shares: Option<[(usize, f64); 3]>| {
        let mut joints: Vec<(u16, f64)> = Vec::new();
        for (v, share) in shares.into_iter().flatten() {
            for (&joint, &weight) in skin.indices[v].iter().zip(&skin.weights[v]) {
                let weight = share * f64::from(weight);
                match joints.iter_mut().find(|(known, _)| *known == joint) {
                    Some((_, sum)) => *sum += weight,
                    None if weight > 0.0 => joints.push((joint, weight)),
                    None => {}
                }
            }
        }
        joints.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let sum = |joints: &[(u16, f64)]| joints.iter().map(|j| j.1).sum::<f64>();
        let all = sum(&joints);
        joints.truncate(4);
        let factor = if joints.is_empty() { 0.0 } else { all / sum(&joints) };
        joints.resize(4, (0, 0.0));
        ([0, 1, 2, 3].map(|i| joints[i].0), [0, 1, 2, 3].map(|i| (joints[i].1 * factor) as f32))
    };
    let (indices, weights) = donors.shares().map(of_vertex).unzip();
    Skin { joints: skin.joints.clone(), indices, weights }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{grid, icosphere, permuted};

    #[test]
    fn a_permutation_carries_everything_to_its_place_and_back() {
        let giver = icosphere(2);
        let (receiver, permutation) = permuted(&giver, 3);
        let donor_of: Vec<u32> = (0..receiver.n_vertices())
            .map(|v| giver.vertices().iter().position(|p| *p == receiver.vertices()[v]).unwrap() as u32)
            .collect();
        assert_eq!(permutation.len(), donor_of.len());
        let map = PointMap::new(donor_of.clone(), giver.n_vertices());
        let values = Matrix::from_fn(giver.n_vertices(), 2, |i, j| (2 * i + j) as f64);
        let moved = transfer_values(&values, &Donors::of_source(&map)).unwrap();
        assert!((0..moved.rows()).all(|v| moved.row(v) == values.row(donor_of[v] as usize)));
        let back = transfer_values(&moved, &Donors::of_target(&map, &giver).unwrap()).unwrap();
        assert_eq!(back, values);
        let landmarks =
            transfer_landmarks(&donor_of[..5], &giver, &receiver, &Donors::of_source(&map)).unwrap();
        assert_eq!(landmarks, (0..5).map(Some).collect::<Vec<_>>());
    }

    #[test]
    fn vertices_that_nothing_maps_to_take_from_the_nearest() {
        let mesh = grid(10, 10);
        let map = PointMap::new(vec![0, 99, PointMap::UNMATCHED], 100);
        let donors = Donors::of_target(&map, &mesh).unwrap();
        let corner = |v: usize, w: u32| vec3::distance(mesh.vertices()[v], mesh.vertices()[w as usize]);
        for (v, donor) in donors.iter().enumerate() {
            let nearer = if corner(v, 0) < corner(v, 99) { 0 } else { 1 };
            let tie = (corner(v, 0) - corner(v, 99)).abs() < 0.3;
            assert!(tie || donor == Some(nearer), "vertex {v} takes from {donor:?}");
        }
    }

    #[test]
    fn labels_are_never_mixed() {
        let (coarse, fine) = (icosphere(1), icosphere(3));
        let n = coarse.n_vertices();
        let labels: Vec<i64> =
            coarse.vertices().iter().map(|p| if p[0] > 0.0 { 16_777_217 } else { 11 }).collect();
        let field = IntegerField { name: "label".into(), kind: crate::io::IntegerKind::I32, values: labels };
        let mut nearest = crate::mesh::nearest_vertices(coarse.vertices(), fine.vertices());
        nearest[7] = PointMap::UNMATCHED;
        let donors = Donors::of_source(&PointMap::new(nearest, n)).interpolated(&fine, &coarse).unwrap();
        let given = Attributes { vertex_integers: vec![field.clone()], ..Attributes::default() };
        let moved = &transfer_attributes(&coarse, &given, &fine, &donors).unwrap().vertex_integers[0];
        assert_eq!((moved.kind, moved.values.len(), moved.values[7]), (field.kind, fine.n_vertices(), -1));
        for (v, label) in moved.values.iter().enumerate().filter(|(v, _)| *v != 7) {
            let x = fine.vertices()[v][0];
            assert!([11, 16_777_217].contains(label));
            assert!(x.abs() < 0.4 || (*label == 11) == (x < 0.0), "vertex {v} at {x}: {label}");
        }
    }

    #[test]
    fn skin_weights_of_several_vertices_come_together() {
        let joint = |_| crate::io::Joint { name: String::new(), parent: None, frame: [[0.0; 4]; 4] };
        let (coarse, fine) = (icosphere(1), icosphere(3));
        let n = coarse.n_vertices();
        let skin = Skin {
            joints: (0..n).map(joint).collect(),
            indices: (0..n as u16).map(|v| [v, (v + 1) % n as u16, (v + 2) % n as u16, 0]).collect(),
            weights: vec![[0.5, 0.25, 0.25, 0.0]; n],
        };
        let nearest = crate::mesh::nearest_vertices(coarse.vertices(), fine.vertices());
        let donors = Donors::of_source(&PointMap::new(nearest, n)).interpolated(&fine, &coarse).unwrap();
        let moved = transfer_skin(&skin, &donors);
        assert!(
            moved
                .weights
                .iter()
                .all(|w| (w.iter().sum::<f32>() - 1.0).abs() < 1e-5 && w.is_sorted_by(|a, b| a >= b))
        );
        assert!(moved.weights.iter().any(|w| w[3] > 0.0));
    }
}
