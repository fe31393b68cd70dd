//! Which property of a vertex or face goes where, and colours of every range.

use super::header::{Element, Kind, Number};
use crate::io::attributes::{IntegerField, IntegerKind};

/// The names of the three components of a colour and of its alpha.
const COLORS: [[&str; 4]; 3] = [
    ["red", "green", "blue", "alpha"],
    ["diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"],
    ["r", "g", "b", "a"],
];

/// The names of the two texture coordinates.
const UVS: [[&str; 2]; 4] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

/// The place and type of a scalar property.
pub(super) fn scalar(element: &Element, name: &str) -> Option<(usize, Number)> {
    element.properties.iter().enumerate().find_map(|(i, property)| match property.kind {
        Kind::Scalar(kind) if property.name == name => Some((i, kind)),
        _ => None,
    })
}

/// The places of the texture coordinates.
pub(super) fn uvs(element: &Element) -> Option<[usize; 2]> {
    UVS.iter().find_map(|[u, v]| Some([scalar(element, u)?.0, scalar(element, v)?.0]))
}

/// Colours as they stand in the file, with the types of their components.
pub(super) struct Colors {
    /// Which property each component is; the alpha may be absent.
    pub(super) at: [Option<usize>; 4],
    kinds: [Option<Number>; 4],
    pub(super) values: Vec<[f32; 4]>,
}

impl Colors {
    /// Those of an element that has red, green and blue.
    pub(super) fn of(element: &Element) -> Option<Self> {
        COLORS.iter().find_map(|names| {
            let found = names.map(|name| scalar(element, name));
            found[..3].iter().all(Option::is_some).then(|| Self {
                at: found.map(|f| f.map(|(i, _)| i)),
                kinds: found.map(|f| f.map(|(_, kind)| kind)),
                values: Vec::new(),
            })
        })
    }

    /// The colours as bytes. Whole numbers are full at 255, or at 65535 where one is larger; others at 1, or at 255
    /// where one is larger.
    pub(super) fn to_bytes(&self) -> Vec<[u8; 4]> {
        let largest = |components: std::ops::Range<usize>| {
            let values = self.values.iter().flat_map(|c| &c[components.clone()]).copied();
            values.filter(|x| x.is_finite()).fold(0.0, f32::max)
        };
        let is_float = |component: usize| self.kinds[component].is_some_and(Number::is_float);
        let of_color = full(largest(0..3), is_float(0));
        let of_alpha = full(largest(3..4), is_float(3));
        let byte = |x: f32, full: f32| (x / full * 255.0).round() as u8;
        let convert = |c: &[f32; 4]| {
            let a = if self.at[3].is_some() { byte(c[3], of_alpha) } else { 255 };
            [byte(c[0], of_color), byte(c[1], of_color), byte(c[2], of_color), a]
        };
        self.values.iter().map(convert).collect()
    }

    /// A component as it counts: the type `char` is used for bytes up to 255.
    pub(super) fn value(value: f64, kind: Number) -> f32 {
        (if kind == Number::I8 && value < 0.0 { value + 256.0 } else { value }) as f32
    }
}

fn full(largest: f32, is_float: bool) -> f32 {
    match largest {
        // A little more than 1 is light, not the darkest byte.
        x if is_float && x <= 2.0 => 1.0,
        x if x <= 255.0 => 255.0,
        _ => 65535.0,
    }
}

/// A further property of the vertices.
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Option<IntegerKind>,
    pub(super) values: Vec<f64>,
}

impl Field {
    /// As a field of integers, where the type and all values are.
    pub(super) fn into_integers(self) -> Result<IntegerField, (String, Vec<f64>)> {
        let fits = |kind: IntegerKind, x: f64| {
            let (low, high) = kind.range();
            x.fract() == 0.0 && x >= low as f64 && x <= high as f64
        };
        match self.kind.filter(|&kind| self.values.iter().all(|&x| fits(kind, x))) {
            Some(kind) => Ok(IntegerField {
                name: self.name,
                kind,
                values: self.values.iter().map(|&x| x as i64).collect(),
            }),
            None => Err((self.name, self.values)),
        }
    }
}
