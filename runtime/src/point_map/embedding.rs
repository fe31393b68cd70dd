//! Both shapes in one space, in which the nearest rows give the point maps.

use super::recover::{Comparison, check_shape, cosines, transport};
use super::search::{
    NearestRows, Rows, SearchError, inner_product, mutual_nearest, nearest_rows, squared_norms,
};
use super::{PointMap, RecoverError};
use crate::Matrix;
use crate::spectral::Eigenbasis;
use rayon::prelude::*;

/// Source rows times target rows up to which one product of both takes less time than two searches, whose cost grows
/// slower.
const MOST_PRODUCTS: usize = 1 << 28;

/// Both shapes in the space in which a functional map compares their vertices, a row for each.
///
/// By [`Comparison::Joint`] it is the space of the coefficients of both, `k_target + k_source` wide: the row of a
/// source vertex `x` is `[C12 phi(x), phi(x)]`, that of a target vertex `y` is `[psi(y), C21 psi(y)]`. A distance in
/// it is what the two functional maps miss together, `|C12 phi(x) - psi(y)|^2 + |phi(x) - C21 psi(y)|^2`; it is the
/// same from either side, so that one embedding gives the point maps of both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Embedding<T = f64> {
    /// The rows of the source, `[n_source, d]`; joint: `[Phi C12^T, Phi]`.
    pub source: Matrix<T>,
    /// The rows of the target, `[n_target, d]`; joint: `[Psi, Psi C21^T]`.
    pub target: Matrix<T>,
    /// Joint: `Phi (C12^T + C21)`, `[n_source, k_target]`, and `Psi`, whose products are those of the rows in half
    /// the width.
    factors: Option<[Matrix<T>; 2]>,
}

impl<T: Copy> Embedding<T> {
    /// Rows of any kind, `[n_source, d]` and `[n_target, d]`, such as descriptors.
    ///
    /// # Errors
    /// If their widths differ.
    pub fn of_rows(source: Matrix<T>, target: Matrix<T>) -> Result<Self, SearchError> {
        if source.cols() != target.cols() {
            return Err(SearchError::WidthMismatch { queries: source.cols(), targets: target.cols() });
        }
        Ok(Self { source, target, factors: None })
    }
}

impl Embedding<f32> {
    /// The point maps of matches, source to target first, with the cosines between their rows.
    pub(crate) fn point_maps(&self, [forth, back]: [Vec<u32>; 2]) -> [PointMap; 2] {
        let squares = |rows: &Matrix<f32>| -> Vec<f32> {
            (0..rows.rows()).map(|i| inner_product(rows.row(i), rows.row(i))).collect()
        };
        let squares = [squares(&self.source), squares(&self.target)];
        let rows = [&self.source, &self.target];
        let map = |from: usize, targets: Vec<u32>| {
            let cosine = |(x, &y): (usize, &u32)| {
                let lengths = (squares[from][x] * squares[1 - from][y as usize]).sqrt();
                let product = inner_product(rows[from].row(x), rows[1 - from].row(y as usize));
                if lengths > 0.0 { (product / lengths).clamp(0.0, 1.0) } else { 0.0 }
            };
            let confidence = Some(targets.par_iter().enumerate().map(cosine).collect());
            PointMap { confidence, ..PointMap::new(targets, rows[1 - from].rows()) }
        };
        [map(0, forth), map(1, back)]
    }
}

impl Embedding<f64> {
    /// The joint embedding of the functional maps `forth`, `[k_target, k_source]`, and `back`, `[k_source, k_target]`.
    ///
    /// # Errors
    /// If a map is not of that shape.
    pub fn joint(
        forth: &Matrix,
        back: &Matrix,
        basis_source: &Eigenbasis,
        basis_target: &Eigenbasis,
    ) -> Result<Self, RecoverError> {
        let rows = Self::joint_beside(forth, back, [basis_source, basis_target], None)?;
        let sum = Matrix::from_fn(forth.rows(), forth.cols(), |i, j| forth[(i, j)] + back[(j, i)]);
        let phi = transport(&basis_source.eigenvectors, &sum);
        Ok(Self { factors: Some([phi, basis_target.eigenvectors.clone()]), ..rows })
    }

