//! Wavefront OBJ: vertices in file order, with colours behind the coordinates (or in `#MRGB` lines, as ZBrush writes
//! them); polygons with texture coordinates.
//!
//! Parsed here: `tobj` renumbers the vertices of each object by first use and drops those that no face uses, but
//! vertex `i` of the file must stay vertex `i`; and it panics on some material libraries.

mod material;
mod write;

use std::path::Path;

use super::assemble::{MeshBuilder, colors_to_bytes};
use super::attributes::MeshFile;
use super::error::{ParseError, Parsed};
use super::format::MeshFormat;
use super::text::{Lines, Words, float, quote, without_comment};

/// As many names of groups and objects are told apart.
const MAX_GROUPS: usize = 256;

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
    /// Colours of `#MRGB` lines.
    painted: Vec<[u8; 4]>,
    uvs: Vec<[f32; 2]>,
    /// The line of each triangle, for the check of its indices when all vertices are known.
    lines: Vec<u32>,
    libraries: Vec<Vec<u8>>,
    materials: Vec<Vec<u8>>,
    /// For each run of triangles of one material the first one, and the material.
    runs: Vec<(usize, usize)>,
    group: Vec<u8>,
    n_weights: usize,
    n_without_area: usize,
    n_curved: usize,
    corners: Vec<u32>,
    corner_uvs: Vec<[f32; 2]>,
}

impl Reader {
    fn new() -> Self {
        Self {
            builder: MeshBuilder::new(MeshFormat::Obj),
            colors: Vec::new(),
            alpha: true,
            painted: Vec::new(),
            uvs: Vec::new(),
            lines: Vec::new(),
            libraries: Vec::new(),
            materials: Vec::new(),
            runs: Vec::new(),
            group: Vec::new(),
            n_weights: 0,
            n_without_area: 0,
            n_curved: 0,
            corners: Vec::new(),
            corner_uvs: Vec::new(),
        }
    }

    fn line(&mut self, line: &[u8], number: usize) -> Parsed<()> {
        // Names may hold a '#', so their lines are taken whole.
        let whole = Words::new(line, number);
        let mut words = Words::new(without_comment(line), number);
        match words.next().unwrap_or_default() {
            b"" => self.comment(line),
            b"v" => self.vertex(words)?,
            b"vt" => {
                let u = words.finite("a texture coordinate")? as f32;
                let v = if words.clone().next().is_some() {
                    words.finite("a texture coordinate")? as f32
                } else {
                    0.0
                };
                self.uvs.push([u, v]);
            }
            b"f" | b"fo" => self.face(words, number)?,
            b"mtllib" => self.libraries.push(name(whole)),
            b"usemtl" => self.material(name(whole)),
            b"g" | b"o" => self.group = name(whole),
            b"l" | b"p" => self.n_without_area += 1,
            b"curv" | b"curv2" | b"surf" => self.n_curved += 1,
            // Normals, smoothing and whatever else there may be.
            _ => {}
        }
        Ok(())
    }

    fn material(&mut self, name: Vec<u8>) {
        let known = self.materials.iter().rposition(|other| *other == name);
        let material = known.unwrap_or_else(|| {
            self.materials.push(name);
            self.materials.len() - 1
        });
        self.runs.push((self.builder.faces.len(), material));
    }

    /// Takes the colours of `#MRGB` and eight hexadecimal digits for each vertex: mask, red, green, blue.
    fn comment(&mut self, line: &[u8]) {
        let Some(digits) = line.trim_ascii().strip_prefix(b"#MRGB") else { return };
        let parse = |group: &[u8]| u32::from_str_radix(std::str::from_utf8(group).ok()?, 16).ok();
        let colors = digits.trim_ascii().chunks_exact(8).map_while(parse);
        self.painted.extend(colors.map(|c| {
            let [_, r, g, b] = c.to_be_bytes();
            [r, g, b, 255]
        }));
    }

    /// `v x y z [w]`, `v x y z r g b` or `v x y z r g b a`.
    fn vertex(&mut self, mut words: Words<'_>) -> Parsed<()> {
        self.builder.vertex(words.place("a coordinate")?);
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
        } else if n > 0 && rest[0] != 1.0 {
            self.n_weights += 1;
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
        if !self.group.is_empty() {
            let (group, groups) = (std::mem::take(&mut self.group), &mut self.builder.info.groups);
            let group = String::from_utf8_lossy(&group).into_owned();
            if groups.len() < MAX_GROUPS && !groups.contains(&group) {
                groups.push(group);
            }
        }
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
        self.vertex_colors(n);
        self.materials(folder);
        let info = &mut self.builder.info;
        if self.n_weights > 0 {
            info.warnings.push(format!(
                "{} vertices have a weight other than 1, which is not applied",
                self.n_weights
            ));
        }
        if self.n_curved > 0 {
            info.warnings.push(format!("{} curves and curved surfaces were left out", self.n_curved));
        }
        if self.n_without_area > 0 {
            info.left_out.push(format!("{} lines and points ('l' and 'p')", self.n_without_area));
        }
        self.builder.finish()
    }

    fn vertex_colors(&mut self, n: usize) {
        if !self.colors.is_empty() {
            self.colors.resize(n, [1.0; 4]);
            self.builder.attributes.vertex_colors = Some(colors_to_bytes(&self.colors, self.alpha));
        }
        match self.painted.len() {
            0 => {}
            painted if painted == n && self.colors.is_empty() => {
                self.builder.attributes.vertex_colors = Some(std::mem::take(&mut self.painted));
            }
            painted => {
                let left_out = format!("{painted} colours of '#MRGB' lines, where there are {n} vertices");
                self.builder.info.left_out.push(left_out);
            }
        }
    }

    /// Takes from the materials in use the image that the texture coordinates refer to, or without images the colours.
    fn materials(&mut self, folder: &Path) {
        if self.materials.is_empty() {
            return;
        }
        let has_uvs = !self.builder.corner_uvs.is_empty();
        let found = material::find(&self.libraries, &self.materials, folder, &mut self.builder.info);
        let has_image = found.iter().flatten().any(|material| material.has_image());
        if has_uvs && has_image {
            let image_of = material::texture(&found, &mut self.builder);
            material::count_other_images(&image_of, &self.runs, &mut self.builder);
        } else if self.builder.attributes.vertex_colors.is_none() && !has_image {
            material::spread_colors(&found, &self.runs, &mut self.builder);
        }
    }
}

/// What follows the keyword, as it is.
fn name(mut line: Words<'_>) -> Vec<u8> {
    line.next();
    line.rest().trim_ascii().to_vec()
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
