//! What triangulations are made, and what is drawn for each.

use super::Manner;
use crate::simulate::random::{generator, uniform, weighted};
use crate::simulate::{SimulateError, check};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Settings of [`triangulated`](super::triangulated()) and
/// [`write_triangulations`](crate::simulate::write_triangulations()).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct TriangulationOptions {
    /// Manners that are drawn from, separated by commas [default: all]
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = Self::default().manners, hide_default_value = true)]
    pub manners: Vec<Manner>,
    /// Fewest vertices, 100 to typical-vertices [default: 1000]
    #[arg(long, default_value_t = Self::default().min_vertices, hide_default_value = true)]
    pub min_vertices: usize,
    /// Half of the shapes have fewer vertices than this, half more, min-vertices to max-vertices [default: 5000]
    #[arg(long, default_value_t = Self::default().typical_vertices, hide_default_value = true)]
    pub typical_vertices: usize,
    /// Most vertices, typical-vertices to 60000; the numbers are met within a quarter [default: 15000]
    #[arg(long, default_value_t = Self::default().max_vertices, hide_default_value = true)]
    pub max_vertices: usize,
    /// Share of the shapes with noise, 0 to 1 [default: 0.2]
    #[arg(long, default_value_t = Self::default().noisy, hide_default_value = true)]
    pub noisy: f64,
    /// Largest root mean square displacement of the noise, relative to the mean edge length, 0 to 0.3 [default: 0.08]
    #[arg(long, default_value_t = Self::default().noise, hide_default_value = true)]
    pub noise: f64,
    /// Share of the shapes with 1 to 4 small holes, 0 to 1 [default: 0.15]
    #[arg(long, default_value_t = Self::default().holed, hide_default_value = true)]
    pub holed: f64,
    /// Share of the shapes without one or two of their ends, such as feet or hands, 0 to 1 [default: 0.1]
    #[arg(long, default_value_t = Self::default().cut, hide_default_value = true)]
    pub cut: f64,
    /// Share of the closed shapes whose skin has grown together where it nearly touches, 0 to 1 [default: 0.1]
    #[arg(long, default_value_t = Self::default().glued, hide_default_value = true)]
    pub glued: f64,
    /// Share of the shapes with 1 to 3 stray pieces beside them, 0 to 1 [default: 0.05]
    #[arg(long, default_value_t = Self::default().stray, hide_default_value = true)]
    pub stray: f64,
    /// Points that correspond, at most, 100 and up; of more, as many are chosen, evenly [default: 7000]
    #[arg(long, default_value_t = Self::default().landmarks, hide_default_value = true)]
    pub landmarks: usize,
    /// Triangulations of each shape, 1 to 1000 [default: 1]
    #[arg(long, default_value_t = Self::default().copies, hide_default_value = true)]
    pub copies: usize,
    /// Another seed, other triangulations [default: 0]
    #[arg(long, default_value_t = Self::default().seed, hide_default_value = true)]
    pub seed: u64,
}

impl Default for TriangulationOptions {
    fn default() -> Self {
        Self {
            manners: Manner::ALL.to_vec(),
            min_vertices: 1000,
            typical_vertices: 5000,
            max_vertices: 15_000,
            noisy: 0.2,
            noise: 0.08,
            holed: 0.15,
            cut: 0.1,
            glued: 0.1,
            stray: 0.05,
            landmarks: 7000,
            copies: 1,
            seed: 0,
        }
    }
}

impl TriangulationOptions {
    /// Whether every option is in its range.
    ///
    /// # Errors
    /// If one is not: the first.
    pub fn check(&self) -> Result<(), SimulateError> {
        check("manners", !self.manners.is_empty(), &self.manners, "one or more")?;
        let [least, typical, most] = [self.min_vertices, self.typical_vertices, self.max_vertices];
        check("min-vertices", least >= 100, least, "100 or more")?;
        let between = (least..=most).contains(&typical);
        check("typical-vertices", between, typical, "from min-vertices to max-vertices")?;
        check("max-vertices", most <= 60_000, most, "60000 at most")?;
        for (option, share) in [
            ("noisy", self.noisy),
            ("holed", self.holed),
            ("cut", self.cut),
            ("glued", self.glued),
            ("stray", self.stray),
        ] {
            check(option, (0.0..=1.0).contains(&share), share, "from 0 to 1")?;
        }
        check("noise", (0.0..=0.3).contains(&self.noise), self.noise, "from 0 to 0.3")?;
        check("landmarks", self.landmarks >= 100, self.landmarks, "100 or more")?;
        check("copies", (1..=1000).contains(&self.copies), self.copies, "from 1 to 1000")
    }
}

/// What is drawn for one shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// How it is triangulated.
    pub manner: Manner,
    /// Vertices wanted, before any are lost to damage; of [`Manner::Original`], the most it may have.
    pub vertices: usize,
    /// Root mean square displacement along the normals, relative to the mean edge length.
    pub noise: f64,
    /// Number of small holes.
    pub holes: usize,
    /// Number of ends cut off.
    pub cuts: usize,
    /// Whether skin that nearly touches has grown together.
    pub glued: bool,
    /// Number of stray pieces.
    pub pieces: usize,
}

impl Plan {
    /// The plan of shape number `index`, and the generator for carrying it out. A shape that is not `closed` has no
    /// inside: nothing of it is glued, and it is not marched through.
    pub(super) fn draw(options: &TriangulationOptions, index: u64, closed: bool) -> (Self, ChaCha8Rng) {
        let mut rng = generator(options.seed, index);
        let shares: Vec<f64> = (options.manners.iter())
            .map(|m| if closed || !m.needs_closed() { m.share() } else { 0.0 })
            .collect();
        let manner = match shares.iter().any(|share| *share > 0.0) {
            true => options.manners[weighted(&mut rng, &shares) as usize],
            false => Manner::Isotropic,
        };
        let [least, typical, most] =
            [options.min_vertices, options.typical_vertices, options.max_vertices].map(|n| (n as f64).ln());
        let (low, high) = if rng.random() { (least, typical) } else { (typical, most) };
        let vertices = (uniform(&mut rng, low, high).exp().round() as usize).clamp(
            options.min_vertices.max(manner.least_vertices()).min(options.max_vertices),
            options.max_vertices,
        );
        let vertices = if manner == Manner::Original { options.max_vertices } else { vertices };
        // Every share is drawn whatever came before, so that one option does not shift what the others get.
        let mut chosen = |share: f64| rng.random::<f64>() < share;
        let [noisy, holed, cut, glued, stray] =
            [options.noisy, options.holed, options.cut, options.glued, options.stray].map(&mut chosen);
        let mut count = |chosen: bool, most: usize| {
            let count = rng.random_range(1..=most);
            if chosen { count } else { 0 }
        };
        let [holes, cuts, pieces] = [count(holed, 4), count(cut, 2), count(stray, 3)];
        let strength = uniform(&mut rng, 0.2, 1.0);
        let noise = if noisy { options.noise * strength } else { 0.0 };
        (Self { manner, vertices, noise, holes, cuts, glued: glued && closed, pieces }, rng)
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:?}, {} vertices", self.manner, self.vertices)?;
        let damage = [
            (self.noise > 0.0, "noise"),
            (self.holes > 0, "holes"),
            (self.cuts > 0, "cut"),
            (self.glued, "glued"),
            (self.pieces > 0, "stray pieces"),
        ];
        damage.iter().filter(|d| d.0).try_for_each(|(_, what)| write!(f, ", {what}"))
    }
}
