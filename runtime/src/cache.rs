//! A folder of computed results, keyed by what they were computed from.
//!
//! The key is a hash of the input's content and of every option that changes the result, so an entry is never
//! stale by its name. Each entry carries a format version and a checksum; an entry that does not match is reported as
//! [`Lookup::Damaged`] and computed again. Entries are written to a temporary name and renamed, so two processes may
//! share a folder: the last one to finish wins, with the same bytes.

use crate::events::{Event, Observer};
use crate::io::{IoError, write_atomically};
use bytemuck::Pod;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"FMNETC\0\0";
/// Raise whenever a stage's output or its encoding changes: older entries are then computed again.
const FORMAT_VERSION: u32 = 1;
const HEADER_LEN: usize = 8 + 4 + 8 + 32;

/// A 256-bit key of an entry: a hash of content and options.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CacheKey([u8; 32]);

impl CacheKey {
    /// The key of these parts; the same bytes split differently give another key.
    pub fn of(parts: &[&[u8]]) -> Self {
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        Self(*hasher.finalize().as_bytes())
    }

    /// The key of these bytes, as [`CacheKey::as_bytes`] gave them.
    pub(crate) fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// The key as bytes, to derive another key from.
    pub fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// The key as 64 hexadecimal digits.
    pub fn to_hex(self) -> String {
        self.0.iter().map(|b| format!("{b:02x}")).collect()
    }

    /// The key of 64 hexadecimal digits, as [`CacheKey::to_hex`] gave them.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.chars().map(|c| c.to_digit(16)).collect::<Option<Vec<u32>>>()?;
        let bytes: Vec<u8> =
            digits.chunks(2).map(|pair| pair.iter().fold(0, |byte, &d| byte * 16 + d as u8)).collect();
        (digits.len() == 64).then_some(())?;
        Some(Self(bytes.try_into().ok()?))
    }
}

/// What a look-up found.
#[derive(Debug)]
pub enum Lookup {
    /// The entry's payload.
    Hit(Vec<u8>),
    /// No such entry.
    Miss,
    /// An entry that is truncated, corrupt, of another version or unreadable, and why.
    Damaged(String),
}

/// A folder of entries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// Opens the folder, which is created if absent.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn open(folder: &Path) -> Result<Self, IoError> {
        std::fs::create_dir_all(folder).map_err(|source| IoError::Write { path: folder.into(), source })?;
        Ok(Self { folder: folder.to_path_buf() })
    }

    /// The file of an entry; `kind` says what it holds, for people who look at the folder.
    pub fn path(&self, kind: &str, key: CacheKey) -> PathBuf {
        self.folder.join(format!("{kind}-{}.fmc", &key.to_hex()[..32]))
    }

    /// Reads an entry.
    pub fn get(&self, kind: &str, key: CacheKey) -> Lookup {
        let path = self.path(kind, key);
        match std::fs::read(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Lookup::Miss,
            Err(e) => Lookup::Damaged(format!("{}: {e}", path.display())),
            Ok(bytes) => match checked_payload(bytes, key) {
                Ok(payload) => Lookup::Hit(payload),
                Err(reason) => Lookup::Damaged(format!("{}: {reason}", path.display())),
            },
        }
    }

    /// Reads an entry; a damaged one is reported and counts as absent, so that it is computed and written again.
    pub fn fetch(&self, kind: &str, key: CacheKey, observer: Observer) -> Option<Vec<u8>> {
        match self.get(kind, key) {
            Lookup::Hit(bytes) => Some(bytes),
            Lookup::Miss => None,
            Lookup::Damaged(reason) => {
                observer(Event::Warning(format!("damaged cache entry, computed again: {reason}")));
                None
            }
        }
    }

    /// Writes an entry.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn put(&self, kind: &str, key: CacheKey, payload: &[u8]) -> Result<(), IoError> {
        write_atomically(&self.path(kind, key), |out| {
            out.write_all(MAGIC)?;
            // In the payload's byte order, so that a machine of the other one takes the entry as damaged.
            out.write_all(&FORMAT_VERSION.to_ne_bytes())?;
            out.write_all(&(payload.len() as u64).to_ne_bytes())?;
            out.write_all(&checksum(key, payload))?;
            out.write_all(payload)
        })
    }
}

fn checksum(key: CacheKey, payload: &[u8]) -> [u8; 32] {
    *blake3::keyed_hash(&key.0, payload).as_bytes()
}

fn checked_payload(mut bytes: Vec<u8>, key: CacheKey) -> Result<Vec<u8>, String> {
    if bytes.len() < HEADER_LEN || &bytes[..8] != MAGIC {
        return Err("not a cache entry".into());
    }
    let mut fields = Decoder::new(&bytes[8..HEADER_LEN]);
    let version: u32 = fields.value().ok_or("truncated")?;
    if version != FORMAT_VERSION {
        return Err(format!("format version {version}, expected {FORMAT_VERSION}"));
    }
    let expected_len: u64 = fields.value().ok_or("truncated")?;
    if (bytes.len() - HEADER_LEN) as u64 != expected_len {
        return Err(format!("{} bytes, expected {expected_len}", bytes.len() - HEADER_LEN));
    }
    if bytes[20..HEADER_LEN] != checksum(key, &bytes[HEADER_LEN..]) {
        return Err("checksum does not match".into());
    }
    bytes.drain(..HEADER_LEN);
    Ok(bytes)
}

