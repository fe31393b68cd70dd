//! Files of values for `transfer`: fields of numbers or labels of every type, landmarks.

use anyhow::{Result, bail};
use fmnet::io::{NpyArray, read_npy, read_point_map, write_atomically, write_npy};
use fmnet::render::{Donors, RenderError, transfer_landmarks, transfer_values};
use fmnet::{Matrix, Mesh};
use std::path::Path;

/// Values of the vertices of a mesh.
pub(super) enum Values {
    /// Numbers: mixed where a vertex takes from several.
    Field(NpyArray),
    /// Vertices; `None` where the list or the map has none.
    Landmarks(Vec<Option<u32>>),
}

impl Values {
    /// Reads the values of a mesh.
    pub(super) fn read(path: &Path, mesh: &Mesh) -> Result<Self> {
        if is_landmarks(path) {
            return Ok(Self::Landmarks(read_point_map(path, Some(mesh.n_vertices()))?.iter().collect()));
        }
        let array = read_npy(path)?;
        if array.rows() != mesh.n_vertices() {
            bail!(
                "{}: {} rows, but the giving mesh has {} vertices",
                path.display(),
                array.rows(),
                mesh.n_vertices()
            );
        }
        Ok(Self::Field(array))
    }

    /// The values that the receiver gets: numbers mixed, integers of the nearest vertex.
    pub(super) fn carried(
        &self,
        giver: &Mesh,
        receiver: &Mesh,
        donors: &Donors,
    ) -> Result<Moved, RenderError> {
        Ok(match self {
            Self::Landmarks(landmarks) => {
                let known: Vec<u32> = landmarks.iter().flatten().copied().collect();
                let mut moved = transfer_landmarks(&known, giver, receiver, donors)?.into_iter();
                Moved::Landmarks(landmarks.iter().map(|l| l.and_then(|_| moved.next().flatten())).collect())
            }
            Self::Field(NpyArray::Floats(values, kind)) => {
                Moved::Field(NpyArray::Floats(transfer_values(values, donors)?, *kind), 0)
            }
            Self::Field(NpyArray::Integers(values, kind)) => {
                let nearest: Vec<Option<usize>> = donors.nearest_vertices().collect();
                let missing = kind.missing();
                let moved = Matrix::from_fn(nearest.len(), values.cols(), |i, j| {
                    nearest[i].map_or(missing, |v| values[(v, j)])
                });
                let n_missing = if missing == 0 { nearest.iter().filter(|v| v.is_none()).count() } else { 0 };
                Moved::Field(NpyArray::Integers(moved, *kind), n_missing)
            }
        })
    }
}

/// Values on the receiver.
pub(super) enum Moved {
    /// With the number of vertices that have 0 for want of a match.
    Field(NpyArray, usize),
    Landmarks(Vec<Option<u32>>),
}

impl Moved {
    /// Writes the file; returns how many vertices have 0 for want of a match.
    pub(super) fn write(&self, path: &Path) -> Result<usize> {
        match self {
            Self::Field(array, n_missing) => {
                write_npy(path, array)?;
                Ok(*n_missing)
            }
            Self::Landmarks(landmarks) => {
                let lines: String =
                    landmarks.iter().map(|l| l.map_or("-1\n".into(), |v| format!("{v}\n"))).collect();
                write_atomically(path, |out| out.write_all(lines.as_bytes()))?;
                Ok(0)
            }
        }
    }
}

/// The extension in lower case.
pub(super) fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Whether a file of values is one of landmarks.
pub(super) fn is_landmarks(path: &Path) -> bool {
    extension(path) == "txt"
}
