use super::*;
use crate::fmap::test_basis::{assert_close, flipped, identity, rectangle, reordered, shuffle};
use crate::point_map::Comparison;

/// The permutation that takes a shape to [`reordered`], and back.
fn permutation(order: &[u32]) -> [PointMap; 2] {
    let mut forth = vec![0; order.len()];
    order.iter().enumerate().for_each(|(y, &x)| forth[x as usize] = y as u32);
    [PointMap::new(forth, order.len()), PointMap::new(order.to_vec(), order.len())]
}

/// A map and the one back, each with every fifth match replaced by one far away.
fn partly_wrong([forth, back]: &[PointMap; 2]) -> [PointMap; 2] {
    [forth, back].map(|map| {
        let n = map.len();
        let mut wrong = map.clone();
        (0..n).step_by(5).for_each(|x| wrong.targets[x] = map.targets[(x * 7 + n / 3) % n]);
        wrong
    })
}

/// The exact maps as `k` eigenfunctions tell them.
fn blurred(source: &Eigenbasis, target: &Eigenbasis, exact: &[PointMap; 2], k: usize) -> [PointMap; 2] {
    let (source, target) = (source.truncated(k), target.truncated(k));
    let noise = |i: usize, j: usize| 0.1 * ((i * k + j) as f64 * 7.3).sin();
    let maps = BothMaps::of([&exact[0], &exact[1]], &source, &target).unwrap();
    let disturbed = |c: &Matrix| Matrix::from_fn(k, k, |i, j| c[(i, j)] + noise(i, j));
    let maps = BothMaps { forth: disturbed(&maps.forth), back: disturbed(&maps.back) };
    let embedding = maps.embedding(Comparison::Joint, &source, &target).unwrap();
    [embedding.forth().unwrap(), embedding.back().unwrap()]
}

fn share_equal(found: &PointMap, expected: &PointMap) -> f64 {
    let equal = found.targets.iter().zip(&expected.targets).filter(|(a, b)| a == b).count();
    equal as f64 / expected.len() as f64
}

fn options() -> WaveletOptions {
    let stages = [(12, 4), (30, 3), (60, 3)].map(|(k, rounds)| WaveletStage { k, rounds });
    WaveletOptions { stages: stages.to_vec() }
}

fn refined(
    maps: &[PointMap; 2],
    bases: [&Eigenbasis; 2],
    options: &WaveletOptions,
) -> RefinedBoth<WaveletInfo> {
    wavelet([&maps[0], &maps[1]], bases[0], bases[1], WaveletHints::default(), options).unwrap()
}

#[test]
fn an_exact_map_stays_exact() {
    let source = rectangle(30, 40, 60);
    let order = shuffle(1200);
    let target = reordered(&flipped(&source), &order);
    let exact = permutation(&order);
    let found = refined(&exact, [&source, &target], &options());
    assert_eq!(found.map.targets, exact[0].targets);
    assert_eq!(found.map_back.targets, exact[1].targets);
    assert!(found.map.confidence.iter().flatten().all(|&c| c > 1.0 - 1e-6));
    assert_eq!(found.info.rounds, [12, 12, 12, 12, 30, 30, 30, 60, 60, 60]);
    let expected = BothMaps::of([&exact[0], &exact[1]], &source, &target).unwrap();
    assert_close(&found.functional_maps.forth, &expected.forth, 1e-10);
    assert_close(&found.functional_maps.back, &expected.back, 1e-10);
}

#[test]
fn a_rough_map_of_a_permuted_copy_becomes_exact() {
    let source = rectangle(30, 40, 60);
    let order = shuffle(1200);
    let target = reordered(&flipped(&source), &order);
    let exact = permutation(&order);
    for start in [partly_wrong(&exact), blurred(&source, &target, &exact, 12)] {
        assert!(share_equal(&start[0], &exact[0]) < 0.81);
        let found = refined(&start, [&source, &target], &options());
        let shares = [share_equal(&found.map, &exact[0]), share_equal(&found.map_back, &exact[1])];
        assert_eq!(shares, [1.0; 2]);
        assert!((0..60).all(|i| (found.functional_maps.forth[(i, i)].abs() - 1.0).abs() < 1e-9));
    }
}

