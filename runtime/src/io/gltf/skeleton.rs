//! Skins: joints in the pose of the scene, and the matrices that take vertices there.

use std::collections::HashMap;

use gltf::json;
use gltf::json::Index;

use super::accessor::Integers;
use super::document::Document;
use super::matrix4::{self, IDENTITY, Matrix4};
use super::nodes::Nodes;
use crate::io::attributes::Joint;
use crate::io::error::{ParseError, Parsed};

/// A skin's joints, in its own numbering.
pub(super) struct Skeleton {
    /// From the mesh's coordinates to the world's, for each joint.
    matrices: Vec<Matrix4>,
    /// The index of each joint in the skeleton of the whole file.
    joints: Vec<u16>,
}

impl Skeleton {
    /// Loads a skin and adds its joints to those of the file, parents first.
    pub(super) fn load(
        document: &Document<'_>,
        nodes: &Nodes,
        index: Index<json::Skin>,
        joints: &mut Vec<Joint>,
    ) -> Parsed<Self> {
        let fail = |problem: String| ParseError::part(format!("skin {index}"), problem);
        let skin = document.root.get(index).ok_or_else(|| fail("it does not exist".into()))?;
        let node_of_joint: Vec<usize> = skin.joints.iter().map(Index::value).collect();
        if let Some(node) = node_of_joint.iter().find(|&&node| node >= nodes.placed.len()) {
            return Err(fail(format!("its joint, node {node}, does not exist")));
        }
        let bind = bind_matrices(document, skin, index)?;
        let world = |node: usize| &nodes.placed[node].world;
        let matrices =
            node_of_joint.iter().zip(&bind).map(|(&node, bind)| matrix4::product(world(node), bind));
        let parents = parents(nodes, &node_of_joint);
        let order = parents_first(nodes, &node_of_joint, &parents);
        if joints.len() + order.len() > usize::from(u16::MAX) {
            return Err(fail(format!("there are more than {} joints", u16::MAX)));
        }
        let mut place = vec![0u16; order.len()];
        for (rank, &joint) in order.iter().enumerate() {
            place[joint] = (joints.len() + rank) as u16;
        }
        joints.extend(order.iter().map(|&joint| Joint {
            name: document.root.nodes[node_of_joint[joint]].name.clone().unwrap_or_default(),
            parent: parents[joint].map(|parent| place[parent]),
            frame: *world(node_of_joint[joint]),
        }));
        Ok(Self { matrices: matrices.collect(), joints: place })
    }

    /// The index in the skeleton of the whole file of one of the skin's joints, if it exists.
    pub(super) fn joint(&self, joint: f64) -> Option<u16> {
        self.joints.get(joint as usize).copied()
    }

    /// The place in the world of a vertex that these joints move: linear blend skinning. `None` where a joint does
    /// not exist or nothing moves it.
    pub(super) fn pose<I: Iterator<Item = (f64, f32)>>(
        &self,
        position: [f64; 3],
        influences: impl Fn() -> I,
    ) -> Option<[f64; 3]> {
        let total: f64 = influences().map(|(_, w)| f64::from(w)).sum();
        let mut posed = [0.0; 3];
        for (joint, weight) in influences() {
            let moved = matrix4::apply(self.matrices.get(joint as usize)?, position);
            posed = [0, 1, 2].map(|axis| posed[axis] + f64::from(weight) / total * moved[axis]);
        }
        (total > 0.0).then_some(posed)
    }
}

fn bind_matrices(
    document: &Document<'_>,
    skin: &json::Skin,
    index: Index<json::Skin>,
) -> Parsed<Vec<Matrix4>> {
    let Some(accessor) = skin.inverse_bind_matrices else { return Ok(vec![IDENTITY; skin.joints.len()]) };
    let matrices = document.read::<16>(accessor, Integers::AsStated)?;
    if matrices.len() < skin.joints.len() {
        let problem = format!("it has {} bind matrices for {} joints", matrices.len(), skin.joints.len());
        return Err(ParseError::part(format!("skin {index}"), problem));
    }
    let column = |m: &[f64; 16], c: usize| [m[4 * c], m[4 * c + 1], m[4 * c + 2], m[4 * c + 3]];
    Ok(matrices.iter().map(|m| [column(m, 0), column(m, 1), column(m, 2), column(m, 3)]).collect())
}

/// The nearest ancestor of each joint that is a joint of the same skin.
fn parents(nodes: &Nodes, node_of_joint: &[usize]) -> Vec<Option<usize>> {
    let joint_of_node: HashMap<usize, usize> =
        node_of_joint.iter().enumerate().map(|(j, &node)| (node, j)).collect();
    let parent = |&node: &usize| {
        let mut above = nodes.placed[node].parent;
        while let Some(ancestor) = above {
            if let Some(&joint) = joint_of_node.get(&ancestor) {
                return Some(joint);
            }
            above = nodes.placed[ancestor].parent;
        }
        None
    };
    node_of_joint.iter().map(parent).collect()
}

/// The joints as they are listed if parents come first there, else from the root outward.
fn parents_first(nodes: &Nodes, node_of_joint: &[usize], parents: &[Option<usize>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..node_of_joint.len()).collect();
    if parents.iter().enumerate().any(|(joint, parent)| parent.is_some_and(|parent| parent >= joint)) {
        order.sort_by_key(|&joint| (nodes.placed[node_of_joint[joint]].depth, joint));
    }
    order
}
