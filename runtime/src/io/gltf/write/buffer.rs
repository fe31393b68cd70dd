//! The binary chunk, and the views and accessors into it.

use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Stride, Target, View};
use gltf::json::validation::Checked::Valid;
use gltf::json::validation::USize64;
use gltf::json::{self, Index, Root};

use super::Misfit;
use crate::io::attributes::IntegerKind;

/// How the bytes of an array are to be read.
#[derive(Clone, Copy)]
pub(super) struct Numbers {
    pub(super) kind: ComponentType,
    pub(super) components: Type,
    pub(super) normalized: bool,
}

/// A document whose bytes are all in one buffer.
#[derive(Default)]
pub(super) struct Buffer {
    pub(super) root: Root,
    bytes: Vec<u8>,
}

impl Buffer {
    /// Adds bytes at a multiple of four.
    pub(super) fn view(&mut self, bytes: &[u8], target: Option<Target>) -> Index<View> {
        let view = View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(self.bytes.len().into()),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: Default::default(),
        };
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.root.push(view)
    }

    fn accessor(&mut self, bytes: &[u8], numbers: Numbers, target: Option<Target>) -> Index<Accessor> {
        let size = numbers.kind.size() * numbers.components.multiplicity();
        let view = self.view(bytes, target);
        self.root.push(accessor(view, bytes.len() / size, numbers))
    }

    /// Adds a vertex attribute.
    pub(super) fn array(&mut self, bytes: &[u8], numbers: Numbers) -> Index<Accessor> {
        self.accessor(bytes, numbers, Some(Target::ArrayBuffer))
    }

    /// Adds integers as a vertex attribute, each at a multiple of four bytes as the specification demands.
    pub(super) fn integers(
        &mut self,
        values: impl Iterator<Item = i64>,
        kind: IntegerKind,
    ) -> Index<Accessor> {
        let (mut bytes, mut count) = (Vec::new(), 0usize);
        for value in values {
            kind.put(value, &mut bytes);
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            count += 1;
        }
        let view = self.view(&bytes, Some(Target::ArrayBuffer));
        self.root.buffer_views[view.value()].byte_stride = Some(Stride(4));
        let component = match kind {
            IntegerKind::I8 => ComponentType::I8,
            IntegerKind::U8 => ComponentType::U8,
            IntegerKind::I16 => ComponentType::I16,
            IntegerKind::U16 => ComponentType::U16,
            IntegerKind::I32 | IntegerKind::U32 => ComponentType::U32,
        };
        let numbers = Numbers { kind: component, components: Type::Scalar, normalized: false };
        let accessor = accessor(view, count, numbers);
        self.root.push(accessor)
    }

    /// Adds an array that is neither attribute nor index.
    pub(super) fn untargeted(&mut self, bytes: &[u8], numbers: Numbers) -> Index<Accessor> {
        self.accessor(bytes, numbers, None)
    }

    /// Adds 32-bit vertex indices.
    pub(super) fn indices(&mut self, bytes: &[u8]) -> Index<Accessor> {
        let numbers = Numbers { kind: ComponentType::U32, components: Type::Scalar, normalized: false };
        self.accessor(bytes, numbers, Some(Target::ElementArrayBuffer))
    }

    /// Adds vertex positions, with the bounds that the specification asks for.
    pub(super) fn positions(&mut self, positions: &[[f32; 3]]) -> Index<Accessor> {
        let bytes: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let numbers = Numbers { kind: ComponentType::F32, components: Type::Vec3, normalized: false };
        let index = self.array(&bytes, numbers);
        let bound = |pick: fn(f32, f32) -> f32, start: f32| {
            let fold = |b: [f32; 3], p: &[f32; 3]| [pick(b[0], p[0]), pick(b[1], p[1]), pick(b[2], p[2])];
            json::serialize::to_value(positions.iter().fold([start; 3], fold)).ok()
        };
        let accessor = &mut self.root.accessors[index.value()];
        accessor.min = bound(f32::min, f32::INFINITY);
        accessor.max = bound(f32::max, f32::NEG_INFINITY);
        index
    }

    /// The whole file.
    pub(super) fn into_glb(mut self) -> Result<Vec<u8>, Misfit> {
        self.root.asset.generator = Some("fmnet".into());
        self.root.push(json::Buffer {
            byte_length: self.bytes.len().into(),
            name: None,
            uri: None,
            extensions: None,
            extras: Default::default(),
        });
        let text = self.root.to_vec().map_err(|e| (e.to_string(), "write a .ply file"))?;
        if self.bytes.len() + text.len() > u32::MAX as usize - 64 {
            return Err(("a GLB file holds at most 4 GiB".into(), "write a .ply file"));
        }
        let header = gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
        let glb = gltf::Glb { header, json: text.into(), bin: Some(self.bytes.into()) };
        glb.to_vec().map_err(|e| (e.to_string(), "write a .ply file"))
    }
}

fn accessor(view: Index<View>, count: usize, numbers: Numbers) -> Accessor {
    Accessor {
        buffer_view: Some(view),
        byte_offset: Some(USize64(0)),
        count: count.into(),
        component_type: Valid(GenericComponentType(numbers.kind)),
        extensions: None,
        extras: Default::default(),
        type_: Valid(numbers.components),
        min: None,
        max: None,
        name: None,
        normalized: numbers.normalized,
        sparse: None,
    }
}
