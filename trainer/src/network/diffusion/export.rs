//! The network as ONNX operators: inputs are the shape's quantities, the wave kernel signature is computed in the
//! graph.
//!
//! A channel is a row, `[width, n]`, as in the rest of the graph.

use super::{DiffusionOptions, SHOT_WIDTH};
use crate::export::{GraphBuilder, Parameters, axis, integer};
use fmnet::diffusion_net::{LEAST_EXPONENT, MIN_TIME};
use fmnet::network::contract::Quantity;
use fmnet::spectral::{WKS_HEADROOM, WKS_WIDTH, WKS_ZERO};

/// Farther than any logarithm of an eigenvalue.
const FAR: f32 = 1e3;

/// Adds the network to `graph`; returns the name of its output, `[outputs, n]`.
pub(super) fn graph(options: &DiffusionOptions, graph: &mut GraphBuilder, parameters: &Parameters) -> String {
    let pairs = options.eigenpairs();
    let all_values = graph.input(Quantity::Eigenvalues, pairs);
    let all_vectors = graph.input(Quantity::Eigenvectors, pairs);
    let mass = graph.input(Quantity::Mass, 0);
    let k = options.eigenfunctions;
    let operators = Operators {
        decaying: negated(graph, &all_values, k),
        eigenvectors: if k == pairs {
            all_vectors.clone()
        } else {
            graph.first("eigenvectors.k", &all_vectors, 1, k)
        },
        gradients: [Quantity::GradientsX, Quantity::GradientsY].map(|quantity| graph.input(quantity, k)),
        mass,
    };
    let mut x = first_layer(options, graph, parameters, &all_values, &all_vectors);
    for block in 0..options.blocks {
        x = residual_block(block, options.width, graph, parameters, &operators, &x);
    }
    let (weight, bias) = parameters.linear("output");
    graph.linear("output", &x, weight, bias)
}

struct Operators {
    /// `-lambda`, `[k]`.
    decaying: String,
    eigenvectors: String,
    gradients: [String; 2],
    mass: String,
}

fn negated(graph: &mut GraphBuilder, eigenvalues: &str, k: usize) -> String {
    let first = graph.first("eigenvalues.k", eigenvalues, 0, k);
    graph.node("Neg", "eigenvalues.negative", &[&first], Vec::new())
}

/// `W^T [wks, scale shot] + b`, the two inputs apart.
fn first_layer(
    options: &DiffusionOptions,
    graph: &mut GraphBuilder,
    parameters: &Parameters,
    eigenvalues: &str,
    eigenvectors: &str,
) -> String {
    let (weight, bias) = parameters.linear("input");
    let (of_wks, of_shot) = weight.split_at(options.wks_energies * options.width);
    let mut terms = Vec::new();
    if options.wks_energies > 0 {
        let wks = wave_kernel_signature(options, graph, eigenvalues, eigenvectors);
        terms.push(graph.product("input.wks", &wks, of_wks, options.wks_energies));
    }
    if options.takes_shot() {
        let shot = graph.input(Quantity::Shot, SHOT_WIDTH);
        let scaled: Vec<f32> = of_shot.iter().map(|w| w * options.shot_scale as f32).collect();
        let weight = graph.constant("input.shot.weight", &[SHOT_WIDTH, options.width], &scaled);
        let transposed = vec![integer("transA", 1), integer("transB", 1)];
        terms.push(graph.node("Gemm", "input.shot", &[&weight, &shot], transposed));
    }
    let bias = graph.constant("input.bias", &[options.width, 1], bias);
    let terms: Vec<&str> = terms.iter().map(String::as_str).collect();
    let sum = match terms[..] {
        [one] => one.to_string(),
        _ => graph.node("Add", "input.sum", &terms, Vec::new()),
    };
    graph.node("Add", "input", &[&sum, &bias], Vec::new())
}

