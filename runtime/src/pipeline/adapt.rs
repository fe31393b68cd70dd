//! Adaptation of a network to a pair: steps of gradient descent on losses that need no ground truth.
//!
//! What a network gets wrong of a pair shows: its functional maps there and back do not undo each other, are not
//! orthogonal, and differ from the ones of the point maps that the descriptors give (Cao, Roetzer and Bernard 2023).
//! A few steps on that mend much. All is native: [`crate::diffusion_net`] forward and backward, [`FmapSolution`] for
//! the functional maps, Adam.

use super::pair::Pair;
use crate::Matrix;
use crate::diffusion_net::{Activations, backward, forward};
use crate::error::Error;
use crate::fmap::{
    FmapError, FmapSolution, FmapSolver, multiply, pseudo_inverse, resolvent_mask, scale_free_eigenvalues,
};
use crate::network::{NativeInput, NativeNetwork, NetworkError};
use crate::spectral::Eigenbasis;

type F64 = Matrix;

/// Rows of each shape that the soft assignment is made between.
const SAMPLES: usize = 1500;
/// Temperature of the soft assignment.
const TEMPERATURE: f64 = 0.07;
/// Adam (Kingma and Ba 2015), as in training.
const LEARNING_RATE: f64 = 1e-3;
const BETAS: [f64; 2] = [0.9, 0.999];
const EPSILON: f64 = 1e-8;
/// Gradients of a larger norm are scaled down to it.
const CLIP: f64 = 5.0;

/// The descriptors of source and target, `[n, d]` each, of the network after `steps` steps on the pair.
///
/// # Errors
/// If an input cannot be computed, or a step gives numbers that are not finite.
pub(super) fn adapted(pair: &Pair, network: &NativeNetwork, steps: usize) -> Result<[Matrix<f32>; 2], Error> {
    let descriptor = pair.matcher.network_descriptor().expect("a native network is that of a model");
    let mut inputs = Vec::with_capacity(2);
    for described in [pair.source, pair.target] {
        let arrays = descriptor.inputs(&described.shape, pair.context)?;
        let arrays: Vec<&[f32]> = arrays.iter().map(|(_, values)| values.as_slice()).collect();
        inputs.push(network.input(described.shape.n(), &arrays));
    }
    let [source, target] = pair.bases(pair.matcher.k())?;
    let sides = [Fixed::new(&source)?, Fixed::new(&target)?];
    let mut adam = Adam::new(network.parameters().to_vec());
    for _ in 0..steps {
        let runs = [
            run(pair, network, &adam.parameters, &inputs[0])?,
            run(pair, network, &adam.parameters, &inputs[1])?,
        ];
        let gradients = gradients(&sides, [&runs[0].0, &runs[1].0])?;
        let mut total = vec![0.0f32; adam.parameters.len()];
        for ((input, (_, activations)), gradient) in inputs.iter().zip(&runs).zip(&gradients) {
            let gradient: Vec<f32> = gradient.data().iter().map(|&x| x as f32).collect();
            let part = backward(
                network.architecture(),
                &adam.parameters,
                &input.features,
                &input.operators,
                activations,
                &gradient,
            );
            let part = part.map_err(|reason| failed(pair, reason))?;
            total.iter_mut().zip(part).for_each(|(sum, x)| *sum += x);
        }
        adam.step(&total);
    }
    let mut descriptors = Vec::with_capacity(2);
    for input in &inputs {
        descriptors.push(run(pair, network, &adam.parameters, input)?.0);
    }
    let [source, target]: [F64; 2] = descriptors.try_into().expect("two shapes");
    Ok([source.map(|x| x as f32), target.map(|x| x as f32)])
}

fn failed(pair: &Pair, reason: String) -> Error {
    let backend = crate::network::Backend::Native;
    Error::from(NetworkError::Backend { path: "adaptation".into(), backend, reason }).in_shape(pair.names)
}

fn run(
    pair: &Pair,
    network: &NativeNetwork,
    parameters: &[f32],
    input: &NativeInput,
) -> Result<(F64, Activations<f32>), Error> {
    let NativeInput { features, operators } = input;
    let (values, kept) = forward(network.architecture(), parameters, features, operators, true)
        .map_err(|reason| failed(pair, reason))?;
    if values.iter().any(|x| !x.is_finite()) {
        return Err(failed(pair, "a step gave numbers that are not finite; use fewer steps".into()));
    }
    let values = values.into_iter().map(f64::from).collect();
    let outputs = network.architecture().outputs;
    let descriptors = Matrix::from_vec(operators.n(), outputs, values);
    Ok((descriptors, kept.expect("activations were asked for")))
}

