//! A pair on its way through the stages: functional maps, point map, refinement, upscaling.

use super::{DescribedShape, Match, Matcher, Refinement, Upscaling};
use crate::error::Error;
use crate::events::{Event, timed};
use crate::fmap::{BothMaps, FmapSolver, functional_maps};
use crate::memory;
use crate::point_map::PointMap;
use crate::refine::{
    IcpOptions, PmfHints, PmfInfo, PmfOptions, WaveletOptions, ZoomOutOptions, icp, pmf, wavelet, zoomout,
};
use crate::shape::{Context, WayBack};
use crate::spectral::Eigenbasis;
use crate::upscale::{
    AdmmInfo, AdmmOptions, delta_coefficients, full_point_map, l21_functional_map,
    least_squares_functional_map,
};

/// Eigenfunctions of the full meshes in upscaling.
const UPSCALE_K: usize = 100;

pub(super) struct Pair<'a> {
    pub(super) matcher: &'a Matcher,
    pub(super) source: &'a DescribedShape,
    pub(super) target: &'a DescribedShape,
    /// Both names, for messages.
    pub(super) names: &'a str,
    pub(super) context: Context<'a>,
}

/// A functional map's point map before refinement.
struct Start {
    maps: BothMaps,
    solver: FmapSolver,
    /// At the functional map's `k`, unit area.
    bases: [Eigenbasis; 2],
    raw: PointMap,
}