/// `[energies, n]`.
fn wave_kernel_signature(
    options: &DiffusionOptions,
    graph: &mut GraphBuilder,
    eigenvalues: &str,
    eigenvectors: &str,
) -> String {
    let (q, pairs) = (options.wks_energies, options.eigenpairs());
    let (mut values, mut vectors) = (eigenvalues.to_string(), eigenvectors.to_string());
    if options.wks_eigenfunctions < pairs {
        values = graph.first("wks.eigenvalues", &values, 0, options.wks_eigenfunctions);
        vectors = graph.first("wks.eigenvectors", &vectors, 1, options.wks_eigenfunctions);
    }
    let scalar = |graph: &mut GraphBuilder, name: &str, value: f32| graph.constant(name, &[], &[value]);
    let zero = scalar(graph, "wks.zero", WKS_ZERO as f32);
    let one = scalar(graph, "wks.one", 1.0);
    let far = scalar(graph, "wks.far", FAR);
    let near = scalar(graph, "wks.near", -FAR);
    let known = graph.node("Greater", "wks.known", &[&values, &zero], Vec::new());
    let positive = graph.node("Where", "wks.positive", &[&known, &values, &one], Vec::new());
    let logs = graph.node("Log", "wks.logarithm", &[&positive], Vec::new());
    let low = graph.node("Where", "wks.low.entries", &[&known, &logs, &far], Vec::new());
    let low = graph.node("ReduceMin", "wks.low", &[&low], vec![axis(0), integer("keepdims", 1)]);
    let high = graph.node("Where", "wks.high.entries", &[&known, &logs, &near], Vec::new());
    let high = graph.node("ReduceMax", "wks.high", &[&high], vec![axis(0), integer("keepdims", 1)]);
    // Energies low + 2 s + step e with s = 7 range / q and step = (range - 4 s) / (q - 1): multiples of the range.
    let headroom = scalar(graph, "wks.headroom", WKS_HEADROOM as f32);
    let high = graph.node("Div", "wks.top", &[&high, &headroom], Vec::new());
    let range = graph.node("Sub", "wks.range", &[&high, &low], Vec::new());
    let width = WKS_WIDTH as f32 / q as f32;
    let step = if q > 1 { (1.0 - 4.0 * width) / (q - 1) as f32 } else { 0.0 };
    let shares: Vec<f32> = (0..q).map(|e| 2.0 * width + step * e as f32).collect();
    let shares = graph.constant("wks.shares", &[q, 1], &shares);
    let energies = graph.node("Mul", "wks.steps", &[&shares, &range], Vec::new());
    let energies = graph.node("Add", "wks.energies", &[&energies, &low], Vec::new());
    let away = graph.node("Sub", "wks.away", &[&energies, &logs], Vec::new());
    let away = graph.node("Div", "wks.relative", &[&away, &range], Vec::new());
    let square = graph.node("Mul", "wks.square", &[&away, &away], Vec::new());
    let factor = scalar(graph, "wks.factor", -1.0 / (2.0 * width * width));
    let exponent = graph.node("Mul", "wks.exponent", &[&square, &factor], Vec::new());
    let weights = graph.node("Exp", "wks.gaussian", &[&exponent], Vec::new());
    let none = scalar(graph, "wks.none", 0.0);
    let weights = graph.node("Where", "wks.weights", &[&known, &weights, &none], Vec::new());
    let axes = graph.integers("wks.axes", &[1]);
    let sums = graph.node("ReduceSum", "wks.sums", &[&weights, &axes], vec![integer("keepdims", 1)]);
    let least = scalar(graph, "wks.least", 1e-30);
    let sums = graph.node("Max", "wks.above_zero", &[&sums, &least], Vec::new());
    let weights = graph.node("Div", "wks.normalised", &[&weights, &sums], Vec::new());
    let squares = graph.node("Mul", "wks.squares", &[&vectors, &vectors], Vec::new());
    graph.node("Gemm", "wks", &[&weights, &squares], vec![integer("transB", 1)])
}

fn residual_block(
    block: usize,
    width: usize,
    graph: &mut GraphBuilder,
    parameters: &Parameters,
    operators: &Operators,
    x: &str,
) -> String {
    let part = |name: &str| format!("blocks.{block}.{name}");
    let plain = |graph: &mut GraphBuilder, op: &str, name: &str, inputs: [&str; 2]| {
        graph.node(op, &part(name), &inputs, Vec::new())
    };
    // The coefficients, `[width, k]`.
    let times: Vec<f32> = parameters.get(&part("time")).iter().map(|t| t.max(MIN_TIME as f32)).collect();
    let times = graph.constant(&part("time"), &[width, 1], &times);
    let exponent = plain(graph, "Mul", "exponent", [&times, &operators.decaying]);
    let least = graph.constant(&part("least"), &[], &[LEAST_EXPONENT as f32]);
    let exponent = plain(graph, "Max", "exponent.above", [&exponent, &least]);
    let decay = graph.node("Exp", &part("decay"), &[&exponent], Vec::new());
    let weighted = plain(graph, "Mul", "weighted", [x, &operators.mass]);
    let projected = plain(graph, "MatMul", "projected", [&weighted, &operators.eigenvectors]);
    let coefficients = plain(graph, "Mul", "coefficients", [&projected, &decay]);
    let [diffused, u, v] = [
        ("diffused", &operators.eigenvectors),
        ("u", &operators.gradients[0]),
        ("v", &operators.gradients[1]),
    ]
    .map(|(name, functions)| {
        graph.node("Gemm", &part(name), &[&coefficients, functions], vec![integer("transB", 1)])
    });
    let [real, imaginary] = ["gradient.real", "gradient.imaginary"].map(|name| parameters.get(&part(name)));
    let mut turned = |function: &str, name: &str, weight: &[f32]| {
        graph.product(
            &part(&format!("{name}.{}", if function == u { "u" } else { "v" })),
            function,
            weight,
            width,
        )
    };
    let (real_u, imaginary_u) = (turned(&u, "real", real), turned(&u, "imaginary", imaginary));
    let (real_v, imaginary_v) = (turned(&v, "real", real), turned(&v, "imaginary", imaginary));
    let of_u = plain(graph, "Sub", "turned.u", [&real_u, &imaginary_v]);
    let of_v = plain(graph, "Add", "turned.v", [&real_v, &imaginary_u]);
    let of_u = plain(graph, "Mul", "product.u", [&u, &of_u]);
    let of_v = plain(graph, "Mul", "product.v", [&v, &of_v]);
    let sum = plain(graph, "Add", "product", [&of_u, &of_v]);
    let directions = graph.node("Tanh", &part("directions"), &[&sum], Vec::new());
    let concatenated =
        graph.node("Concat", &part("features"), &[x, &diffused, &directions], vec![integer("axis", 0)]);
    let mut hidden = concatenated;
    for layer in ["mlp1", "mlp2"] {
        let (weight, bias) = parameters.linear(&part(layer));
        let linear = graph.linear(&part(layer), &hidden, weight, bias);
        hidden = graph.node("Relu", &part(&format!("{layer}.relu")), &[&linear], Vec::new());
    }
    let (weight, bias) = parameters.linear(&part("mlp3"));
    let out = graph.linear(&part("mlp3"), &hidden, weight, bias);
    plain(graph, "Add", "sum", [x, &out])
}
