//! The cotangent stiffness matrix.

use super::SparseMatrix;
use crate::mesh::{Mesh, vec3};

/// Least ratio of twice a triangle's area to the sum of its squared edges that enters the weights as it is.
///
/// A flatter triangle has its three weights scaled down together, which keeps its part of the matrix positive
/// semi-definite, and bounds each weight by `0.5 / MIN_FLATNESS`.
const MIN_FLATNESS: f64 = 1e-6;

/// The cotangent stiffness matrix `W`, `[n, n]`: `f^T W f` is the Dirichlet energy of the piecewise linear
/// function `f`.
///
/// `W_ij = -(cot alpha + cot beta) / 2` over the angles opposite to edge `ij` (one at a boundary, more at a
/// non-manifold edge), and rows sum to zero (Pinkall and Polthier 1993). Symmetric, positive semi-definite,
/// without unit: it does not change when the mesh is scaled. Always finite: a triangle flatter than a height
/// of about a millionth of its length counts as one of that flatness, so a degenerate one ties its vertices
/// together as its neighbours in the limit do; one with two equal indices, or with its three vertices at one
/// point, has no part.
pub fn cotangent_stiffness(mesh: &Mesh) -> SparseMatrix {
    let mut entries = Vec::with_capacity(3 * mesh.n_faces());
    for (face, &[a, b, c]) in mesh.faces().iter().enumerate() {
        if a == b || b == c || c == a {
            continue;
        }
        let [cot_a, cot_b, cot_c] = cotangents(mesh.corners(face));
        entries.extend([(b, c, -0.5 * cot_a), (c, a, -0.5 * cot_b), (a, b, -0.5 * cot_c)]);
    }
    SparseMatrix::with_zero_row_sums(mesh.n_vertices(), &entries)
}

/// Cotangents of the angles at the three corners, bounded as [`MIN_FLATNESS`] says.
fn cotangents([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let edges = [vec3::sub(c, b), vec3::sub(a, c), vec3::sub(b, a)];
    let length = edges.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    if !(length > 0.0 && length.is_finite()) {
        return [0.0; 3];
    }
    // In units of the triangle itself no product over- or underflows.
    let [ea, eb, ec] = edges.map(|e| e.map(|x| x / length));
    let twice_area = vec3::norm(vec3::cross(ec, eb));
    let squared_edges = vec3::dot(ea, ea) + vec3::dot(eb, eb) + vec3::dot(ec, ec);
    let denominator = twice_area.max(MIN_FLATNESS * squared_edges);
    [(eb, ec), (ec, ea), (ea, eb)].map(|(u, v)| -vec3::dot(u, v) / denominator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::spectral::test_shapes::{bumpy, grid, scaled, zoo};

    #[test]
    fn right_angled_grid_gives_the_five_point_stencil() {
        let matrix = cotangent_stiffness(&grid(2, 2, 2.0, 2.0));
        let centre: Vec<f64> =
            (0..9).map(|j| matrix.row(4).filter(|e| e.0 == j).map(|e| e.1).sum()).collect();
        let stencil = [0.0, -1.0, 0.0, -1.0, 4.0, -1.0, 0.0, -1.0, 0.0];
        assert!(centre.iter().zip(stencil).all(|(a, b)| (a - b).abs() < 1e-15), "{centre:?}");
    }

    #[test]
    fn symmetric_with_zero_row_sums_and_semi_definite_for_any_mesh() {
        for (name, mesh) in zoo() {
            let matrix = cotangent_stiffness(&mesh);
            let n = mesh.n_vertices();
            let largest = matrix.diagonal().into_iter().fold(0.0, f64::max);
            assert!(matrix.values().iter().all(|x| x.is_finite()), "{name}");
            let entry = |i: usize, j: usize| matrix.row(i).find(|e| e.0 == j).map(|e| e.1);
            assert!(
                (0..n).all(|i| matrix.row(i).all(|(j, w)| entry(j, i) == Some(w))),
                "{name}: not symmetric"
            );
            let functions = Matrix::from_fn(n, 5, |i, j| if j == 0 { 1.0 } else { ((i * j) as f64).sin() });
            let images = matrix.multiply(&functions);
            for j in 0..5 {
                let energy: f64 = (0..n).map(|i| functions[(i, j)] * images[(i, j)]).sum();
                assert!(energy > -1e-12 * largest, "{name}: energy {energy}");
            }
            assert!((0..n).all(|i| images[(i, 0)].abs() < 1e-12 * largest), "{name}: W 1 is not 0");
        }
    }

    #[test]
    fn energy_of_a_linear_function_is_its_squared_slope_times_the_area() {
        let mesh = grid(7, 4, 3.0, 2.0);
        let heights =
            Matrix::from_fn(mesh.n_vertices(), 1, |i, _| 2.0 * mesh.vertices()[i][0] - mesh.vertices()[i][1]);
        let image = cotangent_stiffness(&mesh).multiply(&heights);
        let energy: f64 = heights.data().iter().zip(image.data()).map(|(f, w)| f * w).sum();
        assert!((energy - 5.0 * 6.0).abs() < 1e-11, "energy {energy}");
    }

    #[test]
    fn a_power_of_two_scales_nothing_even_at_the_ends_of_the_range() {
        let mesh = bumpy(5);
        let matrix = cotangent_stiffness(&mesh);
        for exponent in [-900, 10, 900] {
            assert_eq!(cotangent_stiffness(&scaled(&mesh, 2.0_f64.powi(exponent))), matrix);
        }
    }
}
