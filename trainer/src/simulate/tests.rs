//! Simulated scans and parts on small closed shapes.

use super::*;
use crate::dataset::{Dataset, MISSING, ShapeEntry, Split};
use fmnet::Mesh;
use fmnet::io::{Attributes, write_mesh};
use fmnet::mesh::shapes::{bumpy_sphere, open_half_sphere, transformed};
use fmnet::mesh::{Topology, nearest_vertices, vec3};
use std::collections::BTreeSet;
use std::path::Path;

/// A shape in pose number `pose`.
fn shape(pose: usize) -> Mesh {
    let stretch = [[1.0 + 0.1 * pose as f64, 0.0, 0.0], [0.0, 1.0, 0.05 * pose as f64], [0.0, 0.0, 1.0]];
    transformed(&bumpy_sphere(3, 1), stretch, 1.0, [0.0; 3])
}

fn scan_options() -> ScanOptions {
    ScanOptions { vertices: 900, detail: 0.015, ..ScanOptions::default() }
}

/// As the registration, but for the triangulation.
fn unharmed() -> ScanOptions {
    ScanOptions { contact: 0.0, hidden: 0.0, holes: 0, noise: 0.0, pieces: 0, ..scan_options() }
}

fn folder_of(names: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (pose, name) in names.iter().enumerate() {
        write_mesh(&folder.path().join(name), &shape(pose), &Attributes::default()).unwrap();
    }
    folder
}

fn quiet(_: usize, _: usize, _: &str) {}

fn bytes(folder: &Path, file: &str) -> Vec<u8> {
    std::fs::read(folder.join(file)).unwrap()
}

#[test]
fn a_scan_has_the_surface_of_its_registration_and_other_vertices() {
    let registration = shape(0);
    let scan = simulate_scan(&registration, &unharmed(), 3).unwrap();
    let topology = Topology::new(&scan);
    assert!(topology.is_closed() && topology.is_manifold());
    assert_eq!((scan.n_vertices(), topology.euler_characteristic()), (900, 2));
    assert!((scan.area() / registration.area() - 1.0).abs() < 0.02);
    // As far as two samplings of one surface: within half an edge, never at the same place.
    let nearest = nearest_vertices(registration.vertices(), scan.vertices());
    for (&p, v) in scan.vertices().iter().zip(nearest) {
        let distance = vec3::distance(p, registration.vertices()[v as usize]) / registration.scale();
        assert!(distance < 0.05 && distance > 1e-9, "{distance}");
    }
}

#[test]
fn scans_depend_on_seed_and_number_but_not_on_size() {
    let registration = shape(0);
    let scan = |mesh: &Mesh, seed, index| {
        simulate_scan(mesh, &ScanOptions { seed, ..scan_options() }, index).unwrap()
    };
    let first = scan(&registration, 0, 0);
    assert_eq!(first, scan(&registration, 0, 0));
    assert_ne!(first, scan(&registration, 0, 1));
    assert_ne!(first, scan(&registration, 1, 0));
    // A power of two scales without rounding.
    let straight = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let large = scan(&transformed(&registration, straight, 64.0, [0.0; 3]), 0, 0);
    assert_eq!(large, transformed(&first, straight, 64.0, [0.0; 3]));
}

