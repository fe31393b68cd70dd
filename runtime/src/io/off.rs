//! Object File Format: OFF and its variants with colours (C), normals (N) and texture coordinates (ST) per vertex.
//!
//! Format: Geomview manual, section 4.2.5. Colours of faces become colours of the vertices; normals are not kept.

use std::path::Path;

use super::assemble::{MeshBuilder, colors_to_bytes};
use super::attributes::{Attributes, MeshFile};
use super::error::{ParseError, Parsed, Position, TRUNCATED};
use super::text::{Lines, Words, integer, quote};
use super::{IoError, MeshFormat, write_atomically};
use crate::Mesh;

/// The shortest lines there can be, such as `0 0 0` and `0`, less the newline that the last one may lack.
const MIN_VERTEX_BYTES: usize = 5;
const MIN_FACE_BYTES: usize = 1;

/// What the header says.
#[derive(Debug, PartialEq)]
struct Header {
    normals: bool,
    colors: bool,
    uvs: bool,
    n_vertices: usize,
    n_faces: usize,
}

pub(super) fn read(bytes: &[u8]) -> Parsed<MeshFile> {
    let mut lines = Lines::new(bytes);
    let header = read_header(&mut lines)?;
    let needed = header.n_vertices as u128 * MIN_VERTEX_BYTES as u128
        + header.n_faces as u128 * MIN_FACE_BYTES as u128;
    if needed > lines.remaining() as u128 {
        let problem = format!(
            "the header promises {} vertices and {} faces, but only {} bytes follow",
            header.n_vertices,
            header.n_faces,
            lines.remaining()
        );
        return Err(ParseError::new(Position::Line(lines.number()), problem, TRUNCATED));
    }
    let mut builder = MeshBuilder::new(MeshFormat::Off);
    let uvs = read_vertices(&mut lines, &header, &mut builder)?;
    read_faces(&mut lines, &header, &mut builder)?;
    if header.uvs {
        builder.spread_uvs(&uvs);
    }
    builder.finish()
}

fn read_header(lines: &mut Lines<'_>) -> Parsed<Header> {
    let mut words = next_line(lines, "header")?;
    let mut header = Header { normals: false, colors: false, uvs: false, n_vertices: 0, n_faces: 0 };
    let keyword = words.clone().next().unwrap_or_default();
    // The keyword may be absent, and some files have the first count attached to it: `OFF490 518 0`.
    if integer(keyword).is_none() {
        let start = keyword.windows(3).position(|w| w.eq_ignore_ascii_case(b"OFF"));
        let Some(start) = start.filter(|&start| header.set_variant(&keyword[..start])) else {
            let problem = format!("{} is not one of OFF, COFF, NOFF, CNOFF, STOFF ...", quote(keyword));
            return Err(words.error(problem));
        };
        words = Words::new(&words.rest().trim_ascii_start()[start + 3..], lines.number());
    }
    if words.clone().next().is_none() {
        words = next_line(lines, "line of counts")?;
    }
    if words.clone().next().is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
        let remedy = "save it as a text OFF or as PLY";
        return Err(ParseError::new(Position::Line(lines.number()), "binary OFF is not supported", remedy));
    }
    header.n_vertices = words.size("the number of vertices")?;
    header.n_faces = words.size("the number of faces")?;
    Ok(header)
}

impl Header {
    /// Takes the letters before `OFF`; false where they are of no three-dimensional variant.
    fn set_variant(&mut self, prefix: &[u8]) -> bool {
        let prefix = prefix.to_ascii_uppercase();
        let rest = prefix.strip_prefix(b"ST");
        self.uvs = rest.is_some();
        let letters = rest.unwrap_or(&prefix);
        self.normals = letters.contains(&b'N');
        self.colors = letters.contains(&b'C');
        letters.len() == usize::from(self.normals) + usize::from(self.colors)
    }
}