    /// As [`Embedding::joint`], with further columns beside the rows, `[n_source, a]` and `[n_target, a]`; for its
    /// rows, as it is searched in twice the width.
    ///
    /// # Errors
    /// If a map is not of that shape.
    pub(crate) fn joint_beside(
        forth: &Matrix,
        back: &Matrix,
        [basis_source, basis_target]: [&Eigenbasis; 2],
        columns: Option<&[Matrix; 2]>,
    ) -> Result<Self, RecoverError> {
        check_shape(forth, basis_source, basis_target)?;
        check_shape(back, basis_target, basis_source)?;
        let (phi, psi) = (&basis_source.eigenvectors, &basis_target.eigenvectors);
        let rows = |joint: [&Matrix; 2], columns: Option<&Matrix>| {
            let parts: Vec<&Matrix> = joint.into_iter().chain(columns).collect();
            Matrix::beside(&parts)
        };
        let (source, target) = rayon::join(
            || rows([&transport(phi, forth), phi], columns.map(|[of_source, _]| of_source)),
            || rows([psi, &transport(psi, back)], columns.map(|[_, of_target]| of_target)),
        );
        Ok(Self { source, target, factors: None })
    }

    /// The embedding of one functional map `c`, `[k_target, k_source]`, for a comparison; joint with its adjoint.
    ///
    /// # Errors
    /// If the map is not of that shape.
    pub fn of_one(
        comparison: Comparison,
        c: &Matrix,
        basis_source: &Eigenbasis,
        basis_target: &Eigenbasis,
    ) -> Result<Self, RecoverError> {
        check_shape(c, basis_source, basis_target)?;
        let (phi, psi) = (&basis_source.eigenvectors, &basis_target.eigenvectors);
        let (source, target) = match comparison {
            Comparison::Joint => return Self::joint(c, &c.transposed(), basis_source, basis_target),
            Comparison::Distance => (transport(phi, c), psi.clone()),
            Comparison::Adjoint => (phi.clone(), transport(psi, &c.transposed())),
        };
        Ok(Self { source, target, factors: None })
    }

    /// The same with further columns beside the rows, `[n_source, a]` and `[n_target, a]`, which count in every
    /// distance.
    ///
    /// # Panics
    /// If they have not as many rows.
    pub(crate) fn with_columns(&self, source: &Matrix, target: &Matrix) -> Self {
        let beside = |left: &Matrix, right: &Matrix| Matrix::beside(&[left, right]);
        let factors =
            self.factors.as_ref().map(|[left, right]| [beside(left, source), beside(right, target)]);
        Self { source: beside(&self.source, source), target: beside(&self.target, target), factors }
    }

    /// For each source vertex the nearest target vertex, the lowest of several; the confidence is the cosine of the
    /// angle between their rows, negative ones as 0.
    ///
    /// # Errors
    /// If an entry is not finite, or there are no target vertices.
    pub fn forth(&self) -> Result<PointMap, RecoverError> {
        nearest(&self.source, &self.target)
    }

    /// For each target vertex the nearest source vertex, as [`Embedding::forth`].
    ///
    /// # Errors
    /// If an entry is not finite, or there are no source vertices.
    pub fn back(&self) -> Result<PointMap, RecoverError> {
        nearest(&self.target, &self.source)
    }