#[test]
fn unmatched_vertices_are_filled_in() {
    let basis = rectangle(30, 40, 60);
    let mut start = PointMap::new((0..1200).collect(), 1200);
    start.targets.iter_mut().step_by(3).for_each(|target| *target = PointMap::UNMATCHED);
    let exact = PointMap::new((0..1200).collect(), 1200);
    let found = refined(&[start.clone(), start.clone()], [&basis, &basis], &options());
    assert_eq!(found.map.targets, exact.targets);
    assert_eq!(found.map_back.targets, exact.targets);
    let nothing = PointMap::new(vec![PointMap::UNMATCHED; 1200], 1200);
    for maps in [[&nothing, &start], [&start, &nothing]] {
        let failed = wavelet(maps, &basis, &basis, WaveletHints::default(), &WaveletOptions::default());
        assert_eq!(failed.unwrap_err(), RefineError::NothingMatched);
    }
}

#[test]
fn exchanging_the_shapes_exchanges_the_maps() {
    let (source, target) = (rectangle(30, 40, 60), rectangle(33, 37, 60));
    let k = 12;
    let maps = BothMaps::with_adjoint(identity(k));
    let (phi, psi) = (source.truncated(k), target.truncated(k));
    let embedding = maps.embedding(Comparison::Joint, &phi, &psi).unwrap();
    let start = [embedding.forth().unwrap(), embedding.back().unwrap()];
    let found = refined(&start, [&source, &target], &options());
    let [forth, back] = start;
    let other = refined(&[back, forth], [&target, &source], &options());
    // All but ties to single precision, of which a regular grid has many.
    let shares = [share_equal(&found.map, &other.map_back), share_equal(&found.map_back, &other.map)];
    assert!(shares.iter().all(|&share| share > 0.98), "{shares:?}");
}

#[test]
fn stages_begin_at_the_map_s_k_and_end_where_asked() {
    let ks = |options: &WaveletOptions| options.stages.iter().map(|stage| stage.k).collect::<Vec<_>>();
    let rough = WaveletOptions::coarse_to_fine;
    assert_eq!(ks(&rough(100, 200)), [60, 128, 200]);
    assert_eq!(ks(&rough(30, 200)), [30, 60, 128, 200]);
    assert_eq!(ks(&rough(100, 250)), [60, 128, 200, 250]);
    assert_eq!(ks(&rough(100, 100)), [60, 100]);
    assert_eq!(ks(&rough(40, 40)), [40]);
    assert_eq!(WaveletOptions::default(), rough(200, 200));
}

#[test]
fn options_out_of_range_are_errors() {
    let basis = rectangle(9, 8, 10);
    let map = PointMap::new((0..72).collect(), 72);
    let default = WaveletOptions::default();
    let fails = |options: &WaveletOptions| {
        wavelet([&map, &map], &basis, &basis, WaveletHints::default(), options).unwrap_err()
    };
    let stage = |k, rounds| vec![WaveletStage { k, rounds }];
    for (options, name) in [
        (WaveletOptions { stages: Vec::new() }, "the number of stages"),
        (WaveletOptions { stages: stage(0, 1) }, "k of a stage"),
        (WaveletOptions { stages: stage(1, 0) }, "rounds of a stage"),
    ] {
        assert_eq!(fails(&options).to_string(), format!("{name} is 0, but must be at least 1"));
    }
    let short = PointMap::new(vec![0; 3], 72);
    for maps in [[&short, &map], [&map, &short]] {
        assert!(matches!(
            wavelet(maps, &basis, &basis, WaveletHints::default(), &default),
            Err(RefineError::Fmap(_))
        ));
    }
    let clamped = refined(&[map.clone(), map.clone()], [&basis, &basis], &default);
    assert_eq!(clamped.info.rounds, [10; 8]);
}

#[test]
fn thread_count_does_not_matter() {
    let basis = rectangle(70, 75, 40);
    let exact = PointMap::new((0..5250).collect(), 5250);
    let start = partly_wrong(&[exact.clone(), exact]);
    let stages = [(12, 2), (40, 3)].map(|(k, rounds)| WaveletStage { k, rounds }).to_vec();
    let options = WaveletOptions { stages };
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| refined(&start, [&basis, &basis], &options))
    };
    assert!(run(1) == run(3));
}

