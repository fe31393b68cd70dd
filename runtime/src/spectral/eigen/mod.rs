//! The smallest eigenpairs of a Laplacian.
//!
//! Method: block Lanczos with thick restart on a Chebyshev polynomial of the inverse of `W - sigma A`, by a
//! sparse Cholesky factorisation; `sigma < 0` comes from Weyl's law, so that the matrix is definite. The null
//! space is known (functions constant on each component) and kept out. At the end the number of eigenvalues
//! below the last one found is counted by an `L D L^T` factorisation, so that none is missed. Small meshes
//! take a dense factorisation.

mod components;
mod dense;
mod factor;
mod filter;
mod iterate;
mod lanczos;
mod orthonormalise;
mod panel;
mod pencil;
#[cfg(test)]
mod reference_tests;
mod ritz;
#[cfg(test)]
mod tests;
mod triangular;
mod vectors;

use super::{Eigenbasis, Laplacian};
use crate::Matrix;
use filter::Filter;
use iterate::{Found, Stats, iterate};
use pencil::Pencil;
use thiserror::Error;

/// Meshes up to this size take the dense solver at once.
const DENSE_ALWAYS: usize = 256;
/// Larger ones take it up to this size where many of their pairs are wanted.
const DENSE_AT_MOST: usize = 3000;
/// Share of all pairs from which on they are many.
const MANY: usize = 6;

/// Options of [`eigenbasis`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct EigenOptions {
    /// Relative residual at which a pair has converged, measured on the inverted operator. From 1e-13 to
    /// 1e-2; default 1e-10. Eigenvalues are accurate to about its square.
    pub tolerance: f64,
    /// Dimension of the subspace at which the iteration restarts. Memory is `8 n` bytes for each. Default:
    /// about `2.3 k + 128`, with which most meshes need no restart; less than `k + 32` counts as that.
    pub subspace: Option<usize>,
    /// Restarts until the solver gives up. From 0; default 50.
    pub max_restarts: usize,
    /// Count the eigenvalues by another factorisation, to be sure that none is missed. Default true; costs
    /// some 5 % of the time.
    pub verify: bool,
    /// Seed of the random start. Changes the result by rounding only. Default 0.
    pub seed: u64,
}

impl Default for EigenOptions {
    fn default() -> Self {
        Self { tolerance: 1e-10, subspace: None, max_restarts: 50, verify: true, seed: 0 }
    }
}

/// How [`eigenbasis`] came to its result.
#[derive(Clone, Debug, PartialEq)]
pub struct EigenInfo {
    /// `|W phi - lambda A phi| / ((lambda + s) |A phi|)` of each pair, in Euclidean norms, `[k]`. `s` is
    /// about a tenth of the last eigenvalue, as the zeros have no scale of their own.
    pub residuals: Vec<f64>,
    /// Largest of `residuals`.
    pub max_residual: f64,
    /// Connected components, which is the multiplicity of the eigenvalue 0.
    pub components: usize,
    /// Block steps of the Lanczos iteration; 0 for the dense solver.
    pub iterations: usize,
    /// Vectors that the factorised system was solved for in these steps.
    pub solves: usize,
    /// Times that the iteration restarted.
    pub restarts: usize,
    /// Largest dimension of the subspace.
    pub subspace: usize,
    /// Stored entries of the Cholesky factor.
    pub factor_entries: usize,
    /// Whether the count of eigenvalues says that none is missing; `None` where it was not made or not
    /// conclusive.
    pub complete: Option<bool>,
}

/// Why there is no eigenbasis.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum EigenError {
    /// No pairs, or more than the mesh has.
    #[error("{k} eigenpairs of a mesh of {n} vertices: ask for 1 to {limit}, or use a finer mesh")]
    TooManyPairs {
        /// Pairs asked for.
        k: usize,
        /// Vertices.
        n: usize,
        /// Most pairs that are computed for this mesh.
        limit: usize,
    },
    /// The mesh has no vertices.
    #[error("the mesh has no vertices, hence no eigenpairs: check the file that it was read from")]
    NoVertices,
    /// Stiffness and mass of different meshes.
    #[error(
        "the stiffness matrix is for {stiffness} vertices and the mass for {mass}: take both from one mesh"
    )]
    SizeMismatch {
        /// Rows of the stiffness matrix.
        stiffness: usize,
        /// Entries of the mass.
        mass: usize,
    },
    /// A vertex has no positive mass.
    #[error(
        "vertex {vertex} has mass {mass}, which must be positive and finite: check the scale of the mesh"
    )]
    InvalidMass {
        /// The vertex, 0-based.
        vertex: usize,
        /// Its mass.
        mass: f64,
    },
    /// The mesh has no area, or the numbers overflow.
    #[error(
        "the mesh has area {area}, with which its Laplacian is not finite: check its faces and its scale"
    )]
    NoArea {
        /// Sum of the masses.
        area: f64,
    },
    /// An option is out of its range.
    #[error("tolerance {tolerance} is not between 1e-13 and 1e-2")]
    InvalidTolerance {
        /// The tolerance asked for.
        tolerance: f64,
    },
    /// The sparse factorisation failed.
    #[error("the Laplacian cannot be factorised ({reason}): repair the mesh or decimate it")]
    Factorization {
        /// What the factorisation says.
        reason: String,
    },
    /// The dense eigenproblem did not converge.
    #[error(
        "the dense eigensolver did not converge: the Laplacian has entries of extreme size, repair the mesh"
    )]
    DenseSolver,
    /// The iteration gave up.
    #[error(
        "{converged} of {k} eigenpairs converged in {restarts} restarts of a subspace of {subspace} \
         (worst residual \
         {worst:.1e}): allow a larger subspace or tolerance, or ask for fewer pairs"
    )]
    NotConverged {
        /// Pairs asked for.
        k: usize,
        /// Pairs that converged, from the smallest on.
        converged: usize,
        /// Restarts made.
        restarts: usize,
        /// Dimension of the subspace.
        subspace: usize,
        /// Largest residual.
        worst: f64,
        /// Relative residual of each wanted pair of the inverted operator, the null ones aside.
        residuals: Vec<f64>,
    },
}

