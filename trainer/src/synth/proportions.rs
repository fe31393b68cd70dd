//! Proportions of bodies: numbers that vary from species to species and from breed to breed.

/// Defines `Proportions`: for each field its default and how much it varies, as the deviation of its logarithm, or of
/// itself where the default is 0.
macro_rules! proportions {
    ($($(#[$doc:meta])* $field:ident = $default:expr, $spread:expr;)*) => {
        /// Proportions of a species or breed, relative to the typical body's (1, or 0 for what it lacks) unless said
        /// otherwise.
        #[derive(Clone, Copy, Debug)]
        pub(super) struct Proportions { $($(#[$doc])* pub(super) $field: f64,)* }

        impl Default for Proportions {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl Proportions {
            /// Random proportions around these; `width` multiplies all deviations.
            pub(super) fn varied(mut self, rng: &mut impl rand::Rng, width: f64) -> Self {
                $({
                    let draw = $crate::synth::random::normal(rng, 0.0, width * $spread);
                    self.$field = if $default == 0.0 { (self.$field + draw).max(0.0) } else { self.$field * draw.exp() };
                })*
                self
            }

            /// Between these and others: `t` = 0 gives these.
            pub(super) fn mixed(&self, other: &Self, t: f64) -> Self {
                Self { $($field: self.$field + t * (other.$field - self.$field),)* }
            }
        }
    };
}

/// Defines the species of a family: of each its name, and the proportions that are not the default ones.
macro_rules! species {
    ($($name:ident { $($field:ident: $value:expr),* $(,)? })*) => {
        /// The name of each species.
        pub(super) const NAMES: &[&str] = &[$(stringify!($name)),*];

        /// The proportions of a breed.
        pub(super) fn proportions(
            breed: &$crate::synth::species::Breed,
            rng: &mut impl rand::Rng,
        ) -> Proportions {
            const TYPICAL: &[fn() -> Proportions] =
                &[$(|| Proportions { $($field: $value,)* ..Proportions::default() }),*];
            let own = TYPICAL[breed.species]();
            let mixed = breed.other.map_or(own, |(other, t)| own.mixed(&TYPICAL[other](), t));
            mixed.varied(rng, if breed.varies { 1.0 } else { 0.0 })
        }
    };
}

pub(super) use {proportions, species};
