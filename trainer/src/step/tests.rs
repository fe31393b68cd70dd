//! The whole step on synthetic pairs.

use super::*;
use crate::network::{
    Normalization, ResidualNetwork, ResidualOptions, parameter_values, set_parameter_values,
};
use crate::testing::random;
use candle_core::Device;
use fmnet::fmap::ColumnNorm;

const POINTS: usize = 60;
const K: usize = 8;
const WIDTH: usize = 16;

/// Cosines on points along a line: a basis that is nearly orthonormal for equal masses.
fn shape(seed: u64, signal: &[f64]) -> ShapeBatch {
    let noise = random(seed, POINTS * WIDTH);
    let shot = signal.iter().zip(noise).map(|(s, n)| (s + 0.3 * n) as f32).collect();
    let cosine = |i: usize, l: usize| {
        let position = (i as f64 + 0.5) / POINTS as f64;
        if l == 0 { 1.0 } else { 2f64.sqrt() * (std::f64::consts::PI * l as f64 * position).cos() }
    };
    ShapeBatch {
        input: NetworkInput { features: Matrix::from_vec(POINTS, WIDTH, shot), ..NetworkInput::default() },
        points: (0..POINTS as u32).collect(),
        places: None,
        basis: Matrix::from_fn(POINTS, K, |i, l| cosine(i, l) as f32),
        mass: vec![1.0 / POINTS as f32; POINTS],
        eigenvalues: (0..K).map(|l| (std::f64::consts::PI * l as f64).powi(2)).collect(),
        distances: Some(Matrix::from_fn(POINTS, POINTS, |i, j| i.abs_diff(j) as f32 / POINTS as f32)),
    }
}

fn pair(seed: u64) -> PairBatch {
    let signal = random(100 + seed, POINTS * WIDTH);
    let negatives = (0..POINTS as u32).map(|i| (i, (i + 20) % POINTS as u32)).collect();
    let (source, target) = (shape(2 * seed, &signal), shape(2 * seed + 1, &signal));
    let map = |seed| Matrix::from_vec(K, K, random(seed, K * K));
    let ground_truth = Some([map(50 + seed), map(60 + seed)]);
    let points = |from: &ShapeBatch, to: &ShapeBatch| AssignmentPoints {
        from: (0..POINTS as u32).collect(),
        to: (0..POINTS as u32).collect(),
        basis_from: from.basis.clone(),
        inverse_to: Matrix::from_fn(K, POINTS, |l, i| to.basis[(i, l)] / POINTS as f32),
    };
    let assignment = Some([points(&source, &target), points(&target, &source)]);
    PairBatch { source, target, source_is_part: false, negatives, ground_truth, assignment }
}

/// A pair of which the source lacks the last third of the points.
fn part_pair(seed: u64) -> PairBatch {
    let mut pair = pair(seed);
    let rows: Vec<u32> = (0..POINTS as u32 * 2 / 3).collect();
    let part = &mut pair.source;
    part.input.features = part.input.features.select_rows(&rows);
    (part.basis, part.points) = (part.basis.select_rows(&rows), rows.clone());
    part.mass.truncate(rows.len());
    part.distances = None;
    pair.negatives.retain(|&(i, j)| (i as usize) < rows.len() && (j as usize) < rows.len());
    PairBatch { source_is_part: true, assignment: None, ..pair }
}

fn runner(options: StepOptions) -> StepRunner {
    let network = ResidualOptions { blocks: 2, width: WIDTH, ..ResidualOptions::default() };
    StepRunner::new(Box::new(ResidualNetwork::new(network, 0, &Device::Cpu).unwrap()), options).unwrap()
}

fn all_options() -> Vec<StepOptions> {
    let soft = |column_norm| LossOptions { column_norm, ..LossOptions::soft_error() };
    let unsupervised = LossOptions {
        bijectivity: 1.0,
        orthogonality: 0.5,
        coupling: 1.0,
        temperature: 0.5,
        ..LossOptions::none()
    };
    let supervised = LossOptions { temperature: 0.5, ..LossOptions::default() };
    let with =
        |functional_map: FmapSolver, loss| StepOptions { functional_map, loss, ..StepOptions::default() };
    vec![
        with(FmapSolver::LeastSquares, soft(ColumnNorm::L2)),
        with(FmapSolver::default(), soft(ColumnNorm::L2)),
        with(FmapSolver::default(), soft(ColumnNorm::L1)),
        with(FmapSolver::default(), LossOptions { margin: 3.0, ..LossOptions::siamese() }),
        with(FmapSolver::default(), supervised),
        with(FmapSolver::default(), unsupervised),
    ]
}

/// All options on a pair of whole shapes, and on a part and its whole.
fn all_cases() -> impl Iterator<Item = (StepOptions, [PairBatch; 1])> {
    let fits = |(options, [pair]): &(StepOptions, [PairBatch; 1])| {
        !pair.source_is_part || options.loss.bijectivity == 0.0
    };
    all_options()
        .into_iter()
        .flat_map(|options| [pair(1), part_pair(1)].map(|pair| (options.clone(), [pair])))
        .filter(fits)
}

