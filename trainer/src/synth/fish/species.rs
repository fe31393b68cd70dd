//! The species of fish, and of those that look like fish.

use super::super::proportions::species;
use super::Proportions;

species! {
    carp {}
    tuna {
        size: 1.6, girth: 0.98, height: 0.98, peduncle: 0.62, head: 0.95, snout: 0.8, tail: 1.25, tail_width: 0.8,
        fork: 1.2, dorsal: 0.75, dorsal_length: 0.6, anal: 0.9, pectoral: 1.15, pectoral_width: 0.75, pelvic: 0.6,
    }
    shark {
        size: 2.2, length: 1.28, girth: 0.95, height: 0.8, peduncle: 0.72, snout: 1.7, tail: 1.15, tail_width: 0.85,
        fork: 1.0, skew: 0.55, dorsal: 1.35, dorsal_length: 0.7, anal: 0.6, pectoral: 1.5, pectoral_width: 1.05,
        pelvic: 0.8,
    }
    eel {
        size: 1.3, length: 2.1, girth: 0.62, height: 0.46, peduncle: 1.15, head: 0.85, snout: 1.15, tail: 0.4,
        tail_width: 1.3, fork: 0.25, dorsal: 0.34, dorsal_length: 1.7, anal: 0.34, anal_length: 1.3, pectoral: 0.6,
        pelvic: 0.12,
    }
    dolphin {
        size: 2.0, length: 1.12, girth: 1.12, height: 0.84, peduncle: 0.85, head: 0.95, snout: 0.7, beak: 1.0,
        tail: 0.1, fluke: 1.0, dorsal: 1.1, dorsal_length: 0.75, anal: 0.1, pectoral: 1.15, pectoral_width: 1.05,
        pelvic: 0.1,
    }
    angelfish {
        size: 0.6, length: 0.8, girth: 0.78, height: 1.55, peduncle: 1.2, snout: 1.1, tail: 0.95, tail_width: 1.25,
        fork: 0.6, dorsal: 1.8, dorsal_length: 1.4, anal: 2.0, anal_length: 1.3, pectoral: 0.8, pelvic: 1.2,
    }
    trout {
        size: 0.9, length: 1.12, girth: 0.95, height: 0.86, snout: 1.15, tail: 0.95, fork: 0.7, dorsal: 0.8,
        dorsal_length: 0.7, pectoral: 0.8, pelvic: 0.85,
    }
}
