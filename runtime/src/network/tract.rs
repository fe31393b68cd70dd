//! The back-end on tract: pure Rust, built in.
//!
//! tract is fastest when it knows `n`, so the graph is optimised anew for each number of rows and kept while shapes of the same
//! size follow. Its products and its element-wise operations are spread over the threads of the caller's pool; where rows do not
//! depend on each other they are split into blocks of a fixed size instead.

use super::Engine;
use super::contract::{ModelMetadata, WIDTH};
use crate::Matrix;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use tract_linalg::multithread::{Executor, multithread_tract_scope};
use tract_onnx::prelude::*;

/// Rows in a block, for models whose rows do not depend on each other.
const BLOCK_ROWS: usize = 512;
/// Optimised graphs kept, one for each number of rows.
const KEPT_PLANS: usize = 8;

type Plan = Arc<TypedRunnableModel>;

pub(super) struct TractEngine {
    graph: InferenceModel,
    rows_depend: bool,
    plans: Mutex<BTreeMap<usize, Plan>>,
}

impl TractEngine {
    pub(super) fn load(bytes: &[u8], metadata: &ModelMetadata) -> Result<Self, String> {
        let graph =
            guarded(|| tract_onnx::onnx().model_for_read(&mut &*bytes).map_err(|e| format!("{e:#}")))?;
        Ok(Self { graph, rows_depend: metadata.per_shape_statistics, plans: Mutex::default() })
    }

    fn plan(&self, rows: usize) -> Result<Plan, String> {
        let mut plans = self.plans.lock().map_err(|e| e.to_string())?;
        if let Some(plan) = plans.get(&rows) {
            return Ok(plan.clone());
        }
        let fact = InferenceFact::dt_shape(f32::datum_type(), tvec![rows, WIDTH]);
        let graph = self.graph.clone().with_input_fact(0, fact).and_then(|g| g.into_optimized());
        let plan = graph.and_then(|g| g.into_runnable()).map_err(|e| format!("{e:#}"))?;
        if plans.len() == KEPT_PLANS {
            plans.pop_first();
        }
        plans.insert(rows, plan.clone());
        Ok(plan)
    }

    fn run_rows(&self, rows: &[f32]) -> Result<Vec<f32>, String> {
        let n = rows.len() / WIDTH;
        let input = Tensor::from_shape(&[n, WIDTH], rows).map_err(|e| format!("{e:#}"))?;
        let output = self.plan(n)?.run(tvec!(input.into())).map_err(|e| format!("{e:#}"))?;
        let output = output.first().ok_or("no output")?;
        let values = output
            .try_as_plain_ram()
            .and_then(|v| Ok(v.as_slice::<f32>()?.to_vec()))
            .map_err(|e| format!("{e:#}"))?;
        if values.len() == rows.len() {
            Ok(values)
        } else {
            Err(format!(
                "output of shape {:?} instead of {:?}; export the model anew",
                output.shape(),
                [n, WIDTH]
            ))
        }
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
    fn run(&self, shot: &Matrix<f32>) -> Result<Matrix<f32>, String> {
        let values = if self.rows_depend {
            multithread_tract_scope(Executor::RayonGlobal, || guarded(|| self.run_rows(shot.data())))?
        } else {
            let blocks: Vec<Vec<f32>> = shot
                .data()
                .par_chunks(BLOCK_ROWS * WIDTH)
                .map(|rows| guarded(|| self.run_rows(rows)))
                .collect::<Result<_, _>>()?;
            blocks.concat()
        };
        Ok(Matrix::from_vec(shot.rows(), WIDTH, values))
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