/// The `k` smallest eigenpairs of `W phi = lambda A phi`, and how they were found.
///
/// Eigenvalues ascend; there is one exact 0 for each component, whose eigenvector is constant on that
/// component and 0 elsewhere, larger components first. `Phi^T A Phi = I` to 1e-10. Multiple eigenvalues come
/// with their multiplicity, with some basis of their eigenspace.
///
/// Signs: `sum_i A_i phi_i^3 > 0`; where that sum is nil, the entry of largest magnitude is positive, the one
/// of lowest index among equal ones.
///
/// The same input gives the same bytes for any number of threads; a scaled mesh gives eigenvectors that
/// differ by the scale and rounding only.
///
/// # Errors
/// If the mesh has no area, `k` is 0 or too large for the mesh (more than `n` up to 3000 vertices, than about `n / 6`
/// beyond), an option is out of range, or the iteration does not converge; see [`EigenError`].
pub fn eigenbasis(
    laplacian: &Laplacian,
    k: usize,
    options: &EigenOptions,
) -> Result<(Eigenbasis, EigenInfo), EigenError> {
    if !(1e-13..=1e-2).contains(&options.tolerance) {
        return Err(EigenError::InvalidTolerance { tolerance: options.tolerance });
    }
    let n = laplacian.n();
    if n == 0 {
        return Err(EigenError::NoVertices);
    }
    let limit = max_eigenpairs(n);
    if k == 0 || k > limit {
        return Err(EigenError::TooManyPairs { k, n, limit });
    }
    let pencil = Pencil::new(laplacian)?;
    let found = solve(&pencil, k, options)?;
    Ok(finish(&pencil, laplacian, k, found))
}

/// Most eigenpairs that are computed for a mesh of `n` vertices: all up to 3000, a sixth of more.
pub fn max_eigenpairs(n: usize) -> usize {
    if n <= DENSE_AT_MOST { n } else { n / MANY }
}

/// The solver that suits the size of the problem.
fn solve(pencil: &Pencil<'_>, k: usize, options: &EigenOptions) -> Result<Found, EigenError> {
    let (n, null) = (pencil.n(), pencil.components.len());
    if k <= null {
        let eigenvectors = Matrix::zeros(n, k);
        let stats = Stats { complete: Some(true), ..Stats::default() };
        return Ok(Found { eigenvalues: Vec::new(), eigenvectors, stats });
    }
    let many = k * MANY > n - null || n - null < DENSE_ALWAYS;
    if n <= DENSE_AT_MOST && (n <= DENSE_ALWAYS || many) {
        let (eigenvalues, eigenvectors) = dense::dense_eigenpairs(pencil, k)?;
        let stats = Stats { subspace: n, complete: Some(true), ..Stats::default() };
        return Ok(Found { eigenvalues: eigenvalues[null..].to_vec(), eigenvectors, stats });
    }
    if many {
        return Err(EigenError::TooManyPairs { k, n, limit: null.max((n - null) / MANY) });
    }
    iterate(pencil, k, options)
}

/// Null vectors, signs, residuals, and the unit of the mesh.
fn finish(pencil: &Pencil<'_>, laplacian: &Laplacian, k: usize, found: Found) -> (Eigenbasis, EigenInfo) {
    let Found { eigenvalues: above_zero, mut eigenvectors, stats } = found;
    let null = k - above_zero.len();
    let mut eigenvalues = vec![0.0; null];
    eigenvalues.extend(above_zero.iter().map(|x| x.max(0.0) / pencil.area));
    vectors::write_null_vectors(pencil, null, &mut eigenvectors);
    vectors::fix_signs(&mut eigenvectors, &laplacian.mass);
    let shift = iterate::shift(k) / pencil.area;
    let residuals = vectors::residuals(pencil, &eigenvalues, &eigenvectors, &laplacian.mass, shift);
    let info = EigenInfo {
        max_residual: residuals.iter().copied().fold(0.0, f64::max),
        residuals,
        components: pencil.components.len(),
        iterations: stats.steps,
        solves: stats.steps * panel::BLOCK * Filter::SOLVES,
        restarts: stats.restarts,
        subspace: stats.subspace,
        factor_entries: stats.factor_entries,
        complete: stats.complete,
    };
    (Eigenbasis { eigenvalues, eigenvectors, mass: laplacian.mass.clone() }, info)
}
