//! Stereolithography, text and binary: triangles without connectivity, which is found by welding equal corners.
//!
//! Corners are one vertex where their coordinates are equal; vertices are numbered by first appearance.

use std::collections::HashMap;

use super::assemble::MeshBuilder;
use super::attributes::MeshFile;
use super::error::{ParseError, Parsed, Position, TRUNCATED};
use super::format::MeshFormat;
use super::text::{Lines, Words, decode_text, quote};

/// Bytes before the first triangle of a binary file: a free text and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle: normal, three corners, a 16-bit attribute.
const TRIANGLE: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Parsed<MeshFile> {
    let mut welder = Welder { builder: MeshBuilder::new(MeshFormat::Stl), vertex_of_corner: HashMap::new() };
    if is_text(bytes) {
        read_text(&decode_text(bytes), &mut welder)?;
    } else {
        read_binary(bytes, &mut welder)?;
    }
    welder.builder.finish()
}

/// Whether the length is the one that a binary file's header promises.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    n_triangles(bytes).is_some_and(|n| (HEADER + n * TRIANGLE) == bytes.len())
}

/// Whether this is a text file. A binary one may begin with `solid` too, but has zeros in it soon.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    if is_binary(bytes) {
        return false;
    }
    let text = decode_text(&bytes[..bytes.len().min(4 * HEADER)]);
    let word = text.trim_ascii_start().split(u8::is_ascii_whitespace).next().unwrap_or_default();
    word.eq_ignore_ascii_case(b"solid") && !text.contains(&0)
}

fn n_triangles(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    Some(u32::from_le_bytes(count.try_into().ok()?) as usize)
}

struct Welder {
    builder: MeshBuilder,
    vertex_of_corner: HashMap<[u64; 3], u32>,
}

impl Welder {
    fn vertex(&mut self, position: [f64; 3]) -> u32 {
        // Adding zero makes a negative zero positive, so that equal coordinates have equal bits.
        let key = position.map(|x| (x + 0.0).to_bits());
        *self.vertex_of_corner.entry(key).or_insert_with(|| {
            self.builder.vertices.push(position);
            (self.builder.vertices.len() - 1) as u32
        })
    }
}

fn read_binary(bytes: &[u8], welder: &mut Welder) -> Parsed<()> {
    let stated = n_triangles(bytes).ok_or_else(|| {
        let problem = format!("{} bytes are fewer than the {HEADER} of the header", bytes.len());
        ParseError::new(Position::Byte(bytes.len()), problem, TRUNCATED)
    })?;
    let triangles = bytes[HEADER..].chunks_exact(TRIANGLE);
    if triangles.len() < stated {
        let problem =
            format!("the header promises {stated} triangles, but the file ends after {}", triangles.len());
        return Err(ParseError::new(Position::Byte(bytes.len()), problem, TRUNCATED));
    }
    let info = &mut welder.builder.info;
    // Programs that write as they go leave the count at zero.
    let n = if stated == 0 { triangles.len() } else { stated };
    if n != stated {
        info.warnings.push(format!("the header states no triangles; {n} were found behind it and taken"));
    }
    let rest = &bytes[HEADER + n * TRIANGLE..];
    if rest.iter().any(|b| *b != 0 && !b.is_ascii_whitespace()) {
        info.warnings.push(format!(
            "{} bytes behind the {n} triangles that the header states were left out",
            rest.len()
        ));
    }
    let has_attribute = |record: &[u8]| record[TRIANGLE - 2..] != [0, 0];
    if triangles.clone().take(n).any(has_attribute) {
        info.left_out.push("the attribute bytes of the triangles, which may be colours".into());
    }
    for (triangle, record) in triangles.take(n).enumerate() {
        let mut corners = [0; 3];
        for (c, corner) in corners.iter_mut().enumerate() {
            let position = [0, 1, 2].map(|axis| float_at(record, 12 + 12 * c + 4 * axis));
            if !position.iter().all(|x| x.is_finite()) {
                let problem = format!("corner {c} of triangle {triangle} is not finite: {position:?}");
                return Err(ParseError::byte(HEADER + triangle * TRIANGLE + 12 + 12 * c, problem));
            }
            *corner = welder.vertex(position);
        }
        welder.builder.faces.push(corners);
    }
    Ok(())
}

fn float_at(record: &[u8], at: usize) -> f64 {
    let bytes = [record[at], record[at + 1], record[at + 2], record[at + 3]];
    f64::from(f32::from_le_bytes(bytes))
}

