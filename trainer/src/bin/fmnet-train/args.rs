//! The command line.

use clap::{Args, Parser, Subcommand};
use fmnet::fmap::SolverKind;
use fmnet::pipeline::Refinement;
use fmnet_trainer::config::{TrainConfig, TrainOverrides};
use fmnet_trainer::dataset::Split;
use fmnet_trainer::simulate::{PartOptions, ScanOptions, TriangulationOptions};
use std::path::PathBuf;

/// Trains the descriptor network of fmnet through the functional map, and exports it to ONNX.
///
/// From nothing to a model:
///
///   fmnet-train synth data/bodies
///   fmnet-train train --dataset data/bodies --out runs/bodies
///   fmnet-train export runs/bodies -o bodies.onnx
#[derive(Debug, Parser)]
#[command(name = "fmnet-train", version, max_term_width = 110, verbatim_doc_comment)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Options of every command.
#[derive(Clone, Debug, Args)]
pub(crate) struct Common {
    /// Threads to use; the result does not depend on it [default: all cores]
    #[arg(long, global = true, value_parser = positive)]
    pub(crate) threads: Option<usize>,
    /// Say nothing but warnings and errors
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Print a summary for scripts on standard output
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Generate a dataset of deforming bodies with exact ground truth
    Synth(SynthArgs),
    /// Make scans, parts or other triangulations of a dataset's shapes; an interrupted run goes on where it was
    Simulate(SimulateArgs),
    /// Compute eigenbases, SHOT and geodesic distances of a dataset once; an interrupted run goes on where it was
    Preprocess(PreprocessArgs),
    /// Train a network, or go on training it: the same command again resumes from the last checkpoint
    Train(Box<TrainArgs>),
    /// Write a checkpoint's network as a model file
    Export(ExportArgs),
    /// Fit what the measures of a model's maps say of their error, on pairs with ground truth; for
    /// `export --calibration`
    Calibrate(CalibrateArgs),
    /// Match pairs of a dataset with one or several models, compare with the ground truth: tables, plots, a report
    Evaluate(EvaluateArgs),
    /// Run one of the paper's experiments end to end: generate, train, test, report; run again, it goes on where it was
    Reproduce(ReproduceArgs),
}

#[derive(Debug, Args)]
pub(crate) struct SynthArgs {
    /// Folder for the dataset
    pub(crate) folder: PathBuf,
    /// Write the two bodies of `fmnet-infer demo` instead, source.ply and target.ply
    #[arg(long)]
    pub(crate) demo: bool,
    /// Individuals of each species, 2 and up
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) count: u32,
    /// Species, separated by commas, and families (biped, quadruped, hand, bird, fish,
    /// insect) for all of theirs [default: all]
    #[arg(long, value_delimiter = ',')]
    pub(crate) species: Vec<String>,
    /// Share of the individuals of each species that are for validation, 0 to 0.9
    #[arg(long, default_value_t = 0.1)]
    pub(crate) validation: f64,
    /// Seed, 0 to 65535: the same seed gives the same dataset
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u32,
    /// Least number of vertices of a body, 4000 up to the largest
    #[arg(long, default_value_t = 5000)]
    pub(crate) min_vertices: usize,
    /// Largest number of vertices of a body, up to 15000
    #[arg(long, default_value_t = 7000)]
    pub(crate) max_vertices: usize,
    /// Holes in each body, 0 to 20
    #[arg(long, default_value_t = 0)]
    pub(crate) holes: usize,
    /// Limbs cut off each body, 0 to 3
    #[arg(long, default_value_t = 0)]
    pub(crate) cuts: usize,
    /// Noise on the vertices, relative to the mean edge length, 0 to 0.5
    #[arg(long, default_value_t = 0.0)]
    pub(crate) noise: f64,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    #[command(subcommand)]
    pub(crate) what: Simulated,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Simulated {
    /// What a 3D scanner would have made of registered shapes, in the layout of the FAUST scans
    ///
    /// Writes OUT/scans/tr_scan_NNN.ply and OUT/registrations/tr_reg_NNN.ply, which `preprocess`
    /// and `train` take like real scans. Each scan lies where its registration lies and has a
    /// triangulation of its own. Parts that nearly touch are glued, some of what no camera sees is
    /// missing, and there are holes, noise and stray pieces.
    ///
    /// For scans as the paper trains on them:
    ///
    ///   fmnet-train simulate scans FAUST/registrations data/scans
    ///   fmnet-train train --dataset data/scans --out runs/scans -k 70 --sampling area --jitter 10
    #[command(verbatim_doc_comment)]
    Scans {
        /// Registrations to scan: a folder of closed shapes that correspond vertex by vertex, such as FAUST's or
        /// SCAPE's
        dataset: PathBuf,
        /// Folder for the scans
        out: PathBuf,
        /// Splits of the dataset to scan, separated by commas
        #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Split::Train, Split::Validation, Split::Test])]
        splits: Vec<Split>,
        #[command(flatten)]
        options: ScanOptions,
    },
    /// Parts of a whole with holes or cut by a plane
    ///
    /// Of shapes that correspond vertex by vertex, in the layout of the SHREC'16 partial correspondence
    /// benchmark: OUT/null/CLASS.off, the whole, and OUT/holes/holes_CLASS_shape_N.off with .baryc_gt
    /// (where on the whole each vertex lies), likewise OUT/cuts. Each class of the dataset needs
    /// three poses: the first is the whole; parts 1 to 10, for training, and the parts after them,
    /// for testing, are cut out of different ones.
    ///
    /// Of any others, a part of each kind of every shape beside the shape itself: OUT/shapes/NAME.ply and
    /// OUT/shapes/NAME_holes.ply or NAME_cuts.ply, each with NAME.corr (line i: the triangle, counted
    /// from 1, and the three weights of point i, -1 where it is cut away), and OUT/dataset.toml.
    ///
    ///   fmnet-train simulate parts TOSCA/dog data/dog-parts
    ///   fmnet-train train --dataset data/dog-parts --out runs/dog -k 100 --steps 1000
    #[command(verbatim_doc_comment)]
    Parts {
        /// Shapes to cut: any dataset of whole shapes
        dataset: PathBuf,
        /// Folder for the parts
        out: PathBuf,
        #[command(flatten)]
        options: PartOptions,
    },
    /// Shapes triangulated as other people and programs would have done it, with points on the surface that correspond
    ///
    /// Writes OUT/shapes/NAME.ply with NAME.corr (line i: the triangle, counted from 1, and the three
    /// weights of point i, -1 where it is missing) and OUT/dataset.toml. Each shape is triangulated on
    /// its own in a manner that is drawn for it, and some get noise, holes, cut ends, glued contacts
    /// and stray pieces. Groups and splits are the dataset's.
    ///
    ///   fmnet-train simulate triangulations FAUST/registrations data/faust-triangulations
    ///   fmnet-train train --dataset data/faust-triangulations --out runs/faust
    #[command(verbatim_doc_comment)]
    Triangulations {
        /// Any dataset
        dataset: PathBuf,
        /// Folder for the triangulations
        out: PathBuf,
        /// Splits of the dataset to triangulate, separated by commas
        #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Split::Train, Split::Validation, Split::Test])]
        splits: Vec<Split>,
        #[command(flatten)]
        options: TriangulationOptions,
    },
}

