//! Meyer's wavelets on a spectrum.
//!
//! Six bands cover the eigenvalues from 0 to the largest: one scaling function for the lowest, five wavelets, each an
//! octave above the one before. They overlap with the neighbouring ones only, and their squares sum to 1 everywhere,
//! so that a signal is the sum of what it is in each band (a tight frame).

use crate::Matrix;
use std::f64::consts::FRAC_PI_2;

/// The scaling function and the wavelets.
pub(super) const BANDS: usize = 6;
const WAVELETS: i32 = BANDS as i32 - 1;

/// What is left of each entry of a functional map `[k_target, k_source]`, or of the transpose of one back:
/// `sum_s g_s(mu_i) g_s(lambda_j)`, from 1 between equal eigenvalues down to 0 between those of bands that do not
/// overlap.
///
/// The eigenvalues, `[k_source]` and `[k_target]`, should be at unit area; the bands go up to the largest of all. The
/// squares of the bands sum to 1, so that the filter needs no division by them.
pub(super) fn filter_mask(eigenvalues_source: &[f64], eigenvalues_target: &[f64]) -> Matrix {
    let largest = eigenvalues_source.iter().chain(eigenvalues_target).copied().fold(0.0, f64::max);
    let of_all =
        |values: &[f64]| -> Vec<[f64; BANDS]> { values.iter().map(|&value| bands(value, largest)).collect() };
    let (source, target) = (of_all(eigenvalues_source), of_all(eigenvalues_target));
    Matrix::from_fn(target.len(), source.len(), |i, j| {
        target[i].iter().zip(&source[j]).map(|(mu, lambda)| mu * lambda).sum()
    })
}

/// The bands at an eigenvalue of a spectrum up to `largest`, the scaling function first; eigenvalues below zero,
/// which are rounded zeros, count as zero.
pub(super) fn bands(eigenvalue: f64, largest: f64) -> [f64; BANDS] {
    let relative = if largest > 0.0 { eigenvalue.max(0.0) / largest } else { 0.0 };
    // At scale s the wavelet reaches from 2/3 to 8/3 in s lambda; the finest, s = 4 / (3 largest), peaks at the
    // largest.
    let scaled = |octave: i32| 4.0 / 3.0 * f64::from(octave).exp2() * relative;
    std::array::from_fn(|band| match band as i32 {
        0 => scaling_function(scaled(WAVELETS - 1)),
        wavelet_band => wavelet(scaled(WAVELETS - wavelet_band)),
    })
}

/// 1 up to 2/3, down to 0 at 4/3.
fn scaling_function(x: f64) -> f64 {
    match x {
        x if x <= 2.0 / 3.0 => 1.0,
        x if x <= 4.0 / 3.0 => (FRAC_PI_2 * auxiliary(1.5 * x - 1.0)).cos(),
        _ => 0.0,
    }
}

/// Up from 0 at 2/3 to 1 at 4/3, down to 0 at 8/3.
fn wavelet(x: f64) -> f64 {
    match x {
        x if x <= 2.0 / 3.0 => 0.0,
        x if x <= 4.0 / 3.0 => (FRAC_PI_2 * auxiliary(1.5 * x - 1.0)).sin(),
        x if x <= 8.0 / 3.0 => (FRAC_PI_2 * auxiliary(0.75 * x - 1.0)).cos(),
        _ => 0.0,
    }
}

/// Meyer's auxiliary function, from 0 at 0 to 1 at 1, with `v(x) + v(1 - x) = 1`.
fn auxiliary(x: f64) -> f64 {
    x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_of_the_bands_sum_to_one() {
        for step in 0..=10_000 {
            let squares: f64 = bands(f64::from(step) * 0.07, 700.0).iter().map(|g| g * g).sum();
            assert!((squares - 1.0).abs() < 1e-14, "step {step}: {squares}");
        }
    }

    #[test]
    fn each_band_is_an_octave_above_the_one_before() {
        let at = |relative: f64| bands(relative * 96.0, 96.0);
        assert_eq!(at(0.0), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        // A wavelet is alone where it peaks.
        for band in 1..BANDS {
            let peak = at(f64::from(1 << (band - 1)) / 16.0);
            for (other, g) in peak.iter().enumerate() {
                let expected = if other == band { 1.0 } else { 0.0 };
                assert!((g - expected).abs() < 1e-12, "{peak:?}");
            }
        }
        // Half-way between two peaks, on the scale of the wavelets, both are equal.
        let between = at(0.75);
        assert!((between[4] - between[5]).abs() < 1e-12 && (between[5] - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!(bands(0.0, 0.0), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(bands(-1e-12, 3.0), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn the_mask_keeps_equal_frequencies_and_drops_far_ones() {
        let (source, target) = ([0.0, 1.0, 5.0, 16.0, 80.0], [0.0, 1.0, 5.5, 80.0]);
        let mask = filter_mask(&source, &target);
        assert_eq!((mask.rows(), mask.cols()), (4, 5));
        for (i, j) in [(0, 0), (1, 1), (3, 4)] {
            assert!((mask[(i, j)] - 1.0).abs() < 1e-14);
        }
        assert!(mask[(2, 2)] > 0.9 && mask[(2, 2)] < 1.0);
        assert_eq!((mask[(0, 4)], mask[(3, 1)]), (0.0, 0.0));
        assert_eq!(filter_mask(&target, &source), mask.transposed());
    }
}
