//! The command line.

use clap::{Args, Parser, Subcommand, ValueEnum};
use fmnet::fmap::{FmapSolver, SolverKind};
use fmnet::network::Backend;
use fmnet::pipeline::{DescriptorKind, Effort, MatchOptions, ModelSource, Refinement, Resize, Upscaling};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Dense correspondence between deformable 3D shapes: two meshes in, a map out.
///
/// A map gives every vertex of the source a vertex of the target. Meshes may be OFF, PLY, OBJ, glTF, GLB or STL, in
/// any unit, with holes, several components and other defects; results are always in the vertices of the files as
/// they are.
///
/// Exit status: 0 success, 2 bad usage or bad input, 1 a failure of the program; with `match --strict` 3 for a
/// doubtful map.
#[derive(Debug, Parser)]
#[command(name = "fmnet-infer", version, max_term_width = 110)]
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
    /// Print a summary for scripts on standard output: sizes, settings, seconds of every stage
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Match two built-in shapes, print the error against exact ground truth, write a viewer
    Demo(DemoArgs),
    /// Match two meshes
    Match(MatchArgs),
    /// Match many pairs; each shape is processed once, and an interrupted run goes on where it was
    Batch(BatchArgs),
    /// Carry colours, texture coordinates, scalar fields, landmarks or skin weights over a map
    Transfer(TransferArgs),
    /// Write eigenvalues, eigenvectors, vertex areas and descriptors of a mesh as .npy files
    Features(FeaturesArgs),
    /// Compare a map with ground truth: mean geodesic error, error curve
    Evaluate(EvaluateArgs),
    /// Say what a mesh or a model is, what is wrong with it and what would be repaired
    Inspect(InspectArgs),
}

/// Options that decide what is computed of a shape.
#[derive(Clone, Debug, Args)]
pub(crate) struct ShapeArgs {
    /// Model file, or the name of one in ./models [default: the model built into this program]
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) model: Option<PathBuf>,
    /// What computes the network
    #[arg(long, value_enum, default_value = "native")]
    pub(crate) backend: Backend,
    /// Learned descriptors, or SHOT without a network (the paper's baseline)
    #[arg(long, value_enum, default_value = "learned")]
    pub(crate) descriptor: DescriptorKind,
    /// Eigenfunctions of the functional map, 1 to 500 [default: the model's; 120 with SHOT]
    #[arg(short, long, value_parser = clap::value_parser!(u16).range(1..=500))]
    pub(crate) k: Option<u16>,
    /// Decimate larger meshes to so many vertices, 100 and up, or `off` [default: the model's; 15000 with SHOT]
    #[arg(long, value_name = "N|off", value_parser = resize)]
    pub(crate) decimate: Option<Resize>,
    /// Subdivide smaller meshes inside to so many vertices, 100 and up, or `off`; results stay in the file's vertices
    /// [default: 2000; off for features and for the refinements pmf and shared-triangulation]
    #[arg(long, value_name = "N|off", value_parser = resize)]
    pub(crate) subdivide: Option<Resize>,
    /// SHOT radius relative to sqrt(area), between 0 and 1 [default: the model's; 0.067 with SHOT]
    #[arg(long, value_parser = radius)]
    pub(crate) shot_radius: Option<f64>,
    /// Keep what is computed of each shape in this folder, and use what is there
    #[arg(long, value_name = "DIR")]
    pub(crate) cache: Option<PathBuf>,
}

