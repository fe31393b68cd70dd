//! Postures of bipeds: walking, sitting, kicking and others.

use rand::Rng;

use super::pose::{Arm, HANGING, Leg, Posture, STANDING};
use super::random::{chance, direction, normal, uniform};

/// A random one of the postures.
pub(super) fn archetype(rng: &mut impl Rng) -> Posture {
    match rng.random_range(0..17) {
        0 => STANDING,
        1 => stride(rng, 22.0, 30.0),
        2 => stride(rng, 45.0, 85.0),
        3 => reaching_up(rng),
        4 => reaching_forward(rng),
        5 => sitting(rng),
        6 => crouching(rng),
        7 => bowing(rng),
        8 => arms_out(rng),
        9 => lunging(rng),
        10 => one_leg(rng),
        11 => guarding(rng),
        12 => hands_on_hips(rng),
        13 => kicking(rng),
        14 => leaning(rng),
        15 => kneeling(rng),
        _ => free(rng),
    }
}

/// A step of walking or running: `swing` of the legs, `elbow` bend.
fn stride(rng: &mut impl Rng, swing: f64, elbow: f64) -> Posture {
    let mut posture = STANDING;
    let (swing, phase) = (normal(rng, swing, 0.2 * swing).to_radians(), uniform(rng, 0.3, 1.0));
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        let angle: f64 = sign * phase * swing;
        let (leg, arm) = (&mut posture.legs[side], &mut posture.arms[side]);
        leg.aim = [0.06, -angle.cos(), angle.sin()];
        leg.knee =
            if sign > 0.0 { 0.7 * angle.to_degrees() } else { uniform(rng, 10.0, 30.0 + 60.0 * swing) };
        leg.ankle = if sign > 0.0 { -5.0 } else { 15.0 };
        arm.aim = [0.22, -angle.cos(), -0.9 * angle.sin()];
        arm.elbow = normal(rng, elbow, 12.0);
    }
    posture.spine = [6.0 + 8.0 * swing, 0.0, 8.0 * phase];
    posture
}

fn reaching_up(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    let both = chance(rng, 0.6);
    for side in 0..if both { 2 } else { 1 } {
        posture.arms[side] = Arm {
            aim: direction(rng, [0.45, 1.0, 0.25], 0.2),
            elbow: uniform(rng, 2.0, 50.0),
            curl: uniform(rng, 0.0, 30.0),
            ..HANGING
        };
    }
    posture.head[0] = normal(rng, -12.0, 8.0);
    posture
}

fn reaching_forward(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for arm in &mut posture.arms {
        *arm =
            Arm { aim: direction(rng, [0.25, -0.1, 1.0], 0.22), elbow: uniform(rng, 2.0, 60.0), ..HANGING };
    }
    posture.tilt = uniform(rng, 0.0, 12.0);
    posture.spine[0] = uniform(rng, 0.0, 25.0);
    posture
}

fn sitting(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for side in 0..2 {
        let rise = uniform(rng, -0.35, 0.1);
        let knee = uniform(rng, 60.0, 100.0);
        posture.legs[side] = Leg { aim: [uniform(rng, 0.1, 0.35), rise, 1.0], twist: 0.0, knee, ankle: 0.0 };
        posture.arms[side] = Arm { aim: [0.25, -1.0, 0.35], elbow: uniform(rng, 30.0, 80.0), ..HANGING };
    }
    posture.spine[0] = uniform(rng, -5.0, 20.0);
    posture
}

fn crouching(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    let depth = uniform(rng, 0.4, 1.0);
    for side in 0..2 {
        let flex = (112.0 * depth + normal(rng, 0.0, 6.0)).to_radians();
        let (knee, ankle) = (125.0 * depth + normal(rng, 0.0, 6.0), -24.0 * depth);
        posture.legs[side] = Leg { aim: [0.3, -flex.cos(), flex.sin()], twist: 12.0, knee, ankle };
        let aim = direction(rng, [0.3, -0.6, 0.8], 0.25);
        posture.arms[side] = Arm { aim, elbow: uniform(rng, 10.0, 80.0), ..HANGING };
    }
    posture.tilt = 35.0 * depth;
    posture.spine[0] = uniform(rng, 5.0, 35.0);
    posture.head[0] = -15.0 * depth;
    posture
}

fn bowing(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    posture.tilt = uniform(rng, 20.0, 50.0);
    posture.spine[0] = uniform(rng, 20.0, 50.0);
    let tilt = posture.tilt.to_radians();
    for side in 0..2 {
        posture.legs[side].aim = [0.12, -tilt.cos(), tilt.sin()];
        posture.legs[side].knee = uniform(rng, 2.0, 25.0);
        posture.arms[side].aim = direction(rng, [0.2, -0.6, 1.0], 0.25);
        posture.arms[side].elbow = uniform(rng, 2.0, 40.0);
    }
    posture
}

fn arms_out(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for arm in &mut posture.arms {
        let aim = [1.0, uniform(rng, -0.6, 0.5), uniform(rng, -0.3, 0.4)];
        *arm =
            Arm { aim, twist: normal(rng, 0.0, 25.0), elbow: uniform(rng, 0.0, 90.0), curl: 8.0, ..HANGING };
    }
    for leg in &mut posture.legs {
        leg.aim[0] = uniform(rng, 0.05, 0.4);
    }
    posture
}

