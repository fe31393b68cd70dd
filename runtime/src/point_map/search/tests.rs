use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The definition: a double loop, with the search's own distance.
fn naive(queries: &Matrix, targets: &Matrix) -> Nearest {
    let kernels = Kernels::Portable;
    let mut nearest = Nearest::default();
    for q in 0..queries.rows() {
        let mut best = (f64::INFINITY, 0);
        for t in 0..targets.rows() {
            let distance = kernels.squared_distance(queries.row(q), targets.row(t));
            if distance < best.0 {
                best = (distance, t as u32);
            }
        }
        nearest.index.push(best.1);
        nearest.squared_distance.push(best.0);
    }
    nearest
}

fn random(rows: usize, cols: usize, rng: &mut ChaCha8Rng) -> Matrix {
    Matrix::from_fn(rows, cols, |_, _| rng.random_range(-1.0..1.0))
}

/// Points on a curved two-dimensional sheet in `R^cols`, moved off it by `noise`.
fn sheet(rows: usize, cols: usize, noise: f64, rng: &mut ChaCha8Rng) -> Matrix {
    let mut points = Matrix::zeros(rows, cols);
    for i in 0..rows {
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        for (t, x) in points.row_mut(i).iter_mut().enumerate() {
            let (a, b) = ((t % 7) as f64, (t / 7) as f64);
            *x = (3.0 * a * u).cos() * (3.0 * b * v).cos() + noise * rng.random_range(-1.0..1.0);
        }
    }
    points
}

#[test]
fn sheet_agrees_with_double_loop() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (cols, noise) in [(1, 0.0), (3, 0.1), (20, 0.0), (20, 0.5), (35, 3.0)] {
        let targets = sheet(1500, cols, 0.0, &mut rng);
        let queries = sheet(300, cols, noise, &mut rng);
        assert_eq!(nearest_rows(&queries, &targets).unwrap(), naive(&queries, &targets), "{cols} columns");
    }
}

#[test]
fn structureless_points_agree_with_double_loop() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for (n_targets, cols) in [(1, 5), (2, 1), (7, 9), (400, 16), (700, 40)] {
        let targets = random(n_targets, cols, &mut rng);
        let queries = random(97, cols, &mut rng);
        assert_eq!(nearest_rows(&queries, &targets).unwrap(), naive(&queries, &targets));
    }
}

#[test]
fn ties_and_duplicates_go_to_the_lowest_index() {
    // A small integer lattice, every point four times over; queries on the lattice and half way between its
    // points.
    let targets = Matrix::from_fn(4 * 125, 3, |i, t| ((i % 125) / [1, 5, 25][t] % 5) as f64);
    let queries = Matrix::from_fn(729, 3, |i, t| (i / [1, 9, 81][t] % 9) as f64 / 2.0);
    let found = nearest_rows(&queries, &targets).unwrap();
    assert_eq!(found, naive(&queries, &targets));
    assert!(found.index.iter().all(|&i| i < 125));
}

#[test]
fn equal_points_everywhere() {
    let targets = Matrix::from_fn(300, 4, |_, t| t as f64);
    let found = nearest_rows(&Matrix::zeros(5, 4), &targets).unwrap();
    assert_eq!(found.index, [0; 5]);
    let origin = nearest_rows(&Matrix::zeros(2, 4), &Matrix::zeros(90, 4)).unwrap();
    assert_eq!(origin, Nearest { index: vec![0; 2], squared_distance: vec![0.0; 2] });
}

#[test]
fn near_ties_below_single_precision_are_decided_in_double() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let targets = Matrix::from_fn(500, 12, |_, t| 1.0 + t as f64 + 1e-9 * rng.random_range(-1.0..1.0));
    let queries = Matrix::from_fn(200, 12, |_, t| 1.0 + t as f64 + 1e-9 * rng.random_range(-1.0..1.0));
    assert_eq!(nearest_rows(&queries, &targets).unwrap(), naive(&queries, &targets));
}

#[test]
fn extreme_units_change_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (targets, queries) = (sheet(800, 20, 0.0, &mut rng), sheet(100, 20, 0.3, &mut rng));
    let expected = nearest_rows(&queries, &targets).unwrap().index;
    for exponent in [-80, -20, 20, 80] {
        let factor = 2f64.powi(exponent);
        let scaled = nearest_rows(&queries.map(|x| x * factor), &targets.map(|x| x * factor)).unwrap();
        assert_eq!(scaled.index, expected);
    }
    // Queries so far away that single precision overflows.
    let far = queries.map(|x| x * 1e30);
    assert_eq!(nearest_rows(&far, &targets).unwrap(), naive(&far, &targets));
}

#[test]
fn portable_loops_give_the_same_bytes() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (targets, queries) = (sheet(900, 30, 0.0, &mut rng), sheet(200, 30, 0.2, &mut rng));
    let mut search = NearestRows::new(&targets).unwrap();
    let found = search.nearest(&queries).unwrap();
    search.kernels = Kernels::Portable;
    assert_eq!(search.nearest(&queries).unwrap(), found);
}

#[test]
fn thread_count_does_not_matter() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (targets, queries) = (sheet(3000, 20, 0.0, &mut rng), sheet(1000, 20, 0.2, &mut rng));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| nearest_rows(&queries, &targets).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn misuse_is_an_error() {
    let one = Matrix::from_fn(1, 2, |_, _| 1.0);
    assert_eq!(nearest_rows(&one, &Matrix::zeros(0, 2)), Err(SearchError::NoTargets));
    let wide = SearchError::WidthMismatch { queries: 2, targets: 3 };
    assert_eq!(nearest_rows(&one, &Matrix::zeros(1, 3)), Err(wide));
    let nan = Matrix::from_fn(2, 2, |i, _| if i == 1 { f64::NAN } else { 0.0 });
    assert_eq!(nearest_rows(&one, &nan), Err(SearchError::NotFinite { role: "targets", row: 1 }));
    assert_eq!(nearest_rows(&nan, &one), Err(SearchError::NotFinite { role: "queries", row: 1 }));
    assert!(nearest_rows(&Matrix::zeros(0, 2), &one).unwrap().index.is_empty());
}