#[derive(Debug, Args)]
pub(crate) struct PreprocessArgs {
    /// Dataset folders: FAUST registrations (tr_reg_NNN.ply), FAUST remeshed (tr_reg_NNN.off with corres/*.vts),
    /// FAUST scans (scans/ and registrations/), SCAPE (meshNNN.off), TOSCA (CLASSn.off), SHREC'16 partial (null/ with
    /// holes/ or cuts/), or any folder with a dataset.toml
    #[arg(required = true)]
    pub(crate) datasets: Vec<String>,
    /// Folder for the results; pass the same to `train`
    #[arg(long, value_name = "DIR")]
    pub(crate) cache: PathBuf,
    /// Training configuration that the results are for
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) config: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct TrainArgs {
    /// Settings from a file; options on the command line win over it
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) config: Option<PathBuf>,
    /// Train on the first NVIDIA GPU (needs the feature `cuda`)
    #[arg(long)]
    pub(crate) cuda: bool,
    #[command(flatten)]
    pub(crate) overrides: TrainOverrides,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// A run's folder (its best checkpoint, or the last where nothing was validated), or a checkpoint
    pub(crate) checkpoint: PathBuf,
    /// The model file
    #[arg(short, long, value_name = "MODEL.onnx")]
    pub(crate) output: PathBuf,
    /// What the model was trained on, for its metadata [default: the names of the dataset folders]
    #[arg(long)]
    pub(crate) training_set: Option<String>,
    /// Licence of the weights, for the metadata
    #[arg(long, default_value = "unspecified")]
    pub(crate) license: String,
    /// Eigenfunctions of the functional map when meshes are matched, 1 to 500; raw maps often gain by more than in
    /// training [default: as in training]
    #[arg(short, long, value_parser = clap::value_parser!(u16).range(1..=500))]
    pub(crate) k: Option<u16>,
    /// Meshes of more vertices are decimated to so many when they are matched, 100 or more; 0: never [default: as in
    /// training]
    #[arg(long, value_name = "N")]
    pub(crate) decimate: Option<usize>,
    /// What turns the measures of a map into an estimate of its error, as `fmnet-train calibrate` writes it [default:
    /// the program's own]
    #[arg(long, value_name = "FILE.json")]
    pub(crate) calibration: Option<PathBuf>,
    /// Source revision, for the metadata
    #[arg(long, default_value = env!("CARGO_PKG_VERSION"))]
    pub(crate) commit: String,
}