    /// The point maps of both directions, source to target first, as [`Embedding::forth`] and [`Embedding::back`] but
    /// between small shapes in single precision, which takes a fraction of the time: distances that agree to six
    /// digits may be taken for one another.
    ///
    /// # Errors
    /// If an entry is not finite, or a shape has no vertices.
    pub fn both(&self) -> Result<[PointMap; 2], RecoverError> {
        let [forth, back] = self.matches()?;
        let map = |queries: &Matrix, rows: &Matrix, targets: Vec<u32>| {
            let confidence = Some(cosines(queries, rows, &targets));
            PointMap { confidence, ..PointMap::new(targets, rows.rows()) }
        };
        Ok([map(&self.source, &self.target, forth), map(&self.target, &self.source, back)])
    }

    /// The same in single precision.
    pub(crate) fn single(&self) -> Embedding<f32> {
        let single = |rows: &Matrix| rows.map(|x| x as f32);
        let factors = self.factors.as_ref().map(|factors| factors.each_ref().map(single));
        Embedding { source: single(&self.source), target: single(&self.target), factors }
    }

    /// Rows in single precision whose products give the distances.
    fn rounded(&self) -> [Rows<'static>; 2] {
        let [left, right] = match &self.factors {
            Some([left, right]) => [left, right],
            None => [&self.source, &self.target],
        };
        [
            Rows::rounded(left, &squared_norms(&self.source)),
            Rows::rounded(right, &squared_norms(&self.target)),
        ]
    }

    /// Whether all products of two shapes' rows take less time than two searches.
    pub(crate) fn is_small(n_source: usize, n_target: usize) -> bool {
        n_source.saturating_mul(n_target) <= MOST_PRODUCTS
    }

    /// The matches of [`Embedding::both`].
    pub(crate) fn matches(&self) -> Result<[Vec<u32>; 2], SearchError> {
        if Self::is_small(self.source.rows(), self.target.rows()) {
            return mutual_nearest(self.rounded().each_ref());
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
    Ok(PointMap { confidence, ..PointMap::new(targets, rows.rows()) })
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
        let embedding =
            BothMaps::with_adjoint(identity(25)).embedding(Comparison::Joint, &source, &target).unwrap();
        let (forth, back) = (embedding.forth().unwrap(), embedding.back().unwrap());
        assert_eq!(back.targets, order);
        assert_eq!(embedding.matches().unwrap(), [forth.targets.clone(), order.clone()]);
        let both = embedding.both().unwrap();
        assert_eq!(both, [forth.clone(), back.clone()]);
        assert!(order.iter().enumerate().all(|(y, &x)| forth.targets[x as usize] == y as u32));
        assert!(forth.confidence.iter().chain(&back.confidence).flatten().all(|&c| c > 1.0 - 1e-6));
    }

    #[test]
    fn matches_are_those_of_the_plain_double_loop() {
        let (source, target) = (rectangle(11, 12, 9), rectangle(13, 10, 7));
        let wave = |rows, cols| Matrix::from_fn(rows, cols, |i, j| ((i * cols + j) as f64 * 1.7).sin());
        let maps = BothMaps { forth: wave(7, 9), back: wave(9, 7) };
        let embedding = maps.embedding(Comparison::Joint, &source, &target).unwrap();
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
        let exchanged = maps.reversed().embedding(Comparison::Joint, &target, &source).unwrap();
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
        let expected = maps.embedding(Comparison::Joint, &source, &target).unwrap();
        let found = other.embedding(Comparison::Joint, &source, &flipped(&target)).unwrap();
        assert_eq!(found.forth().unwrap().targets, expected.forth().unwrap().targets);
        assert_eq!(found.back().unwrap().targets, expected.back().unwrap().targets);
    }

    #[test]
    fn a_map_of_the_wrong_shape_is_an_error() {
        let (source, target) = (rectangle(9, 8, 10), rectangle(9, 8, 12));
        let maps = BothMaps { forth: Matrix::zeros(12, 10), back: Matrix::zeros(12, 10) };
        let error = maps.embedding(Comparison::Joint, &source, &target).unwrap_err();
        let expected = RecoverError::ShapeMismatch { rows: 12, cols: 10, k_target: 10, k_source: 12 };
        assert_eq!(error, expected);
    }
}
