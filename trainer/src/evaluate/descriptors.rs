//! What descriptors are worth, whatever comes of the map: CMC curves and distances of correct matches.

use super::{DescriptorFigures, EvaluateOptions};
use fmnet::eval::{EvalError, GroundTruth, cmc_curve, correct_match_distances, match_ranks};
use fmnet::pipeline::DescribedShape;
use fmnet::shape::{Shape, WayBack};

/// The figures of a pair.
pub(super) fn figures(
    source: &DescribedShape,
    target: &DescribedShape,
    truth: &GroundTruth,
    options: &EvaluateOptions,
) -> Result<DescriptorFigures, EvalError> {
    let truth = on_working_meshes(truth, &source.shape, &target.shape, options.points)?;
    let (f, g) = (&source.descriptors, &target.descriptors);
    let ranks = match_ranks(f, g, &truth)?;
    let unit = mean(&correct_match_distances(f, g, &shifted(&truth)?)?).max(f32::MIN_POSITIVE);
    let distances = correct_match_distances(f, g, &truth)?.iter().map(|d| d / unit).collect();
    Ok(DescriptorFigures { cmc: cmc_curve(&ranks, options.ranks), distances })
}

/// The figures of several pairs taken together; `None` of none.
pub(super) fn combined(figures: Vec<DescriptorFigures>) -> Option<DescriptorFigures> {
    let ranks = figures.first()?.cmc.len();
    let share = |rank: usize| figures.iter().map(|f| f.cmc[rank]).sum::<f64>() / figures.len() as f64;
    Some(DescriptorFigures {
        cmc: (0..ranks).map(share).collect(),
        distances: figures.iter().flat_map(|f| &f.distances).copied().collect(),
    })
}

/// At most `points` of the correct matches, those whose vertices both survived decimation, evenly spread.
fn on_working_meshes(
    truth: &GroundTruth,
    source: &Shape,
    target: &Shape,
    points: usize,
) -> Result<GroundTruth, EvalError> {
    let (work_source, work_target) = (source.way_back.work_of_input(), target.way_back.work_of_input());
    let pairs: Vec<(u32, u32)> = (truth.pairs().iter())
        .map(|&(s, t)| (work_source[s as usize], work_target[t as usize]))
        .filter(|&(s, t)| s != WayBack::NONE && t != WayBack::NONE)
        .collect();
    let stride = pairs.len().div_ceil(points.max(1)).max(1);
    let pairs = pairs.into_iter().step_by(stride).collect();
    GroundTruth::new(pairs, source.mesh().n_vertices(), target.mesh().n_vertices())
}

/// Wrong matches: each source vertex with the target vertex of a match half the list away.
fn shifted(truth: &GroundTruth) -> Result<GroundTruth, EvalError> {
    let pairs = truth.pairs();
    let half = pairs.len() / 2;
    let wrong = pairs.iter().enumerate().map(|(i, &(s, _))| (s, pairs[(i + half) % pairs.len()].1));
    GroundTruth::new(wrong.collect(), truth.n_source(), truth.n_target())
}

fn mean(values: &[f32]) -> f32 {
    (values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len().max(1) as f64) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_count_the_same_in_the_curve() {
        let one = |cmc: Vec<f64>, n: usize| DescriptorFigures { cmc, distances: vec![0.5; n] };
        let all = combined(vec![one(vec![0.0, 1.0], 3), one(vec![1.0, 1.0], 1)]).unwrap();
        assert_eq!((all.cmc, all.distances.len()), (vec![0.5, 1.0], 4));
        assert_eq!(combined(Vec::new()), None);
    }

    #[test]
    fn shifted_matches_are_wrong() {
        let truth = GroundTruth::identity(5);
        let wrong = shifted(&truth).unwrap();
        assert!(wrong.pairs().iter().all(|(s, t)| s != t));
    }
}