/// Reads the positions and colours into the builder; returns the texture coordinates, if there are any.
fn read_vertices(lines: &mut Lines<'_>, header: &Header, builder: &mut MeshBuilder) -> Parsed<Vec<[f32; 2]>> {
    builder.vertices.reserve_exact(header.n_vertices);
    let (mut colors, mut uvs) = (Colors::default(), Vec::new());
    for vertex in 0..header.n_vertices {
        let mut words = next_item(lines, "vertex", vertex, header.n_vertices)?;
        builder.vertex(words.place("a coordinate")?);
        if header.colors {
            colors.read(&mut words, header)?;
        } else if header.normals {
            (0..3).try_for_each(|_| words.expect("a normal's component").map(|_| ()))?;
        }
        if header.uvs {
            uvs.push([
                words.finite("a texture coordinate")? as f32,
                words.finite("a texture coordinate")? as f32,
            ]);
        }
    }
    if header.colors {
        builder.attributes.vertex_colors = Some(colors.to_bytes(header.normals));
    }
    Ok(uvs)
}

/// What stands between positions and texture coordinates: colours of three or four components and perhaps normals.
/// The normals come first, but some programs write them behind the colours.
#[derive(Default)]
struct Colors {
    /// The numbers of each vertex, and how many of them are the colour's.
    rows: Vec<([f32; 7], usize)>,
}

impl Colors {
    fn read(&mut self, words: &mut Words<'_>, header: &Header) -> Parsed<()> {
        let n_normal = if header.normals { 3 } else { 0 };
        let n_others = n_normal + if header.uvs { 2 } else { 0 };
        let n_color = words.clone().count().saturating_sub(n_others);
        if !(3..=4).contains(&n_color) {
            return Err(words.error(format!("a colour has 3 or 4 components, not {n_color}")));
        }
        let mut numbers = [0.0; 7];
        for number in &mut numbers[..n_normal + n_color] {
            *number = words.finite("a component of the colour or normal")? as f32;
        }
        self.rows.push((numbers, n_color));
        Ok(())
    }

    fn to_bytes(&self, normals: bool) -> Vec<[u8; 4]> {
        let is_unit = |x: &[f32]| (x.iter().map(|x| x * x).sum::<f32>().sqrt() - 1.0).abs() < 0.02;
        let first = || self.rows.iter().all(|(row, _)| is_unit(&row[..3]));
        let last = || self.rows.iter().all(|(row, n_color)| is_unit(&row[*n_color..n_color + 3]));
        let from = if normals && (first() || !last()) { 3 } else { 0 };
        let alpha = self.rows.iter().all(|(_, n_color)| *n_color == 4);
        let color = |(row, n_color): &([f32; 7], usize)| {
            let a = if *n_color == 4 { row[from + 3] } else { 1.0 };
            [row[from], row[from + 1], row[from + 2], a]
        };
        let colors: Vec<[f32; 4]> = self.rows.iter().map(color).collect();
        colors_to_bytes(&colors, alpha)
    }
}

fn read_faces(lines: &mut Lines<'_>, header: &Header, builder: &mut MeshBuilder) -> Parsed<()> {
    // A triangle's line has at least 8 bytes; a file of shorter ones only makes the vector grow.
    builder.faces.reserve(header.n_faces.min(lines.remaining() / 8 + 1));
    let (mut corners, mut colors, mut n_indices) = (Vec::new(), FaceColors::default(), 0);
    for face in 0..header.n_faces {
        let mut words = next_item(lines, "face", face, header.n_faces)?;
        let n_corners = words.size("the number of corners")?;
        corners.clear();
        for _ in 0..n_corners {
            corners.push(words.index("vertex", header.n_vertices)?);
        }
        let first = builder.faces.len();
        builder.polygon(&corners);
        match words.clone().count() {
            0 => {}
            3 | 4 => colors.read(&mut words, first, builder.faces.len())?,
            _ => n_indices += 1,
        }
    }
    colors.spread(builder);
    if n_indices > 0 {
        let what = format!("the entry of {n_indices} faces in a colour map");
        builder.info.left_out.push(what);
    }
    Ok(())
}

/// Colours behind the corners of faces, with the range of triangles that each belongs to.
#[derive(Default)]
struct FaceColors {
    colors: Vec<[f32; 4]>,
    triangles: Vec<std::ops::Range<usize>>,
    without_alpha: bool,
}

impl FaceColors {
    fn read(&mut self, words: &mut Words<'_>, first: usize, end: usize) -> Parsed<()> {
        let n_components = words.clone().count();
        let mut color = [1.0; 4];
        for component in &mut color[..n_components] {
            *component = words.finite("a colour component")? as f32;
        }
        self.without_alpha |= n_components == 3;
        self.colors.push(color);
        self.triangles.push(first..end);
        Ok(())
    }

