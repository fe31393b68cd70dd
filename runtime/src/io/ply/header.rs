//! The header: which elements follow, how many of each, and the properties of one.

use crate::io::attributes::IntegerKind;
use crate::io::error::{ParseError, Parsed, Position, TRUNCATED};
use crate::io::text::{Words, quote};

/// How the values after the header are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// What a property holds: one number, or a list after its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Scalar(Number),
    List { length: Number, item: Number },
}

#[derive(Debug, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// The files named by `TextureFile` comments.
    pub(super) textures: Vec<Vec<u8>>,
    /// Where the values begin, in bytes.
    pub(super) body: usize,
    /// How many lines the header has.
    pub(super) n_lines: usize,
}

impl Number {
    fn parse(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The type of a field of such integers.
    pub(super) fn integer_kind(self) -> Option<IntegerKind> {
        Some(match self {
            Self::I8 => IntegerKind::I8,
            Self::U8 => IntegerKind::U8,
            Self::I16 => IntegerKind::I16,
            Self::U16 => IntegerKind::U16,
            Self::I32 => IntegerKind::I32,
            Self::U32 => IntegerKind::U32,
            Self::F32 | Self::F64 => return None,
        })
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

impl Header {
    pub(super) fn parse(bytes: &[u8]) -> Parsed<Self> {
        let mut lines = HeaderLines { bytes, at: 0, number: 0 };
        if !lines.next()?.next().is_some_and(|word| word.eq_ignore_ascii_case(b"ply")) {
            return Err(ParseError::line(1, "the file does not begin with 'ply'"));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut textures = Vec::new();
        loop {
            let mut words = lines.next()?;
            match words.next().unwrap_or_default() {
                b"end_header" => break,
                b"format" => encoding = Some(parse_encoding(&mut words)?),
                b"comment" => textures.extend(texture_file(&mut words)),
                b"element" => {
                    let element = parse_element(&mut words)?;
                    if elements.iter().any(|e| e.name == element.name) {
                        return Err(
                            words.error(format!("a second element {}", quote(element.name.as_bytes())))
                        );
                    }
                    elements.push(element);
                }
                b"property" => {
                    let element =
                        elements.last_mut().ok_or_else(|| words.error("a property before any element"))?;
                    element.properties.push(parse_property(&mut words)?);
                }
                b"" | b"obj_info" => {}
                other => return Err(words.error(format!("the header has no keyword {}", quote(other)))),
            }
        }
        let encoding =
            encoding.ok_or_else(|| ParseError::line(lines.number, "the header has no 'format' line"))?;
        Ok(Self { encoding, elements, textures, body: lines.at, n_lines: lines.number })
    }
}

fn parse_encoding(words: &mut Words<'_>) -> Parsed<Encoding> {
    match words.expect("the format")? {
        b"ascii" => Ok(Encoding::Text),
        b"binary_little_endian" => Ok(Encoding::LittleEndian),
        b"binary_big_endian" => Ok(Encoding::BigEndian),
        other => Err(words.error(format!(
            "the format {} is not one of ascii, binary_little_endian, binary_big_endian",
            quote(other)
        ))),
    }
}

fn texture_file(words: &mut Words<'_>) -> Option<Vec<u8>> {
    words.next()?.eq_ignore_ascii_case(b"TextureFile").then(|| words.rest().trim_ascii().to_vec())
}

fn parse_element(words: &mut Words<'_>) -> Parsed<Element> {
    let name = text(words.expect("the element's name")?);
    let count = words.size("the number of records")?;
    Ok(Element { name, count, properties: Vec::new() })
}

fn parse_property(words: &mut Words<'_>) -> Parsed<Property> {
    let number = |words: &mut Words<'_>, word: &[u8]| {
        Number::parse(word).ok_or_else(|| words.error(format!("there is no number type {}", quote(word))))
    };
    let word = words.expect("the property's type")?;
    let kind = if word == b"list" {
        let length = words.expect("the type of the list's length")?;
        let length = number(words, length)?;
        if length.is_float() {
            return Err(words.error("the length of a list must be an integer type"));
        }
        let item = words.expect("the type of the list's items")?;
        Kind::List { length, item: number(words, item)? }
    } else {
        Kind::Scalar(number(words, word)?)
    };
    Ok(Property { name: text(words.expect("the property's name")?), kind })
}

fn text(word: &[u8]) -> String {
    String::from_utf8_lossy(word).into_owned()
}

/// The lines of the header, of which the last is followed by bytes that may look like line ends.
struct HeaderLines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
}

impl<'a> HeaderLines<'a> {
    fn next(&mut self) -> Parsed<Words<'a>> {
        self.number += 1;
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&b| b == b'\n' || b == b'\r').ok_or_else(|| {
            ParseError::new(Position::Line(self.number), "the file ends before 'end_header'", TRUNCATED)
        })?;
        self.at += length + if rest[length..].starts_with(b"\r\n") { 2 } else { 1 };
        Ok(Words::new(&rest[..length], self.number))
    }
}
