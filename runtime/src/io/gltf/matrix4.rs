//! Affine maps as 4 x 4 matrices of four columns.

/// A matrix: `m[column][row]`.
pub(super) type Matrix4 = [[f64; 4]; 4];

pub(super) const IDENTITY: Matrix4 =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// `a b`: first `b`, then `a`.
pub(super) fn product(a: &Matrix4, b: &Matrix4) -> Matrix4 {
    b.map(|column| [0, 1, 2, 3].map(|row| (0..4).map(|k| a[k][row] * column[k]).sum()))
}

/// The image of a point.
pub(super) fn apply(m: &Matrix4, [x, y, z]: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|row| m[0][row] * x + m[1][row] * y + m[2][row] * z + m[3][row])
}

/// The determinant of the linear part; negative where the map mirrors.
pub(super) fn determinant(m: &Matrix4) -> f64 {
    let [a, b, c, _] = m;
    a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
        + c[0] * (a[1] * b[2] - a[2] * b[1])
}

/// The inverse of an affine map, if it has one.
pub(super) fn inverse(m: &Matrix4) -> Option<Matrix4> {
    let scale = 1.0 / determinant(m);
    // The rows of the inverse are the cross products of the columns.
    let cross = |a: &[f64; 4], b: &[f64; 4]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]].map(|x| x * scale)
    };
    let rows = [cross(&m[1], &m[2]), cross(&m[2], &m[0]), cross(&m[0], &m[1])];
    let mut inverse = IDENTITY;
    for (row, values) in rows.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            inverse[column][row] = *value;
        }
        inverse[3][row] = -(0..3).map(|k| values[k] * m[3][k]).sum::<f64>();
    }
    inverse.iter().flatten().all(|x| x.is_finite()).then_some(inverse)
}

/// Translation after rotation (a unit quaternion x, y, z, w) after scaling.
pub(super) fn from_parts(translation: [f64; 3], [x, y, z, w]: [f64; 4], scale: [f64; 3]) -> Matrix4 {
    let axes = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)],
        [2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)],
        [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let column = |i: usize| [axes[i][0] * scale[i], axes[i][1] * scale[i], axes[i][2] * scale[i], 0.0];
    [column(0), column(1), column(2), [translation[0], translation[1], translation[2], 1.0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_and_inverse() {
        let half = 0.5f64.sqrt();
        let m = from_parts([1.0, 2.0, 3.0], [0.0, 0.0, half, half], [2.0, 3.0, -4.0]);
        let p = apply(&m, [1.0, 1.0, 1.0]);
        // A quarter turn about z takes (2, 3, -4) to (-3, 2, -4).
        for (found, expected) in p.iter().zip([-2.0, 4.0, -1.0]) {
            assert!((found - expected).abs() < 1e-14);
        }
        assert!((determinant(&m) + 24.0).abs() < 1e-12);
        let id = product(&inverse(&m).unwrap(), &m);
        assert!(id.iter().flatten().zip(IDENTITY.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-14));
        assert!(inverse(&from_parts([0.0; 3], [0.0, 0.0, 0.0, 1.0], [0.0; 3])).is_none());
    }
}
