use super::test_basis::{assert_close, flipped, identity, rectangle, reordered, shuffle, sign};
use super::*;
use crate::point_map::PointMap;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const REGULARIZED: FmapSolver = FmapSolver::Regularized { weight: FmapSolver::DEFAULT_MASK_WEIGHT };

fn random(rows: usize, cols: usize, seed: u64) -> Matrix {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Matrix::from_fn(rows, cols, |_, _| rng.random_range(-1.0..1.0))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    multiply(a.as_faer(), b.as_faer())
}

fn solve(f: &Matrix, g: &Matrix) -> (Matrix, FmapInfo) {
    least_squares(f, g, &LeastSquaresOptions::default()).unwrap()
}

#[test]
fn same_descriptors_give_the_identity() {
    let basis = rectangle(12, 15, 20);
    let f = random(20, 50, 1);
    for solver in [FmapSolver::LeastSquares, REGULARIZED, REGULARIZED.for_matching()] {
        let (c, info) = functional_map(&basis, &basis, &f, &f, solver).unwrap();
        assert_close(&c, &identity(20), 1e-12);
        assert_eq!(info.rank, 20);
        assert!(info.condition >= 1.0 && info.condition < 1e4, "{}", info.condition);
        assert!(info.relative_residual < 1e-12);
    }
}

#[test]
fn the_bidirectional_map_is_its_own_transpose_and_nearer_to_the_truth() {
    let (source, target) = (rectangle(12, 15, 20), rectangle(12, 15, 20));
    let f = random(20, 60, 1);
    let noise = random(20, 60, 2);
    let g = Matrix::from_fn(20, 60, |i, j| sign(i) * (f[(i, j)] + 0.4 * noise[(i, j)]));
    let truth = Matrix::from_fn(20, 20, |i, j| if i == j { sign(i) } else { 0.0 });
    let both = FmapSolver::Bidirectional { weight: 0.01 };
    let (c, info) = functional_map(&source, &target, &f, &g, both).unwrap();
    let (back, _) = functional_map(&target, &source, &g, &f, both).unwrap();
    assert_close(&back, &c.transposed(), 1e-12);
    assert!(info.rank == 20 && info.relative_residual > 0.0 && info.relative_residual < 1.0);
    let one = FmapSolver::Regularized { weight: 0.01 };
    let (forth, _) = functional_map(&source, &target, &f, &g, one).unwrap();
    let away = |c: &Matrix| c.data().iter().zip(truth.data()).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    assert!(away(&c) < 0.9 * away(&forth), "{} against {}", away(&c), away(&forth));
}

#[test]
fn a_weight_alone_means_bidirectional() {
    assert_eq!(FmapSolver::chosen(None, None), None);
    assert_eq!(FmapSolver::chosen(None, Some(0.2)), Some(FmapSolver::Bidirectional { weight: 0.2 }));
    assert_eq!(FmapSolver::chosen(Some(SolverKind::Regularized), None), Some(REGULARIZED));
    assert_eq!(FmapSolver::chosen(Some(SolverKind::LeastSquares), Some(1.0)), Some(FmapSolver::LeastSquares));
}

#[test]
fn maps_of_both_directions_meet_their_equations() {
    let (source, target) = (rectangle(12, 15, 18), rectangle(14, 13, 16));
    let (f, g) = (random(18, 40, 31), random(16, 40, 32));
    let joint = FmapSolver::Joint { weight: 0.1 };
    let (maps, info) = functional_maps(&source, &target, &f, &g, joint).unwrap();
    let (forth, info_forth) = functional_map(&source, &target, &f, &g, REGULARIZED).unwrap();
    let (back, info_back) = functional_map(&target, &source, &g, &f, REGULARIZED).unwrap();
    assert_eq!((&maps.forth, &maps.back), (&forth, &back));
    assert_eq!(info.relative_residual, info_forth.relative_residual.max(info_back.relative_residual));
    let bidirectional = FmapSolver::Bidirectional { weight: 0.1 };
    let (mean, _) = functional_maps(&source, &target, &f, &g, bidirectional).unwrap();
    assert_eq!(mean, BothMaps::with_adjoint(maps.mean()));
    assert_eq!(functional_map(&source, &target, &f, &g, joint).unwrap().0, maps.forth);
}

