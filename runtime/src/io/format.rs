//! Which mesh format a file has.

use std::path::Path;

use super::stl;

/// A mesh format that can be read; all but [`MeshFormat::Gltf`] and [`MeshFormat::Stl`] can be written too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MeshFormat {
    /// Object File Format, `.off`.
    Off,
    /// Polygon File Format, `.ply`.
    Ply,
    /// Wavefront, `.obj`.
    Obj,
    /// glTF as JSON, `.gltf`.
    Gltf,
    /// glTF in one binary file, `.glb`.
    Glb,
    /// Stereolithography, `.stl`.
    Stl,
}

impl MeshFormat {
    /// The extensions that can be read.
    pub const READABLE: &'static str = ".off, .ply, .obj, .gltf, .glb, .stl";
    /// The extensions that can be written.
    pub const WRITABLE: &'static str = ".off, .ply, .obj, .glb";

    /// The format that the extension of `path` names, whatever its case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "off" => Some(Self::Off),
            "ply" => Some(Self::Ply),
            "obj" => Some(Self::Obj),
            "gltf" => Some(Self::Gltf),
            "glb" => Some(Self::Glb),
            "stl" => Some(Self::Stl),
            _ => None,
        }
    }

    /// The format that the first bytes of a file suggest.
    pub fn from_content(bytes: &[u8]) -> Option<Self> {
        let text = bytes.trim_ascii_start();
        let word = text.split(|b| b.is_ascii_whitespace()).next().unwrap_or_default();
        match word {
            _ if bytes.starts_with(b"glTF") => Some(Self::Glb),
            b"ply" => Some(Self::Ply),
            b"solid" => Some(Self::Stl),
            b"v" | b"vn" | b"vt" | b"f" | b"o" | b"g" | b"mtllib" => Some(Self::Obj),
            _ if word.ends_with(b"OFF") && word.len() <= 8 => Some(Self::Off),
            _ if word.starts_with(b"{") => Some(Self::Gltf),
            _ if stl::is_binary(bytes) => Some(Self::Stl),
            _ if word.starts_with(b"#") => {
                let line_end = text.iter().position(|&b| b == b'\n')?;
                Self::from_content(&text[line_end + 1..])
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extension_then_content() {
        assert_eq!(MeshFormat::from_path(Path::new("a/b.PLY")), Some(MeshFormat::Ply));
        assert_eq!(MeshFormat::from_path(Path::new("a/b.txt")), None);
        assert_eq!(MeshFormat::from_content(b"ply\nformat"), Some(MeshFormat::Ply));
        assert_eq!(MeshFormat::from_content(b"# made by hand\nv 0 0 0\n"), Some(MeshFormat::Obj));
        assert_eq!(MeshFormat::from_content(b"# made by hand\nCOFF\n"), Some(MeshFormat::Off));
        assert_eq!(MeshFormat::from_content(b"{\"asset\": {}}"), Some(MeshFormat::Gltf));
        assert_eq!(MeshFormat::from_content(b"#"), None);
        assert_eq!(MeshFormat::from_content(b""), None);
    }
}
