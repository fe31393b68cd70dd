//! The contract of a model file: its graph's inputs and output, and what travels in `metadata_props`.
//!
//! Graph: the inputs are quantities of a shape by name ([`Quantity`]), float32, at unit area; the output is
//! `descriptors`, float32 `[n, d]`; the number of vertices `n` is dynamic; standard operators only. Format 1 has the
//! input `shot` alone and d = 352. Metadata: the keys of [`ModelMetadata::to_pairs`], all under the prefix `fmnet.`.

use super::NetworkError;
use super::proto::{Model, Type, ValueInfo};
use crate::descriptor::ShotOptions;
use crate::fmap::FmapSolver;
use crate::quality::Calibration;
use prost::Message;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

/// Width of SHOT.
pub const SHOT_WIDTH: usize = 352;
/// Name of the graph's output.
pub const OUTPUT: &str = "descriptors";
/// The newest format that this version reads.
pub const FORMAT_VERSION: u32 = 2;

/// Most eigenfunctions, of a functional map or as an input.
pub const MAX_K: usize = 500;
/// Most descriptors.
const MAX_OUTPUTS: usize = 4096;
/// Least number of vertices that meshes are decimated to.
const MIN_DECIMATE: usize = 100;

const PREFIX: &str = "fmnet.";
/// The remedy for a file that is no model of ours.
const EXPORT: &str = "export the model with `fmnet-train export`";
const ONNX_FLOAT: i32 = 1;

/// What a network can be given of a shape, at unit area.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// SHOT descriptors, `[n, 352]`.
    Shot,
    /// Vertex areas, `[n]`.
    Mass,
    /// Eigenvalues of the Laplacian, `[k]`.
    Eigenvalues,
    /// Its eigenvectors, `[n, k]`.
    Eigenvectors,
    /// Gradients of the eigenvectors along the first axis of a tangent frame at each vertex, `[n, k]`
    /// ([`crate::spectral::EigenGradients`]).
    GradientsX,
    /// Along the second axis, `[n, k]`.
    GradientsY,
}

impl Quantity {
    /// Every quantity.
    pub const ALL: [Self; 6] =
        [Self::Shot, Self::Mass, Self::Eigenvalues, Self::Eigenvectors, Self::GradientsX, Self::GradientsY];

    /// The name of the input, and of the file that `features` writes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shot => "shot",
            Self::Mass => "mass",
            Self::Eigenvalues => "eigenvalues",
            Self::Eigenvectors => "eigenvectors",
            Self::GradientsX => "gradients_x",
            Self::GradientsY => "gradients_y",
        }
    }

    /// The shape for a `width`, `None` standing for the number of vertices.
    pub fn dims(self, width: usize) -> Vec<Option<usize>> {
        match self {
            Self::Mass => vec![None],
            Self::Eigenvalues => vec![Some(width)],
            Self::Shot | Self::Eigenvectors | Self::GradientsX | Self::GradientsY => vec![None, Some(width)],
        }
    }

    /// The width that an input of these dimensions asks for, or what should be there.
    fn width(self, dims: &[Option<i64>]) -> Result<usize, String> {
        let dynamic = |dim: &Option<i64>| matches!(dim, None | Some(0));
        let width = match (self, dims) {
            (Self::Mass, [n]) if dynamic(n) => Some(0),
            (Self::Eigenvalues, [Some(k)]) => usize::try_from(*k).ok(),
            (Self::Mass | Self::Eigenvalues, _) => None,
            (_, [n, Some(width)]) if dynamic(n) => usize::try_from(*width).ok(),
            _ => None,
        };
        let (expected, fits) = match self {
            Self::Shot => ("[n, 352] with n dynamic", width == Some(SHOT_WIDTH)),
            Self::Mass => ("[n], dynamic", width.is_some()),
            Self::Eigenvalues => ("[k], 1 to 500", width.is_some_and(|k| (1..=MAX_K).contains(&k))),
            _ => {
                ("[n, k] with n dynamic and k from 1 to 500", width.is_some_and(|k| (1..=MAX_K).contains(&k)))
            }
        };
        width.filter(|_| fits).ok_or_else(|| format!("expected the shape {expected}, found {dims:?}"))
    }
}

