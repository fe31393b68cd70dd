use super::*;
use crate::fmap::test_basis::{flipped, rectangle, reordered, shuffle};
use crate::mesh::nearest_vertices;
use crate::mesh::shapes::{bumpy_sphere, open_half_sphere, permuted, torus};
use crate::point_map::recover;
use crate::spectral::{EigenOptions, Laplacian, eigenbasis};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn basis_of(mesh: &crate::Mesh, k: usize) -> Eigenbasis {
    let (basis, _) = eigenbasis(&Laplacian::new(mesh), k, &EigenOptions::default()).unwrap();
    basis.at_unit_area(k)
}

/// For shapes of about 1000 vertices, which are coarser than those the defaults are for.
fn coarse() -> PmfOptions {
    PmfOptions {
        time_start: 5e-3,
        time_end: 2e-3,
        neighbors_start: 16,
        neighbors_end: 8,
        ..PmfOptions::default()
    }
}

fn share_of(map: &PointMap, expected: &[u32]) -> f64 {
    map.targets.iter().zip(expected).filter(|(found, expected)| found == expected).count() as f64
        / expected.len() as f64
}

fn is_injective(map: &PointMap) -> bool {
    let mut targets = map.targets.clone();
    targets.sort_unstable();
    targets.last().is_some_and(|&last| (last as usize) < map.n_target)
        && targets.windows(2).all(|w| w[0] != w[1])
}

/// A third of the matches replaced by random ones.
fn corrupted(targets: &[u32], n_target: usize) -> PointMap {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let wrong =
        |&target: &u32| if rng.random_bool(0.33) { rng.random_range(0..n_target as u32) } else { target };
    PointMap::new(targets.iter().map(wrong).collect(), n_target)
}

#[test]
fn the_identity_stays() {
    let basis = rectangle(30, 40, 150);
    let identity: Vec<u32> = (0..1200).collect();
    let refined =
        pmf(&PointMap::new(identity.clone(), 1200), &basis, &basis, PmfHints::default(), &coarse()).unwrap();
    assert_eq!(refined.map.targets, identity);
    assert_eq!(refined.info.left_over, 0);
    assert!(refined.map.confidence.unwrap().iter().all(|&confidence| confidence > 0.9));
}

#[test]
fn a_noisy_permutation_of_a_bumpy_sphere_is_repaired() {
    let mesh = bumpy_sphere(3, 5);
    let (copy, place) = permuted(&mesh, 3);
    let (source, target) = (basis_of(&mesh, 120), basis_of(&copy, 120));
    let start = corrupted(&place, place.len());
    assert!(share_of(&start, &place) < 0.7);
    let refined = pmf(&start, &source, &target, PmfHints::default(), &coarse()).unwrap();
    assert!(is_injective(&refined.map));
    assert!(share_of(&refined.map, &place) > 0.97, "{}", share_of(&refined.map, &place));
    assert!(refined.info.changed.last().is_some_and(|&changed| changed < 0.05), "{:?}", refined.info);
}

#[test]
fn signs_and_order_do_not_matter() {
    let source = rectangle(30, 40, 120);
    let order = shuffle(1200);
    let target = reordered(&flipped(&source), &order);
    let mut place = vec![0; 1200];
    order.iter().enumerate().for_each(|(i, &vertex)| place[vertex as usize] = i as u32);
    let refined = pmf(&corrupted(&place, 1200), &source, &target, PmfHints::default(), &coarse()).unwrap();
    assert!(is_injective(&refined.map));
    assert!(share_of(&refined.map, &place) > 0.95, "{}", share_of(&refined.map, &place));
}

#[test]
fn a_smaller_source_is_mapped_injectively_and_a_larger_one_completely() {
    let (small, large) = (rectangle(24, 33, 100), rectangle(30, 41, 100));
    for (source, target) in [(&small, &large), (&large, &small)] {
        let c = Matrix::from_fn(100, 100, |i, j| f64::from(i == j));
        let start = recover(&c, source, target).unwrap();
        let refined = pmf(&start, source, target, PmfHints::default(), &coarse()).unwrap();
        assert!(refined.map.targets.iter().all(|&t| (t as usize) < target.n()));
        assert_eq!(is_injective(&refined.map), source.n() <= target.n());
        // Two spacings of the coarser grid apart at most, all but a few.
        let (nx_source, nx_target) = if source.n() < target.n() { (24, 30) } else { (30, 24) };
        let ny = |n: usize, nx: usize| (n / nx) as f64;
        let position = |v: u32, n: usize, nx: u32| {
            [(f64::from(v % nx) + 0.5) / f64::from(nx), (f64::from(v / nx) + 0.5) / ny(n, nx as usize)]
        };
        let far = (0..source.n() as u32).filter(|&x| {
            let here = position(x, source.n(), nx_source);
            let there = position(refined.map.targets[x as usize], target.n(), nx_target);
            (here[0] - there[0]).abs() > 2.0 / 24.0 || (here[1] - there[1]).abs() > 2.0 / 33.0
        });
        let far = far.count() as f64 / source.n() as f64;
        assert!(far < 0.05, "{far}");
    }
}

