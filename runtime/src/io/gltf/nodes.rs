//! The scene graph: where each node is in the world.

use gltf::json::scene::Node;
use gltf::json::{Index, Root};

use super::matrix4::{self, Matrix4};
use crate::io::error::{ParseError, Parsed};

/// A node with its place in the world.
pub(super) struct Placed {
    /// From the node's coordinates to the world's.
    pub(super) world: Matrix4,
    pub(super) parent: Option<usize>,
    /// How many ancestors it has.
    pub(super) depth: usize,
    /// Whether the default scene shows it.
    pub(super) in_scene: bool,
}

/// The placed nodes, by index, and the order of a walk through the trees.
pub(super) struct Nodes {
    pub(super) placed: Vec<Placed>,
    pub(super) order: Vec<usize>,
}

impl Nodes {
    /// Places every node. A node with two parents or in a cycle is an error.
    pub(super) fn place(root: &Root) -> Parsed<Self> {
        let parents = parents(root)?;
        let shown = shown(root, &parents)?;
        let placed = root.nodes.iter().zip(&parents).map(|(node, &parent)| Placed {
            world: local(node),
            parent,
            depth: 0,
            in_scene: false,
        });
        let mut nodes = Self { placed: placed.collect(), order: Vec::with_capacity(parents.len()) };
        let mut open: Vec<usize> = (0..parents.len()).rev().filter(|&i| parents[i].is_none()).collect();
        while let Some(i) = open.pop() {
            nodes.order.push(i);
            nodes.settle(i, shown[i]);
            open.extend(children(&root.nodes[i]).rev());
        }
        if nodes.order.len() < parents.len() {
            return Err(ParseError::part("nodes", "some are their own ancestors"));
        }
        Ok(nodes)
    }

    /// Takes a node below its parent, which has its place already.
    fn settle(&mut self, i: usize, shown: bool) {
        self.placed[i].in_scene = shown;
        if let Some(parent) = self.placed[i].parent {
            let above = &self.placed[parent];
            let (world, depth) = (matrix4::product(&above.world, &self.placed[i].world), above.depth + 1);
            let in_scene = shown || above.in_scene;
            self.placed[i] = Placed { world, parent: Some(parent), depth, in_scene };
        }
    }
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> + '_ {
    node.children.iter().flatten().map(Index::value)
}

fn parents(root: &Root) -> Parsed<Vec<Option<usize>>> {
    let mut parents = vec![None; root.nodes.len()];
    for (i, node) in root.nodes.iter().enumerate() {
        for child in children(node) {
            let fail =
                |problem| ParseError::part(format!("node {i}"), format!("its child {child} {problem}"));
            let parent = parents.get_mut(child).ok_or_else(|| fail("does not exist"))?;
            if parent.replace(i).is_some() {
                return Err(fail("has another parent"));
            }
        }
    }
    Ok(parents)
}

/// Which nodes the default scene lists; without a scene, all roots.
fn shown(root: &Root, parents: &[Option<usize>]) -> Parsed<Vec<bool>> {
    let scene = match root.scene {
        Some(index) => Some(
            root.get(index).ok_or_else(|| ParseError::part(format!("scene {index}"), "it does not exist"))?,
        ),
        None => root.scenes.first(),
    };
    let Some(scene) = scene else { return Ok(parents.iter().map(Option::is_none).collect()) };
    let mut shown = vec![false; parents.len()];
    for node in &scene.nodes {
        let place = shown.get_mut(node.value());
        *place.ok_or_else(|| ParseError::part("scene", format!("its node {node} does not exist")))? = true;
    }
    Ok(shown)
}

/// From a node's coordinates to its parent's.
fn local(node: &Node) -> Matrix4 {
    if let Some(m) = node.matrix {
        return [0, 1, 2, 3].map(|column| [0, 1, 2, 3].map(|row| f64::from(m[4 * column + row])));
    }
    let translation = node.translation.unwrap_or([0.0; 3]).map(f64::from);
    let rotation = node.rotation.unwrap_or_default().0.map(f64::from);
    let scale = node.scale.unwrap_or([1.0; 3]).map(f64::from);
    matrix4::from_parts(translation, rotation, scale)
}
