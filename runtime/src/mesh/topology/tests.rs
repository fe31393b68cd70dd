use super::super::shapes;
use super::*;
use std::collections::{BTreeMap, BTreeSet};

fn shape(name: &str) -> Mesh {
    shapes::zoo().into_iter().find(|(n, _)| *n == name).expect("a shape of the zoo").1
}

#[test]
fn edges_agree_with_a_map_of_all_sides() {
    for (name, mesh) in shapes::zoo() {
        let mut expected: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (f, face) in mesh.faces().iter().enumerate() {
            if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
                continue;
            }
            for c in 0..3 {
                let (i, j) = (face[c], face[(c + 1) % 3]);
                expected.entry([i.min(j), i.max(j)]).or_default().push((3 * f + c) as u32);
            }
        }
        let topology = Topology::new(&mesh);
        let found: BTreeMap<[u32; 2], Vec<u32>> = topology
            .edges()
            .iter()
            .enumerate()
            .map(|(e, &key)| (key, topology.half_edges(e).to_vec()))
            .collect();
        assert_eq!(found, expected, "{name}");
        assert!(topology.edges().is_sorted(), "{name}");
        for e in 0..topology.edges().len() {
            assert!(topology.half_edges(e).iter().all(|&h| topology.edge_of(h) == e as u32), "{name}");
        }
    }
}

#[test]
fn euler_characteristics() {
    for (name, expected) in [
        ("icosphere", 2),
        ("bumpy_sphere", 2),
        ("torus", 0),
        ("grid", 1),
        ("open_half_sphere", 1),
        ("two_components", 4),
        ("bowtie_vertex", 3),
        ("non_manifold_edge", 1),
        ("with_unreferenced_vertices", 2),
        ("triangle_soup", 320),
    ] {
        assert_eq!(Topology::new(&shape(name)).euler_characteristic(), expected, "{name}");
    }
}

#[test]
fn defects_are_found_where_they_are() {
    for (name, mesh) in shapes::zoo() {
        let topology = Topology::new(&mesh);
        let non_manifold_edges = match name {
            "non_manifold_edge" => 4,
            // The face without area on one edge; each of the two faces that occur twice has three edges of three faces,
            // or of two where the edge lies on the open equator.
            "with_degenerate_faces" => 1,
            "with_duplicates" => topology.non_manifold_edges().len(),
            _ => 0,
        };
        assert_eq!(topology.non_manifold_edges().len(), non_manifold_edges, "{name}");
        let expected: &[u32] = if name == "bowtie_vertex" { &[0] } else { &[] };
        assert_eq!(topology.non_manifold_vertices(), expected, "{name}");
        assert_eq!(!topology.inconsistent_edges().is_empty(), name == "flipped_faces", "{name}");
    }
    assert!(!Topology::new(&shape("with_duplicates")).non_manifold_edges().is_empty());
}

#[test]
fn flipped_faces_make_every_edge_to_a_face_as_it_was_inconsistent() {
    let mesh = shapes::flipped_faces();
    let topology = Topology::new(&mesh);
    let flipped = |h: u32| h / 3 % 4 == 1;
    let expected: Vec<u32> = (0..topology.edges().len() as u32)
        .filter(|&e| {
            let h = topology.half_edges(e as usize);
            flipped(h[0]) != flipped(h[1])
        })
        .collect();
    assert_eq!(topology.inconsistent_edges(), expected);
}

#[test]
fn components_are_the_separate_parts() {
    for (name, mesh) in shapes::zoo() {
        let components = Topology::new(&mesh).components();
        let expected = match name {
            "two_components" | "with_duplicates" => 2,
            "triangle_soup" => mesh.n_faces(),
            _ => 1,
        };
        assert_eq!(components.count, expected, "{name}");
        for face in mesh.faces().iter().filter(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0]) {
            let labels: BTreeSet<u32> = face.iter().map(|&i| components.of_vertex[i as usize]).collect();
            assert_eq!(labels.len(), 1, "{name}");
        }
    }
    let labels = Topology::new(&shapes::with_unreferenced_vertices()).components().of_vertex;
    assert_eq!((labels[0], labels[21], labels[164]), (NONE, NONE, NONE));
    assert_eq!(labels.iter().filter(|&&l| l == NONE).count(), 3);
}

