//! What a 3D scanner would have made of a registered shape.
//!
//! The registration is rounded between its vertices, its volume is sampled on a turned grid, parts that nearly touch
//! grow together ([`ScanOptions::contact`]), and the surface is polygonised and decimated: nothing of the template's
//! connectivity remains. What no camera sees is left open in part, further holes are made, the surface gets noise,
//! and a few stray pieces float around it.

use super::carve::{carve, disc, largest_component, patches};
use super::polygonize::polygonize;
use super::random::{direction, generator, normal, uniform, weighted};
use super::smooth::refine;
use super::visibility::{seen, vertex_normals};
use super::volume::Volume;
use super::{SimulateError, check};
use fmnet::Mesh;
use fmnet::mesh::shapes::{joined, rotation, transformed};
use fmnet::mesh::{DecimateOptions, Topology, decimate, vec3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// An axis of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl Axis {
    fn direction(self) -> [f64; 3] {
        let mut direction = [0.0; 3];
        direction[self as usize] = 1.0;
        direction
    }
}

/// Settings of [`simulate_scan`]. Lengths are relative to sqrt(area) of the registration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct ScanOptions {
    /// Vertices before holes are made, 500 to 60000 [default: 15000, the size that training decimates scans to]
    #[arg(long, default_value_t = Self::default().vertices, hide_default_value = true)]
    pub vertices: usize,
    /// Spacing of the grid that the shape is sampled on, at most, relative to sqrt(area), 0.0015 to 0.05; what is
    /// thinner is lost [default: 0.0045, half a child's finger]
    #[arg(long, default_value_t = Self::default().detail, hide_default_value = true)]
    pub detail: f64,
    /// Surfaces that come nearer than this, relative to sqrt(area), grow together, as a hand on a hip; 0 (none) to 0.05
    /// [default: 0.01, on a person a finger's width]
    #[arg(long, default_value_t = Self::default().contact, hide_default_value = true)]
    pub contact: f64,
    /// Share of the patches hidden from all cameras, as the soles of the feet, that stay open, 0 to 1; a scanner's
    /// software fills the others [default: 0.6]
    #[arg(long, default_value_t = Self::default().hidden, hide_default_value = true)]
    pub hidden: f64,
    /// The axis that leads away from the floor; the cameras stand around it [default: y, as in FAUST]
    #[arg(long, value_enum, default_value_t = Self::default().up, hide_default_value = true)]
    pub up: Axis,
    /// Further holes anywhere, at most, 0 to 100; each scan has a random number of them [default: 1]
    #[arg(long, default_value_t = Self::default().holes, hide_default_value = true)]
    pub holes: usize,
    /// Radius of the largest of these holes, relative to sqrt(area), 0.005 to 0.3 [default: 0.04]
    #[arg(long, default_value_t = Self::default().hole_radius, hide_default_value = true)]
    pub hole_radius: f64,
    /// Root mean square displacement along the normals, relative to sqrt(area), 0 to 0.01 [default: 0.0006, on a person
    /// 0.8 mm]
    #[arg(long, default_value_t = Self::default().noise, hide_default_value = true)]
    pub noise: f64,
    /// Stray pieces near the surface, at most, 0 to 100 [default: 3]
    #[arg(long, default_value_t = Self::default().pieces, hide_default_value = true)]
    pub pieces: usize,
    /// Another seed, other scans [default: 0]
    #[arg(long, default_value_t = Self::default().seed, hide_default_value = true)]
    pub seed: u64,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self {
            vertices: 15_000,
            detail: 0.0045,
            contact: 0.01,
            hidden: 0.6,
            up: Axis::Y,
            holes: 1,
            hole_radius: 0.04,
            noise: 6e-4,
            pieces: 3,
            seed: 0,
        }
    }
}

