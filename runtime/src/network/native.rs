//! DiffusionNets of `fmnet-train` on the library's own kernels, with the weights of the ONNX file.
//!
//! The exporter names every constant after the parameter that it holds. A file that it wrote, and in which all of
//! them are there in the right shape, is taken apart again; any other is left to the other back-ends. Tests hold the
//! results of all to each other.

use super::Engine;
use super::contract::{Contract, Quantity};
use super::proto::{Model, Tensor};
use crate::Matrix;
use crate::diffusion_net::{Architecture, Operators, forward};
use crate::spectral::{WksOptions, wks_of};
use prost::Message;
use std::collections::BTreeMap;

/// What writes the files.
const PRODUCER: &str = "fmnet-train";
/// `TensorProto.DataType.FLOAT` and `INT64`.
const FLOAT: i32 = 1;
const INT64: i32 = 7;

/// A DiffusionNet with its weights.
#[derive(Clone, Debug, PartialEq)]
pub struct NativeNetwork {
    architecture: Architecture,
    /// Flat, in the order of [`Architecture::parameters`]; the scale of SHOT is in the weights.
    parameters: Vec<f32>,
    /// The quantities that it takes, in the file's order, with their widths.
    inputs: Vec<(Quantity, usize)>,
    /// Energies of the wave kernel signature, 0 for none, and the eigenpairs that it is computed from.
    wks_energies: usize,
    wks_pairs: usize,
    /// Eigenpairs of the diffusion.
    k: usize,
}

/// A shape as the network takes it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NativeInput {
    /// Input functions, `[n, inputs]` row-major: the wave kernel signature, then SHOT.
    pub(crate) features: Vec<f32>,
    /// Operators at unit area.
    pub(crate) operators: Operators<f32>,
}

impl NativeNetwork {
    /// Takes a model file apart; `None` if it is not a DiffusionNet that the exporter wrote.
    pub(super) fn read(bytes: &[u8], contract: &Contract) -> Option<Self> {
        let model = Model::decode(bytes).ok().filter(|model| model.producer_name == PRODUCER)?;
        let graph = model.graph?;
        let constants: BTreeMap<&str, &Tensor> =
            graph.initializer.iter().map(|tensor| (tensor.name.as_str(), tensor)).collect();
        let constants = Constants(constants);
        let width_of = |quantity| contract.inputs.iter().find(|i| i.quantity == quantity).map(|i| i.width);
        let k = width_of(Quantity::GradientsX).filter(|&k| width_of(Quantity::GradientsY) == Some(k))?;
        let pairs = width_of(Quantity::Eigenvectors).filter(|&pairs| {
            pairs >= k && width_of(Quantity::Eigenvalues) == Some(pairs) && contract.takes(Quantity::Mass)
        })?;
        let wks = constants.weight("input.wks.weight");
        let shot = constants.weight("input.shot.weight");
        if shot.is_some() != contract.takes(Quantity::Shot) {
            return None;
        }
        let (wks_energies, of_wks) = wks.unwrap_or_default();
        let (shot_width, of_shot) = shot.unwrap_or_default();
        let wks_pairs = constants.integer("wks.eigenvectors.end").unwrap_or(pairs).min(pairs);
        let width = constants.floats("input.bias")?.len();
        let outputs = constants.floats("output.bias")?.len();
        let blocks =
            (0..).take_while(|block| constants.0.contains_key(&*format!("blocks.{block}.time"))).count();
        let architecture = Architecture { inputs: wks_energies + shot_width, blocks, width, outputs };
        let mut parameters = Vec::with_capacity(architecture.n_parameters());
        for parameter in architecture.parameters() {
            let values = match &*parameter.name {
                "input.weight" => [of_wks.as_slice(), &of_shot].concat(),
                name => constants.floats(&name_in_graph(name))?,
            };
            if values.len() != parameter.len() {
                return None;
            }
            parameters.extend(values);
        }
        let inputs = contract.inputs.iter().map(|input| (input.quantity, input.width)).collect();
        let fits = outputs == contract.outputs && blocks > 0 && architecture.inputs > 0;
        fits.then_some(Self { architecture, parameters, inputs, wks_energies, wks_pairs, k })
    }

    /// The sizes of the network.
    pub fn architecture(&self) -> &Architecture {
        &self.architecture
    }

    /// Its weights, flat, in the order of [`Architecture::parameters`].
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// Eigenpairs of its diffusion.
    pub fn eigenpairs(&self) -> usize {
        self.k
    }

