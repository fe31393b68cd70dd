//! Writing: coordinates in full precision, colours behind them, one material where there is an image.

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;

use crate::Mesh;
use crate::io::attributes::Attributes;
use crate::io::reference::bytes_of_path;
use crate::io::{IoError, write_atomically};

pub(in crate::io) fn write(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<(), IoError> {
    let texture = attributes.texture.as_ref().filter(|_| attributes.corner_uvs.is_some());
    let image = texture.map(|texture| texture.place_beside(path)).transpose()?.flatten();
    let library = image.is_some().then(|| path.with_extension("mtl"));
    if let (Some(image), Some(library)) = (&image, &library) {
        write_atomically(library, |w| {
            write!(w, "newmtl surface\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd ")?;
            w.write_all(&bytes_of_path(image))?;
            writeln!(w)
        })?;
    }
    write_atomically(path, |w| {
        if let Some(name) = library.as_deref().and_then(Path::file_name) {
            w.write_all(b"mtllib ")?;
            w.write_all(&bytes_of_path(Path::new(name)))?;
            writeln!(w)?;
        }
        write_vertices(w, mesh, attributes)?;
        match &attributes.corner_uvs {
            Some(uvs) => write_textured_faces(w, mesh, uvs, image.is_some()),
            None => {
                mesh.faces().iter().try_for_each(|[a, b, c]| writeln!(w, "f {} {} {}", a + 1, b + 1, c + 1))
            }
        }
    })
}

fn write_vertices(w: &mut dyn Write, mesh: &Mesh, attributes: &Attributes) -> io::Result<()> {
    for (i, [x, y, z]) in mesh.vertices().iter().enumerate() {
        write!(w, "v {x:?} {y:?} {z:?}")?;
        if let Some(colors) = &attributes.vertex_colors {
            let [r, g, b, _] = colors[i].map(|c| f64::from(c) / 255.0);
            write!(w, " {r:.6} {g:.6} {b:.6}")?;
        }
        writeln!(w)?;
    }
    Ok(())
}

/// Writes every distinct texture coordinate once, then the faces.
fn write_textured_faces(
    w: &mut dyn Write,
    mesh: &Mesh,
    uvs: &[[[f32; 2]; 3]],
    material: bool,
) -> io::Result<()> {
    let mut number_of_uv = HashMap::new();
    for uv in uvs.iter().flatten() {
        let next = number_of_uv.len() + 1;
        if *number_of_uv.entry(uv.map(f32::to_bits)).or_insert(next) == next {
            writeln!(w, "vt {:?} {:?}", uv[0], uv[1])?;
        }
    }
    if material {
        writeln!(w, "usemtl surface")?;
    }
    for (face, uvs) in mesh.faces().iter().zip(uvs) {
        w.write_all(b"f")?;
        for (corner, uv) in face.iter().zip(uvs) {
            write!(w, " {}/{}", corner + 1, number_of_uv[&uv.map(f32::to_bits)])?;
        }
        writeln!(w)?;
    }
    Ok(())
}