/// A search along the edges finds the exact map as searches through all vertices do.
#[test]
fn edges_lead_to_the_same_map() {
    let (columns, rows) = (50, 60);
    let source = rectangle(columns, rows, 60);
    let mesh = crate::mesh::shapes::grid(columns - 1, rows - 1);
    let order = shuffle(columns * rows);
    let target = reordered(&flipped(&source), &order);
    let exact = permutation(&order);
    let renamed = |face: [u32; 3]| face.map(|x| exact[0].targets[x as usize]);
    let vertices = order.iter().map(|&x| mesh.vertices()[x as usize]).collect();
    let other = Mesh::new(vertices, mesh.faces().iter().copied().map(renamed).collect()).unwrap();
    let start = blurred(&source, &target, &exact, 12);
    let run = |hints| wavelet([&start[0], &start[1]], &source, &target, hints, &options()).unwrap();
    for meshes in [None, Some([&mesh, &other])] {
        let found = run(WaveletHints { meshes, anchors: None });
        assert_eq!([&found.map.targets, &found.map_back.targets], [&exact[0].targets, &exact[1].targets]);
    }
    let pools = [1, 3].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
    let hints = WaveletHints { meshes: Some([&mesh, &other]), anchors: None };
    let [one, three] = pools.map(|pool| pool.install(|| run(hints)));
    assert!(one == three);
}

/// On a square nothing but columns beside the embedding tells its symmetries apart.
#[test]
fn anchors_decide_where_the_eigenfunctions_do_not() {
    let basis = rectangle(24, 24, 40);
    let exact = PointMap::new((0..576).collect(), 576);
    let mirrored = PointMap::new((0..576).map(|x| x / 24 * 24 + 23 - x % 24).collect(), 576);
    let position = Matrix::from_fn(576, 2, |x, j| 30.0 * ([x / 24, x % 24][j] as f64 / 24.0));
    let anchors = [position.clone(), position];
    let run = |anchors| {
        let hints = WaveletHints { anchors, meshes: None };
        wavelet([&mirrored, &mirrored], &basis, &basis, hints, &options()).unwrap().map.targets
    };
    assert_eq!(run(None), mirrored.targets);
    assert_eq!(run(Some(&anchors)), exact.targets);
    let short = [Matrix::zeros(3, 2), Matrix::zeros(576, 2)];
    let hints = WaveletHints { anchors: Some(&short), meshes: None };
    let failed = wavelet([&exact, &exact], &basis, &basis, hints, &options()).unwrap_err();
    assert!(matches!(failed, RefineError::Descriptors { .. }));
}

/// The first `k` eigenfunctions of a mesh where an area of `unit` counts as 1.
fn basis_of(mesh: &Mesh, unit: f64, k: usize) -> Eigenbasis {
    let laplacian = crate::spectral::Laplacian::new(mesh);
    let (basis, _) = crate::spectral::eigenbasis(&laplacian, k, &Default::default()).unwrap();
    basis.in_unit(unit, k)
}

/// Of a part with a third of its matches wrong, all become right but for neighbours.
#[test]
fn a_part_finds_its_place_on_the_whole() {
    let whole = crate::mesh::shapes::bumpy_sphere(4, 1);
    let kept: Vec<u32> =
        (0..whole.n_vertices() as u32).filter(|&v| whole.vertices()[v as usize][2] > -0.2).collect();
    let place: std::collections::HashMap<u32, u32> = kept.iter().copied().zip(0..).collect();
    let faces = whole.faces().iter().filter_map(|face| {
        let [a, b, c] = face.map(|v| place.get(&v).copied());
        Some([a?, b?, c?])
    });
    let part =
        Mesh::new(kept.iter().map(|&v| whole.vertices()[v as usize]).collect(), faces.collect()).unwrap();
    let bases = [&part, &whole].map(|mesh| basis_of(mesh, whole.area(), 60));
    let exact = PointMap::new(kept, whole.n_vertices());
    let mut start = exact.clone();
    (0..start.len()).step_by(3).for_each(|x| start.targets[x] = (x as u32 * 7 + 500) % exact.n_target as u32);
    let refined = wavelet_of_part(&start, &bases[0], &bases[1], None, &options()).unwrap();
    let far = |map: &PointMap| {
        let apart = |x: usize| {
            let [found, right] = [map, &exact].map(|map| whole.vertices()[map.targets[x] as usize]);
            crate::mesh::vec3::distance(found, right)
        };
        (0..map.len()).map(apart).sum::<f64>() / map.len() as f64 / whole.scale()
    };
    assert!(far(&start) > 0.05 && far(&refined.map) < 0.01, "{} {}", far(&start), far(&refined.map));
    let share = part.area() / whole.area();
    let expected = (60.0 * share).round() as usize;
    assert_eq!([refined.functional_map.rows(), refined.functional_map.cols()], [60, expected]);
    let none = PointMap::new(vec![PointMap::UNMATCHED; part.n_vertices()], whole.n_vertices());
    let failed = wavelet_of_part(&none, &bases[0], &bases[1], None, &options());
    assert_eq!(failed, Err(RefineError::NothingMatched));
}
