//! What must hold whatever the input: repair, decimation, nearest neighbours, attribute transfer.

use fmnet::io::{Attributes, Joint, Skin, read_mesh, write_mesh};
use fmnet::mesh::shapes::{bumpy_sphere, grid, icosphere, permuted, torus};
use fmnet::mesh::{DecimateOptions, RepairOptions, decimate, nearest_vertices, repair};
use fmnet::point_map::PointMap;
use fmnet::point_map::search::nearest_rows;
use fmnet::render::{Donors, transfer_attributes, transfer_landmarks, transfer_values};
use fmnet::{Matrix, Mesh};
use proptest::collection::vec;
use proptest::prelude::*;

/// Surfaces of several kinds, their vertices in any order.
fn surface() -> impl Strategy<Value = Mesh> {
    let shape = prop_oneof![
        (2..4u32).prop_map(icosphere),
        (2..4u32, 0..9u64).prop_map(|(subdivisions, seed)| bumpy_sphere(subdivisions, seed)),
        (4..14usize, 4..14usize).prop_map(|(nx, ny)| grid(nx, ny)),
        (8..24usize, 6..12usize).prop_map(|(ring, tube)| torus(ring, tube, 0.3)),
    ];
    (shape, any::<u64>()).prop_map(|(mesh, seed)| permuted(&mesh, seed).0)
}

/// A surface with some of its faces missing, doubled or turned over.
fn damaged_surface() -> impl Strategy<Value = Mesh> {
    (surface(), vec(0..12u8, 64)).prop_map(|(mesh, fates)| {
        let fate = |(i, &face): (usize, &[u32; 3])| match fates[i % fates.len()] {
            0 => vec![],
            1 => vec![face, face],
            2 => vec![[face[0], face[2], face[1]]],
            _ => vec![face],
        };
        let faces = mesh.faces().iter().enumerate().flat_map(fate).collect();
        Mesh::new(mesh.vertices().to_vec(), faces).expect("the faces are of the mesh")
    })
}

/// Two surfaces and any map from the one to the other, some vertices without a match.
fn mapped() -> impl Strategy<Value = (Mesh, Mesh, PointMap)> {
    (surface(), surface()).prop_flat_map(|(source, target)| {
        let (n_source, n_target) = (source.n_vertices(), target.n_vertices());
        let matched = prop_oneof![9 => 0..n_target as u32, 1 => Just(PointMap::UNMATCHED)];
        // As it comes, or with its neighbours, so that vertices share matches and places are interpolated.
        let map =
            prop_oneof![vec(matched, n_source), Just(nearest_vertices(target.vertices(), source.vertices()))];
        (Just(source), Just(target), map).prop_map(|(source, target, map)| {
            let map = PointMap::new(map, target.n_vertices());
            (source, target, map)
        })
    })
}

