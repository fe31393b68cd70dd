//! The manners in which surfaces are triangulated.

use super::metric::{self, Metric};
use super::quads::quads;
use super::remesh::{flips_flat, remesh};
use super::sheet::Sheet;
use super::surface::Surface;
use crate::simulate::SimulateError;
use crate::simulate::carve::largest_component;
use crate::simulate::polygonize::polygonize;
use crate::simulate::random::{direction, uniform};
use crate::simulate::volume::Volume;
use fmnet::Mesh;
use fmnet::mesh::shapes::{rotation, transformed};
use fmnet::mesh::{DecimateOptions, decimate, vec3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// How a surface is triangulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Manner {
    /// Triangles of one size.
    Isotropic,
    /// Smaller triangles where the surface bends.
    Adaptive,
    /// Triangles stretched along limbs, or along a direction that turns slowly.
    Anisotropic,
    /// Simplified by quadrics.
    Quadrics,
    /// Marching cubes on a turned grid.
    Marching,
    /// Quadrilaterals, split along one or the other diagonal.
    Quads,
    /// Smaller triangles on one half, or at some of head, hands and feet.
    Uneven,
    /// As it is, but for some flipped edges and shifted vertices.
    Original,
}

impl Manner {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Isotropic,
        Self::Adaptive,
        Self::Anisotropic,
        Self::Quadrics,
        Self::Marching,
        Self::Quads,
        Self::Uneven,
        Self::Original,
    ];

    /// How often it is drawn, relative to the others.
    pub(super) fn share(self) -> f64 {
        match self {
            Self::Isotropic => 0.2,
            Self::Adaptive | Self::Anisotropic | Self::Quadrics => 0.15,
            Self::Marching | Self::Quads | Self::Uneven => 0.1,
            Self::Original => 0.05,
        }
    }

    /// Fewer vertices lose the fingers.
    pub(super) fn least_vertices(self) -> usize {
        match self {
            Self::Marching => 8000,
            Self::Quads => 4000,
            _ => 0,
        }
    }

    /// Whether it needs an inside and an outside.
    pub(super) fn needs_closed(self) -> bool {
        self == Self::Marching
    }
}

/// Rounds of remeshing: enough to forget the triangulation that it began with.
const ROUNDS: usize = 6;

/// A triangulation of about `target` vertices, of the original at most so many; `plain` is the surface before it was
/// rounded.
pub(super) fn triangulate(
    manner: Manner,
    surface: &Surface,
    plain: &Mesh,
    target: usize,
    rng: &mut ChaCha8Rng,
) -> Result<Mesh, SimulateError> {
    match manner {
        Manner::Isotropic => by_metric(surface, &metric::even(surface, target), target),
        Manner::Adaptive => by_metric(surface, &metric::curved(surface, target), target),
        Manner::Anisotropic => {
            let (bent, stretch) = (rng.random(), uniform(rng, 2.0, 4.5));
            by_metric(surface, &metric::stretched(surface, bent, stretch, target, rng), target)
        }
        Manner::Uneven => {
            let (ends, ratio) = (rng.random::<bool>(), uniform(rng, 2.0, 4.0));
            let metrics = match ends {
                true => metric::ends(surface, ratio, target, rng),
                false => metric::half(surface, ratio, target, rng),
            };
            by_metric(surface, &metrics, target)
        }
        Manner::Quadrics => {
            // Decimation keeps vertices, so the dense mesh must not have those of the template.
            let dense = (3 * target).clamp(8000, 30_000);
            let start = start(surface, dense)?;
            let independent = remesh(surface, &metric::even(surface, dense), &start, dense, 3);
            let mut options = DecimateOptions::default();
            options.evenness = 10f64.powf(uniform(rng, -5.0, -2.5));
            Ok(decimate(&independent, target, &options)?.mesh)
        }
        Manner::Marching => marching(surface.mesh, target, rng),
        Manner::Quads => {
            let coarse = target / 4;
            let coarse = by_metric(surface, &metric::curved(surface, coarse), coarse)?;
            Ok(quads(surface, &coarse, rng))
        }
        Manner::Original => shifted(surface, plain, target, rng),
    }
}

fn by_metric(surface: &Surface, metrics: &[Metric], target: usize) -> Result<Mesh, SimulateError> {
    Ok(remesh(surface, metrics, &start(surface, target)?, target, ROUNDS))
}

/// The surface with about as many vertices, or all it has.
fn start(surface: &Surface, target: usize) -> Result<Mesh, SimulateError> {
    let mut options = DecimateOptions::default();
    options.evenness = 0.1;
    Ok(decimate(surface.mesh, target, &options)?.mesh)
}

fn marching(mesh: &Mesh, target: usize, rng: &mut ChaCha8Rng) -> Result<Mesh, SimulateError> {
    // A surface crosses 1.5 edges of a grid for each square of the grid's spacing, averaged over directions.
    let cell = (1.5 * mesh.area() / target as f64).sqrt();
    let (axis, angle) = (direction(rng), uniform(rng, 0.0, std::f64::consts::PI));
    let turned = transformed(mesh, rotation(axis, angle), 1.0, [0.0; 3]);
    let surface = largest_component(&polygonize(&Volume::new(&turned, cell, 2.0 * cell), 0.0)).mesh;
    match surface.n_faces() {
        0 => Err(SimulateError::Empty),
        _ => Ok(transformed(&surface, rotation(axis, -angle), 1.0, [0.0; 3])),
    }
}

/// The mesh itself, with some of its edges flipped and its vertices moved along the surface, so that its connectivity
/// gives nothing away.
fn shifted(
    surface: &Surface,
    mesh: &Mesh,
    target: usize,
    rng: &mut ChaCha8Rng,
) -> Result<Mesh, SimulateError> {
    let mesh = decimate(mesh, target, &DecimateOptions::default())?.mesh;
    let flips = uniform(rng, 0.1, 0.5);
    let mut places = surface.places(&mesh);
    let mut sheet = Sheet::new(&mesh);
    for [a, b] in sheet.edges() {
        let chosen = rng.random::<f64>() < flips;
        let Some(edge) = sheet.diamond(a, b).filter(|edge| chosen && sheet.may_flip(edge)) else { continue };
        if flips_flat([a, b, edge.left, edge.right].map(|i| sheet.points[i as usize])) {
            sheet.flip(&edge);
        }
    }
    for vertex in 0..sheet.points.len() as u32 {
        let (away, p) = (direction(rng), sheet.points[vertex as usize]);
        let edges = sheet.ring(vertex).map(|face| vec3::distance(p, sheet.points[face[1] as usize]));
        let shortest = edges.fold(f64::INFINITY, f64::min);
        if sheet.is_fixed(vertex) || !shortest.is_finite() {
            continue;
        }
        let normal = places[vertex as usize].normal;
        let along = vec3::sub(away, vec3::scale(normal, vec3::dot(away, normal)));
        let moved = vec3::add(p, vec3::scale(along, 0.3 * shortest));
        let Some(place) = surface.closest(moved, normal) else { continue };
        sheet.points[vertex as usize] = place.position;
        let upright = |face: [u32; 3]| {
            let normals = face.map(|i| places[i as usize].normal);
            normals.iter().all(|&n| vec3::dot(sheet.normal(face), n) > 0.0)
        };
        if sheet.ring(vertex).all(upright) {
            places[vertex as usize] = place;
        } else {
            sheet.points[vertex as usize] = p;
        }
    }
    Ok(sheet.into_mesh())
}
