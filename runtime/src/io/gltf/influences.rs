//! Joints and weights of vertices: any number in the file, four of each vertex in what is kept.

use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Primitive, Semantic};

use super::accessor::Integers;
use super::document::Document;
use super::scene::attribute;
use super::skeleton::Skeleton;
use crate::io::error::{ParseError, Parsed};

/// Sets of four joints beyond this are not looked for.
const MAX_SETS: u32 = 16;

/// Four joints of every vertex, and their weights.
type JointSet = (Vec<[f64; 4]>, Vec<[f32; 4]>);

/// The joints that move each vertex, in the skin's own numbering, with their weights.
pub(super) struct Influences {
    /// For each set of four joints those of every vertex.
    sets: Vec<JointSet>,
}

/// Whether a primitive has joints.
pub(super) fn has_joints(primitive: &Primitive) -> bool {
    accessors(primitive, 0).is_some()
}

fn accessors(primitive: &Primitive, set: u32) -> Option<(Index<Accessor>, Index<Accessor>)> {
    attribute(primitive, Semantic::Joints(set)).zip(attribute(primitive, Semantic::Weights(set)))
}

impl Influences {
    /// Reads all sets of a primitive of `n` vertices.
    pub(super) fn read(document: &Document<'_>, primitive: &Primitive, n: usize) -> Parsed<Self> {
        let mut sets = Vec::new();
        for (joints, weights) in (0..MAX_SETS).map_while(|set| accessors(primitive, set)) {
            let joints = document.read::<4>(joints, Integers::AsStated)?;
            let weights = document.read::<4>(weights, Integers::Fractions)?;
            if joints.len() != n || weights.len() != n {
                return Err(ParseError::part("scene", "joints or weights are not as many as positions"));
            }
            sets.push((joints, weights.iter().map(|w| w.map(|x| x as f32)).collect()));
        }
        Ok(Self { sets })
    }

    /// The joints and weights of a vertex that act.
    fn of(&self, vertex: usize) -> impl Iterator<Item = (f64, f32)> + '_ {
        let each = self
            .sets
            .iter()
            .flat_map(move |(joints, weights)| joints[vertex].into_iter().zip(weights[vertex]));
        each.filter(|&(_, weight)| weight != 0.0)
    }

    /// Where a vertex is, moved by all of its joints.
    pub(super) fn pose(&self, vertex: usize, position: [f64; 3], skeleton: &Skeleton) -> Option<[f64; 3]> {
        skeleton.pose(position, || self.of(vertex))
    }

    /// The four strongest joints of a vertex in the skeleton of the whole file, and whether there are more. With more
    /// the four weights are scaled to a sum of 1; else they stay as they are.
    pub(super) fn strongest(&self, vertex: usize, skeleton: &Skeleton) -> Parsed<([u16; 4], [f32; 4], bool)> {
        let missing = |joint: f64| {
            let joints: Vec<f64> = self.of(vertex).map(|(joint, _)| joint).collect();
            let problem = format!("vertex {vertex} has a joint that does not exist: {joint} of {joints:?}");
            ParseError::part("scene", problem)
        };
        let find = |joint: f64| skeleton.joint(joint).ok_or_else(|| missing(joint));
        let (mut indices, mut kept) = ([0; 4], [0.0f32; 4]);
        if let [(joints, weights)] = &self.sets[..] {
            for c in 0..4 {
                (indices[c], kept[c]) = match (skeleton.joint(joints[vertex][c]), weights[vertex][c]) {
                    (Some(joint), weight) => (joint, weight),
                    (None, 0.0) => (0, 0.0),
                    (None, _) => (find(joints[vertex][c])?, 0.0),
                };
            }
            return Ok((indices, kept, false));
        }
        let mut all = Vec::new();
        for (joint, weight) in self.of(vertex) {
            all.push((find(joint)?, weight));
        }
        // A stable sort: of equal weights the first ones are kept.
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        let has_more = all.len() > 4;
        all.truncate(4);
        let total: f32 = all.iter().map(|(_, weight)| weight).sum();
        for (c, (joint, weight)) in all.into_iter().enumerate() {
            (indices[c], kept[c]) = (joint, if total > 0.0 { weight / total } else { weight });
        }
        Ok((indices, kept, has_more))
    }
}
