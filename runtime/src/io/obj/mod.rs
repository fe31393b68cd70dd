//! Wavefront OBJ: vertices in file order, with colours behind the coordinates; polygons with texture coordinates.
//!
//! Parsed here: `tobj` renumbers the vertices of each object by first use and drops those that no face uses, but vertex `i` of
//! the file must stay vertex `i`; and it panics on some material libraries.

mod material;
mod write;

use std::path::Path;

use super::assemble::{MeshBuilder, colors_to_bytes};
use super::attributes::MeshFile;
use super::error::{ParseError, Parsed};
use super::format::MeshFormat;
use super::text::{Lines, Words, float, quote};

pub(super) use write::write;

pub(super) fn read(bytes: &[u8], folder: &Path) -> Parsed<MeshFile> {
    let mut reader = Reader::new();
    let mut lines = Lines::new(bytes);
    let mut joined = Vec::new();
    while let Some(line) = lines.next() {
        let number = lines.number();
        if continued(line).is_some() {
            join(line, &mut lines, &mut joined);
            reader.line(&joined, number)?;
        } else {
            reader.line(line, number)?;
        }
    }
    reader.finish(folder)
}

/// What stands before the backslash at the end of a line that goes on in the next one.
fn continued(line: &[u8]) -> Option<&[u8]> {
    line.trim_ascii_end().strip_suffix(b"\\").filter(|line| !line.trim_ascii_start().starts_with(b"#"))
}

fn join<'a>(first: &'a [u8], lines: &mut Lines<'a>, joined: &mut Vec<u8>) {
    joined.clear();
    let mut line = Some(first);
    while let Some(part) = line {
        joined.push(b' ');
        let Some(part) = continued(part) else {
            joined.extend(part);
            break;
        };
        joined.extend(part);
        line = lines.next();
    }
}

struct Reader {
    builder: MeshBuilder,
    colors: Vec<[f32; 4]>,
    /// Whether all colours have an alpha.
    alpha: bool,
    uvs: Vec<[f32; 2]>,
    /// The line of each triangle, for the check of its indices when all vertices are known.
    lines: Vec<u32>,
    libraries: Vec<Vec<u8>>,
    materials: Vec<Vec<u8>>,
    corners: Vec<u32>,
    corner_uvs: Vec<[f32; 2]>,
}

impl Reader {
    fn new() -> Self {
        Self {
            builder: MeshBuilder::new(MeshFormat::Obj),
            colors: Vec::new(),
            alpha: true,
            uvs: Vec::new(),
            lines: Vec::new(),
            libraries: Vec::new(),
            materials: Vec::new(),
            corners: Vec::new(),
            corner_uvs: Vec::new(),
        }
    }

    fn line(&mut self, line: &[u8], number: usize) -> Parsed<()> {
        let line = match line.iter().position(|&b| b == b'#') {
            Some(comment) => &line[..comment],
            None => line,
        };
        let mut words = Words::new(line, number);
        match words.next().unwrap_or_default() {
            b"v" => self.vertex(words),
            b"vt" => {
                let u = words.finite("a texture coordinate")? as f32;
                let v = words.next().and_then(float).unwrap_or(0.0) as f32;
                self.uvs.push([u, v]);
                Ok(())
            }
            b"f" | b"fo" => self.face(words, number),
            b"mtllib" => {
                self.libraries.push(words.rest().trim_ascii().to_vec());
                Ok(())
            }
            b"usemtl" => {
                let name = words.rest().trim_ascii();
                if self.materials.last().is_none_or(|last| last != name) {
                    self.materials.push(name.to_vec());
                }
                Ok(())
            }
            // Normals, groups, lines, curves and whatever else there may be.
            _ => Ok(()),
        }
    }

