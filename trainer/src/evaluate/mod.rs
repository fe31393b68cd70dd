//! The field's protocol over a dataset: every method matches every pair, and each map is compared with the ground
//! truth.
//!
//! [`evaluate`] gives, for each [`Method`], the errors of every pair, the average curve, and for computed maps what
//! their descriptors are worth (CMC curve, distances of correct matches); [`report`] writes tables, plots and
//! pictures of that.

mod descriptors;
mod pairs;
pub mod report;
mod shapes;

use crate::dataset::{Dataset, DatasetError};
use fmnet::eval::{ErrorCurve, ErrorSummary, EvalError, geodesic_errors, symmetric_geodesic_errors};
use fmnet::events::{Event, Observer};
use fmnet::io::{IoError, read_point_map};
use fmnet::pipeline::{DescribedShape, MatchOptions, Matcher};
use fmnet::point_map::PointMap;
use fmnet::quality::Quality;
use shapes::LoadedShape;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};
use std::time::Instant;
use thiserror::Error;

pub use pairs::{PairError, listed_pairs, random_pairs};

/// Formats of map files, in the order in which they are looked for.
const MAP_EXTENSIONS: [&str; 5] = ["txt", "vts", "npy", "csv", "npz"];

/// Something that gives a map for every pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Method {
    /// What tables and legends call it.
    pub label: String,
    /// Where its maps come from.
    pub maps: MapSource,
}

/// Where the maps of a method come from.
#[derive(Clone, Debug, PartialEq)]
pub enum MapSource {
    /// Computed with these settings.
    Computed(Box<MatchOptions>),
    /// Any other method's map files, `SOURCE__TARGET.EXT` in this folder.
    Files(PathBuf),
}

/// Settings of [`evaluate`].
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluateOptions {
    /// Whether a left-right mirrored map counts as right where the dataset knows the mirrored ground truth. Default
    /// false.
    pub symmetric: bool,
    /// Ranks of the CMC curve; 0: no figures of descriptors. Default 100.
    pub ranks: usize,
    /// Points of a pair that descriptors are compared at, at most, evenly spread; 1 or more. Default 1000.
    pub points: usize,
}

impl Default for EvaluateOptions {
    fn default() -> Self {
        Self { symmetric: false, ranks: 100, points: 1000 }
    }
}

/// What came of a method.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodResult {
    /// The method's label.
    pub label: String,
    /// Every pair, in the given order.
    pub pairs: Vec<PairResult>,
    /// The average of the pairs' curves.
    pub curve: ErrorCurve,
    /// What its descriptors are worth; `None` for map files.
    pub descriptors: Option<DescriptorFigures>,
}

/// What came of a pair.
#[derive(Clone, Debug, PartialEq)]
pub struct PairResult {
    /// Name of the source.
    pub source: String,
    /// Name of the target.
    pub target: String,
    /// The errors in a few numbers.
    pub summary: ErrorSummary,
    /// Their curve.
    pub curve: ErrorCurve,
    /// Whether it was compared with the mirrored ground truth.
    pub mirrored: bool,
    /// Seconds from described shapes to the map; 0 for map files.
    pub seconds: f64,
    /// The map, in the vertices of the files.
    pub map: PointMap,
    /// What the library measures of it without ground truth; none for map files.
    pub quality: Option<Quality>,
}

/// How well descriptors tell the right match from the others, over all pairs.
#[derive(Clone, Debug, PartialEq)]
pub struct DescriptorFigures {
    /// Probability that the right match is among the k nearest, k from 1, averaged over pairs, `[ranks]`.
    pub cmc: Vec<f64>,
    /// Distances of correct matches, over the mean distance of wrong ones, so that scales do not matter.
    pub distances: Vec<f32>,
}

/// Means over the pairs of a method: each pair counts the same.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanSummary {
    /// Mean error over sqrt(area).
    pub mean: f64,
    /// Median over the pairs of their mean errors, the upper one of two.
    pub median: f64,
    /// Share of exact matches.
    pub exact: f64,
    /// Share of matches within 0.05.
    pub within_005: f64,
    /// Area under the curve.
    pub auc: f64,
    /// Share of vertices matched, from 0 to 1.
    pub coverage: f64,
    /// Largest error of all pairs.
    pub worst: f64,
    /// Mean error in the unit of the target meshes.
    pub mean_length: f64,
    /// Mean over the pairs of their largest error, in the unit of the target meshes.
    pub worst_length: f64,
    /// Seconds for a pair of described shapes.
    pub seconds: f64,
}

