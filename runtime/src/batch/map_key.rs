//! What a map was made from: a key in a file beside it, `MAP.key`.

use super::pairs::Pair;
use crate::Mesh;
use crate::cache::CacheKey;
use crate::io::{IoError, read_mesh, write_atomically, write_point_map};
use crate::pipeline::{MatchOptions, Matcher, ModelSource};
use crate::point_map::PointMap;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Raised with every change by which the same meshes, model and options give another map within a version of the
/// library.
const REVISION: u8 = 5;

/// Keys of maps: hashes of both meshes, the model, every option and the version of the library.
#[derive(Clone, Debug)]
pub struct MapKeys {
    settings: CacheKey,
    /// The hash of each mesh, which is read once.
    meshes: BTreeMap<PathBuf, CacheKey>,
}

impl MapKeys {
    /// Keys of the maps of a matcher of these options; `partial` says that every source is a part of its target.
    pub fn new(matcher: &Matcher, options: &MatchOptions, partial: bool) -> Self {
        // The model counts by its content, and where results are cached does not count.
        let options = MatchOptions { model: ModelSource::Embedded, cache: None, ..options.clone() };
        let model = matcher.network().map_or(&[][..], |network| &network.fingerprint()[..]);
        let settings = CacheKey::of(&[
            env!("CARGO_PKG_VERSION").as_bytes(),
            &[REVISION],
            format!("{options:?}").as_bytes(),
            model,
            &[u8::from(partial)],
        ]);
        Self { settings, meshes: BTreeMap::new() }
    }

    /// The key of a pair's map, of which each mesh file is read once.
    ///
    /// # Errors
    /// If a mesh cannot be read.
    pub fn of(&mut self, pair: &Pair) -> Result<String, IoError> {
        let (source, target) = (self.mesh(&pair.source)?, self.mesh(&pair.target)?);
        Ok(self.of_meshes(source, target))
    }

    /// The key of the map of two meshes, given [`MapKeys::of_mesh`] of both.
    pub fn of_meshes(&self, source: CacheKey, target: CacheKey) -> String {
        let key = CacheKey::of(&[self.settings.as_bytes(), source.as_bytes(), target.as_bytes()]);
        key.to_hex()
    }

    /// The hash of a mesh.
    pub fn of_mesh(mesh: &Mesh) -> CacheKey {
        CacheKey::of(&[bytemuck::cast_slice(mesh.vertices()), bytemuck::cast_slice(mesh.faces())])
    }

    fn mesh(&mut self, path: &Path) -> Result<CacheKey, IoError> {
        if let Some(known) = self.meshes.get(path) {
            return Ok(*known);
        }
        let key = Self::of_mesh(&read_mesh(path)?.mesh);
        self.meshes.insert(path.into(), key);
        Ok(key)
    }
}

/// What is known of a map that may be there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Made {
    /// There is no map.
    Not,
    /// There is one, from what this key says.
    From(String),
    /// There is one without a key.
    Unknown,
}

/// What the map at this path was made from.
pub fn made_from(map: &Path) -> Made {
    if !map.is_file() {
        return Made::Not;
    }
    match std::fs::read_to_string(key_file(map)) {
        Ok(key) => Made::From(key.trim().to_owned()),
        Err(_) => Made::Unknown,
    }
}

/// Writes a map and its key beside it. Without its key a map is made anew, so it never stands beside the key of
/// another one.
///
/// # Errors
/// If a file cannot be written.
pub fn write_map(path: &Path, map: &PointMap, key: &str) -> Result<(), IoError> {
    forget(&key_file(path))?;
    write_point_map(path, map)?;
    write_atomically(&key_file(path), |out| writeln!(out, "{key}"))
}

fn forget(path: &Path) -> Result<(), IoError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(IoError::Write { path: path.into(), source })
        }
        _ => Ok(()),
    }
}

fn key_file(map: &Path) -> PathBuf {
    let mut name = map.as_os_str().to_os_string();
    name.push(".key");
    name.into()
}
