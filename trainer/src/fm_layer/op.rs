//! The functional map layer as a Candle op.

use super::FmLayerError;
use crate::device::contiguous;
use candle_core::backend::{BackendDevice, BackendStorage};
use candle_core::{
    CpuStorage, CudaStorage, CustomOp2, DType, Device, Error, Layout, Result, Shape, Tensor, bail,
};
use fmnet::Matrix;
use fmnet::fmap::{FmapSolution, FmapSolver, LeastSquaresOptions};
use std::sync::{Arc, Mutex, PoisonError};

/// A functional map and how well it was determined.
pub struct FunctionalMap {
    /// `C` `[k_target, k_source]`, differentiable, of the type of the descriptors.
    pub map: Tensor,
    /// Condition number of `F F^T` (the square of that of `F`), without the mask; infinite where it is singular.
    pub condition: f64,
}

/// Solves for the functional map of the spectral descriptors `source` `[k_source, q]` and `target` `[k_target, q]`,
/// both f32 or both f64. `mask` is [`fmnet::fmap::resolvent_mask`], `[k_target, k_source]`; the least squares ignore
/// it. Of the solvers those of one direction can be trained with, [`FmapSolver::LeastSquares`] and
/// [`FmapSolver::Regularized`]. On a GPU the small systems are copied to the host and solved there.
///
/// # Errors
/// If the tensors do not fit together, the solver is another one, or the descriptors are not finite or those of the
/// source all zero ([`FmLayerError`]).
pub fn functional_map(
    source: &Tensor,
    target: &Tensor,
    solver: FmapSolver,
    mask: &Matrix,
) -> Result<FunctionalMap> {
    let ((k_source, q), (k_target, q_target)) = (source.dims2()?, target.dims2()?);
    if q != q_target || k_source == 0 || k_target == 0 {
        bail!("spectral descriptors [{k_source}, {q}] of the source, [{k_target}, {q_target}] of the target");
    }
    if !matches!(solver, FmapSolver::LeastSquares | FmapSolver::Regularized { .. }) {
        bail!("{solver:?} cannot be trained with; take least squares or the regularised solve");
    }
    let regularized = matches!(solver, FmapSolver::Regularized { .. });
    if regularized && (mask.rows(), mask.cols()) != (k_target, k_source) {
        bail!("a mask [{}, {}] for a functional map [{k_target}, {k_source}]", mask.rows(), mask.cols());
    }
    let solution = Arc::new(Mutex::new(None));
    let op = FunctionalMapOp {
        solver,
        mask: if regularized { mask.clone() } else { Matrix::default() },
        solution: solution.clone(),
    };
    let map = source.contiguous()?.apply_op2(&target.contiguous()?, op)?;
    let solution = solution.lock().unwrap_or_else(PoisonError::into_inner);
    let condition = solution.as_ref().map(FmapSolution::gram_condition).transpose().map_err(Error::wrap)?;
    Ok(FunctionalMap { map, condition: condition.unwrap_or(f64::NAN) })
}

struct FunctionalMapOp {
    solver: FmapSolver,
    mask: Matrix,
    solution: Arc<Mutex<Option<FmapSolution>>>,
}

impl FunctionalMapOp {
    fn solve(&self, source: Matrix, target: Matrix) -> std::result::Result<FmapSolution, FmLayerError> {
        if source.data().iter().all(|&value| value == 0.0) {
            return Err(FmLayerError::Zero);
        }
        Ok(match self.solver {
            FmapSolver::Regularized { weight } => {
                FmapSolution::regularized(source, target, &self.mask, weight)?
            }
            _ => FmapSolution::least_squares(source, target, &LeastSquaresOptions::default())?,
        })
    }
}

/// A contiguous CPU tensor `[rows, cols]` as a matrix in double precision.
fn to_matrix(storage: &CpuStorage, layout: &Layout) -> Result<Matrix> {
    let (rows, cols) = layout.shape().dims2()?;
    Ok(match storage {
        CpuStorage::F32(_) => {
            let data: &[f32] = contiguous(storage, layout)?;
            Matrix::from_vec(rows, cols, data.iter().map(|&value| f64::from(value)).collect())
        }
        _ => {
            let data: &[f64] = contiguous(storage, layout)?;
            Matrix::from_vec(rows, cols, data.to_vec())
        }
    })
}

fn to_tensor(matrix: Matrix, like: &Tensor) -> Result<Tensor> {
    let shape = (matrix.rows(), matrix.cols());
    let host = Tensor::from_vec(matrix.into_data(), shape, &Device::Cpu)?;
    host.to_dtype(like.dtype())?.to_device(like.device())
}

impl CustomOp2 for FunctionalMapOp {
    fn name(&self) -> &'static str {
        "functional-map"
    }

    fn cpu_fwd(
        &self,
        source: &CpuStorage,
        source_layout: &Layout,
        target: &CpuStorage,
        target_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (f, g) = (to_matrix(source, source_layout)?, to_matrix(target, target_layout)?);
        let solution = self.solve(f, g).map_err(Error::wrap)?;
        let map = solution.map();
        let shape = Shape::from((map.rows(), map.cols()));
        let storage = match source {
            CpuStorage::F32(_) => CpuStorage::F32(map.data().iter().map(|&value| value as f32).collect()),
            _ => CpuStorage::F64(map.data().to_vec()),
        };
        *self.solution.lock().unwrap_or_else(PoisonError::into_inner) = Some(solution);
        Ok((storage, shape))
    }

    fn cuda_fwd(
        &self,
        source: &CudaStorage,
        source_layout: &Layout,
        target: &CudaStorage,
        target_layout: &Layout,
    ) -> Result<(CudaStorage, Shape)> {
        let (host_source, host_target) = (source.to_cpu_storage()?, target.to_cpu_storage()?);
        let (map, shape) = self.cpu_fwd(&host_source, source_layout, &host_target, target_layout)?;
        Ok((source.device().storage_from_cpu_storage_owned(map)?, shape))
    }

    fn bwd(
        &self,
        source: &Tensor,
        target: &Tensor,
        _map: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let (rows, cols) = grad.dims2()?;
        let grad: Vec<f64> = grad.to_device(&Device::Cpu)?.to_dtype(DType::F64)?.flatten_all()?.to_vec1()?;
        let solution = self.solution.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(solution) = solution.as_ref() else {
            bail!("the functional map's backward pass comes after its forward pass");
        };
        let (grad_source, grad_target) = solution.backward(&Matrix::from_vec(rows, cols, grad));
        Ok((Some(to_tensor(grad_source, source)?), Some(to_tensor(grad_target, target)?)))
    }
}
