//! The fused network against a plain implementation, its gradient against central differences.

use super::*;
use crate::fm_layer::functional_map;
use crate::network::parameter_values;
use crate::projection::{WeightedBasis, project};
use crate::soft_map::{SoftErrorInput, soft_error};
use crate::testing::{check_gradient, random};
use fmnet::fmap::{ColumnNorm, FmapSolver, resolvent_mask};

fn options(normalization: Normalization, activation: Activation) -> ResidualOptions {
    ResidualOptions { blocks: 2, width: 5, normalization, activation, ..ResidualOptions::default() }
}

fn parameters(options: &ResidualOptions) -> Vec<f64> {
    let len = options.blocks * 2 * (options.width * options.width + 2 * options.width);
    random(11, len).iter().map(|value| 0.9 * value + 0.2).collect()
}

fn fused(options: &ResidualOptions, input: &Tensor, statistics: StatisticsOf) -> FusedNetwork<f64> {
    FusedNetwork {
        input: input.flatten_all().unwrap().to_vec1().unwrap(),
        width: options.width,
        blocks: options.blocks,
        epsilon: options.epsilon,
        activation: options.activation,
        statistics,
        train: true,
        pool: Arc::default(),
        saved: SavedActivations::default(),
    }
}

/// The definition, entry by entry.
fn naive(options: &ResidualOptions, flat: &[f64], input: &[f64], groups: &[usize]) -> Vec<f64> {
    let width = options.width;
    let act = |x: f64| match options.activation {
        Activation::Elu if x <= 0.0 => x.exp() - 1.0,
        Activation::Relu if x <= 0.0 => 0.0,
        _ => x,
    };
    let mut x = input.to_vec();
    for block in flat.chunks(flat.len() / options.blocks) {
        let mut y = x.clone();
        for (half, part) in block.chunks(block.len() / 2).enumerate() {
            let (weight, affine) = part.split_at(width * width);
            let product =
                |i: usize, c: usize| (0..width).map(|l| y[i * width + l] * weight[l * width + c]).sum();
            let mut z: Vec<f64> = (0..y.len()).map(|at| product(at / width, at % width)).collect();
            let mut start = 0;
            for &rows in groups {
                for c in 0..width {
                    let at = |i: usize| (start + i) * width + c;
                    let mean = (0..rows).map(|i| z[at(i)]).sum::<f64>() / rows as f64;
                    let variance = (0..rows).map(|i| (z[at(i)] - mean).powi(2)).sum::<f64>() / rows as f64;
                    for i in 0..rows {
                        let normal = (z[at(i)] - mean) / (variance + options.epsilon).sqrt();
                        z[at(i)] = affine[c] * normal + affine[width + c];
                    }
                }
                start += rows;
            }
            let skip = |at: usize| if half == 1 { x[at] } else { 0.0 };
            y = z.iter().enumerate().map(|(at, &value)| act(skip(at) + value)).collect();
        }
        x = y;
    }
    x
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

#[test]
fn fused_and_composed_forward_passes_equal_the_definition() {
    for normalization in [Normalization::PerShape, Normalization::Running] {
        for activation in [Activation::Elu, Activation::Relu] {
            let options = options(normalization, activation);
            let flat = parameters(&options);
            let shapes = vec![601, 290];
            let input = random(5, 891 * options.width);
            let groups = if normalization == Normalization::PerShape { shapes } else { vec![891] };
            let expected = naive(&options, &flat, &input, &groups);

            let tensor = Tensor::from_vec(input, (891, options.width), &Device::Cpu).unwrap();
            let flat = Tensor::from_slice(&flat, flat.len(), &Device::Cpu).unwrap();
            let op = fused(&options, &tensor, StatisticsOf::Groups(groups.clone()));
            let out: Vec<f64> = flat.apply_op1(op).unwrap().flatten_all().unwrap().to_vec1().unwrap();
            assert!(largest_difference(&out, &expected) < 1e-11);
            let out = composed::forward(&options, &flat, &tensor, &groups, None).unwrap().descriptors;
            let out: Vec<f64> = out.flatten_all().unwrap().to_vec1().unwrap();
            assert!(largest_difference(&out, &expected) < 1e-11);
        }
    }
}

#[test]
fn single_precision_network_equals_the_definition() {
    let options = options(Normalization::PerShape, Activation::Elu);
    let network = ResidualNetwork::new(options.clone(), 0, &Device::Cpu).unwrap();
    let flat: Vec<f64> = parameter_values(&network).unwrap().iter().map(|&v| f64::from(v)).collect();
    let shapes = [input_rows(5, 30, options.width), input_rows(6, 10, options.width)];
    let out = Tensor::cat(&network.forward(&[&shapes[0], &shapes[1]]).unwrap(), 0).unwrap();
    let out: Vec<f64> = out.to_dtype(DType::F64).unwrap().flatten_all().unwrap().to_vec1().unwrap();
    let rows = shapes.iter().flat_map(|shape| shape.features.data());
    let input: Vec<f64> = rows.map(|&x| f64::from(x)).collect();
    assert!(largest_difference(&out, &naive(&options, &flat, &input, &[30, 10])) < 1e-5);
}

#[test]
fn gradients_of_all_parameter_families_equal_central_differences() {
    for normalization in [Normalization::PerShape, Normalization::Running] {
        for activation in [Activation::Elu, Activation::Relu] {
            let options = options(normalization, activation);
            let rows = 20;
            let input = Tensor::from_vec(random(7, rows * 5), (rows, 5), &Device::Cpu).unwrap();
            let groups = if normalization == Normalization::PerShape { vec![12, 8] } else { vec![20] };
            let weights = Tensor::from_vec(random(9, rows * 5), (rows, 5), &Device::Cpu).unwrap();
            let flat = parameters(&options);
            let flat = Tensor::from_slice(&flat, flat.len(), &Device::Cpu).unwrap();
            let loss = |out: Tensor| (out.sqr()? * &weights)?.sum_all();
            let by_op = |x: &Tensor| {
                loss(x.apply_op1(fused(&options, &input, StatisticsOf::Groups(groups.clone())))?)
            };
            check_gradient(&flat, by_op, 1e-7);
            check_gradient(
                &flat,
                |x| loss(composed::forward(&options, x, &input, &groups, None)?.descriptors),
                1e-7,
            );
        }
    }
}

#[test]
fn gradient_of_the_whole_loss_equals_central_differences() {
    let (points, k) = (20, 4);
    let input = Tensor::from_vec(random(7, 2 * points * 5), (2 * points, 5), &Device::Cpu).unwrap();
    let basis = |seed| random(seed, points * k).iter().map(|&value| value as f32).collect::<Vec<_>>();
    let bases = || [21, 22].map(|seed| WeightedBasis::<f64>::new(&basis(seed), &vec![1.0; points]));
    let wide = |seed| basis(seed).iter().map(|&value| f64::from(value)).collect::<Vec<_>>();
    let eigenvalues: Vec<f64> = (0..k).map(|l| 12.0 * l as f64).collect();
    let mask = resolvent_mask(&eigenvalues, &eigenvalues);
    let distances: Vec<f64> = random(23, points * points).iter().map(|value| value.abs()).collect();
    let flat = parameters(&options(Normalization::PerShape, Activation::Elu));
    let flat = Tensor::from_slice(&flat, flat.len(), &Device::Cpu).unwrap();
    for normalization in [Normalization::PerShape, Normalization::Running] {
        let options = options(normalization, Activation::Elu);
        let groups =
            if normalization == Normalization::PerShape { vec![points; 2] } else { vec![2 * points] };
        for (solver, norm) in [
            (FmapSolver::LeastSquares, ColumnNorm::L2),
            (FmapSolver::default(), ColumnNorm::L2),
            (FmapSolver::default(), ColumnNorm::L1),
        ] {
            let loss = |x: &Tensor| {
                let out = x.apply_op1(fused(&options, &input, StatisticsOf::Groups(groups.clone())))?;
                let [of_source, of_target] = bases();
                let source = project(&out.narrow(0, 0, points)?, of_source)?;
                let target = project(&out.narrow(0, points, points)?, of_target)?;
                let solved = functional_map(&source, &target, solver, &mask)?;
                let error = SoftErrorInput {
                    basis_source: wide(21),
                    basis_target: wide(22),
                    distances: distances.clone(),
                    norm,
                };
                Ok(soft_error(&solved.map, error)?.loss)
            };
            check_gradient(&flat, loss, 1e-5);
        }
    }
}

/// Random functions `[rows, width]`.
fn input_rows(seed: u64, rows: usize, width: usize) -> NetworkInput {
    let values = random(seed, rows * width).iter().map(|&x| x as f32).collect();
    NetworkInput { features: fmnet::Matrix::from_vec(rows, width, values), ..NetworkInput::default() }
}

#[test]
fn running_statistics_converge_to_those_of_a_repeated_batch() {
    let options = ResidualOptions { momentum: 0.5, ..options(Normalization::Running, Activation::Elu) };
    let mut network = ResidualNetwork::new(options, 0, &Device::Cpu).unwrap();
    let shapes = [input_rows(5, 40, 5), input_rows(6, 20, 5)];
    let shapes = [&shapes[0], &shapes[1]];
    let mut trained = Vec::new();
    for _ in 0..40 {
        let (out, statistics) = network.forward_train(&shapes).unwrap();
        network.accept(statistics);
        trained = out;
    }
    let tested = network.forward(&shapes).unwrap();
    for (trained, tested) in trained.iter().zip(&tested) {
        let worst = (trained - tested).unwrap().abs().unwrap().max_all().unwrap().to_scalar::<f32>().unwrap();
        assert!(worst < 1e-5, "largest difference {worst:e}");
    }
}

#[test]
fn parameters_are_named_in_the_order_of_the_flat_vector() {
    let network =
        ResidualNetwork::new(options(Normalization::PerShape, Activation::Elu), 0, &Device::Cpu).unwrap();
    let infos = network.parameters();
    assert_eq!(infos[0].name, "blocks.0.linear1.weight");
    assert_eq!(infos[11].name, "blocks.1.norm2.shift");
    let end = infos.iter().fold(0, |offset, info| {
        assert_eq!(info.offset, offset);
        offset + info.len()
    });
    let values = parameter_values(&network).unwrap();
    assert_eq!(end, values.len());
    let scales = &values[infos[1].offset..infos[1].offset + infos[1].len()];
    assert!(scales.iter().all(|&scale| scale == 1.0));
}

#[test]
fn threads_and_buffers_do_not_change_the_bits() {
    let options = ResidualOptions { blocks: 2, width: 48, ..ResidualOptions::default() };
    let shapes = [input_rows(5, 900, 48), input_rows(6, 500, 48)];
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut network = ResidualNetwork::new(options.clone(), 0, &Device::Cpu).unwrap();
            let mut gradients = Vec::new();
            for _ in 0..2 {
                let (out, _) = network.forward_train(&[&shapes[0], &shapes[1]]).unwrap();
                let store =
                    Tensor::cat(&out, 0).unwrap().sqr().unwrap().sum_all().unwrap().backward().unwrap();
                gradients.push(store.get(network.variable()).unwrap().to_vec1::<f32>().unwrap());
            }
            gradients
        })
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one[0], one[1]);
    assert_eq!(one, two);
}