/// An input of a model's graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModelInput {
    /// Which quantity.
    pub quantity: Quantity,
    /// Its width, 0 for [`Quantity::Mass`]: 352 for SHOT, else the number of eigenpairs.
    pub width: usize,
}

/// What a model file takes and gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Contract {
    /// The inputs, in the graph's order; at least one has a row for each vertex.
    pub inputs: Vec<ModelInput>,
    /// Width `d` of the descriptors.
    pub outputs: usize,
    /// What travels with it.
    pub metadata: ModelMetadata,
}

impl Contract {
    /// Eigenpairs that the inputs need, 0 where they need none.
    pub fn eigenpairs(&self) -> usize {
        let spectral = |input: &&ModelInput| input.quantity != Quantity::Shot;
        self.inputs.iter().filter(spectral).map(|input| input.width).max().unwrap_or(0)
    }

    /// Whether an input is the quantity.
    pub fn takes(&self, quantity: Quantity) -> bool {
        self.inputs.iter().any(|input| input.quantity == quantity)
    }
}

/// What the runtime must know of a model, and what people want to know of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelMetadata {
    /// Format of the file, at most [`FORMAT_VERSION`].
    pub format_version: u32,
    /// The SHOT descriptor that the network was trained on, if it takes one: a radius below 1, 10 bins.
    pub shot: ShotOptions,
    /// Number of eigenfunctions of the functional map. Range 1 to 500.
    pub k: usize,
    /// Solver of the functional map that it was trained with.
    pub solver: FmapSolver,
    /// Meshes of more vertices are decimated to so many, 100 or more; `None`: never.
    pub decimate: Option<usize>,
    /// Whether the network takes statistics over all vertices of a shape, so that rows depend on each other.
    pub per_shape_statistics: bool,
    /// What it was trained on.
    pub training_set: String,
    /// Seed of the training.
    pub seed: u64,
    /// Minibatches of the training.
    pub steps: u64,
    /// Source revision that trained it.
    pub commit: String,
    /// Licence of the weights.
    pub license: String,
    /// What turns the measures of a map by this model into an estimate of its error; models may lack it.
    pub calibration: Option<Calibration>,
}

impl ModelMetadata {
    /// As key-value pairs for `metadata_props`; without a mask its weight is 0, and a `decimate` of 0 stands for never.
    pub fn to_pairs(&self) -> Vec<(String, String)> {
        let (solver, mask_weight) = match self.solver {
            FmapSolver::LeastSquares => ("least-squares", 0.0),
            FmapSolver::Regularized { weight } => ("regularized", weight),
            FmapSolver::Bidirectional { weight } => ("bidirectional", weight),
            FmapSolver::Joint { weight } => ("joint", weight),
            FmapSolver::Part { weight } => ("part", weight),
        };
        let pairs = [
            ("format_version", self.format_version.to_string()),
            ("shot_radius", self.shot.radius.to_string()),
            ("shot_bins", self.shot.bins.to_string()),
            ("shot_min_neighbors", self.shot.min_neighbors.to_string()),
            ("k", self.k.to_string()),
            ("solver", solver.to_string()),
            ("mask_weight", mask_weight.to_string()),
            ("decimate", self.decimate.unwrap_or(0).to_string()),
            ("per_shape_statistics", self.per_shape_statistics.to_string()),
            ("training_set", self.training_set.clone()),
            ("seed", self.seed.to_string()),
            ("steps", self.steps.to_string()),
            ("commit", self.commit.clone()),
            ("license", self.license.clone()),
        ];
        let calibration = self.calibration.map(|calibration| ("calibration", calibration.to_json()));
        pairs.into_iter().chain(calibration).map(|(key, value)| (format!("{PREFIX}{key}"), value)).collect()
    }

