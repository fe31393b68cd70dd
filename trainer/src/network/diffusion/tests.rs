//! The fused op against Candle's own ops, values and gradients.

use super::*;
use crate::testing::random;
use fmnet::Matrix;
use fmnet::diffusion_net::Operators;

#[test]
fn the_fused_op_and_candles_own_ops_agree_in_value_and_gradient() {
    let architecture = Architecture { inputs: 3, blocks: 2, width: 4, outputs: 5 };
    let (n, k) = (300, 6);
    let values = |seed: u64, len: usize| random(seed, len).iter().map(|&x| x as f32).collect::<Vec<_>>();
    let shape = NetworkInput {
        features: Matrix::from_vec(n, 3, values(1, n * 3)),
        operators: Operators {
            mass: values(2, n).iter().map(|x| (1.5 + x) / n as f32).collect(),
            eigenvalues: (0..k).map(|i| 0.4 * i as f32).collect(),
            eigenvectors: values(3, n * k),
            gradients_x: values(4, n * k),
            gradients_y: values(5, n * k),
        },
    };
    let mut parameters = random(6, architecture.n_parameters());
    for time in architecture.parameters().iter().filter(|p| p.name.ends_with("time")) {
        parameters[time.offset..time.offset + time.len()].iter_mut().for_each(|t| *t = t.abs() + 0.01);
    }
    let weights = Tensor::new(random(7, n * 5), &Device::Cpu).unwrap().reshape((n, 5)).unwrap();
    let run = |fused: bool| -> (Vec<f64>, Vec<f64>) {
        let variable = Var::new(parameters.clone(), &Device::Cpu).unwrap();
        let out = match fused {
            true => {
                let input = shape.features.data().iter().map(|&x| f64::from(x)).collect();
                let op = DiffusionOp::<f64>::new(architecture, input, shape.operators.cast(), true);
                variable.as_tensor().apply_op1(op)
            }
            false => composed::forward(&architecture, variable.as_tensor(), &shape),
        };
        let out = out.unwrap();
        let gradients = (out.sqr().unwrap() * &weights).unwrap().sum_all().unwrap().backward().unwrap();
        let gradient = gradients.get(&variable).unwrap().to_vec1().unwrap();
        (out.flatten_all().unwrap().to_vec1().unwrap(), gradient)
    };
    let (fused, composed) = (run(true), run(false));
    for (a, b) in [(fused.0, composed.0), (fused.1, composed.1)] {
        let largest = b.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-10 * largest, "{worst:e} of {largest:e}");
    }
}

#[test]
fn options_out_of_range_are_named() {
    let error = |options: DiffusionOptions| {
        DiffusionNetwork::new(options, 1, &Device::Cpu).err().unwrap().to_string()
    };
    let default = DiffusionOptions::default();
    assert!(error(DiffusionOptions { blocks: 0, ..default.clone() }).contains("blocks is 0"));
    let none = DiffusionOptions { wks_energies: 0, shot_scale: 0.0, ..default };
    assert!(error(none).contains("no inputs"));
}
