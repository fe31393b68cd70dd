//! DiffusionNet (Sharp, Attaiki, Crane and Ovsjanikov 2022, "DiffusionNet: Discretization agnostic learning on
//! surfaces"): forward and backward on plain slices.
//!
//! The network maps functions on a surface, `[n, inputs]`, to descriptors, `[n, outputs]`: a linear layer, `blocks`
//! residual blocks of `width` channels, a linear layer. A block spreads each channel by heat diffusion of a learned
//! time, which the first `k` eigenpairs of the Laplacian give, and sees directions through the gradients of what it
//! spread. With `E` `[n, k]`, `A` and `lambda` the eigenvectors, vertex areas and eigenvalues at unit area, and
//! `G_x`, `G_y` `[n, k]` the gradients of the eigenvectors in a tangent frame at each vertex
//! ([`EigenGradients`](crate::spectral::EigenGradients)):
//!
//! ```text
//! c   = exp(-lambda t) E^T A x                       [k, width], a time t for each channel
//! d   = E c,  u = G_x c,  v = G_y c                  [n, width]
//! g   = tanh(u (u R - v J) + v (v R + u J))          [n, width], products of functions entry by entry
//! out = x + W3 relu(W2 relu(W1 [x, d, g]))           [n, width], with biases
//! ```
//!
//! Turning a tangent frame changes nothing; mirroring the shape changes the sign of `J`'s part, which is how the
//! network tells left from right. All gradients lie in the span of the eigenvectors, so that everything is a dense
//! product.
//!
//! Parameters are one flat slice in the order of [`Architecture::parameters`], weights `[in, out]`. Shapes may differ
//! in `n`. Rows are worked on in chunks of a fixed size, so that results do not depend on the number of threads.

mod backward;
mod block;
mod forward;
#[cfg(test)]
mod tests;

use crate::numeric::Real;
use serde::{Deserialize, Serialize};

pub use backward::backward;
pub use forward::{Activations, forward};

/// Rows worked on together: what a chunk needs stays in the cache.
const CHUNK: usize = 256;
/// Sums over all vertices are taken in so many parts, which are added in order.
const PIECES: usize = 4;
/// Shorter diffusion times count as this.
pub const MIN_TIME: f64 = 1e-8;
/// A lower `-lambda t` counts as this. What it leaves of a frequency, `4e-18`, is nothing; less would become
/// subnormal in single precision, with which processors take several times as long.
pub const LEAST_EXPONENT: f64 = -40.0;

/// The sizes of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Architecture {
    /// Input functions.
    pub inputs: usize,
    /// Residual blocks.
    pub blocks: usize,
    /// Channels of a block.
    pub width: usize,
    /// Descriptors.
    pub outputs: usize,
}

/// A named part of a flat parameter vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// For instance `blocks.0.mlp1.weight`.
    pub name: String,
    /// `[in, out]` for weights, `[width]` for others.
    pub shape: Vec<usize>,
    /// Index of the first element in the flat vector.
    pub offset: usize,
}

impl Parameter {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Architecture {
    /// Names, shapes and places of the parameters: `input`, then of each block `time`, `gradient.real` (`R`),
    /// `gradient.imaginary` (`J`), `mlp1` to `mlp3`, then `output`; linear layers have a `weight` and a `bias`.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut list = ParameterList::default();
        let width = self.width;
        list.linear("input", self.inputs, width);
        for block in 0..self.blocks {
            let name = |part: &str| format!("blocks.{block}.{part}");
            list.add(name("time"), vec![width]);
            list.add(name("gradient.real"), vec![width, width]);
            list.add(name("gradient.imaginary"), vec![width, width]);
            list.linear(&name("mlp1"), 3 * width, width);
            list.linear(&name("mlp2"), width, width);
            list.linear(&name("mlp3"), width, width);
        }
        list.linear("output", width, self.outputs);
        list.parameters
    }

    /// Length of the flat parameter vector.
    pub fn n_parameters(&self) -> usize {
        let linear = |inputs: usize, outputs: usize| inputs * outputs + outputs;
        linear(self.inputs, self.width)
            + self.blocks * block::len(self.width)
            + linear(self.width, self.outputs)
    }
}

