//! How good a map is, told without ground truth.
//!
//! A right map between deformable shapes nearly commutes with their Laplacians, takes neighbours to neighbours, and
//! keeps the orientation of the surface. [`Quality`] measures how far a map is from that as a whole, [`doubt`] at
//! every vertex; [`Calibration`] turns the measures into an estimate of the error. All measures are of the working
//! meshes, where the map is found, and do not depend on scale, position or pose.

mod agreement;
mod doubt;
mod estimate;
mod regions;
mod spectral;
mod surface;

use crate::Matrix;
use crate::fmap::{FmapError, functional_map_of};
use crate::mesh::Mesh;
use crate::point_map::PointMap;
use crate::spectral::{Eigenbasis, Laplacian};
use serde::{Deserialize, Serialize};

pub use doubt::doubt;
pub use estimate::{Calibration, Estimate};
pub use regions::displaced_regions;
pub use surface::SurfaceFrame;

/// Eigenfunctions of the spectral measures: more of them see noise that does not matter.
pub(crate) const SPECTRAL_K: usize = 30;

/// One of the two shapes of a map, as the measures see it.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Its Laplacian.
    pub laplacian: &'a Laplacian,
    /// Its eigenbasis at unit area, 30 eigenfunctions or more where the mesh has so many.
    pub basis: &'a Eigenbasis,
    /// Normals and lengths of the surface.
    pub frame: &'a SurfaceFrame,
}

/// Measures of a map as a whole. Each is 0, or as small as the shapes allow, for a right one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// How far the functional map of the point map, of 30 eigenfunctions, is from commuting with the Laplacians:
    /// `sum (mu_i - lambda_j)^2 C_ij^2 / sum (mu_i^2 + lambda_j^2) C_ij^2`, from 0 to 1.
    pub commutativity: f64,
    /// `|C C^T - I|^2 / 30` of the same functional map.
    pub orthogonality: f64,
    /// Dirichlet energy of the target's coordinates pulled back to the source, both at unit area; 2 for an isometry.
    pub dirichlet: f64,
    /// Share of the source's edges that are stretched more than five times, or that tear between pieces.
    pub stretched: f64,
    /// Share of the source's area whose orientation the map reverses, of the area where it has one: about 0.04 for a
    /// right map, 0.95 for a mirrored one.
    pub reversed: f64,
    /// Mean distance from a vertex to where the map there and back takes it, relative to sqrt(area); none where the
    /// map back is not known.
    pub cycle: Option<f64>,
    /// Share of the target's area that is matched.
    pub coverage: f64,
    /// Mean cosine between the descriptors of matches, by the area of the source, from -1 to 1; none where no
    /// descriptors are known.
    #[serde(default)]
    pub agreement: Option<f64>,
}

impl Quality {
    /// Measures a map from `source` to `target`, and if it is known the map `back`.
    ///
    /// # Errors
    /// If a map does not fit the shapes.
    pub fn measure(
        map: &PointMap,
        back: Option<&PointMap>,
        source: Side,
        target: Side,
    ) -> Result<Self, FmapError> {
        if let Some(back) = back {
            // Checks the whole map.
            functional_map_of(back, &target.basis.truncated(1), &source.basis.truncated(1))?;
        }
        let spectral = spectral::measure(map, source.basis, target.basis)?;
        let surface = surface::measure(map, source, target);
        Ok(Self {
            commutativity: spectral.commutativity,
            orthogonality: spectral.orthogonality,
            dirichlet: surface.dirichlet,
            stretched: surface.stretched,
            reversed: surface.reversed,
            cycle: back.map(|back| surface::cycle(map, back, source)),
            coverage: surface.coverage,
            agreement: None,
        })
    }

    /// With the agreement of descriptors, a row for each vertex, `[n_source, d]` and `[n_target, d]`; rows of another
    /// number say nothing.
    pub fn with_descriptors(
        self,
        map: &PointMap,
        areas: &[f64],
        source: &Matrix<f32>,
        target: &Matrix<f32>,
    ) -> Self {
        Self { agreement: agreement::measure(map, areas, source, target), ..self }
    }

    /// What looks most wrong, in words.
    pub fn complaint(&self) -> &'static str {
        if self.dirichlet > 15.0 || self.stretched > 0.05 {
            "it is torn in places"
        } else if self.reversed > 0.2 {
            "parts of it are turned inside out, as where limbs are exchanged"
        } else {
            "it does not fit the vibrations of the shapes, as where these are unlike"
        }
    }

    /// Whether the map turns the surface inside out: most of it is reversed.
    pub fn is_mirrored(&self) -> bool {
        self.reversed > 0.5
    }
}

#[cfg(test)]
mod tests;
