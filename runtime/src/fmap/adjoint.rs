//! The functional map of a point map.

use super::{FmapError, check_length};
use crate::Matrix;
use crate::point_map::PointMap;
use crate::spectral::Eigenbasis;
use faer::{Accum, Par};
use rayon::prelude::*;

/// Source vertices whose contributions are summed by one product; the sums are added in order.
const CHUNK: usize = 4096;

/// The functional map `C`, `[k_target, k_source]`, source to target, of a point map from the source to the
/// target.
///
/// A point map `T` from source to target pulls functions back, from target to source: `f o T`, in
/// coefficients `Phi^T A Psi[T]`, `[k_source, k_target]`, where row `x` of `Psi[T]` is row `T(x)` of `Psi`.
/// The map in the source's own direction is its adjoint,
///
/// `C = (Phi^T A Psi[T])^T = Psi[T]^T A Phi`,
///
/// which takes the delta function at `x` to that at `T(x)`: it minimises `sum_x A_x |C phi(x) - psi(T(x))|^2`
/// exactly, since `Phi^T A Phi = I`, where every vertex has a match. Vertices without one are left out of the sum.
///
/// # Errors
/// If the map has not `n_source` entries, or names a target vertex that does not exist.
pub fn functional_map_of(
    map: &PointMap,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
) -> Result<Matrix, FmapError> {
    let targets = &map.targets;
    check_length("the point map", targets.len(), basis_source.n())?;
    let n_target = basis_target.n();
    let outside = |&target: &u32| target != PointMap::UNMATCHED && target as usize >= n_target;
    if let Some(vertex) = targets.iter().position(outside) {
        return Err(FmapError::TargetOutOfRange { vertex, target: targets[vertex], n_target });
    }
    let (k_source, k_target) = (basis_source.k(), basis_target.k());
    let partial: Vec<Matrix> = targets
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, targets)| {
            let first = chunk * CHUNK;
            let mut weighted = Matrix::zeros(targets.len(), k_target); // A Psi[T]
            for (i, &target) in
                targets.iter().enumerate().filter(|&(_, &target)| target != PointMap::UNMATCHED)
            {
                let row = basis_target.eigenvectors.row(target as usize);
                let area = basis_source.mass[first + i];
                weighted.row_mut(i).iter_mut().zip(row).for_each(|(w, psi)| *w = area * psi);
            }
            let phi = basis_source.eigenvectors.as_faer().subrows(first, targets.len());
            let mut product = Matrix::zeros(k_target, k_source);
            let transposed = weighted.as_faer().transpose();
            faer::linalg::matmul::matmul(
                product.as_faer_mut(),
                Accum::Replace,
                transposed,
                phi,
                1.0,
                Par::Seq,
            );
            product
        })
        .collect();
    let mut c = Matrix::zeros(k_target, k_source);
    for product in &partial {
        c.data_mut().iter_mut().zip(product.data()).for_each(|(sum, x)| *sum += x);
    }
    Ok(c)
}