/// Writes plain values and arrays one after another, in the byte order of the machine.
#[derive(Default)]
pub struct Encoder(Vec<u8>);

impl Encoder {
    /// Appends one value.
    pub fn value<T: Pod>(&mut self, value: T) -> &mut Self {
        self.0.extend_from_slice(bytemuck::bytes_of(&value));
        self
    }

    /// Appends an array with its length.
    pub fn slice<T: Pod>(&mut self, values: &[T]) -> &mut Self {
        self.value(values.len() as u64);
        self.0.extend_from_slice(bytemuck::cast_slice(values));
        self
    }

    /// Appends a matrix with its shape.
    pub fn matrix<T: Pod>(&mut self, matrix: &crate::Matrix<T>) -> &mut Self {
        self.value(matrix.cols() as u64).slice(matrix.data())
    }

    /// The bytes written.
    pub fn finish(self) -> Vec<u8> {
        self.0
    }
}

/// Reads what an [`Encoder`] wrote; `None` where the bytes end early or do not fit.
pub struct Decoder<'a>(&'a [u8]);

impl<'a> Decoder<'a> {
    /// Starts at the beginning of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// The next value.
    pub fn value<T: Pod>(&mut self) -> Option<T> {
        let bytes = self.take(size_of::<T>())?;
        Some(bytemuck::pod_read_unaligned(bytes))
    }

    /// The next array.
    pub fn slice<T: Pod>(&mut self) -> Option<Vec<T>> {
        let len = usize::try_from(self.value::<u64>()?).ok()?;
        let bytes = self.take(len.checked_mul(size_of::<T>())?)?;
        Some(bytemuck::pod_collect_to_vec(bytes))
    }

    /// The next matrix.
    pub fn matrix<T: Pod>(&mut self) -> Option<crate::Matrix<T>> {
        let cols = usize::try_from(self.value::<u64>()?).ok()?;
        let data = self.slice::<T>()?;
        let rows = data.len().checked_div(cols).unwrap_or(0);
        (rows * cols == data.len()).then(|| crate::Matrix::from_vec(rows, cols, data))
    }

    fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(len)?;
        self.0 = tail;
        Some(head)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;

    fn cache() -> (tempfile::TempDir, Cache) {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::open(folder.path()).unwrap();
        (folder, cache)
    }

    #[test]
    fn an_entry_comes_back_as_it_was_put() {
        let (_folder, cache) = cache();
        let key = CacheKey::of(&[b"mesh", b"options"]);
        let matrix = Matrix::from_fn(3, 2, |i, j| (i * 2 + j) as f64);
        let mut encoder = Encoder::default();
        encoder.value(7u32).matrix(&matrix);
        cache.put("shape", key, &encoder.finish()).unwrap();
        let Lookup::Hit(bytes) = cache.get("shape", key) else { panic!("expected a hit") };
        let mut decoder = Decoder::new(&bytes);
        assert_eq!(decoder.value::<u32>(), Some(7));
        assert_eq!(decoder.matrix::<f64>(), Some(matrix));
        assert_eq!(decoder.value::<u8>(), None);
    }

    #[test]
    fn another_split_of_the_same_bytes_is_another_key() {
        assert_ne!(CacheKey::of(&[b"ab", b"c"]), CacheKey::of(&[b"a", b"bc"]));
    }

    #[test]
    fn a_key_comes_back_from_its_digits() {
        let key = CacheKey::of(&[b"mesh"]);
        assert_eq!(CacheKey::from_hex(&key.to_hex()), Some(key));
        assert_eq!(CacheKey::from_hex(&key.to_hex()[..63]), None);
        assert_eq!(CacheKey::from_hex(&"g".repeat(64)), None);
    }

    #[test]
    fn every_damage_is_noticed() {
        let (_folder, cache) = cache();
        let key = CacheKey::of(&[b"x"]);
        assert!(matches!(cache.get("shape", key), Lookup::Miss));
        cache.put("shape", key, &[1, 2, 3, 4]).unwrap();
        let path = cache.path("shape", key);
        let good = std::fs::read(&path).unwrap();
        let mut other_order = good.clone();
        other_order[8..12].reverse();
        other_order[12..20].reverse();
        std::fs::write(&path, &other_order).unwrap();
        assert!(matches!(cache.get("shape", key), Lookup::Damaged(_)), "written in the other byte order");
        for len in 0..good.len() {
            std::fs::write(&path, &good[..len]).unwrap();
            assert!(matches!(cache.get("shape", key), Lookup::Damaged(_)), "truncated to {len} bytes");
        }
        for at in 0..good.len() {
            let mut flipped = good.clone();
            flipped[at] ^= 1;
            std::fs::write(&path, &flipped).unwrap();
            assert!(matches!(cache.get("shape", key), Lookup::Damaged(_)), "bit flipped at byte {at}");
        }
    }
}