/// Why a dataset cannot be evaluated on.
#[derive(Debug, Error)]
pub enum EvaluateError {
    /// A shape of the dataset is wrong.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A shape or pair, which it names, could not be described or matched.
    #[error(transparent)]
    Match(Box<fmnet::Error>),
    /// A map does not fit its pair.
    #[error("{pair}: {source}")]
    Compare {
        /// The pair.
        pair: String,
        /// Why.
        source: EvalError,
    },
    /// The model or the cache cannot be used.
    #[error(transparent)]
    Setup(#[from] Box<fmnet::Error>),
    /// A map file cannot be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A map file is missing.
    #[error("{folder}: no map {pair} as .txt, .vts, .npy or .csv")]
    NoMap {
        /// Where it was looked for.
        folder: PathBuf,
        /// The file's stem.
        pair: String,
    },
    /// There is nothing to evaluate.
    #[error(
        "there are no pairs to evaluate: the chosen splits need two shapes of one group at least; choose others (--splits)"
    )]
    NoPairs,
}

impl MethodResult {
    /// Means over the pairs.
    pub fn mean(&self) -> MeanSummary {
        let n = self.pairs.len().max(1) as f64;
        let mean = |value: fn(&PairResult) -> f64| self.pairs.iter().map(value).sum::<f64>() / n;
        MeanSummary {
            mean: mean(|p| p.summary.mean),
            median: median(self.pairs.iter().map(|p| p.summary.mean).collect()),
            exact: mean(|p| p.summary.exact),
            within_005: mean(|p| p.summary.within_005),
            auc: mean(|p| p.summary.auc),
            coverage: mean(|p| p.summary.coverage),
            worst: self.pairs.iter().map(|p| p.summary.worst).fold(0.0, f64::max),
            mean_length: mean(|p| p.summary.mean_length),
            worst_length: mean(|p| p.summary.worst_length),
            seconds: mean(|p| p.seconds),
        }
    }
}

/// The middle value, or the mean of both middle ones; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match (values.len() % 2, values.get(middle)) {
        (_, None) => 0.0,
        (1, Some(&value)) => value,
        (_, Some(&upper)) => (values[middle - 1] + upper) / 2.0,
    }
}

/// Matches all `pairs` (indices into the dataset's shapes) with all methods. The observer hears of every pair.
///
/// # Errors
/// If there are no pairs, a shape or a map file cannot be read or does not fit its pair, a model cannot be loaded, or
/// a pair cannot be matched.
pub fn evaluate(
    dataset: &Dataset,
    pairs: &[(usize, usize)],
    methods: &[Method],
    options: &EvaluateOptions,
    observer: Observer,
) -> Result<Vec<MethodResult>, EvaluateError> {
    if pairs.is_empty() {
        return Err(EvaluateError::NoPairs);
    }
    let shapes = shapes::load(dataset, pairs)?;
    methods.iter().map(|method| evaluate_method(&shapes, pairs, method, options, observer)).collect()
}

fn evaluate_method(
    shapes: &BTreeMap<usize, LoadedShape>,
    pairs: &[(usize, usize)],
    method: &Method,
    options: &EvaluateOptions,
    observer: Observer,
) -> Result<MethodResult, EvaluateError> {
    let mut maps = Maps::open(&method.maps)?;
    let mut results = Vec::new();
    let mut figures = Vec::new();
    for &(s, t) in pairs {
        let (source, target) = (&shapes[&s], &shapes[&t]);
        let pair = format!("{} -> {}", source.name, target.name);
        let start = Instant::now();
        let found = maps.map((s, source), (t, target), observer)?;
        let compared = compare(found, source, target, options)
            .and_then(|result| Ok((result, maps.figures((s, source), (t, target), options)?)));
        let (result, pair_figures) =
            compared.map_err(|source| EvaluateError::Compare { pair: pair.clone(), source })?;
        results.push(result);
        figures.extend(pair_figures);
        let subject = format!("{}: {pair}", method.label);
        observer(Event::Finished { subject, stage: "evaluated", seconds: start.elapsed().as_secs_f64() });
    }
    let curves: Vec<ErrorCurve> = results.iter().map(|r| r.curve.clone()).collect();
    let curve = ErrorCurve::average(&curves).ok_or(EvaluateError::NoPairs)?;
    let descriptors = descriptors::combined(figures);
    Ok(MethodResult { label: method.label.clone(), pairs: results, curve, descriptors })
}

