//! The header: a magic word, a version, and a Python dictionary of element type, order and shape.

use crate::io::error::{ParseError, Parsed, TRUNCATED};
use crate::io::{Position, text::quote};

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// A type of the numbers in a `.npy` file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are NumPy's: kind and bytes")]
pub enum NpyKind {
    F4,
    F8,
    Bool,
    I1,
    U1,
    I2,
    U2,
    I4,
    U4,
    I8,
    U8,
}

impl NpyKind {
    const ALL: [(Self, &'static str); 11] = [
        (Self::F4, "f4"),
        (Self::F8, "f8"),
        (Self::Bool, "b1"),
        (Self::I1, "i1"),
        (Self::U1, "u1"),
        (Self::I2, "i2"),
        (Self::U2, "u2"),
        (Self::I4, "i4"),
        (Self::U4, "u4"),
        (Self::I8, "i8"),
        (Self::U8, "u8"),
    ];

    /// How many bytes a number takes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::Bool | Self::I1 | Self::U1 => 1,
            Self::I2 | Self::U2 => 2,
            Self::F4 | Self::I4 | Self::U4 => 4,
            Self::F8 | Self::I8 | Self::U8 => 8,
        }
    }

    /// Whether numbers of this type have values in between.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F4 | Self::F8)
    }

    /// What stands for no value where the type is of integers: -1, or without a sign 0.
    pub fn missing(self) -> i64 {
        if matches!(self, Self::I1 | Self::I2 | Self::I4 | Self::I8) { -1 } else { 0 }
    }

    /// NumPy's name of the type in the order of bytes that is written.
    pub(super) fn descr(self) -> String {
        let name = Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name);
        format!("{}{name}", if self.size() == 1 { '|' } else { '<' })
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) kind: NpyKind,
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
            let remedy = "convert the array with NumPy's astype to float64, float32 or a type of integers";
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

fn parse_descr(value: &str) -> Option<(NpyKind, bool)> {
    let quote = value.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    let descr = value[1..].split(quote).next()?;
    let (order, kind) = descr.split_at_checked(1)?;
    let big_endian = match order {
        "<" | "|" => false,
        ">" => true,
        "=" => cfg!(target_endian = "big"),
        _ => return None,
    };
    let (kind, _) = NpyKind::ALL.into_iter().find(|(_, name)| *name == kind)?;
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
