//! The calibration of the quality estimate: what the measures of a map say of its error, fitted on maps whose errors
//! are known.
//!
//! The logarithm of the error is fitted by ridge regression, the odds that a map is bad by logistic regression with
//! the good and the bad maps of equal weight; both on [`Calibration::features`]. Beside these a map is doubtful whose
//! descriptors agree less than those of nearly all good maps.

use fmnet::quality::{Calibration, Quality};
use thiserror::Error;

/// A mean error, relative to sqrt(area), from which a map is bad.
pub const BAD: f64 = 0.1;
/// Share of the good maps that may be called doubtful.
const FALSE_ALARMS: f64 = 0.1;
/// Share of the good maps whose descriptors may be called unlike.
const UNLIKE: f64 = 0.02;
/// Penalty on the squared weights: a few hundred maps do not determine correlated measures well.
const RIDGE: f64 = 1.0;
const WIDTH: usize = Calibration::WIDTH;
/// Newton's method ends long before.
const ROUNDS: usize = 50;

type Weights = [f64; WIDTH];

/// Why there is no calibration.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum CalibrateError {
    /// Too few maps of a kind.
    #[error(
        "of {maps} maps {bad} are bad (mean error above 0.1 sqrt(area)), but at least {least} must be and as many must not; \
         add pairs, or models and refinements that fail or succeed more often"
    )]
    TooFew {
        /// Maps with measures.
        maps: usize,
        /// Bad ones among them.
        bad: usize,
        /// How many of each kind are needed.
        least: usize,
    },
}

/// Maps of each kind that a fit needs.
const LEAST: usize = 10;

/// Fits a calibration to maps, each with its measures and its mean error relative to sqrt(area).
///
/// # Errors
/// If fewer than ten of them are good, or bad.
pub fn calibrate(maps: &[(Quality, f64)]) -> Result<Calibration, CalibrateError> {
    let bad = maps.iter().filter(|(_, error)| *error > BAD).count();
    if bad.min(maps.len() - bad) < LEAST {
        return Err(CalibrateError::TooFew { maps: maps.len(), bad, least: LEAST });
    }
    let rows: Vec<(Weights, f64)> =
        maps.iter().map(|(quality, error)| (Calibration::features(quality), *error)).collect();
    let logs: Vec<(Weights, f64)> =
        rows.iter().map(|(x, error)| (*x, (100.0 * error).max(1e-2).ln())).collect();
    let error = ridge(&logs);
    let labels: Vec<(Weights, f64)> =
        rows.iter().map(|(x, error)| (*x, f64::from(u8::from(*error > BAD)))).collect();
    let bad = logistic(&labels);
    let calibration = Calibration { error, bad, doubtful: 0.5, agreement: None };
    let mut good: Vec<f64> = maps
        .iter()
        .filter(|(_, error)| *error <= BAD)
        .map(|(quality, _)| calibration.estimate(quality).bad)
        .collect();
    good.sort_by(f64::total_cmp);
    let last_good = good[((1.0 - FALSE_ALARMS) * (good.len() - 1) as f64).round() as usize];
    let agreement = least_agreement(maps);
    Ok(Calibration { doubtful: last_good.clamp(0.5, 0.95), agreement, ..calibration })
}

/// The agreement of descriptors that few of the good maps fall short of; none where it is known of none of them.
fn least_agreement(maps: &[(Quality, f64)]) -> Option<f64> {
    let good = maps.iter().filter(|(_, error)| *error <= BAD);
    let mut known: Vec<f64> = good.filter_map(|(quality, _)| quality.agreement).collect();
    known.sort_by(f64::total_cmp);
    known.get((UNLIKE * known.len() as f64) as usize).copied()
}

/// The weights that minimise `sum (w x - y)^2 + RIDGE |w|^2`, the constant unpenalised.
fn ridge(rows: &[(Weights, f64)]) -> Weights {
    let (mut gram, mut right) = (penalty(), [0.0; WIDTH]);
    for (x, y) in rows {
        accumulate(&mut gram, &mut right, x, 1.0, *y);
    }
    solve(gram, right)
}

/// Logistic regression by Newton's method; both classes weigh the same.
fn logistic(rows: &[(Weights, f64)]) -> Weights {
    let positive: f64 = rows.iter().map(|(_, y)| y).sum();
    let total = rows.len() as f64;
    let mut weights = [0.0; WIDTH];
    for _ in 0..ROUNDS {
        let (mut hessian, mut gradient) = (penalty(), [0.0; WIDTH]);
        for (i, slot) in gradient.iter_mut().enumerate().skip(1) {
            *slot = -RIDGE * weights[i];
        }
        for (x, y) in rows {
            let odds: f64 = x.iter().zip(&weights).map(|(x, w)| x * w).sum();
            let p = 1.0 / (1.0 + (-odds).exp());
            let class = if *y > 0.5 { total / (2.0 * positive) } else { total / (2.0 * (total - positive)) };
            for i in 0..WIDTH {
                gradient[i] += class * (y - p) * x[i];
                for j in 0..WIDTH {
                    hessian[i][j] += class * p * (1.0 - p) * x[i] * x[j];
                }
            }
        }
        let step = solve(hessian, gradient);
        weights.iter_mut().zip(step).for_each(|(w, s)| *w += s);
        if step.iter().all(|s| s.abs() < 1e-10) {
            break;
        }
    }
    weights
}