    fn from_pairs(pairs: &Pairs) -> Result<Self, NetworkError> {
        let format_version = pairs.value("format_version")?;
        if format_version > FORMAT_VERSION {
            return Err(pairs.contract(format!(
                "the model has format {format_version}, this version reads up to {FORMAT_VERSION}; install a newer fmnet"
            )));
        }
        let solver = match pairs.text("solver")? {
            "least-squares" => FmapSolver::LeastSquares,
            "regularized" => FmapSolver::Regularized { weight: pairs.value("mask_weight")? },
            "bidirectional" | "two-way" => FmapSolver::Bidirectional { weight: pairs.value("mask_weight")? },
            "joint" => FmapSolver::Joint { weight: pairs.value("mask_weight")? },
            "part" => FmapSolver::Part { weight: pairs.value("mask_weight")? },
            other => {
                return Err(pairs.contract(format!(
                    "{PREFIX}solver is {other:?}, but must be least-squares, regularized, \
                     bidirectional, joint or part; export the model anew"
                )));
            }
        };
        let metadata = Self {
            format_version,
            shot: ShotOptions {
                radius: pairs.value("shot_radius")?,
                bins: pairs.value("shot_bins")?,
                min_neighbors: pairs.value("shot_min_neighbors")?,
            },
            k: pairs.value("k")?,
            solver,
            decimate: Some(pairs.value("decimate")?).filter(|&n: &usize| n > 0),
            per_shape_statistics: pairs.value("per_shape_statistics")?,
            training_set: pairs.text("training_set")?.to_string(),
            seed: pairs.value("seed")?,
            steps: pairs.value("steps")?,
            commit: pairs.text("commit")?.to_string(),
            license: pairs.text("license")?.to_string(),
            calibration: pairs.calibration()?,
        };
        metadata.check().map_err(|reason| pairs.contract(reason))?;
        Ok(metadata)
    }

    /// Whether every setting is in the range that the pipeline takes.
    fn check(&self) -> Result<(), String> {
        let wrong = |key: &str, value: &dyn std::fmt::Display, range: &str| {
            Err(format!("{PREFIX}{key} is {value}, but must be {range}; export the model anew"))
        };
        if !(1..=MAX_K).contains(&self.k) {
            return wrong("k", &self.k, "1 to 500");
        }
        if !(self.shot.radius > 0.0 && self.shot.radius < 1.0) {
            return wrong("shot_radius", &self.shot.radius, "between 0 and 1");
        }
        if self.shot.bins.checked_add(1).and_then(|bins| bins.checked_mul(32)) != Some(SHOT_WIDTH) {
            return wrong("shot_bins", &self.shot.bins, "10");
        }
        if let FmapSolver::Regularized { weight }
        | FmapSolver::Bidirectional { weight }
        | FmapSolver::Joint { weight }
        | FmapSolver::Part { weight } = self.solver
            && !(weight.is_finite() && weight >= 0.0)
        {
            return wrong("mask_weight", &weight, "0 or more");
        }
        if self.decimate.is_some_and(|n| n < MIN_DECIMATE) {
            return wrong("decimate", &self.decimate.unwrap_or(0), "0 (never), or 100 or more");
        }
        Ok(())
    }
}

struct Pairs<'a> {
    path: &'a Path,
    values: BTreeMap<String, String>,
}

impl Pairs<'_> {
    fn contract(&self, reason: String) -> NetworkError {
        NetworkError::Contract { path: self.path.to_path_buf(), reason }
    }

    fn text(&self, key: &str) -> Result<&str, NetworkError> {
        let key = format!("{PREFIX}{key}");
        self.values
            .get(&key)
            .map(String::as_str)
            .ok_or_else(|| self.contract(format!("no {key} in the metadata; {EXPORT}")))
    }

    fn calibration(&self) -> Result<Option<Calibration>, NetworkError> {
        let key = format!("{PREFIX}calibration");
        let Some(text) = self.values.get(&key) else { return Ok(None) };
        let read = Calibration::from_json(text);
        read.map(Some).map_err(|reason| self.contract(format!("{key} {reason}; export the model anew")))
    }

    fn value<T: FromStr>(&self, key: &str) -> Result<T, NetworkError> {
        let text = self.text(key)?;
        text.parse().map_err(|_| {
            self.contract(format!("{PREFIX}{key} is {text:?}, which does not parse; export the model anew"))
        })
    }
}