    /// The wave kernel signature among its inputs; of 0 energies where it takes none.
    pub fn wks(&self) -> WksOptions {
        WksOptions { energies: self.wks_energies, k: self.wks_pairs }
    }

    /// Whether SHOT is among its inputs.
    pub fn takes_shot(&self) -> bool {
        self.inputs.iter().any(|(quantity, _)| *quantity == Quantity::Shot)
    }

    /// A shape of `n` vertices as the network takes it, from an array for each input of the model.
    ///
    /// # Panics
    /// If the arrays are not those of the model's inputs.
    pub(crate) fn input(&self, n: usize, arrays: &[&[f32]]) -> NativeInput {
        let of = |wanted: Quantity| {
            let found = self.inputs.iter().position(|(quantity, _)| *quantity == wanted);
            found.map(|i| (arrays[i], self.inputs[i].1))
        };
        let required = |quantity| of(quantity).expect("the network was read with this input");
        let (vectors, pairs) = required(Quantity::Eigenvectors);
        let first = |count: usize| -> Vec<f32> {
            let mut columns = Vec::with_capacity(n * count);
            (0..n).for_each(|i| columns.extend_from_slice(&vectors[i * pairs..i * pairs + count]));
            columns
        };
        let eigenvalues = required(Quantity::Eigenvalues).0;
        let operators = Operators {
            mass: required(Quantity::Mass).0.to_vec(),
            eigenvalues: eigenvalues[..self.k].to_vec(),
            eigenvectors: first(self.k),
            gradients_x: required(Quantity::GradientsX).0.to_vec(),
            gradients_y: required(Quantity::GradientsY).0.to_vec(),
        };
        let mut signature = Matrix::zeros(n, 0);
        if self.wks_energies > 0 {
            let values: Vec<f64> = eigenvalues[..self.wks_pairs].iter().map(|&x| f64::from(x)).collect();
            let vectors = Matrix::from_vec(n, self.wks_pairs, first(self.wks_pairs));
            signature = wks_of(&values, &vectors, self.wks_energies);
        }
        let shot = of(Quantity::Shot);
        let mut features = Vec::with_capacity(n * self.architecture.inputs);
        for i in 0..n {
            features.extend_from_slice(signature.row(i));
            if let Some((shot, width)) = shot {
                features.extend_from_slice(&shot[i * width..(i + 1) * width]);
            }
        }
        NativeInput { features, operators }
    }
}

impl Engine for NativeNetwork {
    fn run(&self, n: usize, inputs: &[&[f32]]) -> Result<Vec<f32>, String> {
        let NativeInput { features, operators } = self.input(n, inputs);
        Ok(forward(&self.architecture, &self.parameters, &features, &operators, false)?.0)
    }
}

/// The exporter's name of a parameter that it does not call by its own: products with `u` and `v` have the same
/// weights.
fn name_in_graph(name: &str) -> String {
    for part in ["real", "imaginary"] {
        if let Some(block) = name.strip_suffix(&format!(".gradient.{part}")) {
            return format!("{block}.{part}.u.weight");
        }
    }
    name.to_string()
}

/// The constants of a graph by name.
struct Constants<'a>(BTreeMap<&'a str, &'a Tensor>);

impl Constants<'_> {
    /// Rows and values of a matrix.
    fn weight(&self, name: &str) -> Option<(usize, Vec<f32>)> {
        let values = self.floats(name)?;
        let rows = usize::try_from(*self.0.get(name)?.dims.first()?).ok()?;
        (rows > 0 && values.len().is_multiple_of(rows)).then_some((rows, values))
    }

    fn floats(&self, name: &str) -> Option<Vec<f32>> {
        let tensor = self.0.get(name).filter(|tensor| tensor.data_type == FLOAT)?;
        let values: Vec<f32> = tensor
            .raw_data
            .chunks_exact(4)
            .map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            .collect();
        let expected = tensor.dims.iter().try_fold(1i64, |product, &dim| product.checked_mul(dim))?;
        (usize::try_from(expected) == Ok(values.len())).then_some(values)
    }

    fn integer(&self, name: &str) -> Option<usize> {
        let tensor = self.0.get(name).filter(|tensor| tensor.data_type == INT64)?;
        let bytes: [u8; 8] = tensor.raw_data.as_slice().try_into().ok()?;
        usize::try_from(i64::from_le_bytes(bytes)).ok()
    }
}
