//! The paper's experiments, each from raw meshes to a report by one command.
//!
//! [`experiment`] describes one: what is generated, which networks are trained, what is tested. [`run`] does it.
//! Trainings are shared between experiments, resumed where they stopped, and not repeated once done.

mod experiments;
mod gallery;

use crate::checkpoint::{Checkpoint, CheckpointError};
use crate::config::TrainConfig;
use crate::dataset::{Dataset, DatasetError, Split};
use crate::evaluate::report::{Chapter, write_html};
use crate::evaluate::{
    EvaluateError, EvaluateOptions, MapSource, Method, MethodResult, PairError, evaluate, listed_pairs,
    random_pairs,
};
use crate::events::TrainObserver;
use crate::export::{ExportError, ModelOrigin, export, metadata};
use crate::simulate::{self, PartKind, PartOptions, ScanOptions, SimulateError};
use crate::train::{TrainError, best_checkpoint, train};
use candle_core::Device;
use fmnet::eval::{ErrorCurve, curves_from_csv};
use fmnet::events::{Event, Observer};
use fmnet::io::IoError;
use fmnet::pipeline::{DescriptorKind, MatchOptions, ModelSource, Refinement};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use thiserror::Error;

pub use experiments::{NAMES, experiment};

/// Where things are and how much is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Folder of the research data: `faust/registrations`, `faust/remeshed_5k`, `faust/scans_7k`, `scape`, `tosca/dog`.
    pub data: PathBuf,
    /// Folder of trainings and reports.
    pub out: PathBuf,
    /// Minibatches of each training; `None`: as many as in the paper.
    pub steps: Option<u64>,
    /// Pairs of each test; a list in the data folder wins.
    pub pairs: usize,
    /// Curves to draw beside, in the format of [`curves_from_csv`].
    pub curves: Option<PathBuf>,
}

/// One of the paper's experiments.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Its name on the command line.
    pub name: &'static str,
    /// What the paper does and what is done here.
    pub text: &'static str,
    /// Data generated beforehand.
    pub preparation: Option<Preparation>,
    /// Networks that are trained.
    pub trainings: Vec<Training>,
    /// What is tested.
    pub test: Test,
    /// Folder of meshes without ground truth that are matched with the first training and pictured.
    pub gallery: Option<PathBuf>,
}

/// Data generated from a dataset.
#[derive(Clone, Debug, PartialEq)]
pub enum Preparation {
    /// Registrations turned into scans.
    Scans {
        /// The registrations.
        from: PathBuf,
        /// The generated dataset.
        to: PathBuf,
    },
    /// Parts cut out of whole shapes.
    Parts {
        /// The whole shapes.
        from: PathBuf,
        /// The generated dataset.
        to: PathBuf,
    },
}

/// A network to train.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// Name of its folder, shared between experiments.
    pub name: &'static str,
    /// Its settings.
    pub config: TrainConfig,
}

/// Methods compared on pairs of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Its heading.
    pub title: &'static str,
    /// The dataset.
    pub dataset: PathBuf,
    /// Splits that pairs are drawn from.
    pub splits: Vec<Split>,
    /// A list of pairs, used where it exists.
    pub list: Option<PathBuf>,
    /// What is compared.
    pub methods: Vec<TestMethod>,
    /// Whether the curves of others belong to it.
    pub with_references: bool,
}

/// One line of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct TestMethod {
    /// Its label.
    pub label: &'static str,
    /// The training whose network it uses; `None`: SHOT.
    pub training: Option<&'static str>,
    /// Eigenfunctions of the functional map.
    pub k: usize,
    /// How the map is refined.
    pub refinement: Refinement,
}

