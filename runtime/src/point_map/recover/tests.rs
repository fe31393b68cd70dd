use super::*;
use crate::fmap::functional_map_of;
use crate::fmap::test_basis::{flipped, identity, rectangle, reordered, shuffle, sign};

const COMPARISONS: [Comparison; 3] = [Comparison::Distance, Comparison::Adjoint, Comparison::Joint];

#[test]
fn identity_map_of_one_shape() {
    let basis = rectangle(30, 40, 25);
    for comparison in COMPARISONS {
        let map = recover_by(comparison, &identity(25), &basis, &basis).unwrap();
        assert!(map.targets.iter().enumerate().all(|(x, &y)| x == y as usize));
        assert_eq!(map.n_target, 1200);
        assert!(map.confidence.unwrap().iter().all(|&confidence| confidence > 1.0 - 1e-6));
    }
}

#[test]
fn permuted_copy_gives_back_the_permutation() {
    let source = rectangle(30, 40, 25);
    let order = shuffle(1200);
    let target = reordered(&source, &order);
    for comparison in COMPARISONS {
        let map = recover_by(comparison, &identity(25), &source, &target).unwrap();
        assert!(
            order.iter().enumerate().all(|(place, &vertex)| map.targets[vertex as usize] == place as u32)
        );
        assert_eq!(functional_map_of(&map, &source, &target).unwrap().rows(), 25);
    }
}

#[test]
fn eigenvector_signs_leave_the_map_unchanged() {
    let (source, target) = (rectangle(30, 40, 25), rectangle(37, 31, 20));
    let c = Matrix::from_fn(20, 25, |i, j| ((i * 25 + j) as f64).sin() + if i == j { 4.0 } else { 0.0 });
    let flipped_c = Matrix::from_fn(20, 25, |i, j| sign(i) * c[(i, j)]);
    for comparison in COMPARISONS {
        let expected = recover_by(comparison, &c, &source, &target).unwrap();
        assert_eq!(recover_by(comparison, &flipped_c, &source, &flipped(&target)).unwrap(), expected);
    }
}

#[test]
fn confidence_falls_where_the_map_contradicts_itself() {
    let basis = rectangle(30, 40, 25);
    let noisy =
        Matrix::from_fn(25, 25, |i, j| identity(25)[(i, j)] + ((i * 25 + j) as f64 * 7.3).sin() / 3.0);
    let mean = |c: &Matrix| {
        let confidence = recover(c, &basis, &basis).unwrap().confidence.unwrap();
        assert!(confidence.iter().all(|c| (0.0..=1.0).contains(c)));
        confidence.iter().sum::<f32>() / confidence.len() as f32
    };
    assert!(mean(&noisy) < 0.9);
    assert_eq!(mean(&Matrix::zeros(25, 25)), 0.0);
}

#[test]
fn map_in_the_wrong_direction_is_an_error() {
    let (source, target) = (rectangle(9, 8, 10), rectangle(9, 8, 12));
    let wrong = recover(&Matrix::zeros(10, 12), &source, &target);
    let expected = RecoverError::ShapeMismatch { rows: 10, cols: 12, k_target: 12, k_source: 10 };
    assert_eq!(wrong, Err(expected));
    let nan = Matrix::from_fn(12, 10, |_, _| f64::NAN);
    assert!(matches!(
        recover(&nan, &source, &target),
        Err(RecoverError::Search(SearchError::NotFinite { .. }))
    ));
}
