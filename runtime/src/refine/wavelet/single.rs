//! Rounds in single precision, which all but the first and the last need no more than.

use crate::Matrix;
use crate::numeric::{MatrixView, matmul_split, par_matmul};
use crate::point_map::search::Rows;
use crate::spectral::Eigenbasis;

/// Pieces of the sums over the vertices. Fixed, so that the sums do not depend on the number of threads.
const PIECES: usize = 8;

/// What rounds at `k` eigenfunctions need of both shapes.
pub(super) struct SingleRounds {
    shapes: [Single; 2],
    /// `[k, k]`, of maps from source to target.
    mask: Matrix<f32>,
}

struct Single {
    /// `[n, k]`.
    phi: Matrix<f32>,
    mass: Vec<f32>,
    /// Columns beside the embedding, `[n, a]`.
    anchors: Matrix<f32>,
    /// Half of the squared norms of the rows of both, `[n]`.
    half_squares: Vec<f32>,
}

impl Single {
    fn new(basis: &Eigenbasis, k: usize, anchors: Option<&Matrix>) -> Self {
        let single = |matrix: &Matrix, cols: usize| {
            let mut data = Vec::with_capacity(matrix.rows() * cols);
            (0..matrix.rows()).for_each(|i| data.extend(matrix.row(i)[..cols].iter().map(|&x| x as f32)));
            Matrix::from_vec(matrix.rows(), cols, data)
        };
        let (phi, mass) = (single(&basis.eigenvectors, k), basis.mass.iter().map(|&x| x as f32).collect());
        let anchors = anchors.map_or(Matrix::zeros(basis.n(), 0), |anchors| single(anchors, anchors.cols()));
        let half_squares =
            (0..basis.n()).map(|i| half_square(phi.row(i)) + half_square(anchors.row(i))).collect();
        Self { phi, mass, anchors, half_squares }
    }

    fn n(&self) -> usize {
        self.phi.rows()
    }

    fn k(&self) -> usize {
        self.phi.cols()
    }

    /// `Phi^T A Psi[T]`, `[k, k_other]`, of a point map `T` of all vertices.
    fn pull_back(&self, images: &[u32], other: &Single) -> Matrix<f32> {
        let mut pulled = other.phi.select_rows(images);
        for (i, mass) in self.mass.iter().enumerate() {
            pulled.row_mut(i).iter_mut().for_each(|x| *x *= mass);
        }
        let mut c = Matrix::zeros(self.k(), other.k());
        matmul_split(c.data_mut(), view(&self.phi).t(), view(&pulled), PIECES);
        c
    }

    /// `Phi C^T`, `[n, k_other]`.
    fn transport(&self, c: &Matrix<f32>) -> Matrix<f32> {
        let mut transported = Matrix::zeros(self.n(), c.rows());
        par_matmul(transported.data_mut(), view(&self.phi), view(c).t());
        transported
    }

    /// Rows with the anchors beside them, whose squared norms are those of the shape's rows in the embedding.
    fn rows(&self, left: &Matrix<f32>, image: &Matrix<f32>) -> Rows {
        let entries = Matrix::beside(&[left, &self.anchors]);
        let half_squares = (0..self.n()).map(|i| self.half_squares[i] + half_square(image.row(i)));
        Rows::new(entries, half_squares.collect())
    }
}

impl SingleRounds {
    /// Of the first `k` eigenfunctions, with the mask of their functional maps, `[k, k]`, and columns beside the embedding.
    pub(super) fn new(
        [source, target]: [&Eigenbasis; 2],
        k: usize,
        mask: &Matrix,
        anchors: Option<&[Matrix; 2]>,
    ) -> Self {
        let shapes = [
            Single::new(source, k, anchors.map(|[of_source, _]| of_source)),
            Single::new(target, k, anchors.map(|[_, of_target]| of_target)),
        ];
        Self { shapes, mask: mask.map(|x| x as f32) }
    }

    /// The rows of both shapes in the embedding of the filtered functional maps of a pair of point maps of all vertices.
    pub(super) fn embedded(&self, [forth, back]: &[Vec<u32>; 2]) -> [Rows; 2] {
        let [source, target] = &self.shapes;
        let (c12, c21) = rayon::join(|| target.pull_back(back, source), || source.pull_back(forth, target));
        let filtered = |i: usize, j: usize| self.mask[(i, j)] * c12[(i, j)];
        let filtered_back = |i: usize, j: usize| self.mask[(j, i)] * c21[(i, j)];
        let c12 = Matrix::from_fn(c12.rows(), c12.cols(), filtered);
        let c21 = Matrix::from_fn(c21.rows(), c21.cols(), filtered_back);
        let sum = Matrix::from_fn(c12.rows(), c12.cols(), |i, j| c12[(i, j)] + c21[(j, i)]);
        let of_source = source.rows(&source.transport(&sum), &source.transport(&c12));
        let of_target = target.rows(&target.phi, &target.transport(&c21));
        [of_source, of_target]
    }
}

fn view(matrix: &Matrix<f32>) -> MatrixView<'_, f32> {
    MatrixView::new(matrix.data(), matrix.rows(), matrix.cols())
}

fn half_square(row: &[f32]) -> f32 {
    row.iter().map(|x| x * x).sum::<f32>() / 2.0
}