/// Why an experiment ended early.
#[derive(Debug, Error)]
pub enum ReproduceError {
    /// Generating the data failed.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A dataset is wrong.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A training failed.
    #[error("training {name}: {source}")]
    Train {
        /// The training.
        name: &'static str,
        /// Why.
        source: Box<TrainError>,
    },
    /// A training was interrupted.
    #[error("stopped in the training {0}; the same command goes on from there")]
    Stopped(&'static str),
    /// A checkpoint cannot be read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A network cannot be exported.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The list of pairs is wrong.
    #[error(transparent)]
    Pairs(#[from] PairError),
    /// The evaluation failed.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The file of curves is wrong.
    #[error("{path}: {reason}")]
    Curves {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
}

/// Who hears of what.
#[derive(Clone, Copy)]
pub struct Observers<'a> {
    /// Trainings.
    pub training: TrainObserver<'a>,
    /// Generation and evaluation.
    pub rest: Observer<'a>,
}

/// Runs an experiment and gives the path of its report, `OUT/NAME/report.html`.
///
/// # Errors
/// If data cannot be read or generated, a training fails or is stopped, or the evaluation or the report fails.
pub fn run(
    experiment: &Experiment,
    settings: &Settings,
    device: &Device,
    observers: Observers,
    stop: &AtomicBool,
) -> Result<PathBuf, ReproduceError> {
    if let Some(preparation) = &experiment.preparation {
        preparation.run(observers.rest)?;
    }
    for training in &experiment.trainings {
        let summary = train(&training.config, device, observers.training, stop)
            .map_err(|source| ReproduceError::Train { name: training.name, source: Box::new(source) })?;
        if summary.stopped {
            return Err(ReproduceError::Stopped(training.name));
        }
        export_training(training)?;
    }
    let references = if experiment.test.with_references { references(settings)? } else { Vec::new() };
    let folder = settings.out.join(experiment.name);
    let dataset = Dataset::open(&experiment.test.dataset)?;
    let chapter = Chapter {
        title: experiment.test.title,
        text: experiment.text,
        dataset: &dataset,
        results: &experiment.test.run(&dataset, settings, observers.rest)?,
        references: &references,
    };
    chapter.write_files(&folder)?;
    let mut sections = vec![chapter.section()?];
    if let (Some(meshes), Some(training)) = (&experiment.gallery, experiment.trainings.first()) {
        sections.push(gallery::section(meshes, &model_path(&training.config.out), observers.rest)?);
    }
    let report = folder.join("report.html");
    write_html(&report, experiment.name, sections)?;
    Ok(report)
}

impl Preparation {
    fn run(&self, observer: Observer) -> Result<(), ReproduceError> {
        let told = |done: usize, total: usize, name: &str| {
            let subject = format!("{done} of {total}: {name}");
            observer(Event::Finished { subject, stage: "generated", seconds: 0.0 });
        };
        match self {
            Self::Scans { from, to } => {
                let splits = [Split::Train, Split::Validation];
                simulate::write_scans(&Dataset::open(from)?, &splits, to, &ScanOptions::default(), &told)?;
            }
            Self::Parts { from, to } => {
                let options = PartOptions { kinds: vec![PartKind::Holes], ..PartOptions::default() };
                simulate::write_parts(&Dataset::open(from)?, to, &options, &told)?;
            }
        }
        Ok(())
    }
}

impl Test {
    fn run(
        &self,
        dataset: &Dataset,
        settings: &Settings,
        observer: Observer,
    ) -> Result<Vec<MethodResult>, ReproduceError> {
        let pairs = match self.list.as_ref().filter(|list| list.is_file()) {
            Some(list) => listed_pairs(dataset, list)?,
            None => random_pairs(dataset, &self.splits, settings.pairs, 1),
        };
        let cache = settings.out.join("cache");
        let methods: Vec<Method> =
            self.methods.iter().map(|m| m.with_options(&settings.out, &cache)).collect();
        Ok(evaluate(dataset, &pairs, &methods, &EvaluateOptions::default(), observer)?)
    }
}

impl TestMethod {
    fn with_options(&self, out: &Path, cache: &Path) -> Method {
        let (descriptor, model) = match self.training {
            None => (DescriptorKind::Shot, ModelSource::Embedded),
            Some(name) => {
                (DescriptorKind::Learned, ModelSource::File(model_path(&training_folder(out, name))))
            }
        };
        let options = MatchOptions::default()
            .descriptor(descriptor)
            .model(model)
            .k(self.k)
            .refinement(self.refinement)
            .cache(cache.to_path_buf());
        Method { label: self.label.into(), maps: MapSource::Computed(Box::new(options)) }
    }
}

fn training_folder(out: &Path, name: &str) -> PathBuf {
    out.join("trainings").join(name)
}

fn model_path(run: &Path) -> PathBuf {
    run.join("model.onnx")
}

fn export_training(training: &Training) -> Result<(), ReproduceError> {
    let run = &training.config.out;
    let checkpoint = Checkpoint::read(&best_checkpoint(run))?;
    let network = checkpoint.network(&Device::Cpu)?;
    export(network.as_ref(), &metadata(&checkpoint, &ModelOrigin::default()), &model_path(run))?;
    Ok(())
}

fn references(settings: &Settings) -> Result<Vec<(String, ErrorCurve)>, ReproduceError> {
    let Some(path) = &settings.curves else { return Ok(Vec::new()) };
    let wrong = |reason: String| ReproduceError::Curves { path: path.clone(), reason };
    let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
    let curves = curves_from_csv(&text).map_err(wrong)?;
    Ok(curves.into_iter().map(|(name, curve)| (format!("{name} (paper)"), curve)).collect())
}
