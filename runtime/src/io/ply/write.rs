//! Writing: binary, little-endian; positions in double precision unless single holds them exactly.

use std::collections::HashSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::Mesh;
use crate::io::attributes::{Attributes, Texture};
use crate::io::{IoError, write_atomically};

/// Property names with a meaning of their own, which no scalar field may take.
const RESERVED: [&str; 27] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "red",
    "green",
    "blue",
    "alpha",
    "r",
    "g",
    "b",
    "a",
    "u",
    "v",
    "s",
    "t",
    "texture_u",
    "texture_v",
    "texture_s",
    "texture_t",
    "diffuse_red",
    "diffuse_green",
    "diffuse_blue",
    "diffuse_alpha",
    "",
];

pub(in crate::io) fn write(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<(), IoError> {
    let texture = attributes.texture.as_ref().filter(|_| attributes.corner_uvs.is_some());
    let texture = texture.map(|texture| texture.place_beside(path)).transpose()?;
    write_atomically(path, |w| {
        let single = mesh.vertices().iter().flatten().all(|&x| f64::from(x as f32) == x);
        write_header(w, mesh, attributes, texture.as_deref(), single)?;
        write_vertices(w, mesh, attributes, single)?;
        write_faces(w, mesh, attributes)
    })
}

fn write_header(
    w: &mut dyn Write,
    mesh: &Mesh,
    attributes: &Attributes,
    texture: Option<&str>,
    single: bool,
) -> io::Result<()> {
    writeln!(w, "ply\nformat binary_little_endian 1.0")?;
    if let Some(name) = texture {
        writeln!(w, "comment TextureFile {name}")?;
    }
    writeln!(w, "element vertex {}", mesh.n_vertices())?;
    let number = if single { "float" } else { "double" };
    ["x", "y", "z"].iter().try_for_each(|name| writeln!(w, "property {number} {name}"))?;
    if attributes.vertex_colors.is_some() {
        ["red", "green", "blue", "alpha"].iter().try_for_each(|name| writeln!(w, "property uchar {name}"))?;
    }
    for name in property_names(attributes) {
        writeln!(w, "property float {name}")?;
    }
    writeln!(w, "element face {}\nproperty list uchar int vertex_indices", mesh.n_faces())?;
    if attributes.corner_uvs.is_some() {
        writeln!(w, "property list uchar float texcoord")?;
    }
    writeln!(w, "end_header")
}

/// The names of the scalar fields as single words, none reserved, none twice.
fn property_names(attributes: &Attributes) -> Vec<String> {
    let mut taken: HashSet<String> = RESERVED.iter().map(|&name| name.to_owned()).collect();
    let free = |name: &String| {
        let mut name = name.replace(|c: char| c.is_whitespace() || c.is_control(), "_");
        while !taken.insert(name.clone()) {
            name.push('_');
        }
        name
    };
    attributes.vertex_scalars.iter().map(|(name, _)| name).map(free).collect()
}

fn write_vertices(w: &mut dyn Write, mesh: &Mesh, attributes: &Attributes, single: bool) -> io::Result<()> {
    let mut record = Vec::new();
    for (i, position) in mesh.vertices().iter().enumerate() {
        record.clear();
        if single {
            position.iter().for_each(|&x| record.extend((x as f32).to_le_bytes()));
        } else {
            position.iter().for_each(|x| record.extend(x.to_le_bytes()));
        }
        record.extend(attributes.vertex_colors.iter().flat_map(|colors| colors[i]));
        attributes.vertex_scalars.iter().for_each(|(_, values)| record.extend(values[i].to_le_bytes()));
        w.write_all(&record)?;
    }
    Ok(())
}

fn write_faces(w: &mut dyn Write, mesh: &Mesh, attributes: &Attributes) -> io::Result<()> {
    let mut record = Vec::new();
    for (i, face) in mesh.faces().iter().enumerate() {
        record.clear();
        record.push(3);
        face.iter().for_each(|corner| record.extend(corner.to_le_bytes()));
        if let Some(uvs) = &attributes.corner_uvs {
            record.push(6);
            uvs[i].iter().flatten().for_each(|x| record.extend(x.to_le_bytes()));
        }
        w.write_all(&record)?;
    }
    Ok(())
}

impl Texture {
    /// How a mesh file at `path` refers to the image: a name relative to its folder. An image that is elsewhere or embedded
    /// is written beside the mesh; one that does not exist is referred to by its absolute path.
    pub(in crate::io) fn place_beside(&self, path: &Path) -> Result<String, IoError> {
        match self {
            Self::File(image) => {
                let folder = path.parent().unwrap_or(Path::new(""));
                let inside = image.strip_prefix(folder).ok().filter(|p| p.is_relative());
                let name = match inside {
                    Some(inside) => inside.to_path_buf(),
                    None => copied(image, path)?
                        .unwrap_or_else(|| std::path::absolute(image).unwrap_or_else(|_| image.clone())),
                };
                Ok(name.to_string_lossy().replace(char::is_control, "_"))
            }
            Self::Embedded { bytes, mime } => {
                let stem = path.file_stem().unwrap_or_default().to_string_lossy();
                let extension = if mime == "image/jpeg" { "jpg" } else { "png" };
                let name = format!("{stem}_texture.{extension}");
                write_atomically(&path.with_file_name(&name), |w| w.write_all(bytes))?;
                Ok(name)
            }
        }
    }
}

/// Copies an image beside the mesh as `STEM_texture.EXTENSION`; its name, or `None` where the image cannot be read.
fn copied(image: &Path, mesh: &Path) -> Result<Option<PathBuf>, IoError> {
    let readable = std::fs::metadata(image).is_ok_and(|m| m.is_file());
    let Some(bytes) = readable.then(|| std::fs::read(image).ok()).flatten() else { return Ok(None) };
    let mut name = mesh.file_stem().unwrap_or_default().to_os_string();
    name.push("_texture");
    let mut name = PathBuf::from(name);
    if let Some(extension) = image.extension() {
        name.as_mut_os_string().push(".");
        name.as_mut_os_string().push(extension);
    }
    write_atomically(&mesh.with_file_name(&name), |w| w.write_all(&bytes))?;
    Ok(Some(name))
}