#[test]
fn functional_maps_of_point_maps_pull_functions_back() {
    let basis = rectangle(40, 50, 20);
    let order = shuffle(2000);
    let target = reordered(&basis, &order);
    let mut forth = vec![0; 2000];
    order.iter().enumerate().for_each(|(y, &x)| forth[x as usize] = y as u32);
    let (forth, back) = (PointMap::new(forth, 2000), PointMap::new(order, 2000));
    let maps = BothMaps::of([&forth, &back], &basis, &target).unwrap();
    assert_close(&maps.forth, &identity(20), 1e-12);
    assert_close(&maps.back, &identity(20), 1e-12);
    // A constant map from the source to the target pulls every function back to a constant one.
    let constant = PointMap::new(vec![7; 2000], 2000);
    let maps = BothMaps::of([&constant, &back], &basis, &target).unwrap();
    let area = basis.area().sqrt();
    let expected =
        Matrix::from_fn(20, 20, |i, j| if i == 0 { area * target.eigenvectors[(7, j)] } else { 0.0 });
    assert_close(&maps.back, &expected, 1e-12);
    assert_close(&maps.forth, &identity(20), 1e-12);
}

#[test]
fn least_squares_recovers_a_map_and_meets_the_normal_equations() {
    let (f, truth) = (random(15, 40, 2), random(11, 15, 3));
    let (c, _) = solve(&f, &product(&truth, &f));
    assert_close(&c, &truth, 1e-12);
    let g = random(11, 40, 4);
    let (c, info) = solve(&f, &g);
    let residual = Matrix::from_vec(11, 40, {
        let image = product(&c, &f);
        image.data().iter().zip(g.data()).map(|(a, b)| a - b).collect()
    });
    assert_close(&product(&residual, &f.transposed()), &Matrix::zeros(11, 15), 1e-11);
    assert!(info.relative_residual > 0.1 && info.relative_residual < 1.0);
}

#[test]
fn dependent_descriptors_are_reported_and_give_the_least_norm() {
    let mut f = random(8, 30, 5);
    let repeated = f.row(2).to_vec();
    f.row_mut(6).copy_from_slice(&repeated);
    let g = random(5, 30, 6);
    let (c, info) = solve(&f, &g);
    assert_eq!(info.rank, 7);
    assert!(info.condition > 1e12);
    // Least norm shares the weight of equal rows evenly.
    for i in 0..5 {
        assert!((c[(i, 2)] - c[(i, 6)]).abs() < 1e-10);
    }
}

#[test]
fn fewer_descriptors_than_eigenfunctions() {
    let (f, g) = (random(20, 6, 7), random(20, 6, 8));
    let (c, info) = solve(&f, &g);
    assert_eq!((info.rank, info.condition), (6, f64::INFINITY));
    assert_close(&product(&c, &f), &g, 1e-11);
    let none = solve(&Matrix::zeros(4, 6), &random(4, 6, 9));
    assert_eq!((none.0, none.1.rank), (Matrix::zeros(4, 4), 0));
}

#[test]
fn regularized_rows_meet_their_equation() {
    let (source, target) = (rectangle(12, 15, 18), rectangle(14, 13, 16));
    let (f, g) = (random(18, 40, 10), random(16, 40, 11));
    let weight = 0.3;
    let (c, _) = functional_map(&source, &target, &f, &g, FmapSolver::Regularized { weight }).unwrap();
    let mask = resolvent_mask(&scale_free_eigenvalues(&source), &scale_free_eigenvalues(&target));
    let gram = product(&f, &f.transposed());
    let mean = (0..18).map(|i| gram[(i, i)]).sum::<f64>() / 18.0;
    let (left, right) = (product(&c, &gram), product(&g, &f.transposed()));
    let left = Matrix::from_fn(16, 18, |i, j| left[(i, j)] + weight * mean * mask[(i, j)] * c[(i, j)]);
    assert_close(&left, &right, 1e-11);
}

#[test]
fn regularized_without_weight_is_least_squares() {
    let (f, g) = (random(10, 30, 12), random(9, 30, 13));
    let (source, target): (Vec<f64>, Vec<f64>) =
        ((0..10).map(f64::from).collect(), (0..9).map(f64::from).collect());
    let (c, _) = regularized(&f, &g, &source, &target, 0.0).unwrap();
    assert_close(&c, &solve(&f, &g).0, 1e-10);
}

