//! The operator that Lanczos works on: a Chebyshev polynomial of the inverted, shifted Laplacian.
//!
//! With `S = (D W D - sigma)^-1`, `D = A^-1/2`, an eigenvalue `lambda` becomes `theta = 1 / (lambda -
//! sigma)`. The polynomial maps `theta` in `[0, theta_cut]` into `[-1, 1]` and grows fast beyond, so wanted
//! eigenvalues stand out more than in `S` itself: a subspace two thirds the size reaches the same accuracy,
//! and orthogonalising that subspace is what costs. It has a root at `theta = 0`, which keeps the highest
//! frequencies out of the subspace (Zhou, Saad, Tiago and Chelikowsky 2006 filter with `W` itself; on a mesh
//! `S` needs a far lower degree).

use super::factor::Cholesky;
use super::panel::{Panel, zip_rows};
use std::f64::consts::FRAC_PI_2;

/// Degree of the polynomial: a higher one costs more solves than it saves in orthogonalisation.
const DEGREE: u32 = 2;

/// `T_d((1 + r) S / theta_cut - r)` with `r = cos(pi / 2d)`.
pub(super) struct Filter<'a> {
    factor: &'a Cholesky<'a>,
    /// The shift, negative.
    sigma: f64,
    /// `(1 + r) / theta_cut`
    slope: f64,
    /// `r`
    offset: f64,
}

impl<'a> Filter<'a> {
    /// The filter that amplifies eigenvalues below `cut`, for the factor of `D W D - sigma`.
    pub(super) fn new(factor: &'a Cholesky<'a>, sigma: f64, cut: f64) -> Self {
        let offset = (FRAC_PI_2 / f64::from(DEGREE)).cos();
        Self { factor, sigma, slope: (1.0 + offset) * (cut - sigma), offset }
    }

    /// Solves needed to apply the filter to one vector.
    pub(super) const SOLVES: usize = DEGREE as usize;

    /// The filter applied to the columns of `panel`, by the three-term recurrence of the Chebyshev
    /// polynomials.
    pub(super) fn apply(&self, panel: &Panel) -> Panel {
        let mut before = panel.clone();
        let mut current = self.linear(panel);
        for _ in 1..DEGREE {
            let mut after = self.linear(&current);
            zip_rows(&mut after, &before, |a, b| {
                for (a, b) in a.iter_mut().zip(b) {
                    *a = 2.0 * *a - b;
                }
            });
            before = std::mem::replace(&mut current, after);
        }
        current
    }

    /// `(slope S - offset)` applied to the columns of `panel`.
    fn linear(&self, panel: &Panel) -> Panel {
        let mut image = panel.clone();
        self.factor.solve(&mut image);
        zip_rows(&mut image, panel, |y, x| {
            for (y, x) in y.iter_mut().zip(x) {
                *y = self.slope * *y - self.offset * x;
            }
        });
        image
    }

    /// The `lambda` below the cut whose filtered value is `value > 1`.
    pub(super) fn eigenvalue(&self, value: f64) -> f64 {
        let x = (value.max(1.0).acosh() / f64::from(DEGREE)).cosh();
        self.slope / (x + self.offset) + self.sigma
    }
}
