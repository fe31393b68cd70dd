//! How well descriptors tell the right match from the others.

use faer::linalg::matmul::matmul;
use faer::{Accum, Par};
use rayon::prelude::*;

use super::{EvalError, GroundTruth, check_size};
use crate::Matrix;

/// Correct matches ranked together, which bounds the memory to this many rows of distances a thread.
const CHUNK: usize = 64;

/// Rank of the correct match among all target vertices in the order of their l2 distance to the source vertex in
/// descriptor space, from 1, for each pair of the ground truth; of equal distances the lower index comes first.
///
/// `source` is `[n_source, d]`, `target` `[n_target, d]`.
///
/// # Errors
/// If the descriptors are not of the ground truth's shapes, or differ in width.
pub fn match_ranks(
    source: &Matrix<f32>,
    target: &Matrix<f32>,
    ground_truth: &GroundTruth,
) -> Result<Vec<u32>, EvalError> {
    check_descriptors(source, target, ground_truth)?;
    let half_norms: Vec<f32> =
        (0..target.rows()).map(|y| 0.5 * target.row(y).iter().map(|v| v * v).sum::<f32>()).collect();
    let ranks = ground_truth.pairs().par_chunks(CHUNK).map(|pairs| {
        let sources: Vec<u32> = pairs.iter().map(|p| p.0).collect();
        let queries = source.select_rows(&sources);
        let mut products = Matrix::<f32>::zeros(pairs.len(), target.rows());
        let transposed = target.as_faer().transpose();
        matmul(products.as_faer_mut(), Accum::Replace, queries.as_faer(), transposed, 1.0f32, Par::Seq);
        let ranks = pairs.iter().enumerate().map(|(i, &(_, correct))| {
            // Half the squared distance, less what all targets share.
            let distance = |y: usize| half_norms[y] - products[(i, y)];
            let own = distance(correct as usize);
            let is_before = |&y: &usize| distance(y) < own || (distance(y) == own && y < correct as usize);
            1 + (0..target.rows()).filter(is_before).count() as u32
        });
        ranks.collect::<Vec<_>>()
    });
    Ok(ranks.collect::<Vec<_>>().concat())
}

/// Cumulative match characteristic: the probability that the correct match is among the `k` nearest in descriptor
/// space, for `k` from 1 to `max_rank`, `[max_rank]`, from the ranks that [`match_ranks`] gives.
pub fn cmc_curve(ranks: &[u32], max_rank: usize) -> Vec<f64> {
    let mut counts = vec![0usize; max_rank];
    for &rank in ranks {
        if let Some(count) = counts.get_mut((rank as usize).wrapping_sub(1)) {
            *count += 1;
        }
    }
    let total = ranks.len().max(1) as f64;
    let cumulative = counts.iter().scan(0, |sum, &count| {
        *sum += count;
        Some(*sum as f64 / total)
    });
    cumulative.collect()
}

/// The l2 distance in descriptor space of each correct match, in the order of the pairs.
///
/// `source` is `[n_source, d]`, `target` `[n_target, d]`.
///
/// # Errors
/// As [`match_ranks`].
pub fn correct_match_distances(
    source: &Matrix<f32>,
    target: &Matrix<f32>,
    ground_truth: &GroundTruth,
) -> Result<Vec<f32>, EvalError> {
    check_descriptors(source, target, ground_truth)?;
    let distance = |&(x, y): &(u32, u32)| {
        let pairs = source.row(x as usize).iter().zip(target.row(y as usize));
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt() as f32
    };
    Ok(ground_truth.pairs().iter().map(distance).collect())
}

fn check_descriptors(
    source: &Matrix<f32>,
    target: &Matrix<f32>,
    ground_truth: &GroundTruth,
) -> Result<(), EvalError> {
    let truth = "the ground truth";
    check_size("the source's descriptors", source.rows(), truth, ground_truth.n_source())?;
    check_size("the target's descriptors", target.rows(), truth, ground_truth.n_target())?;
    if source.cols() == target.cols() {
        return Ok(());
    }
    Err(EvalError::DescriptorWidth { n_source: source.cols(), n_target: target.cols() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn descriptors(n: usize, d: usize, seed: f64) -> Matrix<f32> {
        Matrix::from_fn(n, d, |i, j| ((seed + (i * d + j) as f64).sin() * 43758.5).fract() as f32)
    }

    #[test]
    fn ranks_agree_with_sorting() {
        let (source, target) = (descriptors(150, 5, 1.0), descriptors(90, 5, 2.0));
        let truth = GroundTruth::new((0..150).map(|i| (i, (7 * i) % 90)).collect(), 150, 90).unwrap();
        let ranks = match_ranks(&source, &target, &truth).unwrap();
        for (&(x, correct), rank) in truth.pairs().iter().zip(ranks) {
            let pairs = (0..90).map(|y| (x, y)).collect();
            let row = GroundTruth::new(pairs, 150, 90).unwrap();
            let distances = correct_match_distances(&source, &target, &row).unwrap();
            let nearer = distances.iter().filter(|&&d| d < distances[correct as usize]).count();
            assert_eq!(rank as usize, nearer + 1);
        }
    }

    #[test]
    fn same_descriptors_rank_first_and_equal_ones_by_index() {
        let same = descriptors(70, 4, 3.0);
        let ranks = match_ranks(&same, &same, &GroundTruth::identity(70)).unwrap();
        assert_eq!(ranks, [1; 70]);
        assert_eq!(correct_match_distances(&same, &same, &GroundTruth::identity(70)).unwrap(), [0.0; 70]);
        let flat = Matrix::zeros(3, 2);
        assert_eq!(match_ranks(&flat, &flat, &GroundTruth::identity(3)).unwrap(), [1, 2, 3]);
    }

    #[test]
    fn curve_is_cumulative() {
        assert_eq!(cmc_curve(&[1, 3, 1, 9], 4), [0.5, 0.5, 0.75, 0.75]);
        assert_eq!(cmc_curve(&[], 2), [0.0, 0.0]);
    }

    #[test]
    fn widths_must_agree() {
        let truth = GroundTruth::identity(2);
        let error = match_ranks(&Matrix::zeros(2, 3), &Matrix::zeros(2, 4), &truth);
        assert!(matches!(error, Err(EvalError::DescriptorWidth { n_source: 3, n_target: 4 })));
    }
}
