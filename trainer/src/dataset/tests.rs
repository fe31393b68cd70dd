//! The layouts on small files written by hand.

use super::*;
use fmnet::io::{Attributes, write_mesh};
use fmnet::mesh::shapes::{icosphere, transformed};
use std::fs;

const STRAIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// A pyramid of four triangles over a square, seen from outside.
const WHOLE: &str = "OFF\n5 4 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 1\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";
/// Its first two triangles, the vertices in another order.
const PART: &str = "OFF\n4 2 0\n0.5 0.5 1\n1 1 0\n1 0 0\n0 0 0\n3 3 2 0\n3 2 1 0\n";

fn write(folder: &Path, files: &[(&str, &str)]) {
    for (file, text) in files {
        let path = folder.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
}

fn shape<'a>(dataset: &'a Dataset, name: &str) -> &'a ShapeEntry {
    dataset.shapes.iter().find(|s| s.name == name).unwrap()
}

fn points(shape: &ShapeEntry) -> Result<Vec<u32>, DatasetError> {
    shape.points(&shape.read().unwrap())
}

/// A folder with one part and the ground truth given.
fn with_truth(truth: &str) -> Result<Vec<u32>, DatasetError> {
    let folder = tempfile::tempdir().unwrap();
    let files = [
        ("null/cat.off", WHOLE),
        ("holes/holes_cat_shape_1.off", PART),
        ("holes/holes_cat_shape_1.baryc_gt", truth),
    ];
    write(folder.path(), &files);
    points(shape(&Dataset::open(folder.path()).unwrap(), "holes_cat_shape_1"))
}

#[test]
fn barycentric_ground_truth_gives_the_nearest_vertex() {
    // Vertex 0 is the apex, by a triangle of the part and with a weight that is not quite one.
    let truth = "1 0.05 0.05 0.9\n2 0 1 0\n1 0 1 0\n1 1 0 0\n";
    assert_eq!(with_truth(truth).unwrap(), [3, 2, 1, MISSING, 0]);
    // MATLAB's numbers, and blank lines; of two vertices in one place the better one is taken.
    let truth = "1.0000e+00 0.0 0.2 0.8\n\n1 0 0 1\r\n1 0 1 0\n1 1 0 0\n";
    assert_eq!(with_truth(truth).unwrap(), [3, 2, MISSING, MISSING, 1]);
}

#[test]
fn wrong_ground_truth_is_named_by_file_and_line() {
    let good = "1 0 0 1\n2 0 1 0\n1 0 1 0\n";
    for (line, reason) in [
        ("5 1 0 0", "line 4: triangle 5, but the mesh has triangles 1 to 4"),
        ("0 1 0 0", "line 4: triangle 0,"),
        ("1.5 1 0 0", "line 4: the triangle is not an integer"),
        ("1 1 0", "line 4: a barycentric weight is missing"),
        ("1 1 x 0", "line 4: a barycentric weight is not a number: 'x'"),
        ("", "3 lines, but the part has 4 vertices"),
    ] {
        let error = with_truth(&format!("{good}{line}\n")).unwrap_err().to_string();
        assert!(error.contains("holes_cat_shape_1.baryc_gt") && error.contains(reason), "{error}");
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("null/cat.off", WHOLE), ("cuts/cuts_cat_shape_1.off", PART)]);
    let dataset = Dataset::open(folder.path()).unwrap();
    let error = points(shape(&dataset, "cuts_cat_shape_1")).unwrap_err().to_string();
    assert!(error.contains("cuts_cat_shape_1.baryc_gt"), "{error}");
}

#[test]
fn the_first_ten_parts_by_number_are_for_training() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("null/cat.off", WHOLE), ("null/dog.off", WHOLE)]);
    for number in 1..=12 {
        write(folder.path(), &[(&format!("cuts/cuts_cat_shape_{number}.off"), PART)]);
    }
    let dataset = Dataset::open(folder.path()).unwrap();
    assert_eq!(dataset.shapes.len(), 14);
    for number in 1..=12 {
        let split = if number <= 10 { Split::Train } else { Split::Test };
        let part = shape(&dataset, &format!("cuts_cat_shape_{number}"));
        assert_eq!((part.split, part.is_part(), part.group.as_str()), (split, true, "cat"), "{number}");
    }
    assert!(!shape(&dataset, "dog").is_part());
}

