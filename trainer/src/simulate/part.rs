//! Parts of a whole, cut as for the SHREC'16 partial correspondence benchmark (Cosmo et al. 2016): with holes, or by
//! a plane.

use super::carve::{Carved, carve, largest_component, spread};
use super::random::{direction, generator, uniform, weighted};
use super::{SimulateError, check};
use fmnet::Mesh;
use fmnet::mesh::{Topology, vec3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// How a part is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum PartKind {
    /// Random geodesic discs are taken away.
    Holes,
    /// What lies beyond a random plane is taken away.
    Cuts,
}

impl PartKind {
    /// Its folder and the beginning of its files' names.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Holes => "holes",
            Self::Cuts => "cuts",
        }
    }
}

/// Settings of [`cut_part`] and [`write_parts`](super::write_parts()).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct PartOptions {
    /// Which parts are made, separated by commas [default: holes,cuts]
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = Self::default().kinds, hide_default_value = true)]
    pub kinds: Vec<PartKind>,
    /// Least share of the area that a part keeps, 0.05 to 0.95 [default: 0.3]
    #[arg(long, default_value_t = Self::default().min_area, hide_default_value = true)]
    pub min_area: f64,
    /// Largest share of the area that a part keeps, min-area + 0.02 to 0.98 [default: 0.9]
    #[arg(long, default_value_t = Self::default().max_area, hide_default_value = true)]
    pub max_area: f64,
    /// Fewest holes of a part, 1 to max-holes [default: 3]
    #[arg(long, default_value_t = Self::default().min_holes, hide_default_value = true)]
    pub min_holes: usize,
    /// Most holes of a part, min-holes to 100 [default: 12]
    #[arg(long, default_value_t = Self::default().max_holes, hide_default_value = true)]
    pub max_holes: usize,
    /// Parts of fewer vertices are left out, but for those in the layout of SHREC'16; the built-in model's network
    /// takes 200 eigenpairs of each [default: 0]
    #[arg(long, default_value_t = Self::default().min_vertices, hide_default_value = true)]
    pub min_vertices: usize,
    /// Test parts of each kind and class in the layout of SHREC'16, besides the 10 for training, 1 to 10000 [default:
    /// 20]
    #[arg(long, default_value_t = Self::default().test_parts, hide_default_value = true)]
    pub test_parts: usize,
    /// Another seed, other parts [default: 0]
    #[arg(long, default_value_t = Self::default().seed, hide_default_value = true)]
    pub seed: u64,
}

impl Default for PartOptions {
    fn default() -> Self {
        let kinds = vec![PartKind::Holes, PartKind::Cuts];
        Self {
            kinds,
            min_area: 0.3,
            max_area: 0.9,
            min_holes: 3,
            max_holes: 12,
            min_vertices: 0,
            test_parts: 20,
            seed: 0,
        }
    }
}

impl PartOptions {
    /// Whether every option is in its range.
    ///
    /// # Errors
    /// If one is not: the first.
    pub fn check(&self) -> Result<(), SimulateError> {
        check("kinds", !self.kinds.is_empty(), &self.kinds, "holes, cuts or both")?;
        check("min-area", (0.05..=0.95).contains(&self.min_area), self.min_area, "from 0.05 to 0.95")?;
        let range = (self.min_area + 0.02 - 1e-12..=0.98).contains(&self.max_area);
        check("max-area", range, self.max_area, "0.02 more than min-area at least, and 0.98 at most")?;
        check("min-holes", self.min_holes >= 1, self.min_holes, "1 or more")?;
        let most = (self.min_holes..=100).contains(&self.max_holes);
        check("max-holes", most, self.max_holes, "min-holes at least, and 100 at most")?;
        let few = self.min_vertices <= 1_000_000_000;
        check("min-vertices", few, self.min_vertices, "at most 1000000000")?;
        check("test-parts", (1..=10_000).contains(&self.test_parts), self.test_parts, "from 1 to 10000")
    }
}

/// A part of a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Connected, every vertex in some face.
    pub mesh: Mesh,
    /// The shape's vertex of each vertex, `[n_part]`, ascending.
    pub origin: Vec<u32>,
}

/// Cuts that are tried for one part before the range of areas is given up.
const TRIES: usize = 200;

/// A connected part of `mesh`, whose share of the area is uniform in the range of the options as far as the shape
/// allows. `index` is the part's number: another one, another cut.
///
/// # Errors
/// If an option is out of range, or no part of such a size was found in 200 tries.
pub fn cut_part(
    mesh: &Mesh,
    kind: PartKind,
    options: &PartOptions,
    index: u64,
) -> Result<Part, SimulateError> {
    options.check()?;
    let mut rng = generator(options.seed, 2 * index + u64::from(kind == PartKind::Cuts));
    let whole = mesh.area();
    for _ in 0..TRIES {
        let share = uniform(&mut rng, options.min_area, options.max_area);
        let carved = match kind {
            PartKind::Holes => {
                let holes = rng.random_range(options.min_holes..=options.max_holes);
                with_holes(mesh, share, holes, &mut rng)
            }
            PartKind::Cuts => beyond_a_plane(mesh, share, &mut rng),
        };
        let largest = largest_component(&carved.mesh);
        if (options.min_area..=options.max_area).contains(&(largest.mesh.area() / whole)) {
            let origin = largest.origin.iter().map(|&i| carved.origin[i as usize]).collect();
            return Ok(Part { mesh: largest.mesh, origin });
        }
    }
    Err(SimulateError::NoPart { share: [options.min_area, options.max_area], tries: TRIES })
}

/// Takes away discs around random points, of random areas that add up to what is not kept. Distances are measured along
/// edges, so that the rims are a little ragged.
fn with_holes(mesh: &Mesh, kept: f64, holes: usize, rng: &mut ChaCha8Rng) -> Carved {
    let adjacency = Topology::new(mesh).adjacency();
    let mut areas = mesh.vertex_areas();
    let total: f64 = areas.iter().sum();
    let sizes: Vec<f64> = (0..holes).map(|_| uniform(rng, 0.3, 1.0)).collect();
    let unit = (1.0 - kept) * total / sizes.iter().sum::<f64>();
    let mut removed = vec![false; mesh.n_vertices()];
    for size in sizes {
        let center = weighted(rng, &areas);
        let mut left = size * unit;
        spread(mesh, &adjacency, center, |vertex, _| {
            // What an earlier hole took does not count.
            left -= std::mem::take(&mut areas[vertex as usize]);
            removed[vertex as usize] = true;
            left > 0.0
        });
    }
    carve(mesh, |i| !removed[i as usize])
}

/// Keeps what lies on one side of a plane of random direction, placed so that the share of the area is `kept`.
fn beyond_a_plane(mesh: &Mesh, kept: f64, rng: &mut ChaCha8Rng) -> Carved {
    let normal = direction(rng);
    let areas = mesh.vertex_areas();
    let mut heights: Vec<(f64, u32)> =
        mesh.vertices().iter().zip(0..).map(|(&p, i)| (vec3::dot(p, normal), i)).collect();
    heights.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = kept * areas.iter().sum::<f64>();
    let mut keep = vec![false; mesh.n_vertices()];
    for (_, vertex) in heights {
        left -= areas[vertex as usize];
        keep[vertex as usize] = left >= 0.0;
    }
    carve(mesh, |i| keep[i as usize])
}