fn read_text(bytes: &[u8], welder: &mut Welder) -> Parsed<()> {
    let mut lines = Lines::new(bytes);
    let mut corners: Option<Vec<u32>> = None;
    let (mut closed, mut n_colors) = (false, 0);
    while let Some(line) = lines.next() {
        let mut words = Words::new(line, lines.number());
        let Some(keyword) = keyword(&mut words) else { continue };
        match (keyword.as_slice(), &mut corners) {
            (b"solid", None) => closed = false,
            (b"facet", None) => corners = Some(Vec::new()),
            (b"vertex", Some(corners)) => corners.push(welder.vertex(words.point("a coordinate")?)),
            (b"outer" | b"outerloop" | b"endloop", Some(_)) => {}
            (b"endfacet", Some(done)) => {
                welder.builder.polygon(done);
                corners = None;
            }
            (b"endsolid", None) => closed = true,
            (b"color", _) => n_colors += 1,
            _ => return Err(words.error(format!("{} is out of place here", quote(&keyword)))),
        }
    }
    if n_colors > 0 {
        welder.builder.info.left_out.push(format!("{n_colors} lines 'color'"));
    }
    if !closed {
        let problem = "the file ends without 'endsolid'";
        return Err(ParseError::new(Position::Line(lines.number()), problem, TRUNCATED));
    }
    Ok(())
}

/// The keyword of a line in lower case; `end facet` is `endfacet`.
fn keyword(words: &mut Words<'_>) -> Option<Vec<u8>> {
    let mut keyword = words.next()?.to_ascii_lowercase();
    if keyword == b"end" {
        keyword.extend(words.next().unwrap_or_default().to_ascii_lowercase());
    }
    Some(keyword)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const TEXT: &str = "solid a vertex of facets\n\
        facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n\
        facet normal 0 0 1\n outer loop\n  vertex 1 0 0\n  vertex 1 1 0\n  vertex -0 1e0 0\n endloop\nendfacet\n\
        endsolid a\n";

    pub(super) fn binary(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = b"solid, says the free text".to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_give_the_same_welded_mesh() {
        let (a, b, c, d) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]);
        let binary = read(&binary(&[[a, b, c], [b, d, [-0.0, 1.0, 0.0]]])).unwrap();
        let text = read(TEXT.as_bytes()).unwrap();
        assert_eq!(binary, text);
        assert_eq!(text.mesh.faces(), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(text.mesh.vertices(), [a, b, c, d].map(|p| p.map(f64::from)));
    }

    #[test]
    fn every_spelling_of_a_text_file() {
        let expected = read(TEXT.as_bytes()).unwrap();
        let spaced = TEXT
            .replace("endfacet", "end facet")
            .replace("endloop", "End Loop")
            .replace("endsolid", "END SOLID");
        let utf16: Vec<u8> = TEXT.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let mixed = TEXT.replace("solid", "Solid").replace("facet", "FACET").replace("vertex", "Vertex");
        for text in [
            TEXT.to_uppercase().into_bytes(),
            mixed.into_bytes(),
            spaced.into_bytes(),
            format!("\u{feff}{TEXT}").into_bytes(),
            format!("\r\n  {}", TEXT.replace('\n', "\r\n")).into_bytes(),
            [&[0xFF, 0xFE], &utf16[..]].concat(),
        ] {
            assert!(is_text(&text));
            assert_eq!(read(&text).unwrap(), expected, "{}", String::from_utf8_lossy(&text));
        }
    }

    #[test]
    fn a_count_of_zero_and_bytes_behind_the_triangles() {
        let (a, b, c, d) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]);
        let whole = binary(&[[a, b, c], [b, d, c]]);
        let expected = read(&whole).unwrap();
        assert_eq!(expected.info.warnings, Vec::<String>::new());
        let mut uncounted = whole.clone();
        uncounted[80..84].fill(0);
        let file = read(&uncounted).unwrap();
        assert_eq!(file.mesh, expected.mesh);
        assert!(file.info.warnings[0].contains("2 were found"), "{:?}", file.info.warnings);
        let file = read(&[&whole[..], b"made by a scanner"].concat()).unwrap();
        assert_eq!(file.mesh, expected.mesh);
        assert!(
            file.info.warnings[0].contains("17 bytes behind the 2 triangles"),
            "{:?}",
            file.info.warnings
        );
        assert_eq!(read(&[&whole[..], &[0; 7]].concat()).unwrap(), expected);
        let mut coloured = whole;
        coloured[132..134].copy_from_slice(&[0x1F, 0x80]);
        assert!(read(&coloured).unwrap().info.left_out[0].contains("attribute bytes"));
        assert_eq!(read(&binary(&[])).unwrap().mesh.n_faces(), 0);
    }

    #[test]
    fn errors_say_where() {
        let message = |bytes: &[u8]| read(bytes).unwrap_err().in_file(Path::new("a.stl")).to_string();
        assert!(message(b"").contains("byte 0: 0 bytes are fewer than the 84"));
        let mut hostile = binary(&[]);
        hostile[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        hostile[0] = b'S';
        assert!(message(&hostile).contains("promises 4294967295 triangles"));
        assert!(message(&binary(&[[[f32::NAN; 3]; 3]])).contains("byte 96: corner 0 of triangle 0"));
        assert!(message(b"solid\nvertex 0 0 0\n").contains("line 2: 'vertex' is out of place"));
        assert!(message(b"solid\nfacet\n").contains("without 'endsolid'"));
    }
}
