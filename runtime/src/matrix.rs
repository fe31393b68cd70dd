//! A dense row-major matrix: the one array type of the public API.
//!
//! The library's linear algebra runs on `faer`, but no type of it is public; a [`Matrix`] is viewed as a
//! `faer` matrix inside the crate without a copy.

/// Dense matrix `[rows, cols]`, row-major: entry `(i, j)` is `data()[i * cols + j]`, as in NumPy.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Matrix<T = f64> {
    rows: usize,
    cols: usize,
    data: Vec<T>,
}

impl<T: Copy> Matrix<T> {
    /// Takes `data` as the rows of a `[rows, cols]` matrix.
    ///
    /// # Panics
    /// If `data.len() != rows * cols`, which is a bug of the caller.
    pub fn from_vec(rows: usize, cols: usize, data: Vec<T>) -> Self {
        assert_eq!(data.len(), rows * cols, "matrix data does not fit its shape [{rows}, {cols}]");
        Self { rows, cols, data }
    }

    /// The matrix whose entry `(i, j)` is `entry(i, j)`.
    pub fn from_fn(rows: usize, cols: usize, mut entry: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(rows * cols);
        for i in 0..rows {
            data.extend((0..cols).map(|j| entry(i, j)));
        }
        Self { rows, cols, data }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// All entries, row after row.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All entries, row after row, to write to.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Gives the entries away, row after row.
    pub fn into_data(self) -> Vec<T> {
        self.data
    }

    /// Row `i`, of length `cols`.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, i: usize) -> &[T] {
        &self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// Row `i`, of length `cols`, to write to.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row_mut(&mut self, i: usize) -> &mut [T] {
        &mut self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// The first `cols` columns, copied.
    ///
    /// # Panics
    /// If there are fewer columns.
    pub fn first_cols(&self, cols: usize) -> Self {
        assert!(cols <= self.cols, "asked for {cols} of {} columns", self.cols);
        let mut data = Vec::with_capacity(self.rows * cols);
        (0..self.rows).for_each(|i| data.extend_from_slice(&self.row(i)[..cols]));
        Self { rows: self.rows, cols, data }
    }

    /// The rows listed in `indices`, 0-based, copied, in that order.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn select_rows(&self, indices: &[u32]) -> Self {
        let mut data = Vec::with_capacity(indices.len() * self.cols);
        indices.iter().for_each(|&i| data.extend_from_slice(self.row(i as usize)));
        Self { rows: indices.len(), cols: self.cols, data }
    }

    /// The columns of all parts, at least one, beside each other.
    ///
    /// # Panics
    /// If they have not equally many rows.
    pub(crate) fn beside(parts: &[&Self]) -> Self {
        let (rows, cols) = (parts[0].rows, parts.iter().map(|part| part.cols).sum());
        assert!(parts.iter().all(|part| part.rows == rows), "parts beside each other differ in their rows");
        let mut data = Vec::with_capacity(rows * cols);
        (0..rows).for_each(|i| parts.iter().for_each(|part| data.extend_from_slice(part.row(i))));
        Self { rows, cols, data }
    }

    /// The transpose, `[cols, rows]`, copied.
    pub fn transposed(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self[(j, i)])
    }

    /// The matrix with `f` applied to every entry.
    pub fn map<U: Copy>(&self, f: impl FnMut(T) -> U) -> Matrix<U> {
        Matrix { rows: self.rows, cols: self.cols, data: self.data.iter().copied().map(f).collect() }
    }
}

impl<T: Copy + Default> Matrix<T> {
    /// The `[rows, cols]` matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self { rows, cols, data: vec![T::default(); rows * cols] }
    }
}

impl<T> std::ops::Index<(usize, usize)> for Matrix<T> {
    type Output = T;

    fn index(&self, (i, j): (usize, usize)) -> &T {
        &self.data[i * self.cols + j]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Matrix<T> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        &mut self.data[i * self.cols + j]
    }
}

impl<T: faer::traits::ComplexField> Matrix<T> {
    /// The same entries as a faer view, without a copy.
    pub(crate) fn as_faer(&self) -> faer::MatRef<'_, T> {
        faer::MatRef::from_row_major_slice(&self.data, self.rows, self.cols)
    }

    /// The same entries as a faer view to write to, without a copy.
    pub(crate) fn as_faer_mut(&mut self) -> faer::MatMut<'_, T> {
        faer::MatMut::from_row_major_slice_mut(&mut self.data, self.rows, self.cols)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_columns_and_faer_view_agree() {
        let m = Matrix::from_fn(3, 2, |i, j| (10 * i + j) as f64);
        assert_eq!(m.row(2), &[20.0, 21.0]);
        assert_eq!(m.as_faer()[(2, 1)], m[(2, 1)]);
        assert_eq!(m.first_cols(1).data(), &[0.0, 10.0, 20.0]);
        assert_eq!(m.select_rows(&[2, 0]).data(), &[20.0, 21.0, 0.0, 1.0]);
        assert_eq!(m.transposed().data(), &[0.0, 10.0, 20.0, 1.0, 11.0, 21.0]);
    }
}
