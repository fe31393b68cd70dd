//! The functional map layer as a Candle op.

use super::gradient::Solution;
use super::{FmLayerError, FmSolver};
use crate::device::contiguous;
use candle_core::backend::{BackendDevice, BackendStorage};
use candle_core::{
    CpuStorage, CudaStorage, CustomOp2, DType, Device, Error, Layout, Result, Shape, Tensor, bail,
};
use faer::{Mat, MatRef};
use fmnet::Matrix;
use std::sync::{Arc, Mutex, PoisonError};

/// A functional map and how well it was determined.
pub struct FunctionalMap {
    /// `C` `[k_target, k_source]`, differentiable, of the type of the descriptors.
    pub map: Tensor,
    /// Condition number of `F F^T` (the square of that of `F`), without mask or ridge; infinite where it is singular.
    pub condition: f64,
}

/// Solves for the functional map of the spectral descriptors `source` `[k_source, q]` and `target` `[k_target, q]`, both f32
/// or both f64. `mask` is [`fmnet::fmap::resolvent_mask`], `[k_target, k_source]`; the least squares ignore
/// it. On a GPU the small systems are copied to the host and solved there.
///
/// # Errors
/// If the tensors do not fit together, or the descriptors are not finite or those of the source all zero ([`FmLayerError`]).
pub fn functional_map(
    source: &Tensor,
    target: &Tensor,
    solver: &FmSolver,
    mask: &Matrix,
) -> Result<FunctionalMap> {
    let ((k_source, q), (k_target, q_target)) = (source.dims2()?, target.dims2()?);
    if q != q_target || k_source == 0 || k_target == 0 {
        bail!("spectral descriptors [{k_source}, {q}] of the source, [{k_target}, {q_target}] of the target");
    }
    let regularized = matches!(solver, FmSolver::Regularized { .. });
    if regularized && (mask.rows(), mask.cols()) != (k_target, k_source) {
        bail!("a mask [{}, {}] for a functional map [{k_target}, {k_source}]", mask.rows(), mask.cols());
    }
    let solution = Arc::new(Mutex::new(None));
    let op = FunctionalMapOp {
        solver: solver.clone(),
        mask: if regularized { mask.data().to_vec() } else { Vec::new() },
        solution: solution.clone(),
    };
    let map = source.contiguous()?.apply_op2(&target.contiguous()?, op)?;
    let solution = solution.lock().unwrap_or_else(PoisonError::into_inner);
    let condition = solution.as_ref().map_or(f64::NAN, |solution: &Solution| solution.condition);
    Ok(FunctionalMap { map, condition })
}

struct FunctionalMapOp {
    solver: FmSolver,
    mask: Vec<f64>,
    solution: Arc<Mutex<Option<Solution>>>,
}

/// A contiguous CPU tensor `[rows, cols]` as a matrix in double precision.
fn to_matrix(storage: &CpuStorage, layout: &Layout) -> Result<Mat<f64>> {
    let (rows, cols) = layout.shape().dims2()?;
    Ok(match storage {
        CpuStorage::F32(_) => {
            let data: &[f32] = contiguous(storage, layout)?;
            Mat::from_fn(rows, cols, |i, j| f64::from(data[i * cols + j]))
        }
        _ => {
            let data: &[f64] = contiguous(storage, layout)?;
            Mat::from_fn(rows, cols, |i, j| data[i * cols + j])
        }
    })
}

/// The entries of a matrix, row after row.
fn row_major(matrix: MatRef<'_, f64>) -> Vec<f64> {
    (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| matrix[(i, j)])).collect()
}

fn to_tensor(matrix: &Mat<f64>, like: &Tensor) -> Result<Tensor> {
    let host = Tensor::from_vec(row_major(matrix.as_ref()), matrix.shape(), &Device::Cpu)?;
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
        let finite = |m: &Mat<f64>| (0..m.ncols()).all(|j| m.col(j).iter().all(|value| value.is_finite()));
        if !finite(&f) || !finite(&g) {
            return Err(Error::wrap(FmLayerError::NotFinite));
        }
        let solution = Solution::new(f, g, &self.solver, &self.mask).map_err(Error::wrap)?;
        let (shape, map) = (Shape::from(solution.map.shape()), row_major(solution.map.as_ref()));
        *self.solution.lock().unwrap_or_else(PoisonError::into_inner) = Some(solution);
        let storage = match source {
            CpuStorage::F32(_) => CpuStorage::F32(map.iter().map(|&value| value as f32).collect()),
            _ => CpuStorage::F64(map),
        };
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
        let (grad_source, grad_target) = solution.backward(MatRef::from_row_major_slice(&grad, rows, cols));
        Ok((Some(to_tensor(&grad_source, source)?), Some(to_tensor(&grad_target, target)?)))
    }
}
