//! The parts of a glTF file: its JSON and the bytes of its buffers.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use gltf::json::accessor::Accessor;
use gltf::json::mesh::Primitive;
use gltf::json::{self, Root};

use super::uri::{self, Target};
use crate::io::error::{ParseError, Parsed, Position, TRUNCATED};

/// How many vertices and corners may come of one byte: enough for many instances of a mesh, but not for a file whose
/// nodes repeat one mesh until memory runs out.
const MAX_ITEMS_PER_BYTE: usize = 16;

/// Extensions that change how geometry is stored, by what to do about them.
const COMPRESSIONS: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Required extensions that are applied, or do not touch what is read here, by the beginning of their names.
const HARMLESS: [&str; 7] = [
    "EXT_mesh_gpu_instancing",
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_lights_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_animation_",
];

pub(super) struct Document<'a> {
    pub(super) root: Root,
    pub(super) folder: PathBuf,
    blobs: Vec<Cow<'a, [u8]>>,
    /// The index in `blobs` of each buffer.
    blob_of_buffer: Vec<usize>,
    /// The files of the buffers.
    files: Vec<PathBuf>,
    /// How many more vertices and corners may be read.
    budget: Cell<usize>,
}

impl<'a> Document<'a> {
    pub(super) fn open(bytes: &'a [u8], folder: &Path) -> Parsed<Self> {
        let (text, binary) = split(bytes)?;
        let root: Root =
            json::deserialize::from_slice(&text).map_err(|e| ParseError::part("JSON", e.to_string()))?;
        check_extensions(&root)?;
        let mut document = Self {
            root,
            folder: folder.into(),
            blobs: Vec::new(),
            blob_of_buffer: Vec::new(),
            files: Vec::new(),
            budget: Cell::new(0),
        };
        document.load_buffers(binary)?;
        let n_bytes = bytes.len() + document.blobs.iter().map(|b| b.len()).sum::<usize>();
        document.budget.set(n_bytes.saturating_mul(MAX_ITEMS_PER_BYTE));
        Ok(document)
    }

    fn load_buffers(&mut self, mut binary: Option<Cow<'a, [u8]>>) -> Parsed<()> {
        let mut blob_of_file = HashMap::new();
        for (i, buffer) in self.root.buffers.iter().enumerate() {
            let fail = |problem: String| ParseError::part(format!("buffer {i}"), problem);
            let blob = match &buffer.uri {
                None => {
                    let compression = buffer.extensions.as_ref().and_then(|e| compression(&e.others));
                    let missing = || match compression {
                        Some(name) => compressed(format!("buffer {i}"), name),
                        None => fail("there is no binary chunk for it".into()),
                    };
                    let binary = binary.take().ok_or_else(missing)?;
                    push(&mut self.blobs, binary)
                }
                Some(uri) => match uri::resolve(uri, &self.folder).map_err(fail)? {
                    Target::Data(bytes, _) => push(&mut self.blobs, bytes.into()),
                    Target::File(path) => {
                        let cannot_read =
                            |e: std::io::Error| fail(format!("cannot read {}: {e}", path.display()));
                        // A file that several buffers name is loaded once.
                        let path = std::fs::canonicalize(&path).map_err(cannot_read)?;
                        match blob_of_file.get(&path) {
                            Some(&blob) => blob,
                            None => {
                                let bytes = read_regular_file(&path).map_err(cannot_read)?;
                                let blob = push(&mut self.blobs, bytes.into());
                                self.files.push(path.clone());
                                blob_of_file.insert(path, blob);
                                blob
                            }
                        }
                    }
                },
            };
            let (expected, found) = (buffer.byte_length.0, self.blobs[blob].len());
            if expected > found as u64 {
                let problem = format!("it should have {expected} bytes, but only {found} are there");
                return Err(ParseError::new(Position::Part(format!("buffer {i}")), problem, TRUNCATED));
            }
            self.blob_of_buffer.push(blob);
        }
        Ok(())
    }

