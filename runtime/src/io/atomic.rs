//! Files that are there in full or not at all.

use std::fs::{self, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::IoError;
use tempfile::NamedTempFile;

/// Temporary files of writes under way, so that an interrupted program can remove them.
static UNDER_WAY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the temporary files of all writes under way: for a program that is about to end by an interrupt.
pub fn remove_temporary_files() {
    for path in lock().iter() {
        let _ = fs::remove_file(path);
    }
}

fn lock() -> MutexGuard<'static, Vec<PathBuf>> {
    UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes a file under a temporary name in the same folder and renames it when it is complete, so that no
/// reader ever sees half a file and an old one survives a failure.
///
/// A link is followed; what is neither a file nor absent (a device, a pipe) is written in place.
///
/// # Errors
/// If the folder is absent, the path is a folder, or `write` or the system fails.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), IoError> {
    let target = resolve(path);
    let written = match fs::metadata(&target) {
        Ok(metadata) if !metadata.is_file() && !metadata.is_dir() => write_in_place(&target, write),
        Ok(metadata) if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        _ => write_and_rename(&target, write),
    };
    written.map_err(|source| IoError::Write { path: path.into(), source })
}

/// The file that a link points to, or the path itself.
fn resolve(path: &Path) -> PathBuf {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_symlink() => fs::canonicalize(path).unwrap_or_else(|_| path.into()),
        _ => path.into(),
    }
}

fn write_in_place(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut file = BufWriter::new(fs::OpenOptions::new().write(true).open(path)?);
    write(&mut file)?;
    file.flush()
}

fn write_and_rename(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".fmnet-").suffix(".tmp");
    if let Some(permissions) = permissions(path) {
        builder.permissions(permissions);
    }
    let file = builder.tempfile_in(folder)?;
    let temporary = file.path().to_path_buf();
    lock().push(temporary.clone());
    let written = write_and_persist(file, path, write);
    lock().retain(|p| *p != temporary);
    written
}

fn write_and_persist(
    file: NamedTempFile,
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut file = BufWriter::with_capacity(1 << 17, file);
    write(&mut file)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.persist(path)?;
    Ok(())
}

/// Those of the file to be replaced, or what a new file gets (a temporary one is private by default).
#[cfg(unix)]
fn permissions(path: &Path) -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Some(fs::metadata(path).map_or(Permissions::from_mode(0o666), |m| m.permissions()))
}

#[cfg(not(unix))]
fn permissions(_path: &Path) -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.txt");
        write_atomically(&path, |w| w.write_all(b"old")).unwrap();
        let failed = write_atomically(&path, |w| {
            w.write_all(b"new")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(failed.unwrap_err().to_string().contains("map.txt"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_write_under_way_can_be_cleaned_up() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.txt");
        let interrupted = write_atomically(&path, |w| {
            w.write_all(b"half")?;
            let names: Vec<_> = fs::read_dir(folder.path())?.map(|entry| entry.unwrap().path()).collect();
            assert!(!names.is_empty() && names.iter().all(|name| lock().contains(name)));
            // As remove_temporary_files does for all, which would disturb other tests.
            names.iter().try_for_each(fs::remove_file)
        });
        assert!(interrupted.is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        assert!(!lock().iter().any(|name| name.starts_with(folder.path())));
    }

    #[test]
    fn an_absent_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent/map.txt");
        assert!(write_atomically(&path, |_| Ok(())).unwrap_err().to_string().contains("absent/map.txt"));
        assert!(write_atomically(folder.path(), |_| Ok(())).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_a_device_stays_one() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomically(&link, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        write_atomically(Path::new("/dev/null"), |w| w.write_all(b"gone")).unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }
}
