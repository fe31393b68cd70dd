//! A pair on its way through the stages: functional maps, point map, refinement, judgement, the inputs' vertices.

use super::candidates::{Start, Tried};
use super::finish::{full_by_functional_map, on_inputs};
use super::landmarks::Landmarks;
use super::refine::Found;
use super::{DescribedShape, Match, Matcher, Refinement, Upscaling};
use crate::Matrix;
use crate::error::Error;
use crate::events::{Event, timed};
use crate::fmap::{BothMaps, FmapInfo, FmapSolver, functional_maps};
use crate::memory::{self, Remedy};
use crate::point_map::search::AlongEdges;
use crate::point_map::{Comparison, Embedding, PointMap, RecoverError};
use crate::shape::Context;
use crate::spectral::Eigenbasis;
use std::sync::OnceLock;

/// Length of the descriptors beside the rows of refinement's embeddings, whose squared length is about 400: on people
/// and animals of other makers 7 to 14 give the same, 0 and 20 are worse.
const DESCRIPTORS_BESIDE: f64 = 10.0;

/// A part of so large a share of the whole is in another unit of length, or no part.
pub(super) const LARGEST_SHARE: f64 = 1.1;

pub(super) struct Pair<'a> {
    pub(super) matcher: &'a Matcher,
    pub(super) source: &'a DescribedShape,
    pub(super) target: &'a DescribedShape,
    /// Both names, for messages.
    pub(super) names: &'a str,
    pub(super) context: Context<'a>,
    pub(super) edges: OnceLock<AlongEdges>,
}