fn penalty() -> [Weights; WIDTH] {
    let mut matrix = [[0.0; WIDTH]; WIDTH];
    matrix.iter_mut().enumerate().for_each(|(i, row)| row[i] = if i == 0 { 1e-9 } else { RIDGE });
    matrix
}

fn accumulate(gram: &mut [Weights; WIDTH], right: &mut Weights, x: &Weights, weight: f64, y: f64) {
    for i in 0..WIDTH {
        right[i] += weight * x[i] * y;
        for j in 0..WIDTH {
            gram[i][j] += weight * x[i] * x[j];
        }
    }
}

/// Gaussian elimination of a positive definite system, which needs no pivots.
fn solve(mut matrix: [Weights; WIDTH], mut right: Weights) -> Weights {
    for i in 0..WIDTH {
        for j in i + 1..WIDTH {
            let pivot = matrix[i];
            let factor = matrix[j][i] / pivot[i];
            matrix[j].iter_mut().zip(pivot).for_each(|(entry, above)| *entry -= factor * above);
            right[j] -= factor * right[i];
        }
    }
    for i in (0..WIDTH).rev() {
        let known: f64 = (i + 1..WIDTH).map(|k| matrix[i][k] * right[k]).sum();
        right[i] = (right[i] - known) / matrix[i][i];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Maps whose measures grow with their error, with noise.
    fn maps(count: usize) -> Vec<(Quality, f64)> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let map = |_| {
            let error: f64 = (rng.random_range(-4.6..-0.7f64)).exp();
            let mut noisy = |value: f64| value * rng.random_range(-0.3..0.3f64).exp();
            let quality = Quality {
                commutativity: noisy(error),
                orthogonality: noisy(2.0 * error),
                dirichlet: noisy(2.0 + 100.0 * error),
                stretched: noisy(0.1 * error),
                reversed: noisy(0.02 + error),
                cycle: None,
                coverage: 0.7,
                agreement: Some(0.9 - error + 0.05 * (noisy(1.0) - 1.0)),
            };
            (quality, error)
        };
        (0..count).map(map).collect()
    }

    #[test]
    fn errors_are_estimated_and_bad_maps_found() {
        let calibration = calibrate(&maps(300)).unwrap();
        let tried = maps(600).split_off(300);
        let (mut ratio, mut wrong) = (0.0, 0);
        for (quality, error) in &tried {
            let estimate = calibration.estimate(quality);
            ratio += (estimate.expected_error / (100.0 * error)).ln().abs();
            wrong += usize::from(estimate.doubtful != (*error > BAD));
        }
        assert!(ratio / tried.len() as f64 <= 0.2, "{}", ratio / tried.len() as f64);
        assert!(wrong < tried.len() / 8, "{wrong}");
    }

    #[test]
    fn good_and_bad_maps_are_needed() {
        let good: Vec<(Quality, f64)> = maps(100).into_iter().filter(|(_, error)| *error < BAD).collect();
        let failed = calibrate(&good).unwrap_err();
        assert_eq!(failed, CalibrateError::TooFew { maps: good.len(), bad: 0, least: LEAST });
    }

    #[test]
    fn few_of_the_good_maps_agree_less_than_the_limit() {
        let maps = maps(600);
        let least = calibrate(&maps).unwrap().agreement.unwrap();
        let good: Vec<&Quality> = maps.iter().filter(|(_, error)| *error <= BAD).map(|(q, _)| q).collect();
        let below = good.iter().filter(|quality| quality.agreement.unwrap() < least).count();
        assert_eq!(below, (UNLIKE * good.len() as f64) as usize);
        let unknown =
            maps.into_iter().map(|(quality, error)| (Quality { agreement: None, ..quality }, error));
        assert_eq!(calibrate(&unknown.collect::<Vec<_>>()).unwrap().agreement, None);
    }

    #[test]
    fn systems_are_solved() {
        let mut matrix = penalty();
        matrix[0] = [2.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        matrix[1] = [1.0, 3.0, 0.0, 0.0, 0.0, 0.0];
        let found = solve(matrix, [5.0, 10.0, 0.0, 0.0, 0.0, 4.0]);
        let expected = [1.0, 3.0, 0.0, 0.0, 0.0, 4.0 / RIDGE];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}
