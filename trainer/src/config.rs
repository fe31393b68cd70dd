//! The settings of a training run: one type for the configuration file, the command line, the saved copy and the
//! defaults.

use crate::dataset::Split;
use crate::losses::LossOptions;
use crate::network::{DiffusionOptions, NetworkOptions, ResidualOptions};
use crate::step::StepOptions;
use fmnet::descriptor::ShotOptions;
use fmnet::fmap::{FmapSolver, SolverKind};
use fmnet::shape::ShapeOptions;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use thiserror::Error;

mod earlier;

/// How points of a minibatch are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Sampling {
    /// Every vertex with the same probability.
    Uniform,
    /// With probability proportional to the vertex's area, so that dense regions do not dominate (the paper, for
    /// scans).
    Area,
}

/// A list of values, separated by commas on the command line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct List<T>(pub Vec<T>);

impl<T: FromStr> FromStr for List<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        text.split(',').filter(|s| !s.is_empty()).map(T::from_str).collect::<Result<_, _>>().map(Self)
    }
}

impl<T: fmt::Display> fmt::Display for List<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let items: Vec<String> = self.0.iter().map(T::to_string).collect();
        f.write_str(&items.join(","))
    }
}

impl FromStr for Split {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        <Self as clap::ValueEnum>::from_str(text, true)
    }
}

