//! Arms and legs of a biped.

use super::super::math::{Vec3, lerp, unit};
use super::super::mirror::on_side;
use super::super::recipe::{Girth, Join};
use super::{ARM, BACK_OF_HAND, FOOT_MAGNIFIED, HAND_MAGNIFIED, Sculptor, bone};
use fmnet::mesh::vec3;

impl Sculptor {
    pub(super) fn arm(&mut self, side: usize) {
        use bone::*;
        let (girth, muscle, long) = (self.to.arm_girth, self.to.muscle, self.to.arm_length);
        let on = |p: Vec3| on_side(p, side);
        let (shoulder, elbow, wrist) = (self.shoulder(), self.elbow(), self.wrist());
        let upper = Join { bones: &[limb(UPPER_ARM, side)], blend: 0.035 };
        let lower = Join { bones: &[limb(FOREARM, side)], blend: 0.03 };
        let along =
            |a: Vec3, b: Vec3, t: f64, out: Vec3| on(vec3::add(lerp(a, b, t), vec3::scale(out, girth)));
        let recipe = &mut self.recipe;
        let deltoid = along(shoulder, elbow, 0.12, [0.008, 0.006, 0.0]);
        recipe.tilted_ellipsoid(
            upper,
            deltoid,
            [0.054 * girth * muscle.sqrt(), 0.082 * long, 0.058 * girth * muscle.sqrt()],
            on(ARM),
        );
        let (start, end) = (along(shoulder, elbow, 0.05, [0.0; 3]), on(elbow));
        recipe.spindle(upper, start, end, Girth(0.046 * girth, 0.037 * girth, 0.002));
        let biceps = along(shoulder, elbow, 0.55, [0.0, 0.0, 0.016]);
        recipe.tilted_ellipsoid(
            upper,
            biceps,
            [0.031 * girth, 0.085 * long, 0.032 * girth * muscle],
            on(ARM),
        );
        let triceps = along(shoulder, elbow, 0.48, [0.0, 0.0, -0.017]);
        recipe.tilted_ellipsoid(
            upper,
            triceps,
            [0.032 * girth, 0.095 * long, 0.031 * girth * muscle],
            on(ARM),
        );
        let (near, far) = (along(elbow, wrist, 0.0, [0.0; 3]), along(elbow, wrist, 1.02, [0.0; 3]));
        recipe.flat_spindle(
            lower,
            near,
            far,
            Girth(0.037 * girth, 0.0255 * girth, 0.003),
            on(BACK_OF_HAND),
            0.86,
        );
        let belly = along(elbow, wrist, 0.25, [0.004, 0.004, 0.008]);
        recipe.tilted_ellipsoid(lower, belly, [0.038 * girth, 0.085 * long, 0.04 * girth], on(ARM));
        let point = along(elbow, wrist, -0.02, vec3::scale([0.0, 0.0, -1.0], 0.026));
        recipe.ellipsoid(Join { blend: 0.02, ..upper }, point, [0.016; 3]);
    }

    pub(super) fn hand(&mut self, side: usize) {
        use bone::*;
        let size = HAND_MAGNIFIED * self.to.hand;
        let on = |p: Vec3| on_side(p, side);
        let at = |along: f64, across: f64, up: f64| on(self.palm(along, across, up));
        let back = on(BACK_OF_HAND);
        let palm_join = Join { bones: &[limb(HAND, side)], blend: 0.016 * size };
        // Along, across and girth of each finger: little finger first, as it lies farthest from the thumb.
        let fingers = [(0.086, -0.034, 0.145, -0.052, 0.0075), (0.094, -0.0125, 0.168, -0.0185, 0.0085)];
        let longer = [(0.097, 0.0105, 0.18, 0.014, 0.009), (0.093, 0.033, 0.168, 0.046, 0.0085)];
        let (mitten, spread) = (self.to.mitten, self.to.spread);
        let rays: Vec<_> = fingers
            .into_iter()
            .chain(longer)
            .map(|(near, from, far, to, r)| {
                // Fingers grown together are short, thick and side by side.
                let to = (1.0 - mitten) * (from + spread * (to - from)) + 0.7 * mitten * from;
                let (far, r) = (far - 0.035 * mitten, r * (1.0 + 0.9 * mitten));
                let (root, knuckle) = (at(0.012, 0.4 * from, 0.0), at(near, from, 0.002));
                let (middle, tip) = (at(0.5 * (near + far), 0.5 * (from + to), 0.001), at(far, to, -0.006));
                (root, knuckle, middle, tip, r)
            })
            .collect();
        let (ball_start, ball_end) = (at(0.016, 0.014, -0.006), at(0.05, 0.036, -0.006));
        let (thumb, bend, nail) = (at(0.034, 0.03, -0.006), at(0.064, 0.06, -0.008), at(0.09, 0.074, -0.01));
        let recipe = &mut self.recipe;
        for &(root, knuckle, ..) in &rays {
            let girth = Girth(0.019 * size, 0.0165 * size, 0.0);
            recipe.flat_spindle(palm_join, root, knuckle, girth, back, 0.72);
        }
        recipe.spindle(palm_join, ball_start, ball_end, Girth(0.015 * size, 0.014 * size, 0.002 * size));
        let finger = Join { bones: &[limb(FINGERS, side)], blend: 0.005 * size };
        for (_, knuckle, middle, tip, r) in rays {
            recipe.spindle(finger, knuckle, middle, Girth(1.05 * r * size, r * size, 0.0));
            recipe.spindle(finger, middle, tip, Girth(r * size, 0.85 * r * size, 0.0));
        }
        let join = Join { bones: &[limb(THUMB, side)], blend: 0.009 * size };
        recipe.spindle(join, thumb, bend, Girth(0.0125 * size, 0.0105 * size, 0.0));
        recipe.spindle(join, bend, nail, Girth(0.0105 * size, 0.009 * size, 0.0));
    }

