//! Files through the public interface: real ones read, every format written and read back.

use std::path::{Path, PathBuf};

use fmnet::io::{
    Attributes, IntegerField, IntegerKind, MeshFormat, read_matrix, read_mesh, read_point_map, read_vector,
    write_matrix, write_mesh, write_point_map, write_vector,
};
use fmnet::point_map::PointMap;
use fmnet::{Matrix, Mesh};
use proptest::collection::vec;
use proptest::prelude::*;

#[path = "support/skipped.rs"]
mod skip;
use skip::skipped;

/// The development data, if it is there.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("FMNET_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    if !folder.is_dir() {
        skipped(format!("there is no {} (set FMNET_DATA)", folder.display()));
        return None;
    }
    Some(folder)
}

#[test]
fn real_meshes_have_the_stated_sizes() {
    let Some(data) = data() else { return };
    for (file, format, n_vertices, n_faces) in [
        ("faust/registrations/tr_reg_060.ply", MeshFormat::Ply, 6890, 13776),
        ("faust/remeshed_15k/tr_reg_060.off", MeshFormat::Off, 15000, 29996),
        ("faust/scans_7k/test_scan_000.off", MeshFormat::Off, 7000, 13838),
        ("scape/mesh000.off", MeshFormat::Off, 12500, 24998),
        ("tosca/dog/dog0.off", MeshFormat::Off, 25290, 50528),
    ] {
        let read = read_mesh(&data.join(file)).unwrap();
        assert_eq!((read.mesh.n_vertices(), read.mesh.n_faces()), (n_vertices, n_faces), "{file}");
        assert_eq!(
            (read.info.format, read.info.n_polygons, read.info.n_ignored_faces),
            (format, 0, 0),
            "{file}"
        );
        assert_eq!(read.attributes, Attributes::default(), "{file}");
    }
}

/// The first vertices of both correspond, and the remeshed ones have another unit: one factor must explain all.
#[test]
fn both_formats_give_the_same_positions() {
    let Some(data) = data() else { return };
    let registration = read_mesh(&data.join("faust/registrations/tr_reg_060.ply")).unwrap().mesh;
    let remeshed = read_mesh(&data.join("faust/remeshed_15k/tr_reg_060.off")).unwrap().mesh;
    let distance = |mesh: &Mesh, i: usize| {
        let (a, b) = (mesh.vertices()[0], mesh.vertices()[i]);
        (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
    };
    let factor = distance(&remeshed, 6000) / distance(&registration, 6000);
    for i in (0..6890).step_by(100) {
        let difference = distance(&remeshed, i) - factor * distance(&registration, i);
        assert!(difference.abs() < 0.02, "vertex {i}: {difference}");
    }
}

#[test]
fn real_correspondences_are_one_based() {
    let Some(data) = data() else { return };
    let folder = data.join("faust/remeshed_5k");
    let mesh = read_mesh(&folder.join("tr_reg_060.off")).unwrap().mesh;
    let map = read_point_map(&folder.join("corres/tr_reg_060.vts"), Some(mesh.n_vertices())).unwrap();
    assert!(map.len() > 4900 && map.iter().all(|target| target.is_some()));
}

#[test]
fn unknown_extensions_go_by_the_content() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.dat");
    std::fs::write(&path, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").unwrap();
    assert_eq!(read_mesh(&path).unwrap().info.format, MeshFormat::Off);
    std::fs::write(&path, "PK\u{3}\u{4}").unwrap();
    let message = read_mesh(&path).unwrap_err().to_string();
    assert!(message.contains("mesh.dat") && message.contains(".ply"), "{message}");
    assert!(read_mesh(&folder.path().join("absent.ply")).unwrap_err().to_string().contains("absent.ply"));
    let mesh = Mesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
    let message =
        write_mesh(&folder.path().join("a.stl"), &mesh, &Attributes::default()).unwrap_err().to_string();
    assert!(message.contains(".off, .ply, .obj, .glb"), "{message}");
    let colors = Attributes { vertex_colors: Some(vec![[0; 4]; 2]), ..Default::default() };
    let message = write_mesh(&folder.path().join("a.ply"), &mesh, &colors).unwrap_err().to_string();
    assert!(message.contains("2 vertex colours, but the mesh calls for 3"), "{message}");
}

/// Coordinates of every magnitude, and simple ones.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![-1e3..1e3f64, Just(0.0), (-100..100i32).prop_map(f64::from), proptest::num::f64::NORMAL]
}

fn mesh() -> impl Strategy<Value = Mesh> {
    vec([coordinate(), coordinate(), coordinate()], 3..20).prop_flat_map(|vertices| {
        let n = vertices.len() as u32;
        vec([0..n, 0..n, 0..n], 1..20)
            .prop_map(move |faces| Mesh::new(vertices.clone(), faces).expect("indices are drawn in range"))
    })
}

