//! The quantities of a shape: what is computed of it, when first asked for.
//!
//! | quantity | size | unit | options |
//! |---|---|---|---|
//! | [`Shape::laplacian`] | `[n, n]`, `[n]` | of the mesh | |
//! | [`Shape::eigenbasis`] | `[k]`, `[n, k]` | of the mesh | k; a larger one serves a smaller |
//! | [`Shape::unit_basis`] | the same | unit area | k |
//! | [`Shape::gradients`] | `[n, k]` twice | unit area | k |
//! | [`Shape::wks`] | `[n, energies]` | none | energies, k |
//! | [`Shape::shot`] | `[n, 32 (bins + 1)]` | none | radius, bins |
//! | [`Shape::full_basis`] | `[k]`, `[n_full, k]` | unit area | k |

use super::{Context, Shape};
use crate::cache::{CacheKey, Decoder, Encoder};
use crate::descriptor::{ShotOptions, shot};
use crate::error::Error;
use crate::events::{Event, timed};
use crate::memory::{self, Remedy};
use crate::spectral::{
    EigenGradients, EigenOptions, Eigenbasis, Laplacian, WksOptions, eigen_gradients, eigenbasis, wks,
};
use crate::{Matrix, Mesh};
use std::sync::{Arc, MutexGuard, PoisonError};

/// Versions of the quantities: raise one whenever its numbers or their encoding change.
const EIGENBASIS_VERSION: u32 = 1;
const SHOT_VERSION: u32 = 1;
const GRADIENTS_VERSION: u32 = 2;

/// What was computed so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Store {
    laplacian: Option<Arc<Laplacian>>,
    pub(super) eigenbasis: Option<Arc<Eigenbasis>>,
    pub(super) full_basis: Option<Arc<Eigenbasis>>,
    gradients: Option<Arc<EigenGradients>>,
    shot: Vec<(ShotOptions, Arc<Matrix<f32>>)>,
}

impl Store {
    /// What the mirror image has, too.
    pub(super) fn of_mirror_image(&self) -> Self {
        Self { laplacian: self.laplacian.clone(), eigenbasis: self.eigenbasis.clone(), ..Self::default() }
    }

    /// Forgets what depends on the area that counts as 1.
    pub(super) fn forget_sizes(&mut self) {
        self.gradients = None;
        self.shot.clear();
    }
}

impl Shape {
    pub(super) fn store(&self) -> MutexGuard<'_, Store> {
        self.store.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The Laplacian of [`Shape::mesh`].
    pub fn laplacian(&self) -> Arc<Laplacian> {
        if let Some(laplacian) = &self.store().laplacian {
            return laplacian.clone();
        }
        let laplacian = Arc::new(Laplacian::new(self.mesh()));
        self.store().laplacian = Some(laplacian.clone());
        laplacian
    }

    /// Most eigenpairs that are computed of the mesh: all of up to 3000, a sixth of more.
    pub fn max_eigenpairs(&self) -> usize {
        crate::spectral::max_eigenpairs(self.n())
    }

    /// The first eigenpairs of the Laplacian in the mesh's own unit, `k` of them or more.
    ///
    /// # Errors
    /// If the mesh has fewer eigenpairs ([`Shape::max_eigenpairs`]), they would take more memory than there is, the
    /// solver does not converge, or the cache cannot be written; it names the shape.
    pub fn eigenbasis(&self, k: usize, context: Context) -> Result<Arc<Eigenbasis>, Error> {
        if let Some(basis) = self.store().eigenbasis.as_ref().filter(|basis| basis.k() >= k) {
            return Ok(basis.clone());
        }
        let remedy = Remedy::Decimate { vertices: self.n() };
        let compute = || self.compute_eigenbasis(self.mesh(), &self.laplacian(), k, remedy, context);
        let basis =
            self.cached_basis("eigenbasis", k, context, compute).map_err(|e| e.in_shape(&self.name))?;
        self.store().eigenbasis = Some(basis.clone());
        Ok(basis)
    }

    /// The first `k` eigenpairs where the area of the shape, or of the whole that it is a part of, counts as 1.
    ///
    /// # Errors
    /// As [`Shape::eigenbasis`].
    pub fn unit_basis(&self, k: usize, context: Context) -> Result<Eigenbasis, Error> {
        let basis = self.eigenbasis(k, context)?;
        Ok(basis.in_unit(self.whole_area.unwrap_or_else(|| basis.area()), k))
    }