/// Checks a model file against the contract and reads what it takes, gives and carries. `path` is for messages.
///
/// # Errors
/// If it is no ONNX file, its graph has other inputs or another output, or a key is missing or out of range.
pub fn read_contract(path: &Path, bytes: &[u8]) -> Result<Contract, NetworkError> {
    let contract = |reason: String| NetworkError::Contract { path: path.to_path_buf(), reason };
    let model = Model::decode(bytes).map_err(|e| contract(format!("not an ONNX file ({e}); {EXPORT}")))?;
    let graph = model.graph.ok_or_else(|| contract(format!("no graph in it; {EXPORT}")))?;
    if let Some(opset) = model.opset_import.iter().find(|o| !o.domain.is_empty() && o.domain != "ai.onnx") {
        return Err(contract(format!(
            "operators of the domain {:?}, but only standard ones are allowed; {EXPORT}",
            opset.domain
        )));
    }
    let values = model.metadata_props.into_iter().map(|entry| (entry.key, entry.value)).collect();
    let metadata = ModelMetadata::from_pairs(&Pairs { path, values })?;
    let inputs = inputs(&graph.input).map_err(|reason| contract(format!("input: {reason}; {EXPORT}")))?;
    if metadata.format_version == 1 && inputs != [ModelInput { quantity: Quantity::Shot, width: SHOT_WIDTH }]
    {
        return Err(contract(format!("a model of format 1 has the input \"shot\" alone; {EXPORT}")));
    }
    let outputs = output(&graph.output).map_err(|reason| contract(format!("output: {reason}; {EXPORT}")))?;
    if !graph.node.iter().any(|node| node.output.iter().any(|name| name == OUTPUT)) {
        return Err(contract(format!(
            "no operator gives {OUTPUT:?}; the file is damaged, export the model anew"
        )));
    }
    Ok(Contract { inputs, outputs, metadata })
}

fn inputs(values: &[ValueInfo]) -> Result<Vec<ModelInput>, String> {
    let known = || Quantity::ALL.map(Quantity::name).join(", ");
    let mut inputs: Vec<ModelInput> = Vec::new();
    for value in values {
        let Some(quantity) = Quantity::ALL.into_iter().find(|quantity| quantity.name() == value.name) else {
            return Err(format!(
                "{:?} is not a quantity that this version computes ({})",
                value.name,
                known()
            ));
        };
        if inputs.iter().any(|input| input.quantity == quantity) {
            return Err(format!("{:?} is there twice", value.name));
        }
        let width = float_dims(value).and_then(|dims| quantity.width(&dims));
        let width = width.map_err(|reason| format!("{:?}: {reason}", value.name))?;
        inputs.push(ModelInput { quantity, width });
    }
    match inputs.iter().any(|input| input.quantity != Quantity::Eigenvalues) {
        true => Ok(inputs),
        false => Err(format!("expected one at least that has a row for each vertex, of {}", known())),
    }
}

fn output(values: &[ValueInfo]) -> Result<usize, String> {
    let [value] = values else { return Err(format!("expected one, {OUTPUT:?}, found {}", values.len())) };
    if value.name != OUTPUT {
        return Err(format!("expected {OUTPUT:?}, found {:?}", value.name));
    }
    let dims = float_dims(value)?;
    match dims.as_slice() {
        [None | Some(0), Some(width)] if (1..=MAX_OUTPUTS as i64).contains(width) => Ok(*width as usize),
        _ => Err(format!(
            "expected the shape [n, d] with n dynamic and d from 1 to {MAX_OUTPUTS}, found {dims:?}"
        )),
    }
}

/// The dimensions of a float32 tensor, `None` where they are dynamic.
fn float_dims(value: &ValueInfo) -> Result<Vec<Option<i64>>, String> {
    let Some(Type { tensor: Some(tensor) }) = &value.kind else { return Err("not a tensor".into()) };
    if tensor.elem_type != ONNX_FLOAT {
        return Err(format!("expected float32 (element type 1), found element type {}", tensor.elem_type));
    }
    Ok(tensor.shape.iter().flat_map(|s| s.dim.iter().map(|d| d.value)).collect())
}