/// What the losses need of a shape, whatever the network.
struct Fixed {
    /// `Phi^T A`, `[k, n]`.
    analysis: F64,
    eigenvalues: Vec<f64>,
    /// The rows of the soft assignment.
    rows: Vec<u32>,
    /// Eigenfunctions there, `[m, k]`, and their pseudo-inverse, `[k, m]`.
    functions: F64,
    inverse: F64,
}

impl Fixed {
    fn new(basis: &Eigenbasis) -> Result<Self, FmapError> {
        let n = basis.n();
        let m = SAMPLES.min(n);
        // Neighbours in a file are often neighbours on the surface: even steps spread well enough.
        let rows: Vec<u32> = (0..m).map(|i| (i * n / m) as u32).collect();
        let functions = basis.eigenvectors.select_rows(&rows);
        let inverse = pseudo_inverse(&functions)?;
        let analysis = Matrix::from_fn(basis.k(), n, |i, x| basis.eigenvectors[(x, i)] * basis.mass[x]);
        let eigenvalues = scale_free_eigenvalues(basis);
        Ok(Self { analysis, eigenvalues, rows, functions, inverse })
    }
}

/// The gradients of the sum of the losses by the descriptors of both shapes, `[n, d]` each.
fn gradients(sides: &[Fixed; 2], descriptors: [&F64; 2]) -> Result<[F64; 2], FmapError> {
    let [f, g]: [F64; 2] = std::array::from_fn(|i| times(&sides[i].analysis, descriptors[i]));
    let weight = FmapSolver::DEFAULT_MASK_WEIGHT;
    let mask = resolvent_mask(&sides[0].eigenvalues, &sides[1].eigenvalues);
    let forth = FmapSolution::regularized(f.clone(), g.clone(), &mask, weight)?;
    let back = FmapSolution::regularized(g, f, &mask.transposed(), weight)?;
    let [mut d_forth, mut d_back] = map_gradients(forth.map(), back.map());
    let mut d_descriptors = descriptors.map(|d| Matrix::zeros(d.rows(), d.cols()));
    let assignment = Assignment::new(sides, descriptors);
    // C12 takes the source's functions to the target: rows of the target are assigned to rows of the source.
    let (of_map, [d_target, d_source]) = assignment.coupling(forth.map(), &sides[1], &sides[0], false);
    add(&mut d_forth, &of_map);
    assignment.spread(sides, 1, &d_target, &mut d_descriptors);
    assignment.spread(sides, 0, &d_source, &mut d_descriptors);
    let (of_map, [d_source, d_target]) = assignment.coupling(back.map(), &sides[0], &sides[1], true);
    add(&mut d_back, &of_map);
    assignment.spread(sides, 0, &d_source, &mut d_descriptors);
    assignment.spread(sides, 1, &d_target, &mut d_descriptors);
    let (mut d_f, mut d_g) = forth.backward(&d_forth);
    let (more_g, more_f) = back.backward(&d_back);
    add(&mut d_f, &more_f);
    add(&mut d_g, &more_g);
    for (i, d_hat) in [d_f, d_g].iter().enumerate() {
        let through = multiply(sides[i].analysis.as_faer().transpose(), d_hat.as_faer());
        add(&mut d_descriptors[i], &through);
    }
    Ok(d_descriptors)
}

/// The gradients of `|C12 C21 - I|^2 + |C21 C12 - I|^2 + |C12^T C12 - I|^2 + |C21^T C21 - I|^2` by the two maps.
fn map_gradients(forth: &F64, back: &F64) -> [F64; 2] {
    let off = |mut product: F64| {
        (0..product.rows().min(product.cols())).for_each(|i| product[(i, i)] -= 1.0);
        product
    };
    let there_and_back = off(times(forth, back));
    let back_and_there = off(times(back, forth));
    let transposed = |a: &F64, b: &F64| multiply(a.as_faer().transpose(), b.as_faer());
    let by_transposed = |a: &F64, b: &F64| multiply(a.as_faer(), b.as_faer().transpose());
    let of = |map: &F64, other: &F64, left: &F64, right: &F64| {
        let mut gradient = by_transposed(left, other);
        add(&mut gradient, &transposed(other, right));
        let mut orthogonality = times(map, &off(transposed(map, map)));
        scale(&mut orthogonality, 2.0);
        add(&mut gradient, &orthogonality);
        scale(&mut gradient, 2.0);
        gradient
    };
    [of(forth, back, &there_and_back, &back_and_there), of(back, forth, &back_and_there, &there_and_back)]
}

/// Cosines between sampled descriptors of both shapes.
struct Assignment {
    /// Descriptors of length 1 at the rows of source and target, `[m, d]`, and the lengths that they had.
    unit: [F64; 2],
    lengths: [Vec<f64>; 2],
    /// Cosines, `[m_target, m_source]`.
    cosines: F64,
}

