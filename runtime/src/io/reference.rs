//! References to other files, as mesh files of every system hold them.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Longer names are no names of files.
const MAX_NAME: usize = 4096;

/// A file's name from bytes: as they are where the system allows, else with replacement characters.
pub fn path_from_bytes(bytes: &[u8]) -> PathBuf {
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        std::ffi::OsStr::from_bytes(bytes).into()
    }
    #[cfg(not(unix))]
    {
        String::from_utf8_lossy(bytes).into_owned().into()
    }
}

/// A file's name as bytes: those of the system where it allows, else UTF-8.
pub(super) fn bytes_of_path(path: &Path) -> Cow<'_, [u8]> {
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        path.as_os_str().as_bytes().into()
    }
    #[cfg(not(unix))]
    {
        path.to_string_lossy().into_owned().into_bytes().into()
    }
}

/// The file that a name refers to, seen from `folder`.
///
/// Names come from other systems and other folders. Tried are, in this order: the name as it is; with `/` for `\`;
/// its last parts only, as many as lead to a file in `folder`; each of these in whatever case; all of these with the
/// bytes taken as Latin-1.
pub(super) fn find_file(folder: &Path, name: &[u8]) -> Option<PathBuf> {
    let name = unquoted(name);
    if name.is_empty() || name.len() > MAX_NAME || name.contains(&0) {
        return None;
    }
    let exact = folder.join(path_from_bytes(name));
    if exact.is_file() {
        return Some(exact);
    }
    let latin1 = std::str::from_utf8(name).is_err().then(|| name.iter().map(|&b| char::from(b)).collect());
    let spellings = [Some(name.to_vec()), latin1.map(String::into_bytes)];
    spellings.into_iter().flatten().find_map(|name| find_parts(folder, &name))
}

/// The file that the name leads to, or the longest of its ends that lead to one.
fn find_parts(folder: &Path, name: &[u8]) -> Option<PathBuf> {
    let is_separator = |b: &u8| matches!(b, b'/' | b'\\');
    let parts: Vec<&[u8]> = name.split(is_separator).filter(|part| !part.is_empty()).collect();
    let plain = path_from_bytes(&parts.join(&b'/'));
    if name.first().is_some_and(is_separator) {
        let absolute = Path::new("/").join(&plain);
        if absolute.is_file() {
            return Some(absolute);
        }
    }
    (0..parts.len()).find_map(|from| {
        let end = &parts[from..];
        let as_it_is = folder.join(path_from_bytes(&end.join(&b'/')));
        if as_it_is.is_file() { Some(as_it_is) } else { in_any_case(folder, end) }
    })
}

/// The file below `folder` whose parts are called so, upper and lower case not told apart; of several the first by
/// name.
fn in_any_case(folder: &Path, parts: &[&[u8]]) -> Option<PathBuf> {
    let (last, folders) = parts.split_last()?;
    let mut at = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.to_path_buf() };
    for part in folders {
        at = if matches!(*part, b"." | b"..") {
            at.join(path_from_bytes(part))
        } else {
            child(&at, part, Path::is_dir)?
        };
    }
    let found = child(&at, last, Path::is_file)?;
    if folder.as_os_str().is_empty() {
        found.strip_prefix(".").ok().map(Path::to_path_buf)
    } else {
        Some(found)
    }
}

fn child(folder: &Path, name: &[u8], fits: fn(&Path) -> bool) -> Option<PathBuf> {
    let wanted = String::from_utf8_lossy(name).to_lowercase();
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let same = entries.filter(|e| e.file_name().to_string_lossy().to_lowercase() == wanted);
    same.map(|entry| entry.path()).filter(|path| fits(path)).min()
}

/// Without white space and quotes around.
pub(super) fn unquoted(name: &[u8]) -> &[u8] {
    let name = name.trim_ascii();
    match name {
        [first @ (b'"' | b'\''), inner @ .., last] if first == last => inner.trim_ascii(),
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_systems_lead_to_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("Maps")).unwrap();
        for name in ["skin.png", "Maps/my skin.png", "gr\u{f6}\u{df}e.png"] {
            std::fs::write(path(name), "").unwrap();
        }
        let found = |name: &[u8]| find_file(folder.path(), name);
        for name in [
            "skin.png",
            " \"skin.png\" ",
            "SKIN.PNG",
            "C:\\scans\\skin.png",
            "/home/a/Skin.png",
            ".\\skin.png",
        ] {
            assert_eq!(found(name.as_bytes()), Some(path("skin.png")), "{name}");
        }
        for name in ["Maps\\my skin.png", "maps/My Skin.png", "D:\\scan\\MAPS\\my skin.png"] {
            assert_eq!(found(name.as_bytes()), Some(path("Maps/my skin.png")), "{name}");
        }
        assert_eq!(found(b"gr\xf6\xdfe.png"), Some(path("gr\u{f6}\u{df}e.png")));
        for name in [&b"none.png"[..], b"", b"\"\"", b"\0", b"Maps", b"/", b".."] {
            assert_eq!(found(name), None);
        }
    }
}
