//! The order of the stages in training: dataset -> prepared shapes -> minibatches -> steps -> validation ->
//! checkpoints.
//!
//! A run's folder holds `config.toml`, `metrics.jsonl` (an event a line), `plot.svg` (loss and validation error so
//! far), `last.safetensors` and `best.safetensors`. Running the same command again goes on from `last.safetensors`
//! with the minibatches that the uninterrupted run would have seen.

use crate::checkpoint::{Checkpoint, CheckpointError};
use crate::config::{ConfigError, TrainConfig};
use crate::dataset::{Dataset, DatasetError, ShapeEntry, Split, check_groups};
use crate::events::{TrainEvent, TrainObserver};
use crate::initial::initial_network;
use crate::network::NetworkOptions;
use crate::plot::History;
use crate::precompute::{PrepareError, PrepareOptions, PreparedShape, prepare};
use crate::sampler::{Sampler, SamplerError};
use crate::step::{StepError, StepRunner};
use crate::validate::Validation;
use candle_core::Device;
use fmnet::cache::Cache;
use fmnet::events::Event;
use fmnet::io::{IoError, write_atomically};
use rayon::prelude::*;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::Instant;
use thiserror::Error;

/// Name of the checkpoint that a run goes on from.
pub const LAST: &str = "last.safetensors";
/// Name of the checkpoint with the best validation.
pub const BEST: &str = "best.safetensors";
/// Name of the list of events.
pub const METRICS: &str = "metrics.jsonl";
/// Name of the picture of the loss and the validation error.
pub const PLOT: &str = "plot.svg";
/// Minibatches prepared ahead.
const AHEAD: usize = 2;

/// Why a run ended early.
#[derive(Debug, Error)]
pub enum TrainError {
    /// A setting is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The dataset is wrong.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A shape could not be prepared.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// There is nothing to draw from.
    #[error(transparent)]
    Sampler(#[from] SamplerError),
    /// A checkpoint could not be read or written.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A file of the run could not be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A step failed.
    #[error("minibatch {step}: {source}; the last good checkpoint is {checkpoint}")]
    Step {
        /// The minibatch, from 1; 0 before the first.
        step: u64,
        /// Why.
        source: StepError,
        /// Where to go on from.
        checkpoint: String,
    },
    /// The run's folder belongs to another configuration.
    #[error(
        "{folder} holds a run whose {setting} is {found}, not {wanted}; choose another --out, or remove the folder to start anew"
    )]
    OtherRun {
        /// The run's folder.
        folder: String,
        /// The first setting that differs.
        setting: String,
        /// Its value there.
        found: String,
        /// Its value here.
        wanted: String,
    },
    /// The weights to start from are another network's.
    #[error(
        "{path} (--initial) holds the weights of another network: it has {found}, the run {wanted}; set the table network as there"
    )]
    OtherNetwork {
        /// The checkpoint or model.
        path: String,
        /// The network there.
        found: String,
        /// The network of this run.
        wanted: String,
    },
    /// The model to start from cannot be read.
    #[error("--initial: {source}")]
    InitialModel {
        /// Why.
        source: Box<fmnet::Error>,
    },
    /// The model to start from is not made of the weights of a DiffusionNet.
    #[error("{path} (--initial) is no DiffusionNet that fmnet-train exported; give its checkpoint instead")]
    NoDiffusionNet {
        /// The model file.
        path: PathBuf,
    },
    /// Validation failed.
    #[error("validation: {0:#}")]
    Validation(anyhow::Error),
    /// Candle failed.
    #[error(transparent)]
    Tensor(#[from] candle_core::Error),
}