    /// The gradients of the first `k` eigenfunctions at unit area.
    ///
    /// # Errors
    /// As [`Shape::eigenbasis`].
    pub fn gradients(&self, k: usize, context: Context) -> Result<Arc<EigenGradients>, Error> {
        if let Some(gradients) = self.store().gradients.as_ref().filter(|found| found.x.cols() == k) {
            return Ok(gradients.clone());
        }
        let key = self.quantity_key("gradients", GRADIENTS_VERSION, &k.to_le_bytes());
        let found = context.cache.and_then(|cache| cache.fetch("gradients", key, context.observer));
        let decoded = found.and_then(|bytes| {
            let mut input = Decoder::new(&bytes);
            let gradients = EigenGradients { x: input.matrix()?, y: input.matrix()? };
            let fits = |m: &Matrix| (m.rows(), m.cols()) == (self.n(), k);
            (fits(&gradients.x) && fits(&gradients.y)).then_some(gradients)
        });
        let gradients = match decoded {
            Some(gradients) => gradients,
            None => {
                let basis = self.unit_basis(k, context)?;
                let mut gradients =
                    timed(context.observer, &self.name, "gradients", || eigen_gradients(self.mesh(), &basis));
                // Lengths are in units of sqrt(area).
                let unit = self.unit_area().sqrt();
                for component in [&mut gradients.x, &mut gradients.y] {
                    component.data_mut().iter_mut().for_each(|value| *value *= unit);
                }
                let mut out = Encoder::default();
                out.matrix(&gradients.x).matrix(&gradients.y);
                self.keep("gradients", key, &out.finish(), context)?;
                gradients
            }
        };
        let gradients = Arc::new(gradients);
        self.store().gradients = Some(gradients.clone());
        Ok(gradients)
    }

    /// The wave kernel signature, `[n, energies]`.
    ///
    /// # Errors
    /// As [`Shape::eigenbasis`].
    pub fn wks(&self, options: &WksOptions, context: Context) -> Result<Matrix<f32>, Error> {
        Ok(wks(&self.unit_basis(options.k, context)?, options.energies))
    }

    /// SHOT descriptors; the radius is relative to the square root of [`Shape::unit_area`].
    ///
    /// # Errors
    /// If an option is out of range, or the cache cannot be written; it names the shape.
    pub fn shot(&self, options: &ShotOptions, context: Context) -> Result<Arc<Matrix<f32>>, Error> {
        if let Some((_, found)) = self.store().shot.iter().find(|(other, _)| other == options) {
            return Ok(found.clone());
        }
        let text = serde_json::to_vec(options).unwrap_or_default();
        let key = self.quantity_key("shot", SHOT_VERSION, &text);
        let found = context.cache.and_then(|cache| cache.fetch("shot", key, context.observer));
        let decoded = found.and_then(|bytes| Decoder::new(&bytes).matrix()).filter(|m| m.rows() == self.n());
        let descriptors = match decoded {
            Some(descriptors) => descriptors,
            None => {
                let descriptors = self.compute_shot(options, context).map_err(|e| e.in_shape(&self.name))?;
                let mut out = Encoder::default();
                out.matrix(&descriptors);
                self.keep("shot", key, &out.finish(), context)?;
                descriptors
            }
        };
        let descriptors = Arc::new(descriptors);
        self.store().shot.push((*options, descriptors.clone()));
        Ok(descriptors)
    }

    /// The first `k` eigenpairs of the full mesh at unit area; of a mesh that is not decimated, at most as many as it
    /// has.
    ///
    /// # Errors
    /// As [`Shape::eigenbasis`].
    pub fn full_basis(&self, k: usize, context: Context) -> Result<Eigenbasis, Error> {
        if !self.is_decimated() {
            let basis = self.eigenbasis(k.min(self.max_eigenpairs()), context)?;
            return Ok(basis.at_unit_area(k.min(basis.k())));
        }
        let known = self.store().full_basis.clone().filter(|basis| basis.k() >= k);
        let basis = match known {
            Some(basis) => basis,
            None => {
                let laplacian = || Laplacian::new(&self.full_mesh);
                let compute =
                    || self.compute_eigenbasis(&self.full_mesh, &laplacian(), k, memory::FULL, context);
                self.cached_basis("full-basis", k, context, compute).map_err(|e| e.in_shape(&self.name))?
            }
        };
        self.store().full_basis = Some(basis.clone());
        Ok(basis.at_unit_area(k))
    }

