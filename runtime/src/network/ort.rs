//! The back-end on onnxruntime, whose library is loaded at run time.

use super::Engine;
use super::contract::{INPUT, OUTPUT, WIDTH};
use crate::Matrix;
use ort::environment::Environment;
use ort::session::Session;
use ort::value::TensorRef;
use std::sync::{Mutex, OnceLock};

/// Environment variable with the path of the onnxruntime library.
const LIBRARY_VARIABLE: &str = "ORT_DYLIB_PATH";

pub(super) struct OrtEngine {
    session: Mutex<Session>,
}

impl OrtEngine {
    pub(super) fn load(bytes: &[u8]) -> Result<Self, String> {
        let threads = rayon::current_num_threads();
        let session = Session::builder(environment()?)
            .map_err(|e| e.to_string())?
            .with_intra_threads(threads)
            .map_err(|e| e.to_string())?
            .commit_from_memory(bytes)
            .map_err(|e| e.to_string())?;
        Ok(Self { session: Mutex::new(session) })
    }
}

/// One environment for the process: onnxruntime allows no second one.
fn environment() -> Result<&'static Environment, String> {
    static ENVIRONMENT: OnceLock<Result<Environment, String>> = OnceLock::new();
    ENVIRONMENT.get_or_init(load_library).as_ref().map_err(Clone::clone)
}

fn load_library() -> Result<Environment, String> {
    let path = std::env::var_os(LIBRARY_VARIABLE).ok_or_else(|| {
        format!(
            "set {LIBRARY_VARIABLE} to the path of the onnxruntime library, version 1.24 or newer (libonnxruntime.so, .dylib or \
             onnxruntime.dll; PyPI's package onnxruntime holds one in its folder capi), or use --backend tract"
        )
    })?;
    let failed = |reason: String| format!("{LIBRARY_VARIABLE}={}: {reason}", path.display());
    ort::init_from(&path).map_err(|e| failed(e.to_string()))?.build().map_err(|e| failed(e.to_string()))
}

impl Engine for OrtEngine {
    fn run(&self, shot: &Matrix<f32>) -> Result<Matrix<f32>, String> {
        let mut session = self.session.lock().map_err(|e| e.to_string())?;
        let input =
            TensorRef::from_array_view(([shot.rows(), WIDTH], shot.data())).map_err(|e| e.to_string())?;
        let outputs = session.run(ort::inputs![INPUT => input]).map_err(|e| e.to_string())?;
        let (shape, values) = outputs[OUTPUT].try_extract_tensor::<f32>().map_err(|e| e.to_string())?;
        if values.len() != shot.rows() * WIDTH {
            return Err(format!(
                "output of shape {shape:?} instead of {:?}; export the model anew",
                [shot.rows(), WIDTH]
            ));
        }
        Ok(Matrix::from_vec(shot.rows(), WIDTH, values.to_vec()))
    }
}
