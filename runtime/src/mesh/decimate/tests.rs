use super::*;
use crate::mesh::{RepairOptions, repair, sampling::farthest_point_sampling, shapes, test_data, vec3};
use std::collections::BTreeSet;

fn decimated(mesh: &Mesh, target: usize) -> Decimated {
    decimate(mesh, target, &DecimateOptions::default()).unwrap()
}

fn clean_zoo() -> Vec<(&'static str, Mesh)> {
    let clean = |mesh: Mesh| repair(&mesh, &RepairOptions::default()).unwrap().mesh;
    shapes::zoo().into_iter().map(|(name, mesh)| (name, clean(mesh))).collect()
}

/// What holds for the decimation of any manifold mesh.
fn check(name: &str, full: &Mesh, result: &Decimated) {
    let mesh = &result.mesh;
    assert!(result.injection.is_sorted_by(|a, b| a < b), "{name}");
    assert_eq!(result.injection.len(), mesh.n_vertices(), "{name}");
    for (v, &f) in result.injection.iter().enumerate() {
        assert_eq!(mesh.vertices()[v], full.vertices()[f as usize], "{name}");
    }
    let (before, after) = (Topology::new(full), Topology::new(mesh));
    assert!(after.is_manifold(), "{name}");
    assert!(after.inconsistent_edges().is_empty(), "{name}");
    assert_eq!(after.euler_characteristic(), before.euler_characteristic(), "{name}");
    assert_eq!(after.components().count, before.components().count, "{name}");
    assert_eq!(after.boundary_loops().len(), before.boundary_loops().len(), "{name}");
    assert!(after.components().of_vertex.iter().all(|&c| c != NONE), "{name}: unreferenced vertex");
    let ends = |t: &Topology| -> BTreeSet<u32> {
        t.boundary_edges().iter().flat_map(|&e| t.edges()[e as usize]).collect()
    };
    let boundary_before = ends(&before);
    for v in ends(&after) {
        assert!(boundary_before.contains(&result.injection[v as usize]), "{name}: boundary vertex {v}");
    }
    let diagonal = full.diagonal();
    for f in 0..mesh.n_faces() {
        assert!(!crate::mesh::geometry::is_degenerate(mesh.corners(f), diagonal), "{name}: face {f}");
    }
}

#[test]
fn zoo_reaches_the_target_with_its_topology() {
    for (name, mesh) in clean_zoo() {
        for divisor in [2, 4, 8] {
            let target = mesh.n_vertices() / divisor;
            let result = decimated(&mesh, target);
            check(name, &mesh, &result);
            assert_eq!(result.mesh.n_vertices(), target, "{name}");
        }
    }
}

#[test]
fn topology_is_kept_to_the_very_end() {
    for (name, mesh) in clean_zoo() {
        let result = decimated(&mesh, 4);
        check(name, &mesh, &result);
        let least = match name {
            "torus" => 7,
            "grid" | "open_half_sphere" => 4,
            "two_components" | "bowtie_vertex" => 8,
            "non_manifold_edge" => 6,
            _ => 4,
        };
        assert!(result.mesh.n_vertices() <= least + 4, "{name}: {} left", result.mesh.n_vertices());
    }
}

#[test]
fn small_meshes_come_back_unchanged() {
    let mesh = shapes::with_unreferenced_vertices();
    let result = decimated(&mesh, mesh.n_vertices());
    assert_eq!(result.mesh, mesh);
    assert!(result.injection.iter().enumerate().all(|(i, &v)| v == i as u32));
}

#[test]
fn unreferenced_vertices_are_dropped() {
    let mesh = shapes::with_unreferenced_vertices();
    let result = decimated(&mesh, mesh.n_vertices() - 1);
    assert_eq!(result.mesh.n_vertices(), 162);
    check("unreferenced", &mesh, &result);
}

#[test]
fn a_flat_square_keeps_its_outline() {
    let result = decimated(&shapes::grid(30, 30), 60);
    assert!((result.mesh.area() - 1.0).abs() < 1e-12);
}

#[test]
fn a_locked_boundary_keeps_all_its_vertices() {
    let mesh = shapes::open_half_sphere(4);
    let n_boundary = |m: &Mesh| Topology::new(m).boundary_edges().len();
    let options = DecimateOptions { lock_boundary: true, ..DecimateOptions::default() };
    let result = decimate(&mesh, 120, &options).unwrap();
    check("locked", &mesh, &result);
    assert_eq!((result.mesh.n_vertices(), n_boundary(&result.mesh)), (120, n_boundary(&mesh)));
    assert!(n_boundary(&decimated(&mesh, 120).mesh) < n_boundary(&mesh));
}

#[test]
fn the_surface_stays_close() {
    let mesh = shapes::bumpy_sphere(5, 3);
    let result = decimated(&mesh, 1000);
    assert!((result.mesh.area() / mesh.area() - 1.0).abs() < 0.01);
    // Every full vertex has a kept one within a few mean edge lengths: the vertices are spread over the surface.
    let spacing = (mesh.area() / 1000.0).sqrt();
    for v in farthest_point_sampling(&mesh, 300, 0) {
        let p = mesh.vertices()[v as usize];
        let nearest =
            result.mesh.vertices().iter().map(|&q| vec3::distance(p, q)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 2.0 * spacing, "vertex {v}: {nearest} against {spacing}");
    }
}

#[test]
fn result_does_not_depend_on_scale() {
    let mesh = shapes::bumpy_sphere(4, 3);
    let identity = shapes::rotation([1.0, 0.0, 0.0], 0.0);
    let scaled = shapes::transformed(&mesh, identity, 1024.0, [0.0; 3]);
    assert_eq!(decimated(&mesh, 500).injection, decimated(&scaled, 500).injection);
}

#[test]
fn bad_arguments_are_errors() {
    let mesh = shapes::icosphere(1);
    let options = DecimateOptions::default();
    assert_eq!(decimate(&mesh, 3, &options), Err(DecimateError::TargetTooSmall { target: 3 }));
    let uneven = DecimateOptions { evenness: -1.0, ..options.clone() };
    assert_eq!(decimate(&mesh, 20, &uneven), Err(DecimateError::Evenness { value: -1.0 }));
    let bowtie = shapes::bowtie_vertex();
    assert_eq!(decimate(&bowtie, 20, &options), Err(DecimateError::NotManifold { vertex: 0 }));
    let sheets = shapes::non_manifold_edge();
    assert!(matches!(decimate(&sheets, 20, &options), Err(DecimateError::NotManifold { vertex: 0..=4 })));
}

#[test]
fn real_meshes_reach_the_target_with_their_topology() {
    for path in [
        "faust/scans_7k/test_scan_000.off",
        "faust/scans_7k/test_scan_007.off",
        "faust/scans_7k/test_scan_014.off",
        "faust/scans_7k/test_scan_019.off",
        "scape/mesh003.off",
        "tosca/dog/dog3.off",
        "faust/remeshed_15k/tr_reg_060.off",
        "faust/registrations/tr_reg_000.ply",
    ] {
        let Some(mesh) = test_data::load(path) else { return };
        let mesh = repair(&mesh, &RepairOptions::default()).unwrap().mesh;
        for divisor in [2, 5, 20] {
            let target = mesh.n_vertices() / divisor;
            let result = decimated(&mesh, target);
            check(path, &mesh, &result);
            assert_eq!(result.mesh.n_vertices(), target, "{path}");
            let share = result.mesh.area() / mesh.area();
            assert!((share - 1.0).abs() < 0.03 * (divisor as f64).sqrt(), "{path} / {divisor}: area {share}");
        }
    }
}
