//! Which mesh format a file has.

use std::path::Path;

use super::stl;
use super::text::decode_text;

/// A mesh format that can be read; all but [`MeshFormat::Gltf`] and [`MeshFormat::Stl`] can be written too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
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
        if let Some(format) = Self::certain(bytes) {
            return Some(format);
        }
        if stl::is_binary(bytes) {
            return Some(Self::Stl);
        }
        let text = decode_text(&bytes[..bytes.len().min(HEAD)]);
        let mut lines = text.split(|&b| b == b'\n' || b == b'\r').map(<[u8]>::trim_ascii);
        let word = |line: &[u8]| line.split(u8::is_ascii_whitespace).next().unwrap_or_default().to_vec();
        let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#")).map(word)?;
        match first.as_slice() {
            b"v" | b"vn" | b"vt" | b"f" | b"o" | b"g" | b"mtllib" | b"usemtl" | b"s" => Some(Self::Obj),
            _ if first.starts_with(b"{") => Some(Self::Gltf),
            _ => None,
        }
    }

    /// The format whose mark the first bytes bear, so that no other can be meant whatever the file is called.
    pub(super) fn certain(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"glTF") {
            return Some(Self::Glb);
        }
        if stl::is_text(bytes) {
            return Some(Self::Stl);
        }
        let text = decode_text(&bytes[..bytes.len().min(HEAD)]);
        let mut lines = text.split(|&b| b == b'\n' || b == b'\r').map(<[u8]>::trim_ascii);
        let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"))?;
        let word = first.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        let is_off = || {
            let variant = word.len().checked_sub(3).map(|n| word.split_at(n));
            variant.is_some_and(|(letters, off)| {
                off.eq_ignore_ascii_case(b"OFF") && letters.iter().all(|c| b"STCNstcn4".contains(c))
            })
        };
        match word {
            _ if text.get(..3).is_some_and(|mark| mark.eq_ignore_ascii_case(b"ply")) && word.len() == 3 => {
                Some(Self::Ply)
            }
            _ if is_off() => Some(Self::Off),
            _ if first.starts_with(b"{") && text.windows(7).any(|w| w == b"\"asset\"") => Some(Self::Gltf),
            _ => None,
        }
    }

    /// The name of the format in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "OFF",
            Self::Ply => "PLY",
            Self::Obj => "OBJ",
            Self::Gltf => "glTF",
            Self::Glb => "GLB",
            Self::Stl => "STL",
        }
    }
}

/// How much of a file is looked at for its format.
const HEAD: usize = 4096;

/// What a file is that no reader takes, and what to do about it.
pub(super) fn foreign(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    const EXPORT: &str = "export the mesh as .ply, .obj or .glb";
    let head = &bytes[..bytes.len().min(HEAD)];
    let text = decode_text(head);
    let text = text.trim_ascii_start();
    let starts = |mark: &str| text.get(..mark.len()).is_some_and(|t| t.eq_ignore_ascii_case(mark.as_bytes()));
    if head.is_empty() {
        return Some(("the file is empty", "copy or download it again"));
    }
    if starts("version https://git-lfs") {
        return Some((
            "this is a pointer of Git LFS, not the file itself",
            "fetch the file with `git lfs pull`",
        ));
    }
    if starts("<!doctype html") || starts("<html") {
        return Some(("this is a web page", "download the file itself"));
    }
    if head.starts_with(b"PK\x03\x04") {
        return Some((
            "this is a ZIP archive (or .3mf, .usdz)",
            "unpack it, or export the mesh as .ply, .obj or .glb",
        ));
    }
    if head.starts_with(&[0x1F, 0x8B]) {
        return Some(("this is compressed with gzip", "unpack it with gunzip"));
    }
    if head.starts_with(b"Kaydara FBX") || starts("; FBX") {
        return Some(("this is an FBX file", EXPORT));
    }
    if head.starts_with(b"BLENDER") {
        return Some(("this is a Blender file", EXPORT));
    }
    if starts("<?xml") {
        return Some(("this is an XML file, such as COLLADA or X3D", EXPORT));
    }
    None
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
        assert_eq!(MeshFormat::from_content(b"\xEF\xBB\xBFSOLID a\nendsolid\n"), Some(MeshFormat::Stl));
        assert_eq!(MeshFormat::from_content(b"#"), None);
        assert_eq!(MeshFormat::from_content(b""), None);
    }

    #[test]
    fn a_mark_is_certain_and_other_contents_are_not() {
        for (bytes, format) in [
            (&b"ply\r\nformat"[..], Some(MeshFormat::Ply)),
            (b"OFF\n3 1 0\n", Some(MeshFormat::Off)),
            (b"# c\nstcnoff 3 1 0\n", Some(MeshFormat::Off)),
            (b"solid x\n", Some(MeshFormat::Stl)),
            (b"{\"asset\": {}}", Some(MeshFormat::Gltf)),
            (b"{\"a\": 1}", None),
            (b"v 0 0 0\n", None),
            (b"3 1 0\n", None),
        ] {
            assert_eq!(MeshFormat::certain(bytes), format, "{}", String::from_utf8_lossy(bytes));
        }
        for (bytes, what) in [
            (&b"PK\x03\x04"[..], "ZIP"),
            (b"<!DOCTYPE html>", "web page"),
            (b"", "empty"),
            (b"\x1f\x8b", "gzip"),
        ] {
            assert!(foreign(bytes).is_some_and(|(problem, _)| problem.contains(what)));
        }
    }
}
