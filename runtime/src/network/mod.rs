//! The descriptor network: the model file's contract, and its back-ends.
//!
//! A model is an ONNX file ([`contract`]). It runs through tract, which is built in (feature `tract`), or through
//! onnxruntime (feature `ort`), whose library is loaded at run time from the path in the environment variable
//! `ORT_DYLIB_PATH`. DiffusionNets that `fmnet-train` wrote run on the library's own kernels as well
//! ([`NativeNetwork`]), by which they are adapted to a pair.

pub mod contract;
mod native;
#[cfg(feature = "ort")]
mod ort;
mod proto;
#[cfg(feature = "tract")]
mod tract;

use crate::Matrix;
use contract::{Contract, ModelInput, ModelMetadata};
pub(crate) use native::NativeInput;
pub use native::NativeNetwork;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What computes the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Backend {
    /// The library's own kernels, which the adaptation to a pair runs on, for the DiffusionNets that `fmnet-train`
    /// writes, with the weights of the file, in two thirds of tract's time; tract for all other models.
    #[default]
    Native,
    /// tract, pure Rust, built in.
    Tract,
    /// onnxruntime, its library, named by ORT_DYLIB_PATH, loaded at run time; needs the feature `ort`.
    Ort,
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Native => "native",
            Self::Tract => "tract",
            Self::Ort => "ort",
        })
    }
}

/// Why a model cannot be loaded or run.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NetworkError {
    /// The file cannot be read.
    #[error("{path}: {reason}")]
    Read {
        /// The model file.
        path: PathBuf,
        /// The system's reason.
        reason: String,
    },
    /// The file is not a model of ours.
    #[error("{path}: {reason}")]
    Contract {
        /// The model file.
        path: PathBuf,
        /// What does not fit the contract, and the remedy.
        reason: String,
    },
    /// This build has no such back-end.
    #[error(
        "this build has no back-end {backend}; build with `--features {backend}`, or choose another with --backend"
    )]
    BackendAbsent {
        /// The back-end asked for.
        backend: Backend,
    },
    /// The back-end refuses the model or fails on it.
    #[error("{path}: {backend}: {reason}")]
    Backend {
        /// The model file.
        path: PathBuf,
        /// The back-end.
        backend: Backend,
        /// Its reason.
        reason: String,
    },
    /// There is not an array for each input.
    #[error(
        "the network has {expected} inputs, but {found} arrays were given; give one for each input of its contract"
    )]
    InputCount {
        /// Arrays given.
        found: usize,
        /// Inputs of the model.
        expected: usize,
    },
    /// An input has another size.
    #[error(
        "the network takes {quantity} of {expected} numbers for {n} vertices, not {found}; compute its inputs as its \
         metadata says"
    )]
    InputSize {
        /// The input.
        quantity: &'static str,
        /// Vertices.
        n: usize,
        /// Numbers that fit.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
}

/// A loaded model.
pub struct DescriptorNetwork {
    path: PathBuf,
    contract: Contract,
    fingerprint: [u8; 32],
    backend: Backend,
    engine: Box<dyn Engine>,
    native: Option<NativeNetwork>,
}

/// What a back-end does. Results may differ between back-ends by rounding only.
trait Engine: Send + Sync {
    /// The descriptors, `[n, d]` row-major, of `n` vertices, given an array for each input of the graph.
    fn run(&self, n: usize, inputs: &[&[f32]]) -> Result<Vec<f32>, String>;
}

impl ModelInput {
    /// The dimensions for `n` vertices.
    fn dims(&self, n: usize) -> Vec<usize> {
        self.quantity.dims(self.width).into_iter().map(|dim| dim.unwrap_or(n)).collect()
    }
}

impl fmt::Debug for DescriptorNetwork {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("DescriptorNetwork")
            .field("path", &self.path)
            .field("contract", &self.contract)
            .field("backend", &self.backend)
            .finish_non_exhaustive()
    }
}

impl DescriptorNetwork {
    /// Loads a model file.
    ///
    /// # Errors
    /// If the file cannot be read, and as [`DescriptorNetwork::from_bytes`].
    pub fn load(path: &Path, backend: Backend) -> Result<Self, NetworkError> {
        let bytes = std::fs::read(path)
            .map_err(|e| NetworkError::Read { path: path.to_path_buf(), reason: e.to_string() })?;
        Self::from_bytes(path, &bytes, backend)
    }