#[test]
fn boundary_of_a_grid_is_its_rim_in_order() {
    let mesh = shapes::grid(3, 2);
    assert_eq!(Topology::new(&mesh).boundary_loops(), [vec![0, 1, 2, 3, 7, 11, 10, 9, 8, 4]]);
}

#[test]
fn boundary_loops_cover_the_boundary_edges() {
    for (name, mesh) in shapes::zoo() {
        let topology = Topology::new(&mesh);
        if !topology.non_manifold_edges().is_empty() {
            continue;
        }
        let loops = topology.boundary_loops();
        let mut covered: Vec<[u32; 2]> = loops
            .iter()
            .flat_map(|l| (0..l.len()).map(|i| (l[i], l[(i + 1) % l.len()])))
            .map(|(i, j)| [i.min(j), i.max(j)])
            .collect();
        covered.sort_unstable();
        let expected: Vec<[u32; 2]> =
            topology.boundary_edges().iter().map(|&e| topology.edges()[e as usize]).collect();
        assert_eq!(covered, expected, "{name}");
    }
}

#[test]
fn holes_that_touch_in_a_vertex_are_one_loop_that_passes_it_twice() {
    let mesh = shapes::grid(4, 4);
    // Cells (1, 1) and (2, 2) share the vertex in the middle.
    let faces: Vec<[u32; 3]> =
        (0..mesh.n_faces()).filter(|f| ![5, 10].contains(&(f / 2))).map(|f| mesh.faces()[f]).collect();
    let holed = Mesh::new(mesh.vertices().to_vec(), faces).unwrap();
    let topology = Topology::new(&holed);
    let mut lengths: Vec<usize> = topology.boundary_loops().iter().map(Vec::len).collect();
    lengths.sort_unstable();
    assert_eq!(lengths, [8, 16]);
    assert_eq!(topology.non_manifold_vertices(), [12]);
}

#[test]
fn a_loop_ends_at_a_non_manifold_edge() {
    let mesh = shapes::non_manifold_edge();
    assert_eq!(Topology::new(&mesh).boundary_loops().iter().map(|l| l.len()).sum::<usize>(), 3 * 13);
}

#[test]
fn adjacency_is_symmetric_and_sorted() {
    for (name, mesh) in shapes::zoo() {
        let topology = Topology::new(&mesh);
        let adjacency = topology.adjacency();
        assert_eq!(adjacency.neighbors.len(), 2 * topology.edges().len(), "{name}");
        for i in 0..mesh.n_vertices() {
            assert!(adjacency.of(i).is_sorted(), "{name}");
            for &j in adjacency.of(i) {
                assert!(adjacency.of(j as usize).contains(&(i as u32)), "{name}");
            }
        }
    }
}

#[test]
fn fans_of_a_manifold_mesh_are_its_vertices() {
    for mesh in [shapes::icosphere(2), shapes::grid(4, 3), shapes::two_components()] {
        let fans = Topology::new(&mesh).fans();
        assert_eq!(fans.vertex_of_fan, (0..mesh.n_vertices() as u32).collect::<Vec<_>>());
        assert_eq!(fans.of_corner, mesh.faces().as_flattened());
    }
}

#[test]
fn an_empty_mesh_has_no_topology_to_speak_of() {
    let mesh = Mesh::default();
    let topology = Topology::new(&mesh);
    assert_eq!(topology.euler_characteristic(), 0);
    assert_eq!(topology.components().count, 0);
    assert!(topology.boundary_loops().is_empty() && topology.is_manifold() && !topology.is_closed());
}