impl Pair<'_> {
    pub(super) fn run(&self, landmarks: &[(u32, u32)]) -> Result<Match, Error> {
        let (matcher, is_part) = (self.matcher, self.is_part());
        self.check_part()?;
        let landmarks = match landmarks {
            [] => None,
            given => Some(Landmarks::new(self, given)?),
        };
        let landmarks = landmarks.as_ref();
        let solver = matcher.solver(is_part);
        let bases = self.bases(matcher.k)?;
        let own = [&self.source.descriptors, &self.target.descriptors];
        let (maps, info) = self.functional_maps(own, &bases, solver, landmarks)?;
        let refinement = matcher.refinement(is_part);
        let width = self.refined_k().max(matcher.k) * 2 + own[0].cols();
        let [n_source, n_target] = [&self.source.shape, &self.target.shape].map(|shape| shape.n());
        let needed = memory::search_bytes(n_source, n_target, width);
        let remedy = Remedy::Decimate { vertices: n_source.max(n_target) };
        let reserved = memory::reserve("the search for nearest neighbours", needed, remedy)?;
        let start =
            self.timed("point map", || self.start(own, &maps, solver.comparison(), &bases, landmarks))?;
        let found = self.refine(refinement, &start)?;
        let judge = self.timed("quality", || self.judge())?;
        let tried = self.with_candidates(&judge, &start, found, landmarks)?;
        let Tried { found, quality, estimate, candidates, resized } = tried;
        drop(reserved);
        judge.say_what_looks_wrong(&found, &quality, &estimate);
        let doubt = match &resized {
            Some(source) => self.with_source(source).judge()?.doubt(&found),
            None => judge.doubt(&found),
        };
        let (mut map, upscale_info) = self.on_inputs(&found, &doubt)?;
        if let Some(landmarks) = landmarks {
            landmarks.keep(&mut map, &self.target.shape);
        }
        Ok(Match {
            map,
            functional_map: maps.forth,
            functional_map_info: info,
            pmf_info: found.pmf_info,
            upscale_info,
            quality,
            estimate,
            candidates,
        })
    }

    /// The pair with another source.
    pub(super) fn with_source<'b>(&'b self, source: &'b DescribedShape) -> Pair<'b> {
        Pair { source, edges: OnceLock::new(), ..*self }
    }

    pub(super) fn is_part(&self) -> bool {
        self.source.shape.whole_area.is_some()
    }

    /// Refuses a target that is a part, and doubts a part that is larger than its whole.
    fn check_part(&self) -> Result<(), Error> {
        if self.target.shape.whole_area.is_some() {
            return Err(Error::PartAsTarget);
        }
        let share = self.share_of_whole();
        if share > LARGEST_SHARE {
            self.warn(&format!(
                "the part has {share:.3} times the area of the whole: both must be in one unit of length, the part first"
            ));
        }
        Ok(())
    }

    /// The area of the source as a share of that of the whole.
    pub(super) fn share_of_whole(&self) -> f64 {
        self.source.shape.full_mesh.area() / self.source.shape.unit_area()
    }

    pub(super) fn timed<T>(&self, stage: &'static str, run: impl FnOnce() -> T) -> T {
        timed(self.context.observer, self.names, stage, run)
    }

    pub(super) fn warn(&self, text: &str) {
        (self.context.observer)(Event::Warning(format!("{}: {text}", self.names)));
    }

    /// The bases of source and target, `k` eigenfunctions at unit area.
    pub(super) fn bases(&self, k: usize) -> Result<[Eigenbasis; 2], Error> {
        let of = |described: &DescribedShape| described.shape.unit_basis(k, self.context);
        let (source, target) = rayon::join(|| of(self.source), || of(self.target));
        Ok([source?, target?])
    }

    /// Eigenfunctions that refinement goes up to.
    pub(super) fn refined_k(&self) -> usize {
        self.matcher.refined_k(&self.source.shape).min(self.matcher.refined_k(&self.target.shape))
    }

    /// The functional maps that take the descriptors of both shapes to each other, and the landmarks.
    pub(super) fn functional_maps(
        &self,
        descriptors: [&Matrix<f32>; 2],
        bases: &[Eigenbasis; 2],
        solver: FmapSolver,
        landmarks: Option<&Landmarks>,
    ) -> Result<(BothMaps, FmapInfo), Error> {
        let (maps, info) = self.timed("functional map", || {
            let mut hats = [bases[0].project(descriptors[0]), bases[1].project(descriptors[1])];
            if let Some(landmarks) = landmarks {
                hats = landmarks.beside_coefficients(hats, bases);
            }
            functional_maps(&bases[0], &bases[1], &hats[0], &hats[1], solver)
        })?;
        let k = bases[0].k().min(bases[1].k());
        if info.rank < k {
            self.warn(&format!(
                "the descriptors determine only {} of {k} dimensions of the functional map",
                info.rank
            ));
        }
        Ok((maps, info))
    }

    /// The point maps of functional maps, which come from `descriptors`.
    pub(super) fn start(
        &self,
        descriptors: [&Matrix<f32>; 2],
        maps: &BothMaps,
        comparison: Comparison,
        bases: &[Eigenbasis; 2],
        landmarks: Option<&Landmarks>,
    ) -> Result<Start, Error> {
        let anchors = self.anchors(Some(descriptors), landmarks);
        let functional_map = maps.forth.clone();
        if comparison == Comparison::Joint && self.begins_with_samples() {
            let samples = self.edges().samples();
            let of_samples = [bases[0].at_vertices(samples[0]), bases[1].at_vertices(samples[1])];
            let embedding = compared(maps, comparison, &of_samples, landmarks, Some(samples))?;
            let [map, back] = self.edges().maps_of_samples(embedding.matches().map_err(RecoverError::from)?);
            return Ok(Start { functional_map, map, back, embedding: None, anchors });
        }
        let embedding = compared(maps, comparison, bases, landmarks, None)?;
        let [map, back] = match comparison {
            Comparison::Joint => embedding.both()?,
            _ => {
                let back = maps.clone().reversed().point_map(comparison, &bases[1], &bases[0])?;
                [embedding.forth()?, back]
            }
        };
        Ok(Start { functional_map, map, back, embedding: Some(embedding), anchors })
    }

    /// Whether the filter follows, which between large shapes begins with matches of samples.
    fn begins_with_samples(&self) -> bool {
        !self.is_part() && self.matcher.refinement(false) == Refinement::Wavelet && self.edges().pays()
    }

    /// The edges of the working meshes, and samples enough for refinement.
    pub(super) fn edges(&self) -> &AlongEdges {
        self.edges.get_or_init(|| {
            AlongEdges::new([self.source.shape.mesh(), self.target.shape.mesh()], self.refined_k())
        })
    }

    /// Whether a model was trained to tell vertices by its descriptors, not only to make functional maps of them.
    pub(super) fn descriptors_tell_vertices(&self) -> bool {
        self.matcher.network().is_some()
            && matches!(self.matcher.solver(self.is_part()), FmapSolver::Joint { .. })
    }

    /// What counts beside the embeddings of refinement: descriptors, where a model was trained to tell vertices by
    /// them, and landmarks.
    pub(super) fn anchors(
        &self,
        descriptors: Option<[&Matrix<f32>; 2]>,
        landmarks: Option<&Landmarks>,
    ) -> Option<Box<[Matrix; 2]>> {
        let own = descriptors
            .filter(|_| self.descriptors_tell_vertices())
            .map(|own| own.map(|rows| of_length(DESCRIPTORS_BESIDE, rows)));
        // Rows of a joint embedding at unit area have a squared length of about twice the eigenfunctions.
        let given = landmarks.map(|landmarks| landmarks.anchors(2.0 * self.refined_k() as f64));
        let columns = match (own, given) {
            (Some(own), Some(given)) => {
                [Matrix::beside(&[&own[0], &given[0]]), Matrix::beside(&[&own[1], &given[1]])]
            }
            (own, given) => own.or(given)?,
        };
        Some(Box::new(columns))
    }

    /// From the working meshes to the inputs.
    fn on_inputs(
        &self,
        found: &Found,
        doubt: &[f32],
    ) -> Result<(PointMap, Option<crate::upscale::AdmmInfo>), Error> {
        let (source, target) = (&self.source.shape, &self.target.shape);
        let decimated = source.is_decimated() || target.is_decimated();
        match (&found.embedding, self.matcher.upscaling) {
            (Some(embedding), upscaling) if !decimated || upscaling == Upscaling::Surface => {
                let map =
                    self.timed("surface points", || on_inputs(source, target, &found.map, embedding, doubt));
                Ok((map, None))
            }
            (_, upscaling) => full_by_functional_map(self, &found.map, upscaling, doubt),
        }
    }
}