impl ScanOptions {
    /// Whether every option is in its range.
    ///
    /// # Errors
    /// If one is not: the first.
    pub fn check(&self) -> Result<(), SimulateError> {
        let vertices = (500..=60_000).contains(&self.vertices);
        check("vertices", vertices, self.vertices, "from 500 to 60000")?;
        check("detail", (0.0015..=0.05).contains(&self.detail), self.detail, "from 0.0015 to 0.05")?;
        check("contact", (0.0..=0.05).contains(&self.contact), self.contact, "from 0 to 0.05")?;
        check("hidden", (0.0..=1.0).contains(&self.hidden), self.hidden, "from 0 to 1")?;
        check("holes", self.holes <= 100, self.holes, "from 0 to 100")?;
        let radius = (0.005..=0.3).contains(&self.hole_radius);
        check("hole-radius", radius, self.hole_radius, "from 0.005 to 0.3")?;
        check("noise", (0.0..=0.01).contains(&self.noise), self.noise, "from 0 to 0.01")?;
        check("pieces", self.pieces <= 100, self.pieces, "from 0 to 100")
    }
}

/// Smallest area of a hidden patch that may stay open, relative to the area.
const MIN_PATCH: f64 = 5e-4;
/// Cells of the grid in an edge of the scan, at least.
const CELLS_PER_EDGE: f64 = 2.0;
/// Largest turn of the grid against the shape, in radians; more would waste memory on a longer box.
const TURN: f64 = 0.4;

/// A scan of the closed surface `registration`, in the same place. `index` is the shape's number: another one, other
/// damage.
///
/// The registration may pass through itself. The scan may have holes, several components and vertices that are not
/// manifold; each vertex of the registration corresponds with the nearest vertex of the scan, where there is one
/// near.
///
/// # Errors
/// If an option is out of range, the surface is not closed or encloses nothing, or it cannot be decimated.
pub fn simulate_scan(registration: &Mesh, options: &ScanOptions, index: u64) -> Result<Mesh, SimulateError> {
    options.check()?;
    closed(registration)?;
    let mut rng = generator(options.seed, index);
    let unit = registration.scale();
    let surface = remesh(registration, options, unit, &mut rng)?;
    let open = open(&surface, options, unit, &mut rng);
    let rough = roughen(&open, options.noise * unit, &mut rng)?;
    let pieces = rng.random_range(0..=options.pieces);
    Ok(with_pieces(rough, pieces, [0.012 * unit, 0.03 * unit], &mut rng))
}

pub(super) fn closed(mesh: &Mesh) -> Result<(), SimulateError> {
    let topology = Topology::new(mesh);
    let open = (0..topology.edges().len()).find(|&e| !topology.n_faces_of(e).is_multiple_of(2));
    match open {
        Some(e) => Err(SimulateError::NotClosed { edge: topology.edges()[e], faces: topology.n_faces_of(e) }),
        None if mesh.n_faces() == 0 => Err(SimulateError::Empty),
        None => Ok(()),
    }
}

/// The surface of the shape's volume, contacts glued, triangulated anew.
fn remesh(
    registration: &Mesh,
    options: &ScanOptions,
    unit: f64,
    rng: &mut ChaCha8Rng,
) -> Result<Mesh, SimulateError> {
    // An even triangulation by equilateral triangles of side s has 2 / (sqrt(3) s^2) vertices per area.
    let edge = (2.0 / (3f64.sqrt() * options.vertices as f64)).sqrt();
    let cell = unit * (edge / CELLS_PER_EDGE).min(options.detail);
    let dense = solid(&refine(registration), cell, options.contact * unit, rng)?;
    Ok(decimate(&dense, options.vertices, &DecimateOptions::default())?.mesh)
}

/// The surface of the shape's volume on a turned grid of spacing `cell`, in which surfaces nearer than `contact` have
/// grown together: its largest component.
pub(super) fn solid(
    mesh: &Mesh,
    cell: f64,
    contact: f64,
    rng: &mut ChaCha8Rng,
) -> Result<Mesh, SimulateError> {
    let (axis, angle) = (direction(rng), uniform(rng, -TURN, TURN));
    let turned = transformed(mesh, rotation(axis, angle), 1.0, [0.0; 3]);
    let radius = 0.5 * contact;
    let mut volume = Volume::new(&turned, cell, radius + 2.0 * cell);
    if radius > 0.0 {
        volume.close(radius);
    }
    let dense = largest_component(&polygonize(&volume, 0.0)).mesh;
    match dense.n_faces() {
        0 => Err(SimulateError::Empty),
        _ => Ok(transformed(&dense, rotation(axis, -angle), 1.0, [0.0; 3])),
    }
}

