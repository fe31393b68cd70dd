//! NumPy's `.npy`: matrices `[rows, cols]` and vectors `[n]` of floats and integers.
//!
//! Format: NumPy Enhancement Proposal 1, versions 1.0 to 3.0. Read are `f4`, `f8`, `i4`, `i8` of either byte order, in C
//! and Fortran order; written is C order, little-endian. The header is parsed here, since it may be hostile.

mod header;

use std::path::Path;

use super::error::{ParseError, Parsed, Position, TRUNCATED};
use super::{IoError, write_atomically};
use crate::Matrix;
use header::{Header, Kind};

/// A number that `.npy` files can be read to and written from: `f64`, `f32`, `i32` or `i64`.
pub trait NpyNumber: Copy + sealed::Sealed {}

mod sealed {
    use super::header::Kind;

    pub trait Sealed: Sized {
        /// NumPy's name of the type.
        const DESCR: &'static str;
        /// The file's number as this type, or `None` where it does not fit.
        fn convert(value: Value) -> Option<Self>;
        fn put(self, bytes: &mut Vec<u8>);
    }

    /// A number as it stands in a file.
    #[derive(Clone, Copy)]
    pub enum Value {
        Float(f64),
        Integer(i64),
    }

    impl Value {
        /// Takes the bytes of one item, least significant first.
        pub(in super::super) fn from_le_bytes(kind: Kind, bytes: [u8; 8]) -> Self {
            let [a, b, c, d, ..] = bytes;
            match kind {
                Kind::F4 => Self::Float(f32::from_le_bytes([a, b, c, d]).into()),
                Kind::F8 => Self::Float(f64::from_le_bytes(bytes)),
                Kind::I4 => Self::Integer(i32::from_le_bytes([a, b, c, d]).into()),
                Kind::I8 => Self::Integer(i64::from_le_bytes(bytes)),
            }
        }
    }
}

macro_rules! npy_number {
    ($type:ty, $descr:literal, $convert:expr) => {
        impl NpyNumber for $type {}

        impl sealed::Sealed for $type {
            const DESCR: &'static str = $descr;

            fn convert(value: sealed::Value) -> Option<Self> {
                $convert(value)
            }

            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    };
}

npy_number!(f64, "<f8", |value| match value {
    sealed::Value::Float(x) => Some(x),
    sealed::Value::Integer(i) => Some(i as f64),
});
npy_number!(f32, "<f4", |value| match value {
    sealed::Value::Float(x) => Some(x as f32),
    sealed::Value::Integer(i) => Some(i as f32),
});
npy_number!(i32, "<i4", |value| match value {
    sealed::Value::Float(_) => None,
    sealed::Value::Integer(i) => i32::try_from(i).ok(),
});
npy_number!(i64, "<i8", |value| match value {
    sealed::Value::Float(_) => None,
    sealed::Value::Integer(i) => Some(i),
});

/// Reads a `.npy` array of one or two dimensions as a matrix; one of `n` numbers becomes `[n, 1]`.
///
/// Integers are converted to floats and `f8` to `f4` by rounding; floats to integers are an error, and so are integers too
/// large for `T`.
///
/// # Errors
/// If the file cannot be read, is no such array, ends early, or holds a number that does not fit `T`.
pub fn read_matrix<T: NpyNumber>(path: &Path) -> Result<Matrix<T>, IoError> {
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    decode(&bytes).map_err(|e| e.in_file(path))
}

/// Reads a `.npy` array of one dimension, or of two of which one is 1, as `[n]`; numbers are converted as by [`read_matrix`].
///
/// # Errors
/// As [`read_matrix`], and if both dimensions are above 1.
pub fn read_vector<T: NpyNumber>(path: &Path) -> Result<Vec<T>, IoError> {
    let matrix = read_matrix(path)?;
    if matrix.rows() != 1 && matrix.cols() != 1 {
        let problem = format!("the array is [{}, {}], not a vector", matrix.rows(), matrix.cols());
        return Err(ParseError::part("header", problem).in_file(path));
    }
    Ok(matrix.into_data())
}

/// Writes a matrix `[rows, cols]` as `.npy`.
///
/// # Errors
/// If the file cannot be written.
pub fn write_matrix<T: NpyNumber>(path: &Path, matrix: &Matrix<T>) -> Result<(), IoError> {
    write(path, &format!("({}, {})", matrix.rows(), matrix.cols()), matrix.data())
}

/// Writes a vector `[n]` as `.npy`.
///
/// # Errors
/// If the file cannot be written.
pub fn write_vector<T: NpyNumber>(path: &Path, vector: &[T]) -> Result<(), IoError> {
    write(path, &format!("({},)", vector.len()), vector)
}

fn write<T: NpyNumber>(path: &Path, shape: &str, data: &[T]) -> Result<(), IoError> {
    write_atomically(path, |w| {
        w.write_all(&header::encode(T::DESCR, shape))?;
        let mut bytes = Vec::new();
        for chunk in data.chunks(1 << 13) {
            bytes.clear();
            chunk.iter().for_each(|x| x.put(&mut bytes));
            w.write_all(&bytes)?;
        }
        Ok(())
    })
}

pub(super) fn decode<T: NpyNumber>(bytes: &[u8]) -> Parsed<Matrix<T>> {
    let header = Header::parse(bytes)?;
    let size = header.kind.size();
    let body = &bytes[header.body..];
    let n = header.rows.checked_mul(header.cols).filter(|&n| n <= body.len() / size);
    let Some(n) = n else {
        let problem = format!(
            "the header promises [{}, {}] numbers of {size} bytes, but only {} bytes follow",
            header.rows,
            header.cols,
            body.len()
        );
        return Err(ParseError::new(Position::Byte(header.body), problem, TRUNCATED));
    };
    let mut data = Vec::with_capacity(n);
    for item in body.chunks_exact(size).take(n) {
        data.push(T::convert(header.number(item)).ok_or_else(|| does_not_fit::<T>(&header))?);
    }
    if header.fortran_order && n > 0 {
        return Ok(Matrix::from_fn(header.rows, header.cols, |i, j| data[j * header.rows + i]));
    }
    Ok(Matrix::from_vec(header.rows, header.cols, data))
}

fn does_not_fit<T: NpyNumber>(header: &Header) -> ParseError {
    let problem = format!("a number of type {:?} does not fit {}", header.kind, T::DESCR);
    ParseError::new(Position::Part("data".into()), problem, "convert the array with NumPy's astype")
}

impl Header {
    fn number(&self, item: &[u8]) -> sealed::Value {
        let mut bytes = [0; 8];
        bytes[..item.len()].copy_from_slice(item);
        if self.big_endian {
            bytes[..item.len()].reverse();
        }
        sealed::Value::from_le_bytes(self.kind, bytes)
    }
}

impl Kind {
    fn size(self) -> usize {
        match self {
            Self::F4 | Self::I4 => 4,
            Self::F8 | Self::I8 => 8,
        }
    }
}

#[cfg(test)]
mod tests;
