//! Samples that cover a shape evenly, chosen from its eigenbasis alone.

use crate::spectral::Eigenbasis;

/// Eigenfunctions that enter the distance; the later ones hardly weigh.
const DIRECTIONS: usize = 16;

/// `count` vertices, ascending, each as far as possible from those before it, by the biharmonic distance
/// (Lipman et al. 2010): Euclidean between the rows of `Phi Lambda^-1`, an intrinsic distance that depends on
/// neither the sign of an eigenvector nor the pose. Vertices without area are left out unless all are.
pub(super) fn farthest_points(basis: &Eigenbasis, count: usize) -> Vec<u32> {
    let embedding = biharmonic_embedding(basis);
    let n = basis.n();
    let usable = |i: usize| basis.mass[i] > 0.0;
    let mut distance: Vec<f64> =
        (0..n).map(|i| if usable(i) { f64::INFINITY } else { f64::NEG_INFINITY }).collect();
    let mut next = (0..n).find(|&i| usable(i)).unwrap_or(0);
    let mut chosen = Vec::with_capacity(count);
    while chosen.len() < count.min(n) && distance[next] > f64::NEG_INFINITY {
        chosen.push(next as u32);
        distance[next] = f64::NEG_INFINITY;
        let origin = embedding[next];
        next = 0;
        for i in 0..n {
            if distance[i] > 0.0 {
                distance[i] = distance[i].min(squared_distance(&embedding[i], &origin));
            }
            if distance[i] > distance[next] {
                next = i;
            }
        }
    }
    if chosen.is_empty() {
        chosen.extend(0..count.min(n) as u32);
    }
    chosen.sort_unstable();
    chosen
}

/// Rows of `Phi Lambda^-1`, `[n, DIRECTIONS]`, zero for eigenvalue zero and beyond the basis.
fn biharmonic_embedding(basis: &Eigenbasis) -> Vec<[f64; DIRECTIONS]> {
    let directions = basis.k().min(DIRECTIONS);
    let largest = basis.eigenvalues[..directions].last().copied().unwrap_or(0.0);
    let weight = |eigenvalue: f64| if eigenvalue > 1e-9 * largest { largest / eigenvalue } else { 0.0 };
    let weights: Vec<f64> =
        basis.eigenvalues[..directions].iter().map(|&eigenvalue| weight(eigenvalue)).collect();
    let row = |i: usize| {
        let mut row = [0.0; DIRECTIONS];
        let entries = basis.eigenvectors.row(i).iter().zip(&weights);
        row.iter_mut().zip(entries).for_each(|(slot, (phi, weight))| *slot = phi * weight);
        row
    };
    (0..basis.n()).map(row).collect()
}

/// In four partial sums, which the compiler keeps in vector registers.
fn squared_distance(a: &[f64; DIRECTIONS], b: &[f64; DIRECTIONS]) -> f64 {
    let mut sums = [0.0; 4];
    for t in 0..DIRECTIONS {
        sums[t % 4] += (a[t] - b[t]) * (a[t] - b[t]);
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}
