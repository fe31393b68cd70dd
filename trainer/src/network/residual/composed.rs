//! The network from Candle's own ops: for devices other than the CPU, and to check the fused op against.

use super::{Activation, BatchMoments, ResidualOptions};
use candle_core::{D, Result, Tensor};

/// What a forward pass gives: descriptors of all rows `[n, width]`, and of each block the moments of its two
/// normalisations over the first group, as tensors `[1, width]`.
pub(super) struct Composed {
    /// `[n, width]`.
    pub(super) descriptors: Tensor,
    /// (mean, variance) of each normalisation.
    pub(super) moments: Vec<[(Tensor, Tensor); 2]>,
}

/// Runs the network with `parameters` (flat) over `input` `[n, width]`, whose rows form `groups` unless `fixed` gives
/// the moments.
pub(super) fn forward(
    options: &ResidualOptions,
    parameters: &Tensor,
    input: &Tensor,
    groups: &[usize],
    fixed: Option<&[[BatchMoments; 2]]>,
) -> Result<Composed> {
    let width = options.width;
    let half_len = width * width + 2 * width;
    let mut out = input.clone();
    let mut moments = Vec::new();
    for block in 0..options.blocks {
        let half = |half: usize, x: &Tensor| -> Result<(Tensor, (Tensor, Tensor))> {
            let flat = parameters.narrow(0, (2 * block + half) * half_len, half_len)?;
            let weight = flat.narrow(0, 0, width * width)?.reshape((width, width))?;
            let scale = flat.narrow(0, width * width, width)?;
            let shift = flat.narrow(0, width * width + width, width)?;
            let fixed = match fixed {
                Some(fixed) => Some(fixed[block][half].to_tensors(x)?),
                None => None,
            };
            let (normalized, moments) = normalize(&x.matmul(&weight)?, groups, options.epsilon, fixed)?;
            Ok((normalized.broadcast_mul(&scale)?.broadcast_add(&shift)?, moments))
        };
        let (hidden, moments1) = half(0, &out)?;
        let (residual, moments2) = half(1, &activate(&hidden, options.activation)?)?;
        out = activate(&(&out + residual)?, options.activation)?;
        moments.push([moments1, moments2]);
    }
    Ok(Composed { descriptors: out, moments })
}

fn activate(x: &Tensor, activation: Activation) -> Result<Tensor> {
    match activation {
        Activation::Elu => x.elu(1.0),
        Activation::Relu => x.relu(),
    }
}

/// Normalises each group of rows; returns the moments of the first group.
fn normalize(
    x: &Tensor,
    groups: &[usize],
    epsilon: f64,
    fixed: Option<(Tensor, Tensor)>,
) -> Result<(Tensor, (Tensor, Tensor))> {
    let one = |rows: &Tensor, (mean, variance): &(Tensor, Tensor)| {
        rows.broadcast_sub(mean)?.broadcast_div(&(variance + epsilon)?.sqrt()?)
    };
    if let Some(fixed) = fixed {
        return Ok((one(x, &fixed)?, fixed));
    }
    let mut start = 0;
    let mut parts = Vec::with_capacity(groups.len());
    let mut first = None;
    for &rows in groups {
        let group = x.narrow(D::Minus2, start, rows)?;
        let mean = group.mean_keepdim(0)?;
        let moments = (mean.clone(), group.broadcast_sub(&mean)?.sqr()?.mean_keepdim(0)?);
        parts.push(one(&group, &moments)?);
        first.get_or_insert(moments);
        start += rows;
    }
    let Some(moments) = first else { candle_core::bail!("the network needs at least one shape") };
    Ok((Tensor::cat(&parts, 0)?, moments))
}
