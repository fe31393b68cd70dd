//! Rotations and rigid motions: unit quaternions `[w, x, y, z]` and unit dual quaternions.

use fmnet::mesh::vec3;

pub(super) type Vec3 = [f64; 3];

/// A rotation as a unit quaternion `[w, x, y, z]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quat(pub(super) [f64; 4]);

impl Quat {
    pub(super) const IDENTITY: Self = Self([1.0, 0.0, 0.0, 0.0]);

    /// Rotation by `angle` (radians, right-handed) about the unit vector `axis`.
    pub(super) fn about(axis: Vec3, angle: f64) -> Self {
        let (sin, cos) = (0.5 * angle).sin_cos();
        Self([cos, sin * axis[0], sin * axis[1], sin * axis[2]])
    }

    /// Rotation by `degrees` about the x axis.
    pub(super) fn x(degrees: f64) -> Self {
        Self::about([1.0, 0.0, 0.0], degrees.to_radians())
    }

    /// Rotation by `degrees` about the y axis.
    pub(super) fn y(degrees: f64) -> Self {
        Self::about([0.0, 1.0, 0.0], degrees.to_radians())
    }

    /// Rotation by `degrees` about the z axis.
    pub(super) fn z(degrees: f64) -> Self {
        Self::about([0.0, 0.0, 1.0], degrees.to_radians())
    }

    /// The smallest rotation that takes the direction `from` to the direction `to`; both non-zero and not opposite.
    pub(super) fn between(from: Vec3, to: Vec3) -> Self {
        let (from, to) = (unit(from), unit(to));
        let axis = vec3::cross(from, to);
        Self([1.0 + vec3::dot(from, to), axis[0], axis[1], axis[2]]).normalized()
    }

    /// The rotation `other` first, then `self`.
    pub(super) fn then_after(self, other: Self) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        Self([
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ])
    }

    pub(super) fn inverse(self) -> Self {
        let [w, x, y, z] = self.0;
        Self([w, -x, -y, -z])
    }

    pub(super) fn rotate(self, p: Vec3) -> Vec3 {
        let [w, x, y, z] = self.0;
        let v = [x, y, z];
        let t = vec3::scale(vec3::cross(v, p), 2.0);
        vec3::add(vec3::add(p, vec3::scale(t, w)), vec3::cross(v, t))
    }

    /// Angle of the rotation, in [0, pi].
    pub(super) fn angle(self) -> f64 {
        2.0 * self.0[0].abs().min(1.0).acos()
    }

    /// The same rotation seen in a mirror at the plane x = 0.
    pub(super) fn mirrored(self) -> Self {
        let [w, x, y, z] = self.0;
        Self([w, x, -y, -z])
    }

    fn normalized(self) -> Self {
        let norm = self.0.iter().map(|x| x * x).sum::<f64>().sqrt();
        Self(self.0.map(|x| x / norm))
    }
}

/// A rotation followed by a translation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigid {
    pub(super) rotation: Quat,
    pub(super) translation: Vec3,
}

impl Rigid {
    pub(super) fn apply(&self, p: Vec3) -> Vec3 {
        vec3::add(self.rotation.rotate(p), self.translation)
    }

    /// The unit dual quaternion of the motion: the real part is the rotation, the dual part half the
    /// translation times the rotation (Kavan et al. 2008, equation 2).
    pub(super) fn dual_quaternion(&self) -> [f64; 8] {
        let [w, x, y, z] = self.rotation.0;
        let t = self.translation;
        let dual = Quat([0.0, 0.5 * t[0], 0.5 * t[1], 0.5 * t[2]]).then_after(self.rotation).0;
        [w, x, y, z, dual[0], dual[1], dual[2], dual[3]]
    }
}

/// The rigid motion of a blended dual quaternion, which need not be normalised (Kavan et al. 2008, algorithm 1).
pub(super) fn rigid_of(blend: [f64; 8]) -> Rigid {
    let norm = blend[..4].iter().map(|x| x * x).sum::<f64>().sqrt();
    let [w, x, y, z, dw, dx, dy, dz] = blend.map(|value| value / norm);
    let (v, d) = ([x, y, z], [dx, dy, dz]);
    let cross = vec3::cross(v, d);
    let translation: Vec3 = std::array::from_fn(|i| 2.0 * (w * d[i] - dw * v[i] + cross[i]));
    Rigid { rotation: Quat([w, x, y, z]), translation }
}

/// `p / |p|`, and the x axis for a zero vector.
pub(super) fn unit(p: Vec3) -> Vec3 {
    let norm = vec3::norm(p);
    if norm > 0.0 { vec3::scale(p, 1.0 / norm) } else { [1.0, 0.0, 0.0] }
}

/// `(1 - t) a + t b`
pub(super) fn lerp(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// A unit vector perpendicular to the unit vector `axis`, as close as can be to `hint`.
pub(super) fn perpendicular(axis: Vec3, hint: Vec3) -> Vec3 {
    let along = vec3::dot(axis, hint);
    unit(vec3::sub(hint, vec3::scale(axis, along)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_turns_x_to_y_about_z() {
        let p = Quat::z(90.0).rotate([1.0, 0.0, 0.0]);
        assert!(vec3::distance(p, [0.0, 1.0, 0.0]) < 1e-15);
    }

    #[test]
    fn angle_of_a_rotation_is_what_it_was_made_with() {
        for degrees in [0.0, 40.0, 175.0] {
            assert!((Quat::y(degrees).angle().to_degrees() - degrees).abs() < 1e-6);
            assert!((Quat::y(-degrees).angle().to_degrees() - degrees).abs() < 1e-6);
        }
    }

    #[test]
    fn product_of_rotations_applies_the_right_one_first() {
        let p = [0.3, -0.2, 0.9];
        let (a, b) = (Quat::x(33.0), Quat::about(unit([1.0, 2.0, 3.0]), 1.2));
        assert!(vec3::distance(a.then_after(b).rotate(p), a.rotate(b.rotate(p))) < 1e-15);
    }

    #[test]
    fn dual_quaternion_round_trip() {
        let motion =
            Rigid { rotation: Quat::about(unit([1.0, -2.0, 0.5]), 2.0), translation: [0.1, -3.0, 2.0] };
        let back = rigid_of(motion.dual_quaternion().map(|x| 3.0 * x));
        let p = [0.4, 0.5, -0.6];
        assert!(vec3::distance(motion.apply(p), back.apply(p)) < 1e-14);
    }

    #[test]
    fn mirrored_rotation_commutes_with_the_mirror() {
        let mirror = |p: Vec3| [-p[0], p[1], p[2]];
        let q = Quat::about(unit([1.0, 2.0, 3.0]), 0.7);
        let p = [0.4, 0.5, -0.6];
        assert!(vec3::distance(q.mirrored().rotate(mirror(p)), mirror(q.rotate(p))) < 1e-15);
    }

    #[test]
    fn between_takes_one_direction_to_the_other() {
        let (a, b) = (unit([1.0, 2.0, 3.0]), unit([-0.3, 1.0, 0.2]));
        assert!(vec3::distance(Quat::between(a, b).rotate(a), b) < 1e-15);
    }
}