#[cfg(test)]
impl ModelMetadata {
    /// For tests.
    pub(super) fn example() -> Self {
        Self {
            format_version: 1,
            shot: ShotOptions::default(),
            k: 20,
            solver: FmapSolver::LeastSquares,
            decimate: None,
            per_shape_statistics: false,
            calibration: None,
            training_set: String::new(),
            seed: 0,
            steps: 0,
            commit: String::new(),
            license: String::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::proto::{Dimension, Graph, Model, Node, Shape, StringEntry, TensorType};

    /// A model whose only operator gives a value of this name.
    fn model_giving(name: &str) -> Vec<u8> {
        let dim = [None, Some(SHOT_WIDTH as i64)].map(|value| Dimension { value }).to_vec();
        let kind = Type { tensor: Some(TensorType { elem_type: ONNX_FLOAT, shape: Some(Shape { dim }) }) };
        let value = |name: &str| ValueInfo { name: name.into(), kind: Some(kind.clone()) };
        let metadata = ModelMetadata::example();
        let pairs = metadata.to_pairs().into_iter();
        let model = Model {
            producer_name: String::new(),
            graph: Some(Graph {
                node: vec![Node { output: vec![name.into()], op_type: "Identity".into() }],
                initializer: Vec::new(),
                input: vec![value("shot")],
                output: vec![value(OUTPUT)],
            }),
            opset_import: Vec::new(),
            metadata_props: pairs.map(|(key, value)| StringEntry { key, value }).collect(),
        };
        model.encode_to_vec()
    }

    #[test]
    fn the_output_must_be_computed() {
        let path = Path::new("m.onnx");
        assert!(read_contract(path, &model_giving(OUTPUT)).is_ok());
        let error = read_contract(path, &model_giving("descriptorz")).unwrap_err().to_string();
        assert!(error.contains("no operator gives \"descriptors\""), "{error}");
    }

    #[test]
    fn what_breaks_the_contract_is_named_with_the_remedy() {
        let good = Model::decode(model_giving(OUTPUT).as_slice()).unwrap();
        let broken = |change: &dyn Fn(&mut Model)| {
            let mut model = good.clone();
            change(&mut model);
            read_contract(Path::new("m.onnx"), &model.encode_to_vec()).unwrap_err().to_string()
        };
        let set = |model: &mut Model, key: &str, value: &str| {
            let entry = model.metadata_props.iter_mut().find(|entry| entry.key == key).unwrap();
            entry.value = value.into();
        };
        let errors = [
            (read_contract(Path::new("m.onnx"), b"text").unwrap_err().to_string(), "not an ONNX file"),
            (broken(&|m| m.graph = None), "no graph"),
            (broken(&|m| m.graph.as_mut().unwrap().input.clear()), "input: expected one"),
            (
                broken(&|m| m.graph.as_mut().unwrap().input[0].name = "colour".into()),
                "\"colour\" is not a quantity",
            ),
            (
                broken(&|m| m.graph.as_mut().unwrap().input[0].name = "mass".into()),
                "\"mass\": expected the shape [n]",
            ),
            (broken(&|m| m.graph.as_mut().unwrap().input[0].name = "eigenvectors".into()), "format 1"),
            (broken(&|m| m.graph.as_mut().unwrap().output[0].kind = None), "output: not a tensor"),
            (broken(&|m| set(m, "fmnet.solver", "magic")), "fmnet.solver is \"magic\""),
            (broken(&|m| set(m, "fmnet.k", "many")), "fmnet.k is \"many\""),
        ];
        for (error, what) in errors {
            assert!(error.contains(what) && error.contains("; export the model"), "{error}");
        }
        let newer = broken(&|m| set(m, "fmnet.format_version", "9"));
        assert!(newer.contains("format 9") && newer.ends_with("install a newer fmnet"), "{newer}");
    }
}