macro_rules! train_config {
    ($( $(#[doc = $doc:literal])+ $name:ident $(($short:literal))? : $kind:ty = $default:expr ),* $(,)?) => {
        /// Settings of a training run, as in `--config FILE.toml`, on the command line and in the run's folder.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
        pub struct TrainConfig {
            $( $(#[doc = $doc])+ pub $name: $kind, )*
            /// The table `[network]`.
            pub network: NetworkOptions,
            /// The table `[loss]`.
            pub loss: LossOptions,
        }

        impl Default for TrainConfig {
            fn default() -> Self {
                Self { $( $name: $default, )* network: NetworkOptions::default(), loss: LossOptions::default() }
            }
        }

        /// The same settings on the command line, where each is optional and wins over the file.
        #[derive(Clone, Debug, Default, clap::Args)]
        pub struct TrainOverrides {
            $( $(#[doc = $doc])+ #[arg(long $(, short = $short)?)] pub $name: Option<$kind>, )*
            /// Any setting by its name in the file, as in `--set loss.spectral=0.1` or `--set network.kind=residual`;
            /// may be given several times
            #[arg(long, value_name = "NAME=VALUE")] pub set: Vec<String>,
        }

        impl TrainOverrides {
            /// Replaces the settings that were given on the command line.
            ///
            /// # Errors
            /// If a setting of `set` does not exist, or its value is of another type.
            pub fn apply(self, config: &mut TrainConfig) -> Result<(), ConfigError> {
                $( if let Some(value) = self.$name { config.$name = value; } )*
                self.set.iter().try_for_each(|setting| config.set(setting))
            }
        }
    };
}

train_config! {
    /// Dataset folders, separated by commas (see `fmnet-train preprocess --help` for the layouts)
    dataset: List<String> = List(Vec::new()),
    /// Folder of the run: checkpoints, metrics, plot
    out ('o'): PathBuf = PathBuf::from("runs/default"),
    /// Folder where preprocessed shapes are kept; empty: OUT/cache
    cache: PathBuf = PathBuf::new(),
    /// Weights that the training starts from: a checkpoint, a model file (.onnx) of a DiffusionNet, or embedded, the
    /// built-in model; empty: random ones
    initial: PathBuf = PathBuf::new(),
    /// Splits to train on: train, validation, test, separated by commas
    splits: List<Split> = List(vec![Split::Train]),
    /// Minibatches to train for, 1 or more
    steps: u64 = 3000,
    /// Pairs in a minibatch, 1 or more; their gradients are averaged
    pairs: usize = 1,
    /// Corresponding points in a minibatch, at most; k or more for the residual network; the paper uses about 1500
    points: usize = 1024,
    /// Points of each group between which geodesic distances are computed beforehand, 100 or more
    pool: usize = 2500,
    /// Eigenfunctions of the functional map, 1 to 352
    k ('k'): usize = 100,
    /// Meshes of more vertices are decimated to so many, 500 or more; 0: never
    decimate: usize = 15_000,
    /// SHOT radius, relative to sqrt(area), between 0 and 1
    shot_radius: f64 = ShotOptions::default().radius,
    /// Solver of the functional map inside the training: least-squares (the paper's) or regularized
    solver: SolverKind = SolverKind::Regularized,
    /// Weight of the resolvent mask in the regularised solver, relative to the mean diagonal of F F^T, 0 or more
    mask_weight: f64 = 0.1,
    /// How points are drawn
    sampling: Sampling = Sampling::Uniform,
    /// Each point is replaced by one of so many nearest vertices, 1 (none) to 100; the paper uses 10 for scans
    jitter: usize = 1,
    /// Learning rate of Adam at the beginning, above 0
    learning_rate: f64 = 1e-3,
    /// Learning rate at the end, 0 or more; it falls along a half cosine
    final_learning_rate: f64 = 3e-5,
    /// Gradients of a larger norm are scaled down to it, 0 or more; 0: never
    clip: f64 = 5.0,
    /// Seed of the initialisation, the pools and the minibatches
    seed: u64 = 1,
    /// Minibatches between checkpoints, 1 or more
    checkpoint_every: u64 = 100,
    /// Minibatches between validations; 0: never
    validate_every: u64 = 500,
    /// Pairs of the validation split to validate on, at most, 1 or more
    validation_pairs: usize = 10,
}

/// Why a configuration cannot be used.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is no configuration.
    #[error("{path}: {reason}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// What is wrong, and on which line.
        reason: String,
    },
    /// A setting of `--set` cannot be used.
    #[error("--set {setting}: {reason}")]
    Set {
        /// The setting and its value, as given.
        setting: String,
        /// What is wrong.
        reason: String,
    },
    /// A setting of the network is out of its range.
    #[error("network: {0}")]
    Network(String),
    /// A value is out of its range.
    #[error("{name} is {value}, but must be {expected}")]
    Range {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// The range.
        expected: &'static str,
    },
}

impl TrainConfig {
    /// Reads a TOML file; settings it leaves out have their defaults.
    ///
    /// # Errors
    /// If the file cannot be read, is no TOML, or has an unknown setting or one of another type; ranges are left to
    /// [`TrainConfig::check`].
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.to_path_buf(), source })?;
        Self::parse(&text).map_err(|reason| ConfigError::Parse { path: path.to_path_buf(), reason })
    }

    /// Reads the text of a TOML file, also one of a version that had no tables for network and losses.
    ///
    /// # Errors
    /// The reason, if it is no TOML, or has an unknown setting or one of another type.
    pub fn parse(text: &str) -> Result<Self, String> {
        let table: toml::Table = toml::from_str(text).map_err(|e| e.to_string())?;
        match earlier::is_earlier(&table) {
            true => earlier::migrated(table)?.try_into().map_err(|e: toml::de::Error| e.to_string()),
            // From the text itself, so that the message names the line.
            false => toml::from_str(text).map_err(|e| e.to_string()),
        }
    }

    /// The paper's network, loss and settings.
    pub fn paper() -> Self {
        Self {
            points: 1000,
            k: 120,
            final_learning_rate: 1e-5,
            clip: 0.0,
            network: NetworkOptions::Residual(ResidualOptions::default()),
            loss: LossOptions::soft_error(),
            ..Self::default()
        }
    }

    /// Replaces the setting of a text `name=value`, where the name of a setting in a table is `table.name`.
    ///
    /// # Errors
    /// If there is no such setting, or the value is of another type.
    pub fn set(&mut self, setting: &str) -> Result<(), ConfigError> {
        let wrong = |reason: String| ConfigError::Set { setting: setting.to_string(), reason };
        let (name, value) =
            setting.split_once('=').ok_or_else(|| wrong("expected NAME=VALUE".to_string()))?;
        // A word without quotes is a text.
        let parsed = toml::from_str::<toml::Table>(&format!("value = {value}"));
        let value = parsed.ok().and_then(|mut table| table.remove("value"));
        let value = value.unwrap_or_else(|| toml::Value::String(setting[name.len() + 1..].to_string()));
        let mut table = toml::Table::try_from(&*self).expect("plain data serialises");
        if name == "network.kind" {
            // The settings of another kind of network do not fit.
            table.insert("network".into(), toml::Value::Table(toml::Table::new()));
        }
        let mut place = &mut table;
        let mut parts = name.split('.').peekable();
        while let Some(part) = parts.next() {
            if parts.peek().is_none() {
                place.insert(part.to_string(), value);
                break;
            }
            place = match place.get_mut(part) {
                Some(toml::Value::Table(inner)) => inner,
                _ => return Err(wrong(format!("there is no table {part:?}"))),
            };
        }
        *self = table.try_into().map_err(|e: toml::de::Error| wrong(e.message().to_string()))?;
        Ok(())
    }

    /// The whole configuration as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("plain data serialises")
    }

    /// Checks every value's range.
    ///
    /// # Errors
    /// If a value is out of its range: the first one.
    pub fn check(&self) -> Result<(), ConfigError> {
        let range = |name, ok: bool, value: &dyn fmt::Display, expected| match ok {
            true => Ok(()),
            false => Err(ConfigError::Range { name, value: value.to_string(), expected }),
        };
        let at_least_0 = |value: f64| value >= 0.0 && value.is_finite();
        let above_0 = |value: f64| value > 0.0 && value.is_finite();
        range("dataset", !self.dataset.0.is_empty(), &"empty", "one folder at least")?;
        for (name, path) in [("out", &self.out), ("cache", &self.cache)] {
            let expected = "a name in Unicode, as config.toml in the run's folder names it";
            range(name, path.to_str().is_some(), &path.display(), expected)?;
        }
        range("steps", self.steps > 0, &self.steps, "1 or more")?;
        range("pairs", self.pairs > 0, &self.pairs, "1 or more")?;
        range("pool", self.pool >= 100, &self.pool, "100 or more")?;
        range("k", (1..=352).contains(&self.k), &self.k, "from 1 to 352, the width of the descriptors")?;
        if matches!(self.network, NetworkOptions::Residual(_)) {
            range(
                "points",
                self.points >= self.k,
                &self.points,
                "k or more, else the points cannot tell k functions apart",
            )?;
        }
        range("points", self.points >= 2, &self.points, "2 or more")?;
        range(
            "decimate",
            self.decimate == 0 || self.decimate >= 500,
            &self.decimate,
            "0 (never) or 500 or more",
        )?;
        range(
            "shot-radius",
            self.shot_radius > 0.0 && self.shot_radius < 1.0,
            &self.shot_radius,
            "between 0 and 1",
        )?;
        let trainable = matches!(self.solver, SolverKind::LeastSquares | SolverKind::Regularized);
        let solver = format!("{:?}", self.solver);
        range("solver", trainable, &solver, "least-squares or regularized, which solve in one direction")?;
        range("mask-weight", at_least_0(self.mask_weight), &self.mask_weight, "a finite number, 0 or more")?;
        let loss = &self.loss;
        range("loss.gamma", (0.0..=1.0).contains(&loss.gamma), &loss.gamma, "from 0 to 1")?;
        range("loss.margin", above_0(loss.margin), &loss.margin, "a finite number above 0")?;
        range("loss.temperature", above_0(loss.temperature), &loss.temperature, "a finite number above 0")?;
        for (name, weight) in loss.weights() {
            range(
                name,
                at_least_0(weight),
                &weight,
                "a finite number, 0 or more: it is the weight of a loss",
            )?;
        }
        let total: f64 = loss.weights().iter().map(|(_, weight)| weight).sum();
        range("loss", total > 0.0, &"all of weight 0", "one weight above 0 at least")?;
        self.network.check().map_err(ConfigError::Network)?;
        range("jitter", (1..=100).contains(&self.jitter), &self.jitter, "from 1 (none) to 100")?;
        range("learning-rate", above_0(self.learning_rate), &self.learning_rate, "a finite number above 0")?;
        range(
            "final-learning-rate",
            at_least_0(self.final_learning_rate),
            &self.final_learning_rate,
            "a finite number, 0 or more",
        )?;
        range("clip", at_least_0(self.clip), &self.clip, "a finite number, 0 (never) or more")?;
        range(
            "validation-pairs",
            self.validation_pairs > 0 || self.validate_every == 0,
            &self.validation_pairs,
            "1 or more; to leave out validation set validate-every to 0",
        )?;
        range("checkpoint-every", self.checkpoint_every > 0, &self.checkpoint_every, "1 or more")
    }

    /// How shapes are processed.
    pub fn shape_options(&self) -> ShapeOptions {
        let mut options = ShapeOptions::default();
        options.decimate = Some(self.decimate).filter(|&n| n > 0);
        options
    }

    /// How SHOT is computed.
    pub fn shot_options(&self) -> ShotOptions {
        let mut options = ShotOptions::default();
        options.radius = self.shot_radius;
        options
    }

    /// Eigenpairs that network and functional map need of each shape.
    pub fn eigenpairs(&self) -> usize {
        self.k.max(self.diffusion().map_or(0, DiffusionOptions::eigenpairs))
    }

    /// The settings of the DiffusionNet; `None` for the residual network.
    pub fn diffusion(&self) -> Option<&DiffusionOptions> {
        match &self.network {
            NetworkOptions::Diffusion(options) => Some(options),
            NetworkOptions::Residual(_) => None,
        }
    }

    /// Whether training needs points that correspond: the residual network sees nothing else, and most losses compare
    /// them.
    pub(crate) fn needs_points(&self) -> bool {
        self.diffusion().is_none() || self.loss.spectral > 0.0 || self.loss.needs_points()
    }

    /// What a step minimises and how.
    pub fn step_options(&self) -> StepOptions {
        let functional_map = FmapSolver::new(self.solver, Some(self.mask_weight));
        let clip = Some(self.clip).filter(|&clip| clip > 0.0);
        StepOptions { functional_map, loss: self.loss.clone(), clip, ..StepOptions::default() }
    }

    /// The solver of the functional map that a model of this run is matched with: both directions of a regularised
    /// DiffusionNet.
    pub fn fmap_solver(&self) -> FmapSolver {
        match self.solver {
            SolverKind::Regularized if self.diffusion().is_some() => {
                FmapSolver::Joint { weight: self.mask_weight }
            }
            solver => FmapSolver::new(solver, Some(self.mask_weight)),
        }
    }

    /// Folder of preprocessed shapes.
    pub fn cache_folder(&self) -> PathBuf {
        if self.cache.as_os_str().is_empty() { self.out.join("cache") } else { self.cache.clone() }
    }

    /// Learning rate of minibatch `step`, from 0: from `learning_rate` to `final_learning_rate` along a half cosine.
    pub fn learning_rate_at(&self, step: u64) -> f64 {
        let progress = (step as f64 / self.steps as f64).min(1.0);
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * progress).cos());
        self.final_learning_rate + (self.learning_rate - self.final_learning_rate) * cosine
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_saved_configuration_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.toml");
        let config = TrainConfig {
            k: 70,
            jitter: 10,
            dataset: List(vec!["a".into(), "b".into()]),
            ..Default::default()
        };
        std::fs::write(&path, config.to_toml()).unwrap();
        assert_eq!(TrainConfig::read(&path).unwrap(), config);
    }

    #[test]
    fn solver_and_norm_are_named_as_ever() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.toml");
        std::fs::write(&path, "solver = \"least-squares\"\nmask-weight = 0.1\ncolumn-norm = \"l1\"").unwrap();
        let config = TrainConfig::read(&path).unwrap();
        assert_eq!(
            (config.fmap_solver(), config.loss.column_norm),
            (FmapSolver::LeastSquares, fmnet::fmap::ColumnNorm::L1)
        );
        assert_eq!(TrainConfig::paper().fmap_solver(), FmapSolver::default());
        assert_eq!(TrainConfig::default().fmap_solver(), FmapSolver::Joint { weight: 0.1 });
    }

    #[test]
    fn a_misspelt_setting_and_a_value_out_of_range_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.toml");
        std::fs::write(&path, "learning-rat = 0.1").unwrap();
        assert!(TrainConfig::read(&path).unwrap_err().to_string().contains("learning-rat"));
        let config = TrainConfig { k: 400, dataset: List(vec!["a".into()]), ..Default::default() };
        assert!(config.check().unwrap_err().to_string().starts_with("k is 400"));
    }

    #[test]
    fn every_number_out_of_its_range_is_named() {
        let good = TrainConfig { dataset: List(vec!["a".into()]), ..Default::default() };
        good.check().unwrap();
        TrainConfig { validation_pairs: 0, validate_every: 0, ..good.clone() }.check().unwrap();
        let named = |name: &str, set: &dyn Fn(&mut TrainConfig)| {
            let mut config = good.clone();
            set(&mut config);
            let error = config.check().unwrap_err().to_string();
            assert!(error.starts_with(&format!("{name} is ")), "{error}");
        };
        for wrong in [-1.0, f64::NAN, f64::INFINITY] {
            named("clip", &|c| c.clip = wrong);
            named("mask-weight", &|c| c.mask_weight = wrong);
            named("loss.margin", &|c| c.loss.margin = wrong);
            named("loss.gamma", &|c| c.loss.gamma = wrong);
            named("spectral", &|c| c.loss.spectral = wrong);
            named("shot-radius", &|c| c.shot_radius = wrong);
            named("learning-rate", &|c| c.learning_rate = wrong);
            named("final-learning-rate", &|c| c.final_learning_rate = wrong);
        }
        named("validation-pairs", &|c| c.validation_pairs = 0);
        named("decimate", &|c| c.decimate = 499);
        named("solver", &|c| c.solver = SolverKind::Joint);
    }

    #[test]
    fn the_command_line_wins_over_the_file() {
        let mut config = TrainConfig { k: 70, ..Default::default() };
        TrainOverrides { k: Some(50), ..Default::default() }.apply(&mut config).unwrap();
        assert_eq!((config.k, config.points), (50, 1024));
        let set = |settings: &[&str]| TrainOverrides {
            set: settings.iter().map(ToString::to_string).collect(),
            ..Default::default()
        };
        set(&["loss.spectral=0.5", "network.width=64", "solver=least-squares"]).apply(&mut config).unwrap();
        assert_eq!((config.loss.spectral, config.solver), (0.5, SolverKind::LeastSquares));
        assert_eq!(config.diffusion().unwrap().width, 64);
        set(&["network.kind=residual", "network.blocks=3"]).apply(&mut config).unwrap();
        assert!(matches!(&config.network, NetworkOptions::Residual(options) if options.blocks == 3));
        for wrong in ["loss.spectrum=1", "nothing.here=1", "loss.spectral=many", "k"] {
            let error = set(&[wrong]).apply(&mut config).unwrap_err().to_string();
            assert!(error.starts_with(&format!("--set {wrong}: ")), "{error}");
        }
    }
}
