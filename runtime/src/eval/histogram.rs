//! Histograms.

use serde::{Deserialize, Serialize};

/// Counts of values in bins of equal width.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Histogram {
    /// Borders of the bins, `[bins + 1]`; each bin has its lower border and the last also its upper.
    pub edges: Vec<f64>,
    /// Values in each bin, `[bins]`.
    pub counts: Vec<u64>,
    /// Number of values, with those outside of the bins.
    pub total: u64,
}

impl Histogram {
    /// Counts `values` in `n_bins` (at least one) bins from 0 to `upper` (above 0); what lies outside is in the total
    /// only.
    pub fn new(values: &[f32], n_bins: usize, upper: f64) -> Self {
        let n_bins = n_bins.max(1);
        let mut counts = vec![0; n_bins];
        for value in values.iter().map(|&v| f64::from(v)).filter(|v| (0.0..=upper).contains(v)) {
            let bin = (value / upper * n_bins as f64) as usize;
            counts[bin.min(n_bins - 1)] += 1;
        }
        let edges = (0..=n_bins).map(|i| upper * i as f64 / n_bins as f64).collect();
        Self { edges, counts, total: values.len() as u64 }
    }

    /// The outline as points (value, percent of all values), to plot.
    pub fn points(&self) -> Vec<(f64, f64)> {
        let percent = |count: u64| 100.0 * count as f64 / self.total.max(1) as f64;
        let bins = self.edges.windows(2).zip(&self.counts);
        bins.flat_map(|(e, &c)| [(e[0], percent(c)), (e[1], percent(c))]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fall_in_their_bins() {
        let histogram = Histogram::new(&[0.0, 0.4, 0.5, 1.0, 1.1, f32::NAN], 2, 1.0);
        assert_eq!((histogram.counts.as_slice(), histogram.total), ([2, 2].as_slice(), 6));
        assert_eq!(histogram.edges, [0.0, 0.5, 1.0]);
        assert_eq!(histogram.points()[1].0, 0.5);
        assert_eq!(Histogram::new(&[0.0], 3, 0.0).counts.iter().sum::<u64>(), 1);
    }
}