#[derive(Default)]
struct ParameterList {
    parameters: Vec<Parameter>,
    offset: usize,
}

impl ParameterList {
    fn add(&mut self, name: String, shape: Vec<usize>) {
        let parameter = Parameter { name, shape, offset: self.offset };
        self.offset += parameter.len();
        self.parameters.push(parameter);
    }

    fn linear(&mut self, name: &str, inputs: usize, outputs: usize) {
        self.add(format!("{name}.weight"), vec![inputs, outputs]);
        self.add(format!("{name}.bias"), vec![outputs]);
    }
}

/// What the network needs of a surface besides its input: operators at unit area.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Operators<T> {
    /// Vertex areas, `[n]`.
    pub mass: Vec<T>,
    /// Eigenvalues, `[k]`.
    pub eigenvalues: Vec<T>,
    /// Eigenvectors, `[n, k]`, row-major.
    pub eigenvectors: Vec<T>,
    /// Gradients of the eigenvectors along the first axis of each vertex's tangent frame, `[n, k]`.
    pub gradients_x: Vec<T>,
    /// Along the second axis, `[n, k]`.
    pub gradients_y: Vec<T>,
}

impl<T: Real> Operators<T> {
    /// Number of vertices `n`.
    pub fn n(&self) -> usize {
        self.mass.len()
    }

    /// Number of eigenpairs `k`.
    pub fn k(&self) -> usize {
        self.eigenvalues.len()
    }

    /// The same in another precision.
    pub fn cast<U: Real>(&self) -> Operators<U> {
        let cast = |values: &[T]| values.iter().map(|x| U::from_double(x.to_double())).collect();
        Operators {
            mass: cast(&self.mass),
            eigenvalues: cast(&self.eigenvalues),
            eigenvectors: cast(&self.eigenvectors),
            gradients_x: cast(&self.gradients_x),
            gradients_y: cast(&self.gradients_y),
        }
    }

    /// Says what does not fit together.
    fn check(&self) -> Result<(), String> {
        let (n, k) = (self.n(), self.k());
        let arrays = [
            ("eigenvectors", &self.eigenvectors),
            ("gradients_x", &self.gradients_x),
            ("gradients_y", &self.gradients_y),
        ];
        match arrays.into_iter().find(|(_, array)| array.len() != n * k) {
            Some((name, array)) => {
                Err(format!("{name} has {} entries, expected [{n}, {k}], {}", array.len(), n * k))
            }
            None => Ok(()),
        }
    }
}

/// Says what does not fit the architecture.
fn check<T: Real>(
    architecture: &Architecture,
    parameters: &[T],
    input: &[T],
    operators: &Operators<T>,
) -> Result<(), String> {
    operators.check()?;
    let expected = architecture.n_parameters();
    if parameters.len() != expected {
        return Err(format!("{} parameters, expected {expected}", parameters.len()));
    }
    let (n, inputs) = (operators.n(), architecture.inputs);
    if input.len() != n * inputs {
        return Err(format!(
            "the input has {} entries, expected [{n}, {inputs}], {}",
            input.len(),
            n * inputs
        ));
    }
    Ok(())
}

/// First and last row of each chunk.
fn chunks(n: usize) -> Vec<std::ops::Range<usize>> {
    (0..n).step_by(CHUNK).map(|start| start..(start + CHUNK).min(n)).collect()
}

/// Chunks of each piece.
fn pieces(n_chunks: usize) -> Vec<std::ops::Range<usize>> {
    (0..PIECES).map(|piece| n_chunks * piece / PIECES..n_chunks * (piece + 1) / PIECES).collect()
}

/// The sum of equally long parts, added in order.
fn sum_in_order<T: Real>(parts: Vec<Vec<T>>) -> Vec<T> {
    let mut parts = parts.into_iter();
    let mut sum = parts.next().unwrap_or_default();
    for part in parts {
        crate::numeric::vectorized(|| sum.iter_mut().zip(&part).for_each(|(sum, &x)| *sum += x));
    }
    sum
}