fn lunging(rng: &mut impl Rng) -> Posture {
    let mut posture = arms_out(rng);
    let reach = uniform(rng, 40.0, 80.0);
    let (front, rear) = (reach.to_radians(), uniform(rng, 15.0, 30.0).to_radians());
    posture.legs[0] =
        Leg { aim: [0.15, -front.cos(), front.sin()], twist: 5.0, knee: reach + 5.0, ankle: -3.0 };
    let knee = uniform(rng, 5.0, 50.0);
    posture.legs[1] = Leg { aim: [0.15, -rear.cos(), -rear.sin()], twist: 10.0, knee, ankle: -10.0 };
    posture.spine[0] = uniform(rng, 0.0, 20.0);
    posture
}

fn one_leg(rng: &mut impl Rng) -> Posture {
    let mut posture = if chance(rng, 0.5) { arms_out(rng) } else { STANDING };
    let aim = direction(rng, [0.3, -0.3, 1.0], 0.25);
    posture.legs[0] =
        Leg { aim, twist: 10.0, knee: uniform(rng, 5.0, 100.0), ankle: uniform(rng, -10.0, 25.0) };
    posture.spine[0] = uniform(rng, -5.0, 20.0);
    posture
}

fn guarding(rng: &mut impl Rng) -> Posture {
    let mut posture = stride(rng, 14.0, 90.0);
    for arm in &mut posture.arms {
        let aim = direction(rng, [0.35, -0.55, 0.8], 0.15);
        *arm = Arm { aim, elbow: uniform(rng, 70.0, 125.0), curl: uniform(rng, 40.0, 85.0), ..HANGING };
    }
    posture
}

fn hands_on_hips(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for arm in &mut posture.arms {
        let aim = direction(rng, [0.75, -0.8, -0.25], 0.06);
        *arm = Arm { aim, twist: -45.0, elbow: normal(rng, 82.0, 6.0), ..HANGING };
    }
    posture
}

fn kicking(rng: &mut impl Rng) -> Posture {
    let mut posture = if chance(rng, 0.5) { guarding(rng) } else { arms_out(rng) };
    let aim = direction(rng, [0.3, 0.1, 1.0], 0.3);
    posture.legs[0] =
        Leg { aim, twist: 0.0, knee: uniform(rng, 0.0, 45.0), ankle: uniform(rng, -10.0, 30.0) };
    posture.legs[1].knee = uniform(rng, 2.0, 25.0);
    posture.tilt = uniform(rng, -20.0, 5.0);
    posture.spine = [uniform(rng, -10.0, 30.0), uniform(rng, -15.0, 15.0), uniform(rng, -25.0, 25.0)];
    posture
}

/// Bent and turned sideways, one arm over the head.
fn leaning(rng: &mut impl Rng) -> Posture {
    let mut posture = arms_out(rng);
    posture.spine = [uniform(rng, -15.0, 30.0), uniform(rng, 12.0, 28.0), uniform(rng, -45.0, 45.0)];
    posture.arms[1].aim = direction(rng, [0.3, 1.0, 0.1], 0.25);
    posture.head = [0.0, uniform(rng, -20.0, 20.0), uniform(rng, -40.0, 40.0)];
    posture
}

fn kneeling(rng: &mut impl Rng) -> Posture {
    let mut posture = if chance(rng, 0.5) { reaching_forward(rng) } else { STANDING };
    let one = chance(rng, 0.5);
    posture.legs[0] =
        Leg { aim: [0.15, -1.0, 0.05], twist: 5.0, knee: uniform(rng, 85.0, 110.0), ankle: 35.0 };
    posture.legs[1] = if one {
        Leg {
            aim: [0.2, uniform(rng, -0.3, 0.1), 1.0],
            twist: 5.0,
            knee: uniform(rng, 80.0, 100.0),
            ankle: 0.0,
        }
    } else {
        posture.legs[0]
    };
    posture
}

fn free(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for side in 0..2 {
        let aim = [uniform(rng, 0.15, 1.0), uniform(rng, -1.0, 0.9), uniform(rng, -0.35, 1.0)];
        let (twist, elbow) = (uniform(rng, -40.0, 40.0), uniform(rng, 0.0, 110.0));
        let (pronation, wrist) = (uniform(rng, -50.0, 50.0), uniform(rng, -35.0, 35.0));
        posture.arms[side] = Arm { aim, twist, elbow, pronation, wrist, curl: uniform(rng, 0.0, 75.0) };
        let aim = [uniform(rng, 0.05, 0.5), -1.0, uniform(rng, -0.4, 0.9)];
        let knee = uniform(rng, 2.0, 70.0);
        posture.legs[side] =
            Leg { aim, twist: uniform(rng, -15.0, 25.0), knee, ankle: uniform(rng, -15.0, 25.0) };
    }
    posture.spine = [uniform(rng, -15.0, 40.0), uniform(rng, -20.0, 20.0), uniform(rng, -35.0, 35.0)];
    posture.head = [uniform(rng, -25.0, 25.0), uniform(rng, -15.0, 15.0), uniform(rng, -50.0, 50.0)];
    posture
}
