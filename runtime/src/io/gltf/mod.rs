//! glTF 2.0 and GLB: the scene's triangles in world coordinates, several meshes and primitives one after another.
//!
//! The crate `gltf` gives the container and the data types; its accessors and iterators panic on indices and offsets
//! that are out of range, so every reference is looked up with a check here. Skinned meshes are placed by their
//! joints, as the specification (section 3.7.3.3) demands, morph targets applied with the weights that the file gives
//! them; animations are not applied.

mod accessor;
mod color;
mod document;
mod influences;
mod material;
mod matrix4;
mod nodes;
mod scene;
mod skeleton;
mod uri;
mod write;

use std::path::Path;

use super::attributes::MeshFile;
use super::error::Parsed;

pub(super) use write::encode;

pub(super) fn read(bytes: &[u8], folder: &Path) -> Parsed<MeshFile> {
    scene::read(&document::Document::open(bytes, folder)?)
}

#[cfg(test)]
mod tests;
