use super::*;
use npyz::WriterBuilder;

/// A file written by another implementation of the format.
fn reference<T: npyz::AutoSerialize + Copy>(shape: &[u64], order: npyz::Order, data: &[T]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let options = npyz::WriteOptions::new().default_dtype().shape(shape).order(order).writer(&mut bytes);
    let mut writer = options.begin_nd().unwrap();
    writer.extend(data.iter().copied()).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn reads_what_another_writer_writes() {
    let expected = Matrix::from_fn(2, 3, |i, j| (10 * i + j) as f64);
    let rows = [0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
    let columns = [0.0, 10.0, 1.0, 11.0, 2.0, 12.0];
    assert_eq!(decode::<f64>(&reference(&[2, 3], npyz::Order::C, &rows)).unwrap(), expected);
    assert_eq!(decode::<f64>(&reference(&[2, 3], npyz::Order::Fortran, &columns)).unwrap(), expected);
    let single = rows.map(|x| x as f32);
    assert_eq!(decode::<f64>(&reference(&[2, 3], npyz::Order::C, &single)).unwrap(), expected);
    assert_eq!(
        decode::<f32>(&reference(&[2, 3], npyz::Order::C, &rows)).unwrap(),
        expected.map(|x| x as f32)
    );
    let integers = rows.map(|x| x as i64);
    assert_eq!(
        decode::<i32>(&reference(&[6], npyz::Order::C, &integers)).unwrap().into_data(),
        [0, 1, 2, 10, 11, 12]
    );
    assert_eq!(decode::<f64>(&reference(&[2, 3], npyz::Order::C, &integers)).unwrap(), expected);
}

#[test]
fn another_reader_reads_what_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    write_matrix(&path, &Matrix::from_vec(2, 2, vec![1.0f32, 2.0, 3.0, 4.0])).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!((file.shape(), file.order()), (&[2, 2][..], npyz::Order::C));
    assert_eq!(file.into_vec::<f32>().unwrap(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!((bytes.len() - 16) % 64, 0);

    write_vector(&path, &[1, -1]).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(npyz::NpyFile::new(&bytes[..]).unwrap().shape(), [2]);
    assert_eq!(read_vector::<i32>(&path).unwrap(), [1, -1]);
    assert_eq!(read_matrix::<f64>(&path).unwrap(), Matrix::from_vec(2, 1, vec![1.0, -1.0]));
}

fn with_header(dictionary: &str, body: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dictionary.len() as u16).to_le_bytes());
    bytes.extend(dictionary.as_bytes());
    bytes.extend(body);
    bytes
}

#[test]
fn big_endian_numbers() {
    let header = "{\"descr\": \">i4\", \"fortran_order\": False, \"shape\": (2,)}";
    let bytes = with_header(header, &[0, 0, 1, 2, 255, 255, 255, 254]);
    assert_eq!(decode::<i32>(&bytes).unwrap().into_data(), [258, -2]);
}

#[test]
fn errors_say_what_is_supported() {
    let message = |bytes: &[u8]| decode::<i32>(bytes).unwrap_err().in_file(Path::new("a.npy")).to_string();
    assert!(message(b"PK").contains("does not begin as a .npy file"));
    assert!(message(b"\x93NUMPY\x09\x00\x00\x00").contains("version 9"));
    assert!(message(b"\x93NUMPY\x02\x00\xff\xff\xff\xff{").contains("ends within the header"));
    let dictionary = |descr: &str, shape: &str| {
        format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n")
    };
    for (descr, shape, expected) in [
        ("'<c16'", "(1,)", "arrays of type '<c16' are"),
        ("[('a', '<f8')]", "(1,)", "not supported"),
        ("'\u{fc}'", "(1,)", "not supported"),
        ("'<f8'", "(1,)", "does not fit <i4"),
        ("'<i8'", "(1,)", "does not fit <i4"),
        ("'<i4'", "(1, 2, 3)", "not of one or two dimensions"),
        ("'<i4'", "()", "not of one or two dimensions"),
        ("'<i4'", "(18446744073709551615, 18446744073709551615)", "promises [18446744073709551615"),
        // The product of these is 2^64, and so 0 in 64 bits.
        ("'<i4'", "(4294967296, 4294967296)", "promises [4294967296, 4294967296]"),
        ("'<i4'", "(99999999999999999999,)", "not of one or two dimensions"),
        ("'<i4'", "(4611686018427387905,)", "only 8 bytes follow"),
    ] {
        let bytes = with_header(&dictionary(descr, shape), &[0, 0, 0, 0, 1, 0, 0, 0]);
        assert!(message(&bytes).contains(expected), "{}", message(&bytes));
    }
    let empty = with_header(&dictionary("'<i4'", "(0, 18446744073709551615)"), &[]);
    assert_eq!(decode::<i32>(&empty).unwrap().cols(), usize::MAX);
    assert!(message(&with_header("{}", &[])).contains("there is no 'descr'"));
}

#[test]
fn integers_of_every_type_keep_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    for (descr, kind, low, high) in [
        ("|b1", NpyKind::Bool, 0, 1),
        ("|i1", NpyKind::I1, -128, 127),
        ("|u1", NpyKind::U1, 0, 255),
        ("<i2", NpyKind::I2, -32768, 32767),
        (">u2", NpyKind::U2, 0, 65535),
        ("<i4", NpyKind::I4, -2_147_483_648, 2_147_483_647),
        (">u4", NpyKind::U4, 0, 4_294_967_295i64),
        ("<i8", NpyKind::I8, i64::MIN, i64::MAX),
        ("<u8", NpyKind::U8, 0, i64::MAX),
    ] {
        let size = kind.size();
        let mut body = Vec::new();
        for value in [low, high] {
            let mut bytes = value.to_le_bytes()[..size].to_vec();
            if descr.starts_with('>') {
                bytes.reverse();
            }
            body.extend(bytes);
        }
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (2,), }}");
        std::fs::write(&path, with_header(&header, &body)).unwrap();
        let expected = NpyArray::Integers(Matrix::from_vec(2, 1, vec![low, high]), kind);
        assert_eq!(read_npy(&path).unwrap(), expected, "{descr}");
        write_npy(&path, &expected).unwrap();
        assert_eq!(read_npy(&path).unwrap(), expected, "{descr}");
    }
    let singles = NpyArray::Floats(Matrix::from_vec(1, 2, vec![0.5, f64::NEG_INFINITY]), NpyKind::F4);
    write_npy(&path, &singles).unwrap();
    assert_eq!(read_npy(&path).unwrap(), singles);
    let large = with_header("{'descr': '<u8', 'fortran_order': False, 'shape': (1,), }", &[255; 8]);
    std::fs::write(&path, large).unwrap();
    assert!(read_npy(&path).unwrap_err().to_string().contains("does not fit"));
}
