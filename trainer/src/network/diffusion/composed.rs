//! The network from Candle's own ops: for devices other than the CPU, and to check the fused op against.

use crate::network::NetworkInput;
use candle_core::{D, Result, Tensor};
use fmnet::diffusion_net::{Architecture, LEAST_EXPONENT, MIN_TIME};

/// Descriptors `[n, outputs]` of a shape, with `parameters` flat, `[p]`, of the type that the work is done in.
pub(super) fn forward(
    architecture: &Architecture,
    parameters: &Tensor,
    shape: &NetworkInput,
) -> Result<Tensor> {
    let tensor = |values: &[f32], shape: (usize, usize)| {
        Tensor::from_slice(values, shape, parameters.device())?.to_dtype(parameters.dtype())
    };
    let operators = &shape.operators;
    let (n, k) = (operators.n(), operators.k());
    let eigenvectors = tensor(&operators.eigenvectors, (n, k))?;
    let gradients = [tensor(&operators.gradients_x, (n, k))?, tensor(&operators.gradients_y, (n, k))?];
    let mass = tensor(&operators.mass, (n, 1))?;
    let eigenvalues = tensor(&operators.eigenvalues, (k, 1))?;
    let views = Views { architecture, parameters };
    let mut x = views.linear("input", &tensor(shape.features.data(), (n, architecture.inputs))?)?;
    for block in 0..architecture.blocks {
        let part = |name: &str| format!("blocks.{block}.{name}");
        let time = views.get(&part("time"))?.unsqueeze(0)?.maximum(MIN_TIME)?;
        let decay = (eigenvalues.matmul(&time)? * -1.0)?.maximum(LEAST_EXPONENT)?.exp()?;
        let projected = eigenvectors.t()?.matmul(&x.broadcast_mul(&mass)?)?;
        let coefficients = (projected * decay)?;
        let diffused = eigenvectors.matmul(&coefficients)?;
        let (u, v) = (gradients[0].matmul(&coefficients)?, gradients[1].matmul(&coefficients)?);
        let (real, imaginary) = (views.get(&part("gradient.real"))?, views.get(&part("gradient.imaginary"))?);
        let of_u = (u.matmul(&real)? - v.matmul(&imaginary)?)?;
        let of_v = (v.matmul(&real)? + u.matmul(&imaginary)?)?;
        let directions = ((u * of_u)? + (v * of_v)?)?.tanh()?;
        let mut hidden = Tensor::cat(&[&x, &diffused, &directions], D::Minus1)?;
        for layer in ["mlp1", "mlp2"] {
            hidden = views.linear(&part(layer), &hidden)?.relu()?;
        }
        x = (x + views.linear(&part("mlp3"), &hidden)?)?;
    }
    views.linear("output", &x)
}

struct Views<'a> {
    architecture: &'a Architecture,
    parameters: &'a Tensor,
}

impl Views<'_> {
    fn get(&self, name: &str) -> Result<Tensor> {
        let Some(parameter) = self.architecture.parameters().into_iter().find(|p| p.name == name) else {
            candle_core::bail!("the network has no parameter {name}");
        };
        self.parameters.narrow(0, parameter.offset, parameter.len())?.reshape(parameter.shape)
    }

    fn linear(&self, name: &str, x: &Tensor) -> Result<Tensor> {
        let weight = self.get(&format!("{name}.weight"))?;
        x.matmul(&weight)?.broadcast_add(&self.get(&format!("{name}.bias"))?)
    }
}
