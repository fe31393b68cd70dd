use super::*;
use crate::mesh::{Topology, shapes, test_data, vec3};
use proptest::prelude::*;

fn repaired(mesh: &Mesh) -> Repaired {
    repair(mesh, &RepairOptions::default()).unwrap()
}

/// What holds for the repair of any mesh.
fn check(name: &str, input: &Mesh, result: &Repaired) {
    let (mesh, report) = (&result.mesh, &result.report);
    let topology = Topology::new(mesh);
    assert!(topology.is_manifold(), "{name}");
    assert_eq!(topology.inconsistent_edges().len(), report.unorientable_edges, "{name}");
    assert!(topology.components().of_vertex.iter().all(|&c| c != NONE), "{name}: unreferenced vertex");
    let diagonal = input.diagonal();
    for f in 0..mesh.n_faces() {
        assert!(!crate::mesh::geometry::is_degenerate(mesh.corners(f), diagonal), "{name}: face {f}");
    }
    assert_eq!(result.repaired_of_input.len(), input.n_vertices(), "{name}");
    assert_eq!(result.input_of_repaired.len(), mesh.n_vertices(), "{name}");
    for (r, &i) in result.input_of_repaired.iter().enumerate() {
        assert_eq!(mesh.vertices()[r], input.vertices()[i as usize], "{name}");
        assert!(
            result.repaired_of_input[i as usize].is_some(),
            "{name}: vertex {i} is there but has no match"
        );
    }
    for (i, r) in result.repaired_of_input.iter().enumerate() {
        if let &Some(r) = r {
            assert_eq!(mesh.vertices()[r as usize], input.vertices()[i], "{name}: vertex {i}");
        }
    }
    assert!(result.input_of_repaired.is_sorted(), "{name}");
}

fn is_identity(result: &Repaired) -> bool {
    result.repaired_of_input.iter().enumerate().all(|(i, &r)| r == Some(i as u32))
        && result.input_of_repaired.iter().enumerate().all(|(i, &r)| r == i as u32)
}

#[test]
fn zoo_becomes_manifold_and_maps_are_consistent() {
    for (name, mesh) in shapes::zoo() {
        check(name, &mesh, &repaired(&mesh));
    }
}

#[test]
fn clean_meshes_come_back_bit_for_bit() {
    for (name, mesh) in shapes::zoo() {
        let clean = ["icosphere", "grid", "torus", "bumpy_sphere", "open_half_sphere", "two_components"];
        let result = repaired(&mesh);
        assert_eq!(result.report.is_unchanged(), clean.contains(&name), "{name}: {}", result.report);
        if clean.contains(&name) {
            assert_eq!(result.mesh, mesh, "{name}");
            assert!(is_identity(&result), "{name}");
        }
    }
}

#[test]
fn repair_is_idempotent() {
    for (name, mesh) in shapes::zoo() {
        let once = repaired(&mesh);
        let twice = repaired(&once.mesh);
        assert_eq!(once.mesh, twice.mesh, "{name}");
        assert!(is_identity(&twice) && twice.report.is_unchanged(), "{name}");
    }
}

#[test]
fn defects_of_the_zoo_are_repaired_as_counted() {
    let report = |mesh: Mesh| repaired(&mesh).report;
    let none = RepairReport::default;
    assert_eq!(report(shapes::bowtie_vertex()), RepairReport { cut_vertices: 1, ..none() });
    // The third sheet goes with copies of all five vertices on the common line; one of the two that stay is turned to
    // fit the other.
    assert_eq!(
        report(shapes::non_manifold_edge()),
        RepairReport { cut_vertices: 5, flipped_faces: 32, ..none() }
    );
    assert_eq!(
        report(shapes::with_degenerate_faces()),
        RepairReport { degenerate_faces: 3, dropped_vertices: 1, ..none() }
    );
    assert_eq!(
        report(shapes::with_duplicates()),
        RepairReport { duplicate_faces: 2, welded_vertices: 16, ..none() }
    );
    assert_eq!(
        report(shapes::with_unreferenced_vertices()),
        RepairReport { unmatched_vertices: 3, ..none() }
    );
    assert_eq!(report(shapes::flipped_faces()), RepairReport { flipped_faces: 80, ..none() });
    assert_eq!(report(shapes::triangle_soup()), RepairReport { welded_vertices: 960 - 162, ..none() });
}

