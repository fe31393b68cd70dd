//! Text files as bytes: lines, words and numbers, without a `String` per line.

use std::borrow::Cow;

use super::error::{ParseError, Parsed, REEXPORT};

/// A byte order mark that some editors put in front.
const BOM: &[u8] = b"\xEF\xBB\xBF";

/// A text file's bytes as UTF-8 without a byte order mark.
///
/// UTF-16 of either byte order is known by its mark, or without one by the zeros beside the first two characters.
/// Bytes in any other encoding stay as they are.
pub fn decode_text(bytes: &[u8]) -> Cow<'_, [u8]> {
    match bytes {
        [0xFF, 0xFE, rest @ ..] => decode_utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => decode_utf16(rest, u16::from_be_bytes),
        [a, 0, b, 0, ..] if *a > 0 && *b > 0 => decode_utf16(bytes, u16::from_le_bytes),
        [0, a, 0, b, ..] if *a > 0 && *b > 0 => decode_utf16(bytes, u16::from_be_bytes),
        _ => bytes.strip_prefix(BOM).unwrap_or(bytes).into(),
    }
}

fn decode_utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Cow<'_, [u8]> {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    text.into_bytes().into()
}

/// What stands before a comment.
///
/// A `#` begins one wherever it stands, but not within `1.#INF`, `-1.#IND` and the like: so old run-times of
/// Microsoft print numbers that are not finite.
pub(super) fn without_comment(line: &[u8]) -> &[u8] {
    let mut from = 0;
    while let Some(at) = line[from..].iter().position(|&b| b == b'#').map(|at| at + from) {
        let in_number =
            line[..at].ends_with(b"1.") && line.get(at + 1).is_some_and(|b| b.is_ascii_alphabetic());
        if !in_number {
            return &line[..at];
        }
        from = at + 1;
    }
    line
}

/// The lines of a text file, numbered from 1, ended by `\n`, `\r\n` or (in files without any `\n`) `\r`.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    end: u8,
    number: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(BOM).unwrap_or(bytes);
        let end = if rest.contains(&b'\n') || !rest.contains(&b'\r') { b'\n' } else { b'\r' };
        Self { rest, end, number: 0 }
    }

    /// The number of the line last returned.
    pub(super) fn number(&self) -> usize {
        self.number
    }

    /// How many bytes are left.
    pub(super) fn remaining(&self) -> usize {
        self.rest.len()
    }

    /// The next line with anything on it before a `#`, as its words.
    pub(super) fn next_data(&mut self) -> Option<Words<'a>> {
        loop {
            let line = self.next()?;
            let data = without_comment(line);
            if !data.trim_ascii().is_empty() {
                return Some(Words::new(data, self.number));
            }
        }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let length = self.rest.iter().position(|&b| b == self.end);
        let (line, rest) = match length {
            Some(length) => (&self.rest[..length], &self.rest[length + 1..]),
            None => (self.rest, &self.rest[..0]),
        };
        self.rest = rest;
        Some(line)
    }
}