#[test]
fn damage_is_what_the_options_say() {
    let registration = shape(0);
    let scan = |options: ScanOptions| simulate_scan(&registration, &options, 0).unwrap();
    let whole = scan(unharmed());
    let open = |mesh: &Mesh| Topology::new(mesh).boundary_edges().len();
    let components = |mesh: &Mesh| Topology::new(mesh).components().count;

    let hidden = scan(ScanOptions { hidden: 1.0, up: Axis::Z, ..unharmed() });
    let bottom = |mesh: &Mesh| mesh.vertices().iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    assert!(open(&hidden) > 0 && bottom(&hidden) > bottom(&whole), "the cameras do not see the bottom");

    let noisy = scan(ScanOptions { noise: 1e-3, ..unharmed() });
    let square = |(p, q): (&[f64; 3], &[f64; 3])| vec3::distance(*p, *q).powi(2);
    let sum: f64 = whole.vertices().iter().zip(noisy.vertices()).map(square).sum();
    let deviation = (sum / whole.n_vertices() as f64).sqrt() / registration.scale();
    assert!((deviation - 1e-3).abs() < 1e-9, "{deviation}");

    let holes: usize = (0..4)
        .map(|i| open(&simulate_scan(&registration, &ScanOptions { holes: 5, ..unharmed() }, i).unwrap()))
        .sum();
    assert!(holes > 0);
    // Pieces are small: a coarse scan has no triangle that fits in one.
    let fine = ScanOptions { pieces: 5, vertices: 9000, detail: 0.008, ..unharmed() };
    let stray: usize = (0..4).map(|i| components(&simulate_scan(&registration, &fine, i).unwrap())).sum();
    assert!(stray > 4 && components(&whole) == 1);
}

#[test]
fn what_cannot_be_scanned_is_said() {
    let open = simulate_scan(&open_half_sphere(2), &scan_options(), 0).unwrap_err();
    assert!(matches!(open, SimulateError::NotClosed { faces: 1, .. }), "{open}");
    let none = simulate_scan(&Mesh::default(), &scan_options(), 0).unwrap_err();
    assert!(matches!(none, SimulateError::Empty), "{none}");
    let options = ScanOptions { noise: 0.5, ..scan_options() };
    assert!(
        simulate_scan(&shape(0), &options, 0).unwrap_err().to_string().starts_with("option noise is 0.5")
    );
}

#[test]
fn parts_are_connected_and_of_the_wanted_size() {
    let whole = shape(0);
    let options = PartOptions { min_area: 0.4, max_area: 0.6, ..PartOptions::default() };
    for kind in [PartKind::Holes, PartKind::Cuts] {
        let mut shares = BTreeSet::new();
        for index in 0..8 {
            let part = cut_part(&whole, kind, &options, index).unwrap();
            let share = part.mesh.area() / whole.area();
            assert!((0.4..=0.6).contains(&share), "{kind:?} {index}: {share}");
            shares.insert((1e9 * share) as u64);
            assert_eq!(Topology::new(&part.mesh).components().count, 1);
            for (&p, &origin) in part.mesh.vertices().iter().zip(&part.origin) {
                assert_eq!(p, whole.vertices()[origin as usize]);
            }
            assert_eq!(part, cut_part(&whole, kind, &options, index).unwrap());
        }
        assert_eq!(shares.len(), 8, "every part is another one");
    }
    let narrow = PartOptions { min_area: 0.5, max_area: 0.4, ..options };
    assert!(
        cut_part(&whole, PartKind::Cuts, &narrow, 0).unwrap_err().to_string().starts_with("option max-area")
    );
}