impl Pair<'_> {
    pub(super) fn run(&self) -> Result<Match, Error> {
        let (matcher, is_part) = (self.matcher, self.is_part());
        let (source, target) = (&self.source.shape, &self.target.shape);
        let solver = matcher.solver(is_part);
        let refinement = matcher.refinement(is_part);
        let refined_k = self.source.refined_k.min(self.target.refined_k);
        let bases = self.bases(matcher.k)?;
        let (maps, functional_map_info) = self.timed("functional map", || {
            let f = bases[0].project(&self.source.descriptors);
            let g = bases[1].project(&self.target.descriptors);
            functional_maps(&bases[0], &bases[1], &f, &g, solver)
        })?;
        if functional_map_info.rank < matcher.k {
            self.warn(&format!(
                "the descriptors determine only {} of {} dimensions of the functional map",
                functional_map_info.rank, matcher.k
            ));
        }
        let is_joint = matches!(solver, FmapSolver::Joint { .. }) || refinement == Refinement::Wavelet;
        let width = refined_k.max(matcher.k) * if is_joint { 2 } else { 1 };
        let needed = memory::search_bytes(source.n(), target.n(), width);
        let reserved = memory::reserve("the search for nearest neighbours", needed, memory::DECIMATE)?;
        let raw = self.timed("point map", || maps.point_map(solver.comparison(), &bases[0], &bases[1]))?;
        let (map, pmf_info) =
            self.refine(refinement, refined_k, &Start { maps: maps.clone(), solver, bases, raw })?;
        drop(reserved);
        let (map, upscale_info) = self.upscale(map)?;
        let map = in_input_vertices(&source.way_back, &target.way_back, &map);
        Ok(Match { map, functional_map: maps.forth, functional_map_info, pmf_info, upscale_info })
    }

    fn is_part(&self) -> bool {
        self.source.shape.whole_area.is_some()
    }

    fn timed<T>(&self, stage: &'static str, run: impl FnOnce() -> T) -> T {
        timed(self.context.observer, self.names, stage, run)
    }

    fn warn(&self, text: &str) {
        (self.context.observer)(Event::Warning(format!("{}: {text}", self.names)));
    }

    /// The bases of source and target, `k` eigenfunctions at unit area.
    fn bases(&self, k: usize) -> Result<[Eigenbasis; 2], Error> {
        let of = |described: &DescribedShape| described.shape.unit_basis(k, self.context);
        Ok([of(self.source)?, of(self.target)?])
    }

    /// Refines up to `k` eigenfunctions.
    fn refine(
        &self,
        refinement: Refinement,
        k: usize,
        start: &Start,
    ) -> Result<(PointMap, Option<PmfInfo>), Error> {
        Ok(match refinement {
            Refinement::None => (start.raw.clone(), None),
            Refinement::Icp => {
                let [source, target] = &start.bases;
                let refine = || icp(&start.maps.forth, source, target, &IcpOptions::default());
                (self.timed("icp", refine)?.map, None)
            }
            Refinement::Zoomout => (self.zoomout(start, k)?, None),
            Refinement::Wavelet => (self.wavelet(start, k)?, None),
            Refinement::Pmf | Refinement::SharedTriangulation => {
                let (map, info) = self.product_manifold_filter(refinement, start, k)?;
                (map, Some(info))
            }
        })
    }

    fn zoomout(&self, start: &Start, k: usize) -> Result<PointMap, Error> {
        let [source, target] = self.bases(k)?;
        let options = ZoomOutOptions { part: self.is_part(), ..ZoomOutOptions::default() };
        Ok(self.timed("zoomout", || zoomout(&start.raw, &source, &target, &options))?.map)
    }

    fn wavelet(&self, start: &Start, k: usize) -> Result<PointMap, Error> {
        let options = WaveletOptions { part: self.is_part(), ..WaveletOptions::between(self.matcher.k, k) };
        let [source, target] = self.bases(k)?;
        self.timed("wavelet", || {
            let back = start.maps.clone().reversed();
            let back = back.point_map(start.solver.comparison(), &start.bases[1], &start.bases[0])?;
            Ok(wavelet([&start.raw, &back], &source, &target, &options)?.map)
        })
    }

    fn product_manifold_filter(
        &self,
        refinement: Refinement,
        start: &Start,
        k: usize,
    ) -> Result<(PointMap, PmfInfo), Error> {
        let start = self.zoomout(start, k)?;
        let follows = refinement == Refinement::SharedTriangulation;
        // SHOT tells neighbouring vertices apart; learned descriptors only have to span the right functions.
        let shot = |described: &DescribedShape| described.shape.shot(&self.matcher.shot, self.context);
        let (shot_source, shot_target) = (shot(self.source)?, shot(self.target)?);
        let hints = PmfHints {
            descriptors: Some([&shot_source, &shot_target]),
            meshes: follows.then(|| [self.source.shape.mesh(), self.target.shape.mesh()]),
        };
        let [source, target] = self.bases(k)?;
        let filtered = self.timed("pmf", || pmf(&start, &source, &target, hints, &PmfOptions::default()))?;
        if follows && filtered.info.edges_kept.is_none() {
            self.warn(
                "the meshes are not triangulated alike; the map is that of the product manifold filter",
            );
        }
        Ok((filtered.map, filtered.info))
    }

    /// From the working meshes to the full ones, where they differ.
    fn upscale(&self, map: PointMap) -> Result<(PointMap, Option<AdmmInfo>), Error> {
        let (source, target) = (&self.source.shape, &self.target.shape);
        if !source.is_decimated() && !target.is_decimated() {
            return Ok((map, None));
        }
        let full_source = source.full_basis(UPSCALE_K, self.context)?;
        let full_target = target.full_basis(UPSCALE_K, self.context)?;
        let full = |i: usize| {
            let target_vertex = target.way_back.full_of_work(map.get(i)?);
            Some((source.way_back.full_of_work(i as u32), target_vertex))
        };
        let matches: Vec<(u32, u32)> = (0..map.len()).filter_map(full).collect();
        let (phi, psi) = delta_coefficients(&full_source, &full_target, &matches);
        let (full_map, info) = self.timed("upscale", || match self.matcher.upscaling {
            Upscaling::L21 => {
                l21_functional_map(&phi, &psi, &AdmmOptions::default()).map(|(c, info)| (c, Some(info)))
            }
            Upscaling::LeastSquares => least_squares_functional_map(&phi, &psi).map(|c| (c, None)),
        })?;
        let map = self.timed("full point map", || {
            let vertices = source.full_mesh.vertices();
            full_point_map(&full_map, &full_source, &full_target, vertices, &matches)
        })?;
        Ok((map, info))
    }
}

/// Takes a map of the full repaired meshes to the vertices of the input meshes.
fn in_input_vertices(source: &WayBack, target: &WayBack, map: &PointMap) -> PointMap {
    let full: Vec<Option<usize>> =
        source.full_of_input.iter().map(|&v| (v != WayBack::NONE).then_some(v as usize)).collect();
    let target_of = |v: &Option<usize>| {
        v.and_then(|v| map.get(v)).map_or(PointMap::UNMATCHED, |t| target.input_of_full[t as usize])
    };
    let confidence =
        map.confidence.as_ref().map(|values| full.iter().map(|v| v.map_or(0.0, |v| values[v])).collect());
    let n_target = target.full_of_input.len();
    PointMap { targets: full.iter().map(target_of).collect(), confidence, n_target }
}