    /// The bytes of a buffer view and the distance between its items, if it states one.
    pub(super) fn view(&self, index: json::Index<json::buffer::View>) -> Parsed<(&[u8], Option<usize>)> {
        let fail = |problem: &str| ParseError::part(format!("buffer view {index}"), problem);
        let view = self.root.get(index).ok_or_else(|| fail("it does not exist"))?;
        let blob =
            self.blob_of_buffer.get(view.buffer.value()).ok_or_else(|| fail("its buffer does not exist"))?;
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).unwrap_or(usize::MAX);
        let length = usize::try_from(view.byte_length.0).unwrap_or(usize::MAX);
        let bytes = start.checked_add(length).and_then(|end| self.blobs[*blob].get(start..end));
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0);
        Ok((bytes.ok_or_else(|| fail("it reaches beyond its buffer"))?, stride))
    }

    /// The files of the buffers.
    pub(super) fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Refuses a primitive that has nothing but compressed data.
    pub(super) fn check_compression(
        &self,
        primitive: &Primitive,
        positions: json::Index<Accessor>,
    ) -> Parsed<()> {
        let Some(name) = primitive.extensions.as_ref().and_then(|e| compression(&e.others)) else {
            return Ok(());
        };
        let is_plain =
            self.root.get(positions).is_some_and(|a| a.buffer_view.is_some() || a.sparse.is_some());
        if is_plain { Ok(()) } else { Err(compressed("scene".into(), name)) }
    }

    /// Counts `n` vertices or corners against what a file of this size may hold.
    pub(super) fn charge(&self, n: usize) -> Parsed<()> {
        let left = self.budget.get().checked_sub(n).ok_or_else(|| {
            let problem = "the nodes repeat the meshes until they are far larger than the file";
            ParseError::new(
                Position::Part("scene".into()),
                problem,
                "export a single mesh instead of instances",
            )
        })?;
        self.budget.set(left);
        Ok(())
    }
}

fn push<T>(items: &mut Vec<T>, item: T) -> usize {
    items.push(item);
    items.len() - 1
}

fn read_regular_file(path: &Path) -> std::io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("not a regular file"));
    }
    std::fs::read(path)
}

/// The JSON and, in a GLB file, the binary chunk.
#[allow(clippy::type_complexity)]
fn split(bytes: &[u8]) -> Parsed<(Cow<'_, [u8]>, Option<Cow<'_, [u8]>>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.into(), None));
    }
    let length = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    // The length is checked first: `Glb::from_slice` subtracts the header's size from it unchecked.
    let Some(content) = length.filter(|&length| length >= 12).and_then(|length| bytes.get(..length)) else {
        let promised = length.map_or("a length".to_owned(), |length| format!("{length} bytes"));
        let problem = format!("the header promises {promised}, but the file has {} bytes", bytes.len());
        return Err(ParseError::new(Position::Byte(8), problem, TRUNCATED));
    };
    let glb = gltf::Glb::from_slice(content).map_err(|e| ParseError::byte(12, e.to_string()))?;
    Ok((glb.json, glb.bin))
}

/// Which of the compressions is among the extensions of something.
fn compression(extensions: &serde_json::Map<String, serde_json::Value>) -> Option<&'static str> {
    COMPRESSIONS.into_iter().find(|name| extensions.contains_key(*name))
}

fn compressed(part: String, name: &str) -> ParseError {
    let problem = format!("the mesh is compressed with '{name}', which is not supported");
    ParseError::new(Position::Part(part), problem, "export the mesh without compression")
}

fn check_extensions(root: &Root) -> Parsed<()> {
    for name in &root.extensions_required {
        if HARMLESS.iter().any(|harmless| name.starts_with(harmless)) {
            continue;
        }
        let remedy = if COMPRESSIONS.contains(&name.as_str()) {
            "export the mesh without compression"
        } else {
            "export the mesh without this extension"
        };
        let problem = format!("the extension '{}' is not supported", name.escape_debug());
        return Err(ParseError::new(Position::Part("extensionsRequired".into()), problem, remedy));
    }
    Ok(())
}
