//! The species of bipeds: people, apes and stylised figures.

use super::super::proportions::species;
use super::Proportions;

species! {
    man {
        shoulders: 1.06, chest: 1.05, waist: 1.07, hips: 0.97,
    }
    woman {
        height: 1.65, neck: 0.86, shoulders: 0.93, chest: 0.92, waist: 0.92, hips: 1.06, breast: 0.045,
        buttocks: 1.08, muscle: 0.85, arm_girth: 0.84, hand: 0.93, foot: 0.93,
    }
    child {
        height: 1.3, head: 1.38, neck: 0.86, trunk: 0.9, shoulders: 0.84, chest: 0.88, hips: 0.86, belly: 0.02,
        buttocks: 0.92, muscle: 0.7, arm_length: 0.86, arm_girth: 0.86, hand: 0.92, leg_length: 0.84,
        leg_girth: 0.88, foot: 0.95,
    }
    toddler {
        height: 1.05, head: 1.75, head_width: 1.05, neck: 0.95, neck_length: 0.8, trunk: 0.88, shoulders: 0.8,
        chest: 0.92, waist: 1.08, hips: 0.92, belly: 0.035, muscle: 0.6, arm_length: 0.74, arm_girth: 0.95,
        hand: 0.9, leg_length: 0.66, leg_girth: 0.98, foot: 0.92,
    }
    heavy {
        neck: 1.25, shoulders: 1.12, chest: 1.24, waist: 1.42, hips: 1.22, belly: 0.09, breast: 0.03, buttocks: 1.3,
        arm_girth: 1.32, hand: 1.05, leg_girth: 1.26, foot: 1.04,
    }
    slender {
        height: 1.82, head: 0.92, neck: 0.85, neck_length: 1.15, shoulders: 0.92, chest: 0.86, waist: 0.82,
        hips: 0.88, buttocks: 0.86, muscle: 0.8, arm_length: 1.06, arm_girth: 0.76, leg_length: 1.08,
        leg_girth: 0.78,
    }
    athlete {
        height: 1.85, head: 0.95, neck: 1.2, shoulders: 1.18, chest: 1.16, waist: 0.98, muscle: 1.35,
        arm_girth: 1.15, leg_girth: 1.1,
    }
    ape {
        height: 1.6, head: 1.05, ear: 0.7, neck: 1.35, trunk: 1.12, shoulders: 1.22, chest: 1.22, waist: 1.2,
        hips: 1.02, belly: 0.035, buttocks: 0.85, arm_length: 1.38, arm_girth: 1.2, hand: 1.25, leg_length: 0.7,
        leg_girth: 0.95, foot: 1.15, muzzle: 1.0,
    }
    monkey {
        height: 1.2, head: 1.2, ear: 1.9, neck: 0.85, shoulders: 0.85, chest: 0.88, waist: 0.85, hips: 0.85,
        arm_length: 1.15, arm_girth: 0.75, hand: 1.1, leg_length: 0.82, leg_girth: 0.75, foot: 1.2, muzzle: 0.6,
        tail: 1.3, tail_girth: 0.55,
    }
    teddy {
        height: 1.3, head: 1.7, head_width: 1.12, ear: 0.55, ear_rise: 1.0, neck: 1.6, neck_length: 0.55,
        trunk: 0.92, shoulders: 1.0, chest: 1.2, waist: 1.5, hips: 1.15, belly: 0.06, muscle: 0.7, arm_length: 0.62,
        arm_girth: 1.5, hand: 1.0, mitten: 1.0, leg_length: 0.5, leg_girth: 1.15, foot: 1.0, sock: 1.0, snout: 0.6,
    }
    doll {
        height: 1.4, head: 1.6, neck: 0.75, shoulders: 0.8, chest: 0.8, waist: 0.82, hips: 0.85, muscle: 0.55,
        arm_length: 0.88, arm_girth: 0.8, hand: 0.85, mitten: 0.7, leg_length: 0.85, leg_girth: 0.82, foot: 0.95,
        sock: 1.0,
    }
    giant {
        height: 2.2, head: 0.8, neck: 1.5, neck_length: 0.7, trunk: 1.1, shoulders: 1.45, chest: 1.4, waist: 1.2,
        muscle: 1.3, arm_length: 1.2, arm_girth: 1.5, hand: 1.3, leg_length: 0.85, leg_girth: 1.15, foot: 1.15,
    }
    armadillo {
        height: 1.5, head: 1.15, ear: 2.2, ear_rise: 0.8, neck: 1.35, neck_length: 0.7, shoulders: 1.1, chest: 1.2,
        waist: 1.3, hips: 1.12, belly: 0.03, muscle: 1.25, arm_length: 0.95, arm_girth: 1.3, hand: 1.3, spread: 1.2,
        leg_length: 0.75, leg_girth: 1.25, foot: 1.35, snout: 1.5, tail: 0.9, tail_girth: 1.7,
    }
    bearman {
        height: 1.8, head: 1.25, head_width: 1.1, ear: 0.6, ear_rise: 1.0, neck: 1.6, neck_length: 0.8,
        shoulders: 1.15, chest: 1.35, waist: 1.45, hips: 1.2, belly: 0.04, arm_girth: 1.4, hand: 1.2, mitten: 0.8,
        leg_length: 0.7, leg_girth: 1.25, foot: 1.2, sock: 0.8, snout: 1.1, tail: 0.15,
    }
}
