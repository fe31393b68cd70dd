//! The species of bodies, and the families whose species correspond.

use std::sync::OnceLock;

use rand_chacha::ChaCha8Rng;

use super::correspond::Landmarks;
use super::math::Quat;
use super::random::{Purpose, chance, generator, generator_of_trial, uniform};
use super::recipe::Recipe;
use super::skeleton::Skeleton;
use super::surface::Surface;
use super::{biped, bird, fish, hand, insect, quadruped};

/// Species with one body plan. Bodies of one family correspond point by point, whatever their species.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// Walk on two legs: people, apes, stylised figures.
    Biped,
    /// Walk on four legs.
    Quadruped,
    /// Left hands with a part of the forearm.
    Hand,
    /// Have two wings and two legs.
    Bird,
    /// Swim: fish and dolphins.
    Fish,
    /// Walk on six legs: insects and figures like spiders.
    Insect,
}

/// A kind of body: a family, and proportions within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Species {
    family: Family,
    index: usize,
}

/// What a family has of its own.
pub(super) struct Plan {
    pub(super) name: &'static str,
    /// Names of the species.
    pub(super) species: &'static [&'static str],
    /// The species that datasets hold back for the test split.
    pub(super) held_out: Option<&'static str>,
    /// The body that the landmarks are chosen on.
    pub(super) base: fn() -> Recipe,
    /// The body of a breed; the first parts of all are those of the base.
    pub(super) breed: fn(&Breed, &mut ChaCha8Rng) -> Recipe,
    /// Local rotation of every bone in a random pose, and at rest.
    pub(super) pose: fn(&Skeleton, &mut ChaCha8Rng) -> Vec<Quat>,
    pub(super) rest: fn(&Skeleton, &mut ChaCha8Rng) -> Vec<Quat>,
}

/// What is known of a breed before its proportions are drawn.
pub(super) struct Breed {
    /// Index of the species in its family.
    pub(super) species: usize,
    /// Another species that it is partly, and how much.
    pub(super) other: Option<(usize, f64)>,
    /// Whether it differs from the typical body of its species.
    pub(super) varies: bool,
}

/// Share of the breeds that are half another species of the family.
const MIXED: f64 = 0.15;

impl Family {
    /// All families.
    pub const ALL: [Self; 6] =
        [Self::Biped, Self::Quadruped, Self::Hand, Self::Bird, Self::Fish, Self::Insect];

    /// Name in manifests: lower case, one word.
    pub fn name(self) -> &'static str {
        self.plan().name
    }

    pub(super) fn plan(self) -> &'static Plan {
        match self {
            Self::Biped => &biped::PLAN,
            Self::Quadruped => &quadruped::PLAN,
            Self::Hand => &hand::PLAN,
            Self::Bird => &bird::PLAN,
            Self::Fish => &fish::PLAN,
            Self::Insect => &insect::PLAN,
        }
    }

    /// The species of the family.
    pub fn species(self) -> impl Iterator<Item = Species> {
        (0..self.plan().species.len()).map(move |index| Species { family: self, index })
    }

    /// The landmarks of the family, on its base body.
    pub(super) fn landmarks(self) -> &'static Landmarks {
        static LANDMARKS: [OnceLock<Landmarks>; Family::ALL.len()] =
            [const { OnceLock::new() }; Family::ALL.len()];
        LANDMARKS[self as usize].get_or_init(|| {
            let recipe = (self.plan().base)();
            Surface::of(&recipe).landmarks(&recipe, &mut generator(self as usize, 0, Purpose::Landmarks))
        })
    }
}

impl Species {
    /// All species, family by family.
    pub fn all() -> Vec<Self> {
        Family::ALL.into_iter().flat_map(Family::species).collect()
    }

    /// Name in file names and manifests: lower case, one word.
    pub fn name(self) -> &'static str {
        self.family.plan().species[self.index]
    }

    /// The species of that [`Species::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|species| species.name() == name)
    }

    /// The species that it corresponds with.
    pub fn family(self) -> Family {
        self.family
    }

    /// Whether datasets hold the whole species back for the test split: one biped and one quadruped.
    pub fn held_out(self) -> bool {
        self.family.plan().held_out == Some(self.name())
    }

    /// A number of its own.
    pub(super) fn index(self) -> usize {
        100 * self.family as usize + self.index
    }

    /// The body of a breed: 0 has the typical proportions and wears nothing; others have proportions around these, or
    /// between these and those of another species. Another `trial` draws anew.
    pub(super) fn recipe(self, breed: u64, trial: u8) -> Recipe {
        let mut rng = generator_of_trial(self.index(), breed, Purpose::Breed, trial);
        let plan = self.family.plan();
        let other = (chance(&mut rng, MIXED) && breed > 0).then(|| {
            (uniform(&mut rng, 0.0, plan.species.len() as f64) as usize, uniform(&mut rng, 0.2, 0.6))
        });
        (plan.breed)(&Breed { species: self.index, other, varies: breed > 0 }, &mut rng)
    }
}
