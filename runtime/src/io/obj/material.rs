//! The material library: which image the texture coordinates refer to.

use std::path::Path;

use crate::io::attributes::Texture;

/// A library larger than this is not read: materials are a few lines each.
const MAX_LIBRARY_BYTES: u64 = 16 << 20;

/// As many images are told apart; what matters is whether there is more than one.
const MAX_IMAGES: usize = 16;

/// The image of the first material in use that has one. What could not be read or kept goes to `warnings`.
pub(super) fn texture(
    libraries: &[Vec<u8>],
    used: &[Vec<u8>],
    folder: &Path,
    warnings: &mut Vec<String>,
) -> Option<Texture> {
    let mut materials = Vec::new();
    for name in libraries {
        match load(&folder.join(&*String::from_utf8_lossy(name))) {
            Ok(found) => materials.extend(found),
            Err(problem) => warnings.push(problem),
        }
    }
    let mut images: Vec<&str> = Vec::new();
    for name in used {
        let material = materials.iter().find(|m| m.name.as_bytes() == name.as_slice());
        let image = material.and_then(|m| m.diffuse_texture.as_deref());
        images.extend(image.filter(|image| images.len() < MAX_IMAGES && !images.contains(image)));
    }
    if let [first, _, ..] = images[..] {
        warnings.push(format!("the materials have {} images, of which only {first} is kept", images.len()));
    }
    images.first().map(|image| Texture::File(folder.join(image)))
}

fn load(path: &Path) -> Result<Vec<tobj::Material>, String> {
    let bytes =
        read_small_file(path).map_err(|e| format!("cannot read the materials {}: {e}", path.display()))?;
    let loaded = tobj::load_mtl_buf(&mut bytes.as_slice());
    loaded
        .map(|(materials, _)| materials)
        .map_err(|e| format!("cannot read the materials {}: {e}", path.display()))
}

fn read_small_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() || metadata.len() > MAX_LIBRARY_BYTES {
        return Err(std::io::Error::other(format!("not a file of at most {} MiB", MAX_LIBRARY_BYTES >> 20)));
    }
    std::fs::read(path)
}
