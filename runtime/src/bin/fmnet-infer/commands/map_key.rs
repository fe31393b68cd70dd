//! What a map of `batch` was made from: a key in a file beside it, `MAP.key`.

use super::pairs::Pair;
use anyhow::Result;
use fmnet::cache::CacheKey;
use fmnet::io::{IoError, read_mesh, write_atomically};
use fmnet::pipeline::{MatchOptions, Matcher, ModelSource};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Keys of maps: hashes of both meshes, the model, every option and the version of the program.
pub(super) struct MapKeys {
    settings: CacheKey,
    /// The hash of each mesh, which is read once.
    meshes: BTreeMap<PathBuf, CacheKey>,
}

impl MapKeys {
    pub(super) fn new(matcher: &Matcher, options: &MatchOptions, partial: bool) -> Self {
        // The model counts by its content, and where results are cached does not count.
        let options = MatchOptions { model: ModelSource::Embedded, cache: None, ..options.clone() };
        let model = matcher.network().map_or(&[][..], |network| &network.fingerprint()[..]);
        let settings = CacheKey::of(&[
            env!("CARGO_PKG_VERSION").as_bytes(),
            format!("{options:?}").as_bytes(),
            model,
            &[u8::from(partial)],
        ]);
        Self { settings, meshes: BTreeMap::new() }
    }

    /// The key of a pair's map.
    pub(super) fn of(&mut self, pair: &Pair) -> Result<String> {
        let (source, target) = (self.mesh(&pair.source)?, self.mesh(&pair.target)?);
        let key = CacheKey::of(&[self.settings.as_bytes(), source.as_bytes(), target.as_bytes()]);
        Ok(key.as_bytes().iter().map(|b| format!("{b:02x}")).collect())
    }

    fn mesh(&mut self, path: &Path) -> Result<CacheKey> {
        if let Some(known) = self.meshes.get(path) {
            return Ok(*known);
        }
        let mesh = read_mesh(path)?.mesh;
        let key = CacheKey::of(&[bytemuck::cast_slice(mesh.vertices()), bytemuck::cast_slice(mesh.faces())]);
        self.meshes.insert(path.into(), key);
        Ok(key)
    }
}

/// What is known of a map that may be there.
pub(super) enum Made {
    /// There is no map.
    Not,
    /// There is one, from what this key says.
    From(String),
    /// There is one without a key.
    Unknown,
}

/// What the map at this path was made from.
pub(super) fn made_from(map: &Path) -> Made {
    if !map.is_file() {
        return Made::Not;
    }
    match std::fs::read_to_string(key_file(map)) {
        Ok(key) => Made::From(key.trim().to_owned()),
        Err(_) => Made::Unknown,
    }
}

/// Removes the key of a map that is about to be written.
pub(super) fn forget_key(map: &Path) -> Result<()> {
    let path = key_file(map);
    match std::fs::remove_file(&path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(IoError::Write { path, source }.into())
        }
        _ => Ok(()),
    }
}

/// Writes the key beside a map.
pub(super) fn write_key(map: &Path, key: &str) -> Result<()> {
    Ok(write_atomically(&key_file(map), |out| writeln!(out, "{key}"))?)
}

fn key_file(map: &Path) -> PathBuf {
    let mut name = map.as_os_str().to_os_string();
    name.push(".key");
    name.into()
}
