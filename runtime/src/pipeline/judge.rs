//! How good the map of a pair is, and what is said of it.

use super::pair::Pair;
use super::refine::Found;
use crate::error::Error;
use crate::quality::{Estimate, Quality, SPECTRAL_K, Side, SurfaceFrame, displaced_regions, doubt};
use crate::shape::Shape;
use crate::spectral::{Eigenbasis, Laplacian};
use std::sync::Arc;

/// What judges maps of a pair.
pub(super) struct Judge<'a> {
    pair: &'a Pair<'a>,
    bases: [Eigenbasis; 2],
    laplacians: [Arc<Laplacian>; 2],
    frames: [SurfaceFrame; 2],
}

impl Judge<'_> {
    fn sides(&self) -> [Side<'_>; 2] {
        let shapes = [&self.pair.source.shape, &self.pair.target.shape];
        std::array::from_fn(|i| Side {
            mesh: shapes[i].mesh(),
            laplacian: &self.laplacians[i],
            basis: &self.bases[i],
            frame: &self.frames[i],
        })
    }

    /// The measures of a map and what they say of its error.
    pub(super) fn judge(&self, found: &Found) -> Result<(Quality, Estimate), Error> {
        let [source, target] = self.sides();
        let quality = Quality::measure(&found.map, found.back.as_ref(), source, target)?;
        let quality = self.with_descriptors(found, quality);
        let mut estimate = self.pair.matcher.calibration(self.pair.is_part()).estimate(&quality);
        estimate.doubtful |= self.is_torn_apart(found);
        Ok((quality, estimate))
    }

    /// With the agreement of a model's descriptors of wholes; along the borders of a part they are others than the
    /// whole's, and cosines of SHOT depend on the triangulation.
    fn with_descriptors(&self, found: &Found, quality: Quality) -> Quality {
        if self.pair.is_part() || self.pair.matcher.network().is_none() {
            return quality;
        }
        let [source, target] = [self.pair.source, self.pair.target].map(|shape| &shape.descriptors);
        quality.with_descriptors(&found.map, &self.bases[0].mass, source, target)
    }

    /// Whether a map of wholes sends a region elsewhere. Regions of a part hang together by bridges between its
    /// holes, which tear where nothing is wrong.
    fn is_torn_apart(&self, found: &Found) -> bool {
        !self.pair.is_part() && !self.displaced_regions(found).is_empty()
    }

    pub(super) fn doubt(&self, found: &Found) -> Vec<f32> {
        let [source, target] = self.sides();
        doubt(&found.map, found.back.as_ref(), source, target)
    }

    /// Regions of the source that a map has torn off and sent elsewhere, the largest first.
    pub(super) fn displaced_regions(&self, found: &Found) -> Vec<Vec<u32>> {
        let [source, target] = self.sides();
        displaced_regions(&found.map, source, target)
    }

    /// What looks most wrong with a map, in words.
    fn complaint(&self, found: &Found, quality: &Quality) -> &'static str {
        let calibration = self.pair.matcher.calibration(self.pair.is_part());
        if self.is_torn_apart(found) {
            "parts of it are torn off, as where limbs are exchanged"
        } else if calibration.sees_no_likeness(quality) {
            "the model sees little likeness between what it matches, as where it does not know the kind of shape"
        } else {
            quality.complaint()
        }
    }

    pub(super) fn say_what_looks_wrong(&self, found: &Found, quality: &Quality, estimate: &Estimate) {
        let pair = self.pair;
        if quality.is_mirrored() {
            pair.warn(&format!(
                "the map turns {:.0} % of the surface inside out: one of the meshes is mirrored or has its faces turned round, or left and right are exchanged; check the orientation of both",
                100.0 * quality.reversed
            ));
        } else if estimate.doubtful {
            let remedy = match pair.is_part() {
                true => "a larger part, one in the whole's unit and of a body of its size, or --landmarks",
                false => "--effort high, --landmarks or --adapt",
            };
            pair.warn(&format!(
                "the map is doubtful (expected mean error {:.0} % of sqrt(area)): {}; look at it (-o map.html) and try {remedy}",
                estimate.expected_error,
                self.complaint(found, quality)
            ));
        }
    }
}

impl Pair<'_> {
    pub(super) fn judge(&self) -> Result<Judge<'_>, Error> {
        let shapes = [&self.source.shape, &self.target.shape];
        let k = SPECTRAL_K.min(shapes[0].max_eigenpairs()).min(shapes[1].max_eigenpairs());
        let of = |shape: &Shape| (shape.laplacian(), SurfaceFrame::new(shape.mesh()));
        let (source, target) = rayon::join(|| of(shapes[0]), || of(shapes[1]));
        Ok(Judge {
            pair: self,
            bases: self.bases(k)?,
            laplacians: [source.0, target.0],
            frames: [source.1, target.1],
        })
    }
}
