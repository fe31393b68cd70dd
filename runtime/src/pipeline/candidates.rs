//! Other ways to the map of a pair, tried where the first looks wrong; the best by its quality is taken.

use super::adapt::adapted;
use super::judge::Judge;
use super::landmarks::Landmarks;
use super::pair::{Pair, of_length};
use super::refine::Found;
use super::{DescribedShape, Effort, Refinement};
use crate::Matrix;
use crate::descriptor::ShotOptions;
use crate::error::Error;
use crate::network::NativeNetwork;
use crate::point_map::{Embedding, PointMap, RecoverError};
use crate::quality::{Estimate, Quality};
use serde::{Deserialize, Serialize};

/// Steps of the adaptation of a doubtful pair.
const ADAPTATION: usize = 10;

/// Radius of SHOT where it stands in for a model that does not know the shapes, relative to sqrt(area): wide enough
/// to tell a head from a hand.
const SHOT_RADIUS: f64 = 0.12;

/// Probability that the first map is bad from which the cheapest other one is tried.
const WORTH_A_TRY: f64 = 0.2;

/// Another map is taken if its expected error is below this share of the one so far: the estimate does not tell smaller
/// differences.
pub(super) const CLEARLY: f64 = 0.9;

/// A map before refinement, both ways.
#[derive(Clone)]
pub(super) struct Start {
    pub(super) functional_map: Matrix,
    /// Where the filter follows, those of samples are enough.
    pub(super) map: PointMap,
    pub(super) back: PointMap,
    /// What the maps were found in; none where that were samples alone.
    pub(super) embedding: Option<Embedding>,
    /// Columns beside the embeddings of refinement.
    pub(super) anchors: Option<Box<[Matrix; 2]>>,
}

/// One way that was tried, and what came of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// How it was made.
    pub name: String,
    /// Measures of the map.
    pub quality: Quality,
    /// What they say of its error.
    pub estimate: Estimate,
    /// Whether it was taken.
    pub taken: bool,
}

/// The map taken, and all that were tried.
pub(super) struct Tried {
    pub(super) found: Found,
    pub(super) quality: Quality,
    pub(super) estimate: Estimate,
    pub(super) candidates: Vec<Candidate>,
    /// The part in the size that the map was found in, where that is not its own.
    pub(super) resized: Option<Box<DescribedShape>>,
}

impl Tried {
    fn first(name: &str, found: Found, (quality, estimate): (Quality, Estimate)) -> Self {
        let candidate = Candidate { name: name.to_string(), quality, estimate, taken: true };
        Self { found, quality, estimate, candidates: vec![candidate], resized: None }
    }

    /// Takes another map if it is clearly better: if its expected error is below so large a share of the one so far.
    pub(super) fn add(
        &mut self,
        name: &str,
        found: Found,
        (quality, estimate): (Quality, Estimate),
        clearly: f64,
    ) -> bool {
        let better = estimate.expected_error < clearly * self.estimate.expected_error;
        if better {
            self.candidates.iter_mut().for_each(|candidate| candidate.taken = false);
            (self.found, self.quality, self.estimate) = (found, quality, estimate);
        }
        self.candidates.push(Candidate { name: name.to_string(), quality, estimate, taken: better });
        better
    }

    /// Calls the map taken doubtful from half the usual probability on, where it is not the first: the best of
    /// several looks better than it is.
    fn doubt_the_best(&mut self, usual: f64) {
        let Some(best) = self.candidates.iter_mut().skip(1).find(|candidate| candidate.taken) else { return };
        self.estimate.doubtful = self.estimate.bad >= usual / 2.0;
        best.estimate = self.estimate;
    }
}