    /// `v x y z [w]`, `v x y z r g b` or `v x y z r g b a`.
    fn vertex(&mut self, mut words: Words<'_>) -> Parsed<()> {
        self.builder.vertices.push(words.point("a coordinate")?);
        let mut rest = [1.0f32; 4];
        let mut n = 0;
        while let Some(word) = words.next().filter(|_| n < 4) {
            rest[n] = match float(word) {
                Some(value) => value as f32,
                None => {
                    return Err(words.error(format!("a colour component is not a number: {}", quote(word))));
                }
            };
            n += 1;
        }
        if n >= 3 {
            // Vertices before the first coloured one are white.
            self.colors.resize(self.builder.vertices.len() - 1, [1.0; 4]);
            self.colors.push(rest);
            self.alpha &= n == 4;
        }
        Ok(())
    }

    fn face(&mut self, mut words: Words<'_>, number: usize) -> Parsed<()> {
        self.corners.clear();
        self.corner_uvs.clear();
        let (n_vertices, n_uvs) = (self.builder.vertices.len(), self.uvs.len());
        while let Some(word) = words.next() {
            let (vertex, uv) = parse_corner(word).ok_or_else(|| {
                words.error(format!(
                    "{} is not a face's corner, as in '1', '1/2', '1//3' or '1/2/3'",
                    quote(word)
                ))
            })?;
            let vertex =
                absolute(vertex, n_vertices).ok_or_else(|| no_such(&words, "vertex", vertex, n_vertices))?;
            self.corners.push(vertex);
            if let Some(uv) = uv {
                let known = absolute(uv, n_uvs).and_then(|i| self.uvs.get(i as usize));
                self.corner_uvs.push(*known.ok_or_else(|| no_such(&words, "texture coordinate", uv, n_uvs))?);
            }
        }
        self.builder
            .polygon_with_uvs(&self.corners, Some(self.corner_uvs.as_slice()).filter(|uvs| !uvs.is_empty()));
        self.lines.resize(self.builder.faces.len(), number as u32);
        Ok(())
    }

    fn finish(mut self, folder: &Path) -> Parsed<MeshFile> {
        let n = self.builder.vertices.len();
        if n == 0 {
            return Err(ParseError::line(1, "there are no vertices ('v' lines)"));
        }
        for (face, &line) in self.builder.faces.iter().zip(&self.lines) {
            if let Some(&vertex) = face.iter().find(|&&i| i as usize >= n) {
                return Err(no_such(&Words::new(b"", line as usize), "vertex", i64::from(vertex) + 1, n));
            }
        }
        if !self.colors.is_empty() {
            self.colors.resize(n, [1.0; 4]);
            self.builder.attributes.vertex_colors = Some(colors_to_bytes(&self.colors, self.alpha));
        }
        if !self.builder.corner_uvs.is_empty() {
            let texture =
                material::texture(&self.libraries, &self.materials, folder, &mut self.builder.info.warnings);
            self.builder.attributes.texture = texture;
        }
        self.builder.finish()
    }
}

/// Splits `v`, `v/vt`, `v//vn` or `v/vt/vn` into the indices of vertex and texture coordinate, as written.
fn parse_corner(word: &[u8]) -> Option<(i64, Option<i64>)> {
    let mut parts = word.split(|&b| b == b'/');
    let vertex = parse_index(parts.next()?)?;
    let uv = match parts.next() {
        None | Some(b"") => None,
        Some(part) => Some(parse_index(part)?),
    };
    Some((vertex, uv))
}

/// A decimal integer other than 0.
fn parse_index(digits: &[u8]) -> Option<i64> {
    std::str::from_utf8(digits).ok()?.parse().ok().filter(|&i| i != 0)
}

/// The 0-based index: positive ones count from 1, negative ones back from the `n` so far. Positive ones may lie ahead.
fn absolute(index: i64, n: usize) -> Option<u32> {
    let index = if index > 0 { index - 1 } else { index.checked_add(i64::try_from(n).ok()?)? };
    u32::try_from(index).ok()
}

fn no_such(words: &Words<'_>, what: &str, index: i64, n: usize) -> ParseError {
    words.error(format!("{what} {index} does not exist: there are {n}, counted from 1"))
}

#[cfg(test)]
mod tests;
