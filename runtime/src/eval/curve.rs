//! Cumulative error curves.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

/// Share of matches whose error is at most a threshold, for rising thresholds.
///
/// The share at 0 is that of exact matches, as in the paper's figures. Unmatched (NaN) and disconnected (infinite)
/// matches count in the denominator and lie beyond every threshold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorCurve {
    /// Normalised errors, ascending.
    pub thresholds: Vec<f64>,
    /// Share of matches up to each threshold, from 0 to 1, `[thresholds]`.
    pub shares: Vec<f64>,
}

impl ErrorCurve {
    /// The curve of the Princeton protocol, of normalised errors: thresholds from 0 to 0.10 in steps of 0.001.
    pub fn princeton(errors: &[f32]) -> Self {
        Self::new(errors, (0..=100).map(|i| f64::from(i) * 0.001).collect())
    }

    /// The curve at the given ascending thresholds.
    pub fn new(errors: &[f32], thresholds: Vec<f64>) -> Self {
        let mut sorted: Vec<f32> = errors.iter().copied().filter(|e| e.is_finite()).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let total = errors.len().max(1) as f64;
        // Compared as f32, so that an error stored as 0.003 is within 0.003.
        let within = |t: f64| sorted.partition_point(|&e| e <= t as f32);
        let shares = thresholds.iter().map(|&t| within(t) as f64 / total).collect();
        Self { thresholds, shares }
    }

    /// The mean of curves with the same thresholds: each map counts the same whatever its size. `None` without
    /// curves, or where thresholds differ.
    pub fn average(curves: &[Self]) -> Option<Self> {
        let first = curves.first()?;
        if curves.iter().any(|c| c.thresholds != first.thresholds) {
            return None;
        }
        let mean = |i: usize| curves.iter().map(|c| c.shares[i]).sum::<f64>() / curves.len() as f64;
        Some(Self {
            thresholds: first.thresholds.clone(),
            shares: (0..first.shares.len()).map(mean).collect(),
        })
    }

    /// Area under the curve over the range of its thresholds, by the trapezoid rule, as a share of the best possible;
    /// 0 where they have no range.
    pub fn auc(&self) -> f64 {
        let (Some(first), Some(last)) = (self.thresholds.first(), self.thresholds.last()) else { return 0.0 };
        let trapezoids = self.thresholds.windows(2).zip(self.shares.windows(2));
        let area: f64 = trapezoids.map(|(t, s)| (t[1] - t[0]) * (s[0] + s[1]) / 2.0).sum();
        if last > first { area / (last - first) } else { 0.0 }
    }

    /// Points (threshold, percent of matches), to plot.
    pub fn points(&self) -> Vec<(f64, f64)> {
        self.thresholds.iter().zip(&self.shares).map(|(&t, &s)| (t, 100.0 * s)).collect()
    }
}

/// Curves of several methods as CSV: a header `threshold,NAME,...`, then a line for each threshold of the first curve
/// with the percentage of each method, empty where a curve has no such threshold.
pub fn curves_csv(curves: &[(&str, &ErrorCurve)]) -> String {
    let mut csv = String::from("threshold");
    for (name, _) in curves {
        csv.push(',');
        csv.push_str(&csv_field(name));
    }
    csv.push('\n');
    let Some((_, first)) = curves.first() else { return csv };
    for (row, threshold) in first.thresholds.iter().enumerate() {
        // Rounded because 3 * 0.001 is not 0.003.
        let _ = write!(csv, "{}", (threshold * 1e9).round() / 1e9);
        for (_, curve) in curves {
            csv.push(',');
            if curve.thresholds.get(row) == Some(threshold) {
                let _ = write!(csv, "{:.4}", 100.0 * curve.shares[row]);
            }
        }
        csv.push('\n');
    }
    csv
}

/// Reads curves as [`curves_csv`] writes them, where no name has a comma or a quote: name and curve of each column. Lines
/// start with a threshold; percentages follow.
///
/// # Errors
/// In words, with the line: no header, a line of another number of columns, or a cell that is no number.
pub fn curves_from_csv(text: &str) -> Result<Vec<(String, ErrorCurve)>, String> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let (_, header) = lines.next().ok_or("no header")?;
    let names: Vec<String> =
        header.split(',').skip(1).map(|name| name.trim_matches('"').to_string()).collect();
    if names.is_empty() {
        return Err("line 1: expected threshold,NAME,...".into());
    }
    let mut curves = vec![ErrorCurve { thresholds: Vec::new(), shares: Vec::new() }; names.len()];
    for (index, line) in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let number = |cell: &str| {
            cell.parse::<f64>().map_err(|_| format!("line {}: {cell:?} is no number", index + 1))
        };
        if cells.len() != names.len() + 1 {
            return Err(format!(
                "line {}: {} columns, but the header has {}",
                index + 1,
                cells.len(),
                names.len() + 1
            ));
        }
        let threshold = number(cells[0])?;
        for (curve, cell) in curves.iter_mut().zip(&cells[1..]).filter(|(_, cell)| !cell.is_empty()) {
            curve.thresholds.push(threshold);
            curve.shares.push(number(cell)? / 100.0);
        }
    }
    Ok(names.into_iter().zip(curves).collect())
}

fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_include_the_threshold_itself() {
        let curve = ErrorCurve::new(&[0.0, 0.0, 0.5, 1.0, f32::NAN], vec![0.0, 0.25, 0.5, 1.0]);
        assert_eq!(curve.shares, [0.4, 0.4, 0.6, 0.8]);
        assert!((curve.auc() - (0.25 * 0.4 + 0.25 * 0.5 + 0.5 * 0.7)).abs() < 1e-12);
    }

    #[test]
    fn princeton_curve_has_the_thresholds_of_the_field() {
        let curve = ErrorCurve::princeton(&[0.0499, 0.0501, 9.0]);
        assert_eq!((curve.thresholds.len(), curve.thresholds[100]), (101, 0.1));
        assert_eq!([curve.shares[49], curve.shares[50], curve.shares[51]], [0.0, 1.0 / 3.0, 2.0 / 3.0]);
        assert_eq!(ErrorCurve::princeton(&[]).auc(), 0.0);
    }

    #[test]
    fn average_weighs_maps_not_matches() {
        let average = ErrorCurve::average(&[ErrorCurve::princeton(&[0.0]), ErrorCurve::princeton(&[9.0; 3])]);
        assert_eq!(average.unwrap().shares, vec![0.5; 101]);
        let other = ErrorCurve::new(&[], vec![0.0]);
        assert_eq!(ErrorCurve::average(&[other, ErrorCurve::princeton(&[])]), None);
        assert_eq!(ErrorCurve::average(&[]), None);
    }

    #[test]
    fn csv_has_a_column_for_each_method() {
        let ours = ErrorCurve::new(&[0.0, 0.003], vec![0.0, 3.0 * 0.001]);
        let theirs = ErrorCurve::new(&[0.0], vec![0.0]);
        let csv = curves_csv(&[("ours", &ours), ("theirs, raw", &theirs)]);
        assert_eq!(csv, "threshold,ours,\"theirs, raw\"\n0,50.0000,100.0000\n0.003,100.0000,\n");
        let read = curves_from_csv(&csv.replace("theirs, raw", "theirs")).unwrap();
        assert_eq!(read, [("ours".to_string(), ours), ("theirs".to_string(), theirs)]);
        assert!(curves_from_csv("threshold,a\n0,x\n").unwrap_err().contains("line 2"));
    }
}
