//! The network as ONNX operators. Statistics of each shape stay in the graph, as `ReduceMean` over the vertices;
//! trained statistics are folded into the linear layers.

use super::{Activation, Normalization, ResidualNetwork};
use crate::export::{GraphBuilder, Parameters, axis, float, integer, integers};
use fmnet::network::contract::Quantity;

/// Adds the network to `graph`; returns the name of its output, `[width, n]`.
pub(super) fn graph(network: &ResidualNetwork, graph: &mut GraphBuilder, parameters: &Parameters) -> String {
    let options = network.options();
    let shot = graph.input(Quantity::Shot, options.width);
    let mut x = graph.node("Transpose", "channels", &[&shot], vec![integers("perm", &[1, 0])]);
    graph.constant("epsilon", &[1, 1], &[options.epsilon as f32]);
    for block in 0..options.blocks {
        let half = |graph: &mut GraphBuilder, input: &str, half: usize| {
            let part = |name: &str| parameters.get(&format!("blocks.{block}.{name}"));
            let weight = part(&format!("linear{half}.weight"));
            let (scale, shift) = (part(&format!("norm{half}.scale")), part(&format!("norm{half}.shift")));
            let name = format!("block{block}.{half}");
            match options.normalization {
                Normalization::PerShape => normalized_linear(graph, &name, input, weight, scale, shift),
                Normalization::Running => {
                    let moments = &network.running_statistics()[block][half - 1];
                    let (weight, bias) =
                        folded(weight, scale, shift, &moments.mean, &moments.variance, options.epsilon);
                    graph.linear(&name, input, &weight, &bias)
                }
            }
        };
        let inner = half(graph, &x, 1);
        let inner = activation(graph, options.activation, &format!("block{block}.1.activation"), &inner);
        let outer = half(graph, &inner, 2);
        let sum = graph.node("Add", &format!("block{block}.sum"), &[&x, &outer], Vec::new());
        x = activation(graph, options.activation, &format!("block{block}.activation"), &sum);
    }
    x
}

fn activation(graph: &mut GraphBuilder, activation: Activation, name: &str, x: &str) -> String {
    match activation {
        Activation::Elu => graph.node("Elu", name, &[x], vec![float("alpha", 1.0)]),
        Activation::Relu => graph.node("Relu", name, &[x], Vec::new()),
    }
}

/// `scale (h - mean) / sqrt(variance + epsilon) + shift` with `h = W^T x` and the statistics taken over the vertices.
fn normalized_linear(
    graph: &mut GraphBuilder,
    name: &str,
    x: &str,
    weight: &[f32],
    scale: &[f32],
    shift: &[f32],
) -> String {
    let width = scale.len();
    let scale = graph.constant(&format!("{name}.scale"), &[width, 1], scale);
    let shift = graph.constant(&format!("{name}.shift"), &[width, 1], shift);
    let step = |part: &str| format!("{name}.{part}");
    let h = graph.product(&step("product"), x, weight, width);
    let mean = vertex_mean(graph, &step("mean"), &h);
    let centered = graph.node("Sub", &step("centered"), &[&h, &mean], Vec::new());
    let square = graph.node("Mul", &step("square"), &[&centered, &centered], Vec::new());
    let variance = vertex_mean(graph, &step("variance"), &square);
    let above_zero = graph.node("Add", &step("above_zero"), &[&variance, "epsilon"], Vec::new());
    let deviation = graph.node("Sqrt", &step("deviation"), &[&above_zero], Vec::new());
    let factor = graph.node("Div", &step("factor"), &[&scale, &deviation], Vec::new());
    let scaled = graph.node("Mul", &step("scaled"), &[&centered, &factor], Vec::new());
    graph.node("Add", &step("normalized"), &[&scaled, &shift], Vec::new())
}

fn vertex_mean(graph: &mut GraphBuilder, name: &str, x: &str) -> String {
    graph.node("ReduceMean", name, &[x], vec![axis(1), integer("keepdims", 1)])
}

/// A linear layer and the normalisation after it as one linear layer:
/// `scale (x W - mean) / sqrt(variance + epsilon) + shift`.
fn folded(
    weight: &[f32],
    scale: &[f32],
    shift: &[f32],
    mean: &[f64],
    variance: &[f64],
    epsilon: f64,
) -> (Vec<f32>, Vec<f32>) {
    let width = scale.len();
    let factor: Vec<f64> = (0..width).map(|j| f64::from(scale[j]) / (variance[j] + epsilon).sqrt()).collect();
    let bias = (0..width).map(|j| (f64::from(shift[j]) - mean[j] * factor[j]) as f32).collect();
    let weight = weight.iter().enumerate().map(|(i, &w)| (f64::from(w) * factor[i % width]) as f32).collect();
    (weight, bias)
}
