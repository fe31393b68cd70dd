//! References to buffers and images: inside the URI itself, or in a file beside.

use std::path::{Path, PathBuf};

use crate::io::reference::{find_file, path_from_bytes};

/// Where a URI points.
#[derive(Debug, PartialEq)]
pub(super) enum Target {
    /// The URI holds the bytes; with their media type, which may be empty.
    Data(Vec<u8>, String),
    /// A file.
    File(PathBuf),
}

/// Resolves a URI against the folder of the file it is in; an error says what is not supported.
pub(super) fn resolve(uri: &str, folder: &Path) -> Result<Target, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (head, body) = data.split_once(',').ok_or("a data URI has no comma")?;
        let mime = head.strip_suffix(";base64").ok_or("a data URI is not in base64")?;
        let bytes = decode_base64(body.as_bytes()).ok_or("a data URI is not valid base64")?;
        return Ok(Target::Data(bytes, mime.to_owned()));
    }
    if let Some((scheme, _)) = uri.split_once(':').filter(|(scheme, _)| scheme.len() > 1) {
        return Err(format!("URIs of the kind '{}:' are not supported", scheme.escape_debug()));
    }
    // Names may be encoded or not, and be of another system.
    let (decoded, plain) = (decode_percent(uri), uri.as_bytes());
    let found = find_file(folder, &decoded).or_else(|| find_file(folder, plain));
    Ok(Target::File(found.unwrap_or_else(|| folder.join(path_from_bytes(&decoded)))))
}

fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.trim_ascii();
    let text = text.strip_suffix(b"==").or(text.strip_suffix(b"=")).unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for &c in group {
            bits = bits << 6 | u32::from(decode_digit(c)?);
        }
        let n_bytes = match group.len() {
            1 => return None,
            n => n - 1,
        };
        bits <<= 6 * (4 - group.len());
        bytes.extend_from_slice(&bits.to_be_bytes()[1..=n_bytes]);
    }
    Some(bytes)
}

fn decode_digit(c: u8) -> Option<u8> {
    match c {
        b'A'..=b'Z' => Some(c - b'A'),
        b'a'..=b'z' => Some(c - b'a' + 26),
        b'0'..=b'9' => Some(c - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    }
}

/// Replaces `%20` and the like; what is no such code stays.
fn decode_percent(uri: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&c, tail)) = rest.split_first() {
        let code = tail
            .get(..2)
            .and_then(|d| std::str::from_utf8(d).ok())
            .and_then(|d| u8::from_str_radix(d, 16).ok());
        match code.filter(|_| c == b'%') {
            Some(code) => {
                bytes.push(code);
                rest = &tail[2..];
            }
            None => {
                bytes.push(c);
                rest = tail;
            }
        }
    }
    bytes
}

/// A file name as a URI.
pub(super) fn encode_percent(name: &[u8]) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-._~/".contains(&b);
    name.iter()
        .copied()
        .map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_files_and_what_is_neither() {
        let folder = Path::new("folder");
        assert_eq!(
            resolve("data:image/png;base64,AAEC", folder),
            Ok(Target::Data(vec![0, 1, 2], "image/png".into()))
        );
        assert_eq!(resolve("a%20b.bin", folder), Ok(Target::File("folder/a b.bin".into())));
        for uri in ["http://a/b.bin", "data:,plain", "data:;base64,A", "data:;base64,A*AA", "data:"] {
            assert!(resolve(uri, folder).is_err(), "{uri}");
        }
    }

    #[test]
    fn base64_of_every_length() {
        assert_eq!(decode_base64(b"").unwrap(), b"");
        assert_eq!(decode_base64(b"Zg==").unwrap(), b"f");
        assert_eq!(decode_base64(b"Zm8=").unwrap(), b"fo");
        assert_eq!(decode_base64(b"Zm9vYmFy").unwrap(), b"foobar");
    }

    #[test]
    fn percent_codes() {
        assert_eq!(decode_percent("%C3%BC%2"), "\u{fc}%2".as_bytes());
        for name in ["a b/\u{fc}%.png".as_bytes(), b"k\xf6rper.png"] {
            assert_eq!(decode_percent(&encode_percent(name)), name);
        }
    }
}
