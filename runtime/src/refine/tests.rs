use super::sampling::farthest_points;
use super::*;
use crate::Matrix;
use crate::fmap::test_basis::{assert_close, flipped, identity, rectangle, reordered, shuffle};
use crate::point_map::recover;
use crate::spectral::Eigenbasis;

/// The share of vertices that a map of a shape to itself leaves in place.
fn share_exact(map: &PointMap) -> f64 {
    map.iter().enumerate().filter(|&(x, y)| y == Some(x as u32)).count() as f64 / map.len() as f64
}

/// The identity with an error everywhere.
fn disturbed(k: usize, size: f64) -> Matrix {
    Matrix::from_fn(k, k, |i, j| identity(k)[(i, j)] + size * ((i * k + j) as f64 * 7.3).sin())
}

/// The map of a shape to itself that `k` eigenfunctions with an error give.
fn coarse_map(basis: &Eigenbasis, k: usize) -> PointMap {
    let truncated = basis.truncated(k);
    recover(&disturbed(k, 0.15), &truncated, &truncated).unwrap()
}

fn zoomout_options(samples: ZoomOutSamples) -> ZoomOutOptions {
    ZoomOutOptions { k_start: 6, k_step: 4, k_max: 60, samples, ..ZoomOutOptions::default() }
}

#[test]
fn icp_finds_the_identity_from_a_disturbed_map() {
    let basis = rectangle(30, 40, 40);
    let refined = icp(&disturbed(40, 0.1), &basis, &basis, &IcpOptions::default()).unwrap();
    assert!(refined.info.converged);
    assert_eq!(share_exact(&refined.map), 1.0);
    assert!(refined.map.confidence.iter().flatten().all(|&confidence| confidence > 0.999));
    assert_close(&refined.functional_map, &identity(40), 1e-10);
    let after_first = &refined.info.residuals[1..];
    assert!(after_first.is_sorted_by(|a, b| a >= b), "{:?}", refined.info.residuals);
}

#[test]
fn icp_map_is_orthonormal() {
    let (source, target) = (rectangle(30, 40, 20), rectangle(33, 37, 24));
    let c = Matrix::from_fn(24, 20, |i, j| if i == j { 1.0 } else { 0.1 * ((i + 3 * j) as f64).sin() });
    let refined = icp(&c, &source, &target, &IcpOptions { max_iterations: 2 }).unwrap().functional_map;
    let columns = Matrix::from_fn(20, 20, |a, b| (0..24).map(|i| refined[(i, a)] * refined[(i, b)]).sum());
    assert_close(&columns, &identity(20), 1e-12);
}

#[test]
fn zoomout_improves_a_small_correct_map() {
    let basis = rectangle(30, 40, 60);
    let coarse = coarse_map(&basis, 8);
    assert!(share_exact(&coarse) < 0.5, "{}", share_exact(&coarse));
    let options = zoomout_options(ZoomOutSamples::All);
    let one_way =
        zoomout(&coarse, &basis, &basis, &ZoomOutOptions { bidirectional: false, ..options.clone() })
            .unwrap();
    assert!(share_exact(&one_way.map) > 0.95, "{}", share_exact(&one_way.map));
    let refined = zoomout(&coarse, &basis, &basis, &options).unwrap();
    assert!(share_exact(&refined.map) > 0.95, "{}", share_exact(&refined.map));
    assert_eq!(refined.info.rounds.first(), Some(&6));
    assert_eq!(refined.info.rounds.last(), Some(&60));
    assert_eq!(refined.functional_map.rows(), 60);
    let confidence = refined.map.confidence.unwrap();
    assert!(confidence.iter().sum::<f32>() > 0.9 * 1200.0 && confidence.iter().all(|&c| c <= 1.0));
}

#[test]
fn zoomout_on_samples_is_as_good() {
    let basis = rectangle(30, 40, 60);
    let refined =
        zoomout(&coarse_map(&basis, 8), &basis, &basis, &zoomout_options(ZoomOutSamples::Farthest(300)))
            .unwrap();
    assert_eq!(refined.info.samples, [300, 300]);
    assert!(share_exact(&refined.map) > 0.95, "{}", share_exact(&refined.map));
}