/// The checkpoint of a run's folder that its model is made of: the best validated one, the last where nothing was
/// validated.
pub fn best_checkpoint(run: &Path) -> PathBuf {
    let best = run.join(BEST);
    if best.is_file() { best } else { run.join(LAST) }
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainSummary {
    /// Minibatches done, with those of earlier runs that it went on from.
    pub step: u64,
    /// Best validated mean error over sqrt(area), times 100; infinite without validation.
    pub best_error: f64,
    /// Whether it was stopped before the last minibatch.
    pub stopped: bool,
}

/// Trains, or goes on training, until the last minibatch or until `stop` is set.
///
/// # Errors
/// If a setting is out of range, the folder holds a run of other settings, a shape cannot be prepared, no two of them
/// correspond, a step or a validation fails, or a file cannot be read or written.
pub fn train(
    config: &TrainConfig,
    device: &Device,
    observer: TrainObserver,
    stop: &AtomicBool,
) -> Result<TrainSummary, TrainError> {
    config.check()?;
    fs::create_dir_all(&config.out).map_err(|source| IoError::Write { path: config.out.clone(), source })?;
    let resumed = resume(config)?;
    let text = config.to_toml();
    write_atomically(&config.out.join("config.toml"), |out| out.write_all(text.as_bytes()))?;
    let shapes = prepare_splits(config, &config.splits.0, observer)?;
    let held_out = if config.validate_every > 0 { validation_entries(config)? } else { Vec::new() };
    let validation = Validation::new(&held_out, config, observer)?;
    let sampler = Sampler::new(&shapes, config)?;
    let (step, best_error) = resumed.as_ref().map_or((0, f64::INFINITY), |c| (c.step, c.best_error));
    let runner = match resumed {
        Some(checkpoint) => checkpoint.into_runner(device)?,
        None => StepRunner::new(initial_network(config, device)?, config.step_options())
            .map_err(|source| TrainError::Step { step: 0, source, checkpoint: "none".into() })?,
    };
    let metrics = open_metrics(&config.out.join(METRICS), step)?;
    let history = History::read(&config.out.join(METRICS))?;
    let mut run = Run { config, runner, step, best_error, metrics, history, observer };
    run.tell(TrainEvent::Started { step, steps: config.steps, pairs: sampler.n_pairs() });
    run.go(&sampler, &validation, stop)
}

/// Prepares the shapes of some splits of all the datasets, in parallel.
///
/// # Errors
/// If a dataset or a shape cannot be read or processed.
pub fn prepare_splits(
    config: &TrainConfig,
    splits: &[Split],
    observer: TrainObserver,
) -> Result<Vec<PreparedShape>, TrainError> {
    let mut entries = entries(config)?;
    entries.retain(|entry| splits.contains(&entry.split));
    prepare_entries(config, &entries, observer)
}

/// All shapes of all the datasets.
fn entries(config: &TrainConfig) -> Result<Vec<ShapeEntry>, TrainError> {
    let mut entries = Vec::new();
    for (index, folder) in config.dataset.0.iter().enumerate() {
        for mut entry in Dataset::open(Path::new(folder))?.shapes {
            // Groups of different datasets do not correspond, whatever their names.
            entry.group = format!("{index}/{}", entry.group);
            entries.push(entry);
        }
    }
    Ok(entries)
}

/// The shapes of the validation split; where a group has only parts there, its first whole shape too, which they are
/// matched to.
fn validation_entries(config: &TrainConfig) -> Result<Vec<ShapeEntry>, TrainError> {
    let all = entries(config)?;
    let mut chosen: Vec<ShapeEntry> =
        all.iter().filter(|entry| entry.split == Split::Validation).cloned().collect();
    for whole in all.into_iter().filter(|entry| !entry.is_part() && entry.split != Split::Validation) {
        let of_group = || chosen.iter().filter(|entry| entry.group == whole.group);
        if of_group().count() > 0 && of_group().all(|entry| entry.is_part()) {
            chosen.push(whole);
        }
    }
    Ok(chosen)
}

fn prepare_entries(
    config: &TrainConfig,
    entries: &[ShapeEntry],
    observer: TrainObserver,
) -> Result<Vec<PreparedShape>, TrainError> {
    let cache = Cache::open(&config.cache_folder())?;
    let options = prepare_options(config);
    let done = AtomicUsize::new(0);
    let prepared: Result<Vec<PreparedShape>, PrepareError> = entries
        .par_iter()
        .map(|entry| {
            let warn = |event| {
                if let Event::Warning(text) = event {
                    observer(TrainEvent::Warning { text });
                }
            };
            let shape = prepare(entry, &options, config.jitter, &cache, &warn)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            observer(TrainEvent::Prepared { done, total: entries.len(), shape: entry.name.clone() });
            Ok(shape)
        })
        .collect();
    let prepared = prepared?;
    if config.needs_points() {
        check_groups(prepared.iter().map(|shape| (&shape.entry, shape.points.len())))?;
    }
    Ok(prepared)
}

/// What is prepared of each shape for a run.
pub fn prepare_options(config: &TrainConfig) -> PrepareOptions {
    let (gradients, takes_shot) = match &config.network {
        NetworkOptions::Residual(_) => (0, true),
        NetworkOptions::Diffusion(options) => (options.eigenfunctions, options.takes_shot()),
    };
    PrepareOptions {
        shape: config.shape_options(),
        k: config.eigenpairs(),
        gradients,
        shot: takes_shot.then(|| config.shot_options()),
        distances: config.loss.soft_error > 0.0,
        pool: config.pool,
        seed: config.seed,
    }
}

/// The checkpoint in the run's folder, if it is of this configuration; folders, and how often it saves and validates,
/// may differ. The number of steps may not: the learning rate depends on it.
fn resume(config: &TrainConfig) -> Result<Option<Checkpoint>, TrainError> {
    let path = config.out.join(LAST);
    if !path.is_file() {
        return Ok(None);
    }
    let checkpoint = Checkpoint::read(&path)?;
    let table = |config: &TrainConfig| toml::Table::try_from(config).expect("plain data serialises");
    let (found, wanted) = (table(&checkpoint.config), table(config));
    let free = ["out", "cache", "checkpoint-every", "validate-every", "validation-pairs"];
    for (setting, value) in &wanted {
        if !free.contains(&setting.as_str()) && found.get(setting) != Some(value) {
            return Err(TrainError::OtherRun {
                folder: config.out.display().to_string(),
                setting: setting.clone(),
                found: found.get(setting).map(ToString::to_string).unwrap_or_default(),
                wanted: value.to_string(),
            });
        }
    }
    Ok(Some(checkpoint))
}

/// Opens the list of events, without the steps that the checkpoint does not know of.
fn open_metrics(path: &Path, step: u64) -> Result<File, TrainError> {
    let wrong = |source| TrainError::Io(IoError::Write { path: path.to_path_buf(), source });
    if path.is_file() {
        let known = |line: &String| {
            let value: Option<serde_json::Value> = serde_json::from_str(line).ok();
            value.is_some_and(|v| v["step"].as_u64().is_none_or(|s| s <= step))
        };
        let lines: Vec<String> = BufReader::new(File::open(path).map_err(wrong)?)
            .lines()
            .collect::<Result<_, _>>()
            .map_err(wrong)?;
        let kept: String = lines.into_iter().filter(known).map(|line| line + "\n").collect();
        write_atomically(path, |out| out.write_all(kept.as_bytes()))?;
    }
    File::options().create(true).append(true).open(path).map_err(wrong)
}

struct Run<'a> {
    config: &'a TrainConfig,
    runner: StepRunner,
    step: u64,
    best_error: f64,
    metrics: File,
    history: History,
    observer: TrainObserver<'a>,
}

