//! Images beside the mesh files that refer to them.

use std::path::{Path, PathBuf};

use super::attributes::Texture;
use super::{IoError, write_atomically};

impl Texture {
    /// How a mesh file at `path` refers to the image: a name relative to its folder. An image that is elsewhere or
    /// embedded is written beside the mesh; `None` where there is no such file to be read.
    pub(super) fn place_beside(&self, path: &Path) -> Result<Option<PathBuf>, IoError> {
        match self.placement(path) {
            Placement::Absent => Ok(None),
            Placement::There(name) => Ok(Some(name)),
            Placement::Written(name) => {
                let to = path.with_file_name(&name);
                match self {
                    Self::File(image) => {
                        let bytes = std::fs::read(image)
                            .map_err(|source| IoError::Read { path: image.clone(), source })?;
                        write_atomically(&to, |w| w.write_all(&bytes))?;
                    }
                    Self::Embedded { bytes, .. } => write_atomically(&to, |w| w.write_all(bytes))?,
                }
                Ok(Some(name))
            }
        }
    }

    /// The file that [`Self::place_beside`] writes, if it writes one.
    pub(super) fn written_beside(&self, path: &Path) -> Option<PathBuf> {
        match self.placement(path) {
            Placement::Written(name) => Some(path.with_file_name(name)),
            _ => None,
        }
    }

    /// Whether there is an image: a file that can be read, or an embedded one.
    pub(super) fn exists(&self) -> bool {
        !matches!(self, Self::File(image) if !image.is_file())
    }

    /// Whether glTF takes the image into the file: it is a PNG or JPEG, or was inside a file before.
    pub(super) fn is_embeddable(&self) -> bool {
        use std::io::Read;
        let Self::File(image) = self else { return true };
        let mut head = [0; 4];
        let read = std::fs::File::open(image).and_then(|mut file| file.read_exact(&mut head));
        read.is_ok() && (is_png(&head) || is_jpeg(&head))
    }

    fn placement(&self, path: &Path) -> Placement {
        let mut name = path.file_stem().unwrap_or_default().to_os_string();
        name.push("_texture");
        let extension = match self {
            Self::File(image) => {
                if !self.exists() {
                    return Placement::Absent;
                }
                let folder = path.parent().unwrap_or(Path::new(""));
                // A name with a line break in it would end the statement that refers to it.
                let inside = image.strip_prefix(folder).ok().filter(|p| p.is_relative());
                if let Some(inside) = inside.filter(|p| !p.to_string_lossy().contains(char::is_control)) {
                    return Placement::There(inside.to_path_buf());
                }
                image.extension().map(std::ffi::OsStr::to_os_string)
            }
            Self::Embedded { mime, .. } => {
                Some(if mime == "image/jpeg" { "jpg".into() } else { "png".into() })
            }
        };
        if let Some(extension) = extension {
            name.push(".");
            name.push(extension);
        }
        Placement::Written(name.into())
    }
}

pub(super) fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG")
}

pub(super) fn is_jpeg(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\xFF\xD8\xFF")
}

/// Where an image is, seen from the mesh.
enum Placement {
    Absent,
    /// In the mesh's folder, or below it.
    There(PathBuf),
    /// To be written under this name in the mesh's folder.
    Written(PathBuf),
}