    pub(super) fn leg(&mut self, side: usize) {
        use bone::*;
        let (girth, muscle, long) = (self.to.leg_girth, self.to.muscle, self.to.leg_length);
        let on = |p: Vec3| on_side(p, side);
        let (hip, knee, ankle) = (self.hip(), self.knee(), self.ankle());
        let thigh = Join { bones: &[limb(THIGH, side)], blend: 0.04 };
        let shin = Join { bones: &[limb(SHIN, side)], blend: 0.035 };
        let along =
            |a: Vec3, b: Vec3, t: f64, out: Vec3| on(vec3::add(lerp(a, b, t), vec3::scale(out, girth)));
        let (down, below) = (unit(vec3::sub(knee, hip)), unit(vec3::sub(ankle, knee)));
        let recipe = &mut self.recipe;
        let (start, end) = (along(hip, knee, 0.08, [0.004, 0.0, 0.0]), on(knee));
        recipe.spindle(thigh, start, end, Girth(0.081 * girth, 0.05 * girth, 0.004));
        let front = along(hip, knee, 0.45, [0.008, 0.0, 0.026]);
        recipe.tilted_ellipsoid(thigh, front, [0.058 * girth, 0.17 * long, 0.048 * girth * muscle], on(down));
        let behind = along(hip, knee, 0.48, [0.0, 0.0, -0.026]);
        recipe.tilted_ellipsoid(
            thigh,
            behind,
            [0.052 * girth, 0.16 * long, 0.046 * girth * muscle],
            on(down),
        );
        let cap = along(hip, knee, 0.99, [0.0, 0.0, 0.028]);
        recipe.ellipsoid(Join { blend: 0.025, ..thigh }, cap, [0.026 * girth, 0.034, 0.024 * girth]);
        let (near, far) = (along(knee, ankle, 0.0, [0.0; 3]), along(knee, ankle, 1.0, [0.0; 3]));
        recipe.spindle(shin, near, far, Girth(0.047 * girth, 0.03 * girth, 0.0));
        for (x, length) in [(-0.016, 0.1), (0.018, 0.088)] {
            let calf = along(knee, ankle, 0.3, [x, 0.0, -0.024]);
            recipe.tilted_ellipsoid(
                shin,
                calf,
                [0.033 * girth, length * long, 0.036 * girth * muscle],
                on(below),
            );
        }
        let edge = (along(knee, ankle, 0.05, [0.0, 0.0, 0.02]), along(knee, ankle, 0.8, [0.0, 0.0, 0.008]));
        recipe.spindle(shin, edge.0, edge.1, Girth(0.026 * girth, 0.02 * girth, 0.0));
    }

    pub(super) fn foot(&mut self, side: usize) {
        use bone::*;
        let size = FOOT_MAGNIFIED * self.to.foot;
        let at = |x: f64, y: f64, z: f64| on_side(self.sole([x, y, z]), side);
        let foot = Join { bones: &[limb(FOOT, side)], blend: 0.022 * size };
        let (ankle, heel) = (at(0.0, 0.0, 0.0), at(0.0, -0.052, -0.042));
        let (instep, ball) = (at(-0.004, -0.03, 0.05), at(-0.002, -0.062, 0.125));
        let malleoli = [at(0.025, 0.002, -0.004), at(-0.025, 0.01, 0.004)];
        let (tendon, sole) = (at(0.0, 0.03, -0.03), at(0.012, -0.063, 0.04));
        let sock = self.to.sock;
        // Toes, big toe first: place, reach and girth.
        let toes = [(-0.026, 0.19, 0.0155), (-0.004, 0.189, 0.0115), (0.012, 0.183, 0.011)];
        let small = [(0.026, 0.174, 0.0105), (0.038, 0.161, 0.0105)];
        let toes: Vec<_> = toes
            .into_iter()
            .chain(small)
            .map(|(x, reach, r)| {
                let (reach, r) = (reach - 0.025 * sock, r * (1.0 + 0.7 * sock));
                (at(0.85 * x, -0.062, 0.118), at((1.0 - 0.15 * sock) * x, -0.085 + r, reach - r), r)
            })
            .collect();
        let recipe = &mut self.recipe;
        recipe.spindle(foot, ankle, instep, Girth(0.037 * size, 0.034 * size, 0.0));
        recipe.flat_spindle(
            foot,
            instep,
            ball,
            Girth(0.036 * size, 0.042 * size, 0.0),
            [0.0, 1.0, 0.0],
            0.58,
        );
        recipe.flat_spindle(foot, heel, sole, Girth(0.033 * size, 0.03 * size, 0.0), [0.0, 1.0, 0.0], 0.85);
        recipe.spindle(foot, tendon, heel, Girth(0.02 * size, 0.026 * size, 0.0));
        for bump in malleoli {
            recipe.ellipsoid(
                Join { blend: 0.015 * size, ..foot },
                bump,
                vec3::scale([0.012, 0.015, 0.013], size),
            );
        }
        let join = Join { bones: &[limb(TOES, side)], blend: 0.006 * size };
        for (root, tip, r) in toes {
            recipe.spindle(join, root, tip, Girth(1.1 * r * size, r * size, 0.0));
        }
    }
}
