//! Typed arrays in the buffers.

use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType};
use gltf::json::validation::Checked;

use super::document::Document;
use crate::io::attributes::IntegerKind;
use crate::io::error::{ParseError, Parsed, Position, TRUNCATED};

/// What integers stand for.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Integers {
    /// Themselves, unless the accessor says that they are fractions.
    AsStated,
    /// Fractions of the largest one, as in colours and weights.
    Fractions,
}

/// Equally spaced items in a buffer view.
struct Items<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Items<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        let Self { bytes, stride, size, count } = *self;
        (0..count).map(move |i| &bytes[i * stride..i * stride + size])
    }
}

impl Document<'_> {
    /// How many components an item has, and how many items there are.
    pub(super) fn shape(&self, index: Index<Accessor>) -> Parsed<(usize, usize)> {
        let accessor = self.accessor(index)?;
        match accessor.type_ {
            Checked::Valid(type_) => Ok((type_.multiplicity(), accessor.count.0 as usize)),
            Checked::Invalid => Err(error(index, "it has no valid type")),
        }
    }

    /// The type of an accessor's integers, unless they stand for fractions.
    pub(super) fn integer_kind(&self, index: Index<Accessor>) -> Option<IntegerKind> {
        let accessor = self.root.get(index).filter(|accessor| !accessor.normalized)?;
        let Checked::Valid(component) = &accessor.component_type else { return None };
        Some(match component.0 {
            ComponentType::I8 => IntegerKind::I8,
            ComponentType::U8 => IntegerKind::U8,
            ComponentType::I16 => IntegerKind::I16,
            ComponentType::U16 => IntegerKind::U16,
            ComponentType::U32 => IntegerKind::U32,
            ComponentType::F32 => return None,
        })
    }

    /// The items of an accessor of `N` components; every number type fits `f64` exactly.
    pub(super) fn read<const N: usize>(
        &self,
        index: Index<Accessor>,
        integers: Integers,
    ) -> Parsed<Vec<[f64; N]>> {
        let accessor = self.accessor(index)?;
        let (n_components, count) = self.shape(index)?;
        if n_components != N {
            return Err(error(index, format!("its items have {n_components} components instead of {N}")));
        }
        let Checked::Valid(component) = &accessor.component_type else {
            return Err(error(index, "it has no valid component type"));
        };
        let kind = component.0;
        let fractions = accessor.normalized || integers == Integers::Fractions;
        let decode = |item: &[u8]| decode::<N>(item, kind, fractions);
        let offset = accessor.byte_offset.unwrap_or_default().0;
        let mut values: Vec<[f64; N]> = match accessor.buffer_view {
            Some(view) => {
                self.items(index, view, offset, count, N * kind.size())?.iter().map(decode).collect()
            }
            None => {
                self.charge(count)?;
                vec![[0.0; N]; count]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let n = sparse.count.0 as usize;
            let Checked::Valid(index_kind) = &sparse.indices.component_type else {
                return Err(error(index, "its sparse indices have no valid type"));
            };
            let (at, given) = (&sparse.indices, &sparse.values);
            let places = self.items(index, at.buffer_view, at.byte_offset.0, n, index_kind.0.size())?;
            let items = self.items(index, given.buffer_view, given.byte_offset.0, n, N * kind.size())?;
            for (place, item) in places.iter().zip(items.iter()) {
                let [place] = self::decode::<1>(place, index_kind.0, false);
                let value = values.get_mut(place as usize);
                *value.ok_or_else(|| error(index, format!("sparse index {place} is out of range")))? =
                    decode(item);
            }
        }
        Ok(values)
    }

    fn accessor(&self, index: Index<Accessor>) -> Parsed<&Accessor> {
        self.root.get(index).ok_or_else(|| error(index, "it does not exist"))
    }

    fn items(
        &self,
        accessor: Index<Accessor>,
        view: Index<gltf::json::buffer::View>,
        offset: u64,
        count: usize,
        size: usize,
    ) -> Parsed<Items<'_>> {
        let (bytes, stride) = self.view(view)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(error(accessor, format!("its items of {size} bytes are {stride} bytes apart")));
        }
        let needed = match count {
            0 => 0,
            _ => u128::from(offset) + (count as u128 - 1) * stride as u128 + size as u128,
        };
        if needed > bytes.len() as u128 {
            let problem = format!("it needs {needed} bytes of its buffer view, which has {}", bytes.len());
            return Err(ParseError::new(Position::Part(format!("accessor {accessor}")), problem, TRUNCATED));
        }
        let bytes = if count == 0 { &[] } else { &bytes[offset as usize..] };
        Ok(Items { bytes, stride, size, count })
    }
}

fn error(index: Index<Accessor>, problem: impl Into<String>) -> ParseError {
    ParseError::part(format!("accessor {index}"), problem)
}

fn decode<const N: usize>(item: &[u8], kind: ComponentType, fractions: bool) -> [f64; N] {
    std::array::from_fn(|i| number(&item[i * kind.size()..], kind, fractions))
}

/// The number at the beginning of `b`; as a fraction as section 3.11 of the specification has it.
fn number(b: &[u8], kind: ComponentType, fractions: bool) -> f64 {
    let (value, largest) = match kind {
        ComponentType::I8 => (f64::from(b[0] as i8), 127.0),
        ComponentType::U8 => (f64::from(b[0]), 255.0),
        ComponentType::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
        ComponentType::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
        ComponentType::U32 => (f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])), f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
    };
    if fractions { (value / largest).max(-1.0) } else { value }
}