#[test]
fn written_scans_are_read_as_faust_scans() {
    let data = folder_of(&["tr_reg_000.ply", "tr_reg_059.ply", "tr_reg_060.ply", "tr_reg_085.ply"]);
    let out = tempfile::tempdir().unwrap();
    let dataset = Dataset::open(data.path()).unwrap();
    let splits = [Split::Train, Split::Validation];
    assert_eq!(write_scans(&dataset, &splits, out.path(), &scan_options(), &quiet).unwrap(), 3);
    let scans = Dataset::open(out.path()).unwrap();
    assert_eq!(scans.layout, "FAUST scans");
    let found: Vec<(&str, Split)> = scans.shapes.iter().map(|s| (s.name.as_str(), s.split)).collect();
    let expected =
        [("tr_scan_000", Split::Train), ("tr_scan_059", Split::Train), ("tr_scan_060", Split::Validation)];
    assert_eq!(found, expected);
    for (pose, scan) in scans.shapes.iter().enumerate() {
        let (mesh, registration) = (scan.read().unwrap(), shape(pose));
        let points = scan.points(&mesh).unwrap();
        assert_eq!(points.len(), registration.n_vertices());
        let near = |(&p, &v): (&[f64; 3], &u32)| {
            v == MISSING || vec3::distance(p, mesh.vertices()[v as usize]) < 0.04 * registration.scale()
        };
        assert!(registration.vertices().iter().zip(&points).all(near));
        let there = points.iter().filter(|&&v| v != MISSING).count();
        assert!(there * 3 > points.len() * 2, "{there} of {} points", points.len());
    }

    // An interrupted run goes on; another one does not mix with it.
    let before = bytes(out.path(), "scans/tr_scan_059.ply");
    std::fs::remove_file(out.path().join("scans/tr_scan_059.ply")).unwrap();
    write_scans(&dataset, &splits, out.path(), &scan_options(), &quiet).unwrap();
    assert_eq!(bytes(out.path(), "scans/tr_scan_059.ply"), before);
    let other = ScanOptions { seed: 7, ..scan_options() };
    let error = write_scans(&dataset, &splits, out.path(), &other, &quiet).unwrap_err();
    assert!(error.to_string().contains("simulation.toml"), "{error}");
}

#[test]
fn scans_of_other_datasets_keep_their_split() {
    let data = folder_of(&["mesh000.off", "mesh001.off", "mesh060.off"]);
    let dataset = Dataset::open(data.path()).unwrap();
    let out = tempfile::tempdir().unwrap();
    write_scans(&dataset, &[Split::Train, Split::Test], out.path(), &scan_options(), &quiet).unwrap();
    let scans = Dataset::open(out.path()).unwrap();
    let found: Vec<(&str, Split)> = scans.shapes.iter().map(|s| (s.name.as_str(), s.split)).collect();
    let expected =
        [("tr_scan_000", Split::Train), ("tr_scan_001", Split::Train), ("tr_scan_080", Split::Test)];
    assert_eq!(found, expected);

    let mixed = folder_of(&["cat0.off", "dog0.off"]);
    let mixed = Dataset::open(mixed.path()).unwrap();
    let error = write_scans(&mixed, &[Split::Train], out.path(), &scan_options(), &quiet).unwrap_err();
    assert!(error.to_string().contains("cat0 and dog0"), "{error}");
}

#[test]
fn written_parts_are_read_as_shrec16() {
    let data = folder_of(&["dog0.off", "dog1.off", "dog2.off", "dog3.off"]);
    let out = tempfile::tempdir().unwrap();
    let options = PartOptions { test_parts: 3, ..PartOptions::default() };
    let dataset = Dataset::open(data.path()).unwrap();
    assert_eq!(write_parts(&dataset, out.path(), &options, &quiet).unwrap(), 26);
    let parts = Dataset::open(out.path()).unwrap();
    assert_eq!((parts.layout, parts.shapes.len()), ("SHREC'16 partial", 27));
    let pose_of = |mesh: &Mesh| {
        (0..4).find(|&pose| {
            let whole = shape(pose);
            mesh.vertices().iter().all(|p| whole.vertices().contains(p))
        })
    };
    for part in parts.shapes.iter().filter(|s| s.is_part()) {
        let mesh = part.read().unwrap();
        let pose = pose_of(&mesh).unwrap();
        let expected = if part.split == Split::Train { 1..3 } else { 3..4 };
        assert!(expected.contains(&pose), "{} is of pose {pose}", part.name);
        let points = part.points(&mesh).unwrap();
        assert_eq!(points.len(), shape(0).n_vertices());
        let found = points.iter().enumerate().filter(|(_, v)| **v != MISSING);
        assert_eq!(found.clone().count(), mesh.n_vertices());
        for (point, &vertex) in found {
            assert_eq!(mesh.vertices()[vertex as usize], shape(pose).vertices()[point]);
        }
    }
    for kind in ["holes", "cuts"] {
        let of_kind = || parts.shapes.iter().filter(|s| s.name.starts_with(kind));
        assert_eq!(of_kind().filter(|s| s.split == Split::Train).count(), 10);
        assert_eq!(of_kind().filter(|s| s.split == Split::Test).count(), 3);
    }
    let whole = parts.shapes.iter().find(|s| !s.is_part()).unwrap();
    assert_eq!((whole.name.as_str(), whole.read().unwrap()), ("dog", shape(0)));

    let few = folder_of(&["cat0.off", "cat1.off"]);
    let few = Dataset::open(few.path()).unwrap();
    let error = write_parts(&few, &out.path().join("few"), &options, &quiet).unwrap_err();
    assert!(error.to_string().contains("class cat has 2 shapes"), "{error}");
}

