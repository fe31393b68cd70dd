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
        let material = materials.iter().find(|m| m.name == *name);
        let image = material.and_then(|m| m.diffuse_texture.as_deref());
        images.extend(image.filter(|image| images.len() < MAX_IMAGES && !images.contains(image)));
    }
    if let [first, _, ..] = images[..] {
        warnings.push(format!("the materials have {} images, of which only {first} is kept", images.len()));
    }
    images.first().map(|image| Texture::File(folder.join(image)))
}

/// What is kept of a material.
#[derive(Debug, PartialEq)]
struct Material {
    name: Vec<u8>,
    diffuse_texture: Option<String>,
}

fn load(path: &Path) -> Result<Vec<Material>, String> {
    let bytes =
        read_small_file(path).map_err(|e| format!("cannot read the materials {}: {e}", path.display()))?;
    Ok(parse(&bytes))
}

/// Reads `newmtl` and `map_Kd`; whatever else a library says does not matter here.
fn parse(bytes: &[u8]) -> Vec<Material> {
    let mut materials: Vec<Material> = Vec::new();
    for line in bytes.split(|&b| b == b'\n' || b == b'\r') {
        let line = line.trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = (line[..end].to_ascii_lowercase(), line[end..].trim_ascii());
        match (keyword.as_slice(), materials.last_mut()) {
            (b"newmtl", _) => materials.push(Material { name: rest.to_vec(), diffuse_texture: None }),
            (b"map_kd", Some(material)) => {
                material.diffuse_texture = image_name(&String::from_utf8_lossy(rest))
            }
            _ => {}
        }
    }
    materials
}

/// The file behind a map's options (`-s 1 1 1`, `-clamp on` and the like); its name may have spaces.
fn image_name(statement: &str) -> Option<String> {
    let mut rest = statement.trim();
    while rest.starts_with('-') {
        let mut words = rest.splitn(2, char::is_whitespace);
        let option = words.next().unwrap_or_default();
        rest = words.next().unwrap_or_default().trim_start();
        let arguments = match option {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        for taken in 0..arguments {
            let mut words = rest.splitn(2, char::is_whitespace);
            let word = words.next().unwrap_or_default();
            // The second and third of three numbers may be left out.
            if taken > 0 && word.parse::<f64>().is_err() {
                break;
            }
            rest = words.next().unwrap_or_default().trim_start();
        }
    }
    Some(rest.to_string()).filter(|name| !name.is_empty())
}

fn read_small_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() || metadata.len() > MAX_LIBRARY_BYTES {
        return Err(std::io::Error::other(format!("not a file of at most {} MiB", MAX_LIBRARY_BYTES >> 20)));
    }
    std::fs::read(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_images() {
        let text = b"# two\r\nnewmtl two words\nKa 1\nKd\nmap_Kd -s 1 1 -clamp on my skin.png\nnewmtl b\nmap_kd b.jpg\n";
        let found = parse(text);
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].name.as_slice(), found[0].diffuse_texture.as_deref()),
            (&b"two words"[..], Some("my skin.png"))
        );
        assert_eq!(
            (found[1].name.as_slice(), found[1].diffuse_texture.as_deref()),
            (&b"b"[..], Some("b.jpg"))
        );
        assert_eq!(parse(b"map_Kd orphan.png\nnewmtl a\nmap_Kd -bm\n")[0].diffuse_texture, None);
    }
}