#[test]
fn regularized_singular_system_is_reported() {
    let (f, g) = (random(10, 4, 14), random(10, 4, 15));
    let eigenvalues: Vec<f64> = (0..10).map(f64::from).collect();
    let (c, info) = regularized(&f, &g, &eigenvalues, &eigenvalues, 0.0).unwrap();
    assert_eq!(info.rank, 4);
    assert_close(&product(&c, &f), &g, 1e-8);
    let (_, info) = regularized(&f, &g, &eigenvalues, &eigenvalues, 0.1).unwrap();
    assert_eq!(info.rank, 10, "the mask makes up for missing descriptors");
}

#[test]
fn gradients_equal_central_differences() {
    let (f, g, weights) = (random(5, 9, 41), random(4, 9, 42), random(4, 5, 43));
    let spectrum = |scale: f64, k: usize| (0..k).map(|i| scale * i as f64).collect::<Vec<_>>();
    let mask = resolvent_mask(&spectrum(12.0, 5), &spectrum(13.5, 4));
    type Solve<'a> = &'a dyn Fn(&Matrix, &Matrix) -> FmapSolution;
    let by: [(&str, Solve); 2] = [
        ("least squares", &|f, g| {
            FmapSolution::least_squares(f.clone(), g.clone(), &LeastSquaresOptions::default()).unwrap()
        }),
        ("regularised", &|f, g| FmapSolution::regularized(f.clone(), g.clone(), &mask, 3.0).unwrap()),
    ];
    for (name, solve) in by {
        let loss = |f: &Matrix, g: &Matrix| -> f64 {
            solve(f, g).map().data().iter().zip(weights.data()).map(|(c, w)| w * c * c).sum()
        };
        let solution = solve(&f, &g);
        let upstream = Matrix::from_fn(4, 5, |i, j| 2.0 * weights[(i, j)] * solution.map()[(i, j)]);
        let (grad_f, grad_g) = solution.backward(&upstream);
        let step = 1e-5;
        let moved = |m: &Matrix, entry: usize, by: f64| {
            let mut moved = m.clone();
            moved.data_mut()[entry] += by;
            moved
        };
        for (entry, found) in grad_f.data().iter().enumerate() {
            let difference = loss(&moved(&f, entry, step), &g) - loss(&moved(&f, entry, -step), &g);
            assert!((found - difference / (2.0 * step)).abs() < 1e-7, "{name}, F entry {entry}");
        }
        for (entry, found) in grad_g.data().iter().enumerate() {
            let difference = loss(&f, &moved(&g, entry, step)) - loss(&f, &moved(&g, entry, -step));
            assert!((found - difference / (2.0 * step)).abs() < 1e-7, "{name}, G entry {entry}");
        }
    }
}

#[test]
fn a_solution_s_map_is_that_of_the_plain_solve() {
    let (f, g) = (random(10, 30, 44), random(9, 30, 45));
    let spectrum = |k: i32| (0..k).map(f64::from).collect::<Vec<_>>();
    let (source, target) = (spectrum(10), spectrum(9));
    let mask = resolvent_mask(&source, &target);
    let kept = FmapSolution::regularized(f.clone(), g.clone(), &mask, 0.1).unwrap();
    let (c, info) = regularized(&f, &g, &source, &target, 0.1).unwrap();
    assert_eq!((kept.map(), kept.info()), (&c, &info));
    let plain = LeastSquaresOptions::default();
    let kept_plain = FmapSolution::least_squares(f.clone(), g.clone(), &plain).unwrap();
    let (c, info) = least_squares(&f, &g, &plain).unwrap();
    assert_eq!((kept_plain.map(), kept_plain.info()), (&c, &info));
    let conditions = [kept.gram_condition().unwrap(), kept_plain.gram_condition().unwrap()];
    assert!((conditions[0] / conditions[1] - 1.0).abs() < 1e-9, "{conditions:?}");
    let wrong = FmapSolution::regularized(f, g, &mask.transposed(), 0.1).unwrap_err();
    assert!(matches!(wrong, FmapError::SizeMismatch { .. }));
}

