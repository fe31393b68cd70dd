//! Bodies as implicit surfaces: a smooth union of spindles and ellipsoids, negative inside.

use fmnet::mesh::vec3;

use super::loft::Loft;
use super::math::{Vec3, lerp};

/// One solid of a body. All distances are first-order approximations (value over length of the gradient),
/// accurate near the surface, which is where they are blended.
#[derive(Clone, Debug)]
pub(super) enum Solid {
    /// Spheres swept from `a` to `b`: radii `ra` and `rb` at the ends, and `bulge` more than their mean half-way.
    /// The cross-section is squeezed by `flatten` along the unit vector `axis`.
    Spindle { a: Vec3, b: Vec3, ra: f64, rb: f64, bulge: f64, axis: Vec3, flatten: f64 },
    /// An ellipsoid whose semi-axes `radii` lie along the orthonormal rows of `axes`.
    Ellipsoid { center: Vec3, radii: Vec3, axes: [Vec3; 3] },
    /// A tube through cross-sections.
    Tube(Loft),
}

/// A solid, how it joins the others, and the bones it may belong to.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) solid: Solid,
    /// Width of the smooth union with everything before it, a length.
    pub(super) blend: f64,
    /// Takes the solid away instead of adding it.
    pub(super) carve: bool,
    /// The bones that may move this part; the nearest one does.
    pub(super) bones: Vec<usize>,
    /// A ball that holds the solid: centre and radius.
    bound: (Vec3, f64),
}

impl Part {
    pub(super) fn new(solid: Solid, blend: f64, carve: bool, bones: &[usize]) -> Self {
        let bound = solid.bound();
        Self { solid, blend, carve, bones: bones.to_vec(), bound }
    }

    /// Whether the bounding ball alone shows that the solid is farther than `distance` from `p`.
    pub(super) fn is_beyond(&self, p: Vec3, distance: f64) -> bool {
        let (center, radius) = self.bound;
        let least = radius + distance;
        let offset = vec3::sub(p, center);
        least <= 0.0 || vec3::dot(offset, offset) > least * least
    }
}

impl Solid {
    /// Approximate signed distance of `p`, negative inside.
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        match *self {
            Self::Tube(ref loft) => loft.distance(p),
            Self::Spindle { a, b, ra, rb, bulge, axis, flatten } => {
                let stretch =
                    |v: Vec3| vec3::add(v, vec3::scale(axis, vec3::dot(v, axis) * (1.0 / flatten - 1.0)));
                let (ab, ap) = (stretch(vec3::sub(b, a)), stretch(vec3::sub(p, a)));
                let t = (vec3::dot(ap, ab) / vec3::dot(ab, ab).max(1e-300)).clamp(0.0, 1.0);
                let radius = ra + t * (rb - ra) + 4.0 * bulge * t * (1.0 - t);
                let offset = vec3::sub(ap, vec3::scale(ab, t));
                let length = vec3::norm(offset);
                let gradient =
                    if length > 0.0 { vec3::norm(stretch(offset)) / length } else { 1.0 / flatten.min(1.0) };
                (length - radius) / gradient
            }
            Self::Ellipsoid { center, radii, axes } => {
                let offset = vec3::sub(p, center);
                let q: Vec3 = std::array::from_fn(|i| vec3::dot(offset, axes[i]) / radii[i]);
                let level = vec3::norm(q);
                let gradient = vec3::norm(std::array::from_fn(|i| q[i] / radii[i]));
                // Deep inside, along the longest axis, the approximation would exceed the least radius.
                let least = radii.iter().fold(f64::MAX, |least, &r| least.min(r));
                if gradient > 0.0 { (level * (level - 1.0) / gradient).max(-least) } else { -least }
            }
        }
    }

    /// A ball that holds the solid: centre and radius.
    pub(super) fn bound(&self) -> (Vec3, f64) {
        match *self {
            Self::Tube(ref loft) => loft.bound(),
            Self::Spindle { a, b, ra, rb, bulge, flatten, .. } => {
                let radius = (ra.max(rb) + bulge.max(0.0)) * flatten.max(1.0);
                (lerp(a, b, 0.5), 0.5 * vec3::distance(a, b) + radius)
            }
            Self::Ellipsoid { center, radii, .. } => {
                (center, radii.iter().fold(0.0, |most: f64, &r| most.max(r)))
            }
        }
    }
}

/// Value of the smooth union of `parts` at `p`, negative inside.
pub(super) fn field<'a>(parts: impl Iterator<Item = &'a Part>, p: Vec3) -> f64 {
    let mut value = f64::INFINITY;
    for part in parts {
        // A solid farther than the union by the width of the blend, or a hole that far, changes nothing. Twice the
        // width, as distances to flat solids are underestimated.
        if part.is_beyond(p, 2.0 * part.blend + if part.carve { -value } else { value }) {
            continue;
        }
        let distance = part.solid.distance(p);
        value = if part.carve {
            -smooth_min(-value, distance, part.blend)
        } else {
            smooth_min(value, distance, part.blend)
        };
    }
    value
}

/// A minimum with its corner rounded by a parabola of width `blend`.
fn smooth_min(a: f64, b: f64, blend: f64) -> f64 {
    if a == f64::INFINITY {
        return b;
    }
    let overlap = (blend - (a - b).abs()).max(0.0);
    a.min(b) - if blend > 0.0 { overlap * overlap / (4.0 * blend) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXES: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn distance_of_round_solids_is_exact() {
        let ball = Solid::Ellipsoid { center: [1.0, 0.0, 0.0], radii: [2.0; 3], axes: AXES };
        assert!((ball.distance([5.0, 0.0, 0.0]) - 2.0).abs() < 1e-14);
        let rod = Solid::Spindle {
            a: [0.0; 3],
            b: [0.0, 2.0, 0.0],
            ra: 0.5,
            rb: 0.5,
            bulge: 0.0,
            axis: AXES[2],
            flatten: 1.0,
        };
        assert!((rod.distance([1.5, 1.0, 0.0]) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn flattened_spindle_has_its_surface_at_the_squeezed_radius() {
        let (axis, b) = (AXES[2], [0.0, 2.0, 0.0]);
        let rod = Solid::Spindle { a: [0.0; 3], b, ra: 0.5, rb: 0.5, bulge: 0.1, axis, flatten: 0.4 };
        assert!(rod.distance([0.0, 1.0, 0.24]).abs() < 1e-14);
        assert!(rod.distance([0.6, 1.0, 0.0]).abs() < 1e-14);
    }

    #[test]
    fn smooth_union_grows_only_near_both() {
        assert_eq!(smooth_min(0.0, 1.0, 0.5), 0.0);
        assert!((smooth_min(0.1, 0.1, 0.2) - 0.05).abs() < 1e-15);
    }
}
