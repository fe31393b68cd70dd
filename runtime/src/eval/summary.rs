//! The errors of a map in a few numbers.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::ErrorCurve;

/// The errors of a map, or of several maps taken together, in a few numbers. Errors are lengths over sqrt(area).
///
/// Unmatched vertices (NaN) are left out of [`mean`](Self::mean) and [`worst`](Self::worst), but count as wrong in
/// every share and in the curve: a map cannot gain by leaving hard vertices out unseen. What cannot be measured is
/// NaN: mean and worst where no vertex is matched, everything where no correct match is known. JSON has `null` for
/// it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorSummary {
    /// Number of correct matches known.
    pub count: usize,
    /// Mean error. The field reports it times 100.
    #[serde(deserialize_with = "number")]
    pub mean: f64,
    /// Largest error.
    #[serde(deserialize_with = "number")]
    pub worst: f64,
    /// Mean error in the unit of the target mesh: metres for FAUST.
    #[serde(deserialize_with = "number")]
    pub mean_length: f64,
    /// Largest error in the unit of the target mesh.
    #[serde(deserialize_with = "number")]
    pub worst_length: f64,
    /// Area under the curve from 0 to 0.10, as a share of the best possible.
    #[serde(deserialize_with = "number")]
    pub auc: f64,
    /// Share of matches that are exact, from 0 to 1.
    #[serde(deserialize_with = "number")]
    pub exact: f64,
    /// Share of matches with an error of at most 0.05.
    #[serde(deserialize_with = "number")]
    pub within_005: f64,
    /// Share of the correct matches known whose source vertex was matched at all.
    #[serde(deserialize_with = "number")]
    pub coverage: f64,
}

/// A number, or NaN for `null`.
fn number<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

impl ErrorSummary {
    /// Sums up normalised `errors` as [`geodesic_errors`](super::geodesic_errors) gives them, on a target mesh of the
    /// given area, in its squared units (of several maps taken together, the mean area).
    pub fn new(errors: &[f32], area: f64) -> Self {
        let finite = || errors.iter().copied().filter(|e| e.is_finite()).map(f64::from);
        let (n_finite, n) = (finite().count() as f64, errors.len() as f64);
        let n_matched = errors.iter().filter(|e| !e.is_nan()).count();
        // Divided by zero, where nothing is to be measured, these are NaN.
        let share = |limit: f32| errors.iter().filter(|&&e| e <= limit).count() as f64 / n;
        let mean = finite().sum::<f64>() / n_finite;
        let worst = finite().fold(f64::NAN, f64::max);
        Self {
            count: errors.len(),
            mean,
            worst,
            mean_length: mean * area.sqrt(),
            worst_length: worst * area.sqrt(),
            auc: if errors.is_empty() { f64::NAN } else { ErrorCurve::princeton(errors).auc() },
            exact: share(0.0),
            within_005: share(0.05),
            coverage: n_matched as f64 / n,
        }
    }
}

impl fmt::Display for ErrorSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.count == 0 {
            return f.write_str("no correct match is known, so there is nothing to measure");
        }
        if self.mean.is_nan() {
            return write!(
                f,
                "none of the {} vertices with a known match is matched, so there is nothing to measure",
                self.count
            );
        }
        write!(
            f,
            "mean error x 100: {:.3}, exact {:.2} %, within 0.05 {:.2} %, AUC {:.4}, worst x 100: {:.1}",
            100.0 * self.mean,
            100.0 * self.exact,
            100.0 * self.within_005,
            self.auc,
            100.0 * self.worst
        )?;
        if self.coverage < 1.0 {
            write!(f, ", coverage {:.2} %", 100.0 * self.coverage)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unmatched_vertices_lower_the_shares_only() {
        let summary = ErrorSummary::new(&[0.0, 0.02, 0.07, f32::NAN], 4.0);
        assert!((summary.mean - 0.03).abs() < 1e-8 && (summary.worst - 0.07).abs() < 1e-8);
        assert_eq!((summary.exact, summary.within_005, summary.coverage), (0.25, 0.5, 0.75));
        assert_eq!(summary.count, 4);
        assert!((summary.mean_length - 0.06).abs() < 1e-8);
        assert!((summary.worst_length - 0.14).abs() < 1e-8);
        assert!(summary.to_string().contains("coverage 75.00 %"), "{summary}");
    }

    #[test]
    fn a_perfect_map() {
        let perfect = ErrorSummary::new(&[0.0; 4], 1.0);
        assert_eq!((perfect.mean, perfect.exact, perfect.coverage), (0.0, 1.0, 1.0));
        assert!((perfect.auc - 1.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_to_measure_is_not_zero() {
        let unmatched = ErrorSummary::new(&[f32::NAN; 3], 1.0);
        assert!(unmatched.mean.is_nan() && unmatched.worst.is_nan() && unmatched.mean_length.is_nan());
        assert_eq!((unmatched.exact, unmatched.coverage), (0.0, 0.0));
        assert!(unmatched.to_string().contains("none of the 3 vertices"), "{unmatched}");
        let nothing = ErrorSummary::new(&[], 1.0);
        assert!([nothing.mean, nothing.exact, nothing.auc, nothing.coverage].iter().all(|x| x.is_nan()));
        assert!(nothing.to_string().contains("nothing to measure"));
        let json = serde_json::to_string(&unmatched).unwrap();
        assert!(json.contains("\"mean\":null"), "{json}");
        let read: ErrorSummary = serde_json::from_str(&json).unwrap();
        assert!(read.mean.is_nan() && read.exact == 0.0);
    }
}
