//! The back-end on tract: pure Rust, built in.
//!
//! tract is fastest when it knows `n`, so the graph is optimised anew for each number of rows and kept while shapes
//! of the same size follow. Where rows do not depend on each other, blocks of a fixed size are spread over the
//! threads; other networks run on one thread each, as tract's own threads would make the program a fifth larger and
//! longer to build, and DiffusionNets of `fmnet-train` run on the library's own kernels.

use super::Engine;
use super::contract::{Contract, ModelInput};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use tract_onnx::prelude::*;

/// Rows in a block, for models whose rows do not depend on each other.
const BLOCK_ROWS: usize = 512;
/// Optimised graphs kept, one for each number of rows.
const KEPT_PLANS: usize = 8;

type Plan = Arc<TypedRunnableModel>;

pub(super) struct TractEngine {
    graph: InferenceModel,
    inputs: Vec<ModelInput>,
    rows_depend: bool,
    plans: Mutex<BTreeMap<usize, Plan>>,
}

impl TractEngine {
    pub(super) fn load(bytes: &[u8], contract: &Contract) -> Result<Self, String> {
        let graph =
            guarded(|| tract_onnx::onnx().model_for_read(&mut &*bytes).map_err(|e| format!("{e:#}")))?;
        let rows_depend = contract.metadata.per_shape_statistics || contract.inputs.len() > 1;
        Ok(Self { graph, inputs: contract.inputs.clone(), rows_depend, plans: Mutex::default() })
    }

    fn plan(&self, n: usize) -> Result<Plan, String> {
        let mut plans = self.plans.lock().map_err(|e| e.to_string())?;
        if let Some(plan) = plans.get(&n) {
            return Ok(plan.clone());
        }
        let mut graph = self.graph.clone();
        for (index, input) in self.inputs.iter().enumerate() {
            let fact = InferenceFact::dt_shape(f32::datum_type(), input.dims(n));
            graph.set_input_fact(index, fact).map_err(|e| format!("{e:#}"))?;
        }
        let plan = graph.into_optimized().and_then(|g| g.into_runnable()).map_err(|e| format!("{e:#}"))?;
        if plans.len() == KEPT_PLANS {
            plans.pop_first();
        }
        plans.insert(n, plan.clone());
        Ok(plan)
    }

    fn run_rows(&self, n: usize, inputs: &[&[f32]]) -> Result<Vec<f32>, String> {
        let tensor = |(input, values): (&ModelInput, &&[f32])| {
            Ok(Tensor::from_shape(&input.dims(n), values).map_err(|e| format!("{e:#}"))?.into())
        };
        let inputs: TVec<TValue> =
            self.inputs.iter().zip(inputs).map(tensor).collect::<Result<_, String>>()?;
        let output = self.plan(n)?.run(inputs).map_err(|e| format!("{e:#}"))?;
        let output = output.first().ok_or("no output")?;
        output
            .try_as_plain_ram()
            .and_then(|v| Ok(v.as_slice::<f32>()?.to_vec()))
            .map_err(|e| format!("{e:#}"))
    }
}

/// tract panics on some damaged graphs; that is an error like any other.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let refused = |panic: Box<dyn std::any::Any + Send>| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("of unknown kind");
        Err(format!("the graph is damaged ({text}); export the model anew"))
    };
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(refused)
}

impl Engine for TractEngine {
    fn run(&self, n: usize, inputs: &[&[f32]]) -> Result<Vec<f32>, String> {
        if self.rows_depend {
            return guarded(|| self.run_rows(n, inputs));
        }
        let width = self.inputs[0].width;
        let blocks: Vec<Vec<f32>> = inputs[0]
            .par_chunks(BLOCK_ROWS * width)
            .map(|rows| guarded(|| self.run_rows(rows.len() / width, &[rows])))
            .collect::<Result<_, _>>()?;
        Ok(blocks.concat())
    }
}

#[cfg(test)]
mod tests {
    use super::guarded;

    #[test]
    fn a_panic_is_an_error() {
        assert_eq!(guarded(|| Ok(3)), Ok(3));
        let index = std::hint::black_box(2);
        let error = guarded(|| Ok([1, 2][index])).unwrap_err();
        assert!(error.contains("out of bounds") && error.contains("export"), "{error}");
    }
}
