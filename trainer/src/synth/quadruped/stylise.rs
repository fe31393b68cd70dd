//! Quadrupeds as toy makers have them: big heads, no necks, thick short legs.

use rand::Rng;

use super::super::random::uniform;
use super::Proportions;

impl Proportions {
    /// Between this body and a toy.
    pub(super) fn as_toy(self, rng: &mut impl Rng) -> Self {
        let mut within = |low: f64, high: f64| uniform(rng, low, high);
        let toy = Self {
            legs: within(0.35, 1.1),
            leg_girth: within(1.0, 2.4),
            trunk: within(0.6, 1.1),
            chest: within(0.9, 1.5),
            loin: within(1.0, 1.8),
            rump: within(0.9, 1.5),
            belly: within(0.0, 0.04),
            neck: within(0.3, 1.2),
            neck_girth: within(0.9, 1.8),
            neck_rise: within(15.0, 65.0),
            head: within(1.2, 2.5),
            head_width: within(0.9, 1.3),
            muzzle: within(0.3, 1.2),
            muzzle_girth: within(0.9, 2.2),
            ear: within(0.5, 2.2),
            ear_width: within(0.8, 2.5),
            ear_drop: within(0.0, 1.4),
            tail: within(0.3, 1.4),
            tail_girth: within(0.6, 1.8),
            paw: within(1.0, 1.9),
            ..self
        };
        let share = within(0.4, 1.0);
        self.mixed(&toy, share)
    }
}