#[test]
fn a_pair_is_learned_in_some_dozens_of_steps() {
    for (options, pairs) in all_cases() {
        let mut runner = runner(options.clone());
        let first = runner.step(&pairs, 1e-2).unwrap();
        let last = (0..60).map(|_| runner.step(&pairs, 1e-2).unwrap()).last().unwrap();
        // The cross entropy of 60 points at this temperature has a floor of its own.
        let share = if options.loss.contrastive > 0.0 { 0.75 } else { 0.5 };
        assert!(last.loss < share * first.loss, "{options:?}: {first:?} to {last:?}");
    }
}

#[test]
fn gradient_of_the_whole_loss_equals_differences_along_it() {
    for (options, pairs) in all_cases() {
        let mut runner = runner(options.clone());
        let values = parameter_values(runner.network.as_ref()).unwrap();
        let gradient = runner.gradient(&pairs).unwrap().gradient;
        let gradient: Vec<f32> = gradient.to_vec1().unwrap();
        let length = gradient.iter().map(|&g| f64::from(g).powi(2)).sum::<f64>().sqrt();
        let mut loss_at = |step: f64| {
            let moved: Vec<f32> = values
                .iter()
                .zip(&gradient)
                .map(|(&v, &g)| (f64::from(v) + step / length * f64::from(g)) as f32)
                .collect();
            set_parameter_values(runner.network.as_ref(), &moved).unwrap();
            runner.gradient(&pairs).unwrap().stats.loss
        };
        let step = 3e-3;
        let slope = (loss_at(step) - loss_at(-step)) / (2.0 * step);
        assert!((slope - length).abs() < 2e-2 * length, "{options:?}: slope {slope}, gradient {length}");
    }
}

#[test]
fn threads_do_not_change_the_bits() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let loss = LossOptions { soft_error: 1.0, ..LossOptions::default() };
            let mut runner = runner(StepOptions { clip: Some(1e-3), loss, ..StepOptions::default() });
            let stats: Vec<_> = (0..3).map(|i| runner.step(&[pair(i), pair(i + 1)], 1e-3).unwrap()).collect();
            (stats, parameter_values(runner.network.as_ref()).unwrap())
        })
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn accumulated_gradient_is_the_mean_over_the_pairs() {
    let mut runner = runner(StepOptions::default());
    let alone: Vec<Vec<f32>> =
        [pair(1), pair(2)].map(|pair| runner.gradient(&[pair]).unwrap().gradient.to_vec1().unwrap()).into();
    let both: Vec<f32> = runner.gradient(&[pair(1), pair(2)]).unwrap().gradient.to_vec1().unwrap();
    for ((a, b), both) in alone[0].iter().zip(&alone[1]).zip(both) {
        assert!(((a + b) / 2.0 - both).abs() < 1e-6);
    }
}

#[test]
fn running_statistics_and_clipping_train_too() {
    let network = ResidualOptions {
        blocks: 2,
        width: WIDTH,
        normalization: Normalization::Running,
        ..ResidualOptions::default()
    };
    let options = StepOptions { clip: Some(0.01), ..StepOptions::default() };
    let options = StepOptions { loss: LossOptions::soft_error(), ..options };
    let network = Box::new(ResidualNetwork::new(network, 0, &Device::Cpu).unwrap());
    let mut runner = StepRunner::new(network, options).unwrap();
    let first = runner.step(&[pair(1)], 1e-2).unwrap();
    let last = (0..40).map(|_| runner.step(&[pair(1)], 1e-2).unwrap()).last().unwrap();
    assert!(last.loss < 0.7 * first.loss);
    let statistics = runner.network.statistics();
    assert_ne!(statistics[0][0].mean, vec![0.0; WIDTH]);
    let mut refused = pair(1);
    refused.source.basis.data_mut().fill(f32::INFINITY);
    runner.step(&[refused], 1e-2).unwrap_err();
    assert_eq!(runner.network.statistics(), statistics, "a refused step leaves the statistics as they were");
}

#[test]
fn a_batch_that_does_not_fit_names_the_part() {
    let mut runner = runner(StepOptions::default());
    let mut wrong = pair(1);
    wrong.target.mass.pop();
    let error = runner.step(&[pair(1), wrong], 1e-3).unwrap_err().to_string();
    assert!(error.contains("pair 1") && error.contains("vertex areas of the target"), "{error}");
    let mut nan = pair(1);
    nan.source.input.features.data_mut().fill(f32::NAN);
    let before = parameter_values(runner.network.as_ref()).unwrap();
    assert!(runner.step(&[nan], 1e-3).unwrap_err().to_string().contains("NaN"));
    assert_eq!(before, parameter_values(runner.network.as_ref()).unwrap());
}