#[test]
fn soup_and_halves_become_the_sphere() {
    for mesh in [shapes::triangle_soup(), shapes::with_duplicates(), shapes::flipped_faces()] {
        let result = repaired(&mesh).mesh;
        let topology = Topology::new(&result);
        assert!(topology.is_closed());
        assert_eq!((topology.euler_characteristic(), topology.components().count), (2, 1));
        assert!((0..result.n_faces()).all(|f| vec3::dot(result.face_cross(f), result.corners(f)[0]) > 0.0));
    }
}

#[test]
fn without_welding_vertices_at_one_position_stay_apart() {
    let options = RepairOptions { weld: false, min_component_area: 0.0 };
    let soup = shapes::triangle_soup();
    let result = repair(&soup, &options).unwrap();
    assert_eq!(result.mesh, soup);
}

#[test]
fn bowtie_keeps_the_vertex_on_the_larger_sphere() {
    let result = repaired(&shapes::bowtie_vertex());
    let fan = |v: u32| -> f64 {
        let faces = result.mesh.faces().iter().enumerate().filter(|(_, face)| face.contains(&v));
        faces.map(|(f, _)| result.mesh.face_area(f)).sum()
    };
    let copies: Vec<u32> =
        (0..result.mesh.n_vertices() as u32).filter(|&v| result.input_of_repaired[v as usize] == 0).collect();
    let kept = result.repaired_of_input[0].unwrap();
    assert_eq!(copies.len(), 2);
    assert!(copies.iter().all(|&c| fan(c) <= fan(kept)));
}

#[test]
fn spheres_that_touch_in_welded_places_stay_two() {
    // Two cubes' worth of contact: a shared face between closed surfaces would be lost as a duplicate, a shared
    // vertex not.
    let sphere = shapes::icosphere(1);
    let contact = sphere.vertices()[0];
    let identity = shapes::rotation([0.0, 0.0, 1.0], 0.0);
    let opposite = sphere.vertices().iter().position(|&p| p == contact.map(|x| -x)).unwrap();
    let moved = shapes::transformed(&sphere, identity, 1.0, vec3::sub(contact, sphere.vertices()[opposite]));
    let result = repaired(&shapes::joined(&[&sphere, &moved]));
    assert!(is_identity(&result));
}

#[test]
fn inside_out_closed_surfaces_are_turned_round_and_open_ones_kept() {
    let reversed = |mesh: &Mesh| {
        let faces = mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
        Mesh::new(mesh.vertices().to_vec(), faces).unwrap()
    };
    let sphere = shapes::bumpy_sphere(2, 3);
    assert_eq!(repaired(&reversed(&sphere)).mesh, sphere);
    let mut punctured = sphere.faces().to_vec();
    punctured.swap_remove(17);
    let punctured = Mesh::new(sphere.vertices().to_vec(), punctured).unwrap();
    assert_eq!(repaired(&reversed(&punctured)).mesh, punctured);
    let sheet = reversed(&shapes::grid(3, 3));
    assert_eq!(repaired(&sheet).mesh, sheet);
}

#[test]
fn a_moebius_strip_is_left_with_a_seam() {
    let n = 12u32;
    let at = |i: u32, side: u32| if i < n { 2 * i + side } else { 1 - side };
    let vertices = (0..n).flat_map(|i| {
        let t = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        [-0.3, 0.3].map(|w: f64| {
            let r = 1.0 + w * (t / 2.0).cos();
            [r * t.cos(), r * t.sin(), w * (t / 2.0).sin()]
        })
    });
    let faces =
        (0..n).flat_map(|i| [[at(i, 0), at(i + 1, 0), at(i + 1, 1)], [at(i, 0), at(i + 1, 1), at(i, 1)]]);
    let mesh = Mesh::new(vertices.collect(), faces.collect()).unwrap();
    let result = repaired(&mesh);
    check("moebius", &mesh, &result);
    assert_eq!(result.report.unorientable_edges, 1);
    assert_eq!(Topology::new(&result.mesh).euler_characteristic(), 0);
}

