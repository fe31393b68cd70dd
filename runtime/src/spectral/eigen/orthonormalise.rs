//! Orthonormal blocks: Cholesky QR, and Gram-Schmidt where a block is rank deficient.

use super::panel::{BLOCK, Panel, Square, TallMatrix, gram, multiply_right};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Least share of a vector that must remain after orthogonalisation for its direction to mean anything.
const RANK_TOLERANCE: f64 = 1e-10;
/// Share below which rounding left too much of the subspace in the vector, which is then orthogonalised
/// again.
const CANCELLATION: f64 = 1e-3;

/// Turns `panel = U`, already orthogonal to the first `len` columns of `space`, into an orthonormal `Q` with
/// `U = Q R`, and returns `R`.
///
/// `norms` are those of the columns before they were made orthogonal to the space. A column that all but
/// vanished is replaced by a random one, with zeros in its row of `R`: the span of `U` stays within that of
/// `Q`.
pub(super) fn orthonormalise(
    panel: &mut Panel,
    norms: &[f64; BLOCK],
    space: &TallMatrix,
    len: usize,
    random: &mut ChaCha8Rng,
) -> Square {
    let first = match cholesky_upper(&gram(panel), norms) {
        Some(r) => {
            multiply_right(panel, &invert_upper(&r));
            r
        }
        None => gram_schmidt(panel, norms, space, len, random),
    };
    if (0..BLOCK).any(|j| first[j][j] < CANCELLATION * norms[j]) {
        project_out(panel, space, len);
    }
    let second =
        cholesky_upper(&gram(panel), &[1.0; BLOCK]).expect("a block orthonormalised once has full rank");
    multiply_right(panel, &invert_upper(&second));
    multiply_upper(&second, &first)
}

/// Fills `panel` with random orthonormal columns, orthogonal to the first `len` columns of `space`.
pub(super) fn random_block(panel: &mut Panel, space: &TallMatrix, len: usize, random: &mut ChaCha8Rng) {
    panel.iter_mut().flatten().for_each(|x| *x = random.random_range(-1.0..1.0));
    let norms = column_norms(panel);
    project_out(panel, space, len);
    project_out(panel, space, len);
    orthonormalise(panel, &norms, space, len, random);
}

/// Euclidean norms of the columns.
pub(super) fn column_norms(panel: &Panel) -> [f64; BLOCK] {
    let products = gram(panel);
    std::array::from_fn(|j| products[j][j].sqrt())
}

fn project_out(panel: &mut Panel, space: &TallMatrix, len: usize) {
    let coefficients = space.inner(0..len, panel);
    space.subtract(0..len, &coefficients, panel);
}

/// Upper `R` with `G = R^T R`; `None` where a column is numerically dependent on those before it or all but
/// vanished.
fn cholesky_upper(g: &Square, norms: &[f64; BLOCK]) -> Option<Square> {
    let mut r = [[0.0; BLOCK]; BLOCK];
    for j in 0..BLOCK {
        for i in 0..j {
            let sum: f64 = (0..i).map(|l| r[l][i] * r[l][j]).sum();
            r[i][j] = (g[i][j] - sum) / r[i][i];
        }
        let pivot = g[j][j] - (0..j).map(|l| r[l][j].powi(2)).sum::<f64>();
        // The square root halves the digits: below this the pivot is rounding of the Gram matrix.
        if !(pivot > 1e-10 * g[j][j] && g[j][j].sqrt() > RANK_TOLERANCE * norms[j]) {
            return None;
        }
        r[j][j] = pivot.sqrt();
    }
    Some(r)
}

/// Column by column, with random columns in the place of dependent ones.
fn gram_schmidt(
    panel: &mut Panel,
    norms: &[f64; BLOCK],
    space: &TallMatrix,
    len: usize,
    random: &mut ChaCha8Rng,
) -> Square {
    let mut r = [[0.0; BLOCK]; BLOCK];
    for j in 0..BLOCK {
        for i in (0..j).chain(0..j) {
            r[i][j] += remove(panel, i, j);
        }
        let norm = column_norm(panel, j);
        if norm > RANK_TOLERANCE * norms[j] {
            r[j][j] = norm;
        } else {
            replace_column(panel, j, space, len, random);
        }
        let scale = column_norm(panel, j).recip();
        panel.iter_mut().for_each(|row| row[j] *= scale);
    }
    r
}

/// Puts a random vector, orthogonal to the space and to the columns before it, in column `j`.
fn replace_column(panel: &mut Panel, j: usize, space: &TallMatrix, len: usize, random: &mut ChaCha8Rng) {
    let mut fresh: Panel = vec![[0.0; BLOCK]; panel.len()];
    fresh.iter_mut().for_each(|row| row[j] = random.random_range(-1.0..1.0));
    project_out(&mut fresh, space, len);
    project_out(&mut fresh, space, len);
    panel.iter_mut().zip(&fresh).for_each(|(row, f)| row[j] = f[j]);
    for i in (0..j).chain(0..j) {
        remove(panel, i, j);
    }
}

/// Subtracts from column `j` its part along the unit column `i`, and returns that part.
fn remove(panel: &mut Panel, i: usize, j: usize) -> f64 {
    let part: f64 = panel.iter().map(|row| row[i] * row[j]).sum();
    panel.iter_mut().for_each(|row| row[j] -= part * row[i]);
    part
}

fn column_norm(panel: &Panel, j: usize) -> f64 {
    panel.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt()
}

fn invert_upper(r: &Square) -> Square {
    let mut inverse = [[0.0; BLOCK]; BLOCK];
    for j in 0..BLOCK {
        inverse[j][j] = r[j][j].recip();
        for i in (0..j).rev() {
            let sum: f64 = (i + 1..=j).map(|l| r[i][l] * inverse[l][j]).sum();
            inverse[i][j] = -sum / r[i][i];
        }
    }
    inverse
}

fn multiply_upper(a: &Square, b: &Square) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..BLOCK).map(|l| a[i][l] * b[l][j]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// `[n, BLOCK]` whose last columns repeat the first ones.
    fn dependent_panel(n: usize, random: &mut ChaCha8Rng) -> Panel {
        (0..n)
            .map(|_| {
                let x: [f64; 3] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
                std::array::from_fn(|j| x[j % 3] * (1.0 + j as f64))
            })
            .collect()
    }

    #[test]
    fn rank_deficient_block_is_completed() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let space = TallMatrix::zeros(50, 8);
        let original = dependent_panel(50, &mut random);
        let norms = column_norms(&original);
        let mut q = original.clone();
        let r = orthonormalise(&mut q, &norms, &space, 0, &mut random);
        let products = gram(&q);
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        for (u, q) in original.iter().zip(&q) {
            for j in 0..BLOCK {
                let product: f64 = (0..BLOCK).map(|l| q[l] * r[l][j]).sum();
                assert!((product - u[j]).abs() < 1e-10, "Q R differs from U by {}", product - u[j]);
            }
        }
        assert_eq!((0..BLOCK).filter(|&j| r[j][j].abs() < 1e-12).count(), BLOCK - 3);
    }
}
