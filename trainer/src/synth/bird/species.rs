//! The species of birds.

use super::super::proportions::species;
use super::Proportions;

species! {
    songbird {
        size: 0.5, pitch: 32.0, girth: 1.08, neck: 0.55, neck_girth: 1.25, head: 1.3, beak: 0.6, beak_girth: 0.8,
        wing: 0.85, chord: 1.05, tail: 1.2, legs: 0.8, leg_girth: 0.85,
    }
    goose {
        size: 1.6, pitch: 10.0, trunk: 1.15, girth: 1.05, breast: 1.1, neck: 2.7, neck_girth: 0.85, neck_rise: 75.0,
        head: 0.95, beak: 1.15, beak_girth: 1.35, wing: 1.15, tail: 0.5, legs: 0.62, leg_girth: 1.3, foot: 1.25, web: 1.0,
    }
    eagle {
        size: 2.0, pitch: 48.0, girth: 0.98, breast: 1.05, neck: 0.85, neck_girth: 1.2, neck_rise: 70.0, head: 1.0,
        beak: 0.85, beak_girth: 1.2, hook: 0.55, wing: 1.4, chord: 1.35, tail: 1.1, fan: 1.3, legs: 0.8,
        leg_girth: 1.4, foot: 1.35,
    }
    penguin {
        size: 1.8, pitch: 82.0, trunk: 1.35, girth: 1.12, breast: 1.1, neck: 0.7, neck_girth: 1.35, neck_rise: 88.0,
        head: 1.05, beak: 1.05, beak_girth: 0.85, hook: 0.1, wing: 0.62, chord: 0.75, tail: 0.35, legs: 0.35,
        leg_girth: 1.5, foot: 1.3, web: 1.0,
    }
    flamingo {
        size: 2.2, pitch: 22.0, trunk: 0.9, girth: 0.85, neck: 3.6, neck_girth: 0.62, neck_rise: 72.0, head: 0.85,
        beak: 1.25, beak_girth: 1.2, hook: 0.7, wing: 1.15, tail: 0.5, legs: 2.8, leg_girth: 0.95, foot: 0.95, web: 1.0,
    }
    pigeon {}
    ostrich {
        size: 4.5, pitch: 12.0, girth: 1.15, breast: 1.1, neck: 2.6, neck_girth: 0.7, neck_rise: 78.0, head: 0.8,
        beak: 0.8, beak_girth: 1.4, wing: 0.6, chord: 1.0, tail: 0.5, fan: 1.5, legs: 2.3, leg_girth: 1.6, foot: 1.35,
    }
}
