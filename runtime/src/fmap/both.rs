//! The functional maps of both directions, each solved for on its own.

use super::{
    FmapError, FmapInfo, FmapSolver, check_length, functional_map, functional_map_of, regularized,
    relative_residual, scale_free_eigenvalues,
};
use crate::Matrix;
use crate::point_map::{Comparison, Embedding, PointMap, RecoverError};
use crate::spectral::Eigenbasis;

/// Two functional maps between the same bases, one in each direction.
///
/// Between isometric shapes each is the transpose of the other; where they differ, each knows something the other
/// does not.
#[derive(Clone, Debug, PartialEq)]
pub struct BothMaps {
    /// `C12`, `[k_target, k_source]`: takes functions on the source to functions on the target.
    pub forth: Matrix,
    /// `C21`, `[k_source, k_target]`: takes functions on the target to functions on the source.
    pub back: Matrix,
}

impl BothMaps {
    /// A functional map, `[k_target, k_source]`, and its adjoint.
    pub fn with_adjoint(forth: Matrix) -> Self {
        let back = forth.transposed();
        Self { forth, back }
    }

    /// The functional maps of a pair of point maps, `[source to target, target to source]`: each point map pulls
    /// functions back, so that `C12 = Psi^T A_target Phi[T21]` and `C21 = Phi^T A_source Psi[T12]`.
    ///
    /// # Errors
    /// As [`functional_map_of`].
    pub fn of(
        [forth, back]: [&PointMap; 2],
        basis_source: &Eigenbasis,
        basis_target: &Eigenbasis,
    ) -> Result<Self, FmapError> {
        Ok(Self {
            forth: functional_map_of(back, basis_target, basis_source)?.transposed(),
            back: functional_map_of(forth, basis_source, basis_target)?.transposed(),
        })
    }

    /// The same maps with source and target exchanged.
    pub fn reversed(self) -> Self {
        Self { forth: self.back, back: self.forth }
    }

    /// `(C12 + C21^T) / 2`, `[k_target, k_source]`.
    pub fn mean(&self) -> Matrix {
        mean_with_transpose(&self.forth, &self.back)
    }

    /// The point map from the source to the target; by [`Comparison::Joint`] of both maps, else of `forth` alone.
    /// That of the other direction is the one of [`BothMaps::reversed`].
    ///
    /// # Errors
    /// As [`Embedding::forth`].
    pub fn point_map(
        &self,
        comparison: Comparison,
        basis_source: &Eigenbasis,
        basis_target: &Eigenbasis,
    ) -> Result<PointMap, RecoverError> {
        self.embedding(comparison, basis_source, basis_target)?.forth()
    }

    /// The embedding in which the vertices of both shapes are compared: by [`Comparison::Joint`] that of both maps,
    /// else of `forth` alone.
    ///
    /// # Errors
    /// As [`Embedding::joint`].
    pub fn embedding(
        &self,
        comparison: Comparison,
        basis_source: &Eigenbasis,
        basis_target: &Eigenbasis,
    ) -> Result<Embedding, RecoverError> {
        match comparison {
            Comparison::Joint => Embedding::joint(&self.forth, &self.back, basis_source, basis_target),
            one_map => Embedding::of_one(one_map, &self.forth, basis_source, basis_target),
        }
    }
}

/// The regularised functional maps of both directions, by [`regularized`] with the same weight of the mask.
///
/// The two solves fit different sides of the same equation, `C12 F^ = G^` and `F^ = C21 G^`, and what either gets
/// wrong where descriptors disagree is not what the other gets wrong.
///
/// Arguments and errors as in [`regularized`]. The rank is the smaller, the condition and the residual the larger
/// ones of the two solves.
pub fn both_maps(
    f_hat: &Matrix,
    g_hat: &Matrix,
    eigenvalues_source: &[f64],
    eigenvalues_target: &[f64],
    weight: f64,
) -> Result<(BothMaps, FmapInfo), FmapError> {
    let (forth, info) = regularized(f_hat, g_hat, eigenvalues_source, eigenvalues_target, weight)?;
    let (back, info_back) = regularized(g_hat, f_hat, eigenvalues_target, eigenvalues_source, weight)?;
    let info = FmapInfo {
        rank: info.rank.min(info_back.rank),
        condition: info.condition.max(info_back.condition),
        relative_residual: info.relative_residual.max(info_back.relative_residual),
    };
    Ok((BothMaps { forth, back }, info))
}

/// The functional maps of both directions by a solver: [`both_maps`] for [`FmapSolver::Joint`]; the others find one
/// map, and the map back is its adjoint. Arguments as in [`functional_map`].
///
/// # Errors
/// As [`functional_map`].
pub fn functional_maps(
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    f_hat: &Matrix,
    g_hat: &Matrix,
    solver: FmapSolver,
) -> Result<(BothMaps, FmapInfo), FmapError> {
    let FmapSolver::Joint { weight } = solver else {
        let (forth, info) = functional_map(basis_source, basis_target, f_hat, g_hat, solver)?;
        return Ok((BothMaps::with_adjoint(forth), info));
    };
    check_length("a column of the source's coefficients", f_hat.rows(), basis_source.k())?;
    check_length("a column of the target's coefficients", g_hat.rows(), basis_target.k())?;
    let [source, target] = [basis_source, basis_target].map(scale_free_eigenvalues);
    both_maps(f_hat, g_hat, &source, &target, weight)
}

/// The bidirectional functional map: the mean of the map `C`, `[k_target, k_source]`, that [`regularized`] finds from
/// the source to the target and of the transpose of the one from the target to the source.
///
/// Between isometric shapes at unit area a functional map is orthogonal, so the transpose of the map back is the map
/// itself. On FAUST pairs the mean error of the raw map falls by a quarter, and a weaker mask,
/// [`super::FmapSolver::BIDIRECTIONAL_WEIGHT`], then is best.
///
/// Arguments and errors as in [`regularized`], rank and condition as in [`both_maps`]; the residual is that of the
/// mean in `C F^ = G^`.
pub fn bidirectional(
    f_hat: &Matrix,
    g_hat: &Matrix,
    eigenvalues_source: &[f64],
    eigenvalues_target: &[f64],
    weight: f64,
) -> Result<(Matrix, FmapInfo), FmapError> {
    let (maps, info) = both_maps(f_hat, g_hat, eigenvalues_source, eigenvalues_target, weight)?;
    let mean = maps.mean();
    let relative_residual = relative_residual(&mean, f_hat, g_hat);
    Ok((mean, FmapInfo { relative_residual, ..info }))
}

/// `(forth + back^T) / 2`.
pub(crate) fn mean_with_transpose(forth: &Matrix, back: &Matrix) -> Matrix {
    Matrix::from_fn(forth.rows(), forth.cols(), |i, j| 0.5 * (forth[(i, j)] + back[(j, i)]))
}