/// A mesh and, for some, colours, texture coordinates and scalars.
fn textured_mesh() -> impl Strategy<Value = (Mesh, Attributes)> {
    mesh().prop_flat_map(|mesh| {
        let (n, m) = (mesh.n_vertices(), mesh.n_faces());
        let uv = || [0..=16u8, 0..=16u8].prop_map(|uv| uv.map(|x| f32::from(x) / 16.0));
        let colors = proptest::option::of(vec(any::<[u8; 4]>(), n));
        let uvs = proptest::option::of(vec([uv(), uv(), uv()], m));
        let scalars = vec(vec(proptest::num::f32::NORMAL.prop_map(f64::from), n), 0..3);
        let integers = proptest::option::of(vec(any::<i16>().prop_map(i64::from), n));
        (Just(mesh), colors, uvs, scalars, integers).prop_map(
            |(mesh, vertex_colors, corner_uvs, fields, labels)| {
                let vertex_scalars =
                    fields.into_iter().enumerate().map(|(i, f)| (format!("f{i}"), f)).collect();
                let field = |values| IntegerField { name: "label".into(), kind: IntegerKind::I32, values };
                let vertex_integers = labels.into_iter().map(field).collect();
                let attributes = Attributes {
                    vertex_colors,
                    corner_uvs,
                    vertex_scalars,
                    vertex_integers,
                    ..Attributes::default()
                };
                (mesh, attributes)
            },
        )
    })
}

/// Whether colours of a text format are told from those that count to 1: an alpha must exceed 1.
fn is_clear(colors: &[[u8; 4]]) -> bool {
    colors.iter().any(|c| c[3] > 1)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn off_round_trips((mesh, attributes) in textured_mesh()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.off");
        write_mesh(&path, &mesh, &attributes).unwrap();
        let file = read_mesh(&path).unwrap();
        prop_assert_eq!(file.mesh, mesh);
        if attributes.vertex_colors.as_ref().is_none_or(|colors| is_clear(colors)) {
            prop_assert_eq!(file.attributes.vertex_colors, attributes.vertex_colors);
        }
    }

    #[test]
    fn ply_round_trips((mesh, attributes) in textured_mesh()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        write_mesh(&path, &mesh, &attributes).unwrap();
        let file = read_mesh(&path).unwrap();
        prop_assert_eq!(file.mesh, mesh);
        prop_assert_eq!(file.attributes, attributes);
    }

    #[test]
    fn obj_round_trips((mesh, attributes) in textured_mesh()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        write_mesh(&path, &mesh, &attributes).unwrap();
        let file = read_mesh(&path).unwrap();
        prop_assert_eq!(file.mesh, mesh);
        prop_assert_eq!(file.attributes.corner_uvs, attributes.corner_uvs);
        let opaque = attributes.vertex_colors.map(|c| c.iter().map(|c| [c[0], c[1], c[2], 255]).collect::<Vec<_>>());
        prop_assert_eq!(file.attributes.vertex_colors, opaque);
    }

    #[test]
    fn glb_round_trips_in_single_precision((mesh, attributes) in textured_mesh()) {
        let vertices = mesh.vertices().iter().map(|p| p.map(|x| f64::from((x as f32).clamp(-1e30, 1e30)))).collect();
        let mesh = Mesh::new(vertices, mesh.faces().to_vec()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        write_mesh(&path, &mesh, &attributes).unwrap();
        let file = read_mesh(&path).unwrap();
        let n = mesh.n_vertices();
        prop_assert_eq!(&file.mesh.vertices()[..n], mesh.vertices());
        for face in 0..mesh.n_faces() {
            prop_assert_eq!(file.mesh.corners(face), mesh.corners(face));
        }
        prop_assert_eq!(file.attributes.corner_uvs, attributes.corner_uvs);
        let colors = file.attributes.vertex_colors.map(|colors| colors[..n].to_vec());
        prop_assert_eq!(colors, attributes.vertex_colors);
        for (found, expected) in file.attributes.vertex_scalars.iter().zip(&attributes.vertex_scalars) {
            prop_assert_eq!((&found.0, &found.1[..n]), (&expected.0, &expected.1[..]));
        }
        prop_assert_eq!(file.attributes.vertex_integers.len(), attributes.vertex_integers.len());
        for (found, expected) in file.attributes.vertex_integers.iter().zip(&attributes.vertex_integers) {
            prop_assert_eq!((&found.name, &found.values[..n]), (&expected.name, &expected.values[..]));
        }
    }

    #[test]
    fn point_maps_round_trip(targets in vec(prop_oneof![4 => 0..50u32, 1 => Just(PointMap::UNMATCHED)], 0..40)) {
        let map =
            PointMap { confidence: Some(vec![0.25; targets.len()]), ..PointMap::new(targets, 50) };
        let folder = tempfile::tempdir().unwrap();
        for extension in ["txt", "vts", "npy", "csv"] {
            let path = folder.path().join(format!("map.{extension}"));
            write_point_map(&path, &map).unwrap();
            let read = read_point_map(&path, Some(50)).unwrap();
            prop_assert_eq!(&read.targets, &map.targets);
            prop_assert_eq!(read.n_target, 50);
        }
        let csv = read_point_map(&folder.path().join("map.csv"), None).unwrap();
        prop_assert_eq!(csv.n_target, 50);
        if !map.is_empty() {
            prop_assert_eq!(csv.confidence, map.confidence);
        }
    }

    #[test]
    fn matrices_round_trip(rows in 0..8usize, cols in 0..8usize, seed in proptest::num::f64::ANY) {
        let matrix = Matrix::from_fn(rows, cols, |i, j| seed * (i * cols + j) as f64);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        write_matrix(&path, &matrix).unwrap();
        let read = read_matrix::<f64>(&path).unwrap();
        prop_assert_eq!((read.rows(), read.cols()), (rows, cols));
        let bits = |m: &Matrix| m.data().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&read), bits(&matrix));
        let integers: Vec<i32> = (0..rows as i32).map(|i| i - 3).collect();
        write_vector(&path, &integers).unwrap();
        prop_assert_eq!(read_vector::<i32>(&path).unwrap(), integers);
    }
}
