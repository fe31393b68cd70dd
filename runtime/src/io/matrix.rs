//! NumPy's `.npy`: matrices `[rows, cols]` and vectors `[n]` of floats and integers.
//!
//! Format: NumPy Enhancement Proposal 1, versions 1.0 to 3.0. Read are `f4`, `f8`, `bool` and integers of 1 to 8
//! bytes of either byte order, in C and Fortran order; written is C order, little-endian. The header is parsed here,
//! since it may be hostile.

mod header;

use std::path::Path;

use super::error::{ParseError, Parsed, Position, TRUNCATED};
use super::{IoError, write_atomically};
use crate::Matrix;
use header::Header;
pub use header::NpyKind;

/// Most bytes of an array in a `.npz` file: compressed, a few bytes may promise any number.
#[cfg(not(target_arch = "wasm32"))]
const MAX_ARRAY: u64 = 1 << 30;

/// A number that `.npy` files can be read to and written from: `f64`, `f32`, `i32` or `i64`.
pub trait NpyNumber: Copy + sealed::Sealed {}

mod sealed {
    use super::NpyKind;

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
        pub(in super::super) fn from_le_bytes(kind: NpyKind, bytes: [u8; 8]) -> Self {
            let [a, b, c, d, ..] = bytes;
            Self::Integer(match kind {
                NpyKind::F4 => return Self::Float(f32::from_le_bytes([a, b, c, d]).into()),
                NpyKind::F8 => return Self::Float(f64::from_le_bytes(bytes)),
                NpyKind::I1 => i8::from_le_bytes([a]).into(),
                NpyKind::Bool | NpyKind::U1 => a.into(),
                NpyKind::I2 => i16::from_le_bytes([a, b]).into(),
                NpyKind::U2 => u16::from_le_bytes([a, b]).into(),
                NpyKind::I4 => i32::from_le_bytes([a, b, c, d]).into(),
                NpyKind::U4 => u32::from_le_bytes([a, b, c, d]).into(),
                NpyKind::I8 => i64::from_le_bytes(bytes),
                NpyKind::U8 => match i64::try_from(u64::from_le_bytes(bytes)) {
                    Ok(value) => value,
                    Err(_) => return Self::Float(u64::from_le_bytes(bytes) as f64),
                },
            })
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
/// Integers are converted to floats and `f8` to `f4` by rounding; floats to integers are an error, and so are
/// integers too large for `T`.
///
/// # Errors
/// If the file cannot be read, is no such array, ends early, or holds a number that does not fit `T`.
pub fn read_matrix<T: NpyNumber>(path: &Path) -> Result<Matrix<T>, IoError> {
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    decode(&bytes).map_err(|e| e.in_file(path))
}

/// Reads a `.npy` array of one dimension, or of two of which one is 1, as `[n]`; numbers are converted as by
/// [`read_matrix`].
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

/// An array of numbers that keep their type: integers may be labels.
#[derive(Clone, Debug, PartialEq)]
pub enum NpyArray {
    /// Numbers with values in between, `[rows, cols]`.
    Floats(Matrix, NpyKind),
    /// Integers, `[rows, cols]`.
    Integers(Matrix<i64>, NpyKind),
}

impl NpyArray {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        match self {
            Self::Floats(values, _) => values.rows(),
            Self::Integers(values, _) => values.rows(),
        }
    }
}

/// Reads a `.npy` array of one or two dimensions as it is; one of `n` numbers becomes `[n, 1]`.
///
/// # Errors
/// As [`read_matrix`], and if an unsigned number exceeds 63 bits.
pub fn read_npy(path: &Path) -> Result<NpyArray, IoError> {
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    let array = Header::parse(&bytes).and_then(|header| match header.kind.is_float() {
        true => decode(&bytes).map(|values| NpyArray::Floats(values, header.kind)),
        false => decode(&bytes).map(|values| NpyArray::Integers(values, header.kind)),
    });
    array.map_err(|e| e.in_file(path))
}

/// Writes an array as `.npy` in its own type; one of a single column as `[rows]`.
///
/// # Errors
/// If the file cannot be written.
pub fn write_npy(path: &Path, array: &NpyArray) -> Result<(), IoError> {
    let (rows, cols, kind) = match array {
        NpyArray::Floats(values, kind) => (values.rows(), values.cols(), *kind),
        NpyArray::Integers(values, kind) => (values.rows(), values.cols(), *kind),
    };
    let shape = if cols == 1 { format!("({rows},)") } else { format!("({rows}, {cols})") };
    let mut bytes = header::encode(&kind.descr(), &shape);
    match array {
        NpyArray::Floats(values, NpyKind::F4) => {
            values.data().iter().for_each(|&x| bytes.extend((x as f32).to_le_bytes()));
        }
        NpyArray::Floats(values, _) => values.data().iter().for_each(|x| bytes.extend(x.to_le_bytes())),
        NpyArray::Integers(values, _) => {
            values.data().iter().for_each(|x| bytes.extend(&x.to_le_bytes()[..kind.size()]));
        }
    }
    write_atomically(path, |w| w.write_all(&bytes))
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

/// The bytes of a `.npy` file of an array.
pub(super) fn encode<T: NpyNumber>(shape: &[usize], data: &[T]) -> Vec<u8> {
    let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
    let shape = if shape.len() == 1 { format!("({},)", sizes[0]) } else { format!("({})", sizes.join(", ")) };
    let mut bytes = header::encode(T::DESCR, &shape);
    data.iter().for_each(|x| x.put(&mut bytes));
    bytes
}

/// There is no zip archive in WebAssembly.
#[cfg(target_arch = "wasm32")]
pub(super) fn npz(path: &Path, _arrays: &[(&str, Vec<u8>)]) -> Result<Vec<u8>, IoError> {
    let problem = ".npz files are not written in WebAssembly".into();
    Err(IoError::Unwritable { path: path.into(), problem, remedy: "write a .csv file" })
}

/// The bytes of a `.npz` file of named arrays, as [`encode`] gives them: a zip archive without compression. `path` is
/// for messages.
#[cfg(not(target_arch = "wasm32"))]
pub(super) fn npz(path: &Path, arrays: &[(&str, Vec<u8>)]) -> Result<Vec<u8>, IoError> {
    let written = || -> zip::result::ZipResult<Vec<u8>> {
        let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        // The date of NumPy's own files, so that the same map gives the same bytes.
        let stored = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default());
        for (name, bytes) in arrays {
            archive.start_file(format!("{name}.npy"), stored)?;
            std::io::Write::write_all(&mut archive, bytes)?;
        }
        Ok(archive.finish()?.into_inner())
    };
    written().map_err(|e| IoError::Write { path: path.into(), source: std::io::Error::other(e) })
}

/// There is no zip archive in WebAssembly.
#[cfg(target_arch = "wasm32")]
pub(super) fn read_npz<const N: usize>(_bytes: &[u8], _names: &[&str; N]) -> Parsed<[Option<Vec<u8>>; N]> {
    let error = ParseError::part("file", ".npz files are not read in WebAssembly");
    Err(error.with_remedy("pass the .npy files in it"))
}

/// The arrays of these names in a `.npz` file, as `.npy` files; none where it has no such array.
#[cfg(not(target_arch = "wasm32"))]
pub(super) fn read_npz<const N: usize>(bytes: &[u8], names: &[&str; N]) -> Parsed<[Option<Vec<u8>>; N]> {
    use std::io::Read;
    let wrong = |e: zip::result::ZipError| ParseError::part("file", format!("it is no .npz archive: {e}"));
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).map_err(wrong)?;
    let mut arrays = [const { None }; N];
    for (array, name) in arrays.iter_mut().zip(names) {
        let entry = match archive.by_name(&format!("{name}.npy")) {
            Err(zip::result::ZipError::FileNotFound) => continue,
            other => other.map_err(|e| wrong(e).within(name))?,
        };
        let mut content = Vec::new();
        let read = entry.take(MAX_ARRAY + 1).read_to_end(&mut content);
        let n_bytes = read.map_err(|e| ParseError::part(*name, e.to_string()))?;
        if n_bytes as u64 > MAX_ARRAY {
            return Err(ParseError::part(*name, format!("the array has more than {MAX_ARRAY} bytes")));
        }
        *array = Some(content);
    }
    Ok(arrays)
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

/// Whether these bytes begin as a `.npy` file.
pub(super) fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(header::MAGIC)
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

#[cfg(test)]
mod tests;
