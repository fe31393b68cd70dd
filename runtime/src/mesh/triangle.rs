//! The point of a triangle that is closest to another point.

use super::vec3;

type Vec3 = [f64; 3];

/// Barycentric weights of the point of the triangle `[a, b, c]` that is closest to `p`: none is negative, and they
/// sum to 1. The triangle may be a line or a point.
///
/// Ericson, Real-Time Collision Detection (2005), section 5.1.5: by Voronoi regions.
pub fn closest_weights(p: Vec3, [a, b, c]: [Vec3; 3]) -> [f64; 3] {
    let (ab, ac) = (vec3::sub(b, a), vec3::sub(c, a));
    let dots = |q: Vec3| (vec3::dot(ab, vec3::sub(p, q)), vec3::dot(ac, vec3::sub(p, q)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (dots(a), dots(b), dots(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let [va, vb, vc] = [d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2];
    let sum = va + vb + vc;
    // The sum is the square of twice the area. In a sliver it is mostly rounding, and the closest point is on a side.
    let longest = vec3::dot(ab, ab).max(vec3::dot(ac, ac));
    if va > 0.0 && vb > 0.0 && vc > 0.0 && sum > 1e-18 * longest * longest {
        return [1.0 - (vb + vc) / sum, vb / sum, vc / sum];
    }
    let sides = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
        let corners = [a, b, c];
        let (t, square) = closest_on_side(p, corners[i], corners[j]);
        let mut weights = [0.0; 3];
        (weights[i], weights[j]) = (1.0 - t, t);
        (square, weights)
    });
    sides.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or([1.0, 0.0, 0.0], |(_, weights)| weights)
}

/// How far along the side from `q` to `r` the point closest to `p` lies, from 0 to 1, and its squared distance.
fn closest_on_side(p: Vec3, q: Vec3, r: Vec3) -> (f64, f64) {
    let (along, to) = (vec3::sub(r, q), vec3::sub(p, q));
    let square = vec3::dot(along, along);
    let t = if square > 0.0 { (vec3::dot(to, along) / square).clamp(0.0, 1.0) } else { 0.0 };
    let away = vec3::sub(to, vec3::scale(along, t));
    (t, vec3::dot(away, away))
}

/// The point with the given weights of the corners.
pub(super) fn weighted([a, b, c]: [Vec3; 3], [u, v, w]: [f64; 3]) -> Vec3 {
    vec3::add(vec3::scale(a, u), vec3::add(vec3::scale(b, v), vec3::scale(c, w)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Vec3; 3] = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [0.2, 0.8, -0.3]];

    fn distance(p: Vec3, triangle: [Vec3; 3]) -> f64 {
        let weights = closest_weights(p, triangle);
        assert!(weights.iter().all(|w| *w >= 0.0) && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        vec3::distance(p, weighted(triangle, weights))
    }

    #[test]
    fn no_other_point_of_the_triangle_is_closer() {
        for p in [
            [0.3, 0.3, 1.0],
            [-1.0, -0.5, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [1.0, 1.0, 0.5],
            [0.5, -1.0, 0.1],
        ] {
            let mut least = f64::INFINITY;
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let (s, t) = (f64::from(i) / 200.0, f64::from(j) / 200.0);
                    least = least.min(vec3::distance(p, weighted(TRIANGLE, [1.0 - s - t, s, t])));
                }
            }
            let found = distance(p, TRIANGLE);
            assert!(found <= least + 1e-12 && found > least - 0.006, "{found} instead of {least}");
        }
    }

    #[test]
    fn triangles_without_area_are_segments_and_points() {
        let [a, b, _] = TRIANGLE;
        let middle = vec3::scale(vec3::add(a, b), 0.5);
        for p in [[0.3, 0.3, 1.0], [2.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.4, 0.05, 0.1]] {
            let (_, square) = closest_on_side(p, a, b);
            for line in [[a, b, middle], [middle, b, a], [a, a, b], [a, b, b], [b, middle, a]] {
                assert!((distance(p, line) - square.sqrt()).abs() < 1e-12);
            }
            assert!((distance(p, [a, a, a]) - vec3::norm(p)).abs() < 1e-15);
        }
    }
}
