//! A shape as bytes: its meshes, the way back and its eigenbases; everything else is computed anew when asked for.

use super::{Shape, ShapeOptions};
use crate::cache::{CacheKey, Decoder, Encoder};
use crate::shape::quantities::{decode_basis, encode_basis};
use crate::spectral::Eigenbasis;
use std::sync::Arc;

impl Shape {
    /// Appends the shape.
    pub(crate) fn save(&self, out: &mut Encoder) {
        out.slice(self.name.as_bytes())
            .value(self.whole_area.unwrap_or(f64::NAN))
            .value(*self.key.as_bytes());
        out.slice(&self.encode());
        let store = self.store();
        for basis in [&store.eigenbasis, &store.full_basis] {
            let mut bytes = Encoder::default();
            if let Some(basis) = basis {
                encode_basis(&mut bytes, basis);
            }
            out.slice(&bytes.finish());
        }
    }

    /// The next shape; `None` where the bytes are not one.
    pub(crate) fn load(input: &mut Decoder) -> Option<Self> {
        let name = String::from_utf8(input.slice()?).ok()?;
        let whole_area = Some(input.value::<f64>()?).filter(|area| !area.is_nan());
        let key = CacheKey::from_bytes(input.value()?);
        let options = ShapeOptions { whole_area, ..ShapeOptions::default() };
        let shape = Self::decode(&name, &options, key, &input.slice::<u8>()?)?;
        let basis = read_basis(input, shape.n())?;
        let full_basis = read_basis(input, shape.full_mesh.n_vertices())?;
        shape.store().eigenbasis = basis;
        shape.store().full_basis = full_basis;
        Some(shape)
    }
}

/// The basis of a mesh of `n` vertices, where there is one; the outer `None` where the bytes are neither.
fn read_basis(input: &mut Decoder, n: usize) -> Option<Option<Arc<Eigenbasis>>> {
    let bytes = input.slice::<u8>()?;
    if bytes.is_empty() {
        return Some(None);
    }
    decode_basis(&bytes).filter(|basis| basis.n() == n).map(|basis| Some(Arc::new(basis)))
}