    /// Loads a model from memory; `path` is for messages.
    ///
    /// # Errors
    /// If the file breaks the contract, the back-end is not in this build, or refuses the model.
    pub fn from_bytes(path: &Path, bytes: &[u8], backend: Backend) -> Result<Self, NetworkError> {
        let contract = contract::read_contract(path, bytes)?;
        let native = NativeNetwork::read(bytes, &contract);
        let backend = match (backend, &native) {
            (Backend::Native, None) => Backend::Tract,
            (chosen, _) => chosen,
        };
        let engine =
            load_engine(bytes, &contract, native.as_ref(), backend).map_err(|failure| match failure {
                Failure::Absent => NetworkError::BackendAbsent { backend },
                Failure::Refused(reason) => {
                    NetworkError::Backend { path: path.to_path_buf(), backend, reason }
                }
            })?;
        let fingerprint = *blake3::hash(bytes).as_bytes();
        Ok(Self { path: path.to_path_buf(), contract, fingerprint, backend, engine, native })
    }

    /// The model file, or what stands for it in messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What travels with the model.
    pub fn metadata(&self) -> &ModelMetadata {
        &self.contract.metadata
    }

    /// What it takes and gives.
    pub fn contract(&self) -> &Contract {
        &self.contract
    }

    /// A hash of the model file, for cache keys.
    pub fn fingerprint(&self) -> &[u8; 32] {
        &self.fingerprint
    }

    /// The network in the library's own kernels, if it is a DiffusionNet that `fmnet-train` wrote.
    pub fn native(&self) -> Option<&NativeNetwork> {
        self.native.as_ref()
    }

    /// The back-end it runs on.
    pub fn backend(&self) -> Backend {
        self.backend
    }

    /// Learned descriptors `[n, d]` of a shape of `n` vertices. `inputs` has an array, row-major, for each of
    /// [`Contract::inputs`].
    ///
    /// # Errors
    /// If an input is missing or has another size, or the back-end fails.
    pub fn descriptors(&self, n: usize, inputs: &[&[f32]]) -> Result<Matrix<f32>, NetworkError> {
        let (found, expected) = (inputs.len(), self.contract.inputs.len());
        if found != expected {
            return Err(NetworkError::InputCount { found, expected });
        }
        for (input, array) in self.contract.inputs.iter().zip(inputs) {
            let expected = input.dims(n).iter().product();
            if array.len() != expected {
                let (quantity, found) = (input.quantity.name(), array.len());
                return Err(NetworkError::InputSize { quantity, n, expected, found });
            }
        }
        let failed =
            |reason| NetworkError::Backend { path: self.path.clone(), backend: self.backend, reason };
        let values = self.engine.run(n, inputs).map_err(failed)?;
        let outputs = self.contract.outputs;
        if values.len() != n * outputs {
            return Err(failed(format!(
                "an output of {} numbers instead of {n} x {outputs}; export the model anew",
                values.len()
            )));
        }
        Ok(Matrix::from_vec(n, outputs, values))
    }
}

/// Why there is no engine.
#[cfg_attr(all(feature = "tract", feature = "ort"), allow(dead_code))]
enum Failure {
    Absent,
    #[cfg_attr(not(any(feature = "tract", feature = "ort")), allow(dead_code))]
    Refused(String),
}

#[cfg_attr(not(any(feature = "tract", feature = "ort")), allow(unused_variables))]
fn load_engine(
    bytes: &[u8],
    contract: &Contract,
    native: Option<&NativeNetwork>,
    backend: Backend,
) -> Result<Box<dyn Engine>, Failure> {
    match backend {
        Backend::Native => {
            native.map(|native| Box::new(native.clone()) as Box<dyn Engine>).ok_or(Failure::Absent)
        }
        #[cfg(feature = "tract")]
        Backend::Tract => Ok(Box::new(tract::TractEngine::load(bytes, contract).map_err(Failure::Refused)?)),
        #[cfg(feature = "ort")]
        Backend::Ort => Ok(Box::new(ort::OrtEngine::load(bytes, contract).map_err(Failure::Refused)?)),
        #[allow(unreachable_patterns)]
        _ => Err(Failure::Absent),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contract::Quantity;

    struct Failing;

    impl Engine for Failing {
        fn run(&self, _: usize, _: &[&[f32]]) -> Result<Vec<f32>, String> {
            Err("no".into())
        }
    }

    #[test]
    fn a_failure_names_the_model_file_and_a_wrong_size_the_input() {
        let input = ModelInput { quantity: Quantity::Eigenvectors, width: 3 };
        let network = DescriptorNetwork {
            path: "m.onnx".into(),
            contract: Contract { inputs: vec![input], outputs: 2, metadata: ModelMetadata::example() },
            fingerprint: [0; 32],
            backend: Backend::Tract,
            engine: Box::new(Failing),
            native: None,
        };
        let error = |len| network.descriptors(4, &[&vec![0.0; len]]).unwrap_err().to_string();
        assert_eq!(error(12), "m.onnx: tract: no");
        assert!(error(11).starts_with("the network takes eigenvectors of 12 numbers for 4 vertices, not 11"));
    }
}