    fn spread(self, builder: &mut MeshBuilder) {
        let bytes = colors_to_bytes(&self.colors, !self.without_alpha);
        let mut of_face = vec![None; builder.faces.len()];
        for (range, color) in self.triangles.into_iter().zip(bytes) {
            of_face[range].fill(Some(color));
        }
        builder.spread_face_colors(&of_face, "faces");
    }
}

fn next_line<'a>(lines: &mut Lines<'a>, what: &str) -> Parsed<Words<'a>> {
    lines.next_data().ok_or_else(|| {
        ParseError::new(Position::Line(lines.number() + 1), format!("the {what} is missing"), TRUNCATED)
    })
}

fn next_item<'a>(lines: &mut Lines<'a>, what: &str, i: usize, n: usize) -> Parsed<Words<'a>> {
    lines.next_data().ok_or_else(|| {
        let problem = format!("the file ends before {what} {i} of {n}");
        ParseError::new(Position::Line(lines.number()), problem, TRUNCATED)
    })
}

pub(super) fn write(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<(), IoError> {
    write_atomically(path, |w| {
        let colors = attributes.vertex_colors.as_deref();
        writeln!(w, "{}", if colors.is_some() { "COFF" } else { "OFF" })?;
        writeln!(w, "{} {} 0", mesh.n_vertices(), mesh.n_faces())?;
        for (i, [x, y, z]) in mesh.vertices().iter().enumerate() {
            write!(w, "{x:?} {y:?} {z:?}")?;
            if let Some([r, g, b, a]) = colors.map(|c| c[i]) {
                write!(w, " {r} {g} {b} {a}")?;
            }
            writeln!(w)?;
        }
        mesh.faces().iter().try_for_each(|[a, b, c]| writeln!(w, "3 {a} {b} {c}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Parsed<MeshFile> {
        read(text.as_bytes())
    }

    #[test]
    fn plain_with_comments_blank_lines_and_polygons() {
        let text = "# made by hand\nOFF\n\n4 3 0 # counts\n0 0 0\n1 0 0 # a corner\n\n1 1 0\n0 1 0\n\
                    4 0 1 2 3 0.5 0.5 0.5\n2 0 1\n3 0 2 3\n";
        let file = read_text(text).unwrap();
        assert_eq!(file.mesh.n_vertices(), 4);
        assert_eq!(file.mesh.faces(), [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
        assert_eq!((file.info.n_polygons, file.info.n_ignored_faces), (1, 1));
        let grey = [128, 128, 128, 255];
        assert_eq!(file.attributes.vertex_colors, Some(vec![grey; 4]));
    }

    #[test]
    fn colors_of_every_range_and_order() {
        let colors = |text: &str| read_text(text).unwrap().attributes.vertex_colors.unwrap();
        // Whole numbers that are fractions all the same, as %g prints them; with an alpha of 1 behind bytes; 16 bits.
        assert_eq!(
            colors("COFF\n2 0 0\n0 0 0 1 0 0 1\n0 0 0 0 0 1 1\n"),
            [[255, 0, 0, 255], [0, 0, 255, 255]]
        );
        assert_eq!(
            colors("COFF\n2 0 0\n0 0 0 255 0 0 1\n0 0 0 0 7 1 1\n"),
            [[255, 0, 0, 255], [0, 7, 1, 255]]
        );
        assert_eq!(colors("COFF\n1 0 0\n0 0 0 65535 0 257\n"), [[255, 0, 1, 255]]);
        // Normals in front, where they belong, and behind.
        let expected = [[255, 128, 0, 255], [0, 0, 1, 255]];
        assert_eq!(colors("CNOFF\n2 0 0\n0 0 0 0 0 1 255 128 0\n0 0 0 0.6 0.8 0 0 0 1\n"), expected);
        assert_eq!(colors("NCOFF\n2 0 0\n0 0 0 255 128 0 0 0 1\n0 0 0 0 0 1 0.6 0.8 0\n"), expected);
    }

    #[test]
    fn colors_of_faces_come_to_the_vertices() {
        let text =
            "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 255 0 0\n3 1 3 2 0 0 255 255\n3 0 1 3 5\n";
        let file = read_text(text).unwrap();
        let mixed = [128, 0, 128, 255];
        let expected = [[255, 0, 0, 255], mixed, mixed, [0, 0, 255, 255]];
        assert_eq!(file.attributes.vertex_colors.unwrap(), expected);
        assert!(file.info.left_out.iter().any(|what| what.contains("1 faces in a colour map")));
        // Colours of the vertices themselves come before those of the faces.
        let file =
            read_text("COFF\n3 1 0\n0 0 0 9 9 9\n1 0 0 9 9 9\n0 1 0 9 9 9\n3 0 1 2 255 0 0\n").unwrap();
        assert_eq!(file.attributes.vertex_colors.unwrap(), [[9, 9, 9, 255]; 3]);
        assert!(file.info.left_out[0].contains("the vertices have their own"));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused_in_any_spelling() {
        for number in ["1.#INF00", "-1.#IND00", "1.#QNAN0", "nan(ind)", "inf"] {
            let error = read_text(&format!("OFF\n2 1 0\n0 0 {number}\n0 0 0\n3 0 1 1\n"))
                .unwrap_err()
                .in_file(Path::new("a.off"));
            assert!(error.to_string().contains("line 3: a coordinate is not finite"), "{error}");
        }
    }

    #[test]
    fn header_with_counts_on_its_line_or_without_keyword() {
        let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
        for header in
            ["OFF 3 1 0\n", "OFF3 1 0\n", "3 1 0\n", "OFF\r\n3 1\r\n", "off\n3\t1 0\n", "  OFF\n3 1 0\n"]
        {
            let file = read_text(&format!("{header}{body}")).unwrap();
            assert_eq!((file.mesh.n_vertices(), file.mesh.n_faces()), (3, 1), "{header:?}");
        }
    }

    #[test]
    fn variants_with_colors_normals_and_texture_coordinates() {
        let faces = "3 0 1 2\n";
        let colored = "COFF\n3 1 0\n0 0 0 255 0 0 128\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n";
        let file = read_text(&format!("{colored}{faces}")).unwrap();
        let colors = file.attributes.vertex_colors.unwrap();
        assert_eq!(colors, [[255, 0, 0, 128], [0, 255, 0, 255], [0, 0, 255, 255]]);

        let both = "CNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0\n1 0 0 0 0 1 0 1 0\n0 1 0 0 0 1 0 0 .5\n";
        let file = read_text(&format!("{both}{faces}")).unwrap();
        assert_eq!(
            file.attributes.vertex_colors.unwrap(),
            [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 128, 255]]
        );

        let all =
            "STCNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0 1 0 0\n1 0 0 0 0 1 0 1 0 1 1 0\n0 1 0 0 0 1 0 0 1 1 0 1\n";
        let file = read_text(&format!("{all}{faces}")).unwrap();
        assert_eq!(file.attributes.corner_uvs.unwrap(), [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);

        let file = read_text("NOFF\n1 0 0\n0 0 7 0 0 1\n").unwrap();
        assert_eq!((file.mesh.vertices(), file.attributes), (&[[0.0, 0.0, 7.0]][..], Attributes::default()));
    }

    #[test]
    fn errors_say_line_and_remedy() {
        let message = |text: &str| read_text(text).unwrap_err().in_file(Path::new("a.off")).to_string();
        for (text, expected) in [
            ("", "line 1: the header is missing"),
            ("PLY\n", "line 1: 'PLY' is not one of OFF"),
            ("4OFF\n1 0 0\n0 0 0 1\n", "is not one of"),
            ("OFF BINARY\n", "save it as a text OFF"),
            ("OFF\n-3 1 0\n", "line 2: the number of vertices is -3"),
            ("OFF\n4000000000 9000000000 0\n0 0 0\n", "promises 4000000000 vertices"),
            ("OFF\n2 1 0\n0 0 0\n0 nan 0\n3 0 1 1\n", "line 4: a coordinate is not finite: 'nan'"),
            ("OFF\n2 0 0\n0 0 0\n0 0,5 0\n", "line 4: a coordinate is not a number: '0,5'"),
            ("OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "line 4: vertex 1 is out of range: there are 1"),
            ("OFF\n1 1 0\n0 0 0\n3 0 0\n", "line 4: vertex is missing at the end of the line"),
            ("OFF\n2 0 0\n0 0 0         \n", "the file ends before vertex 1 of 2; the file is truncated"),
            ("COFF\n1 0 0\n0 0 0 1 1\n", "3 or 4 components, not 2"),
        ] {
            assert!(message(text).contains(expected), "{}", message(text));
            assert!(message(text).starts_with("a.off, "));
        }
    }
}
