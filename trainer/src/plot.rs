//! `plot.svg`: the loss and the validation error of a run over its steps, to look at while it trains.

use crate::events::TrainEvent;
use fmnet::eval::{AxisScale, LineChart, Series};
use fmnet::io::{IoError, write_atomically};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Means that are kept of the losses, at most; then each two become one.
const MOST: usize = 512;
/// Means on each side that a drawn point is averaged with.
const SMOOTH: usize = 8;
/// Height of a chart, as [`LineChart`] draws it.
const HEIGHT: usize = 420;
const WIDTH: usize = 640;

/// What the plot shows, in bounded memory, however long the run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    /// Sum of the steps, sum of the logarithms of their losses, and how many they are, for each group of `stride`
    /// steps.
    groups: Vec<(f64, f64, usize)>,
    /// Steps in a full group, a power of two.
    stride: usize,
    /// Step and mean error x 100 of each validation.
    errors: Vec<(f64, f64)>,
}

impl History {
    /// The history in a run's `metrics.jsonl`; empty where there is no such file. Other lines are passed over.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read(metrics: &Path) -> Result<Self, IoError> {
        let mut history = Self::default();
        if !metrics.is_file() {
            return Ok(history);
        }
        let wrong = |source| IoError::Read { path: metrics.to_path_buf(), source };
        for line in BufReader::new(File::open(metrics).map_err(wrong)?).lines() {
            let value: serde_json::Value = serde_json::from_str(&line.map_err(wrong)?).unwrap_or_default();
            let Some(step) = value["step"].as_u64() else { continue };
            match (value["event"].as_str(), value["loss"].as_f64(), value["mean_error"].as_f64()) {
                (Some("step"), Some(loss), _) => history.add_loss(step, loss),
                (Some("validated"), _, Some(error)) => history.errors.push((step as f64, error)),
                _ => {}
            }
        }
        Ok(history)
    }

    /// Takes notice of an event.
    pub fn add(&mut self, event: &TrainEvent) {
        match event {
            TrainEvent::Step { step, stats, .. } => self.add_loss(*step, stats.loss),
            TrainEvent::Validated { step, mean_error, .. } => self.errors.push((*step as f64, *mean_error)),
            _ => {}
        }
    }

    fn add_loss(&mut self, step: u64, loss: f64) {
        if loss.is_nan() || loss <= 0.0 {
            return;
        }
        if self.groups.len() == MOST && self.groups[MOST - 1].2 >= self.stride {
            self.stride *= 2;
            let sum = |pair: &[(f64, f64, usize)]| {
                pair.iter().fold((0.0, 0.0, 0), |s, g| (s.0 + g.0, s.1 + g.1, s.2 + g.2))
            };
            self.groups = self.groups.chunks(2).map(sum).collect();
        }
        self.stride = self.stride.max(1);
        match self.groups.last_mut() {
            Some(group) if group.2 < self.stride => {
                *group = (group.0 + step as f64, group.1 + loss.ln(), group.2 + 1);
            }
            _ => self.groups.push((step as f64, loss.ln(), 1)),
        }
    }

    /// Step and loss, as geometric means of a group and of its neighbours.
    fn losses(&self, smooth: usize) -> Vec<(f64, f64)> {
        let n = self.groups.len();
        let point = |i: usize| {
            // As many on both sides, so that the ends do not lean inwards.
            let reach = smooth.min(i).min(n - 1 - i);
            let around = &self.groups[i - reach..=i + reach];
            let (logarithms, count) = around.iter().fold((0.0, 0), |s, g| (s.0 + g.1, s.1 + g.2));
            (self.groups[i].0 / self.groups[i].2 as f64, (logarithms / count as f64).exp())
        };
        (0..n).map(point).collect()
    }

    /// The plot as an SVG document: the loss, and below it the validation error, where there was a validation.
    pub fn to_svg(&self, title: &str) -> String {
        let series = |name: &str, points| Series { name: name.into(), points };
        let chart = |title: &str, y_label: &str, y_scale, series| LineChart {
            title: title.into(),
            x_label: "Minibatch".into(),
            y_label: y_label.into(),
            y_scale,
            series,
            ..LineChart::default()
        };
        let losses = vec![series("minibatches", self.losses(0)), series("smoothed", self.losses(SMOOTH))];
        let loss = chart(title, "Loss", AxisScale::Log10, losses);
        if self.errors.is_empty() {
            return loss.to_svg();
        }
        let errors = vec![series("held-out pairs, raw", self.errors.clone())];
        let error = chart("", "Mean geodesic error x 100", AxisScale::Linear, errors);
        let both = 2 * HEIGHT;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {both}\" width=\"{WIDTH}\" \
             height=\"{both}\">\n{}<g transform=\"translate(0 {HEIGHT})\">\n{}</g>\n</svg>\n",
            loss.to_svg(),
            error.to_svg()
        )
    }

    /// Writes the plot.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path, title: &str) -> Result<(), IoError> {
        write_atomically(path, |file| file.write_all(self.to_svg(title).as_bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::StepStats;

    fn step(step: u64, loss: f64) -> TrainEvent {
        let stats = StepStats { loss, ..StepStats::default() };
        TrainEvent::Step { step, stats, learning_rate: 1e-3, seconds: 0.5 }
    }

    fn validated(step: u64, mean_error: f64) -> TrainEvent {
        TrainEvent::Validated { step, mean_error, exact: 0.1, within_5: 0.5, best: false }
    }

    #[test]
    fn what_is_read_back_is_what_was_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.jsonl");
        assert_eq!(History::read(&path).unwrap(), History::default());
        let (mut history, mut text) = (History::default(), String::from("half a li\n"));
        let events = (1..=1500)
            .map(|i| step(i, 0.25 + (i % 8) as f64))
            .chain([validated(1500, 3.5), TrainEvent::Checkpoint { step: 3 }]);
        for event in events {
            history.add(&event);
            text += &(serde_json::to_string(&event).unwrap() + "\n");
        }
        std::fs::write(&path, text).unwrap();
        assert_eq!(History::read(&path).unwrap(), history);
    }

    #[test]
    fn a_long_run_keeps_its_course_in_bounded_memory() {
        let mut history = History::default();
        let loss = |step: f64| 3.0 * (-step / 20_000.0).exp();
        for i in 1..=50_001 {
            history.add(&step(i, loss(i as f64) * if i % 2 == 0 { 1.5 } else { 1.0 / 1.5 }));
        }
        assert!(history.groups.len() <= MOST && history.groups.len() > MOST / 4);
        assert_eq!(history.groups.iter().map(|g| g.2).sum::<usize>(), 50_001);
        for (at, found) in &history.losses(SMOOTH)[..history.groups.len() - 1] {
            assert!((found / loss(*at) - 1.0).abs() < 1e-3, "{found} at {at}");
        }
    }

    #[test]
    fn the_plot_has_the_error_below_the_loss() {
        let mut history = History::default();
        assert!(history.to_svg("empty").ends_with("</svg>\n"));
        [step(1, 1e-2), step(2, f64::NAN), step(3, 1e-5)].iter().for_each(|e| history.add(e));
        assert!(!history.to_svg("a").contains("held-out"));
        history.add(&validated(3, 7.0));
        let svg = history.to_svg("a & b");
        for part in ["a &amp; b", "Loss", ">0.001<", "held-out pairs", "translate(0 420)"] {
            assert!(svg.contains(part), "{part} is missing");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert_eq!(svg.matches("<svg").count(), svg.matches("</svg>").count());
    }
}