#[test]
fn points_in_a_hole_of_a_scan_are_missing() {
    let folder = tempfile::tempdir().unwrap();
    let registration = icosphere(4);
    for subfolder in ["scans", "registrations"] {
        fs::create_dir_all(folder.path().join(subfolder)).unwrap();
    }
    let save = |name: &str, mesh: &Mesh| {
        write_mesh(&folder.path().join(name), mesh, &Attributes::default()).unwrap();
    };
    save("registrations/tr_reg_007.off", &registration);
    // The upper half, in reverse order and off by a little.
    let upper: Vec<u32> = (0..registration.n_vertices() as u32)
        .rev()
        .filter(|&i| registration.vertices()[i as usize][2] > 0.3)
        .collect();
    let vertices = upper.iter().map(|&i| registration.vertices()[i as usize]).collect();
    let scan = transformed(&Mesh::new(vertices, vec![[0, 1, 2]]).unwrap(), STRAIGHT, 1.001, [0.0; 3]);
    save("scans/tr_scan_007.off", &scan);
    // FAUST publishes no registrations of these.
    save("scans/test_scan_008.off", &scan);
    let dataset = Dataset::open(folder.path()).unwrap();
    assert_eq!(dataset.shapes.len(), 1, "a scan without registration has no ground truth");
    let points = points(shape(&dataset, "tr_scan_007")).unwrap();
    for (i, &point) in points.iter().enumerate() {
        let height = registration.vertices()[i][2];
        if height > 0.3 {
            assert_eq!(upper[point as usize] as usize, i);
        } else if height < 0.1 {
            assert_eq!(point, MISSING, "vertex {i} at {height}");
        }
    }
}

#[test]
fn scape_and_tosca_are_split_by_number() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("mesh000.off", WHOLE), ("mesh050.off", WHOLE), ("mesh051.off", WHOLE)]);
    let scape = Dataset::open(folder.path()).unwrap();
    assert_eq!(
        scape.shapes.iter().map(|s| s.split).collect::<Vec<_>>(),
        [Split::Train, Split::Train, Split::Test]
    );
    assert_eq!(points(&scape.shapes[0]).unwrap(), [0, 1, 2, 3, 4]);

    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("cat0.off", WHOLE), ("cat4.off", WHOLE), ("dog10.off", PART)]);
    let tosca = Dataset::open(folder.path()).unwrap();
    let found: Vec<_> = tosca.shapes.iter().map(|s| (s.group.as_str(), s.split)).collect();
    assert_eq!(found, [("cat", Split::Train), ("cat", Split::Validation), ("dog", Split::Train)]);
}

#[test]
fn remeshed_faust_has_lists_with_missing_points() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("tr_reg_000.off", WHOLE), ("corres/tr_reg_000.vts", "5\n0\n1\n")]);
    let dataset = Dataset::open(folder.path()).unwrap();
    assert_eq!(points(&dataset.shapes[0]).unwrap(), [4, MISSING, 0]);
    write(folder.path(), &[("corres/tr_reg_000.vts", "5\n6\n1\n")]);
    let error = points(&dataset.shapes[0]).unwrap_err().to_string();
    assert!(error.contains("tr_reg_000.vts") && error.contains("line 2"), "{error}");
}

#[test]
fn a_wrong_manifest_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let shape = "[[shape]]\nname = \"a\"\nmesh = \"a.off\"\ngroup = \"g\"\nsplit = \"train\"\n";
    for (text, reason) in [
        (format!("format = 2\n{shape}"), "format = 2"),
        (format!("format = 1\n{shape}{shape}"), "two shapes are named \"a\""),
        ("format = 1\n".into(), "no [[shape]]"),
        (format!("format = 1\n{}", shape.replace("train", "training")), "training"),
        (format!("format = 1\n{}", shape.replace("group", "grup")), "grup"),
        (format!("format = 1\n{shape}whole = \"b.off\"\n"), "add partial = true"),
        (format!("format = 1\n{shape}partial = true\n"), "no whole shape"),
    ] {
        write(folder.path(), &[("dataset.toml", &text)]);
        let error = Dataset::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("dataset.toml") && error.contains(reason), "{error}");
    }
}

/// A folder with the pyramid and the `.corr` file given.
fn with_surface_points(text: &str) -> (tempfile::TempDir, Dataset) {
    let folder = tempfile::tempdir().unwrap();
    let manifest = "format = 1\n[[shape]]\nname = \"a\"\nmesh = \"a.off\"\ngroup = \"g\"\n\
                    correspondence = \"a.CORR\"\nsplit = \"train\"\n";
    write(folder.path(), &[("a.off", WHOLE), ("a.CORR", text), ("dataset.toml", manifest)]);
    let dataset = Dataset::open(folder.path()).unwrap();
    (folder, dataset)
}

