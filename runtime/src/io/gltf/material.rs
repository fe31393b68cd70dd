//! What a material says of colours: the image, where on it, and the factor that all colours are multiplied by.

use gltf::json;
use gltf::json::Index;
use gltf::json::mesh::Primitive;
use serde_json::Value;

use super::document::Document;
use crate::io::error::{ParseError, Parsed};

/// What is kept of a primitive's material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Look {
    /// The image, if there is one that can be kept.
    pub(super) image: Option<Index<json::Image>>,
    /// Which set of texture coordinates it uses.
    pub(super) uv_set: u32,
    pub(super) placement: Placement,
    /// Linear red, green, blue and alpha.
    pub(super) factor: [f64; 4],
}

/// Where texture coordinates come to lie in the image (KHR_texture_transform): scaled, then turned counter-clockwise
/// as seen in the image, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
}

impl Default for Placement {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2] }
    }
}

impl Placement {
    fn parse(value: &Value) -> Self {
        let pair = |name: &str| Some([value[name][0].as_f64()?, value[name][1].as_f64()?]);
        let default = Self::default();
        Self {
            offset: pair("offset").unwrap_or(default.offset),
            rotation: value["rotation"].as_f64().unwrap_or(default.rotation),
            scale: pair("scale").unwrap_or(default.scale),
        }
    }

    /// The coordinates in the image, whose `v` goes down.
    pub(super) fn apply(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = self.rotation.sin_cos();
        let [u, v] = [u * self.scale[0], v * self.scale[1]];
        [cosine * u + sine * v + self.offset[0], cosine * v - sine * u + self.offset[1]]
    }
}

impl Look {
    /// The look of a primitive; what of its material is not kept goes to `left_out`.
    pub(super) fn of(
        document: &Document<'_>,
        primitive: &Primitive,
        left_out: &mut Vec<String>,
    ) -> Parsed<Self> {
        let plain = Self { image: None, uv_set: 0, placement: Placement::default(), factor: [1.0; 4] };
        let Some(index) = primitive.material else { return Ok(plain) };
        let missing = || ParseError::part(format!("material {index}"), "it or its texture does not exist");
        let material = document.root.get(index).ok_or_else(missing)?;
        let metallic = &material.pbr_metallic_roughness;
        let mut factor = metallic.base_color_factor.0.map(f64::from);
        let mut texture = metallic.base_color_texture.as_ref().map(TextureUse::of);
        let glossiness = material.extensions.as_ref().and_then(|e| e.others.get(GLOSSINESS));
        if let Some(glossiness) = glossiness {
            texture = texture.or_else(|| TextureUse::parse(&glossiness["diffuseTexture"]));
            let component = |i: usize| glossiness["diffuseFactor"][i].as_f64();
            if let (Some(r), Some(g), Some(b), Some(a)) =
                (component(0), component(1), component(2), component(3))
            {
                factor = [r, g, b, a];
            }
        }
        note_other_images(material, left_out);
        let Some(texture) = texture else { return Ok(Self { factor, ..plain }) };
        let source = document.root.get(Index::<json::Texture>::new(texture.index)).ok_or_else(missing)?;
        let image = document.root.get(source.source).map(|_| source.source);
        if image.is_none() {
            let formats = source.extensions.as_ref().map(|e| e.others.keys().cloned().collect::<Vec<_>>());
            let format = formats.filter(|f| !f.is_empty()).map_or("no format".into(), |f| f.join(", "));
            note(
                left_out,
                format!(
                    "the image of {}, in the format of {format}; export it as PNG or JPEG",
                    name_of(material)
                ),
            );
        } else if factor != [1.0; 4] {
            note(
                left_out,
                format!(
                    "the colour factor {factor:?} that the image of {} is multiplied by",
                    name_of(material)
                ),
            );
        }
        Ok(Self { image, uv_set: texture.uv_set, placement: texture.placement, factor })
    }
}

const GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// A reference to a texture.
struct TextureUse {
    index: u32,
    uv_set: u32,
    placement: Placement,
}

impl TextureUse {
    fn of(info: &json::texture::Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
        Self::new(info.index.value() as u32, info.tex_coord, transform)
    }

    fn parse(info: &Value) -> Option<Self> {
        let index = u32::try_from(info["index"].as_u64()?).ok()?;
        let uv_set = info["texCoord"].as_u64().and_then(|set| u32::try_from(set).ok()).unwrap_or(0);
        Some(Self::new(index, uv_set, info["extensions"].get("KHR_texture_transform")))
    }

    fn new(index: u32, uv_set: u32, transform: Option<&Value>) -> Self {
        let other_set =
            transform.and_then(|t| t["texCoord"].as_u64()).and_then(|set| u32::try_from(set).ok());
        let placement = transform.map(Placement::parse).unwrap_or_default();
        Self { index, uv_set: other_set.unwrap_or(uv_set), placement }
    }
}

/// Notes the images besides that of the colours.
fn note_other_images(material: &json::Material, left_out: &mut Vec<String>) {
    let others = [
        (material.normal_texture.is_some(), "the normal map"),
        (material.occlusion_texture.is_some(), "the occlusion map"),
        (material.emissive_texture.is_some(), "the emissive image"),
        (material.pbr_metallic_roughness.metallic_roughness_texture.is_some(), "the metallic-roughness map"),
    ];
    for (_, what) in others.iter().filter(|(is_there, _)| *is_there) {
        note(left_out, format!("{what} of {}", name_of(material)));
    }
}

fn name_of(material: &json::Material) -> String {
    match &material.name {
        Some(name) => format!("material '{}'", name.escape_debug()),
        None => "a material".to_owned(),
    }
}

/// Notes what is left out, once.
pub(super) fn note(left_out: &mut Vec<String>, what: String) {
    /// A hostile file must not make the list grow without end.
    const MOST: usize = 64;
    if left_out.len() < MOST && !left_out.contains(&what) {
        left_out.push(what);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The example of the extension's own page: only the lower left quarter of the image, turned.
    #[test]
    fn the_lower_left_quarter_turned_by_a_right_angle() {
        let placement = Placement::parse(
            &json!({"offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5]}),
        );
        for (uv, expected) in [
            ([0.0, 0.0], [0.0, 1.0]),
            ([1.0, 0.0], [0.0, 0.5]),
            ([0.0, 1.0], [0.5, 1.0]),
            ([1.0, 1.0], [0.5, 0.5]),
        ] {
            let found = placement.apply(uv);
            assert!(
                (found[0] - expected[0]).abs() < 1e-12 && (found[1] - expected[1]).abs() < 1e-12,
                "{found:?}"
            );
        }
        assert_eq!(Placement::parse(&json!({})), Placement::default());
        assert_eq!(Placement::default().apply([0.25, 0.75]), [0.25, 0.75]);
    }
}