/// Words separated by white space, and the line they are on; newlines among them are counted.
#[derive(Clone)]
pub(super) struct Words<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(bytes: &'a [u8], line: usize) -> Self {
        Self { rest: bytes, line }
    }

    /// The line of the word last returned, 1-based.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// What is left, unsplit.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// The next word, which must be a number, and what is wrong where it is not finite.
    fn number(&mut self, what: &str) -> Parsed<(f64, Option<ParseError>)> {
        let word = self.expect(what)?;
        match float(word) {
            Some(value) if value.is_finite() => Ok((value, None)),
            Some(value) => Ok((value, Some(self.error(format!("{what} is not finite: {}", quote(word)))))),
            None => Err(self.error(format!("{what} is not a number: {}", quote(word)))),
        }
    }

    /// The next word, which must be a finite number.
    pub(super) fn finite(&mut self, what: &str) -> Parsed<f64> {
        match self.number(what)? {
            (value, None) => Ok(value),
            (_, Some(problem)) => Err(problem),
        }
    }

    /// The next three words, which must be finite numbers.
    pub(super) fn point(&mut self, what: &str) -> Parsed<[f64; 3]> {
        Ok([self.finite(what)?, self.finite(what)?, self.finite(what)?])
    }

    /// The next three words, which must be numbers, and what is wrong with the first that is not finite.
    pub(super) fn place(&mut self, what: &str) -> Parsed<([f64; 3], Option<ParseError>)> {
        let numbers = [self.number(what)?, self.number(what)?, self.number(what)?];
        let place = [numbers[0].0, numbers[1].0, numbers[2].0];
        Ok((place, numbers.into_iter().find_map(|(_, problem)| problem)))
    }

    /// The next word, which must be an integer.
    pub(super) fn integer(&mut self, what: &str) -> Parsed<i64> {
        let word = self.expect(what)?;
        integer(word).ok_or_else(|| self.error(format!("{what} is not an integer: {}", quote(word))))
    }

    /// The next word, which must be a count.
    pub(super) fn size(&mut self, what: &str) -> Parsed<usize> {
        let value = self.integer(what)?;
        usize::try_from(value).map_err(|_| self.error(format!("{what} is {value}, which is negative")))
    }

    /// The next word, which must be the 0-based index of one of `n` things.
    pub(super) fn index(&mut self, what: &str, n: usize) -> Parsed<u32> {
        let value = self.integer(what)?;
        if value < 0 || value as u64 >= n as u64 {
            return Err(self.error(format!("{what} {value} is out of range: there are {n}, counted from 0")));
        }
        u32::try_from(value).map_err(|_| self.error(format!("{what} {value} does not fit 32 bits")))
    }

    pub(super) fn expect(&mut self, what: &str) -> Parsed<&'a [u8]> {
        self.next()
            .ok_or_else(|| ParseError::line(self.line, format!("{what} is missing at the end of the line")))
    }

    pub(super) fn error(&self, problem: impl Into<String>) -> ParseError {
        ParseError::new(super::Position::Line(self.line), problem, REEXPORT)
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.rest.iter().position(|b| {
            self.line += usize::from(*b == b'\n');
            !b.is_ascii_whitespace()
        });
        let word = &self.rest[start.unwrap_or(self.rest.len())..];
        let length = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.rest = &word[length..];
        (length > 0).then(|| &word[..length])
    }
}

/// A decimal number, in whatever way a run-time prints it: also `nan`, `-nan(ind)`, `inf`, `1.#INF00`, and `1.0D+02`
/// of Fortran.
pub(super) fn float(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| unusual_float(text))
}

#[cold]
fn unusual_float(text: &str) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    let (sign, digits) = match lower.strip_prefix(['-', '+']) {
        Some(digits) => (if lower.starts_with('-') { -1.0 } else { 1.0 }, digits),
        None => (1.0, lower.as_str()),
    };
    if let Some(kind) = digits.strip_prefix("1.#").filter(|kind| kind.starts_with(char::is_alphabetic)) {
        // `1.#J` is `1.#INF` rounded to two places, as the run-time does it.
        return Some(sign * if kind.starts_with("inf") || kind == "j" { f64::INFINITY } else { f64::NAN });
    }
    if let Some(kind) = digits.strip_prefix("nan") {
        return (kind.starts_with('(') && kind.ends_with(')')).then_some(f64::NAN);
    }
    let (mantissa, exponent) = digits.split_once('d')?;
    let plain = |part: &str| part.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if !plain(mantissa) || !plain(exponent) {
        return None;
    }
    Some(sign * format!("{mantissa}e{exponent}").parse::<f64>().ok()?)
}

/// A decimal integer, also one written as `3.0` or `3.0e0`, as NumPy's `savetxt` does.
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    let digits = word.strip_prefix(b"-").unwrap_or(word);
    if !digits.is_empty() && digits.len() < 18 && digits.iter().all(u8::is_ascii_digit) {
        let value = digits.iter().fold(0i64, |value, b| value * 10 + i64::from(b - b'0'));
        return Some(if digits.len() < word.len() { -value } else { value });
    }
    let value = float(word)?;
    (value.fract() == 0.0 && value.abs() < 9.0e15).then_some(value as i64)
}

