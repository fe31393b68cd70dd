//! A run that is stopped and goes on sees the same minibatches and has the same losses as one that is not.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use candle_core::Device;
use fmnet_trainer::config::{List, TrainConfig};
use fmnet_trainer::events::TrainEvent;
use fmnet_trainer::network::{NetworkOptions, ResidualOptions};
use fmnet_trainer::synth::{DatasetOptions, Species, write_dataset};
use fmnet_trainer::train::{LAST, METRICS, TrainError, train};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

fn config(data: &Path, out: &Path) -> TrainConfig {
    TrainConfig {
        dataset: List(vec![data.display().to_string()]),
        out: out.to_path_buf(),
        cache: data.join("cache"),
        steps: 6,
        k: 20,
        points: 80,
        pool: 150,
        network: NetworkOptions::Residual(ResidualOptions { blocks: 2, ..ResidualOptions::default() }),
        checkpoint_every: 2,
        validate_every: 3,
        validation_pairs: 1,
        ..TrainConfig::paper()
    }
}

/// Losses of the minibatches of one call, which is stopped after `stop_after`.
fn losses(config: &TrainConfig, stop_after: u64) -> Vec<(u64, f64)> {
    let stop = AtomicBool::new(false);
    let losses = Mutex::new(Vec::new());
    let observer = |event| {
        if let TrainEvent::Step { step, stats, .. } = event {
            losses.lock().unwrap().push((step, stats.loss));
            stop.store(step >= stop_after, Ordering::Relaxed);
        }
    };
    train(config, &Device::Cpu, &observer, &stop).unwrap();
    losses.into_inner().unwrap()
}

#[test]
fn a_stopped_run_goes_on_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let options = DatasetOptions {
        species: Species::from_name("child").into_iter().collect(),
        per_species: 4,
        validation: 0.5,
        ..Default::default()
    };
    write_dataset(&data, &options, &|_, _| {}).unwrap();
    let whole = losses(&config(&data, &folder.path().join("whole")), u64::MAX);
    assert_eq!(whole.iter().map(|l| l.0).collect::<Vec<_>>(), [1, 2, 3, 4, 5, 6]);

    let stopped = config(&data, &folder.path().join("stopped"));
    let mut parts = losses(&stopped, 3);
    parts.extend(losses(&stopped, u64::MAX));
    assert_eq!(parts, whole);

    // As after a kill: the metrics know of a step that the checkpoint does not.
    let last = stopped.out.join(LAST);
    let weights =
        |out: &Path| fmnet_trainer::checkpoint::Checkpoint::read(&out.join(LAST)).unwrap().parameters;
    assert_eq!(weights(&stopped.out), weights(&folder.path().join("whole")));
    let metrics = std::fs::read_to_string(stopped.out.join(METRICS)).unwrap();
    assert_eq!(metrics.matches("\"event\":\"step\"").count(), 6, "{metrics}");

    let started = TrainConfig {
        initial: stopped.out.join(LAST),
        out: folder.path().join("started"),
        steps: 1,
        ..stopped.clone()
    };
    let fresh =
        TrainConfig { initial: Default::default(), out: folder.path().join("fresh"), ..started.clone() };
    let (started_loss, fresh_loss) = (losses(&started, u64::MAX)[0].1, losses(&fresh, u64::MAX)[0].1);
    assert!(
        started_loss < 0.95 * fresh_loss,
        "from trained weights {started_loss}, from random ones {fresh_loss}"
    );
    let blocks = NetworkOptions::Residual(ResidualOptions { blocks: 1, ..ResidualOptions::default() });
    let wrong = TrainConfig { network: blocks, out: folder.path().join("wrong"), ..started };
    let error = train(&wrong, &Device::Cpu, &|_| {}, &AtomicBool::new(false)).unwrap_err();
    assert!(matches!(error, TrainError::OtherNetwork { .. }), "{error}");

    let other = TrainConfig { k: 21, ..stopped };
    let error = train(&other, &Device::Cpu, &|_| {}, &AtomicBool::new(false)).unwrap_err();
    assert!(matches!(&error, TrainError::OtherRun { setting, .. } if setting == "k"), "{error}");
    assert!(last.is_file());
}
