//! Cumulative error curves.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

/// Share of matches whose error is at most a threshold, for rising thresholds.
///
/// The share at 0 is that of exact matches, as in the paper's figures. Unmatched vertices (NaN) count in the
/// denominator and lie beyond every threshold.
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

/// Reads curves as [`curves_csv`] writes them: name and curve of each column. Lines start with a threshold; percentages
/// follow.
///
/// # Errors
/// In words, with the line: no header, a line of another number of columns, a cell that is no number, or a quote that
/// is not closed.
pub fn curves_from_csv(text: &str) -> Result<Vec<(String, ErrorCurve)>, String> {
    let mut records = csv_records(text)?.into_iter();
    let (line, mut header) =
        records.next().ok_or("the file is empty; begin it with a header threshold,NAME,...")?;
    let names = header.split_off(1);
    if names.is_empty() {
        return Err(format!("line {line}: no name of a curve; begin with a header threshold,NAME,..."));
    }
    let mut curves = vec![ErrorCurve { thresholds: Vec::new(), shares: Vec::new() }; names.len()];
    for (line, cells) in records {
        let number = |cell: &str| {
            let parsed = cell.parse::<f64>();
            parsed.map_err(|_| format!("line {line}: {cell:?} is no number; write it as in 12.5"))
        };
        if cells.len() != names.len() + 1 {
            let (found, expected) = (cells.len(), names.len() + 1);
            return Err(format!(
                "line {line}: {found} columns, but the header has {expected}; give each curve a cell, empty if need be"
            ));
        }
        let cells: Vec<&str> = cells.iter().map(|cell| cell.trim()).collect();
        let threshold = number(cells[0])?;
        for (curve, cell) in curves.iter_mut().zip(&cells[1..]).filter(|(_, cell)| !cell.is_empty()) {
            curve.thresholds.push(threshold);
            curve.shares.push(number(cell)? / 100.0);
        }
    }
    Ok(names.into_iter().zip(curves).collect())
}

/// The cells of each line that is not blank, with its number from 1. A cell in quotes may hold commas, line breaks
/// and, doubled, quotes.
fn csv_records(text: &str) -> Result<Vec<(usize, Vec<String>)>, String> {
    let mut records = Vec::new();
    let (mut cells, mut cell) = (Vec::new(), String::new());
    let (mut line, mut first_line, mut is_quoted, mut previous) = (1, 1, false, '\n');
    let missing_end = if text.ends_with('\n') { "" } else { "\n" };
    for c in text.chars().chain(missing_end.chars()) {
        line += usize::from(c == '\n');
        match c {
            '"' => {
                if !is_quoted && previous == '"' {
                    cell.push('"');
                }
                is_quoted = !is_quoted;
            }
            '\r' if !is_quoted => {}
            ',' if !is_quoted => cells.push(std::mem::take(&mut cell)),
            '\n' if !is_quoted => {
                cells.push(std::mem::take(&mut cell));
                let record = std::mem::take(&mut cells);
                if record.len() > 1 || !record[0].trim().is_empty() {
                    records.push((first_line, record));
                }
                first_line = line;
            }
            _ => cell.push(c),
        }
        previous = c;
    }
    if is_quoted {
        return Err(format!(
            "line {first_line}: a quote is not closed; close it, or double it within a name"
        ));
    }
    Ok(records)
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
    }

    #[test]
    fn csv_reads_back_whatever_the_names() {
        let ours = ErrorCurve::new(&[0.0, 0.003], vec![0.0, 3.0 * 0.001]);
        let theirs = ErrorCurve::new(&[0.0], vec![0.0]);
        for name in ["theirs", "theirs, raw", "\"theirs\"", "\"", "a\"\",\"b", "two\r\nlines", ""] {
            let csv = curves_csv(&[("ours", &ours), (name, &theirs)]);
            let expected = [("ours".to_string(), ours.clone()), (name.to_string(), theirs.clone())];
            for text in [csv.clone(), csv.replace("\n0", "\r\n\r\n0"), csv.trim_end().to_string()] {
                assert_eq!(curves_from_csv(&text).unwrap(), expected, "{text}");
            }
        }
    }

    #[test]
    fn wrong_csv_is_named_by_its_line() {
        for (text, part) in [
            ("", "empty; begin"),
            ("\nthreshold\n", "line 2: no name"),
            ("threshold,a\n0,x\n", "line 2: \"x\""),
            ("threshold,\"a\nb\"\n0,1,2", "line 3: 3 columns, but the header has 2"),
            ("threshold,\"a\n0,1\n", "line 1: a quote"),
        ] {
            let error = curves_from_csv(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
