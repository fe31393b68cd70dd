//! Point maps of both directions from one embedding of both shapes.

use super::recover::{check_shape, cosines, transport};
use super::search::{NearestRows, SearchError, mutual_nearest, nearest_rows};
use super::{PointMap, RecoverError};
use crate::Matrix;
use crate::spectral::Eigenbasis;

/// Source rows times target rows up to which one product of both takes less time than two searches, whose cost grows slower.
const MOST_PRODUCTS: usize = 1 << 28;

/// Both shapes in the space of the coefficients of both, `[k_target, k_source]` wide: the row of a source vertex `x` is
/// `[C12 phi(x), phi(x)]`, that of a target vertex `y` is `[psi(y), C21 psi(y)]`.
///
/// A distance in it is what the two functional maps miss together, `|C12 phi(x) - psi(y)|^2 + |phi(x) - C21 psi(y)|^2`; it is
/// the same from either side, so that one embedding gives the point maps of both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct JointEmbedding {
    /// `[Phi C12^T, Phi]`, `[n_source, k_target + k_source]`.
    pub source: Matrix,
    /// `[Psi, Psi C21^T]`, `[n_target, k_target + k_source]`.
    pub target: Matrix,
}

impl JointEmbedding {
    /// The embedding of the functional maps `forth`, `[k_target, k_source]`, and `back`, `[k_source, k_target]`.
    ///
    /// # Errors
    /// If a map is not of that shape.
    pub fn new(
        forth: &Matrix,
        back: &Matrix,
        basis_source: &Eigenbasis,
        basis_target: &Eigenbasis,
    ) -> Result<Self, RecoverError> {
        check_shape(forth, basis_source, basis_target)?;
        check_shape(back, basis_target, basis_source)?;
        let (phi, psi) = (&basis_source.eigenvectors, &basis_target.eigenvectors);
        Ok(Self { source: beside(&transport(phi, forth), phi), target: beside(psi, &transport(psi, back)) })
    }

    /// For each source vertex the nearest target vertex, the lowest of several; the confidence is the cosine of the angle
    /// between their rows, negative ones as 0.
    ///
    /// # Errors
    /// If an entry is not finite, or there are no target vertices.
    pub fn forth(&self) -> Result<PointMap, RecoverError> {
        nearest(&self.source, &self.target)
    }

    /// For each target vertex the nearest source vertex, as [`JointEmbedding::forth`].
    ///
    /// # Errors
    /// If an entry is not finite, or there are no source vertices.
    pub fn back(&self) -> Result<PointMap, RecoverError> {
        nearest(&self.target, &self.source)
    }

    /// The matches of both directions, source to target first, for maps that are not final: between small shapes in single
    /// precision.
    pub(crate) fn both(&self) -> Result<[Vec<u32>; 2], SearchError> {
        if self.source.rows().saturating_mul(self.target.rows()) <= MOST_PRODUCTS {
            return mutual_nearest(&self.source, &self.target);
        }
        let (forth, back) = rayon::join(
            || nearest_rows(&self.source, &self.target),
            || nearest_rows(&self.target, &self.source),
        );
        Ok([forth?.index, back?.index])
    }
}

fn nearest(queries: &Matrix, rows: &Matrix) -> Result<PointMap, RecoverError> {
    let targets = NearestRows::new(rows)?.nearest(queries)?.index;
    let confidence = Some(cosines(queries, rows, &targets));
    Ok(PointMap { targets, confidence, n_target: rows.rows() })
}