#[test]
fn resolvent_mask_vanishes_where_spectra_agree_and_ignores_scale() {
    let eigenvalues = [-1e-15, 1.0, 4.0, 9.0];
    let mask = resolvent_mask(&eigenvalues, &eigenvalues[..3]);
    assert_eq!((mask.rows(), mask.cols()), (3, 4));
    assert!((0..3).all(|i| mask[(i, i)] == 0.0));
    // At the largest eigenvalue g = 1: re = im = 1/2, against re = 0, im = 1 at zero.
    assert!((mask[(0, 3)] - 0.5).abs() < 1e-15);
    let scaled = |factor: f64| eigenvalues.map(|x| factor * x);
    assert_close(
        &resolvent_mask(&scaled(1e4), &scaled(1e4)),
        &resolvent_mask(&eigenvalues, &eigenvalues),
        1e-15,
    );
    assert_eq!(resolvent_mask(&[0.0], &[0.0]), Matrix::zeros(1, 1));
}

#[test]
fn shapes_of_different_size_match() {
    let source = rectangle(12, 15, 20);
    // The same shape in a unit 100 times smaller.
    let target = Eigenbasis {
        eigenvalues: source.eigenvalues.iter().map(|x| x / 1e4).collect(),
        eigenvectors: source.eigenvectors.map(|x| x / 100.0),
        mass: source.mass.iter().map(|x| x * 1e4).collect(),
    };
    let f = random(20, 30, 16);
    let scaled = f.map(|x| 100.0 * x);
    let (c, _) = functional_map(&source, &target, &f, &scaled, REGULARIZED).unwrap();
    assert_close(&c, &identity(20).map(|x| 100.0 * x), 1e-10);
}

#[test]
fn eigenvector_signs_only_change_signs() {
    let basis = rectangle(12, 15, 20);
    let (f, g) = (random(20, 30, 17), random(20, 30, 18));
    let flipped_g = Matrix::from_fn(20, 30, |i, j| sign(i) * g[(i, j)]);
    for solver in [FmapSolver::LeastSquares, REGULARIZED] {
        let (c, _) = functional_map(&basis, &basis, &f, &g, solver).unwrap();
        let (other, _) = functional_map(&basis, &flipped(&basis), &f, &flipped_g, solver).unwrap();
        assert_close(&other, &Matrix::from_fn(20, 20, |i, j| sign(i) * c[(i, j)]), 1e-12);
    }
}

#[test]
fn point_map_to_functional_map() {
    let basis = rectangle(40, 50, 20);
    let all: Vec<u32> = (0..2000).collect();
    let same = functional_map_of(&PointMap::new(all, 2000), &basis, &basis).unwrap();
    assert_close(&same, &identity(20), 1e-12);

    // Target vertex i is source vertex order[i], so source vertex order[i] goes to i.
    let order = shuffle(2000);
    let target = reordered(&basis, &order);
    let mut targets = vec![0; 2000];
    order.iter().enumerate().for_each(|(i, &x)| targets[x as usize] = i as u32);
    let mut map = PointMap::new(targets, 2000);
    assert_close(&functional_map_of(&map, &basis, &target).unwrap(), &identity(20), 1e-12);

    // An unmatched vertex takes away exactly its own term.
    map.targets[7] = PointMap::UNMATCHED;
    let phi = basis.eigenvectors.row(7);
    let expected = Matrix::from_fn(20, 20, |i, j| identity(20)[(i, j)] - basis.mass[7] * phi[i] * phi[j]);
    assert_close(&functional_map_of(&map, &basis, &target).unwrap(), &expected, 1e-12);

    map.targets[9] = 2000;
    let outside = FmapError::TargetOutOfRange { vertex: 9, target: 2000, n_target: 2000 };
    assert_eq!(functional_map_of(&map, &basis, &target), Err(outside));
    let short = functional_map_of(&PointMap::new(vec![0; 3], 2000), &basis, &target);
    assert!(matches!(short, Err(FmapError::SizeMismatch { found: 3, expected: 2000, .. })));
}

#[test]
fn soft_columns_are_normalised() {
    let (source, target) = (rectangle(9, 8, 10), rectangle(7, 11, 12));
    let c = random(12, 10, 19);
    for norm in [ColumnNorm::L2, ColumnNorm::L1] {
        let soft = SoftCorrespondence::new(&source, &target, &c, norm).unwrap();
        let dense = soft.dense(1 << 20).unwrap();
        assert_eq!((dense.rows(), dense.cols()), (77, 72));
        let peaks = soft.peaks();
        for x in 0..72 {
            let column: Vec<f64> = (0..77).map(|y| f64::from(dense[(y, x)])).collect();
            let (sum, squares) = (column.iter().sum::<f64>(), column.iter().map(|p| p * p).sum::<f64>());
            let one = if norm == ColumnNorm::L2 { squares } else { sum };
            assert!((one - 1.0).abs() < 1e-5);
            let largest = column.iter().copied().fold(0.0, f64::max);
            assert!((peaks[x].weight - largest).abs() < 1e-6);
            assert_eq!(column[peaks[x].target as usize], largest);
            assert!((peaks[x].spread - sum * sum / squares).abs() < 1e-3);
        }
    }
}

