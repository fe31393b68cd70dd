//! The whole network as one Candle op on the CPU, with a hand-written backward pass.

use super::block::{BlockActivations, BlockContext, BlockParameters};
use super::norm::{Moments, RowPlan};
use super::pool::BufferPool;
use super::{Activation, BatchMoments};
use crate::device::contiguous;
use crate::numeric::Real;
use candle_core::{CpuStorage, CustomOp1, Layout, Result, Shape, Tensor, bail};
use std::sync::{Arc, Mutex, PoisonError};

/// Where the statistics of a forward pass come from.
pub(super) enum StatisticsOf {
    /// From the rows of each group.
    Groups(Vec<usize>),
    /// Fixed: for `rows` rows, of each block its two normalisations.
    Fixed {
        /// Number of rows.
        rows: usize,
        /// Two normalisations a block.
        blocks: Vec<[BatchMoments; 2]>,
    },
}

/// Maps the flat parameters `[p]` to descriptors `[n, width]`, for constant inputs `[n, width]`.
pub(super) struct FusedNetwork<T: Real> {
    /// The input descriptors, `[n, width]` row-major.
    pub(super) input: Vec<T>,
    /// Number of channels.
    pub(super) width: usize,
    /// Number of residual blocks.
    pub(super) blocks: usize,
    /// Added to variances.
    pub(super) epsilon: f64,
    /// Between the layers.
    pub(super) activation: Activation,
    /// Where the statistics come from.
    pub(super) statistics: StatisticsOf,
    /// Whether to keep all activations for a backward pass.
    pub(super) train: bool,
    /// Where buffers come from.
    pub(super) pool: Arc<BufferPool<T>>,
    /// Filled by the forward pass, emptied by the backward pass.
    pub(super) saved: SavedActivations<T>,
}

/// The activations of the last forward pass, shared between the op and its caller.
pub(super) type SavedActivations<T> = Arc<Mutex<Vec<BlockActivations<T>>>>;

/// The moments of every normalisation over all rows, from what the forward pass saved.
pub(super) fn batch_moments<T>(saved: &SavedActivations<T>) -> Vec<[BatchMoments; 2]> {
    let whole = |groups: &[Moments]| BatchMoments {
        mean: groups[0].mean.clone(),
        variance: groups[0].variance.clone(),
    };
    let blocks = saved.lock().unwrap_or_else(PoisonError::into_inner);
    blocks.iter().map(|block| [whole(&block.moments[0]), whole(&block.moments[1])]).collect()
}

impl<T: Real> FusedNetwork<T> {
    fn plan(&self) -> RowPlan {
        match &self.statistics {
            StatisticsOf::Groups(groups) => RowPlan::new(groups.clone()),
            StatisticsOf::Fixed { rows, .. } => RowPlan::new(vec![*rows]),
        }
    }

    fn context<'a>(&'a self, plan: &'a RowPlan) -> BlockContext<'a, T> {
        BlockContext {
            plan,
            width: self.width,
            epsilon: self.epsilon,
            activation: self.activation,
            pool: &self.pool,
        }
    }

    fn block<'a, V>(&self, flat: &'a [V], block: usize) -> &'a [V] {
        let len = BlockParameters::<V>::len(self.width);
        &flat[block * len..(block + 1) * len]
    }

    fn forward(&self, flat: &[T]) -> Result<Vec<T>> {
        if flat.len() != self.blocks * BlockParameters::<T>::len(self.width) {
            bail!("{} parameters for {} residual blocks of width {}", flat.len(), self.blocks, self.width);
        }
        let plan = self.plan();
        let context = self.context(&plan);
        let mut saved: Vec<BlockActivations<T>> = Vec::with_capacity(self.blocks);
        for block in 0..self.blocks {
            let fixed = match &self.statistics {
                StatisticsOf::Groups(_) => None,
                StatisticsOf::Fixed { blocks, .. } => {
                    Some(blocks[block].each_ref().map(BatchMoments::to_moments))
                }
            };
            let input = saved.last().map_or(&self.input, |previous| &previous.out);
            let parameters = BlockParameters::new(self.block(flat, block), self.width);
            let activations = context.forward(parameters, input, fixed.as_ref());
            if !self.train {
                saved.drain(..).for_each(|block| block.recycle(&self.pool));
            }
            saved.push(activations);
        }
        let out = saved.last().map_or_else(|| self.input.clone(), |last| last.out.clone());
        let previous =
            std::mem::replace(&mut *self.saved.lock().unwrap_or_else(PoisonError::into_inner), saved);
        previous.into_iter().for_each(|block| block.recycle(&self.pool));
        Ok(out)
    }

    fn backward(&self, flat: &[T], grad: &[T]) -> Result<Vec<T>> {
        let mut saved = std::mem::take(&mut *self.saved.lock().unwrap_or_else(PoisonError::into_inner));
        if saved.len() != self.blocks || matches!(self.statistics, StatisticsOf::Fixed { .. }) {
            bail!("the network's backward pass runs once, after a forward pass in training mode");
        }
        let plan = self.plan();
        let context = self.context(&plan);
        let len = BlockParameters::<T>::len(self.width);
        let mut grad = grad.to_vec();
        let mut flat_grad = vec![T::zero(); flat.len()];
        for block in (0..self.blocks).rev() {
            let Some(activations) = saved.pop() else { break };
            let input = saved.last().map_or(&self.input, |previous| &previous.out);
            let parameters = BlockParameters::new(self.block(flat, block), self.width);
            let target = &mut flat_grad[block * len..(block + 1) * len];
            context.backward(parameters, &activations, input, &mut grad, target, block > 0);
            activations.recycle(&self.pool);
        }
        Ok(flat_grad)
    }
}

impl<T: Real> Drop for FusedNetwork<T> {
    fn drop(&mut self) {
        let saved = std::mem::take(&mut *self.saved.lock().unwrap_or_else(PoisonError::into_inner));
        saved.into_iter().for_each(|block| block.recycle(&self.pool));
    }
}

impl<T: Real> CustomOp1 for FusedNetwork<T> {
    fn name(&self) -> &'static str {
        "residual-network"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let out = self.forward(contiguous(storage, layout)?)?;
        let shape = Shape::from((out.len() / self.width, self.width));
        Ok((T::to_cpu_storage_owned(out), shape))
    }

    fn bwd(&self, parameters: &Tensor, _out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let grad = grad.contiguous()?;
        let gradient = crate::device::with_slice(parameters, |flat| {
            crate::device::with_slice(&grad, |grad| self.backward(flat, grad))
        })?;
        Ok(Some(Tensor::from_vec(gradient, parameters.shape(), parameters.device())?))
    }
}
