//! Soft correspondence: for each source vertex a distribution over the target.

use super::{FmapError, check_length, dense};
use crate::Matrix;
use crate::spectral::Eigenbasis;
use faer::{Accum, Par};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Source vertices handled together.
const BLOCK: usize = 32;

/// How the columns of the soft correspondence are normalised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColumnNorm {
    /// Squares sum to one, as in the authors' code.
    #[default]
    L2,
    /// Entries sum to one: the column is a probability distribution over the target.
    L1,
}

impl FromStr for ColumnNorm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "l2" => Ok(Self::L2),
            "l1" => Ok(Self::L1),
            other => Err(format!("{other:?} is no norm of columns; take l2 or l1")),
        }
    }
}

/// The soft correspondence `P = |Psi C Phi^T A|^`, `[n_target, n_source]` (Litany et al. 2017, eq. 6), of a
/// functional map.
///
/// Column `x` says where on the target the source vertex `x` may lie. The columns are normalised, so that the
/// area `A_x` in column `x` cancels; it is left out, which also gives vertices without area a column. A
/// column of zeros stays zero.
#[derive(Clone, Debug)]
pub struct SoftCorrespondence<'a> {
    /// `Phi C^T`, `[n_source, k_target]`.
    transported: Matrix,
    /// `Psi`, `[n_target, k_target]`.
    basis_target: &'a Matrix,
    norm: ColumnNorm,
}

/// The largest entry of a column of the soft correspondence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftPeak {
    /// Target vertex of the largest entry, the lowest of several.
    pub target: u32,
    /// The entry, 0 to 1, under the chosen norm.
    pub weight: f64,
    /// Over how many target vertices the column effectively spreads: `(sum p)^2 / sum p^2`, from 1 (certain)
    /// to `n_target`; 0 for a column of zeros.
    pub spread: f64,
}

impl<'a> SoftCorrespondence<'a> {
    /// The soft correspondence of the functional map `c`, `[k_target, k_source]`.
    ///
    /// # Errors
    /// If `c` is not of that shape, or the target has no vertices.
    pub fn new(
        basis_source: &Eigenbasis,
        basis_target: &'a Eigenbasis,
        c: &Matrix,
        norm: ColumnNorm,
    ) -> Result<Self, FmapError> {
        check_length("a row of the functional map", c.cols(), basis_source.k())?;
        check_length("a column of the functional map", c.rows(), basis_target.k())?;
        if basis_target.n() == 0 {
            return Err(FmapError::Empty { what: "the target's basis" });
        }
        let transported = dense::multiply(basis_source.eigenvectors.as_faer(), c.as_faer().transpose());
        Ok(Self { transported, basis_target: &basis_target.eigenvectors, norm })
    }

    /// The whole matrix, `[n_target, n_source]`, if it takes no more than `max_bytes`.
    ///
    /// # Errors
    /// If it takes more.
    pub fn dense(&self, max_bytes: usize) -> Result<Matrix<f32>, FmapError> {
        let (n_target, n_source) = (self.basis_target.rows(), self.transported.rows());
        let needed = n_target.saturating_mul(n_source).saturating_mul(size_of::<f32>());
        if needed > max_bytes {
            return Err(FmapError::TooLarge { n_target, n_source, needed, allowed: max_bytes });
        }
        let mut soft = Matrix::zeros(n_target, n_source);
        for first in (0..n_source).step_by(BLOCK) {
            let columns = self.columns(first, BLOCK.min(n_source - first));
            for (x, column) in columns.data().chunks_exact(n_target).enumerate() {
                let factor = Moments::of(column).factor(self.norm);
                for (y, &entry) in column.iter().enumerate() {
                    soft[(y, first + x)] = (entry * factor) as f32;
                }
            }
        }
        Ok(soft)
    }

    /// The peak of every column, `[n_source]`, with memory for a few columns only.
    pub fn peaks(&self) -> Vec<SoftPeak> {
        let (n_target, n_source) = (self.basis_target.rows(), self.transported.rows());
        (0..n_source.div_ceil(BLOCK))
            .into_par_iter()
            .flat_map_iter(|block| {
                let first = block * BLOCK;
                let columns = self.columns(first, BLOCK.min(n_source - first));
                let peaks: Vec<SoftPeak> =
                    columns.data().chunks_exact(n_target).map(|column| self.peak(column)).collect();
                peaks
            })
            .collect()
    }

    fn peak(&self, column: &[f64]) -> SoftPeak {
        let moments = Moments::of(column);
        let target = (0..column.len()).fold(0, |peak, y| if column[y] > column[peak] { y } else { peak });
        let spread = if moments.squares > 0.0 { moments.sum * moments.sum / moments.squares } else { 0.0 };
        SoftPeak { target: target as u32, weight: column[target] * moments.factor(self.norm), spread }
    }

    /// `count` columns from `first` on before normalisation, one after the other, `[count, n_target]`.
    fn columns(&self, first: usize, count: usize) -> Matrix {
        let mut columns = Matrix::zeros(count, self.basis_target.rows());
        faer::linalg::matmul::matmul(
            columns.as_faer_mut(),
            Accum::Replace,
            self.transported.as_faer().subrows(first, count),
            self.basis_target.as_faer().transpose(),
            1.0,
            Par::Seq,
        );
        columns.data_mut().iter_mut().for_each(|x| *x = x.abs());
        columns
    }
}

/// Sums over a column.
struct Moments {
    sum: f64,
    squares: f64,
}

impl Moments {
    fn of(column: &[f64]) -> Self {
        Self { sum: column.iter().sum(), squares: column.iter().map(|x| x * x).sum() }
    }

    /// What a column is multiplied by to normalise it.
    fn factor(&self, norm: ColumnNorm) -> f64 {
        let length = match norm {
            ColumnNorm::L2 => self.squares.sqrt(),
            ColumnNorm::L1 => self.sum,
        };
        if length > 0.0 { 1.0 / length } else { 0.0 }
    }
}