#[test]
fn parts_of_other_triangulations_keep_the_points_that_they_have() {
    let data = folder_of(&["cat0.off", "cat4.off"]);
    let (triangulated, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let splits = [Split::Train, Split::Validation];
    let dataset = Dataset::open(data.path()).unwrap();
    write_triangulations(&dataset, &splits, triangulated.path(), &triangulation_options(), &quiet).unwrap();
    let dataset = Dataset::open(triangulated.path()).unwrap();
    assert_eq!(write_parts(&dataset, out.path(), &PartOptions::default(), &quiet).unwrap(), 4);
    let written = Dataset::open(out.path()).unwrap();
    let names: Vec<&str> = written.shapes.iter().map(|shape| shape.name.as_str()).collect();
    assert_eq!(names, ["cat0", "cat0_cuts", "cat0_holes", "cat4", "cat4_cuts", "cat4_holes"]);
    let positions = |entry: &ShapeEntry| {
        let mesh = entry.read().unwrap();
        let points = entry.surface_points(&mesh).unwrap();
        (mesh.area(), points.iter().map(|point| point.map(|p| p.position(&mesh))).collect::<Vec<_>>())
    };
    for (number, entry) in written.shapes.iter().enumerate() {
        let whole = &written.shapes[number / 3 * 3];
        let ((area, found), (whole_area, all)) = (positions(entry), positions(whole));
        assert_eq!((entry.is_part(), entry.split, &entry.group), (number % 3 > 0, whole.split, &whole.group));
        if entry.is_part() {
            let share = area / whole_area;
            let kept = found.iter().flatten().count() as f64 / all.iter().flatten().count() as f64;
            assert!((0.3..0.9).contains(&share) && (kept - share).abs() < 0.15, "{share} {kept}");
            assert!((entry.whole_area().unwrap().unwrap() / whole_area - 1.0).abs() < 1e-6);
        }
        assert!(std::iter::zip(&found, &all).all(|(point, of_whole)| point.is_none() || point == of_whole));
    }

    // Parts are not cut again.
    let again = tempfile::tempdir().unwrap();
    let large = tempfile::tempdir().unwrap();
    let options = PartOptions { min_vertices: 1_000_000, ..PartOptions::default() };
    assert_eq!(write_parts(&dataset, large.path(), &options, &quiet).unwrap(), 0);
    assert!(Dataset::open(large.path()).unwrap().shapes.iter().all(|shape| !shape.is_part()));
    assert_eq!(write_parts(&written, again.path(), &PartOptions::default(), &quiet).unwrap(), 4);
}

fn triangulation_options() -> TriangulationOptions {
    TriangulationOptions {
        min_vertices: 400,
        typical_vertices: 500,
        max_vertices: 600,
        landmarks: 100,
        ..TriangulationOptions::default()
    }
}

#[test]
fn written_triangulations_keep_groups_splits_and_points() {
    let data = folder_of(&["cat0.off", "cat4.off", "dog1.off"]);
    let out = tempfile::tempdir().unwrap();
    let dataset = Dataset::open(data.path()).unwrap();
    let splits = [Split::Train, Split::Validation];
    let options = TriangulationOptions { copies: 2, ..triangulation_options() };
    assert_eq!(write_triangulations(&dataset, &splits, out.path(), &options, &quiet).unwrap(), 6);
    let written = Dataset::open(out.path()).unwrap();
    let found: Vec<(&str, &str, Split)> =
        written.shapes.iter().map(|s| (s.name.as_str(), s.group.as_str(), s.split)).collect();
    let (train, validation) = (Split::Train, Split::Validation);
    let expected = [
        ("cat0_0", "cat", train),
        ("cat0_1", "cat", train),
        ("cat4_0", "cat", validation),
        ("cat4_1", "cat", validation),
        ("dog1_0", "dog", train),
        ("dog1_1", "dog", train),
    ];
    assert_eq!(found, expected);
    // The landmarks are the same of all shapes of a group: each lies near the same vertex of every pose.
    let mut vertices: Vec<Option<u32>> = vec![None; 100];
    for (pose, entry) in [0, 0, 1, 1].into_iter().zip(&written.shapes) {
        let (mesh, whole) = (entry.read().unwrap(), shape(pose));
        let points = entry.surface_points(&mesh).unwrap();
        assert_eq!(points.len(), 100);
        assert!(points.iter().flatten().count() > 40, "{}", entry.name);
        for (known, point) in vertices.iter_mut().zip(points) {
            let Some(p) = point.map(|p| p.position(&mesh)) else { continue };
            match *known {
                None => *known = Some(nearest_vertices(whole.vertices(), &[p])[0]),
                Some(vertex) => {
                    let distance = vec3::distance(p, whole.vertices()[vertex as usize]) / whole.scale();
                    assert!(distance < 0.1, "{}: {distance}", entry.name);
                }
            }
        }
    }

    // An interrupted run goes on; another one does not mix with it.
    let files = ["shapes/cat4_1.ply", "shapes/cat4_1.corr", "dataset.toml"];
    let before = files.map(|file| bytes(out.path(), file));
    files.iter().for_each(|file| std::fs::remove_file(out.path().join(file)).unwrap());
    write_triangulations(&dataset, &splits, out.path(), &options, &quiet).unwrap();
    assert_eq!(files.map(|file| bytes(out.path(), file)), before);
    let other = TriangulationOptions { seed: 7, ..options };
    let error = write_triangulations(&dataset, &splits, out.path(), &other, &quiet).unwrap_err();
    assert!(error.to_string().contains("simulation.toml"), "{error}");
}

#[test]
fn triangulations_can_be_triangulated_again() {
    let data = folder_of(&["cat0.off", "cat1.off"]);
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let options = triangulation_options();
    let write = |from: &Path, to: &Path, seed| {
        let options = TriangulationOptions { seed, ..options.clone() };
        write_triangulations(&Dataset::open(from).unwrap(), &[Split::Train], to, &options, &quiet)
    };
    assert_eq!(write(data.path(), first.path(), 0).unwrap(), 2);
    assert_eq!(write(first.path(), second.path(), 1).unwrap(), 2);
    let again = &Dataset::open(second.path()).unwrap().shapes[0];
    assert_eq!(again.surface_points(&again.read().unwrap()).unwrap().len(), 100);

    // Shapes of one group must have the same points.
    let unlike = tempfile::tempdir().unwrap();
    write_mesh(&unlike.path().join("cat0.off"), &shape(0), &Attributes::default()).unwrap();
    write_mesh(&unlike.path().join("cat1.off"), &bumpy_sphere(2, 1), &Attributes::default()).unwrap();
    let error = write(unlike.path(), &unlike.path().join("out"), 0).unwrap_err().to_string();
    assert!(error.contains("cat1") && error.contains("162 points, but cat0"), "{error}");
    let none = write_triangulations(
        &Dataset::open(data.path()).unwrap(),
        &[Split::Test],
        &data.path().join("out"),
        &options,
        &quiet,
    );
    assert!(none.unwrap_err().to_string().contains("no shapes in these splits"));
}
