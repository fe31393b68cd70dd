//! Sparse factorisations: Cholesky for the solves, `L D L^T` for counting eigenvalues.

use super::EigenError;
use super::panel::{BLOCK, Panel};
use super::pencil::Pencil;
use super::triangular::LowerFactor;
use faer::Par;
use faer::Side;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SparseColMat;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};

/// Supernodes merge up to so many columns where at most this share of the entries becomes a stored zero. Less
/// than faer's default, as the solves are bound by reading the factor.
const RELAXATION: &[(usize, f64)] = &[(4, 0.3), (16, 0.15), (usize::MAX, 0.05)];

/// The upper triangle of a symmetric matrix.
pub(super) type Upper = SparseColMat<u32, f64>;

/// The fill-reducing order and the structure of the factor, shared by all matrices with one pattern.
pub(super) struct Analysis {
    symbolic: SymbolicCholesky<u32>,
}

impl Analysis {
    /// Orders by approximate minimum degree. Supernodal: the factorisation is several times faster than the
    /// simplicial one, and the solves run on dense blocks.
    pub(super) fn new(pencil: &Pencil<'_>) -> Result<Self, EigenError> {
        let matrix = pencil.shifted(0.0);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            supernodal_params: SymbolicSupernodalParams { relax: Some(RELAXATION) },
            ..Default::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(matrix.symbolic(), Side::Upper, SymmetricOrdering::Amd, params)
                .map_err(|error| EigenError::Factorization { reason: error.to_string() })?;
        Ok(Self { symbolic })
    }

    /// The vertex at each position of the factor's order, `[n]`.
    pub(super) fn order(&self) -> &[u32] {
        self.symbolic.perm().expect("an ordering was asked for").arrays().0
    }

    fn supernodal(&self) -> &SymbolicSupernodalCholesky<u32> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => symbolic,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("the supernodal factor was asked for"),
        }
    }

    /// Entries of the factor, zeros inside supernodes included.
    pub(super) fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// `L` of `M = L L^T`; `None` where `M` is not positive definite to working precision.
    pub(super) fn cholesky(&self, matrix: &Upper) -> Option<Cholesky<'_>> {
        let mut values = vec![0.0; self.symbolic.len_val()];
        let scratch = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        self.symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix.as_ref(),
                Side::Upper,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .ok()?;
        self.for_each_pivot(|at| values[at] = values[at].recip());
        let usable = values.iter().all(|x| x.is_finite());
        usable.then_some(Cholesky { analysis: self, values })
    }

    /// Number of negative eigenvalues of a nonsingular `M`, by Sylvester's law of inertia from `M = L D L^T`.
    /// `None` where a pivot vanishes, as none is exchanged.
    pub(super) fn negative_eigenvalues(&self, matrix: &Upper) -> Option<usize> {
        let mut values = vec![0.0; self.symbolic.len_val()];
        let scratch = self.symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        self.symbolic
            .factorize_numeric_ldlt(
                &mut values,
                matrix.as_ref(),
                Side::Upper,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .ok()?;
        let (mut negative, mut regular) = (0, true);
        self.for_each_pivot(|at| {
            negative += usize::from(values[at] < 0.0);
            regular &= values[at].is_finite() && values[at] != 0.0;
        });
        regular.then_some(negative)
    }

    /// Calls `f` with the place of every diagonal entry of the factor.
    fn for_each_pivot(&self, mut f: impl FnMut(usize)) {
        let symbolic = self.supernodal();
        for (s, &offset) in symbolic.col_ptr_for_val()[..symbolic.n_supernodes()].iter().enumerate() {
            let node = symbolic.supernode(s);
            let columns = symbolic.supernode_end()[s] as usize - node.start();
            let rows = columns + node.pattern().len();
            (0..columns).for_each(|j| f(offset as usize + j * (rows + 1)));
        }
    }
}

/// The Cholesky factor of a matrix, in the order of its analysis.
pub(super) struct Cholesky<'a> {
    analysis: &'a Analysis,
    values: Vec<f64>,
}

impl Cholesky<'_> {
    /// `M^-1` applied to the columns of the panel, whose rows are in the factor's order.
    ///
    /// With several threads two of them take half of the columns each, which does not change the result.
    pub(super) fn solve(&self, panel: &mut Panel) {
        let factor = LowerFactor { symbolic: self.analysis.supernodal(), values: &self.values };
        if rayon::current_num_threads() < 2 {
            return factor.solve(panel);
        }
        let (mut left, mut right) = rayon::join(
            || panel.iter().map(half::<0>).collect::<Vec<_>>(),
            || panel.iter().map(half::<1>).collect::<Vec<_>>(),
        );
        rayon::join(|| factor.solve(&mut left), || factor.solve(&mut right));
        for (row, (l, r)) in panel.iter_mut().zip(left.iter().zip(&right)) {
            row[..BLOCK / 2].copy_from_slice(l);
            row[BLOCK / 2..].copy_from_slice(r);
        }
    }
}

/// The left (0) or right (1) half of a row.
fn half<const SIDE: usize>(row: &[f64; BLOCK]) -> [f64; BLOCK / 2] {
    std::array::from_fn(|w| row[SIDE * BLOCK / 2 + w])
}
