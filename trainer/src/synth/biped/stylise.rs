//! Bipeds as toys and cartoons have them: big heads, hands and feet, short or long limbs, no fingers or toes.

use rand::Rng;

use super::super::random::{chance, normal};
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
}
