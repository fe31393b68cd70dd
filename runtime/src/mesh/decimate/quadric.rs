//! Quadrics: sums of squared distances to planes and points.

use crate::mesh::vec3;

/// The quadratic form `q(x) = x^T A x + 2 b^T x + c`, `A` symmetric.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    /// `A` as xx, xy, xz, yy, yz, zz.
    a: [f64; 6],
    b: [f64; 3],
    c: f64,
}

impl Quadric {
    /// `weight` times the squared distance to the plane through `point` with the unit normal `n`.
    pub(super) fn of_plane(n: [f64; 3], point: [f64; 3], weight: f64) -> Self {
        let d = -vec3::dot(n, point);
        let [x, y, z] = n;
        Self {
            a: [x * x, x * y, x * z, y * y, y * z, z * z].map(|v| weight * v),
            b: vec3::scale(n, weight * d),
            c: weight * d * d,
        }
    }

    /// `weight` times the squared distance to `point`.
    pub(super) fn of_point(point: [f64; 3], weight: f64) -> Self {
        Self {
            a: [weight, 0.0, 0.0, weight, 0.0, weight],
            b: vec3::scale(point, -weight),
            c: weight * vec3::dot(point, point),
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        for i in 0..6 {
            self.a[i] += other.a[i];
        }
        self.b = vec3::add(self.b, other.b);
        self.c += other.c;
    }

    pub(super) fn at(&self, p: [f64; 3]) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let [x, y, z] = p;
        let ap = [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
        vec3::dot(p, ap) + 2.0 * vec3::dot(self.b, p) + self.c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_squared_distances() {
        let n = [0.6, 0.0, 0.8];
        let (on_plane, point, p) = ([1.0, 2.0, 3.0], [0.5, -1.0, 2.0], [4.0, -2.0, 0.3]);
        let mut sum = Quadric::of_plane(n, on_plane, 2.0);
        sum.add(&Quadric::of_point(point, 3.0));
        let to_plane = vec3::dot(n, vec3::sub(p, on_plane));
        let expected = 2.0 * to_plane * to_plane + 3.0 * vec3::distance(p, point).powi(2);
        assert!((sum.at(p) - expected).abs() < 1e-12 * expected);
    }
}