#[test]
fn tiny_components_go_and_their_vertices_are_named() {
    let sphere = shapes::icosphere(2);
    let crumb = shapes::transformed(
        &shapes::icosphere(0),
        shapes::rotation([1.0, 0.0, 0.0], 0.1),
        0.02,
        [3.0, 0.0, 0.0],
    );
    let mesh = shapes::joined(&[&crumb, &sphere]);
    let result = repaired(&mesh);
    assert_eq!(result.mesh, sphere);
    assert_eq!((result.report.dropped_components, result.report.dropped_vertices), (1, 12));
    assert_eq!((result.report.unmatched_vertices, result.dropped_vertices), (0, (0..12).collect()));
    let keep_all = RepairOptions { min_component_area: 0.0, ..RepairOptions::default() };
    assert_eq!(repair(&mesh, &keep_all).unwrap().mesh, mesh);
}

#[test]
fn repair_does_not_depend_on_scale_and_place() {
    for (name, mesh) in shapes::zoo() {
        let moved = shapes::transformed(&mesh, shapes::rotation([1.0, 1.0, 0.0], 1.0), 1e-4, [0.0; 3]);
        let (a, b) = (repaired(&mesh), repaired(&moved));
        assert_eq!(
            (a.mesh.faces(), a.repaired_of_input, a.report),
            (b.mesh.faces(), b.repaired_of_input, b.report),
            "{name}"
        );
    }
}

#[test]
fn real_meshes_become_manifold_and_keep_nearly_all_vertices() {
    let scans = (0..20).map(|i| format!("faust/scans_7k/test_scan_{i:03}.off"));
    let others = [
        "scape/mesh000.off",
        "scape/mesh003.off",
        "tosca/dog/dog3.off",
        "faust/registrations/tr_reg_000.ply",
    ];
    for path in scans.chain(others.map(String::from)) {
        let Some(mesh) = test_data::load(&path) else { return };
        let once = repaired(&mesh);
        check(&path, &mesh, &once);
        assert!(once.report.unmatched_vertices < mesh.n_vertices() / 100, "{path}: {}", once.report);
        assert!((once.mesh.area() / mesh.area() - 1.0).abs() < 0.01, "{path}");
        assert_eq!(Topology::new(&once.mesh).components().count, 1, "{path}");
        let twice = repaired(&once.mesh);
        assert_eq!(twice.mesh, once.mesh, "{path}");
        assert!(is_identity(&twice) && twice.report.is_unchanged(), "{path}");
    }
}

#[test]
fn hopeless_input_is_an_error() {
    let options = RepairOptions::default();
    let points = Mesh::new(vec![[0.0; 3]; 4], vec![]).unwrap();
    assert_eq!(repair(&points, &options), Err(RepairError::NoFaces { n_vertices: 4 }));
    let line =
        Mesh::new((0..4).map(|i| [f64::from(i), 0.0, 0.0]).collect(), vec![[0, 1, 2], [1, 2, 3]]).unwrap();
    assert!(matches!(repair(&line, &options), Err(RepairError::NoArea { n_faces: 2, .. })));
    let bad = RepairOptions { min_component_area: f64::NAN, ..options };
    assert!(matches!(repair(&line, &bad), Err(RepairError::MinComponentArea { .. })));
}

prop_compose! {
    /// Triangles at random among few vertices at few positions: every defect at once.
    fn any_soup()(n in 1usize..24)(
        positions in prop::collection::vec(prop::array::uniform3(0..4i32), n),
        faces in prop::collection::vec(prop::array::uniform3(0..n as u32), 0..60),
    ) -> Mesh {
        Mesh::new(positions.into_iter().map(|p| p.map(f64::from)).collect(), faces).unwrap()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_soup_becomes_manifold_or_an_error(mesh in any_soup(), weld: bool) {
        let options = RepairOptions { weld, ..RepairOptions::default() };
        if let Ok(result) = repair(&mesh, &options) {
            check("soup", &mesh, &result);
            let again = repair(&result.mesh, &options).unwrap();
            check("soup, repaired", &result.mesh, &again);
        } else {
            let diagonal = mesh.diagonal();
            prop_assert!((0..mesh.n_faces()).all(|f| crate::mesh::geometry::is_degenerate(mesh.corners(f), diagonal)));
        }
    }
}
