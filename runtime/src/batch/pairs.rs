//! The list of pairs that `batch` matches, and the names of their maps.

use crate::io::{IoError, Position, decode_text, path_from_bytes};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::path::{Component, Path, PathBuf};
use thiserror::Error;

/// Two meshes, and where their map goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair {
    /// The source mesh.
    pub source: PathBuf,
    /// The target mesh.
    pub target: PathBuf,
    /// The file of the map.
    pub out: PathBuf,
}

/// Why a list of pairs cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PairsError {
    /// The list cannot be read, or a line is no pair.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The folder of the meshes is none.
    #[error("{}: there is no such folder; name the one that the meshes of the list are in", root.display())]
    NoFolder {
        /// The folder.
        root: PathBuf,
    },
    /// Two pairs would write the same file.
    #[error(
        "{} -> {} and {} -> {} would both be written to {}; give the files different names",
        first.source.display(), first.target.display(), second.source.display(), second.target.display(), first.out.display()
    )]
    SameOut {
        /// The one pair.
        first: Box<Pair>,
        /// The other.
        second: Box<Pair>,
    },
}

/// Two names of a line.
type Names<'a> = [&'a [u8]; 2];

/// Reads a list of pairs, one a line; their maps are `SOURCE__TARGET.EXTENSION` in the folder `out`. Mesh files are
/// relative to `root`, by default the folder of the list.
///
/// # Errors
/// If the list cannot be read, a line is no pair, `root` is no folder, or two pairs would write the same file.
pub fn read_pairs(
    list: &Path,
    root: Option<&Path>,
    out: &Path,
    extension: &str,
) -> Result<Vec<Pair>, PairsError> {
    let bytes = std::fs::read(list).map_err(|source| IoError::Read { path: list.into(), source })?;
    decode_pairs(&bytes, list, root, out, extension)
}

/// [`read_pairs`] of bytes at hand; `list` is their name in errors, and its folder that of the meshes where `root` is
/// none.
///
/// # Errors
/// As [`read_pairs`].
pub fn decode_pairs(
    bytes: &[u8],
    list: &Path,
    root: Option<&Path>,
    out: &Path,
    extension: &str,
) -> Result<Vec<Pair>, PairsError> {
    let root = root.unwrap_or(list.parent().unwrap_or(Path::new("")));
    if !root.as_os_str().is_empty() && !root.is_dir() {
        return Err(PairsError::NoFolder { root: root.into() });
    }
    let mut named = Vec::new();
    for (number, line) in decode_text(bytes).split(|&b| b == b'\n' || b == b'\r').enumerate() {
        let line = line.trim_ascii();
        match names(line, |name| file_of(root, name).is_file()) {
            Some(names) => named.push(names.map(|name| file_of(Path::new(""), name))),
            None if line.is_empty() || line.starts_with(b"#") => {}
            None => {
                let malformed = IoError::Malformed {
                    path: list.into(),
                    at: Position::Line(number + 1),
                    problem: format!("expected two mesh files, found {:?}", String::from_utf8_lossy(line)),
                    remedy: "put names that contain spaces in quotes, or a tab between them".into(),
                };
                return Err(malformed.into());
            }
        }
    }
    let outs = out_names(&named, extension);
    let folder = out;
    let pair = |([source, target], out): ([PathBuf; 2], OsString)| Pair {
        source: root.join(source),
        target: root.join(target),
        out: folder.join(out),
    };
    let pairs: Vec<Pair> = named.into_iter().zip(outs).map(pair).collect();
    check_names(&pairs)?;
    Ok(pairs)
}

/// The file of a name, which may be written as another system does.
fn file_of(root: &Path, name: &[u8]) -> PathBuf {
    let path = root.join(path_from_bytes(name));
    if path.is_file() || !name.contains(&b'\\') {
        return path;
    }
    let slashes: Vec<u8> = name.iter().map(|&b| if b == b'\\' { b'/' } else { b }).collect();
    root.join(path_from_bytes(&slashes))
}

/// The two names of a line: of all ways to read it the one by which most files exist, of several the first.
fn names<'a>(line: &'a [u8], exists: impl Fn(&[u8]) -> bool) -> Option<Names<'a>> {
    let begins = |i: &usize| line[*i] == b'#' && *i > 0 && line[*i - 1].is_ascii_whitespace();
    // A name may have a # of its own: the line as it is, then without what may be a comment, the shortest comment
    // first.
    let ends = std::iter::once(line.len()).chain((0..line.len()).rev().filter(begins).take(16));
    let readings = ends.flat_map(|end| readings(line[..end].trim_ascii()));
    let scored = readings.map(|names| (names.iter().filter(|name| exists(name)).count(), names));
    let best = scored.reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    let is_comment = line.starts_with(b"#") && best.0 < 2;
    (!is_comment).then_some(best.1)
}