/// Without some of what no camera sees, and with holes.
fn open(mesh: &Mesh, options: &ScanOptions, unit: f64, rng: &mut ChaCha8Rng) -> Mesh {
    let adjacency = Topology::new(mesh).adjacency();
    let areas = mesh.vertex_areas();
    let turn = uniform(rng, 0.0, std::f64::consts::TAU);
    let hidden: Vec<bool> = seen(mesh, &vertex_normals(mesh), options.up.direction(), turn)
        .into_iter()
        .map(|seen| !seen)
        .collect();
    let mut removed = vec![false; mesh.n_vertices()];
    for patch in patches(&adjacency, &hidden) {
        let area: f64 = patch.iter().map(|&i| areas[i as usize]).sum();
        // Drawn for every patch, so that the threshold does not shift what the others get.
        let stays_open = rng.random::<f64>() < options.hidden;
        if stays_open && area >= MIN_PATCH * unit * unit {
            patch.iter().for_each(|&i| removed[i as usize] = true);
        }
    }
    for _ in 0..rng.random_range(0..=options.holes) {
        let radius = options.hole_radius * unit * uniform(rng, 0.3, 1.0);
        let center = weighted(rng, &areas);
        disc(mesh, &adjacency, center, radius).into_iter().for_each(|i| removed[i as usize] = true);
    }
    let open = carve(mesh, |i| !removed[i as usize]).mesh;
    if open.n_faces() == 0 { mesh.clone() } else { open }
}

/// Moves the vertices along their normals by noise that neighbours share in part, as smoothing by the scanner leaves
/// it.
pub(super) fn roughen(mesh: &Mesh, deviation: f64, rng: &mut ChaCha8Rng) -> Result<Mesh, SimulateError> {
    let white: Vec<f64> = (0..mesh.n_vertices()).map(|_| normal(rng)).collect();
    let adjacency = Topology::new(mesh).adjacency();
    let smooth = |i: usize| {
        let around = adjacency.of(i);
        let sum: f64 = around.iter().map(|&j| white[j as usize]).sum();
        white[i] + sum / around.len().max(1) as f64
    };
    let noise: Vec<f64> = (0..mesh.n_vertices()).map(smooth).collect();
    let mean_square = noise.iter().map(|x| x * x).sum::<f64>() / noise.len().max(1) as f64;
    let factor = if mean_square > 0.0 { deviation / mean_square.sqrt() } else { 0.0 };
    let normals = vertex_normals(mesh);
    let moved = mesh.vertices().iter().zip(normals).zip(noise);
    let vertices = moved.map(|((&p, n), x)| vec3::add(p, vec3::scale(n, factor * x))).collect();
    Ok(Mesh::new(vertices, mesh.faces().to_vec()).expect("finite displacements keep a mesh valid"))
}

/// With copies of small patches beside the surface: what a scanner makes of reflections and hair. Their radii are in
/// the given range. The faces of the surface come first.
pub(super) fn with_pieces(mesh: Mesh, count: usize, radii: [f64; 2], rng: &mut ChaCha8Rng) -> Mesh {
    let (adjacency, areas, normals) =
        (Topology::new(&mesh).adjacency(), mesh.vertex_areas(), vertex_normals(&mesh));
    let unit = mesh.scale();
    let mut pieces = Vec::new();
    for _ in 0..count {
        let center = weighted(rng, &areas);
        let radius = uniform(rng, radii[0], radii[1]);
        let mut inside = vec![false; mesh.n_vertices()];
        disc(&mesh, &adjacency, center, radius).into_iter().for_each(|i| inside[i as usize] = true);
        let piece = carve(&mesh, |i| inside[i as usize]).mesh;
        let turn = rotation(direction(rng), uniform(rng, -0.6, 0.6));
        let about = mesh.vertices()[center as usize];
        let out = vec3::scale(normals[center as usize], unit * uniform(rng, 0.03, 0.1));
        let place = vec3::add(about, out);
        let back = vec3::sub(place, turn.map(|row| vec3::dot(row, about)));
        pieces.push(transformed(&piece, turn, 1.0, back));
    }
    let all: Vec<&Mesh> = std::iter::once(&mesh).chain(&pieces).collect();
    joined(&all)
}