#[test]
fn a_part_is_matched_to_the_whole() {
    let (part, whole) = (open_half_sphere(4), bumpy_sphere(3, 1));
    let (source, target) = (basis_of(&part, 60), basis_of(&whole, 60));
    let start: Vec<u32> = (0..part.n_vertices()).map(|i| (i * 3 % whole.n_vertices()) as u32).collect();
    for (source, target) in [(&source, &target), (&target, &source)] {
        let n = target.n();
        let mut start =
            PointMap::new((0..source.n()).map(|x| start[x % start.len()] % n as u32).collect(), n);
        start.targets.iter_mut().step_by(2).for_each(|target| *target = PointMap::UNMATCHED);
        let refined = pmf(&start, source, target, PmfHints::default(), &coarse()).unwrap();
        assert!(refined.map.targets.iter().all(|&t| (t as usize) < n));
        assert_eq!(is_injective(&refined.map), source.n() <= n);
    }
}

#[test]
fn tiny_shapes_and_bases_are_no_trouble() {
    for (nx, ny, k) in [(1, 1, 1), (2, 1, 2), (3, 3, 1), (5, 4, 20)] {
        let basis = rectangle(nx, ny, k);
        let refined = pmf(
            &PointMap::new(vec![0; nx * ny], nx * ny),
            &basis,
            &basis,
            PmfHints::default(),
            &PmfOptions::default(),
        )
        .unwrap();
        assert!(is_injective(&refined.map), "{nx} x {ny}, k = {k}");
    }
}

#[test]
fn descriptors_decide_what_kernels_cannot() {
    // The start is the mirror image of the truth in one cell in three; only descriptors can tell.
    let basis = rectangle(20, 30, 60);
    let identity: Vec<u32> = (0..600).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let descriptors = Matrix::from_fn(600, 8, |_, _| rng.random_range(-1.0f32..1.0));
    let shifted: Vec<u32> = (0..600).map(|v| if v % 20 < 19 { v + 1 } else { v }).collect();
    let start = PointMap::new(shifted, 600);
    let with = PmfHints { descriptors: Some([&descriptors, &descriptors]), meshes: None };
    let options = PmfOptions { descriptor_weight: 10.0, ..coarse() };
    let (plain, told) = (
        pmf(&start, &basis, &basis, PmfHints::default(), &options).unwrap(),
        pmf(&start, &basis, &basis, with, &options).unwrap(),
    );
    let shares = [share_of(&plain.map, &identity), share_of(&told.map, &identity)];
    assert!(shares[1] > 0.99 && shares[1] >= shares[0], "{shares:?}");
}

#[test]
fn a_shared_triangulation_makes_the_map_exact() {
    let mesh = bumpy_sphere(3, 5);
    let (copy, place) = permuted(&mesh, 3);
    let (source, target) = (basis_of(&mesh, 25), basis_of(&copy, 25));
    // A single round, of affine fits, leaves wrong matches.
    let options = PmfOptions { heat_rounds: 0, local_rounds: 1, ..coarse() };
    let run = |hints| pmf(&corrupted(&place, place.len()), &source, &target, hints, &options).unwrap();
    let plain = run(PmfHints::default());
    let told = run(PmfHints { meshes: Some([&mesh, &copy]), descriptors: None });
    assert_eq!((plain.info.edges_kept, told.info.edges_kept), (None, Some(1.0)));
    assert!(share_of(&plain.map, &place) < 1.0);
    assert_eq!(told.map.targets, place);
}

#[test]
fn separate_triangulations_are_not_taken_for_one() {
    let (coarse_tube, coarse_ring) = (torus(50, 24, 0.4), torus(30, 40, 0.4));
    let start = nearest_vertices(coarse_ring.vertices(), coarse_tube.vertices());
    let bases = [&coarse_tube, &coarse_ring].map(|mesh| basis_of(mesh, 60));
    let run = |meshes| {
        let hints = PmfHints { meshes, descriptors: None };
        pmf(&PointMap::new(start.clone(), 1200), &bases[0], &bases[1], hints, &coarse()).unwrap()
    };
    assert_eq!(run(Some([&coarse_tube, &coarse_ring])), run(None));
}

#[test]
fn a_triangulation_is_followed_from_the_right_piece() {
    let mesh = bumpy_sphere(3, 5);
    let (copy, place) = permuted(&mesh, 3);
    // Right on one cap, garbage elsewhere.
    let top = |v: usize| mesh.vertices()[v][2] > 0.6;
    let n = place.len();
    let mut present: Vec<u32> = (0..n as u32).collect();
    (0..n).filter(|&v| top(v)).for_each(|v| present[v] = place[v]);
    assert_eq!(carried_on([&mesh, &copy], &present), (place.clone(), 1.0));
    // The mirrored triangulation is another one.
    let mirrored =
        crate::Mesh::new(copy.vertices().to_vec(), copy.faces().iter().map(|&[a, b, c]| [a, c, b]).collect());
    assert!(carried_on([&mesh, &mirrored.unwrap()], &place).1 < 0.95);
}

