//! A folder of bodies with a manifest, for training.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use rayon::prelude::*;

use fmnet::io::{Attributes, IoError, write_atomically, write_mesh};

use super::{Body, Species, SynthError, SynthOptions, Template, UNMATCHED};

/// Individuals that share a breed.
const PER_BREED: usize = 3;

/// What a dataset holds.
#[derive(Clone, Debug, PartialEq)]
pub struct DatasetOptions {
    /// Species, each in a folder of its name; default all.
    pub species: Vec<Species>,
    /// Individuals of every species, 2 to 16777215; default 40.
    pub per_species: usize,
    /// Share of the individuals of a species that are for validation, in [0, 0.9]; default 0.1.
    pub validation: f64,
    /// Another seed, other individuals; 0 to 65535, as larger ones are the demo's; default 0.
    pub seed: u32,
    /// Triangulation and damage.
    pub body: SynthOptions,
}

impl Default for DatasetOptions {
    fn default() -> Self {
        Self {
            species: Species::all(),
            per_species: 40,
            validation: 0.1,
            seed: 0,
            body: SynthOptions::default(),
        }
    }
}

/// What a shape of a dataset is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Seen by training.
    Train,
    /// Unseen individuals of seen species.
    Validation,
    /// Species that training never sees ([`Species::held_out`]).
    Test,
}

impl Split {
    fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }
}

/// The split of the individual with the given number, 0-based: the last ones of a species validate.
pub fn split_of(species: Species, individual: usize, options: &DatasetOptions) -> Split {
    let validating = (options.validation * options.per_species as f64).ceil() as usize;
    if species.held_out() {
        Split::Test
    } else if individual + validating >= options.per_species {
        Split::Validation
    } else {
        Split::Train
    }
}

/// Writes a dataset into `folder`, which is made if need be: `SPECIES/SPECIES_000.ply` with `SPECIES_000.vts`
/// (line i: 1-based vertex of landmark i, 0 where it is missing), and `dataset.toml`, which names them:
///
/// ```toml
/// format = 1
/// [[shape]]
/// name = "man_000"
/// mesh = "man/man_000.ply"
/// group = "biped"                       # shapes of one group correspond with each other: a species' family
/// correspondence = "man/man_000.vts"
/// split = "train"                       # train, validation or test
/// ```
///
/// The manifest is written last: a folder that has it is complete. `progress` is told after each shape how many of how
/// many are done.
///
/// # Errors
/// If an option is out of range, or a file or folder cannot be written.
pub fn write_dataset(
    folder: &Path,
    options: &DatasetOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(), SynthError> {
    options.check()?;
    let total = options.species.len() * options.per_species;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let mut manifest = String::from("format = 1\n");
    for &species in &options.species {
        let place = folder.join(species.name());
        fs::create_dir_all(&place).map_err(|source| IoError::Write { path: place.clone(), source })?;
        let seed = u64::from(options.seed) << 24;
        (0..options.per_species.div_ceil(PER_BREED)).into_par_iter().try_for_each(|breed| {
            let template = Template::new(species, seed + 1 + breed as u64);
            let first = breed * PER_BREED;
            (first..(first + PER_BREED).min(options.per_species)).try_for_each(|individual| {
                let body = template.body(seed + individual as u64, &options.body)?;
                let name = name_of(species, individual);
                write_mesh(&place.join(format!("{name}.ply")), &body.mesh, &Attributes::default())?;
                let correspondence = vts(&body);
                write_atomically(&place.join(format!("{name}.vts")), |file| file.write_all(&correspondence))?;
                progress(1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed), total);
                Ok::<(), SynthError>(())
            })
        })?;
        for individual in 0..options.per_species {
            let (name, folder, group) =
                (name_of(species, individual), species.name(), species.family().name());
            let split = split_of(species, individual, options).name();
            let _ = write!(
                manifest,
                "\n[[shape]]\nname = \"{name}\"\nmesh = \"{folder}/{name}.ply\"\ngroup = \"{group}\"\n\
                 correspondence = \"{folder}/{name}.vts\"\nsplit = \"{split}\"\n"
            );
        }
    }
    write_atomically(&folder.join("dataset.toml"), |file| file.write_all(manifest.as_bytes()))?;
    Ok(())
}

impl DatasetOptions {
    fn check(&self) -> Result<(), SynthError> {
        let refuse = |option, value: String, range| Err(SynthError::Option { option, value, range });
        if !(2..1 << 24).contains(&self.per_species) {
            return refuse("per_species", self.per_species.to_string(), "2 to 16777215");
        }
        if self.seed > u32::from(u16::MAX) {
            return refuse("seed", self.seed.to_string(), "0 to 65535, as larger ones are the demo's");
        }
        if !(0.0..=0.9).contains(&self.validation) {
            return refuse("validation", self.validation.to_string(), "0 to 0.9");
        }
        self.body.check()
    }
}

fn name_of(species: Species, individual: usize) -> String {
    format!("{}_{individual:03}", species.name())
}

fn vts(body: &Body) -> Vec<u8> {
    let line =
        |&vertex: &u32| if vertex == UNMATCHED { "0\n".to_owned() } else { format!("{}\n", vertex + 1) };
    body.landmarks.iter().map(line).collect::<String>().into_bytes()
}
