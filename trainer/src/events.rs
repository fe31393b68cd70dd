//! What a training run tells its caller: the library itself never prints.

use crate::step::StepStats;
use serde::Serialize;

/// One thing that happened in a run. Its JSON form is a line of `metrics.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum TrainEvent {
    /// So many shapes of so many are ready.
    Prepared {
        /// Shapes ready.
        done: usize,
        /// Shapes in all.
        total: usize,
        /// The shape that became ready.
        shape: String,
    },
    /// Training begins or goes on.
    Started {
        /// Minibatches done before.
        step: u64,
        /// Minibatches in all.
        steps: u64,
        /// Ordered pairs to draw from.
        pairs: usize,
    },
    /// A minibatch was used.
    Step {
        /// Its number, from 1.
        step: u64,
        /// Loss, error on the samples, condition, gradient.
        #[serde(flatten)]
        stats: StepStats,
        /// The learning rate.
        learning_rate: f64,
        /// Seconds it took.
        seconds: f64,
    },
    /// The network was tried on held-out pairs, through the runtime's own stages.
    Validated {
        /// Minibatches done.
        step: u64,
        /// Mean geodesic error of the raw maps over sqrt(area), times 100.
        mean_error: f64,
        /// Share of exact matches, from 0 to 1.
        exact: f64,
        /// Share of matches within 0.05 sqrt(area), from 0 to 1.
        within_5: f64,
        /// Whether it is the best so far.
        best: bool,
    },
    /// A checkpoint was written.
    Checkpoint {
        /// Minibatches done.
        step: u64,
    },
    /// Something the user should know.
    Warning {
        /// What.
        text: String,
    },
}

/// Receives events.
pub type TrainObserver<'a> = &'a (dyn Fn(TrainEvent) + Sync);
