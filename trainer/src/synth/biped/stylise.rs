//! Bipeds as games and toy makers have them: big heads, hands and feet, short or long limbs, no fingers or toes.

use rand::Rng;

use super::super::random::{chance, normal, uniform};
use super::Proportions;

impl Proportions {
    /// The same kind of body in proportions that nobody has.
    pub(super) fn stylised(mut self, rng: &mut impl Rng) -> Self {
        // Of each proportion how much larger it gets, as a logarithm, how much that varies, and the largest of all.
        let draws: [(&mut f64, f64, f64, f64); 13] = [
            (&mut self.head, 0.25, 0.28, 2.3),
            (&mut self.head_width, 0.04, 0.1, 1.3),
            (&mut self.neck, -0.05, 0.2, 1.6),
            (&mut self.neck_length, -0.1, 0.25, 1.7),
            (&mut self.trunk, -0.05, 0.15, 1.4),
            (&mut self.shoulders, 0.0, 0.18, 1.5),
            (&mut self.waist, 0.0, 0.2, 1.7),
            (&mut self.arm_length, -0.06, 0.2, 1.5),
            (&mut self.arm_girth, 0.0, 0.22, 1.7),
            (&mut self.hand, 0.15, 0.2, 1.7),
            (&mut self.leg_length, -0.15, 0.22, 1.3),
            (&mut self.leg_girth, 0.0, 0.18, 1.5),
            (&mut self.foot, 0.15, 0.2, 1.8),
        ];
        for (value, mean, deviation, most) in draws {
            *value = (*value * normal(rng, mean, deviation).exp()).min(most);
        }
        self.muscle *= normal(rng, -0.15, 0.2).exp();
        if chance(rng, 0.5) {
            self.mitten = 1.0;
        }
        if chance(rng, 0.5) {
            self.sock = 1.0;
        }
        self
    }

    /// Between this body and a toy: a head as large as the trunk, no neck, stumps for limbs.
    pub(super) fn as_toy(self, rng: &mut impl Rng) -> Self {
        let mut within = |low: f64, high: f64| uniform(rng, low, high);
        let toy = Self {
            head: within(1.4, 3.2),
            head_width: within(0.9, 1.4),
            ear: within(0.5, 3.0),
            ear_rise: within(0.0, 1.0),
            neck: within(0.8, 1.8),
            neck_length: within(0.1, 0.9),
            trunk: within(0.6, 1.1),
            shoulders: within(0.65, 1.1),
            chest: within(0.8, 1.4),
            waist: within(0.8, 1.8),
            hips: within(0.8, 1.4),
            belly: within(0.0, 0.1),
            muscle: within(0.5, 0.9),
            arm_length: within(0.45, 1.0),
            arm_girth: within(0.6, 2.0),
            hand: within(0.7, 1.8),
            leg_length: within(0.25, 0.9),
            leg_girth: within(0.7, 2.0),
            foot: within(0.9, 2.2),
            muzzle: within(-0.5, 1.0).max(0.0),
            snout: within(-0.8, 1.0).max(0.0),
            ..self
        };
        let share = within(0.4, 1.0);
        let grown = |together: f64, coin: f64| if coin < 0.6 { 1.0 } else { together };
        let (mitten, sock) = (grown(self.mitten, within(0.0, 1.0)), grown(self.sock, within(0.0, 1.0)));
        Self { mitten, sock, ..self.mixed(&toy, share) }
    }
}
