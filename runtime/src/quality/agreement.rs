//! Whether the descriptors see a likeness between what a map matches.

use crate::Matrix;
use crate::point_map::PointMap;

/// Mean cosine between the descriptors of matches, by the area of the source; none without any match, or where rows
/// are missing.
pub(super) fn measure(
    map: &PointMap,
    areas: &[f64],
    source: &Matrix<f32>,
    target: &Matrix<f32>,
) -> Option<f64> {
    if source.rows() != map.len() || areas.len() != map.len() || source.cols() != target.cols() {
        return None;
    }
    let (mut sum, mut total) = (0.0, 0.0);
    for (i, area) in areas.iter().enumerate() {
        let Some(j) = map.get(i) else { continue };
        if j as usize >= target.rows() {
            return None;
        }
        sum += area * cosine(source.row(i), target.row(j as usize));
        total += area;
    }
    (total > 0.0).then(|| sum / total)
}

/// 0 where a row is 0.
fn cosine(a: &[f32], b: &[f32]) -> f64 {
    let dot = |a: &[f32], b: &[f32]| -> f64 { a.iter().zip(b).map(|(x, y)| f64::from(x * y)).sum() };
    dot(a, b) / (dot(a, a) * dot(b, b)).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_cosine_is_weighted_by_area() {
        let source = Matrix::from_vec(3, 2, vec![1.0, 0.0, 0.0, 2.0, 3.0, 3.0]);
        let target = Matrix::from_vec(2, 2, vec![5.0, 0.0, 0.0, 0.0]);
        let measure = |targets: Vec<u32>| {
            super::measure(&PointMap::new(targets, 2), &[1.0, 2.0, 5.0], &source, &target)
        };
        // Cosines 1, 0 and 1 / sqrt(2).
        let expected = (1.0 + 5.0 * 0.5f64.sqrt()) / 8.0;
        assert!((measure(vec![0, 0, 0]).unwrap() - expected).abs() < 1e-7);
        assert_eq!(measure(vec![0, PointMap::UNMATCHED, 1]), Some(1.0 / 6.0));
        assert_eq!(measure(vec![PointMap::UNMATCHED; 3]), None);
        assert_eq!(measure(vec![0, 0]), None);
    }
}
