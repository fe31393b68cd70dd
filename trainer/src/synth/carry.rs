//! Where points of a body go when its solids change: each goes with the solids whose surface it is on.

use fmnet::mesh::vec3;

use super::implicit::{Part, Solid};
use super::math::{Quat, Vec3, unit};

/// The solids that a point goes with, as indices of parts, and their shares, which sum to 1.
pub(super) struct Carriers(Vec<(u16, f64)>);

impl Carriers {
    /// The solids nearest to `p`; those that blend with the nearest one share it.
    pub(super) fn of(parts: &[Part], p: Vec3, least_width: f64) -> Self {
        let solids = || parts.iter().enumerate().filter(|(_, part)| !part.carve);
        let near: Vec<(u16, f64, f64)> = solids()
            .filter(|(_, part)| !part.is_beyond(p, 4.0 * least_width + part.blend))
            .map(|(i, part)| (i as u16, part.solid.distance(p), part.blend.max(least_width)))
            .collect();
        let least = near.iter().fold(f64::INFINITY, |least, &(_, distance, _)| least.min(distance));
        let shares = near
            .into_iter()
            .map(|(i, distance, width)| (i, (1.0 - (distance - least) / width).max(0.0).powi(2)));
        let shares: Vec<(u16, f64)> = shares.filter(|&(_, share)| share > 0.0).collect();
        let sum: f64 = shares.iter().map(|(_, share)| share).sum();
        Self(shares.into_iter().map(|(i, share)| (i, share / sum)).collect())
    }

    /// Where `p` goes when each solid of `from` becomes the one of `to` with its index.
    pub(super) fn carry(&self, from: &[Part], to: &[Part], p: Vec3) -> Vec3 {
        self.0.iter().fold([0.0; 3], |sum, &(i, share)| {
            let moved = carry(&from[i as usize].solid, &to[i as usize].solid, p);
            vec3::add(sum, vec3::scale(moved, share))
        })
    }
}

/// Where `p` goes when the solid `from` becomes `to`, which is of the same kind: it keeps its place along the solid
/// and its distance from the axis relative to the radius there.
fn carry(from: &Solid, to: &Solid, p: Vec3) -> Vec3 {
    match (from, to) {
        (Solid::Tube(from), Solid::Tube(to)) => from.carry(to, p),
        (
            Solid::Ellipsoid { center, radii, axes },
            Solid::Ellipsoid { center: other, radii: sizes, axes: turned },
        ) => {
            let offset = vec3::sub(p, *center);
            (0..3).fold(*other, |sum, i| {
                let share = vec3::dot(offset, axes[i]) / radii[i];
                vec3::add(sum, vec3::scale(turned[i], share * sizes[i]))
            })
        }
        (Solid::Spindle { .. }, Solid::Spindle { .. }) => {
            let (from, to) = (Axis::of(from), Axis::of(to));
            let offset = vec3::sub(p, from.start);
            let along = vec3::dot(offset, from.direction);
            let t = (along / from.length).clamp(0.0, 1.0);
            let (radius, other) = (from.radius(t), to.radius(t));
            let beyond = (along - t * from.length) * other / radius;
            let across = vec3::sub(offset, vec3::scale(from.direction, along));
            let across = to.squeezed(from.round(across), from.direction);
            let place = vec3::add(to.start, vec3::scale(to.direction, t * to.length + beyond));
            vec3::add(place, vec3::scale(across, other / radius))
        }
        _ => p,
    }
}

/// The axis of a spindle.
struct Axis {
    start: Vec3,
    direction: Vec3,
    length: f64,
    radii: [f64; 3],
    axis: Vec3,
    flatten: f64,
}

impl Axis {
    fn of(solid: &Solid) -> Self {
        let Solid::Spindle { a, b, ra, rb, bulge, axis, flatten } = *solid else {
            unreachable!("only spindles have an axis")
        };
        let length = vec3::distance(a, b).max(1e-9);
        Self { start: a, direction: unit(vec3::sub(b, a)), length, radii: [ra, rb, bulge], axis, flatten }
    }