impl Run<'_> {
    fn go(
        &mut self,
        sampler: &Sampler,
        validation: &Validation,
        stop: &AtomicBool,
    ) -> Result<TrainSummary, TrainError> {
        let (first, last) = (self.step, self.config.steps);
        std::thread::scope(|scope| {
            let (sender, batches) = sync_channel(AHEAD);
            scope.spawn(move || {
                for index in first..last {
                    if sender.send(sampler.batch(index)).is_err() {
                        return;
                    }
                }
            });
            while self.step < last && !stop.load(Ordering::Relaxed) {
                let Ok(batch) = batches.recv() else { break };
                let batch = batch?;
                let start = Instant::now();
                let learning_rate = self.config.learning_rate_at(self.step);
                let stats =
                    self.runner.step(&batch, learning_rate).map_err(|source| self.step_error(source))?;
                self.step += 1;
                let seconds = start.elapsed().as_secs_f64();
                self.tell(TrainEvent::Step { step: self.step, stats, learning_rate, seconds });
                self.after_step(validation)?;
            }
            self.save(LAST)?;
            self.plot();
            Ok(TrainSummary { step: self.step, best_error: self.best_error, stopped: self.step < last })
        })
    }

    fn after_step(&mut self, validation: &Validation) -> Result<(), TrainError> {
        let (step, last) = (self.step, self.step == self.config.steps);
        let every = self.config.validate_every;
        if every > 0 && !validation.is_empty() && (step.is_multiple_of(every) || last) {
            self.validate(validation)?;
        }
        if step.is_multiple_of(self.config.checkpoint_every) || last {
            self.save(LAST)?;
            self.tell(TrainEvent::Checkpoint { step });
            self.plot();
        }
        Ok(())
    }

    /// A picture that cannot be written must not end the run.
    fn plot(&self) {
        let title = self.config.out.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if let Err(e) = self.history.write(&self.config.out.join(PLOT), &title) {
            (self.observer)(TrainEvent::Warning { text: e.to_string() });
        }
    }

    fn validate(&mut self, validation: &Validation) -> Result<(), TrainError> {
        let result =
            validation.run(self.runner.network.as_ref(), self.config).map_err(TrainError::Validation)?;
        let best = result.mean_error < self.best_error;
        if best {
            self.best_error = result.mean_error;
            self.save(BEST)?;
        }
        self.tell(TrainEvent::Validated {
            step: self.step,
            mean_error: result.mean_error,
            exact: result.exact,
            within_5: result.within_5,
            best,
        });
        self.plot();
        Ok(())
    }

    fn save(&self, name: &str) -> Result<(), TrainError> {
        let checkpoint = Checkpoint::of(&self.runner, self.config, self.step, self.best_error)?;
        Ok(checkpoint.write(&self.config.out.join(name))?)
    }

    fn step_error(&self, source: StepError) -> TrainError {
        let checkpoint = self.config.out.join(LAST);
        let checkpoint = if checkpoint.is_file() { checkpoint.display().to_string() } else { "none".into() };
        TrainError::Step { step: self.step + 1, source, checkpoint }
    }

    /// Passes an event on and keeps it; a full disk must not end a run whose checkpoints can still be written.
    fn tell(&mut self, event: TrainEvent) {
        let line = serde_json::to_string(&event).expect("events serialise");
        if let Err(e) = writeln!(self.metrics, "{line}") {
            (self.observer)(TrainEvent::Warning { text: format!("{METRICS}: {e}") });
        }
        self.history.add(&event);
        (self.observer)(event);
    }
}
