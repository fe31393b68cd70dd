//! The back-end on onnxruntime, whose library is loaded at run time.

use super::Engine;
use super::contract::{Contract, ModelInput, OUTPUT};
use ort::environment::Environment;
use ort::session::Session;
use ort::value::TensorRef;
use std::sync::{Mutex, OnceLock};

/// Environment variable with the path of the onnxruntime library.
const LIBRARY_VARIABLE: &str = "ORT_DYLIB_PATH";

pub(super) struct OrtEngine {
    inputs: Vec<ModelInput>,
    session: Mutex<Session>,
}

impl OrtEngine {
    pub(super) fn load(bytes: &[u8], contract: &Contract) -> Result<Self, String> {
        let threads = rayon::current_num_threads();
        let session = Session::builder(environment()?)
            .map_err(|e| e.to_string())?
            .with_intra_threads(threads)
            .map_err(|e| e.to_string())?
            .commit_from_memory(bytes)
            .map_err(|e| e.to_string())?;
        Ok(Self { inputs: contract.inputs.clone(), session: Mutex::new(session) })
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
    fn run(&self, n: usize, inputs: &[&[f32]]) -> Result<Vec<f32>, String> {
        let mut session = self.session.lock().map_err(|e| e.to_string())?;
        let mut named = Vec::with_capacity(inputs.len());
        for (input, values) in self.inputs.iter().zip(inputs) {
            let tensor = TensorRef::from_array_view((input.dims(n), *values)).map_err(|e| e.to_string())?;
            named.push((input.quantity.name(), tensor));
        }
        let outputs = session.run(named).map_err(|e| e.to_string())?;
        let (_, values) = outputs[OUTPUT].try_extract_tensor::<f32>().map_err(|e| e.to_string())?;
        Ok(values.to_vec())
    }
}
