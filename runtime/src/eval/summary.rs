//! The errors of a map in a few numbers.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::ErrorCurve;

/// The errors of a map, or of several maps taken together, in a few numbers. Errors are lengths over sqrt(area).
///
/// Matches without an error (unmatched vertices, NaN) and matches on another component than the right one (infinite)
/// are left out of [`mean`](Self::mean) and [`worst`](Self::worst), which would say nothing otherwise, but count as
/// wrong in every share and in the curve: a map cannot gain by leaving hard vertices out unseen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorSummary {
    /// Number of correct matches known.
    pub count: usize,
    /// Mean error; 0 where there is none. The field reports it times 100.
    pub mean: f64,
    /// Largest error.
    pub worst: f64,
    /// Mean error in the unit of the target mesh: metres for FAUST.
    pub mean_length: f64,
    /// Largest error in the unit of the target mesh.
    pub worst_length: f64,
    /// Area under the curve from 0 to 0.10, as a share of the best possible.
    pub auc: f64,
    /// Share of matches that are exact, from 0 to 1.
    pub exact: f64,
    /// Share of matches with an error of at most 0.05.
    pub within_005: f64,
    /// Share of the correct matches known whose source vertex was matched at all.
    pub coverage: f64,
    /// Number of matches on another component than the right one.
    pub disconnected: usize,
}

impl ErrorSummary {
    /// Sums up normalised `errors` as [`geodesic_errors`](super::geodesic_errors) gives them, on a target mesh of the
    /// given area, in its squared units (of several maps taken together, the mean area).
    pub fn new(errors: &[f32], area: f64) -> Self {
        let finite = || errors.iter().copied().filter(|e| e.is_finite()).map(f64::from);
        let n_finite = finite().count();
        let n_unmatched = errors.iter().filter(|e| e.is_nan()).count();
        let share = |limit: f32| {
            let within = errors.iter().filter(|&&e| e <= limit).count();
            within as f64 / errors.len().max(1) as f64
        };
        let mean = finite().sum::<f64>() / n_finite.max(1) as f64;
        let worst = finite().fold(0.0, f64::max);
        Self {
            count: errors.len(),
            mean,
            worst,
            mean_length: mean * area.sqrt(),
            worst_length: worst * area.sqrt(),
            auc: ErrorCurve::princeton(errors).auc(),
            exact: share(0.0),
            within_005: share(0.05),
            coverage: (errors.len() - n_unmatched) as f64 / errors.len().max(1) as f64,
            disconnected: errors.len() - n_unmatched - n_finite,
        }
    }
}

impl fmt::Display for ErrorSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
        if self.disconnected > 0 {
            write!(f, ", {} on another component", self.disconnected)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unmatched_and_disconnected_lower_the_shares_only() {
        let summary = ErrorSummary::new(&[0.0, 0.02, 0.07, f32::NAN, f32::INFINITY], 4.0);
        assert!((summary.mean - 0.03).abs() < 1e-8 && (summary.worst - 0.07).abs() < 1e-8);
        assert_eq!((summary.exact, summary.within_005, summary.coverage), (0.2, 0.4, 0.8));
        assert_eq!((summary.count, summary.disconnected), (5, 1));
        assert!((summary.mean_length - 0.06).abs() < 1e-8);
        assert!((summary.worst_length - 0.14).abs() < 1e-8);
        let text = summary.to_string();
        assert!(text.contains("coverage 80.00 %") && text.contains("1 on another component"), "{text}");
    }

    #[test]
    fn perfect_map_and_no_map() {
        let perfect = ErrorSummary::new(&[0.0; 4], 1.0);
        assert_eq!((perfect.mean, perfect.exact, perfect.coverage), (0.0, 1.0, 1.0));
        assert!((perfect.auc - 1.0).abs() < 1e-12);
        assert_eq!(ErrorSummary::new(&[], 1.0).mean, 0.0);
    }
}