#[test]
fn zoomout_matches_a_permuted_copy_whatever_the_signs() {
    let source = rectangle(30, 40, 60);
    let order = shuffle(1200);
    let target = reordered(&flipped(&source), &order);
    let mut place = vec![0; 1200];
    order.iter().enumerate().for_each(|(i, &vertex)| place[vertex as usize] = i as u32);
    let coarse = coarse_map(&source, 8);
    let start = PointMap::new(coarse.targets.iter().map(|&y| place[y as usize]).collect(), 1200);
    let options = zoomout_options(ZoomOutSamples::All);
    let refined = zoomout(&start, &source, &target, &options).unwrap();
    let same = zoomout(&coarse, &source, &source, &options).unwrap();
    let expected: Vec<u32> = same.map.targets.iter().map(|&y| place[y as usize]).collect();
    assert_eq!(refined.map.targets, expected);
}

#[test]
fn zoomout_fills_in_unmatched_vertices() {
    let basis = rectangle(30, 40, 60);
    let mut start = PointMap::new((0..1200).collect(), 1200);
    start.targets.iter_mut().step_by(3).for_each(|target| *target = PointMap::UNMATCHED);
    for samples in [ZoomOutSamples::All, ZoomOutSamples::Farthest(200)] {
        let refined = zoomout(&start, &basis, &basis, &zoomout_options(samples)).unwrap();
        assert!(share_exact(&refined.map) > 0.95, "{samples:?}: {}", share_exact(&refined.map));
    }
    let nothing = PointMap::new(vec![PointMap::UNMATCHED; 1200], 1200);
    let failed = zoomout(&nothing, &basis, &basis, &ZoomOutOptions::default());
    assert_eq!(failed.unwrap_err(), RefineError::NothingMatched);
}

#[test]
fn samples_are_spread_and_distinct() {
    let basis = rectangle(30, 40, 60);
    let samples = farthest_points(&basis, 48);
    assert_eq!(samples.len(), 48);
    assert!(samples.is_sorted_by(|a, b| a < b));
    // No two in neighbouring cells.
    let cell = |i: u32| (i64::from(i) % 30, i64::from(i) / 30);
    for (i, &a) in samples.iter().enumerate() {
        for &b in &samples[i + 1..] {
            let ((ax, ay), (bx, by)) = (cell(a), cell(b));
            assert!((ax - bx).abs() + (ay - by).abs() > 1);
        }
    }
    assert_eq!(farthest_points(&basis, 5000).len(), 1200);
}

#[test]
fn options_out_of_range_are_errors() {
    let basis = rectangle(9, 8, 10);
    let map = PointMap::new((0..72).collect(), 72);
    let default = ZoomOutOptions::default();
    for options in [
        ZoomOutOptions { k_start: 0, ..default.clone() },
        ZoomOutOptions { k_step: 0, ..default.clone() },
        ZoomOutOptions { k_max: 5, ..default.clone() },
    ] {
        assert!(matches!(zoomout(&map, &basis, &basis, &options), Err(RefineError::Option { .. })));
    }
    assert_eq!(zoomout(&map, &basis, &basis, &default).unwrap().info.rounds, [10], "clamped to the basis");
    let empty = basis.truncated(0);
    for (source, target, side) in [(&empty, &basis, "source"), (&basis, &empty, "target")] {
        let error = zoomout(&map, source, target, &default).unwrap_err();
        assert_eq!(error, RefineError::NoEigenfunctions { side });
        let error = pmf(&map, source, target, PmfHints::default(), &PmfOptions::default()).unwrap_err();
        assert_eq!(error, RefineError::NoEigenfunctions { side });
    }
    let none = icp(&identity(10), &basis, &basis, &IcpOptions { max_iterations: 0 });
    assert!(matches!(none, Err(RefineError::Option { option: "max_iterations", .. })));
    let wrong = icp(&identity(9), &basis, &basis, &IcpOptions::default());
    assert!(matches!(wrong, Err(RefineError::Recover(RecoverError::ShapeMismatch { .. }))));
}

#[test]
fn thread_count_does_not_matter() {
    let basis = rectangle(70, 75, 40);
    let start = coarse_map(&basis, 12);
    let options = ZoomOutOptions { k_start: 12, k_step: 14, k_max: 40, ..ZoomOutOptions::default() };
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let icp = icp(&disturbed(40, 0.1), &basis, &basis, &IcpOptions { max_iterations: 2 }).unwrap();
            (icp, zoomout(&start, &basis, &basis, &options).unwrap())
        })
    };
    assert!(run(1) == run(3));
}
