//! Building an ONNX graph node by node.

use fmnet::network::contract::{OUTPUT, Quantity};
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

/// A graph under construction. Inside, features are `[width, n]`, a channel a row: tract (0.23) vectorises what it
/// does to rows of any length, but not a short row spread over all rows. Every method returns the name of its result.
#[derive(Default)]
pub struct GraphBuilder {
    inputs: Vec<ValueInfoProto>,
    nodes: Vec<NodeProto>,
    constants: Vec<TensorProto>,
}

impl GraphBuilder {
    /// Declares an input of the shape that the quantity has: `[n, width]`, `[width]` or `[n]`.
    pub(crate) fn input(&mut self, quantity: Quantity, width: usize) -> String {
        let dims = quantity.dims(width);
        self.inputs.push(value(quantity.name(), &dims));
        quantity.name().into()
    }

    /// `W^T x + b`, with `weight` the `[in, out]` matrix W.
    pub(crate) fn linear(&mut self, name: &str, x: &str, weight: &[f32], bias: &[f32]) -> String {
        let width = bias.len();
        let bias = self.constant(&format!("{name}.bias"), &[width, 1], bias);
        let weight = self.constant(&format!("{name}.weight"), &[weight.len() / width, width], weight);
        self.node("Gemm", &format!("{name}.linear"), &[&weight, x, &bias], vec![integer("transA", 1)])
    }

    /// `W^T x`, with `weight` the matrix W of `inputs` rows.
    pub(crate) fn product(&mut self, name: &str, x: &str, weight: &[f32], inputs: usize) -> String {
        let weight = self.constant(&format!("{name}.weight"), &[inputs, weight.len() / inputs], weight);
        self.node("Gemm", name, &[&weight, x], vec![integer("transA", 1)])
    }

    /// The first `count` entries of `x` along an axis.
    pub(crate) fn first(&mut self, name: &str, x: &str, along: i64, count: usize) -> String {
        let part = |graph: &mut Self, part: &str, at: i64| graph.integers(&format!("{name}.{part}"), &[at]);
        let start = part(self, "start", 0);
        let end = part(self, "end", count as i64);
        let axis = part(self, "axis", along);
        self.node("Slice", name, &[x, &start, &end, &axis], Vec::new())
    }

    /// The model whose output is `x`, `[width, n]`, by the contract.
    pub(super) fn finish(mut self, x: &str, width: usize, metadata: &[(String, String)]) -> ModelProto {
        self.node("Transpose", OUTPUT, &[x], vec![integers("perm", &[1, 0])]);
        let graph = GraphProto {
            name: "fmnet".into(),
            node: self.nodes,
            initializer: self.constants,
            input: self.inputs,
            output: vec![value(OUTPUT, &[None, Some(width)])],
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

    /// One operator.
    pub(crate) fn node(
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

    /// A float32 constant.
    pub(crate) fn constant(&mut self, name: &str, shape: &[usize], values: &[f32]) -> String {
        let raw_data = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.raw_constant(name, shape, DataType::Float, raw_data)
    }

    /// A list of int64.
    pub(crate) fn integers(&mut self, name: &str, values: &[i64]) -> String {
        let raw_data = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.raw_constant(name, &[values.len()], DataType::Int64, raw_data)
    }

    fn raw_constant(
        &mut self,
        name: &str,
        shape: &[usize],
        data_type: DataType,
        raw_data: Vec<u8>,
    ) -> String {
        self.constants.push(TensorProto {
            name: name.into(),
            dims: shape.iter().map(|&d| d as i64).collect(),
            data_type: data_type as i32,
            raw_data,
            ..TensorProto::default()
        });
        name.into()
    }
}

pub(crate) fn float(name: &str, value: f32) -> AttributeProto {
    AttributeProto {
        name: name.into(),
        r#type: AttributeType::Float as i32,
        f: value,
        ..AttributeProto::default()
    }
}

pub(crate) fn integer(name: &str, value: i64) -> AttributeProto {
    AttributeProto {
        name: name.into(),
        r#type: AttributeType::Int as i32,
        i: value,
        ..AttributeProto::default()
    }
}

pub(crate) fn integers(name: &str, values: &[i64]) -> AttributeProto {
    AttributeProto {
        name: name.into(),
        r#type: AttributeType::Ints as i32,
        ints: values.to_vec(),
        ..AttributeProto::default()
    }
}

/// The attribute `axes` of a reduction over one axis.
pub(crate) fn axis(axis: i64) -> AttributeProto {
    integers("axes", &[axis])
}

/// A float32 value; `None` stands for the number of vertices.
fn value(name: &str, dims: &[Option<usize>]) -> ValueInfoProto {
    let dimension = |dim: &Option<usize>| {
        let value = match dim {
            None => dimension::Value::DimParam("n".into()),
            Some(width) => dimension::Value::DimValue(*width as i64),
        };
        Dimension { value: Some(value), ..Dimension::default() }
    };
    let tensor = type_proto::Tensor {
        elem_type: DataType::Float as i32,
        shape: Some(TensorShapeProto { dim: dims.iter().map(dimension).collect() }),
    };
    let kind = TypeProto { value: Some(type_proto::Value::TensorType(tensor)), ..TypeProto::default() };
    ValueInfoProto { name: name.into(), r#type: Some(kind), ..ValueInfoProto::default() }
}