/// The source's, the target's, and each with places within triangles; with the giver and the receiver.
fn all_donors<'a>(source: &'a Mesh, target: &'a Mesh, map: &PointMap) -> Vec<(&'a Mesh, &'a Mesh, Donors)> {
    let (to_source, to_target) =
        (Donors::of_source(map), Donors::of_target(map, target).expect("the map is of the target"));
    vec![
        (target, source, to_source.clone().interpolated(source, target).expect("points of both meshes")),
        (target, source, to_source),
        (source, target, to_target.clone().interpolated(target, source).expect("points of both meshes")),
        (source, target, to_target),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn repair_is_done_after_once_and_knows_the_way_back(mesh in damaged_surface()) {
        let options = RepairOptions::default();
        let Ok(once) = repair(&mesh, &options) else { return Ok(()) };
        prop_assert_eq!(once.repaired_of_input.len(), mesh.n_vertices());
        prop_assert_eq!(once.input_of_repaired.len(), once.mesh.n_vertices());
        for (repaired, &input) in once.input_of_repaired.iter().enumerate() {
            prop_assert_eq!(once.mesh.vertices()[repaired], mesh.vertices()[input as usize]);
        }
        for (input, repaired) in once.repaired_of_input.iter().enumerate() {
            if let Some(repaired) = repaired {
                prop_assert_eq!(once.mesh.vertices()[*repaired as usize], mesh.vertices()[input]);
            }
        }
        let twice = repair(&once.mesh, &options).unwrap();
        prop_assert!(twice.report.is_unchanged(), "{:?}", twice.report);
        prop_assert_eq!(twice.mesh, once.mesh);
    }

    #[test]
    fn decimation_keeps_a_subset_of_the_vertices(mesh in surface(), share in 0.2..1.0f64) {
        let target = (share * mesh.n_vertices() as f64) as usize;
        let Ok(small) = decimate(&mesh, target, &DecimateOptions::default()) else { return Ok(()) };
        prop_assert_eq!(small.injection.len(), small.mesh.n_vertices());
        let mut kept = small.injection.clone();
        kept.sort_unstable();
        kept.dedup();
        prop_assert_eq!(kept.len(), small.injection.len());
        for (vertex, &full) in small.injection.iter().enumerate() {
            prop_assert_eq!(small.mesh.vertices()[vertex], mesh.vertices()[full as usize]);
        }
    }

    #[test]
    fn the_nearest_row_is_that_of_a_double_loop(
        (d, targets, queries) in (1..20usize).prop_flat_map(|d| {
            let rows = |n: std::ops::Range<usize>| vec(vec(-4..4i32, d), n);
            (Just(d), rows(1..60), rows(1..40))
        })
    ) {
        // Few values: many ties, which go to the lowest index.
        let matrix = |rows: &[Vec<i32>]| Matrix::from_fn(rows.len(), d, |i, j| f64::from(rows[i][j]));
        let found = nearest_rows(&matrix(&queries), &matrix(&targets)).unwrap();
        for (q, query) in queries.iter().enumerate() {
            let distance = |t: &Vec<i32>| t.iter().zip(query).map(|(a, b)| (a - b).pow(2)).sum::<i32>();
            let (best, index) = targets.iter().enumerate().map(|(i, t)| (distance(t), i)).min().unwrap();
            prop_assert_eq!(found.index[q] as usize, index);
            prop_assert_eq!(found.squared_distance[q], f64::from(best));
        }
    }

    #[test]
    fn what_is_constant_on_the_giver_is_so_on_the_receiver((source, target, map) in mapped()) {
        for (giver, receiver, donors) in all_donors(&source, &target, &map) {
            let n = giver.n_vertices();
            let joint = |i: u16| Joint { name: i.to_string(), parent: None, frame: [[0.0; 4]; 4] };
            let attributes = Attributes {
                vertex_colors: Some(vec![[10, 200, 30, 255]; n]),
                corner_uvs: Some(vec![[[0.25, 0.5]; 3]; giver.n_faces()]),
                texture: None,
                vertex_scalars: vec![("f".into(), vec![3.0; n])],
                vertex_integers: Vec::new(),
                skin: Some(Skin {
                    joints: (0..3).map(joint).collect(),
                    indices: vec![[2, 0, 1, 0]; n],
                    weights: vec![[0.5, 0.25, 0.25, 0.0]; n],
                }),
            };
            let moved = transfer_attributes(giver, &attributes, receiver, &donors).unwrap();
            let values = transfer_values(&Matrix::from_fn(n, 1, |_, _| 7.0), &donors).unwrap();
            let (colors, skin) = (moved.vertex_colors.unwrap(), moved.skin.unwrap());
            for (v, donor) in donors.iter().enumerate() {
                let weights: f32 = skin.weights[v].iter().sum();
                if donor.is_some() {
                    prop_assert_eq!(colors[v], [10, 200, 30, 255]);
                    prop_assert!((moved.vertex_scalars[0].1[v] - 3.0).abs() < 1e-5);
                    prop_assert!((values[(v, 0)] - 7.0).abs() < 1e-12);
                    prop_assert!((weights - 1.0).abs() < 1e-5);
                    prop_assert_eq!(skin.indices[v][0], 2);
                } else {
                    prop_assert!(values[(v, 0)].is_nan() && moved.vertex_scalars[0].1[v].is_nan());
                    prop_assert_eq!(weights, 0.0);
                }
            }
            for (face, uvs) in receiver.faces().iter().zip(moved.corner_uvs.unwrap()) {
                let matched = face.iter().any(|&v| donors.iter().nth(v as usize).unwrap().is_some());
                let expected = if matched { [0.25, 0.5] } else { [0.0; 2] };
                let near = |uv: [f32; 2]| (uv[0] - expected[0]).abs() < 1e-6 && (uv[1] - expected[1]).abs() < 1e-6;
                prop_assert!(uvs.into_iter().all(near), "{:?}", uvs);
            }
        }
    }

    #[test]
    fn values_stay_within_the_range_of_the_giver((source, target, map) in mapped()) {
        for (giver, _, donors) in all_donors(&source, &target, &map) {
            let values = Matrix::from_fn(giver.n_vertices(), 3, |i, j| giver.vertices()[i][j]);
            let moved = transfer_values(&values, &donors).unwrap();
            for j in 0..3 {
                let column = || giver.vertices().iter().map(|p| p[j]);
                let (low, high) = (column().fold(f64::INFINITY, f64::min), column().fold(f64::NEG_INFINITY, f64::max));
                let within = |x: f64| x.is_nan() || (low - 1e-9..=high + 1e-9).contains(&x);
                prop_assert!((0..moved.rows()).all(|i| within(moved[(i, j)])));
            }
        }
    }

    #[test]
    fn landmarks_of_a_permutation_are_found(mesh in surface(), seed: u64, marks in vec(0..16u32, 1..5)) {
        let (copy, new_of_old) = permuted(&mesh, seed);
        let map = PointMap::new(new_of_old, copy.n_vertices());
        let moved = transfer_landmarks(&marks, &copy, &mesh, &Donors::of_source(&map)).unwrap();
        for (&mark, found) in marks.iter().zip(moved) {
            let found = found.unwrap();
            prop_assert_eq!(mesh.vertices()[found as usize], copy.vertices()[mark as usize]);
        }
    }

    #[test]
    fn skins_survive_a_glb_file(mesh in surface(), parents in vec(any::<prop::sample::Index>(), 1..9), seed in 1..99u32) {
        let parent = |j: usize, index: &prop::sample::Index| (j > 0).then(|| index.index(j) as u16);
        let joint = |(j, index): (usize, &prop::sample::Index)| {
            let mut frame = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
            frame[3] = [j as f64, -0.5, 0.25, 1.0];
            Joint { name: format!("joint {j}"), parent: parent(j, index), frame }
        };
        let joints: Vec<Joint> = parents.iter().enumerate().map(joint).collect();
        let n_joints = joints.len() as u32;
        let indices = (0..mesh.n_vertices() as u32).map(|v| [(v * seed % n_joints) as u16, 0, 0, 0]).collect();
        let skin = Skin { joints, indices, weights: vec![[1.0, 0.0, 0.0, 0.0]; mesh.n_vertices()] };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        write_mesh(&path, &mesh, &Attributes { skin: Some(skin.clone()), ..Attributes::default() }).unwrap();
        let file = read_mesh(&path).unwrap();
        prop_assert_eq!(file.attributes.skin, Some(skin));
        prop_assert_eq!(file.mesh.faces(), mesh.faces());
        for (read, written) in file.mesh.vertices().iter().zip(mesh.vertices()) {
            prop_assert!((0..3).all(|i| (read[i] - written[i]).abs() < 1e-5));
        }
    }
}
