//! The descriptor network: the model file's contract, and its back-ends.
//!
//! A model is an ONNX file ([`contract`]). It runs through tract, which is built in (feature `tract`), or through onnxruntime
//! (feature `ort`), whose library is loaded at run time from the path in the environment variable `ORT_DYLIB_PATH`.

pub mod contract;
#[cfg(feature = "ort")]
mod ort;
mod proto;
#[cfg(feature = "tract")]
mod tract;

use crate::Matrix;
use contract::{ModelMetadata, WIDTH};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What computes the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// tract, pure Rust, built in.
    #[default]
    Tract,
    /// onnxruntime, its library, named by ORT_DYLIB_PATH, loaded at run time; needs the feature `ort`.
    Ort,
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
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
    /// The input has another width.
    #[error("the network takes descriptors of width {WIDTH}, not {width}; compute SHOT with 10 bins")]
    Width {
        /// Width of the input.
        width: usize,
    },
}

/// A loaded model.
pub struct DescriptorNetwork {
    path: PathBuf,
    metadata: ModelMetadata,
    fingerprint: [u8; 32],
    backend: Backend,
    engine: Box<dyn Engine>,
}

/// What a back-end does. Results may differ between back-ends by rounding only.
trait Engine: Send + Sync {
    /// `[n, 352]` to `[n, 352]`.
    fn run(&self, shot: &Matrix<f32>) -> Result<Matrix<f32>, String>;
}

impl fmt::Debug for DescriptorNetwork {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("DescriptorNetwork")
            .field("path", &self.path)
            .field("metadata", &self.metadata)
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
        let metadata = contract::read_contract(path, bytes)?;
        let engine = load_engine(bytes, &metadata, backend).map_err(|failure| match failure {
            Failure::Absent => NetworkError::BackendAbsent { backend },
            Failure::Refused(reason) => NetworkError::Backend { path: path.to_path_buf(), backend, reason },
        })?;
        let fingerprint = *blake3::hash(bytes).as_bytes();
        Ok(Self { path: path.to_path_buf(), metadata, fingerprint, backend, engine })
    }

    /// What travels with the model.
    pub fn metadata(&self) -> &ModelMetadata {
        &self.metadata
    }

    /// A hash of the model file, for cache keys.
    pub fn fingerprint(&self) -> &[u8; 32] {
        &self.fingerprint
    }

    /// The back-end it runs on.
    pub fn backend(&self) -> Backend {
        self.backend
    }

    /// Learned descriptors `[n, 352]` of SHOT descriptors `[n, 352]`.
    ///
    /// # Errors
    /// If the input has another width, or the back-end fails.
    pub fn descriptors(&self, shot: &Matrix<f32>) -> Result<Matrix<f32>, NetworkError> {
        if shot.cols() != WIDTH {
            return Err(NetworkError::Width { width: shot.cols() });
        }
        let failed =
            |reason| NetworkError::Backend { path: self.path.clone(), backend: self.backend, reason };
        self.engine.run(shot).map_err(failed)
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
fn load_engine(bytes: &[u8], metadata: &ModelMetadata, backend: Backend) -> Result<Box<dyn Engine>, Failure> {
    match backend {
        #[cfg(feature = "tract")]
        Backend::Tract => Ok(Box::new(tract::TractEngine::load(bytes, metadata).map_err(Failure::Refused)?)),
        #[cfg(feature = "ort")]
        Backend::Ort => Ok(Box::new(ort::OrtEngine::load(bytes).map_err(Failure::Refused)?)),
        #[allow(unreachable_patterns)]
        _ => Err(Failure::Absent),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Failing;

    impl Engine for Failing {
        fn run(&self, _: &Matrix<f32>) -> Result<Matrix<f32>, String> {
            Err("no".into())
        }
    }

    #[test]
    fn a_failure_names_the_model_file() {
        let network = DescriptorNetwork {
            path: "m.onnx".into(),
            metadata: ModelMetadata::example(),
            fingerprint: [0; 32],
            backend: Backend::Tract,
            engine: Box::new(Failing),
        };
        let error = |width| network.descriptors(&Matrix::zeros(1, width)).unwrap_err().to_string();
        assert_eq!(error(WIDTH), "m.onnx: tract: no");
        assert!(error(320).ends_with("not 320; compute SHOT with 10 bins"), "{}", error(320));
    }
}
