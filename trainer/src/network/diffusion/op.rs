//! The whole network on one shape as one Candle op on the CPU.

use crate::device::{contiguous, with_slice};
use crate::numeric::Real;
use candle_core::{CpuStorage, CustomOp1, Layout, Result, Shape, Tensor, bail};
use fmnet::diffusion_net::{Activations, Architecture, Operators, backward, forward};
use std::sync::{Mutex, PoisonError};

/// Maps the flat parameters `[p]` to the descriptors `[n, outputs]` of a shape.
pub(super) struct DiffusionOp<T> {
    architecture: Architecture,
    /// `[n, inputs]`.
    input: Vec<T>,
    operators: Operators<T>,
    train: bool,
    /// Filled by the forward pass, taken by the backward pass.
    activations: Mutex<Option<Activations<T>>>,
}

impl<T: Real> DiffusionOp<T> {
    pub(super) fn new(
        architecture: Architecture,
        input: Vec<T>,
        operators: Operators<T>,
        train: bool,
    ) -> Self {
        Self { architecture, input, operators, train, activations: Mutex::new(None) }
    }

    fn saved(&self) -> std::sync::MutexGuard<'_, Option<Activations<T>>> {
        self.activations.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T: Real> CustomOp1 for DiffusionOp<T> {
    fn name(&self) -> &'static str {
        "diffusion-net"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let parameters: &[T] = contiguous(storage, layout)?;
        let (out, activations) =
            forward(&self.architecture, parameters, &self.input, &self.operators, self.train)
                .map_err(candle_core::Error::msg)?;
        *self.saved() = activations;
        Ok((T::to_cpu_storage_owned(out), Shape::from((self.operators.n(), self.architecture.outputs))))
    }

    fn bwd(&self, parameters: &Tensor, _out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let Some(activations) = self.saved().take() else {
            bail!("the backward pass runs once, after a forward pass that trains");
        };
        let gradient = with_slice(parameters, |parameters: &[T]| {
            with_slice(&grad.contiguous()?, |grad: &[T]| {
                let Self { architecture, input, operators, .. } = self;
                backward(architecture, parameters, input, operators, &activations, grad)
                    .map_err(candle_core::Error::msg)
            })
        })?;
        Ok(Some(Tensor::from_vec(gradient, parameters.shape(), parameters.device())?))
    }
}