#[test]
fn surface_points_give_positions_and_the_heaviest_vertex() {
    let (_folder, dataset) = with_surface_points("2 0.5 0.25 0.25\n-1 0 0 0\n4 0.1 0.2 0.7\n");
    let entry = &dataset.shapes[0];
    assert_eq!(points(entry).unwrap(), [1, MISSING, 4]);
    let mesh = entry.read().unwrap();
    let surface = entry.surface_points(&mesh).unwrap();
    assert_eq!(surface[0].unwrap().position(&mesh), [0.875, 0.375, 0.25]);
    assert!(surface[1].is_none() && surface[2].unwrap().face == 3);

    let (_folder, dataset) = with_surface_points("2 0.5 0.25 0.25\n5 1 0 0\n");
    for error in
        [points(&dataset.shapes[0]).unwrap_err(), dataset.shapes[0].surface_points(&mesh).unwrap_err()]
    {
        let error = error.to_string();
        assert!(error.contains("a.CORR, line 2: triangle 5"), "{error}");
    }
}

#[test]
fn every_correspondence_gives_points_on_the_surface() {
    let mesh = icosphere(2);
    let folder = tempfile::tempdir().unwrap();
    let registration = folder.path().join("registration.off");
    write_mesh(&registration, &mesh, &Attributes::default()).unwrap();
    write(folder.path(), &[("a.vts", "7\n0\n3\n")]);
    let with = |correspondence| ShapeEntry {
        name: "a".into(),
        mesh: registration.clone(),
        group: "g".into(),
        correspondence,
        split: Split::Train,
        whole: None,
    };
    for correspondence in [
        Correspondence::Identity,
        Correspondence::First(5),
        Correspondence::Vts(folder.path().join("a.vts")),
        Correspondence::NearestTo(registration.clone()),
    ] {
        let entry = with(correspondence);
        let (vertices, points) = (entry.points(&mesh).unwrap(), entry.surface_points(&mesh).unwrap());
        assert_eq!(vertices.len(), points.len());
        for (&vertex, point) in vertices.iter().zip(points) {
            match point {
                None => assert_eq!(vertex, MISSING),
                Some(point) => assert_eq!(point.position(&mesh), mesh.vertices()[vertex as usize]),
            }
        }
    }
    // A scan that is turned against its registration by a fraction of an edge: its surface is nearer than its vertices.
    let scan = transformed(&mesh, fmnet::mesh::shapes::rotation([0.0, 0.0, 1.0], 0.1), 1.0, [0.0; 3]);
    let points = with(Correspondence::NearestTo(registration.clone())).surface_points(&scan).unwrap();
    for (&p, point) in mesh.vertices().iter().zip(points) {
        let distance = fmnet::mesh::vec3::distance(p, point.unwrap().position(&scan));
        assert!(distance < 0.03, "{distance}");
    }
    // A vertex of no triangle is on no surface.
    let (_folder, dataset) = with_surface_points("");
    let lone =
        Mesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0; 3]], vec![[0, 1, 2]]).unwrap();
    let identity = ShapeEntry { correspondence: Correspondence::Identity, ..dataset.shapes[0].clone() };
    assert_eq!(identity.surface_points(&lone).unwrap()[3], None);
}

#[test]
fn meshes_that_only_look_like_a_dataset_do_not_correspond() {
    let folder = tempfile::tempdir().unwrap();
    for (name, mesh) in [("part1.off", icosphere(1)), ("part2.off", icosphere(2)), ("lid1.off", icosphere(0))]
    {
        write_mesh(&folder.path().join(name), &mesh, &Attributes::default()).unwrap();
    }
    let dataset = Dataset::open(folder.path()).unwrap();
    assert_eq!(dataset.layout, "TOSCA");
    let counted = |shape| (shape, points(shape).unwrap().len());
    let error = check_groups(dataset.shapes.iter().map(counted)).unwrap_err().to_string();
    assert!(error.contains("part2.off: 162 points, but ") && error.contains("'part', has 42"), "{error}");
    check_groups(dataset.shapes.iter().filter(|shape| shape.name != "part2").map(counted)).unwrap();
}