/// A word for an error message: shortened, without control characters.
pub(super) fn quote(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(&word[..word.len().min(40)]);
    let text = text.replace(char::is_control, "\u{fffd}");
    format!("'{text}{}'", if word.len() > 40 { "..." } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_every_system_are_numbered() {
        for text in ["a\n\nb\n", "a\r\n\r\nb", "a\r\rb\r"] {
            let mut lines = Lines::new(text.as_bytes());
            assert_eq!(lines.next_data().unwrap().next(), Some(&b"a"[..]));
            assert_eq!(lines.next_data().unwrap().next(), Some(&b"b"[..]));
            assert_eq!(lines.number(), 3);
            assert!(lines.next_data().is_none());
        }
    }

    #[test]
    fn every_encoding_of_unicode_gives_the_same_text() {
        let text = "OFF # gr\u{f6}\u{df}e \u{1d11e}\n";
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [BOM, text.as_bytes()].concat(),
            [&[0xFF, 0xFE], &little[..]].concat(),
            [&[0xFE, 0xFF], &big[..]].concat(),
            little,
            big,
        ] {
            assert_eq!(decode_text(&bytes), text.as_bytes());
        }
        assert_eq!(*decode_text(b"\xFF\xFEa\0\x00\xD8b\0c"), *"a\u{fffd}b".as_bytes());
        assert_eq!(*decode_text(b"k\xf6rper"), *b"k\xf6rper");
        assert_eq!(*decode_text(b""), *b"");
    }

    #[test]
    fn numbers_of_old_run_times_are_no_comments() {
        for (line, expected) in [
            (&b"0 1.#INF00 2 # note"[..], &b"0 1.#INF00 2 "[..]),
            (b"-1.#IND 1.#QNAN0", b"-1.#IND 1.#QNAN0"),
            (b"1.# note", b"1."),
            (b"3#corner", b"3"),
            (b"#", b""),
        ] {
            assert_eq!(without_comment(line), expected);
        }
    }

    #[test]
    fn numbers_as_other_run_times_print_them() {
        for word in ["1.#INF", "1.#INF00", "+1.#inf", "1.#J"] {
            assert_eq!(float(word.as_bytes()), Some(f64::INFINITY), "{word}");
        }
        assert_eq!(float(b"-1.#INF"), Some(f64::NEG_INFINITY));
        for word in ["-1.#IND", "1.#QNAN0", "1.#SNAN", "nan(ind)", "-nan(snan)", "-nan", "NaN"] {
            assert!(float(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        assert_eq!(float(b"1.5D+02"), Some(150.0));
        assert_eq!(float(b"-1d-1"), Some(-0.1));
        for word in ["d", "1d", "d1", "1.#", "2.#INF", "nanny", "infd1", "0x1p3", "1,5"] {
            assert_eq!(float(word.as_bytes()), None, "{word}");
        }
    }

    #[test]
    fn words_count_the_lines_they_cross() {
        let mut words = Words::new(b" a b\n\n  c \n", 5);
        assert_eq!(words.by_ref().take(2).count(), 2);
        assert_eq!(words.line(), 5);
        assert_eq!((words.next(), words.line()), (Some(&b"c"[..]), 7));
        assert_eq!(words.next(), None);
    }

    #[test]
    fn numbers() {
        assert_eq!(integer(b"-12"), Some(-12));
        assert_eq!(integer(b"+12"), Some(12));
        assert_eq!(integer(b"1.2e1"), Some(12));
        assert_eq!(integer(b"1.5"), None);
        assert_eq!(integer(b"-"), None);
        assert_eq!(integer(b"99999999999999999999"), None);
        assert_eq!(float(b"1e-3"), Some(1e-3));
        assert!(Words::new(b"nan", 1).finite("x").is_err());
        assert!(Words::new(b"7", 1).index("vertex", 7).is_err());
        assert_eq!(quote(b"\x1b[31m"), "'\u{fffd}[31m'");
    }
}