/// A map against the ground truth, or the better of it and the mirrored one.
fn compare(
    FoundMap { map, quality, seconds }: FoundMap,
    source: &LoadedShape,
    target: &LoadedShape,
    options: &EvaluateOptions,
) -> Result<PairResult, EvalError> {
    let truth = source.ground_truth(target)?;
    let solver = target.solver.as_ref().expect("every target has a solver");
    let mirrored = if options.symmetric { source.mirrored_ground_truth(target)? } else { None };
    let (errors, mirrored) = match mirrored {
        None => (geodesic_errors(&map, &truth, solver, target.area)?, false),
        Some(mirrored) => {
            let found = symmetric_geodesic_errors(&map, &truth, &mirrored, solver, target.area)?;
            (found.errors, found.is_mirrored)
        }
    };
    Ok(PairResult {
        source: source.name.clone(),
        target: target.name.clone(),
        summary: ErrorSummary::new(&errors, target.area),
        curve: ErrorCurve::princeton(&errors),
        mirrored,
        seconds,
        map,
        quality,
    })
}

struct FoundMap {
    map: PointMap,
    quality: Option<Quality>,
    seconds: f64,
}

/// The maps of a method, one after the other; shapes are described once.
enum Maps {
    Computed { matcher: Box<Matcher>, described: BTreeMap<usize, DescribedShape> },
    Files(PathBuf),
}

impl Maps {
    fn open(source: &MapSource) -> Result<Self, EvaluateError> {
        Ok(match source {
            MapSource::Computed(options) => Self::Computed {
                matcher: Box::new(Matcher::new(options).map_err(Box::new)?),
                described: BTreeMap::new(),
            },
            MapSource::Files(folder) => Self::Files(folder.clone()),
        })
    }

    /// The map of a pair and the seconds it took, without those for describing the shapes.
    fn map(
        &mut self,
        (s, source): (usize, &LoadedShape),
        (t, target): (usize, &LoadedShape),
        observer: Observer,
    ) -> Result<FoundMap, EvaluateError> {
        match self {
            Self::Files(folder) => {
                let map = read_map(folder, &source.name, &target.name, target.mesh.n_vertices())?;
                Ok(FoundMap { map, quality: None, seconds: 0.0 })
            }
            Self::Computed { matcher, described } => {
                let warnings = |event| {
                    if let Event::Warning(_) = &event {
                        observer(event);
                    }
                };
                let failed = |e| EvaluateError::Match(Box::new(e));
                for (index, shape) in [(s, source), (t, target)] {
                    if let Entry::Vacant(slot) = described.entry(index) {
                        let (name, mesh) = (&shape.name, &shape.mesh);
                        let result = match shape.whole_area {
                            Some(area) => matcher.describe_part(name, mesh, area, &warnings),
                            None => matcher.describe(name, mesh, &warnings),
                        };
                        slot.insert(result.map_err(failed)?);
                    }
                }
                let start = Instant::now();
                let found =
                    matcher.match_shapes(&described[&s], &described[&t], &warnings).map_err(failed)?;
                let seconds = start.elapsed().as_secs_f64();
                Ok(FoundMap { map: found.map, quality: Some(found.quality), seconds })
            }
        }
    }

    /// What the descriptors of a pair are worth; `None` for map files.
    fn figures(
        &self,
        (s, source): (usize, &LoadedShape),
        (t, target): (usize, &LoadedShape),
        options: &EvaluateOptions,
    ) -> Result<Option<DescriptorFigures>, EvalError> {
        match self {
            Self::Computed { described, .. } if options.ranks > 0 => {
                let truth = source.ground_truth(target)?;
                descriptors::figures(&described[&s], &described[&t], &truth, options).map(Some)
            }
            _ => Ok(None),
        }
    }
}

/// The map file of a pair, whatever its format.
fn read_map(folder: &Path, source: &str, target: &str, n_target: usize) -> Result<PointMap, EvaluateError> {
    let pair = format!("{source}__{target}");
    let found = MAP_EXTENSIONS.iter().map(|e| folder.join(format!("{pair}.{e}"))).find(|p| p.is_file());
    match found {
        Some(path) => Ok(read_point_map(&path, Some(n_target))?),
        None => Err(EvaluateError::NoMap { folder: folder.to_path_buf(), pair }),
    }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn the_median_of_an_even_number_is_between_the_middle_ones() {
        assert_eq!(median(vec![20.0, 1.0]), 10.5);
        assert_eq!(median(vec![3.0, 20.0, 1.0]), 3.0);
        assert_eq!(median(Vec::new()), 0.0);
    }
}
