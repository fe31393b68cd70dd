//! A run that is stopped and goes on sees the same minibatches and has the same losses as one that is not.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use candle_core::Device;
use fmnet::network::{Backend, DescriptorNetwork};
use fmnet::quality::Calibration;
use fmnet_trainer::checkpoint::Checkpoint;
use fmnet_trainer::config::{List, TrainConfig};
use fmnet_trainer::events::TrainEvent;
use fmnet_trainer::export::{ModelOrigin, export, metadata};
use fmnet_trainer::network::{DiffusionOptions, NetworkOptions, ResidualOptions};
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

fn children(data: &Path) {
    let options = DatasetOptions {
        species: Species::from_name("child").into_iter().collect(),
        per_species: 4,
        validation: 0.5,
        ..Default::default()
    };
    write_dataset(data, &options, &|_, _| {}).unwrap();
}

#[test]
fn a_model_file_starts_a_run_as_its_checkpoint_does() {
    let folder = tempfile::tempdir().unwrap();
    let (data, model) = (folder.path().join("data"), folder.path().join("model.onnx"));
    children(&data);
    let network = DiffusionOptions {
        blocks: 2,
        width: 16,
        outputs: 24,
        eigenfunctions: 18,
        wks_energies: 12,
        wks_eigenfunctions: 20,
        shot_scale: 3.0,
    };
    let first = TrainConfig {
        network: NetworkOptions::Diffusion(network.clone()),
        steps: 2,
        validate_every: 0,
        ..config(&data, &folder.path().join("first"))
    };
    losses(&first, u64::MAX);
    let checkpoint = Checkpoint::read(&first.out.join(LAST)).unwrap();
    let network_of = checkpoint.network(&Device::Cpu).unwrap();
    export(network_of.as_ref(), &metadata(&checkpoint, &ModelOrigin::default()), &model).unwrap();

    let (other, fitted) = (folder.path().join("other.onnx"), folder.path().join("fitted.json"));
    let calibration = Calibration { doubtful: 0.6, agreement: Some(0.8), ..Calibration::default() };
    let exported = |calibration: &str| {
        std::fs::write(&fitted, calibration).unwrap();
        let mut export = fmnet_tests::train();
        export.arg("export").args([&first.out, Path::new("-o"), &other]).args(["-k", "15", "--quiet"]);
        export.arg("--calibration").arg(&fitted).output().unwrap()
    };
    let no_cosine = Calibration { agreement: Some(1.8), ..calibration };
    assert_eq!(exported(&no_cosine.to_json()).status.code(), Some(2));
    assert!(!other.exists());
    assert!(exported(&calibration.to_json()).status.success());
    let of = |path: &Path| {
        let network = DescriptorNetwork::load(path, Backend::default()).unwrap();
        (network.metadata().k, network.metadata().calibration)
    };
    assert_eq!([of(&model), of(&other)], [(first.k, None), (15, Some(calibration))]);

    let started = |initial: &Path, name: &str, network: &DiffusionOptions| TrainConfig {
        initial: initial.to_path_buf(),
        out: folder.path().join(name),
        steps: 1,
        network: NetworkOptions::Diffusion(network.clone()),
        ..first.clone()
    };
    let of_checkpoint = losses(&started(&first.out.join(LAST), "checkpoint", &network), u64::MAX)[0].1;
    let of_model = losses(&started(&model, "model", &network), u64::MAX)[0].1;
    let of_nothing = losses(&started(Path::new(""), "nothing", &network), u64::MAX)[0].1;
    assert!((of_model - of_checkpoint).abs() < 1e-5 * of_checkpoint, "{of_model}, {of_checkpoint}");
    assert!((of_nothing - of_checkpoint).abs() > 1e-3 * of_checkpoint, "{of_nothing}, {of_checkpoint}");
    // The file's weights hold the scale of SHOT, so that a run may have another.
    let rescaled = DiffusionOptions { shot_scale: 7.0, ..network.clone() };
    let of_rescaled = losses(&started(&model, "rescaled", &rescaled), u64::MAX)[0].1;
    assert!((of_rescaled - of_checkpoint).abs() < 1e-5 * of_checkpoint, "{of_rescaled}, {of_checkpoint}");

    let refusal = |config: TrainConfig| {
        train(&config, &Device::Cpu, &|_| {}, &AtomicBool::new(false)).unwrap_err().to_string()
    };
    let wider = DiffusionOptions { width: 17, ..network.clone() };
    let text = refusal(started(&model, "wider", &wider));
    assert!(text.contains("model.onnx (--initial) holds the weights of another network"), "{text}");
    let text = refusal(started(&folder.path().join("none.onnx"), "none", &network));
    assert!(text.contains("none.onnx") && text.starts_with("--initial"), "{text}");
    let text = refusal(started(Path::new("embedded"), "embedded", &network));
    assert!(text.contains("embedded (--initial) holds the weights of another network"), "{text}");
}

#[test]
fn a_stopped_run_goes_on_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    children(&data);
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
