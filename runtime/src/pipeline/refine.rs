//! The refinements of a pair's maps.

use super::candidates::Start;
use super::pair::Pair;
use super::{DescribedShape, Refinement};
use crate::error::Error;
use crate::point_map::{Comparison, Embedding, PointMap};
use crate::refine::{
    IcpOptions, PmfHints, PmfInfo, PmfOptions, WaveletOptions, ZoomOutOptions, adjoint_embedding, icp, pmf,
    wavelet_along, wavelet_of_part, zoomout,
};

/// A map between the working meshes, both ways where both are known.
pub(super) struct Found {
    pub(super) map: PointMap,
    pub(super) back: Option<PointMap>,
    /// The space that it was found in; none where it comes from no functional map.
    pub(super) embedding: Option<Embedding<f32>>,
    pub(super) pmf_info: Option<PmfInfo>,
}

impl Found {
    fn in_embedding(map: PointMap, back: Option<PointMap>, embedding: Embedding<f32>) -> Self {
        Self { map, back, embedding: Some(embedding), pmf_info: None }
    }
}

impl Pair<'_> {
    /// Refines a start up to [`Pair::refined_k`] eigenfunctions.
    pub(super) fn refine(&self, refinement: Refinement, start: &Start) -> Result<Found, Error> {
        match refinement {
            Refinement::None => {
                let (map, back) = (start.map.clone(), (!self.is_part()).then(|| start.back.clone()));
                let embedding = start.embedding.as_ref().map(Embedding::single);
                Ok(Found { map, back, embedding, pmf_info: None })
            }
            Refinement::Icp => self.icp(start),
            Refinement::Zoomout => self.zoomout(start),
            Refinement::Wavelet if self.is_part() => self.wavelet_of_part(start),
            Refinement::Wavelet => self.wavelet(start),
            Refinement::Pmf | Refinement::SharedTriangulation => {
                self.product_manifold_filter(refinement, start)
            }
        }
    }

    fn icp(&self, start: &Start) -> Result<Found, Error> {
        let [source, target] = self.bases(self.matcher.k)?;
        let refine = || icp(&start.functional_map, &source, &target, &IcpOptions::default());
        let refined = self.timed("icp", refine)?;
        let embedding = Embedding::of_one(Comparison::Distance, &refined.functional_map, &source, &target)?;
        Ok(Found::in_embedding(refined.map, None, embedding.single()))
    }

    fn zoomout(&self, start: &Start) -> Result<Found, Error> {
        let [source, target] = self.bases(self.refined_k())?;
        let options = ZoomOutOptions { part: self.is_part(), ..ZoomOutOptions::default() };
        let refined = self.timed("zoomout", || zoomout(&start.map, &source, &target, &options))?;
        let embedding = adjoint_embedding(&refined.functional_map, &source, &target, None)?;
        Ok(Found::in_embedding(refined.map, None, embedding.single()))
    }

    fn wavelet_of_part(&self, start: &Start) -> Result<Found, Error> {
        let k = self.refined_k();
        let [source, target] = self.bases(k)?;
        let options = WaveletOptions::coarse_to_fine(self.matcher.k, k);
        let anchors = start.anchors.as_deref();
        let refine = || wavelet_of_part(&start.map, &source, &target, anchors, &options);
        let refined = self.timed("wavelet", refine)?;
        let embedding = adjoint_embedding(&refined.functional_map, &source, &target, anchors)?;
        Ok(Found::in_embedding(refined.map, None, embedding.single()))
    }

    fn wavelet(&self, start: &Start) -> Result<Found, Error> {
        let k = self.refined_k();
        let [source, target] = self.bases(k)?;
        let options = WaveletOptions::coarse_to_fine(self.matcher.k, k);
        let (maps, anchors) = ([&start.map, &start.back], start.anchors.as_deref());
        let refine = || wavelet_along(maps, [&source, &target], anchors, Some(self.edges()), &options);
        let refined = self.timed("wavelet", refine)?;
        Ok(Found::in_embedding(refined.map, Some(refined.map_back), refined.embedding))
    }

    fn product_manifold_filter(&self, refinement: Refinement, start: &Start) -> Result<Found, Error> {
        let start = self.zoomout(start)?.map;
        let follows = refinement == Refinement::SharedTriangulation;
        // SHOT tells neighbouring vertices apart; learned descriptors only have to span the right functions.
        let shot = |described: &DescribedShape| described.shape.shot(&self.matcher.shot, self.context);
        let (shot_source, shot_target) = (shot(self.source)?, shot(self.target)?);
        let hints = PmfHints {
            descriptors: Some([&shot_source, &shot_target]),
            meshes: follows.then(|| [self.source.shape.mesh(), self.target.shape.mesh()]),
        };
        let [source, target] = self.bases(self.refined_k())?;
        let options = PmfOptions { part: self.is_part(), ..PmfOptions::default() };
        let filtered = self.timed("pmf", || pmf(&start, &source, &target, hints, &options))?;
        if follows && filtered.info.edges_kept.is_none() {
            self.warn(
                "the meshes are not triangulated alike; the map is that of the product manifold filter",
            );
        }
        Ok(Found { map: filtered.map, back: None, embedding: None, pmf_info: Some(filtered.info) })
    }
}
