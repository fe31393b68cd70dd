use super::*;
use PointMapFormat::{Csv, Npy, Npz, Txt, Vts};

fn map() -> PointMap {
    PointMap {
        confidence: Some(vec![0.5, 0.0, 1.0]),
        points: Some(vec![
            Some(SurfacePoint { face: 7, weights: [0.25, 0.5, 0.25] }),
            None,
            Some(SurfacePoint::at_corner(0, 2)),
        ]),
        ..PointMap::new(vec![2, PointMap::UNMATCHED, 0], 4)
    }
}

#[test]
fn every_format_round_trips() {
    let folder = tempfile::tempdir().unwrap();
    let marked = PointMap { followers: vec![1, 2], ..map() };
    for extension in ["txt", "vts", "npy", "CSV", "npz"] {
        let path = folder.path().join(format!("map.{extension}"));
        write_point_map(&path, &map()).unwrap();
        let keeps_all = ["CSV", "npz"].contains(&extension);
        let targets = PointMap::new(map().targets, 4);
        assert_eq!(read_point_map(&path, Some(4)).unwrap(), if keeps_all { map() } else { targets.clone() });
        let path = folder.path().join(format!("marked.{extension}"));
        for written in [marked.clone(), PointMap { points: None, ..marked.clone() }] {
            write_point_map(&path, &written).unwrap();
            assert_eq!(
                read_point_map(&path, Some(4)).unwrap(),
                if keeps_all { written } else { targets.clone() }
            );
        }
    }
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(text("map.txt"), "2\n-1\n0\n");
    assert_eq!(text("map.vts"), "3\n0\n1\n");
    assert_eq!(
        text("map.CSV"),
        "# source->target, 0-based, n_source=3, n_target=4\nsource,target,confidence,face,u,v,w\n\
         0,2,0.5,7,0.25,0.5,0.25\n1,-1,0,-1,0,0,0\n2,0,1,0,0,0,1\n"
    );
    assert_eq!(
        text("marked.CSV"),
        "# source->target, 0-based, n_source=3, n_target=4\nsource,target,confidence,follows\n\
         0,2,0.5,0\n1,-1,0,1\n2,0,1,1\n"
    );
    let unknown = write_point_map(&folder.path().join("map.map"), &map()).unwrap_err();
    assert!(unknown.to_string().contains(".npz"), "{unknown}");
    for (csv, problem) in [
        (&b"source,target\n0,1,,3,0.9,0.9,0\n"[..], None),
        (b"0,1,,3,0.9,0.9,0\n", Some("sum to 1")),
        (b"source,target,u,face,v,w\n0,1,1,3,0,0\n", None),
        (b"source,target,face\n0,1,3\n", Some("sum to 1")),
        (b"source,target,follows\n0,1,2\n", Some("follows is '2'")),
    ] {
        let read = decode(csv, Csv, None);
        match problem {
            None => assert!(read.is_ok(), "{read:?}"),
            Some(problem) => assert!(format!("{:?}", read.unwrap_err()).contains(problem)),
        }
    }
}

