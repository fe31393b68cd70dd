//! The species of bodies, and the families whose species correspond.

use std::sync::OnceLock;

use super::correspond::Landmarks;
use super::random::{Purpose, chance, generator, generator_of_trial, uniform};
use super::recipe::Recipe;
use super::surface::Surface;
use super::{biped, quadruped};

/// Species with one body plan. Bodies of one family correspond point by point, whatever their species.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// Walk on two legs: people, apes, stylised figures.
    Biped,
    /// Walk on four legs.
    Quadruped,
}

/// A kind of body: a family, and proportions within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Species {
    family: Family,
    index: usize,
}

/// Share of the breeds of bipeds that wear something.
const DRESSED: f64 = 0.18;
/// Share of the breeds that are half another species of the family.
const MIXED: f64 = 0.15;

impl Family {
    /// All families.
    pub const ALL: [Self; 2] = [Self::Biped, Self::Quadruped];

    /// Name in manifests: lower case, one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Biped => "biped",
            Self::Quadruped => "quadruped",
        }
    }

    fn n_species(self) -> usize {
        match self {
            Self::Biped => biped::SPECIES.len(),
            Self::Quadruped => quadruped::SPECIES.len(),
        }
    }

    /// The species of the family.
    pub fn species(self) -> impl Iterator<Item = Species> {
        (0..self.n_species()).map(move |index| Species { family: self, index })
    }

    /// The landmarks of the family, on its base body.
    pub(super) fn landmarks(self) -> &'static Landmarks {
        static LANDMARKS: [OnceLock<Landmarks>; 2] = [const { OnceLock::new() }; 2];
        LANDMARKS[self as usize].get_or_init(|| {
            let recipe = match self {
                Self::Biped => biped::recipe(&biped::Proportions::default(), &biped::Outfit::default()),
                Self::Quadruped => quadruped::recipe(&quadruped::Proportions::default()),
            };
            Surface::of(&recipe).landmarks(&recipe, &mut generator(self as usize, 0, Purpose::Landmarks))
        })
    }
}

impl Species {
    /// All species: bipeds first, then quadrupeds.
    pub fn all() -> Vec<Self> {
        Family::ALL.into_iter().flat_map(Family::species).collect()
    }

    /// Name in file names and manifests: lower case, one word.
    pub fn name(self) -> &'static str {
        match self.family {
            Family::Biped => biped::SPECIES[self.index].0,
            Family::Quadruped => quadruped::SPECIES[self.index].0,
        }
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
        matches!(self.name(), "slender" | "panther")
    }

    /// A number of its own.
    pub(super) fn index(self) -> usize {
        100 * self.family as usize + self.index
    }

    /// The body of a breed: 0 has the typical proportions and wears nothing; others have proportions around these, or between
    /// these and those of another species. Another `trial` draws anew.
    pub(super) fn recipe(self, breed: u64, trial: u8) -> Recipe {
        let mut rng = generator_of_trial(self.index(), breed, Purpose::Breed, trial);
        let other = (chance(&mut rng, MIXED) && breed > 0).then(|| {
            (uniform(&mut rng, 0.0, self.family.n_species() as f64) as usize, uniform(&mut rng, 0.2, 0.6))
        });
        let width = if breed > 0 { 1.0 } else { 0.0 };
        match self.family {
            Family::Biped => {
                let own = biped::SPECIES[self.index].1();
                let mixed = other.map_or(own, |(other, t)| own.mixed(&biped::SPECIES[other].1(), t));
                let proportions = mixed.varied(&mut rng, width);
                let dressed = breed > 0 && chance(&mut rng, DRESSED);
                let outfit = if dressed { biped::Outfit::random(&mut rng) } else { biped::Outfit::default() };
                biped::recipe(&proportions, &outfit)
            }
            Family::Quadruped => {
                let own = quadruped::SPECIES[self.index].1();
                let mixed = other.map_or(own, |(other, t)| own.mixed(&quadruped::SPECIES[other].1(), t));
                quadruped::recipe(&mixed.varied(&mut rng, width))
            }
        }
    }
}
