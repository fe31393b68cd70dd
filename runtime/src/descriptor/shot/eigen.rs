//! Eigenvectors of symmetric 3 x 3 matrices.

use std::array;

/// A symmetric 3 x 3 matrix: `[xx, yy, zz, xy, xz, yz]`.
pub(super) type Symmetric3 = [f64; 6];

/// More sweeps than any matrix takes: convergence is quadratic, four or five are usual.
const MAX_SWEEPS: usize = 20;

/// Unit eigenvectors of the smallest and of the largest eigenvalue, by Jacobi rotations (Golub and Van Loan,
/// Matrix Computations, section 8.5). Their signs carry no meaning.
#[inline(always)]
pub(super) fn extreme_eigenvectors(matrix: Symmetric3) -> [[f64; 3]; 2] {
    let [xx, yy, zz, xy, xz, yz] = matrix;
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    // Row i holds the eigenvector of a[i][i].
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let negligible = 1e-32 * matrix.iter().map(|x| x * x).sum::<f64>();
    for _ in 0..MAX_SWEEPS {
        if a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2] <= negligible {
            break;
        }
        rotate(&mut a, &mut v, 0, 1, 2);
        rotate(&mut a, &mut v, 0, 2, 1);
        rotate(&mut a, &mut v, 1, 2, 0);
    }
    let (mut smallest, mut largest) = (0, 0);
    for i in 1..3 {
        if a[i][i] < a[smallest][smallest] {
            smallest = i;
        }
        if a[i][i] >= a[largest][largest] {
            largest = i;
        }
    }
    [v[smallest], v[largest]]
}

/// The rotation of the plane `p`, `q` that makes `a[p][q]` zero; `r` is the third index.
#[inline(always)]
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize, r: usize) {
    let off_diagonal = a[p][q];
    if off_diagonal == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * off_diagonal);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    a[p][p] -= t * off_diagonal;
    a[q][q] += t * off_diagonal;
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    let (rp, rq) = (a[r][p], a[r][q]);
    a[r][p] = c * rp - s * rq;
    a[r][q] = s * rp + c * rq;
    a[p][r] = a[r][p];
    a[q][r] = a[r][q];
    let (vp, vq) = (v[p], v[q]);
    v[p] = array::from_fn(|k| c * vp[k] - s * vq[k]);
    v[q] = array::from_fn(|k| s * vp[k] + c * vq[k]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::vec3::{cross, dot, norm, sub};
    use proptest::prelude::*;

    fn apply(m: Symmetric3, v: [f64; 3]) -> [f64; 3] {
        let [xx, yy, zz, xy, xz, yz] = m;
        [dot([xx, xy, xz], v), dot([xy, yy, yz], v), dot([xz, yz, zz], v)]
    }

    proptest! {
        #[test]
        fn vectors_satisfy_the_equation_and_enclose_the_third(m in prop::array::uniform6(-1.0f64..1.0)) {
            let [z, x] = extreme_eigenvectors(m);
            let y = cross(z, x);
            let value = |v| dot(v, apply(m, v));
            prop_assert!(value(z) <= value(y) + 1e-14 && value(y) <= value(x) + 1e-14);
            for v in [x, y, z] {
                prop_assert!((norm(v) - 1.0).abs() < 1e-14);
                prop_assert!(norm(sub(apply(m, v), v.map(|c| c * value(v)))) < 1e-14);
            }
        }
    }

    #[test]
    fn degenerate_matrices_give_orthonormal_vectors() {
        for m in [[0.0; 6], [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [1.0; 6], [2.0, 2.0, 1.0, 0.0, 0.0, 0.0]] {
            let [z, x] = extreme_eigenvectors(m);
            assert!(
                dot(z, x).abs() < 1e-15 && (norm(z) - 1.0).abs() < 1e-15 && (norm(x) - 1.0).abs() < 1e-15
            );
        }
    }
}