    /// The key of a quantity of this mesh with options of its own.
    pub(crate) fn quantity_key(&self, name: &str, version: u32, options: &[u8]) -> CacheKey {
        CacheKey::of(&[self.key.as_bytes(), name.as_bytes(), &version.to_le_bytes(), options])
    }

    /// Writes a quantity to the cache, where there is one.
    pub(crate) fn keep(
        &self,
        kind: &str,
        key: CacheKey,
        bytes: &[u8],
        context: Context,
    ) -> Result<(), Error> {
        match context.cache {
            Some(cache) => cache.put(kind, key, bytes).map_err(|e| Error::from(e).in_shape(&self.name)),
            None => Ok(()),
        }
    }

    /// An eigenbasis from the cache, if it has `k` pairs or more, else computed and kept.
    fn cached_basis(
        &self,
        kind: &'static str,
        k: usize,
        context: Context,
        compute: impl FnOnce() -> Result<Eigenbasis, Error>,
    ) -> Result<Arc<Eigenbasis>, Error> {
        let key = self.quantity_key(kind, EIGENBASIS_VERSION, &[]);
        let found = context.cache.and_then(|cache| cache.fetch(kind, key, context.observer));
        if let Some(basis) = found.and_then(|bytes| decode_basis(&bytes)).filter(|basis| basis.k() >= k) {
            return Ok(Arc::new(basis));
        }
        let basis = compute()?;
        let mut out = Encoder::default();
        encode_basis(&mut out, &basis);
        self.keep(kind, key, &out.finish(), context)?;
        Ok(Arc::new(basis))
    }

    fn compute_eigenbasis(
        &self,
        mesh: &Mesh,
        laplacian: &Laplacian,
        k: usize,
        remedy: Remedy,
        context: Context,
    ) -> Result<Eigenbasis, Error> {
        let needed = memory::eigenbasis_bytes(mesh.n_vertices(), k);
        let _reserved = memory::reserve("the eigenbasis", needed, remedy)?;
        let stage = if std::ptr::eq(mesh, &self.full_mesh) && self.is_decimated() {
            "full eigenbasis"
        } else {
            "eigenbasis"
        };
        let (basis, info) = timed(context.observer, &self.name, stage, || {
            eigenbasis(laplacian, k, &EigenOptions::default())
        })?;
        if info.complete == Some(false) {
            (context.observer)(Event::Warning(format!(
                "{}: the {stage} of {k} pairs lacks some eigenvalue below its last one; maps may be worse, try another -k",
                self.name
            )));
        }
        Ok(basis)
    }

    fn compute_shot(&self, options: &ShotOptions, context: Context) -> Result<Matrix<f32>, Error> {
        let remedy = Remedy::Decimate { vertices: self.n() };
        let _reserved = memory::reserve("SHOT", memory::descriptor_bytes(self.n(), 0), remedy)?;
        let relative_scale = self.whole_area.map_or(1.0, |whole| (whole / self.mesh().area()).sqrt());
        let scaled = ShotOptions { radius: options.radius * relative_scale, ..*options };
        let (descriptors, info) = timed(context.observer, &self.name, "shot", || shot(self.mesh(), &scaled))?;
        if info.zero_rows > self.n() / 10 {
            (context.observer)(Event::Warning(format!(
                "{}: {} of {} vertices have too few neighbours for a descriptor; a finer mesh would help (--subdivide N)",
                self.name,
                info.zero_rows,
                self.n()
            )));
        }
        Ok(descriptors)
    }
}

pub(super) fn encode_basis(out: &mut Encoder, basis: &Eigenbasis) {
    out.slice(&basis.eigenvalues).slice(&basis.mass).matrix(&basis.eigenvectors);
}

pub(super) fn decode_basis(bytes: &[u8]) -> Option<Eigenbasis> {
    let mut input = Decoder::new(bytes);
    let basis =
        Eigenbasis { eigenvalues: input.slice()?, mass: input.slice()?, eigenvectors: input.matrix()? };
    let fits = basis.mass.len() == basis.eigenvectors.rows() && basis.k() == basis.eigenvectors.cols();
    fits.then_some(basis)
}
