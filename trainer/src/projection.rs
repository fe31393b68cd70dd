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

/// Projects the rows of `descriptors` `[m_source + m_target, q]` on the two bases: `[k_source + k_target, q]`, source first.
pub(crate) fn project<T: Real>(descriptors: &Tensor, bases: [WeightedBasis<T>; 2]) -> Result<Tensor> {
    let (rows, q) = descriptors.dims2()?;
    if rows != bases[0].points + bases[1].points {
        bail!("{rows} descriptors for {} and {} points", bases[0].points, bases[1].points);
    }
    if descriptors.device().is_cpu() {
        return descriptors.contiguous()?.apply_op1(Projection { bases, q });
    }
    composed(descriptors, bases)
}

/// The same from Candle's own ops, for devices other than the CPU.
fn composed<T: Real>(descriptors: &Tensor, bases: [WeightedBasis<T>; 2]) -> Result<Tensor> {
    let mut start = 0;
    let mut parts = Vec::with_capacity(2);
    for basis in bases {
        let matrix = Tensor::from_vec(basis.data, (basis.points, basis.k), descriptors.device())?;
        parts.push(matrix.t()?.matmul(&descriptors.narrow(0, start, basis.points)?)?);
        start += basis.points;
    }
    Tensor::cat(&parts, 0)
}

struct Projection<T> {
    bases: [WeightedBasis<T>; 2],
    q: usize,
}

impl<T: Real> CustomOp1 for Projection<T> {
    fn name(&self) -> &'static str {
        "spectral-projection"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let data: &[T] = contiguous(storage, layout)?;
        let [source, target] = &self.bases;
        let mut out = vec![T::zero(); (source.k + target.k) * self.q];
        let (data_source, data_target) = data.split_at(source.points * self.q);
        let (out_source, out_target) = out.split_at_mut(source.k * self.q);
        for (basis, data, out) in [(source, data_source, out_source), (target, data_target, out_target)] {
            let data = MatrixView::new(data, basis.points, self.q);
            matmul_split(out, basis.view().t(), data, PIECES);
        }
        Ok((T::to_cpu_storage_owned(out), Shape::from((source.k + target.k, self.q))))
    }

    fn bwd(&self, descriptors: &Tensor, _out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let [source, target] = &self.bases;
        let mut out = vec![T::zero(); (source.points + target.points) * self.q];
        let (out_source, out_target) = out.split_at_mut(source.points * self.q);
        with_slice(&grad.contiguous()?, |grad: &[T]| {
            let (grad_source, grad_target) = grad.split_at(source.k * self.q);
            for (basis, grad, out) in [(source, grad_source, out_source), (target, grad_target, out_target)] {
                par_matmul(out, basis.view(), MatrixView::new(grad, basis.k, self.q));
            }
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
        let (points, k, q) = ([7, 6], [3, 2], 4);
        let values = |seed, len| random(seed, len).iter().map(|&value| value as f32).collect::<Vec<_>>();
        let basis = [values(1, points[0] * k[0]), values(2, points[1] * k[1])];
        let mass = [values(3, points[0]), values(4, points[1])];
        let weighted = || [0, 1].map(|shape| WeightedBasis::<f64>::new(&basis[shape], &mass[shape]));
        let rows = random(5, (points[0] + points[1]) * q);
        let descriptors = Tensor::from_slice(&rows, (points[0] + points[1], q), &Device::Cpu).unwrap();

        let mut expected = Vec::new();
        for (shape, first) in [(0, 0), (1, points[0])] {
            let entry = |l: usize, c: usize| {
                let weight = |i: usize| f64::from(basis[shape][i * k[shape] + l] * mass[shape][i]);
                (0..points[shape]).map(|i| weight(i) * rows[(first + i) * q + c]).sum::<f64>()
            };
            expected
                .extend((0..k[shape]).flat_map(|l| (0..q).map(move |c| (l, c))).map(|(l, c)| entry(l, c)));
        }
        for projected in [project(&descriptors, weighted()), composed(&descriptors, weighted())] {
            let projected: Vec<f64> = projected.unwrap().flatten_all().unwrap().to_vec1().unwrap();
            assert!(projected.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-13));
        }
        check_gradient(&descriptors, |x| project(x, weighted())?.sqr()?.sum_all(), 1e-8);
    }
}