/// Options that decide how shapes are processed and matched.
#[derive(Clone, Debug, Args)]
pub(crate) struct PipelineArgs {
    #[command(flatten)]
    pub(crate) shape: ShapeArgs,
    /// Solver of the functional map [default: bidirectional, or what the model was trained with; least-squares with
    /// SHOT]
    #[arg(long, value_enum)]
    pub(crate) fm: Option<SolverKind>,
    /// Weight of the mask of the regularised solvers, 0 and up [default: 0.03 for bidirectional, else 0.1]
    #[arg(long, value_parser = non_negative)]
    pub(crate) mask_weight: Option<f64>,
    /// Refinement of the map [default: wavelet, or zoomout for models that find one functional map; none with SHOT]
    #[arg(long, value_enum)]
    pub(crate) refine: Option<Refinement>,
    /// How the map of decimated meshes becomes one of the full meshes
    #[arg(long, value_enum, default_value = "surface")]
    pub(crate) upscale: Upscaling,
    /// How many ways to a map are tried; the one that looks best is taken
    #[arg(long, value_enum, default_value = "normal")]
    pub(crate) effort: Effort,
    /// Adapt the network to the pair by so many steps, 0 to 100, about half a second each; the map is taken if it
    /// looks better [default: 10 where the first map is doubtful, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=100))]
    pub(crate) adapt: Option<u16>,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  fmnet-infer demo -o demo.html")]
pub(crate) struct DemoArgs {
    /// Where the viewer is written
    #[arg(short, long, value_name = "FILE.html", default_value = "fmnet-demo.html")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  fmnet-infer match man.obj woman.glb -o map.txt -o pair.html")]
pub(crate) struct MatchArgs {
    /// Mesh whose vertices are to be matched
    pub(crate) source: PathBuf,
    /// Mesh that they are matched to
    pub(crate) target: PathBuf,
    /// Output; may be given several times. The extension decides: .txt (one 0-based target vertex a line, -1 where
    /// unmatched), .vts (1-based), .npy (int32), .csv (source, target, confidence and the point on the target's
    /// surface), .npz (the same as arrays), .ply or .glb (both meshes side by side, coloured alike where they match),
    /// .png (a picture of that), .html (viewer)
    #[arg(short, long = "output", value_name = "MAP", required = true)]
    pub(crate) outputs: Vec<PathBuf>,
    /// The source is a part of a shape, with holes or cut off, and the target the whole, in whatever pose; both in
    /// the same unit of length. Parts determine fewer eigenfunctions than wholes; where the map is doubtful, fewer
    /// are tried, and other sizes of the part
    #[arg(long)]
    pub(crate) partial: bool,
    /// Matches that are known, kept exactly, which pull the rest of the map: a text file with a source vertex and a
    /// target vertex a line, 0-based, or one vertex that both have; # begins a comment
    #[arg(long, value_name = "FILE")]
    pub(crate) landmarks: Option<PathBuf>,
    /// End with exit status 3 where the map is doubtful or mirrored; it is written all the same
    #[arg(long)]
    pub(crate) strict: bool,
    /// Write the functional map, [k of target, k of source]
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) save_functional_map: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pipeline: PipelineArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  fmnet-infer batch pairs.txt --root scans --out maps")]
pub(crate) struct BatchArgs {
    /// Text file with a pair of mesh files a line, separated by white space, a comma, a semicolon or a tab; names
    /// with spaces may stand in quotes; # begins a comment. `-` is standard input
    pub(crate) pairs: PathBuf,
    /// Folder for the maps, SOURCE__TARGET.EXT, each with a .key file that says what it was made from. A map that is
    /// there is kept where both meshes, the model and every option are the same as then, else made anew
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Format of the maps
    #[arg(long, value_name = "EXT", default_value = "txt", value_parser = ["txt", "vts", "npy", "csv", "npz"])]
    pub(crate) format: String,
    /// Every source is a part of a shape and its target the whole, in the same unit of length
    #[arg(long)]
    pub(crate) partial: bool,
    /// Folder that mesh files are relative to [default: that of the list]
    #[arg(long, value_name = "DIR")]
    pub(crate) root: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pipeline: PipelineArgs,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  fmnet-infer transfer scan.obj rig.glb --map scan_to_rig.txt -o rigged_scan.glb"
)]
pub(crate) struct TransferArgs {
    /// Source mesh of the map
    pub(crate) source: PathBuf,
    /// Target mesh of the map
    pub(crate) target: PathBuf,
    /// The map: for each source vertex a target vertex (.txt, .vts, .npy, .csv or .npz)
    #[arg(long)]
    pub(crate) map: PathBuf,
    /// Which mesh receives. `source` takes from the target what each vertex is matched to. `target` takes from the
    /// source: each vertex from the source vertex whose match is nearest
    #[arg(long, value_enum, default_value = "source")]
    pub(crate) to: Receiver,
    /// Per-vertex values of the giving mesh to carry over as well: scalar fields, skin weights or labels [n] or [n,
    /// q] (.npy; integers are labels and never mixed), or landmarks (.txt, a 0-based vertex a line); each needs an
    /// output of its extension
    #[arg(long, value_name = "FILE")]
    pub(crate) values: Vec<PathBuf>,
    /// Output: the receiving mesh (.ply, .obj, .glb, .off) with the attributes of the giving mesh file beside its
    /// own; or, for each --values in turn, a file of the same kind (.npy, .txt)
    #[arg(short, long = "output", required = true)]
    pub(crate) outputs: Vec<PathBuf>,
}

/// The mesh that receives attributes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Receiver {
    Source,
    Target,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  fmnet-infer features man.ply --out features -k 100")]
pub(crate) struct FeaturesArgs {
    /// The mesh
    pub(crate) mesh: PathBuf,
    /// Folder for eigenvalues.npy [k], eigenvectors.npy [n,k], mass.npy [n], what else the model takes (shot.npy
    /// [n,352], gradients_x.npy and gradients_y.npy [n,k]) and its descriptors.npy [n,d]; without a model shot.npy
    /// alone. Where the mesh was repaired or decimated so that vertices differ from the file's, also vertices.npy
    /// [n]: the file's vertex of each row. Files of an earlier run are replaced or removed
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) shape: ShapeArgs,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  fmnet-infer evaluate map.txt --source a.ply --target b.ply --ground-truth identity -o curve.svg"
)]
pub(crate) struct EvaluateArgs {
    /// Maps to evaluate, of the same pair; several are drawn into one plot
    #[arg(required = true)]
    pub(crate) maps: Vec<PathBuf>,
    /// Source mesh
    #[arg(long)]
    pub(crate) source: PathBuf,
    /// Target mesh
    #[arg(long)]
    pub(crate) target: PathBuf,
    /// `identity` (vertex i corresponds with vertex i), a map file, points on the target (.corr, .baryc_gt), or two
    /// .vts or .corr files separated by a comma (line i of the one corresponds with line i of the other)
    #[arg(long, value_name = "identity|FILE|FILE_A,FILE_B")]
    pub(crate) ground_truth: OsString,
    /// Second ground truth, the left-right mirrored one; the better of the two counts
    #[arg(long, value_name = "identity|FILE|FILE_A,FILE_B")]
    pub(crate) symmetric_ground_truth: Option<OsString>,
    /// Output: .csv (curve), .svg (plot) or .html (report with pictures); may be given several times
    #[arg(short, long = "output")]
    pub(crate) outputs: Vec<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  fmnet-infer inspect man.obj")]
pub(crate) struct InspectArgs {
    /// A mesh file, or a model (.onnx)
    pub(crate) file: PathBuf,
}

/// `--decimate` and `--subdivide`: a number of vertices, or never.
fn resize(text: &str) -> Result<Resize, String> {
    match text {
        "off" => Ok(Resize::Never),
        _ => match text.parse() {
            Ok(n) if n >= 100 => Ok(Resize::To(n)),
            _ => Err("expected a number of vertices, 100 or more, or `off`".into()),
        },
    }
}

fn positive(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&n| n > 0).ok_or_else(|| "expected 1 or more".into())
}