#[derive(Debug, Args)]
pub(crate) struct CalibrateArgs {
    /// The model file, or `embedded`
    pub(crate) model: PathBuf,
    /// Dataset folders, with pairs that the model was not trained on
    #[arg(required = true)]
    pub(crate) datasets: Vec<PathBuf>,
    /// Where the calibration is written
    #[arg(short, long, value_name = "FILE.json")]
    pub(crate) output: PathBuf,
    /// Random pairs of each dataset, matched in five ways each
    #[arg(long, default_value_t = 20)]
    pub(crate) pairs: usize,
    /// Splits that pairs are drawn from, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "validation")]
    pub(crate) splits: Vec<Split>,
    /// Seed of the pairs
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Keep what is computed of each shape in this folder, and use what is there
    #[arg(long, value_name = "DIR")]
    pub(crate) cache: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// A dataset folder (see `fmnet-train preprocess --help` for the layouts)
    pub(crate) dataset: PathBuf,
    /// Folder for report.html, summary.csv, pairs.csv, curves.csv, the plots (.svg) and the maps
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Model files to compare, or `embedded`, with a name for the tables if wanted; may be given several times
    #[arg(long = "model", value_name = "[NAME=]FILE")]
    pub(crate) models: Vec<String>,
    /// Compare SHOT without a network as well
    #[arg(long)]
    pub(crate) shot: bool,
    /// Compare the map files of another method as well: its name and the folder of SOURCE__TARGET.txt (.vts, .npy,
    /// .npz, .csv); may be given several times
    #[arg(long = "maps", value_name = "NAME=DIR", value_parser = named_folder)]
    pub(crate) maps: Vec<(String, PathBuf)>,
    /// Refinements to compare, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "none,zoomout")]
    pub(crate) refine: Vec<Refinement>,
    /// Splits that pairs are drawn from, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "test")]
    pub(crate) splits: Vec<Split>,
    /// Number of random pairs, 1 and up, or a file with the names of source and target on each line
    #[arg(long, value_name = "N|FILE", default_value = "20")]
    pub(crate) pairs: String,
    /// Seed of the random pairs
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Count a left-right mirrored map as right, where the dataset knows the mirrored ground truth
    #[arg(long)]
    pub(crate) symmetric: bool,
    /// Eigenfunctions of the functional map, 1 to 500 [default: the model's; 120 with SHOT]
    #[arg(short, long, value_parser = clap::value_parser!(u16).range(1..=500))]
    pub(crate) k: Option<u16>,
    /// Solver of the functional map [default: bidirectional, or what the model was trained with; least-squares with
    /// SHOT]
    #[arg(long, value_enum)]
    pub(crate) fm: Option<SolverKind>,
    /// Weight of the mask of the regularised solvers, 0 and up [default: 0.03 for bidirectional, else 0.1]
    #[arg(long)]
    pub(crate) mask_weight: Option<f64>,
    /// Curves of others to draw beside: a header `threshold,NAME,...`, then percentages
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) curves: Option<PathBuf>,
    /// Keep what is computed of each shape in this folder, and use what is there
    #[arg(long, value_name = "DIR")]
    pub(crate) cache: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ReproduceArgs {
    /// The experiment
    #[arg(value_parser = fmnet_trainer::reproduce::NAMES)]
    pub(crate) experiment: String,
    /// Folder of the research data: faust/registrations, faust/remeshed_5k, faust/scans_7k, scape, tosca/dog
    #[arg(long, value_name = "DIR")]
    pub(crate) data: PathBuf,
    /// Folder of trainings and reports, shared by all experiments
    #[arg(long, value_name = "DIR", default_value = "runs/reproduce")]
    pub(crate) out: PathBuf,
    /// Minibatches of each training [default: as many as in the paper, hours to days on a CPU]
    #[arg(long)]
    pub(crate) steps: Option<u64>,
    /// Pairs of each test, where the data has no list of them
    #[arg(long, default_value_t = 20)]
    pub(crate) pairs: usize,
    /// Curves of others to draw beside: a header `threshold,NAME,...`, then percentages
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) curves: Option<PathBuf>,
    /// Train on the first NVIDIA GPU (needs the feature `cuda`)
    #[arg(long)]
    pub(crate) cuda: bool,
}

fn named_folder(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, folder)) if !name.is_empty() && !folder.is_empty() => Ok((name.into(), folder.into())),
        _ => Err("expected NAME=DIR".into()),
    }
}

fn positive(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&n| n > 0).ok_or_else(|| "expected 1 or more".into())
}

/// Adds the defaults of the training settings to their help, from the one place that knows them.
pub(crate) fn with_defaults(command: clap::Command) -> clap::Command {
    let defaults = toml::Table::try_from(TrainConfig::default()).expect("plain data serialises");
    command.mut_subcommand("train", |train| {
        train.mut_args(|arg| {
            let Some(default) = defaults.get(&arg.get_id().as_str().replace('_', "-")) else { return arg };
            let help = arg.get_help().cloned().unwrap_or_default();
            let text = match default {
                toml::Value::String(text) if text.is_empty() => return arg,
                toml::Value::String(text) => text.clone(),
                toml::Value::Array(items) if items.is_empty() => return arg,
                toml::Value::Array(items) => {
                    items.iter().filter_map(toml::Value::as_str).collect::<Vec<_>>().join(",")
                }
                other => other.to_string(),
            };
            arg.help(format!("{help} [default: {text}]"))
        })
    })
}
