//! The species of quadrupeds.

use super::super::proportions::species;
use super::Proportions;

species! {
    dog {}
    cat {
        size: 0.5, legs: 0.86, leg_girth: 0.95, trunk: 1.05, chest: 0.82, loin: 0.98, rump: 0.92, neck: 0.72,
        neck_girth: 0.86, neck_rise: 42.0, head: 1.06, muzzle: 0.42, muzzle_girth: 0.86, ear: 0.9, ear_width: 1.45,
        tail: 1.75, tail_girth: 0.85, tail_drop: 25.0, paw: 1.08,
    }
    horse {
        size: 2.15, legs: 1.34, leg_girth: 0.98, trunk: 1.06, chest: 1.06, loin: 1.24, rump: 1.22, neck: 1.5,
        neck_girth: 1.22, neck_rise: 52.0, head: 1.02, muzzle: 1.45, muzzle_girth: 1.5, ear: 0.75, ear_width: 0.7,
        tail: 1.25, tail_girth: 1.35, tail_drop: 72.0, brush: 0.6, paw: 1.02, hoof: 1.0,
    }
    bear {
        size: 1.7, legs: 0.84, leg_girth: 1.62, trunk: 1.06, chest: 1.26, loin: 1.6, rump: 1.42, hump: 0.03,
        neck: 0.82, neck_girth: 1.45, neck_rise: 22.0, head: 1.22, muzzle: 0.85, muzzle_girth: 1.15, ear: 0.5,
        ear_width: 1.25, tail: 0.22, tail_girth: 1.3, tail_drop: 50.0, paw: 1.6,
    }
    wolf {
        size: 1.2, legs: 1.08, leg_girth: 1.0, chest: 1.05, neck: 0.95, neck_girth: 1.25, neck_rise: 30.0,
        throat: 1.3, head: 1.08, muzzle: 1.15, ear: 0.9, tail: 1.05, tail_girth: 1.3, brush: 0.8, tail_drop: 55.0,
    }
    fox {
        size: 0.65, legs: 0.9, leg_girth: 0.8, chest: 0.82, loin: 0.9, rump: 0.88, neck: 0.85, neck_girth: 1.05,
        neck_rise: 38.0, head: 1.08, muzzle: 0.95, muzzle_girth: 0.75, ear: 1.35, ear_width: 1.2, tail: 1.5,
        tail_girth: 1.3, brush: 1.3, tail_drop: 30.0, paw: 0.85,
    }
    hound {
        size: 0.95, legs: 1.25, leg_girth: 0.82, trunk: 1.05, chest: 1.02, loin: 0.72, rump: 0.86, neck: 1.25,
        neck_girth: 0.8, neck_rise: 45.0, throat: 0.8, head: 0.95, head_width: 0.88, muzzle: 1.35,
        muzzle_girth: 0.85, ear: 0.9, ear_drop: 1.3, tail: 1.2, tail_girth: 0.6, tail_drop: 60.0, paw: 0.9,
    }
    dachshund {
        size: 0.5, legs: 0.42, leg_girth: 1.05, trunk: 1.35, chest: 0.95, neck: 0.95, neck_rise: 45.0, head: 1.1,
        muzzle: 1.2, ear: 1.3, ear_width: 1.4, ear_drop: 1.8, tail: 0.95, tail_girth: 0.85, tail_drop: 10.0,
        paw: 1.1,
    }
    bulldog {
        size: 0.65, legs: 0.72, leg_girth: 1.4, trunk: 0.9, chest: 1.25, loin: 1.1, rump: 1.0, neck: 0.65,
        neck_girth: 1.45, neck_rise: 38.0, throat: 1.5, head: 1.35, head_width: 1.15, muzzle: 0.35,
        muzzle_girth: 1.7, ear: 0.7, ear_drop: 1.2, tail: 0.3, paw: 1.2,
    }
    lion {
        size: 1.7, legs: 0.92, leg_girth: 1.25, trunk: 1.12, chest: 1.05, loin: 1.12, rump: 1.08, neck: 0.75,
        neck_girth: 1.2, neck_rise: 32.0, throat: 1.2, head: 1.25, muzzle: 0.7, muzzle_girth: 1.35, ear: 0.45,
        ear_width: 1.2, tail: 1.6, tail_girth: 0.75, tail_drop: 55.0, paw: 1.35, mane: 1.15,
    }
    panther {
        size: 1.4, legs: 0.88, leg_girth: 1.12, trunk: 1.15, chest: 0.95, loin: 1.02, rump: 1.0, neck: 0.75,
        neck_girth: 1.1, neck_rise: 25.0, head: 1.12, muzzle: 0.6, muzzle_girth: 1.2, ear: 0.5, ear_width: 1.2,
        tail: 1.9, tail_girth: 0.9, tail_drop: 45.0, paw: 1.3,
    }
    cow {
        size: 2.0, legs: 0.98, leg_girth: 1.02, trunk: 1.18, chest: 1.2, loin: 1.5, rump: 1.32, belly: 0.04,
        neck: 0.95, neck_girth: 1.2, neck_rise: 18.0, throat: 1.35, head: 1.12, muzzle: 1.35, muzzle_girth: 1.7,
        ear: 0.9, ear_width: 1.0, ear_drop: 1.05, tail: 1.5, tail_girth: 0.6, tail_drop: 82.0, paw: 1.05, hoof: 1.0,
        horn: 0.8,
    }
    calf {
        size: 1.3, legs: 1.2, leg_girth: 1.05, trunk: 0.98, chest: 0.98, loin: 1.2, rump: 1.1, neck: 0.95,
        neck_girth: 1.0, neck_rise: 32.0, head: 1.22, muzzle: 1.1, muzzle_girth: 1.55, ear: 1.1, ear_width: 1.1,
        ear_drop: 1.0, tail: 1.2, tail_girth: 0.6, tail_drop: 80.0, hoof: 1.0,
    }
    pig {
        size: 1.0, legs: 0.55, leg_girth: 1.25, trunk: 1.12, chest: 1.2, loin: 1.5, rump: 1.32, belly: 0.03,
        neck: 0.55, neck_girth: 1.7, neck_rise: 12.0, throat: 1.5, head: 1.3, head_width: 1.1, muzzle: 1.05,
        muzzle_girth: 1.7, ear: 1.1, ear_width: 1.3, ear_drop: 0.5, tail: 0.5, tail_girth: 0.5, tail_drop: 30.0,
        hoof: 1.0,
    }
    hippo {
        size: 1.9, legs: 0.5, leg_girth: 1.9, trunk: 1.22, chest: 1.45, loin: 1.95, rump: 1.6, belly: 0.06,
        neck: 0.6, neck_girth: 2.1, neck_rise: 8.0, throat: 1.6, head: 1.65, head_width: 1.1, muzzle: 1.15,
        muzzle_girth: 2.3, ear: 0.4, ear_width: 0.8, tail: 0.45, tail_girth: 0.9, tail_drop: 80.0, paw: 1.7,
        hoof: 0.4,
    }
    rhino {
        size: 1.9, legs: 0.62, leg_girth: 1.85, trunk: 1.2, chest: 1.4, loin: 1.75, rump: 1.5, hump: 0.03,
        belly: 0.04, neck: 0.75, neck_girth: 1.85, neck_rise: 4.0, throat: 1.4, head: 1.35, muzzle: 1.5,
        muzzle_girth: 1.6, ear: 0.8, ear_width: 1.0, tail: 0.7, tail_girth: 0.6, tail_drop: 75.0, paw: 1.6,
        hoof: 0.5,
    }
    elephant {
        size: 2.6, legs: 1.0, leg_girth: 2.0, trunk: 1.05, chest: 1.45, loin: 1.85, rump: 1.55, belly: 0.03,
        neck: 0.55, neck_girth: 1.9, neck_rise: 22.0, throat: 1.2, head: 1.6, muzzle: 0.3, muzzle_girth: 1.5,
        ear: 2.2, ear_width: 3.2, ear_drop: 1.25, tail: 0.95, tail_girth: 0.6, tail_drop: 82.0, paw: 1.75,
        hoof: 0.6, proboscis: 1.0,
    }
    deer {
        size: 1.5, legs: 1.42, leg_girth: 0.75, trunk: 1.02, chest: 0.92, loin: 0.98, rump: 0.98, neck: 1.4,
        neck_girth: 0.95, neck_rise: 55.0, head: 0.92, muzzle: 1.2, muzzle_girth: 0.95, ear: 1.4, ear_width: 1.1,
        ear_drop: 0.6, tail: 0.3, tail_girth: 0.8, tail_drop: 60.0, paw: 0.85, hoof: 1.0, horn: 1.3, antler: 1.0,
    }
    goat {
        size: 1.0, legs: 1.05, leg_girth: 0.85, chest: 1.0, loin: 1.2, rump: 1.05, belly: 0.02, neck: 1.1,
        neck_girth: 1.05, neck_rise: 48.0, head: 1.05, muzzle: 1.05, muzzle_girth: 1.05, ear: 1.0, ear_drop: 1.0,
        tail: 0.3, tail_drop: -20.0, paw: 0.85, hoof: 1.0, horn: 0.9, antler: 0.45,
    }
    sheep {
        size: 1.0, legs: 0.8, leg_girth: 0.8, chest: 1.3, loin: 1.65, rump: 1.4, neck: 0.9, neck_girth: 1.45,
        neck_rise: 35.0, throat: 1.3, head: 1.0, muzzle: 1.0, muzzle_girth: 1.1, ear: 1.0, ear_drop: 1.1, tail: 0.4,
        tail_girth: 1.3, tail_drop: 75.0, paw: 0.8, hoof: 1.0,
    }
    giraffe {
        size: 2.6, legs: 1.75, leg_girth: 0.8, trunk: 0.9, chest: 1.1, loin: 1.0, rump: 0.95, hump: 0.03, neck: 3.0,
        neck_girth: 1.05, neck_rise: 62.0, head: 0.88, muzzle: 1.3, muzzle_girth: 1.1, ear: 0.9, ear_drop: 0.9,
        tail: 1.2, tail_girth: 0.6, tail_drop: 80.0, hoof: 1.0, horn: 0.35, antler: 0.45,
    }
    camel {
        size: 2.1, legs: 1.45, leg_girth: 0.95, chest: 1.15, loin: 1.1, rump: 1.05, hump: 0.09, neck: 1.7,
        neck_girth: 0.95, neck_rise: 38.0, head: 0.95, muzzle: 1.25, muzzle_girth: 1.2, ear: 0.5, tail: 0.9,
        tail_girth: 0.7, tail_drop: 78.0, paw: 1.3, hoof: 0.4,
    }
    mouse {
        size: 0.2, legs: 0.5, leg_girth: 0.95, trunk: 0.95, chest: 0.95, loin: 1.4, rump: 1.35, neck: 0.5,
        neck_girth: 1.2, neck_rise: 20.0, head: 1.35, muzzle: 0.75, muzzle_girth: 0.7, ear: 1.5, ear_width: 2.0,
        ear_drop: 0.5, tail: 2.2, tail_girth: 0.5, tail_drop: 30.0, paw: 1.2,
    }
    toy {
        size: 0.5, legs: 0.6, leg_girth: 1.9, trunk: 0.8, chest: 1.1, loin: 1.35, rump: 1.15, neck: 0.5,
        neck_girth: 1.35, neck_rise: 50.0, head: 1.75, head_width: 1.1, muzzle: 0.45, muzzle_girth: 1.5, ear: 1.3,
        ear_width: 1.8, ear_drop: 0.8, tail: 0.6, tail_girth: 1.4, tail_drop: 10.0, paw: 1.6, hoof: 0.3,
    }
}