/// Every way to take two names from a text: split at a tab, a comma, a semicolon, white space; or at any white space
/// where there is more.
fn readings(text: &[u8]) -> Vec<Names<'_>> {
    let separators: [fn(u8) -> bool; 4] =
        [|b| b == b'\t', |b| b.is_ascii_whitespace(), |b| b == b',', |b| b == b';'];
    let mut found: Vec<Names> = Vec::new();
    for separator in separators {
        if let [source, target] = split(text, separator)[..] {
            found.push([source, target]);
        }
    }
    // As many places as a line of a few words has.
    let spaces = (0..text.len()).filter(|&i| text[i].is_ascii_whitespace()).take(64);
    found.extend(spaces.map(|at| [unquoted(&text[..at]), unquoted(&text[at..])]));
    found.retain(|names| names.iter().all(|name| !name.is_empty()));
    found
}

/// The parts between separators that are not within quotes; without the quotes and empty ones.
fn split(text: &[u8], separator: fn(u8) -> bool) -> Vec<&[u8]> {
    let mut in_quotes = false;
    let parts = text.split(|&b| {
        in_quotes ^= b == b'"';
        !in_quotes && separator(b)
    });
    parts.map(unquoted).filter(|part| !part.is_empty()).collect()
}

fn unquoted(name: &[u8]) -> &[u8] {
    match name.trim_ascii() {
        [b'"', inner @ .., b'"'] => inner,
        name => name,
    }
}

/// `SOURCE__TARGET.EXT` of the names without folders and extensions; with them where several pairs would be called so.
fn out_names(pairs: &[[PathBuf; 2]], extension: &str) -> Vec<OsString> {
    let name = |pair: &[PathBuf; 2], part: fn(&Path) -> OsString| {
        let mut name = part(&pair[0]);
        name.push("__");
        name.push(part(&pair[1]));
        name.push(".");
        name.push(extension);
        name
    };
    let mut users: BTreeMap<OsString, Vec<&[PathBuf; 2]>> = BTreeMap::new();
    for pair in pairs {
        let users = users.entry(name(pair, stem)).or_default();
        if !users.contains(&pair) {
            users.push(pair);
        }
    }
    let is_shared = |short: &OsString| users.get(short).is_some_and(|users| users.len() > 1);
    let chosen = |pair: &[PathBuf; 2]| {
        let short = name(pair, stem);
        if is_shared(&short) { name(pair, whole) } else { short }
    };
    pairs.iter().map(chosen).collect()
}

fn stem(path: &Path) -> OsString {
    path.file_stem().unwrap_or_default().to_os_string()
}

/// Folders and file, joined by `_`.
fn whole(path: &Path) -> OsString {
    let parts = path.components().filter_map(|part| match part {
        Component::Normal(name) => Some(name),
        Component::ParentDir => Some(OsStr::new("..")),
        _ => None,
    });
    parts.collect::<Vec<_>>().join(OsStr::new("_"))
}

/// Two pairs must not write the same file.
fn check_names(pairs: &[Pair]) -> Result<(), PairsError> {
    let mut seen: BTreeMap<&Path, &Pair> = BTreeMap::new();
    for pair in pairs {
        if let Some(other) = seen.insert(&pair.out, pair)
            && (&other.source, &other.target) != (&pair.source, &pair.target)
        {
            return Err(PairsError::SameOut {
                first: Box::new(other.clone()),
                second: Box::new(pair.clone()),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read<'a>(line: &'a str, files: &[&str]) -> Option<[&'a str; 2]> {
        let exists = |name: &[u8]| files.iter().any(|file| file.as_bytes() == name);
        names(line.as_bytes(), exists).map(|names| names.map(|name| std::str::from_utf8(name).unwrap()))
    }

    #[test]
    fn lines_of_every_kind() {
        let files = ["a.off", "b.off", "my scan.off", "scan #1.off", "#2.off"];
        for (line, expected) in [
            ("a.off b.off", ["a.off", "b.off"]),
            ("a.off\tb.off # both good", ["a.off", "b.off"]),
            ("a.off b.off # both good", ["a.off", "b.off"]),
            ("a.off,b.off", ["a.off", "b.off"]),
            ("a.off; b.off", ["a.off", "b.off"]),
            ("my scan.off\tb.off", ["my scan.off", "b.off"]),
            ("my scan.off b.off", ["my scan.off", "b.off"]),
            ("\"my scan.off\" b.off", ["my scan.off", "b.off"]),
            ("a.off \"scan #1.off\"", ["a.off", "scan #1.off"]),
            ("scan #1.off\tb.off", ["scan #1.off", "b.off"]),
            ("a.off\tscan #1.off", ["a.off", "scan #1.off"]),
            ("a.off scan #1.off # the first", ["a.off", "scan #1.off"]),
            ("#2.off a.off", ["#2.off", "a.off"]),
            ("none.off b.off", ["none.off", "b.off"]),
        ] {
            assert_eq!(read(line, &files), Some(expected), "{line}");
        }
        for line in ["", "# a.off b.off", "#", "a.off", "#a comment"] {
            assert_eq!(read(line, &files), None, "{line}");
        }
    }

    #[test]
    fn names_of_maps_tell_shapes_of_one_name_apart() {
        let pairs =
            [["s1/body.off", "b.off"], ["s2/body.off", "b.off"], ["a.off", "b.off"], ["a.off", "b.off"]];
        let pairs = pairs.map(|pair| pair.map(PathBuf::from));
        let names = out_names(&pairs, "txt");
        assert_eq!(names, ["s1_body.off__b.off.txt", "s2_body.off__b.off.txt", "a__b.txt", "a__b.txt"]);
    }
}
