//! Polygon File Format (Turk 1994): text and both binary byte orders, any further elements and properties.
//!
//! Kept are positions, colours, texture coordinates (per vertex, or per corner as the list `texcoord`), the image
//! named by a `TextureFile` comment, and every other scalar property of the vertices as a field. Normals are not.

mod header;
mod records;
mod source;
mod write;

use std::path::Path;

use super::assemble::MeshBuilder;
use super::attributes::{MeshFile, Texture};
use super::error::{ParseError, Parsed, TRUNCATED};
use super::format::MeshFormat;
use header::{Element, Encoding, Header};
use source::{Binary, Source, Text};

pub(super) use write::write;

pub(super) fn read(bytes: &[u8], folder: &Path) -> Parsed<MeshFile> {
    let header = Header::parse(bytes)?;
    let body = &bytes[header.body..];
    let mut builder = MeshBuilder::new(MeshFormat::Ply);
    let uvs = match header.encoding {
        Encoding::Text => read_body(Text::new(body, header.n_lines), &header, &mut builder)?,
        Encoding::LittleEndian => read_body(Binary::<false>::new(bytes, header.body), &header, &mut builder)?,
        Encoding::BigEndian => read_body(Binary::<true>::new(bytes, header.body), &header, &mut builder)?,
    };
    if builder.corner_uvs.is_empty() && !uvs.is_empty() {
        builder.spread_uvs(&uvs);
    }
    builder.attributes.texture = header.texture.map(|name| Texture::File(folder.join(name)));
    builder.finish()
}

/// Reads all elements into the builder; returns the texture coordinates per vertex, if there are any.
fn read_body<S: Source>(mut source: S, header: &Header, builder: &mut MeshBuilder) -> Parsed<Vec<[f32; 2]>> {
    let n_vertices = header.elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    let mut uvs = Vec::new();
    for element in &header.elements {
        check_count(&source, element)?;
        match element.name.as_str() {
            "vertex" => uvs = records::read_vertices(&mut source, element, builder)?,
            "face" => records::read_faces(&mut source, element, n_vertices, builder)?,
            "tristrips" => records::read_strips(&mut source, element, n_vertices, builder)?,
            _ => records::skip(&mut source, element)?,
        }
    }
    Ok(uvs)
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
