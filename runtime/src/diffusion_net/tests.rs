use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn random(generator: &mut ChaCha8Rng, len: usize) -> Vec<f64> {
    (0..len).map(|_| generator.random_range(-1.0..1.0)).collect()
}

struct Setup {
    architecture: Architecture,
    parameters: Vec<f64>,
    input: Vec<f64>,
    operators: Operators<f64>,
}

/// More rows than a chunk has, so that all sums have several parts.
fn setup() -> Setup {
    let architecture = Architecture { inputs: 3, blocks: 2, width: 4, outputs: 5 };
    let (n, k) = (CHUNK * 5 + 17, 6);
    let generator = &mut ChaCha8Rng::seed_from_u64(3);
    let mut parameters = random(generator, architecture.n_parameters());
    for parameter in architecture.parameters().iter().filter(|p| p.name.ends_with("time")) {
        parameters[parameter.offset..parameter.offset + parameter.len()]
            .iter_mut()
            .for_each(|t| *t = t.abs());
    }
    let operators = Operators {
        mass: random(generator, n).iter().map(|x| (1.5 + x) / n as f64).collect(),
        eigenvalues: (0..k).map(|i| 0.4 * i as f64).collect(),
        eigenvectors: random(generator, n * k),
        gradients_x: random(generator, n * k),
        gradients_y: random(generator, n * k),
    };
    let input = random(generator, n * architecture.inputs);
    Setup { architecture, parameters, input, operators }
}

fn descriptors(setup: &Setup, parameters: &[f64]) -> Vec<f64> {
    forward(&setup.architecture, parameters, &setup.input, &setup.operators, false).unwrap().0
}

#[test]
fn parameters_fill_the_flat_vector() {
    let Architecture { inputs, width, outputs, .. } = setup().architecture;
    let parameters = setup().architecture.parameters();
    let last = parameters.last().unwrap();
    assert_eq!(last.offset + last.len(), setup().architecture.n_parameters());
    assert_eq!(parameters[0].shape, [inputs, width]);
    assert_eq!(last.shape, [outputs]);
}

#[test]
fn the_gradient_of_every_parameter_family_equals_the_central_differences() {
    const STEP: f64 = 1e-6;
    let setup = setup();
    let Setup { architecture, parameters, input, operators } = &setup;
    let weights = random(&mut ChaCha8Rng::seed_from_u64(9), operators.n() * architecture.outputs);
    let loss = |parameters: &[f64]| -> f64 {
        descriptors(&setup, parameters).iter().zip(&weights).map(|(d, w)| w * d * d).sum()
    };
    let (out, kept) = forward(architecture, parameters, input, operators, true).unwrap();
    let grad: Vec<f64> = out.iter().zip(&weights).map(|(d, w)| 2.0 * w * d).collect();
    let gradient = backward(architecture, parameters, input, operators, &kept.unwrap(), &grad).unwrap();
    for family in architecture.parameters() {
        let own = family.offset..family.offset + family.len();
        let largest = gradient[own.clone()].iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert!(largest > 0.0, "{} has no gradient", family.name);
        for i in own.step_by(family.len().div_ceil(7)) {
            let at = |step: f64| {
                let mut moved = parameters.clone();
                moved[i] += step;
                loss(&moved)
            };
            let numeric = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            assert!(
                (gradient[i] - numeric).abs() < 2e-5 * largest.max(1.0),
                "{} entry {}: {} by the backward pass, {numeric} by differences",
                family.name,
                i - family.offset,
                gradient[i]
            );
        }
    }
}

#[test]
fn turned_tangent_frames_change_nothing_and_mirrored_ones_much() {
    let setup = setup();
    let before = descriptors(&setup, &setup.parameters);
    let (k, n) = (setup.operators.k(), setup.operators.n());
    let mut turned = Setup { operators: setup.operators.clone(), input: setup.input.clone(), ..setup };
    for v in 0..n {
        let (sin, cos) = (v as f64).sin_cos();
        for i in v * k..(v + 1) * k {
            let (x, y) = (turned.operators.gradients_x[i], turned.operators.gradients_y[i]);
            turned.operators.gradients_x[i] = cos * x - sin * y;
            turned.operators.gradients_y[i] = sin * x + cos * y;
        }
    }
    let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let after = descriptors(&turned, &turned.parameters);
    assert!(difference(&before, &after) < 1e-10);
    turned.operators.gradients_y.iter_mut().for_each(|y| *y = -*y);
    let mirrored = descriptors(&turned, &turned.parameters);
    assert!(difference(&before, &mirrored) > 1e-3);
}

#[test]
fn flipped_signs_of_eigenvectors_and_other_orders_of_vertices_change_nothing() {
    let setup = setup();
    let before = descriptors(&setup, &setup.parameters);
    let (k, n, inputs) = (setup.operators.k(), setup.operators.n(), setup.architecture.inputs);
    let order: Vec<usize> = (0..n).map(|v| (v * 7) % n).collect();
    let rows = |values: &[f64], width: usize| -> Vec<f64> {
        order.iter().flat_map(|&v| values[v * width..(v + 1) * width].iter().copied()).collect()
    };
    let flipped = |values: &[f64]| -> Vec<f64> {
        rows(values, k).iter().enumerate().map(|(i, x)| if i % k == 2 { -x } else { *x }).collect()
    };
    let operators = Operators {
        mass: rows(&setup.operators.mass, 1),
        eigenvalues: setup.operators.eigenvalues.clone(),
        eigenvectors: flipped(&setup.operators.eigenvectors),
        gradients_x: flipped(&setup.operators.gradients_x),
        gradients_y: flipped(&setup.operators.gradients_y),
    };
    let other = Setup { operators, input: rows(&setup.input, inputs), ..setup };
    let after = descriptors(&other, &other.parameters);
    let expected = rows(&before, other.architecture.outputs);
    assert!(after.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-10));
}

#[test]
fn the_result_does_not_depend_on_the_threads() {
    let setup = setup();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| descriptors(&setup, &setup.parameters))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn arrays_that_do_not_fit_are_named() {
    let setup = setup();
    let mut operators = setup.operators.clone();
    operators.gradients_y.pop();
    let error =
        forward(&setup.architecture, &setup.parameters, &setup.input, &operators, false).err().unwrap();
    assert!(error.starts_with("gradients_y has "), "{error}");
    let error = forward(&setup.architecture, &setup.parameters[1..], &setup.input, &setup.operators, false);
    assert!(error.err().unwrap().contains("parameters, expected"));
}

/// Long diffusion times leave no subnormal numbers, with which processors are slow.
#[test]
fn what_long_times_leave_is_normal_in_single_precision() {
    let Setup { architecture, mut parameters, operators, .. } = setup();
    for parameter in architecture.parameters().iter().filter(|p| p.name.ends_with("time")) {
        parameters[parameter.offset..parameter.offset + parameter.len()].fill(50.0);
    }
    let parameters: Vec<f32> = parameters.iter().map(|&x| x as f32).collect();
    let mut rest = &parameters[architecture.inputs * architecture.width + architecture.width..];
    let block = block::Block::take(&mut rest, architecture.width);
    let decay = block.decay(&operators.cast::<f32>().eigenvalues);
    assert_eq!(decay[..architecture.width], [1.0; 4]);
    assert!(decay.iter().all(|x| x.is_normal()) && decay.last().is_some_and(|&x| x < 1e-17));
}