    fn radius(&self, t: f64) -> f64 {
        let [ra, rb, bulge] = self.radii;
        (ra + t * (rb - ra) + 4.0 * bulge * t * (1.0 - t)).max(1e-9)
    }

    /// An offset from the axis as if the spindle were not flattened.
    fn round(&self, across: Vec3) -> Vec3 {
        vec3::add(across, vec3::scale(self.axis, vec3::dot(across, self.axis) * (1.0 / self.flatten - 1.0)))
    }

    /// A round offset from the axis `direction`, turned to this one and flattened as this one.
    fn squeezed(&self, across: Vec3, direction: Vec3) -> Vec3 {
        let turned = Quat::between(direction, self.direction).rotate(across);
        vec3::add(turned, vec3::scale(self.axis, vec3::dot(turned, self.axis) * (self.flatten - 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::loft::{Loft, Station};
    use super::*;

    fn assert_surface_goes_to_surface(from: Solid, to: Solid) {
        for start in [[0.9, 0.3, 0.2], [0.1, 0.8, -0.7], [-0.4, 1.4, 0.5], [0.3, -0.4, 0.3]] {
            let on_surface = |solid: &Solid, mut p: Vec3| {
                for _ in 0..60 {
                    let delta = 1e-6;
                    let value = solid.distance(p);
                    let gradient: Vec3 = std::array::from_fn(|i| {
                        let mut q = p;
                        q[i] += delta;
                        (solid.distance(q) - value) / delta
                    });
                    p = vec3::sub(p, vec3::scale(gradient, value / vec3::dot(gradient, gradient)));
                }
                p
            };
            let p = on_surface(&from, start);
            assert!(from.distance(p).abs() < 1e-9);
            let q = carry(&from, &to, p);
            assert!(to.distance(q).abs() < 1e-6, "{start:?}: {}", to.distance(q));
            assert!(vec3::distance(carry(&to, &from, q), p) < 1e-6, "{start:?} does not come back");
        }
    }

    #[test]
    fn ellipsoid_is_carried_onto_another() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let from = Solid::Ellipsoid { center: [0.0, 0.3, 0.1], radii: [0.5, 0.4, 0.3], axes };
        let to = Solid::Ellipsoid {
            center: [1.0, 0.0, 0.0],
            radii: [0.2, 0.7, 0.4],
            axes: [axes[1], axes[2], axes[0]],
        };
        assert_surface_goes_to_surface(from, to);
    }

    #[test]
    fn spindle_is_carried_onto_another() {
        let round = |b: Vec3, ra: f64, rb: f64| Solid::Spindle {
            a: [0.0; 3],
            b,
            ra,
            rb,
            bulge: 0.0,
            axis: [0.0, 0.0, 1.0],
            flatten: 1.0,
        };
        assert_surface_goes_to_surface(round([0.0, 1.0, 0.0], 0.3, 0.3), round([1.0, 0.5, 0.2], 0.2, 0.2));
        let flat = |ra: f64, flatten: f64| Solid::Spindle {
            a: [0.0; 3],
            b: [0.0, 1.0, 0.0],
            ra,
            rb: ra,
            bulge: 0.0,
            axis: [0.0, 0.0, 1.0],
            flatten,
        };
        assert_surface_goes_to_surface(flat(0.4, 0.5), flat(0.3, 0.8));
    }

    #[test]
    fn tube_is_carried_onto_another() {
        let tube = |widths: [f64; 3], tall: f64| {
            let station = |i: usize| Station {
                center: [0.0, tall * i as f64, 0.1 * i as f64],
                side: widths[i],
                front: 0.3,
                back: 0.2 * widths[i],
            };
            Solid::Tube(Loft { stations: (0..3).map(station).collect(), upright: true, cap: 0.8 })
        };
        assert_surface_goes_to_surface(tube([0.4, 0.5, 0.3], 0.5), tube([0.3, 0.7, 0.3], 0.8));
    }
}
