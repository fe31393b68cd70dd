//! The values after the header, one at a time, from text or bytes.

use super::header::{Kind, Number, Property};
use crate::io::error::{ParseError, Parsed, Position, REEXPORT, TRUNCATED};
use crate::io::text::{Words, float, quote};

/// A stream of numbers. Every type fits `f64` exactly.
pub(super) trait Source {
    /// The next number.
    fn number(&mut self, kind: Number) -> Parsed<f64>;

    /// Where the next number is, or in text the last one was.
    fn position(&self) -> Position;

    /// How many bytes are left.
    fn remaining(&self) -> usize;

    /// The fewest bytes that a property can take; in text the last one may take one less.
    fn min_bytes(property: &Property) -> usize;

    /// Passes over `n` numbers.
    fn skip(&mut self, n: usize, kind: Number) -> Parsed<()> {
        (0..n).try_for_each(|_| self.number(kind).map(|_| ()))
    }

    fn error(&self, problem: String) -> ParseError {
        ParseError::new(self.position(), problem, REEXPORT)
    }

    fn end(&self) -> ParseError {
        ParseError::new(self.position(), "the file ends here", TRUNCATED)
    }

    /// The next number, which must be a list's length.
    fn length(&mut self, kind: Number) -> Parsed<usize> {
        let length = self.number(kind)?;
        if length < 0.0 || length.fract() != 0.0 || length > f64::from(u32::MAX) {
            return Err(self.error(format!("{length} is not the length of a list")));
        }
        Ok(length as usize)
    }

    /// The next list, in `items`.
    fn list(&mut self, length: Number, item: Number, items: &mut Vec<f64>) -> Parsed<()> {
        items.clear();
        for _ in 0..self.length(length)? {
            items.push(self.number(item)?);
        }
        Ok(())
    }

    /// Passes over a property.
    fn skip_property(&mut self, property: &Property) -> Parsed<()> {
        match property.kind {
            Kind::Scalar(kind) => self.skip(1, kind),
            Kind::List { length, item } => {
                let n = self.length(length)?;
                self.skip(n, item)
            }
        }
    }
}

/// Words of a text, wherever the lines break.
pub(super) struct Text<'a> {
    words: Words<'a>,
}

impl<'a> Text<'a> {
    pub(super) fn new(body: &'a [u8], n_header_lines: usize) -> Self {
        Self { words: Words::new(body, n_header_lines + 1) }
    }
}

impl Source for Text<'_> {
    fn number(&mut self, _kind: Number) -> Parsed<f64> {
        let word = self.words.next().ok_or_else(|| self.end())?;
        float(word).ok_or_else(|| self.error(format!("{} is not a number", quote(word))))
    }

    fn position(&self) -> Position {
        Position::Line(self.words.line())
    }

    fn remaining(&self) -> usize {
        self.words.rest().len()
    }

    fn min_bytes(_property: &Property) -> usize {
        2
    }
}

/// Bytes, of either order.
pub(super) struct Binary<'a, const BIG_ENDIAN: bool> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a, const BIG_ENDIAN: bool> Binary<'a, BIG_ENDIAN> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        let Some(&(mut value)) = self.bytes[self.at..].first_chunk::<N>() else { return Err(self.end()) };
        self.at += N;
        if BIG_ENDIAN {
            value.reverse();
        }
        Ok(value)
    }
}

impl<const BIG_ENDIAN: bool> Source for Binary<'_, BIG_ENDIAN> {
    #[inline]
    fn number(&mut self, kind: Number) -> Parsed<f64> {
        Ok(match kind {
            Number::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Number::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Number::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Number::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Number::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Number::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Number::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Number::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn position(&self) -> Position {
        Position::Byte(self.at)
    }

    fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn min_bytes(property: &Property) -> usize {
        match property.kind {
            Kind::Scalar(kind) => kind.size(),
            Kind::List { length, .. } => length.size(),
        }
    }

    fn skip(&mut self, n: usize, kind: Number) -> Parsed<()> {
        let n_bytes = n.saturating_mul(kind.size());
        if n_bytes > self.remaining() {
            return Err(self.end());
        }
        self.at += n_bytes;
        Ok(())
    }
}
