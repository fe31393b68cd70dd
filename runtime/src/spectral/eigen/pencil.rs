//! The eigenproblem in a unit of its own, so that the unit of the mesh does not matter.

use super::EigenError;
use super::components::Components;
use super::factor::Upper;
use crate::spectral::{Laplacian, SparseMatrix};
use faer::sparse::SymbolicSparseColMat;
use std::f64::consts::PI;

/// A mesh of less area has numbers too small to compute with.
const LEAST_AREA: f64 = 1e-290;

/// `W phi = lambda A phi` scaled to area 1, and as the standard problem of `D W D`, `D = A^-1/2`.
pub(super) struct Pencil<'a> {
    pub(super) stiffness: &'a SparseMatrix,
    /// Area of the mesh in its own unit.
    pub(super) area: f64,
    /// The diagonal of `D`, for area 1, `[n]`.
    pub(super) scale: Vec<f64>,
    pub(super) components: Components,
}

impl<'a> Pencil<'a> {
    pub(super) fn new(laplacian: &'a Laplacian) -> Result<Self, EigenError> {
        let Laplacian { stiffness, mass } = laplacian;
        if stiffness.n() != mass.len() {
            return Err(EigenError::SizeMismatch { stiffness: stiffness.n(), mass: mass.len() });
        }
        let area = mass.iter().sum::<f64>();
        if let Some(vertex) = mass.iter().position(|&a| !(a > 0.0 && a.is_finite())) {
            return Err(EigenError::InvalidMass { vertex, mass: mass[vertex] });
        }
        let scale: Vec<f64> = mass.iter().map(|a| (area / a).sqrt()).collect();
        let scales_well =
            |(i, s): (usize, &f64)| stiffness.row(i).all(|(j, w)| (s * scale[j] * w).is_finite());
        if !(area > LEAST_AREA && scale.iter().enumerate().all(scales_well)) {
            return Err(EigenError::NoArea { area });
        }
        let components = Components::new(stiffness, mass);
        Ok(Self { stiffness, area, scale, components })
    }

    /// Number of vertices.
    pub(super) fn n(&self) -> usize {
        self.scale.len()
    }

    /// Estimate of the `k`-th eigenvalue by Weyl's law, for area 1.
    pub(super) fn weyl_estimate(k: usize) -> f64 {
        4.0 * PI * k as f64
    }

    /// The upper triangle of `D W D - shift`.
    pub(super) fn shifted(&self, shift: f64) -> Upper {
        let n = self.n();
        let mut offsets = Vec::with_capacity(n + 1);
        let mut indices = Vec::with_capacity(self.stiffness.indices().len() / 2 + n);
        let mut values = Vec::with_capacity(indices.capacity());
        offsets.push(0_u32);
        for i in 0..n {
            for (j, weight) in self.stiffness.row(i).take_while(|&(j, _)| j <= i) {
                let diagonal = if i == j { shift } else { 0.0 };
                indices.push(j as u32);
                values.push(self.scale[i] * self.scale[j] * weight - diagonal);
            }
            offsets.push(indices.len() as u32);
        }
        Upper::new(SymbolicSparseColMat::new_checked(n, n, offsets, None, indices), values)
    }
}