#[test]
fn what_a_triangulation_does_not_reach_keeps_a_free_match() {
    let (mesh, place): (_, Vec<u32>) = (bumpy_sphere(2, 5), (0..162).collect());
    let cut = crate::Mesh::new(mesh.vertices().to_vec(), mesh.faces()[5..].to_vec()).unwrap();
    let (carried, share) = carried_on([&mesh, &cut], &place);
    assert!(share > 0.95 && carried == place, "{share}");
    let nothing = carried_on([&mesh, &cut], &vec![PointMap::UNMATCHED; 162]);
    assert_eq!(nothing, (vec![PointMap::UNMATCHED; 162], 0.0));
}

#[test]
fn options_out_of_range_are_errors() {
    let basis = rectangle(9, 8, 10);
    let map = PointMap::new((0..72).collect(), 72);
    let default = PmfOptions::default();
    for options in [
        PmfOptions { time_end: 0.0, ..default.clone() },
        PmfOptions { time_start: f64::NAN, ..default.clone() },
        PmfOptions { time_start: 1e-9, ..default.clone() },
        PmfOptions { descriptor_weight: -1.0, ..default.clone() },
        PmfOptions { alike: 1.1, ..default.clone() },
    ] {
        assert!(matches!(
            pmf(&map, &basis, &basis, PmfHints::default(), &options),
            Err(RefineError::RealOption { .. })
        ));
    }
    for options in [
        PmfOptions { neighbors_end: 3, ..default.clone() },
        PmfOptions { neighbors_start: 5, ..default.clone() },
        PmfOptions { candidates: 0, ..default.clone() },
        PmfOptions { heat_rounds: 0, local_rounds: 0, ..default.clone() },
    ] {
        assert!(matches!(
            pmf(&map, &basis, &basis, PmfHints::default(), &options),
            Err(RefineError::Option { .. })
        ));
    }
    let nothing = PointMap::new(vec![PointMap::UNMATCHED; 72], 72);
    assert_eq!(
        pmf(&nothing, &basis, &basis, PmfHints::default(), &default).unwrap_err(),
        RefineError::NothingMatched
    );
    let wrong = Matrix::zeros(71, 4);
    let descriptors = PmfHints { descriptors: Some([&wrong, &wrong]), meshes: None };
    assert!(matches!(
        pmf(&map, &basis, &basis, descriptors, &default),
        Err(RefineError::Descriptors { found: [71, 4, 71, 4], .. })
    ));
}

#[test]
fn thread_count_does_not_matter() {
    let basis = rectangle(30, 40, 80);
    let start = corrupted(&(0..1200).collect::<Vec<u32>>(), 1200);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| pmf(&start, &basis, &basis, PmfHints::default(), &coarse()).unwrap())
    };
    assert!(run(1) == run(3));
}

/// A part of a bumpy sphere in the unit of the whole: its heat kernels are as wide as those of the whole, in lengths.
#[test]
fn a_part_and_its_whole_are_in_one_unit() {
    let whole = bumpy_sphere(3, 5);
    let is_kept = |v: usize| whole.vertices()[v][2] > 0.0;
    let kept: Vec<u32> = (0..whole.n_vertices() as u32).filter(|&v| is_kept(v as usize)).collect();
    let place = |v: u32| kept.binary_search(&v).map(|at| at as u32);
    let face = |face: &[u32; 3]| -> Option<[u32; 3]> {
        Some([place(face[0]).ok()?, place(face[1]).ok()?, place(face[2]).ok()?])
    };
    let vertices = kept.iter().map(|&v| whole.vertices()[v as usize]).collect();
    let part = crate::Mesh::new(vertices, whole.faces().iter().filter_map(face).collect()).unwrap();
    let basis = |mesh: &crate::Mesh, k, unit: f64| {
        let (basis, _) = eigenbasis(&Laplacian::new(mesh), k, &EigenOptions::default()).unwrap();
        basis.in_unit(unit, k)
    };
    let start = corrupted(&kept, whole.n_vertices());
    let options = PmfOptions { part: true, ..coarse() };
    let refined = |unit: f64| {
        let (part, whole) = (basis(&part, 60, unit), basis(&whole, 120, unit));
        pmf(&start, &part, &whole, PmfHints::default(), &options).unwrap().map
    };
    let (one, other) = (refined(whole.area()), refined(3.0 * whole.area()));
    assert!(share_of(&one, &kept) > 0.8, "{}", share_of(&one, &kept));
    // The unit of both together does not matter.
    assert!(share_of(&one, &other.targets) > 0.99, "{}", share_of(&one, &other.targets));
}
