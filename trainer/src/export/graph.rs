//! Building an ONNX graph node by node.

use crate::network::Activation;
use fmnet::network::contract::{INPUT, OUTPUT};
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, StringStringEntryProto,
    TensorProto, TensorShapeProto, TypeProto, ValueInfoProto, type_proto,
};

const OPSET: i64 = 17;
/// The version of the file format that came with opset 17.
const IR_VERSION: i64 = 8;

/// A graph under construction. Inside, features are `[width, n]`, a channel a row: tract (0.23) vectorises what it does to rows
/// of any length, but not a row of 352 spread over all rows. Every method returns the name of its result.
pub(super) struct GraphBuilder {
    width: usize,
    activation: Activation,
    nodes: Vec<NodeProto>,
    constants: Vec<TensorProto>,
}

impl GraphBuilder {
    pub(super) fn new(width: usize, activation: Activation, epsilon: f32) -> Self {
        let mut builder = Self { width, activation, nodes: Vec::new(), constants: Vec::new() };
        builder.constant("epsilon", &[1, 1], &[epsilon]);
        builder
    }

    /// The input, a channel a row.
    pub(super) fn input(&mut self) -> String {
        self.node("Transpose", "channels", &[INPUT], vec![integers("perm", &[1, 0])])
    }

    /// `W^T x + b`, with `weight` the `[in, out]` matrix W.
    pub(super) fn linear(&mut self, name: &str, x: &str, weight: &[f32], bias: &[f32]) -> String {
        let bias = self.constant(&format!("{name}.bias"), &[self.width, 1], bias);
        self.product(&format!("{name}.linear"), name, &[x, &bias], weight)
    }

    /// `scale (h - mean) / sqrt(variance + epsilon) + shift` with `h = W^T x` and the statistics taken over the vertices.
    pub(super) fn normalized_linear(
        &mut self,
        name: &str,
        x: &str,
        weight: &[f32],
        scale: &[f32],
        shift: &[f32],
    ) -> String {
        let scale = self.constant(&format!("{name}.scale"), &[self.width, 1], scale);
        let shift = self.constant(&format!("{name}.shift"), &[self.width, 1], shift);
        let step = |part: &str| format!("{name}.{part}");
        let h = self.product(&step("product"), name, &[x], weight);
        let mean = self.vertex_mean(&step("mean"), &h);
        let centered = self.node("Sub", &step("centered"), &[&h, &mean], Vec::new());
        let square = self.node("Mul", &step("square"), &[&centered, &centered], Vec::new());
        let variance = self.vertex_mean(&step("variance"), &square);
        let above_zero = self.node("Add", &step("above_zero"), &[&variance, "epsilon"], Vec::new());
        let deviation = self.node("Sqrt", &step("deviation"), &[&above_zero], Vec::new());
        let factor = self.node("Div", &step("factor"), &[&scale, &deviation], Vec::new());
        let scaled = self.node("Mul", &step("scaled"), &[&centered, &factor], Vec::new());
        self.node("Add", &step("normalized"), &[&scaled, &shift], Vec::new())
    }

    /// The activation of `x`.
    pub(super) fn activation(&mut self, name: &str, x: &str) -> String {
        match self.activation {
            Activation::Elu => self.node("Elu", name, &[x], vec![float("alpha", 1.0)]),
            Activation::Relu => self.node("Relu", name, &[x], Vec::new()),
        }
    }

    /// `a + b`
    pub(super) fn add(&mut self, name: &str, a: &str, b: &str) -> String {
        self.node("Add", name, &[a, b], Vec::new())
    }

    /// The model whose output is `x`, by the contract.
    pub(super) fn finish(mut self, x: &str, metadata: &[(String, String)]) -> ModelProto {
        self.node("Transpose", OUTPUT, &[x], vec![integers("perm", &[1, 0])]);
        let graph = GraphProto {
            name: "fmnet".into(),
            node: self.nodes,
            initializer: self.constants,
            input: vec![matrix(INPUT, self.width)],
            output: vec![matrix(OUTPUT, self.width)],
            ..GraphProto::default()
        };
        let entry = |(key, value): &(String, String)| StringStringEntryProto {
            key: key.clone(),
            value: value.clone(),
        };
        ModelProto {
            ir_version: IR_VERSION,
            opset_import: vec![OperatorSetIdProto { domain: String::new(), version: OPSET }],
            producer_name: "fmnet-train".into(),
            producer_version: env!("CARGO_PKG_VERSION").into(),
            graph: Some(graph),
            metadata_props: metadata.iter().map(entry).collect(),
            ..ModelProto::default()
        }
    }

    /// `W^T x`, plus a bias `[width, 1]` where one follows `x` among the inputs.
    fn product(&mut self, name: &str, layer: &str, inputs: &[&str], weight: &[f32]) -> String {
        let weight = self.constant(&format!("{layer}.weight"), &[self.width, self.width], weight);
        let inputs = [&[&weight[..]], inputs].concat();
        self.node("Gemm", name, &inputs, vec![integer("transA", 1)])
    }

    fn vertex_mean(&mut self, name: &str, x: &str) -> String {
        self.node("ReduceMean", name, &[x], vec![integers("axes", &[1]), integer("keepdims", 1)])
    }

    fn node(
        &mut self,
        operator: &str,
        name: &str,
        inputs: &[&str],
        attribute: Vec<AttributeProto>,
    ) -> String {
        self.nodes.push(NodeProto {
            op_type: operator.into(),
            name: name.into(),
            input: inputs.iter().map(ToString::to_string).collect(),
            output: vec![name.into()],
            attribute,
            ..NodeProto::default()
        });
        name.into()
    }

    fn constant(&mut self, name: &str, shape: &[usize], values: &[f32]) -> String {
        self.constants.push(TensorProto {
            name: name.into(),
            dims: shape.iter().map(|&d| d as i64).collect(),
            data_type: DataType::Float as i32,
            raw_data: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            ..TensorProto::default()
        });
        name.into()
    }
}

fn float(name: &str, value: f32) -> AttributeProto {
    AttributeProto {
        name: name.into(),
        r#type: AttributeType::Float as i32,
        f: value,
        ..AttributeProto::default()
    }
}

fn integer(name: &str, value: i64) -> AttributeProto {
    AttributeProto {
        name: name.into(),
        r#type: AttributeType::Int as i32,
        i: value,
        ..AttributeProto::default()
    }
}

fn integers(name: &str, values: &[i64]) -> AttributeProto {
    AttributeProto {
        name: name.into(),
        r#type: AttributeType::Ints as i32,
        ints: values.to_vec(),
        ..AttributeProto::default()
    }
}

/// A float32 value of shape `[n, width]`.
fn matrix(name: &str, width: usize) -> ValueInfoProto {
    let dimension = |value| Dimension { value: Some(value), ..Dimension::default() };
    let rows = dimension(dimension::Value::DimParam("n".into()));
    let cols = dimension(dimension::Value::DimValue(width as i64));
    let tensor = type_proto::Tensor {
        elem_type: DataType::Float as i32,
        shape: Some(TensorShapeProto { dim: vec![rows, cols] }),
    };
    let kind = TypeProto { value: Some(type_proto::Value::TensorType(tensor)), ..TypeProto::default() };
    ValueInfoProto { name: name.into(), r#type: Some(kind), ..ValueInfoProto::default() }
}
