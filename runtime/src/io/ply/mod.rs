//! Polygon File Format (Turk 1994): text and both binary byte orders, any further elements and properties.
//!
//! Kept are positions, colours, texture coordinates (per vertex, or per corner as the list `texcoord`), the image
//! named by a `TextureFile` comment, and every other scalar property of the vertices as a field. Colours of faces
//! become colours of the vertices. Normals are not kept.

mod columns;
mod header;
mod records;
mod source;
mod write;

use std::path::Path;

use super::assemble::MeshBuilder;
use super::attributes::{MeshFile, Texture};
use super::error::{ParseError, Parsed, TRUNCATED};
use super::format::MeshFormat;
use super::reference::find_file;
use super::text::quote;
use header::{Element, Encoding, Header};
use source::{Binary, Source, Text};

pub(super) use write::write;

pub(super) fn read(bytes: &[u8], folder: &Path) -> Parsed<MeshFile> {
    let header = Header::parse(bytes)?;
    let body = &bytes[header.body..];
    let mut builder = MeshBuilder::new(MeshFormat::Ply);
    let (uvs, image_of_face) = match header.encoding {
        Encoding::Text => read_body(Text::new(body, header.n_lines), &header, &mut builder)?,
        Encoding::LittleEndian => read_body(Binary::<false>::new(bytes, header.body), &header, &mut builder)?,
        Encoding::BigEndian => read_body(Binary::<true>::new(bytes, header.body), &header, &mut builder)?,
    };
    if builder.corner_uvs.is_empty() && !uvs.is_empty() {
        builder.spread_uvs(&uvs);
    }
    texture(&header.textures, &image_of_face, folder, &mut builder);
    builder.finish()
}

/// Keeps the image that most triangles refer to.
fn texture(names: &[Vec<u8>], image_of_face: &[u32], folder: &Path, builder: &mut MeshBuilder) {
    if names.is_empty() {
        return;
    }
    let mut counts = vec![0usize; names.len()];
    for &image in image_of_face {
        if let Some(count) = counts.get_mut(image as usize) {
            *count += 1;
        }
    }
    let kept = (0..names.len()).max_by_key(|&i| (counts[i], std::cmp::Reverse(i))).unwrap_or(0);
    let left_out = &mut builder.info.left_out;
    if builder.corner_uvs.is_empty() {
        left_out.push(format!("the image {}, since there are no texture coordinates", quote(&names[kept])));
        return;
    }
    match find_file(folder, &names[kept]) {
        Some(path) => {
            builder.info.files.push(path.clone());
            builder.attributes.texture = Some(Texture::File(path));
        }
        None => left_out
            .push(format!("the image {}, which is not there; put it beside the mesh", quote(&names[kept]))),
    }
    if names.len() > 1 {
        let others: Vec<String> =
            names.iter().filter(|name| **name != names[kept]).take(8).map(|name| quote(name)).collect();
        left_out.push(format!(
            "the images {} besides {}, which alone is kept",
            others.join(", "),
            quote(&names[kept])
        ));
        let n_others = image_of_face.len() - counts[kept];
        if n_others > 0 {
            left_out.push(format!(
                "the right image of {n_others} triangles, whose texture coordinates are for another"
            ));
        }
    }
}

/// Reads all elements into the builder; returns the texture coordinates per vertex and the number of each triangle's
/// image, if there are any.
#[allow(clippy::type_complexity)]
fn read_body<S: Source>(
    mut source: S,
    header: &Header,
    builder: &mut MeshBuilder,
) -> Parsed<(Vec<[f32; 2]>, Vec<u32>)> {
    let n_vertices = header.elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    let mut uvs = Vec::new();
    let mut faces = records::FaceColumns::default();
    for element in &header.elements {
        check_count(&source, element)?;
        match element.name.as_str() {
            "vertex" => uvs = records::read_vertices(&mut source, element, builder)?,
            // There is nothing to read of them, so no count would ever be too large.
            "face" | "tristrips" if element.properties.is_empty() && element.count > 0 => {
                let problem = format!("{} records of '{}' without a property", element.count, element.name);
                return Err(ParseError::part("header", problem));
            }
            "face" => faces = records::read_faces(&mut source, element, n_vertices, builder)?,
            "tristrips" => records::read_strips(&mut source, element, n_vertices, builder)?,
            _ => {
                records::skip(&mut source, element)?;
                if element.count > 0 {
                    builder.info.left_out.push(format!("{} records of '{}'", element.count, element.name));
                }
            }
        }
    }
    Ok((uvs, faces.finish(builder)))
}

/// Refuses a count that the rest of the file cannot hold, before memory is set aside for it.
fn check_count<S: Source>(source: &S, element: &Element) -> Parsed<()> {
    let needed: usize = element.properties.iter().map(|p| S::min_bytes(p)).sum();
    if needed as u128 * element.count as u128 > source.remaining() as u128 + 1 {
        let problem = format!(
            "the header promises {} records of '{}', but only {} bytes are left",
            element.count,
            element.name,
            source.remaining()
        );
        return Err(ParseError::new(source.position(), problem, TRUNCATED));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
