//! From descriptors on sampled points to their coefficients in the eigenbasis: `F^ = Phi^T A F` over the samples.

use crate::device::{contiguous, with_slice};
use crate::numeric::{MatrixView, Real, matmul_split, par_matmul};
use candle_core::{CpuStorage, CustomOp1, Layout, Result, Shape, Tensor, bail};

/// Pieces of the long products; fixed, so that results do not depend on the threads.
const PIECES: usize = 4;

/// The eigenbasis of a shape on its sampled points, weighted by the points' areas: `A Phi` `[m, k]`, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WeightedBasis<T> {
    /// Number of points.
    pub(crate) points: usize,
    /// Number of eigenfunctions.
    pub(crate) k: usize,
    /// `[m, k]`.
    pub(crate) data: Vec<T>,
}

impl<T: Real> WeightedBasis<T> {
    /// Weights `basis` `[m, k]` by `mass` `[m]`.
    pub(crate) fn new(basis: &[f32], mass: &[f32]) -> Self {
        let (points, k) = (mass.len(), basis.len() / mass.len().max(1));
        let rows = basis.chunks(k.max(1)).zip(mass);
        let data =
            rows.flat_map(|(row, &mass)| row.iter().map(move |&value| T::from_f64((value * mass).into())));
        Self { points, k, data: data.collect() }
    }

    fn view(&self) -> MatrixView<'_, T> {
        MatrixView::new(&self.data, self.points, self.k)
    }
}

/// Projects the rows of `descriptors` `[m, q]` on the basis: `[k, q]`.
pub(crate) fn project<T: Real>(descriptors: &Tensor, basis: WeightedBasis<T>) -> Result<Tensor> {
    let (rows, q) = descriptors.dims2()?;
    if rows != basis.points {
        bail!("{rows} descriptors for {} points", basis.points);
    }
    if descriptors.device().is_cpu() {
        return descriptors.contiguous()?.apply_op1(Projection { basis, q });
    }
    composed(descriptors, basis)
}

/// The same from Candle's own ops, for devices other than the CPU.
fn composed<T: Real>(descriptors: &Tensor, basis: WeightedBasis<T>) -> Result<Tensor> {
    Tensor::from_vec(basis.data, (basis.points, basis.k), descriptors.device())?.t()?.matmul(descriptors)
}

struct Projection<T> {
    basis: WeightedBasis<T>,
    q: usize,
}

impl<T: Real> CustomOp1 for Projection<T> {
    fn name(&self) -> &'static str {
        "spectral-projection"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let data: &[T] = contiguous(storage, layout)?;
        let mut out = vec![T::ZERO; self.basis.k * self.q];
        matmul_split(
            &mut out,
            self.basis.view().t(),
            MatrixView::new(data, self.basis.points, self.q),
            PIECES,
        );
        Ok((T::to_cpu_storage_owned(out), Shape::from((self.basis.k, self.q))))
    }

    fn bwd(&self, descriptors: &Tensor, _out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let mut out = vec![T::ZERO; self.basis.points * self.q];
        with_slice(&grad.contiguous()?, |grad: &[T]| {
            par_matmul(&mut out, self.basis.view(), MatrixView::new(grad, self.basis.k, self.q));
            Ok(())
        })?;
        Ok(Some(Tensor::from_vec(out, descriptors.shape(), descriptors.device())?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_gradient, random};
    use candle_core::Device;

    #[test]
    fn projection_equals_its_definition_and_its_gradient_the_central_differences() {
        let (points, k, q) = (7, 3, 4);
        let values = |seed, len| random(seed, len).iter().map(|&value| value as f32).collect::<Vec<_>>();
        let (basis, mass) = (values(1, points * k), values(3, points));
        let weighted = || WeightedBasis::<f64>::new(&basis, &mass);
        let rows = random(5, points * q);
        let descriptors = Tensor::from_slice(&rows, (points, q), &Device::Cpu).unwrap();
        let entry = |l: usize, c: usize| {
            let weight = |i: usize| f64::from(basis[i * k + l] * mass[i]);
            (0..points).map(|i| weight(i) * rows[i * q + c]).sum::<f64>()
        };
        let expected: Vec<f64> = (0..k * q).map(|at| entry(at / q, at % q)).collect();
        for projected in [project(&descriptors, weighted()), composed(&descriptors, weighted())] {
            let projected: Vec<f64> = projected.unwrap().flatten_all().unwrap().to_vec1().unwrap();
            assert!(projected.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-13));
        }
        check_gradient(&descriptors, |x| project(x, weighted())?.sqr()?.sum_all(), 1e-8);
    }
}