impl Assignment {
    fn new(sides: &[Fixed; 2], descriptors: [&F64; 2]) -> Self {
        let mut lengths = [Vec::new(), Vec::new()];
        let unit: [F64; 2] = std::array::from_fn(|i| {
            let mut rows = descriptors[i].select_rows(&sides[i].rows);
            for r in 0..rows.rows() {
                let length = (rows.row(r).iter().map(|x| x * x).sum::<f64>() + 1e-12).sqrt();
                rows.row_mut(r).iter_mut().for_each(|x| *x /= length);
                lengths[i].push(length);
            }
            rows
        });
        let cosines = multiply(unit[1].as_faer(), unit[0].as_faer().transpose());
        Self { unit, lengths, cosines }
    }

    /// `|C - Psi^+ P Phi|^2` for a map from the functions of `from` to those of `to`, where row `y` of `P` is the
    /// softmax of the cosines of a row of `to` with those of `from`: its gradient by `C`, and those by the unit
    /// descriptors of `to` and `from`.
    ///
    /// `transposed`: `to` is the source.
    fn coupling(&self, map: &F64, to: &Fixed, from: &Fixed, transposed: bool) -> (F64, [F64; 2]) {
        let mut weights = if transposed { self.cosines.transposed() } else { self.cosines.clone() };
        for y in 0..weights.rows() {
            let row = weights.row_mut(y);
            row.iter_mut().for_each(|w| *w = ((*w - 1.0) / TEMPERATURE).exp());
            let sum: f64 = row.iter().sum();
            row.iter_mut().for_each(|w| *w /= sum);
        }
        let transferred = times(&weights, &from.functions);
        let mut residual = times(&to.inverse, &transferred);
        residual.data_mut().iter_mut().zip(map.data()).for_each(|(r, c)| *r = 2.0 * (c - *r));
        let mut d_transferred = multiply(to.inverse.as_faer().transpose(), residual.as_faer());
        scale(&mut d_transferred, -1.0);
        let mut d_weights = multiply(d_transferred.as_faer(), from.functions.as_faer().transpose());
        // Through the softmax.
        for y in 0..weights.rows() {
            let (p, d) = (weights.row(y), d_weights.row_mut(y));
            let mean: f64 = p.iter().zip(d.iter()).map(|(p, d)| p * d).sum();
            p.iter().zip(d).for_each(|(p, d)| *d = p * (*d - mean) / TEMPERATURE);
        }
        let (unit_to, unit_from) =
            if transposed { (&self.unit[0], &self.unit[1]) } else { (&self.unit[1], &self.unit[0]) };
        let d_to = times(&d_weights, unit_from);
        let d_from = multiply(d_weights.as_faer().transpose(), unit_to.as_faer());
        (residual, [d_to, d_from])
    }

    /// Adds the gradient by the unit descriptors of a side to that by its descriptors.
    fn spread(&self, sides: &[Fixed; 2], side: usize, d_unit: &F64, d_descriptors: &mut [F64; 2]) {
        for (r, &row) in sides[side].rows.iter().enumerate() {
            let (unit, d) = (self.unit[side].row(r), d_unit.row(r));
            let along: f64 = unit.iter().zip(d).map(|(u, d)| u * d).sum();
            let out = d_descriptors[side].row_mut(row as usize);
            for ((out, u), d) in out.iter_mut().zip(unit).zip(d) {
                *out += (d - along * u) / self.lengths[side][r];
            }
        }
    }
}

/// Adam on flat parameters.
struct Adam {
    parameters: Vec<f32>,
    first: Vec<f64>,
    second: Vec<f64>,
    steps: i32,
}

impl Adam {
    fn new(parameters: Vec<f32>) -> Self {
        let zeros = vec![0.0; parameters.len()];
        Self { parameters, first: zeros.clone(), second: zeros, steps: 0 }
    }

    fn step(&mut self, gradient: &[f32]) {
        self.steps += 1;
        let norm = gradient.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt();
        let shrink = if norm > CLIP { CLIP / norm } else { 1.0 };
        let unbiased = BETAS.map(|beta| 1.0 - beta.powi(self.steps));
        for (i, &gradient) in gradient.iter().enumerate() {
            let gradient = f64::from(gradient) * shrink;
            self.first[i] = BETAS[0] * self.first[i] + (1.0 - BETAS[0]) * gradient;
            self.second[i] = BETAS[1] * self.second[i] + (1.0 - BETAS[1]) * gradient * gradient;
            let step = self.first[i] / unbiased[0] / ((self.second[i] / unbiased[1]).sqrt() + EPSILON);
            self.parameters[i] -= (LEARNING_RATE * step) as f32;
        }
    }
}