#[test]
fn archives_are_read_as_another_reader_and_writer_have_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.npz");
    write_point_map(&path, &map()).unwrap();
    let mut archive = npyz::npz::NpzArchive::open(&path).unwrap();
    let weights = archive.by_name("weights").unwrap().unwrap();
    assert_eq!(weights.shape(), [3, 3]);
    assert_eq!(weights.into_vec::<f64>().unwrap()[..4], [0.25, 0.5, 0.25, 0.0]);
    let faces: Vec<i32> = archive.by_name("faces").unwrap().unwrap().into_vec().unwrap();
    assert_eq!(faces, [7, -1, 0]);
    let targets: Vec<i32> = archive.by_name("targets").unwrap().unwrap().into_vec().unwrap();
    assert_eq!(targets, [2, -1, 0]);

    // As numpy.savez_compressed writes it.
    let archive = |arrays: &[(&str, Vec<u8>)]| {
        let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        let options =
            zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
        for (name, bytes) in arrays {
            archive.start_file(format!("{name}.npy"), options).unwrap();
            std::io::Write::write_all(&mut archive, bytes).unwrap();
        }
        archive.finish().unwrap().into_inner()
    };
    let targets = ("targets", matrix::encode(&[2], &[1i64, -1]));
    let read = decode(&archive(std::slice::from_ref(&targets)), Npz, None).unwrap();
    assert_eq!(read, PointMap::new(vec![1, PointMap::UNMATCHED], 2));
    for (other, problem) in [
        (("confidence", matrix::encode(&[3], &[1.0f32; 3])), "confidence: the array is [3, 1], not [2, 1]"),
        (("faces", matrix::encode(&[2], &[1i64, -1])), "has one alone"),
        (("followers", matrix::encode(&[1], &[2i64])), "source vertex 2 does not exist"),
        (("followers", vec![0; 40]), "followers"),
    ] {
        let error =
            decode(&archive(&[targets.clone(), other]), Npz, None).unwrap_err().in_file(Path::new("m.npz"));
        assert!(error.to_string().contains(problem), "{error}");
    }
    for (bytes, problem) in
        [(archive(&[]), "no array `targets`"), (b"PK\x03\x04".to_vec(), "no .npz archive")]
    {
        let error = decode(&bytes, Npz, None).unwrap_err().in_file(Path::new("m.npz")).to_string();
        assert!(error.contains(problem), "{error}");
    }
}

#[test]
fn the_number_of_targets_is_found_where_it_is_not_given() {
    assert_eq!(decode(b"# by hand\n1\n\n 5.0e0\n", Txt, None).unwrap(), PointMap::new(vec![1, 5], 6));
    assert_eq!(decode(b"1\n0\n", Vts, None).unwrap(), PointMap::new(vec![0, PointMap::UNMATCHED], 1));
    let csv = decode(b"# n_source=3, n_target=9\n1,4\n", Csv, None).unwrap();
    assert_eq!(csv, PointMap::new(vec![PointMap::UNMATCHED, 4, PointMap::UNMATCHED], 9));
    assert_eq!(decode(b"source, target\n0, 1\n", Csv, None).unwrap(), PointMap::new(vec![1], 2));
}

#[test]
fn errors_say_line_and_range() {
    for (bytes, format, expected) in [
        (&b"0\n3\n"[..], Txt, "line 2: target vertex 3 does not exist: there are 3, counted from 0"),
        (b"4\n", Vts, "target vertex 4 does not exist: there are 3, counted from 1"),
        (b"-1\n", Vts, "target vertex -1 does not exist"),
        (b"-2\n", Txt, "target vertex -2 does not exist"),
        (b"0 1\n", Txt, "line 1: '1' follows the target"),
        (b"a\n", Txt, "line 1: the target is not an integer: 'a'"),
        (b"0", Npy, "does not begin as a .npy file"),
        (b"x,y\n", Csv, "the columns are 'x,y'"),
        (b"# n_source=99\n", Csv, "n_source=99, but the file has only 14 bytes"),
        (b"# n_target=4\n", Csv, "the map is to 4 vertices, but the target has 3"),
        (b"# source->target, 1-based\n", Csv, "0-based are read"),
        (b"0,0\n0,0\n", Csv, "line 2: source vertex 0 is there a second time"),
        (b"99999999,0\n", Csv, "source vertex 99999999 does not exist"),
        (b"0,0,high\n", Csv, "the confidence is not a number: 'high'"),
        (b"0\n", Csv, "the target is not an integer: ''"),
    ] {
        let error = decode(bytes, format, Some(3)).unwrap_err().in_file(Path::new("map")).to_string();
        assert!(error.contains(expected), "{error}");
    }
    let large = format!("{}\n", u32::MAX);
    assert!(
        decode(large.as_bytes(), Txt, None)
            .unwrap_err()
            .in_file(Path::new("map"))
            .to_string()
            .contains("exist")
    );
}
