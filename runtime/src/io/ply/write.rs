//! Writing: binary, little-endian; positions in double precision unless single holds them exactly.

use std::collections::HashSet;
use std::io::{self, Write};
use std::path::Path;

use crate::Mesh;
use crate::io::attributes::{Attributes, IntegerKind};
use crate::io::reference::bytes_of_path;
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
    let texture = texture.map(|texture| texture.place_beside(path)).transpose()?.flatten();
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
    texture: Option<&Path>,
    single: bool,
) -> io::Result<()> {
    writeln!(w, "ply\nformat binary_little_endian 1.0")?;
    if let Some(name) = texture {
        w.write_all(b"comment TextureFile ")?;
        w.write_all(&bytes_of_path(name))?;
        writeln!(w)?;
    }
    writeln!(w, "element vertex {}", mesh.n_vertices())?;
    let number = if single { "float" } else { "double" };
    ["x", "y", "z"].iter().try_for_each(|name| writeln!(w, "property {number} {name}"))?;
    if attributes.vertex_colors.is_some() {
        ["red", "green", "blue", "alpha"].iter().try_for_each(|name| writeln!(w, "property uchar {name}"))?;
    }
    for (name, kind) in property_names(attributes).iter().zip(property_types(attributes)) {
        writeln!(w, "property {kind} {name}")?;
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
    let integers = attributes.vertex_integers.iter().map(|field| &field.name);
    attributes.vertex_scalars.iter().map(|(name, _)| name).chain(integers).map(free).collect()
}

/// The types of the fields, in the same order.
fn property_types(attributes: &Attributes) -> impl Iterator<Item = &'static str> + '_ {
    let scalars = attributes
        .vertex_scalars
        .iter()
        .map(|(_, values)| if is_single(values) { "float" } else { "double" });
    scalars.chain(attributes.vertex_integers.iter().map(|field| match field.kind {
        IntegerKind::I8 => "char",
        IntegerKind::U8 => "uchar",
        IntegerKind::I16 => "short",
        IntegerKind::U16 => "ushort",
        IntegerKind::I32 => "int",
        IntegerKind::U32 => "uint",
    }))
}

/// Whether single precision holds all values exactly.
fn is_single(values: &[f64]) -> bool {
    values.iter().all(|&x| x.is_nan() || f64::from(x as f32) == x)
}

fn write_vertices(w: &mut dyn Write, mesh: &Mesh, attributes: &Attributes, single: bool) -> io::Result<()> {
    let mut record = Vec::new();
    let scalars: Vec<(bool, &[f64])> =
        attributes.vertex_scalars.iter().map(|(_, values)| (is_single(values), values.as_slice())).collect();
    for (i, position) in mesh.vertices().iter().enumerate() {
        record.clear();
        if single {
            position.iter().for_each(|&x| record.extend((x as f32).to_le_bytes()));
        } else {
            position.iter().for_each(|x| record.extend(x.to_le_bytes()));
        }
        record.extend(attributes.vertex_colors.iter().flat_map(|colors| colors[i]));
        for (single, values) in &scalars {
            match single {
                true => record.extend((values[i] as f32).to_le_bytes()),
                false => record.extend(values[i].to_le_bytes()),
            }
        }
        attributes.vertex_integers.iter().for_each(|field| field.kind.put(field.values[i], &mut record));
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