/// `[left, right]`, two matrices of as many rows beside each other.
fn beside(left: &Matrix, right: &Matrix) -> Matrix {
    let rows = (0..left.rows()).flat_map(|i| left.row(i).iter().chain(right.row(i)).copied());
    Matrix::from_vec(left.rows(), left.cols() + right.cols(), rows.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmap::BothMaps;
    use crate::fmap::test_basis::{flipped, identity, rectangle, reordered, shuffle, sign};

    #[test]
    fn a_permuted_copy_gives_the_permutation_and_its_inverse() {
        let source = rectangle(30, 40, 25);
        let order = shuffle(1200);
        let target = reordered(&source, &order);
        let embedding = BothMaps::with_adjoint(identity(25)).embedding(&source, &target).unwrap();
        let (forth, back) = (embedding.forth().unwrap(), embedding.back().unwrap());
        assert_eq!(back.targets, order);
        assert_eq!(embedding.both().unwrap(), [forth.targets.clone(), order.clone()]);
        assert!(order.iter().enumerate().all(|(y, &x)| forth.targets[x as usize] == y as u32));
        assert!(forth.confidence.iter().chain(&back.confidence).flatten().all(|&c| c > 1.0 - 1e-6));
    }

    #[test]
    fn matches_are_those_of_the_plain_double_loop() {
        let (source, target) = (rectangle(11, 12, 9), rectangle(13, 10, 7));
        let wave = |rows, cols| Matrix::from_fn(rows, cols, |i, j| ((i * cols + j) as f64 * 1.7).sin());
        let maps = BothMaps { forth: wave(7, 9), back: wave(9, 7) };
        let embedding = maps.embedding(&source, &target).unwrap();
        let image = |c: &Matrix, row: &[f64]| -> Vec<f64> {
            (0..c.rows()).map(|i| c.row(i).iter().zip(row).map(|(a, b)| a * b).sum()).collect()
        };
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let distance = |x: usize, y: usize| {
            let (phi, psi) = (source.eigenvectors.row(x), target.eigenvectors.row(y));
            apart(&image(&maps.forth, phi), psi) + apart(phi, &image(&maps.back, psi))
        };
        for (x, y) in embedding.forth().unwrap().targets.iter().enumerate() {
            let least = (0..target.n()).map(|y| distance(x, y)).fold(f64::INFINITY, f64::min);
            assert!(distance(x, *y as usize) <= least + 1e-12);
        }
        for (y, x) in embedding.back().unwrap().targets.iter().enumerate() {
            let least = (0..source.n()).map(|x| distance(x, y)).fold(f64::INFINITY, f64::min);
            assert!(distance(*x as usize, y) <= least + 1e-12);
        }
        let exchanged = maps.reversed().embedding(&target, &source).unwrap();
        assert_eq!(exchanged.forth().unwrap().targets, embedding.back().unwrap().targets);
    }

    #[test]
    fn eigenvector_signs_leave_the_maps_unchanged() {
        let (source, target) = (rectangle(30, 40, 25), rectangle(37, 31, 20));
        let wave = |i: usize, j: usize| ((i * 25 + j) as f64).sin() + if i == j { 4.0 } else { 0.0 };
        let maps = BothMaps {
            forth: Matrix::from_fn(20, 25, wave),
            back: Matrix::from_fn(25, 20, |i, j| wave(j, i) + 0.1 * wave(i, j)),
        };
        let other = BothMaps {
            forth: Matrix::from_fn(20, 25, |i, j| sign(i) * maps.forth[(i, j)]),
            back: Matrix::from_fn(25, 20, |i, j| sign(j) * maps.back[(i, j)]),
        };
        let expected = maps.embedding(&source, &target).unwrap();
        let found = other.embedding(&source, &flipped(&target)).unwrap();
        assert_eq!(found.forth().unwrap().targets, expected.forth().unwrap().targets);
        assert_eq!(found.back().unwrap().targets, expected.back().unwrap().targets);
    }

    #[test]
    fn a_map_of_the_wrong_shape_is_an_error() {
        let (source, target) = (rectangle(9, 8, 10), rectangle(9, 8, 12));
        let maps = BothMaps { forth: Matrix::zeros(12, 10), back: Matrix::zeros(12, 10) };
        let error = maps.embedding(&source, &target).unwrap_err();
        let expected = RecoverError::ShapeMismatch { rows: 12, cols: 10, k_target: 10, k_source: 12 };
        assert_eq!(error, expected);
    }
}