fn times(a: &F64, b: &F64) -> F64 {
    multiply(a.as_faer(), b.as_faer())
}

fn add(sum: &mut F64, other: &F64) {
    sum.data_mut().iter_mut().zip(other.data()).for_each(|(a, b)| *a += b);
}

fn scale(matrix: &mut F64, factor: f64) {
    matrix.data_mut().iter_mut().for_each(|x| *x *= factor);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmap::test_basis::rectangle;

    fn fixed(nx: usize, ny: usize, k: usize) -> Fixed {
        let basis = rectangle(nx, ny, k);
        let rows: Vec<u32> = (0..basis.n() as u32).step_by(2).collect();
        let functions = basis.eigenvectors.select_rows(&rows);
        let inverse = pseudo_inverse(&functions).unwrap();
        let analysis =
            Matrix::from_fn(basis.k(), basis.n(), |i, x| basis.eigenvectors[(x, i)] * basis.mass[x]);
        let eigenvalues = scale_free_eigenvalues(&basis);
        Fixed { analysis, eigenvalues, rows, functions, inverse }
    }

    /// The sum of the losses, straight from their definitions.
    fn loss(sides: &[Fixed; 2], descriptors: [&F64; 2]) -> f64 {
        let [f, g]: [F64; 2] = std::array::from_fn(|i| times(&sides[i].analysis, descriptors[i]));
        let mask = resolvent_mask(&sides[0].eigenvalues, &sides[1].eigenvalues);
        let forth = FmapSolution::regularized(f.clone(), g.clone(), &mask, 0.1).unwrap().map().clone();
        let back = FmapSolution::regularized(g, f, &mask.transposed(), 0.1).unwrap().map().clone();
        let to_identity = |a: F64| {
            let entry = |i: usize, j: usize| (a[(i, j)] - f64::from(u8::from(i == j))).powi(2);
            (0..a.rows()).map(|i| (0..a.cols()).map(|j| entry(i, j)).sum::<f64>()).sum::<f64>()
        };
        let mut sum = to_identity(times(&forth, &back)) + to_identity(times(&back, &forth));
        for map in [&forth, &back] {
            sum += to_identity(times(&map.transposed(), map));
        }
        let cosine = |a: &[f64], b: &[f64]| {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            dot(a, b) / ((dot(a, a) + 1e-12) * (dot(b, b) + 1e-12)).sqrt()
        };
        for (map, to, from) in [(&forth, 1, 0), (&back, 0, 1)] {
            let mut soft = Matrix::from_fn(sides[to].rows.len(), sides[from].rows.len(), |y, x| {
                let (y, x) = (sides[to].rows[y] as usize, sides[from].rows[x] as usize);
                (cosine(descriptors[to].row(y), descriptors[from].row(x)) / TEMPERATURE).exp()
            });
            for y in 0..soft.rows() {
                let total: f64 = soft.row(y).iter().sum();
                soft.row_mut(y).iter_mut().for_each(|w| *w /= total);
            }
            let found = times(&sides[to].inverse, &times(&soft, &sides[from].functions));
            sum += map.data().iter().zip(found.data()).map(|(c, x)| (c - x).powi(2)).sum::<f64>();
        }
        sum
    }

    #[test]
    fn gradients_are_those_of_central_differences() {
        let sides = [fixed(7, 6, 5), fixed(6, 8, 5)];
        let wave = |n: usize, phase: f64| {
            Matrix::from_fn(n, 9, |i, j| ((i * 9 + j) as f64 * 1.3 + phase).sin() + 0.3 * (j as f64))
        };
        let descriptors = [wave(42, 0.0), wave(48, 0.7)];
        let found = gradients(&sides, [&descriptors[0], &descriptors[1]]).unwrap();
        for side in 0..2 {
            for entry in (0..descriptors[side].data().len()).step_by(23) {
                let at = |step: f64| {
                    let mut moved = descriptors.clone();
                    moved[side].data_mut()[entry] += step;
                    loss(&sides, [&moved[0], &moved[1]])
                };
                let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
                let gradient = found[side].data()[entry];
                assert!(
                    (gradient - expected).abs() < 1e-4 * (1.0 + expected.abs()),
                    "side {side}, entry {entry}: {gradient} instead of {expected}"
                );
            }
        }
    }

    #[test]
    fn adam_walks_downhill() {
        let mut adam = Adam::new(vec![3.0, -2.0]);
        for _ in 0..5000 {
            let gradient: Vec<f32> = adam.parameters.iter().map(|x| 2.0 * x).collect();
            adam.step(&gradient);
        }
        assert!(adam.parameters.iter().all(|x| x.abs() < 0.2));
    }
}