impl Pair<'_> {
    /// The first map, or a better one where it is doubtful or effort is asked for.
    pub(super) fn with_candidates(
        &self,
        judge: &Judge,
        start: &Start,
        found: Found,
        landmarks: Option<&Landmarks>,
    ) -> Result<Tried, Error> {
        let judged = judge.judge(&found)?;
        let mut tried = Tried::first("default", found, judged);
        // Other refinements were asked for by name.
        if self.matcher.refinement(self.is_part()) != Refinement::Wavelet {
            return Ok(tried);
        }
        let all = self.matcher.effort == Effort::High;
        let more = self.matcher.effort != Effort::Low;
        if self.descriptors_tell_vertices() && (all || more && tried.estimate.bad > WORTH_A_TRY) {
            let start = Start { anchors: self.anchors(None, landmarks), ..start.clone() };
            self.attempt("without descriptors beside", &start, judge, &mut tried)?;
        }
        if more && tried.estimate.doubtful {
            self.try_other_side(judge, &mut tried, landmarks)?;
        }
        let asked_to_adapt = self.matcher.adapt.is_some_and(|steps| steps > 0);
        if all || more && tried.estimate.doubtful {
            self.try_others(judge, start, &mut tried, landmarks)?;
        } else if asked_to_adapt && !self.is_part() {
            self.try_adapted(judge, &mut tried, landmarks)?;
        }
        Ok(tried)
    }

    fn try_others(
        &self,
        judge: &Judge,
        start: &Start,
        tried: &mut Tried,
        landmarks: Option<&Landmarks>,
    ) -> Result<(), Error> {
        let k = self.matcher.k;
        let own = [&self.source.descriptors, &self.target.descriptors];
        let mut attempt = |name: &str, start: &Start| self.attempt(name, start, judge, tried);
        attempt("features alone", &Start { anchors: start.anchors.clone(), ..self.by_rows(own)? })?;
        attempt("k = 50", &self.solved(own, k.min(50), 1.0, landmarks)?)?;
        attempt("strong mask", &self.solved(own, k, 10.0, landmarks)?)?;
        if self.is_part() {
            self.try_sizes(tried, landmarks)?;
            tried.doubt_the_best(self.matcher.calibration(true).doubtful);
            return Ok(());
        }
        let shot = ShotOptions { radius: SHOT_RADIUS, ..self.matcher.shot };
        let [source, target] =
            [self.source, self.target].map(|described| described.shape.shot(&shot, self.context));
        let anchors = self.anchors(None, landmarks);
        attempt("SHOT alone", &Start { anchors, ..self.by_rows([&*source?, &*target?])? })?;
        self.try_adapted(judge, tried, landmarks)
    }

    /// The map of the network adapted to the pair, where it can be.
    fn try_adapted(
        &self,
        judge: &Judge,
        tried: &mut Tried,
        landmarks: Option<&Landmarks>,
    ) -> Result<(), Error> {
        let Some((network, steps)) = self.adaptation() else { return Ok(()) };
        let [source, target] = self.timed("adaptation", || adapted(self, network, steps))?;
        let start = self.solved([&source, &target], self.matcher.k, 1.0, landmarks)?;
        self.attempt("adapted", &start, judge, tried)
    }

    fn attempt(&self, name: &str, start: &Start, judge: &Judge, tried: &mut Tried) -> Result<(), Error> {
        let found = self.refine(Refinement::Wavelet, start)?;
        let judged = judge.judge(&found)?;
        tried.add(name, found, judged, CLEARLY);
        Ok(())
    }

    /// The network that can be adapted, and for how many steps.
    fn adaptation(&self) -> Option<(&NativeNetwork, usize)> {
        let steps = self.matcher.adapt.unwrap_or(ADAPTATION);
        Some((self.matcher.network()?.native()?, steps)).filter(|(_, steps)| *steps > 0)
    }

    /// Nearest neighbours among descriptors, without a functional map.
    fn by_rows(&self, descriptors: [&Matrix<f32>; 2]) -> Result<Start, Error> {
        let [source, target] = descriptors.map(|rows| of_length(1.0, rows));
        let embedding = Embedding::of_rows(source, target).map_err(RecoverError::from)?;
        let [map, back] = embedding.both()?;
        let [phi, psi] = self.bases(self.matcher.k)?;
        let functional_map = crate::fmap::functional_map_of(&map, &phi, &psi)?;
        Ok(Start { functional_map, map, back, embedding: Some(embedding), anchors: None })
    }

    /// The map by the first way, refined.
    pub(super) fn by_first_way(&self, landmarks: Option<&Landmarks>) -> Result<Found, Error> {
        let own = [&self.source.descriptors, &self.target.descriptors];
        self.refine(Refinement::Wavelet, &self.solved(own, self.matcher.k, 1.0, landmarks)?)
    }

    /// The functional maps of descriptors at another `k` or so many times the usual weight of the mask.
    pub(super) fn solved(
        &self,
        descriptors: [&Matrix<f32>; 2],
        k: usize,
        times: f64,
        landmarks: Option<&Landmarks>,
    ) -> Result<Start, Error> {
        let bases = self.bases(k)?;
        let solver = self.matcher.solver(self.is_part()).with_mask(times);
        let (maps, _) = self.functional_maps(descriptors, &bases, solver, landmarks)?;
        self.start(descriptors, &maps, solver.comparison(), &bases, landmarks)
    }
}
