//! Files: meshes, point maps, matrices; read with bounded memory, written to a temporary name and renamed.
//!
//! - [`read_mesh`] / [`write_mesh`]: OFF, PLY, OBJ, glTF / GLB and STL (reading only), with what they carry
//!   besides the triangles: colours, texture coordinates, scalar fields, skin weights ([`Attributes`]).
//! - [`read_point_map`] / [`write_point_map`]: `.txt`, `.vts`, `.npy`, `.csv`.
//! - [`read_surface_points`] / [`write_surface_points`]: `.corr`, points that need not be vertices.
//! - [`read_matrix`] / [`write_matrix`], [`read_vector`] / [`write_vector`]: NumPy's `.npy`.
//! - [`decode_mesh`], [`encode_glb`], [`encode_point_map`]: the same in memory, where there are no files.
//! - [`write_atomically`]: what every writer here goes through.
//!
//! Vertex `i` of a file is vertex `i` of the mesh read from it, and the other way round. No reader panics on
//! any bytes, nor takes memory beyond a small multiple of the file's size, whatever its header promises.
//!
//! ```
//! use fmnet::io::{Attributes, read_mesh, write_mesh};
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("triangle.off");
//! std::fs::write(&path, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")?;
//! let file = read_mesh(&path)?;
//! assert_eq!((file.mesh.n_vertices(), file.mesh.n_faces()), (3, 1));
//! write_mesh(&folder.path().join("triangle.ply"), &file.mesh, &Attributes::default())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assemble;
mod atomic;
mod attributes;
mod carried;
mod error;
mod format;
mod gltf;
mod landmarks;
mod matrix;
mod obj;
mod off;
mod ply;
mod point_map;
mod reference;
mod stl;
mod streams;
mod surface_points;
mod text;
mod texture;
mod unmeasured;

use std::path::Path;

pub use atomic::{remove_temporary_files, write_atomically};
pub use attributes::{Attributes, IntegerField, IntegerKind, Joint, MeshFile, ReadInfo, Skin, Texture};
pub use error::{IoError, Position};
pub use format::MeshFormat;
pub use landmarks::read_landmarks;
pub use matrix::{
    NpyArray, NpyKind, NpyNumber, read_matrix, read_npy, read_vector, write_matrix, write_npy, write_vector,
};
pub use point_map::{PointMapFormat, encode_point_map, read_point_map, write_point_map};
pub use reference::path_from_bytes;
pub use streams::{print_error_line, print_line};
pub use surface_points::{read_surface_points, write_surface_points};
pub use text::decode_text;

use crate::Mesh;
use error::Parsed;

/// Reads a mesh and its attributes. The format is the content's where that bears a mark, else the extension's, else
/// what the content suggests.
///
/// Polygons are split into triangle fans, several objects are concatenated in file order. What could not be
/// kept is said in [`ReadInfo::warnings`] and [`ReadInfo::left_out`]. Text files may be in UTF-8 or UTF-16.
///
/// # Errors
/// If the file cannot be read, is of no known format, or breaks its rules: then with the line, byte or part where it
/// does.
pub fn read_mesh(path: &Path) -> Result<MeshFile, IoError> {
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    decode_mesh(&bytes, path)
}

/// [`read_mesh`] of bytes at hand; `path` gives the format, the name in errors and the folder in which
/// material, buffer and texture files are looked for.
///
/// # Errors
/// As [`read_mesh`].
pub fn decode_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, IoError> {
    let named = MeshFormat::from_path(path);
    let format = MeshFormat::certain(bytes).or(named).or_else(|| MeshFormat::from_content(bytes));
    if let Some((problem, remedy)) = format::foreign(bytes) {
        let error = error::ParseError::new(Position::Byte(0), problem, remedy);
        return Err(error.in_file(path));
    }
    let format =
        format.ok_or_else(|| IoError::UnknownFormat { path: path.into(), known: MeshFormat::READABLE })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut file = decode(bytes, format, folder).map_err(|e| e.in_file(path))?;
    let is_gltf = |format| matches!(format, MeshFormat::Gltf | MeshFormat::Glb);
    if let Some(named) = named.filter(|&named| named != format && !(is_gltf(named) && is_gltf(format))) {
        let warning =
            format!("the name is that of {} file, but the content is {}", with_article(named), format.name());
        file.info.warnings.push(warning);
    }
    Ok(file)
}

fn with_article(format: MeshFormat) -> String {
    let article =
        if matches!(format, MeshFormat::Off | MeshFormat::Obj | MeshFormat::Stl) { "an" } else { "a" };
    format!("{article} {}", format.name())
}

fn decode(bytes: &[u8], format: MeshFormat, folder: &Path) -> Parsed<MeshFile> {
    match format {
        MeshFormat::Off => off::read(&decode_text(bytes)),
        MeshFormat::Ply => ply::read(&decode_text(bytes), folder),
        MeshFormat::Obj => obj::read(&decode_text(bytes), folder),
        MeshFormat::Gltf | MeshFormat::Glb => gltf::read(&decode_text(bytes), folder),
        MeshFormat::Stl => stl::read(bytes),
    }
}

/// Writes a mesh with what the format can hold of its attributes; the extension decides:
///
/// | | vertices | colours | texture | scalars | skin |
/// |---|---|---|---|---|---|
/// | `.off` | exact | yes | | | |
/// | `.ply` (binary) | exact | yes | per corner, reference | yes | |
/// | `.obj` (+ `.mtl`) | exact | yes, without alpha | per corner, reference | | |
/// | `.glb` | rounded to f32 | yes | per corner, embedded | yes | yes |
///
/// Vertex `i` of the mesh is vertex `i` of the file. GLB has texture coordinates per vertex only, so a vertex on a
/// seam is repeated there, behind the `n` vertices of the mesh. A texture that is embedded or in another folder is
/// written beside a `.ply` or `.obj` as `STEM_texture.png` (or whatever its extension).
///
/// # Errors
/// If the format is none of [`MeshFormat::WRITABLE`], an attribute has not the mesh's size, a skin's joint does not
/// exist or comes before its parent, the mesh is empty and the format `.glb`, or a file cannot be written.
pub fn write_mesh(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<(), IoError> {
    check(path, mesh, attributes)?;
    match MeshFormat::from_path(path) {
        Some(MeshFormat::Off) => off::write(path, mesh, attributes),
        Some(MeshFormat::Ply) => ply::write(path, mesh, attributes),
        Some(MeshFormat::Obj) => obj::write(path, mesh, attributes),
        Some(MeshFormat::Glb) => {
            let bytes = gltf::encode(path, mesh, attributes)?;
            write_atomically(path, |w| w.write_all(&bytes))
        }
        _ => Err(IoError::UnknownFormat { path: path.into(), known: MeshFormat::WRITABLE }),
    }
}

/// The bytes of a `.glb` file as [`write_mesh`] writes it; `path` is for messages, and an image is looked for in its
/// folder.
///
/// # Errors
/// As [`write_mesh`], but for those of the written file.
pub fn encode_glb(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<Vec<u8>, IoError> {
    check(path, mesh, attributes)?;
    gltf::encode(path, mesh, attributes)
}

fn check(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<(), IoError> {
    let unwritable = |(problem, remedy)| IoError::Unwritable { path: path.into(), problem, remedy };
    attributes.check(mesh).map_err(unwritable)
}
