//! A shape with its descriptors, in memory and as a file.

use crate::Matrix;
use crate::cache::{CacheKey, Decoder, Encoder};
use crate::io::{IoError, Position, write_atomically};
use crate::shape::Shape;
use std::path::Path;

const MAGIC: &[u8; 8] = b"FMNETS\0\0";
/// Raise where the encoding, or what descriptors are computed from, changes.
const FORMAT_VERSION: u32 = 2;
const HEADER_LEN: usize = 8 + 4 + 32;

/// A shape with its descriptors.
#[derive(Clone, Debug)]
pub struct DescribedShape {
    /// The processed shape.
    pub shape: Shape,
    /// Descriptors of its working mesh, `[n, d]`.
    pub descriptors: Matrix<f32>,
    /// What described it: [`Matcher::descriptor_key`](super::Matcher::descriptor_key).
    pub(super) described_by: CacheKey,
}

impl DescribedShape {
    /// The shape as bytes, in the byte order of the machine: meshes, the way back to the input's vertices, eigenbases
    /// and descriptors.
    pub fn encode(&self) -> Vec<u8> {
        let mut payload = Encoder::default();
        self.shape.save(&mut payload);
        payload.matrix(&self.descriptors).value(*self.described_by.as_bytes());
        let payload = payload.finish();
        let mut out = Vec::with_capacity(HEADER_LEN + payload.len());
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&FORMAT_VERSION.to_ne_bytes());
        out.extend_from_slice(CacheKey::of(&[&payload]).as_bytes());
        out.extend_from_slice(&payload);
        out
    }

    /// The shape of bytes that [`DescribedShape::encode`] gave; `path` is the file's name in errors.
    ///
    /// # Errors
    /// If they are not such bytes, damaged, of another version or of a machine of the other byte order.
    pub fn decode(bytes: &[u8], path: &Path) -> Result<Self, IoError> {
        let malformed = |problem: String| IoError::Malformed {
            path: path.into(),
            at: Position::Part("described shape".into()),
            problem,
            remedy: "describe the mesh again".into(),
        };
        let (header, payload) = bytes.split_at_checked(HEADER_LEN).unwrap_or((bytes, &[]));
        if header.len() < HEADER_LEN || !header.starts_with(MAGIC) {
            return Err(malformed("these bytes are no described shape".into()));
        }
        if header[8..12] != FORMAT_VERSION.to_ne_bytes() {
            return Err(malformed(
                "it is of another version, or of a machine of the other byte order".into(),
            ));
        }
        if &header[12..] != CacheKey::of(&[payload]).as_bytes() {
            return Err(malformed("its checksum does not match; it is damaged or cut off".into()));
        }
        Self::payload(&mut Decoder::new(payload)).ok_or_else(|| malformed("its parts do not fit".into()))
    }

    fn payload(input: &mut Decoder) -> Option<Self> {
        let shape = Shape::load(input)?;
        let descriptors = input.matrix().filter(|m: &Matrix<f32>| m.rows() == shape.n())?;
        Some(Self { shape, descriptors, described_by: CacheKey::from_bytes(input.value()?) })
    }

    /// Writes the shape to a file, which [`DescribedShape::read`] reads.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), IoError> {
        let bytes = self.encode();
        write_atomically(path, |out| out.write_all(&bytes))
    }

    /// Reads a shape that was written by [`DescribedShape::write`].
    ///
    /// # Errors
    /// If the file cannot be read, and as [`DescribedShape::decode`].
    pub fn read(path: &Path) -> Result<Self, IoError> {
        let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
        Self::decode(&bytes, path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::ignore;
    use crate::mesh::shapes::{bumpy_sphere, permuted};
    use crate::pipeline::{DescriptorKind, MatchOptions, Matcher, Resize};

    fn matcher(shot_radius: f64) -> Matcher {
        let options = MatchOptions {
            descriptor: DescriptorKind::Shot,
            k: Some(20),
            decimate: Resize::To(300),
            shot_radius: Some(shot_radius),
            ..MatchOptions::default()
        };
        Matcher::new(&options).unwrap()
    }

    #[test]
    fn a_shape_comes_back_as_it_was_written() {
        let (source, matcher) = (bumpy_sphere(3, 1), matcher(0.2));
        let target = permuted(&source, 3).0;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.fms");
        let source = matcher.describe_part("source", &source, source.area(), &ignore).unwrap();
        let target = matcher.describe("target", &target, &ignore).unwrap();
        // The full basis, which upscaling computes, is kept as well.
        let expected = matcher.match_shapes(&source, &target, &ignore).unwrap();
        source.write(&path).unwrap();
        let read = DescribedShape::read(&path).unwrap();
        assert_eq!(read.encode(), source.encode());
        assert_eq!(matcher.match_shapes(&read, &target, &ignore).unwrap(), expected);
    }

    #[test]
    fn damage_and_foreign_descriptors_are_refused() {
        let mesh = bumpy_sphere(2, 1);
        let shape = matcher(0.2).describe("a", &mesh, &ignore).unwrap();
        let good = shape.encode();
        let path = Path::new("a.fms");
        for bytes in [&good[..20], &good[..good.len() - 1], b"OFF"] {
            let error = DescribedShape::decode(bytes, path).unwrap_err().to_string();
            assert!(error.starts_with("a.fms, described shape: "), "{error}");
        }
        for at in (0..good.len()).step_by(97) {
            let mut flipped = good.clone();
            flipped[at] ^= 1;
            assert!(DescribedShape::decode(&flipped, path).is_err(), "bit flipped at byte {at}");
        }
        let error = matcher(0.3).match_shapes(&shape, &shape, &ignore).unwrap_err().to_string();
        assert!(error.contains("a was described by another model"), "{error}");
    }
}
