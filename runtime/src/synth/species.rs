//! The families of bodies, and the proportions of each.

use super::recipe::Recipe;
use super::{biped, quadruped};

/// A family of bodies. Shapes of one species correspond point by point; shapes of two species do not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Species {
    /// An adult man.
    Man,
    /// An adult woman.
    Woman,
    /// A child of about five years: large head, short limbs.
    Child,
    /// A heavy adult: thick trunk and limbs.
    Heavy,
    /// A tall and thin adult.
    Slender,
    /// An ape that stands upright: long arms, short legs, muzzle.
    Ape,
    /// A dog with erect ears.
    Dog,
    /// A cat: low, supple, long tail.
    Cat,
    /// A horse: long legs and neck, hooves.
    Horse,
    /// A bear: massive, short legs, hardly any tail.
    Bear,
}

impl Species {
    /// All species: bipeds first, then quadrupeds.
    pub const ALL: [Self; 10] = [
        Self::Man,
        Self::Woman,
        Self::Child,
        Self::Heavy,
        Self::Slender,
        Self::Ape,
        Self::Dog,
        Self::Cat,
        Self::Horse,
        Self::Bear,
    ];

    /// Name in file names and manifests: lower case, one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Man => "man",
            Self::Woman => "woman",
            Self::Child => "child",
            Self::Heavy => "heavy",
            Self::Slender => "slender",
            Self::Ape => "ape",
            Self::Dog => "dog",
            Self::Cat => "cat",
            Self::Horse => "horse",
            Self::Bear => "bear",
        }
    }

    /// The species of that [`Species::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|species| species.name() == name)
    }

    /// Whether it walks on two legs.
    pub fn is_biped(self) -> bool {
        !matches!(self, Self::Dog | Self::Cat | Self::Horse | Self::Bear)
    }

    /// Whether datasets hold the whole species back for the test split: one biped and one quadruped.
    pub fn held_out(self) -> bool {
        matches!(self, Self::Slender | Self::Cat)
    }

    /// Position in [`Species::ALL`].
    pub(super) fn index(self) -> usize {
        self as usize
    }

    pub(super) fn recipe(self) -> Recipe {
        let adult = biped::Proportions::default();
        let dog = quadruped::Proportions::default();
        match self {
            Self::Man => biped::recipe(&biped::Proportions {
                shoulders: 1.06,
                chest: 1.05,
                waist: 1.07,
                hips: 0.97,
                ..adult
            }),
            Self::Woman => biped::recipe(&biped::Proportions {
                height: 1.65,
                neck: 0.86,
                shoulders: 0.93,
                chest: 0.92,
                waist: 0.92,
                hips: 1.06,
                breast: 0.045,
                buttocks: 1.08,
                arm_girth: 0.84,
                hand: 0.93,
                leg_girth: 1.0,
                foot: 0.93,
                ..adult
            }),
            Self::Child => biped::recipe(&biped::Proportions {
                height: 1.3,
                head: 1.38,
                neck: 0.86,
                trunk: 0.9,
                shoulders: 0.84,
                chest: 0.88,
                waist: 1.0,
                hips: 0.86,
                belly: 0.02,
                buttocks: 0.92,
                arm_length: 0.86,
                arm_girth: 0.86,
                hand: 0.92,
                leg_length: 0.84,
                leg_girth: 0.88,
                foot: 0.95,
                ..adult
            }),
            Self::Heavy => biped::recipe(&biped::Proportions {
                neck: 1.25,
                shoulders: 1.12,
                chest: 1.24,
                waist: 1.42,
                hips: 1.22,
                belly: 0.09,
                breast: 0.03,
                buttocks: 1.3,
                arm_girth: 1.32,
                hand: 1.05,
                leg_girth: 1.26,
                foot: 1.04,
                ..adult
            }),
            Self::Slender => biped::recipe(&biped::Proportions {
                height: 1.82,
                head: 0.92,
                neck: 0.85,
                shoulders: 0.92,
                chest: 0.86,
                waist: 0.82,
                hips: 0.88,
                buttocks: 0.86,
                arm_length: 1.06,
                arm_girth: 0.76,
                leg_length: 1.08,
                leg_girth: 0.78,
                ..adult
            }),
            Self::Ape => biped::recipe(&biped::Proportions {
                height: 1.6,
                head: 1.05,
                neck: 1.35,
                trunk: 1.12,
                shoulders: 1.22,
                chest: 1.22,
                waist: 1.2,
                hips: 1.02,
                belly: 0.035,
                buttocks: 0.85,
                arm_length: 1.38,
                arm_girth: 1.2,
                hand: 1.25,
                leg_length: 0.7,
                leg_girth: 0.95,
                foot: 1.15,
                muzzle: 1.0,
                ..adult
            }),
            Self::Dog => quadruped::recipe(&dog),
            Self::Cat => quadruped::recipe(&quadruped::Proportions::cat()),
            Self::Horse => quadruped::recipe(&quadruped::Proportions::horse()),
            Self::Bear => quadruped::recipe(&quadruped::Proportions::bear()),
        }
    }
}
