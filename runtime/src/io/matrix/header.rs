//! The header: a magic word, a version, and a Python dictionary of element type, order and shape.

use crate::io::error::{ParseError, Parsed, TRUNCATED};
use crate::io::{Position, text::quote};

const MAGIC: &[u8] = b"\x93NUMPY";

/// The element types that are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::io) enum Kind {
    F4,
    F8,
    I4,
    I8,
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) kind: Kind,
    pub(super) big_endian: bool,
    pub(super) fortran_order: bool,
    pub(super) rows: usize,
    pub(super) cols: usize,
    /// Where the data begin, in bytes.
    pub(super) body: usize,
}

impl Header {
    pub(super) fn parse(bytes: &[u8]) -> Parsed<Self> {
        let (dictionary, body) = split(bytes)?;
        let value = |key: &str| value(dictionary, key).ok_or_else(|| error(format!("there is no '{key}'")));
        let descr = value("descr")?;
        let (kind, big_endian) = parse_descr(descr).ok_or_else(|| {
            let name = descr.split(", '").next().unwrap_or(descr);
            let problem =
                format!("arrays of type {} are not supported", quote(name.trim_matches('\'').as_bytes()));
            let remedy = "convert the array with NumPy's astype to float64, float32, int32 or int64";
            ParseError::new(Position::Part("header".into()), problem, remedy)
        })?;
        let fortran_order = value("fortran_order")?.starts_with("True");
        let shape = value("shape")?;
        let (rows, cols) = parse_shape(shape).ok_or_else(|| {
            error(format!("the shape {} is not of one or two dimensions", quote(shape.as_bytes())))
        })?;
        Ok(Self { kind, big_endian, fortran_order, rows, cols, body })
    }
}

/// The dictionary's text, and where the data begin.
fn split(bytes: &[u8]) -> Parsed<(&str, usize)> {
    if !bytes.starts_with(MAGIC) {
        return Err(ParseError::byte(0, "the file does not begin as a .npy file"));
    }
    let end = || ParseError::new(Position::Byte(bytes.len()), "the file ends within the header", TRUNCATED);
    let length_at = MAGIC.len() + 2;
    let (length, start) = match bytes.get(MAGIC.len()).ok_or_else(end)? {
        1 => {
            let length = bytes.get(length_at..length_at + 2).ok_or_else(end)?;
            (usize::from(u16::from_le_bytes([length[0], length[1]])), length_at + 2)
        }
        2 | 3 => {
            let length = bytes.get(length_at..length_at + 4).ok_or_else(end)?;
            (u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize, length_at + 4)
        }
        other => {
            return Err(ParseError::byte(MAGIC.len(), format!("version {other} of the format is not known")));
        }
    };
    let text = bytes[start..].get(..length).ok_or_else(end)?;
    let text = std::str::from_utf8(text).map_err(|_| error("the dictionary is not text"))?;
    Ok((text, start + length))
}

/// What follows a quoted key and its colon.
fn value<'a>(dictionary: &'a str, key: &str) -> Option<&'a str> {
    ['\'', '"'].iter().find_map(|quote| {
        let (_, rest) = dictionary.split_once(&format!("{quote}{key}{quote}"))?;
        Some(rest.trim_start().strip_prefix(':')?.trim_start())
    })
}

fn parse_descr(value: &str) -> Option<(Kind, bool)> {
    let quote = value.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    let descr = value[1..].split(quote).next()?;
    let (order, kind) = descr.split_at_checked(1)?;
    let big_endian = match order {
        "<" | "|" => false,
        ">" => true,
        "=" => cfg!(target_endian = "big"),
        _ => return None,
    };
    let kind = match kind {
        "f4" => Kind::F4,
        "f8" => Kind::F8,
        "i4" => Kind::I4,
        "i8" => Kind::I8,
        _ => return None,
    };
    Some((kind, big_endian))
}

fn parse_shape(value: &str) -> Option<(usize, usize)> {
    let (shape, _) = value.strip_prefix('(')?.split_once(')')?;
    let mut sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty()).map(str::parse::<usize>);
    let rows = sizes.next()?.ok()?;
    let cols = sizes.next().unwrap_or(Ok(1)).ok()?;
    (sizes.next().is_none()).then_some((rows, cols))
}

fn error(problem: impl Into<String>) -> ParseError {
    ParseError::part("header", problem)
}

/// The header of version 1.0, padded so that the data begin at a multiple of 64 bytes.
pub(super) fn encode(descr: &str, shape: &str) -> Vec<u8> {
    let dictionary = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    let fixed = MAGIC.len() + 4;
    let length = (fixed + dictionary.len() + 1).next_multiple_of(64) - fixed;
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(dictionary.as_bytes());
    bytes.resize(fixed + length - 1, b' ');
    bytes.push(b'\n');
    bytes
}