#[test]
fn column_norms_are_read_by_name() {
    assert_eq!("l2".parse(), Ok(ColumnNorm::L2));
    assert_eq!("l1".parse(), Ok(ColumnNorm::L1));
    assert!("l3".parse::<ColumnNorm>().unwrap_err().contains("l2 or l1"));
}

#[test]
fn soft_correspondence_of_the_full_basis_is_the_identity() {
    let basis = rectangle(6, 7, 42);
    let soft = SoftCorrespondence::new(&basis, &basis, &identity(42), ColumnNorm::L1).unwrap();
    assert_close(&soft.dense(1 << 20).unwrap().map(f64::from), &identity(42), 1e-6);
    for (x, peak) in soft.peaks().iter().enumerate() {
        assert_eq!(peak.target as usize, x);
        assert!(peak.weight > 1.0 - 1e-9 && peak.spread < 1.0 + 1e-9);
    }
}

#[test]
fn soft_correspondence_refuses_to_fill_the_memory() {
    let basis = rectangle(9, 8, 5);
    let soft = SoftCorrespondence::new(&basis, &basis, &identity(5), ColumnNorm::L2).unwrap();
    let expected = FmapError::TooLarge { n_target: 72, n_source: 72, needed: 4 * 72 * 72, allowed: 1000 };
    assert_eq!(soft.dense(1000), Err(expected));
    let zero = SoftCorrespondence::new(&basis, &basis, &Matrix::zeros(5, 5), ColumnNorm::L2).unwrap();
    assert!(zero.peaks().iter().all(|peak| *peak == SoftPeak { target: 0, weight: 0.0, spread: 0.0 }));
    let none = Eigenbasis { eigenvectors: Matrix::zeros(0, 5), mass: Vec::new(), ..basis.clone() };
    let nowhere = SoftCorrespondence::new(&basis, &none, &identity(5), ColumnNorm::L2).unwrap_err();
    assert_eq!(nowhere, FmapError::Empty { what: "the target's basis" });
}

#[test]
fn misuse_is_an_error() {
    let basis = rectangle(9, 8, 5);
    let f = random(5, 4, 20);
    let solve = |f: &Matrix, g: &Matrix, solver| functional_map(&basis, &basis, f, g, solver).map(|_| ());
    let counts = FmapError::DescriptorCount { source_count: 4, target_count: 3 };
    assert_eq!(solve(&f, &random(5, 3, 21), FmapSolver::LeastSquares), Err(counts));
    assert!(matches!(
        solve(&random(6, 4, 22), &f, REGULARIZED),
        Err(FmapError::SizeMismatch { found: 6, .. })
    ));
    assert!(matches!(
        solve(&Matrix::zeros(5, 0), &Matrix::zeros(5, 0), REGULARIZED),
        Err(FmapError::Empty { .. })
    ));
    let mut nan = f.clone();
    nan[(3, 1)] = f64::NAN;
    assert!(matches!(solve(&f, &nan, FmapSolver::LeastSquares), Err(FmapError::NotFinite { row: 3, .. })));
    let negative = FmapSolver::Regularized { weight: -1.0 };
    assert_eq!(solve(&f, &f, negative), Err(FmapError::BadWeight { weight: -1.0 }));
}

#[test]
fn thread_count_does_not_matter() {
    let basis = rectangle(100, 90, 30);
    let (f, g) = (random(30, 60, 23), random(30, 60, 24));
    let map = PointMap::new(shuffle(9000), 9000);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (c, _) = functional_map(&basis, &basis, &f, &g, REGULARIZED).unwrap();
            let peaks = SoftCorrespondence::new(&basis, &basis, &c, ColumnNorm::L2).unwrap().peaks();
            (c, functional_map_of(&map, &basis, &basis).unwrap(), peaks)
        })
    };
    assert!(run(1) == run(3));
}
