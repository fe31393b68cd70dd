//! Landmarks in text files: a source vertex and a target vertex a line.

use std::path::Path;

use super::IoError;
use super::error::Parsed;
use super::text::{Lines, Words, decode_text, quote};

/// Reads landmarks, `[landmarks]`: 0-based vertices of source and target. A line with one vertex means it on both;
/// `#` begins a comment. That is the format of pyFM and of `numpy.savetxt` with `fmt="%d"`.
///
/// # Errors
/// If the file cannot be read, or a line is no vertex or two.
pub fn read_landmarks(path: &Path) -> Result<Vec<(u32, u32)>, IoError> {
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    decode(&bytes).map_err(|e| e.in_file(path))
}

fn decode(bytes: &[u8]) -> Parsed<Vec<(u32, u32)>> {
    let bytes = &*decode_text(bytes);
    let mut lines = Lines::new(bytes);
    let mut landmarks = Vec::new();
    while let Some(mut words) = lines.next_data() {
        let source = vertex(&mut words, "the source vertex")?;
        let target = match words.rest().trim_ascii().is_empty() {
            true => source,
            false => vertex(&mut words, "the target vertex")?,
        };
        if let Some(word) = words.next() {
            return Err(
                words.error(format!("{} follows; a source and a target vertex are expected", quote(word)))
            );
        }
        landmarks.push((source, target));
    }
    Ok(landmarks)
}

fn vertex(words: &mut Words<'_>, what: &str) -> Parsed<u32> {
    let index = words.integer(what)?;
    u32::try_from(index).map_err(|_| words.error(format!("{what} is {index}, but must be 0 or more")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_or_two_vertices_a_line() {
        assert_eq!(decode(b"# nose\n3 7\n\n5\n 1e1 2\n").unwrap(), [(3, 7), (5, 5), (10, 2)]);
        for (text, part) in [("1 2 3", "follows"), ("-1 2", "0 or more"), ("a", "integer")] {
            let error = format!("{:?}", decode(text.as_bytes()).unwrap_err());
            assert!(error.contains(part), "{error}");
        }
    }
}
