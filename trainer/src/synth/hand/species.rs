//! The species of hands.

use super::super::proportions::species;
use super::Proportions;

species! {
    barehand {}
    slimhand {
        palm_width: 0.88, palm_depth: 0.85, fingers: 1.06, girth: 0.84, tip: 0.94, knuckle: 1.2, ball: 0.85,
        forearm_girth: 0.85, spread: 1.1, nail: 0.4,
    }
    thickhand {
        size: 1.05, palm_width: 1.14, palm_depth: 1.25, fingers: 0.95, girth: 1.22, thumb: 0.98, ball: 1.2,
        forearm: 1.1, forearm_girth: 1.25, spread: 1.25,
    }
    childhand {
        size: 0.68, palm_length: 0.95, palm_width: 1.05, palm_depth: 1.2, fingers: 0.84, girth: 1.1, tip: 0.92,
        knuckle: 0.6, thumb: 0.88, ball: 1.2, forearm_girth: 1.08, forearm: 0.9,
    }
    longhand {
        size: 1.02, palm_length: 1.08, palm_width: 0.92, palm_depth: 0.9, fingers: 1.38, girth: 0.85, knuckle: 1.4,
        thumb: 1.25, ball: 0.9, forearm_girth: 0.85, spread: 1.15, forearm: 1.6, nail: 0.9,
    }
    glove {
        size: 1.1, palm_width: 1.18, palm_depth: 1.35, fingers: 0.92, girth: 1.36, tip: 1.12, knuckle: 0.5, ball: 1.3,
        spread: 1.6, forearm: 0.9, forearm_girth: 1.1, cuff: 1.3,
    }
}