fn non_negative(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite() && *x >= 0.0).ok_or_else(|| "expected 0 or more".into())
}

fn radius(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|&x| x > 0.0 && x < 1.0)
        .ok_or_else(|| "expected a number between 0 and 1".into())
}

impl ShapeArgs {
    /// The file of the model, if one is named.
    pub(crate) fn model_file(&self) -> Option<PathBuf> {
        self.model.as_deref().map(model_path)
    }

    /// The library's options, those of matching at their defaults.
    pub(crate) fn to_options(&self) -> MatchOptions {
        MatchOptions::default()
            .descriptor(self.descriptor)
            .model(self.model_file().map_or(ModelSource::Embedded, ModelSource::File))
            .backend(self.backend)
            .k(self.k.map(usize::from))
            .shot_radius(self.shot_radius)
            .decimate(self.decimate.unwrap_or_default())
            .subdivide(self.subdivide.unwrap_or_default())
            .cache(self.cache.clone())
    }
}

impl PipelineArgs {
    /// The library's options.
    pub(crate) fn to_options(&self) -> MatchOptions {
        let options = self.shape.to_options();
        options
            .solver(FmapSolver::chosen(self.fm, self.mask_weight))
            .refinement(self.refine)
            .upscaling(self.upscale)
            .effort(self.effort)
            .adapt(self.adapt.map(usize::from))
    }
}

/// A path, or the name of a model in `./models`.
fn model_path(model: &Path) -> PathBuf {
    let named = Path::new("models").join(model).join("model.onnx");
    let is_file = model.extension().is_some_and(|e| e == "onnx");
    if !is_file && named.is_file() { named } else { model.into() }
}