/// The embedding of functional maps, with columns of the landmarks beside it; `rows` are the vertices that the bases
/// are at.
fn compared(
    maps: &BothMaps,
    comparison: Comparison,
    bases: &[Eigenbasis; 2],
    landmarks: Option<&Landmarks>,
    rows: Option<[&[u32]; 2]>,
) -> Result<Embedding, Error> {
    let embedding = maps.embedding(comparison, &bases[0], &bases[1])?;
    let Some(landmarks) = landmarks else { return Ok(embedding) };
    let source = &embedding.source;
    let mean_square = source.data().iter().map(|x| x * x).sum::<f64>() / source.rows() as f64;
    let [source, target] = landmarks.anchors(mean_square);
    Ok(match rows {
        Some([of_source, of_target]) => {
            embedding.with_columns(&source.select_rows(of_source), &target.select_rows(of_target))
        }
        None => embedding.with_columns(&source, &target),
    })
}

/// Rows brought to a length, in double precision; those of no length stay.
pub(super) fn of_length(length: f64, rows: &Matrix<f32>) -> Matrix {
    let mut rows = rows.map(f64::from);
    for i in 0..rows.rows() {
        let row = rows.row_mut(i);
        let norm = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 0.0 {
            row.iter_mut().for_each(|x| *x *= length / norm);
        }
    }
    rows
}
