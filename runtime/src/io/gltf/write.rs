//! Writing GLB: one mesh of one primitive, everything in the binary chunk.

mod buffer;
mod seams;

use std::borrow::Cow;
use std::path::Path;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;
use gltf::json::{self, Index};

use super::matrix4;
use super::uri::encode_percent;
use crate::Mesh;
use crate::io::attributes::{Attributes, Skin, Texture};
use crate::io::{IoError, write_atomically};
use buffer::{Buffer, Numbers};
use seams::Split;

/// What does not fit, and what to do about it.
type Misfit = (String, &'static str);

pub(in crate::io) fn write(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<(), IoError> {
    let unwritable = |(problem, remedy): Misfit| IoError::Unwritable { path: path.into(), problem, remedy };
    if mesh.n_vertices() == 0 || mesh.n_faces() == 0 {
        return Err(unwritable(("glTF has no empty meshes".into(), "write a .ply or .off file")));
    }
    let image = match attributes.texture.as_ref().filter(|_| attributes.corner_uvs.is_some()) {
        Some(texture) => Some(image(texture, path)?),
        None => None,
    };
    let mut buffer = Buffer::default();
    let primitive = primitive(&mut buffer, mesh, attributes).map_err(unwritable)?;
    let primitive = Primitive { material: Some(material(&mut buffer, image)), ..primitive };
    let mesh = buffer.root.push(json::Mesh {
        extensions: None,
        extras: Default::default(),
        name: None,
        primitives: vec![primitive],
        weights: None,
    });
    let node = buffer.root.push(json::Node { mesh: Some(mesh), ..Default::default() });
    let mut nodes = vec![node];
    if let Some(skin) = &attributes.skin {
        let roots = skeleton(&mut buffer, skin, node).map_err(unwritable)?;
        nodes.extend(roots);
    }
    let scene =
        buffer.root.push(json::Scene { extensions: None, extras: Default::default(), name: None, nodes });
    buffer.root.scene = Some(scene);
    let bytes = buffer.into_glb().map_err(unwritable)?;
    write_atomically(path, |w| w.write_all(&bytes))
}

fn primitive(buffer: &mut Buffer, mesh: &Mesh, attributes: &Attributes) -> Result<Primitive, Misfit> {
    let split = Split::at_seams(mesh, attributes.corner_uvs.as_deref());
    let positions: Vec<[f32; 3]> =
        split.vertices.iter().map(|&v| mesh.vertices()[v as usize].map(|x| x as f32)).collect();
    if let Some(vertex) = positions.iter().position(|p| p.iter().any(|x| x.is_infinite())) {
        let problem = format!("vertex {vertex} is too far away for single precision");
        return Err((problem, "scale the mesh or write a .ply file"));
    }
    let mut list = vec![(Semantic::Positions, buffer.positions(&positions))];
    let floats = |components, normalized| Numbers { kind: ComponentType::F32, components, normalized };
    if let Some(colors) = &attributes.vertex_colors {
        let bytes: Vec<u8> = split.vertices.iter().flat_map(|&v| colors[v as usize]).collect();
        let numbers = Numbers { kind: ComponentType::U8, components: Type::Vec4, normalized: true };
        list.push((Semantic::Colors(0), buffer.array(&bytes, numbers)));
    }
    if attributes.corner_uvs.is_some() {
        let bytes: Vec<u8> =
            split.uvs.iter().flat_map(|[u, v]| [*u, 1.0 - v]).flat_map(f32::to_le_bytes).collect();
        list.push((Semantic::TexCoords(0), buffer.array(&bytes, floats(Type::Vec2, false))));
    }
    if let Some(skin) = &attributes.skin {
        let joints: Vec<u8> = split
            .vertices
            .iter()
            .flat_map(|&v| skin.indices[v as usize])
            .flat_map(u16::to_le_bytes)
            .collect();
        let numbers = Numbers { kind: ComponentType::U16, components: Type::Vec4, normalized: false };
        list.push((Semantic::Joints(0), buffer.array(&joints, numbers)));
        let weights: Vec<u8> = split
            .vertices
            .iter()
            .flat_map(|&v| skin.weights[v as usize])
            .flat_map(f32::to_le_bytes)
            .collect();
        list.push((Semantic::Weights(0), buffer.array(&weights, floats(Type::Vec4, false))));
    }
    for (name, values) in &attributes.vertex_scalars {
        let bytes: Vec<u8> = split.vertices.iter().flat_map(|&v| values[v as usize].to_le_bytes()).collect();
        list.push((Semantic::Extras(name.clone()), buffer.array(&bytes, floats(Type::Scalar, false))));
    }
    let indices: Vec<u8> = split.faces.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    Ok(Primitive {
        attributes: list.into_iter().map(|(semantic, accessor)| (Valid(semantic), accessor)).collect(),
        extensions: None,
        extras: Default::default(),
        indices: Some(buffer.indices(&indices)),
        material: None,
        mode: Valid(Mode::Triangles),
        targets: None,
    })
}

/// An image to embed, or a reference to one.
enum Image<'a> {
    Bytes(Cow<'a, [u8]>, &'static str),
    Uri(String),
}

/// The image's bytes where it is a PNG or JPEG file that can be read, else a reference.
fn image<'a>(texture: &'a Texture, path: &Path) -> Result<Image<'a>, IoError> {
    match texture {
        Texture::Embedded { bytes, mime } => Ok(Image::Bytes(bytes.into(), mime_of(bytes, mime))),
        Texture::File(file) => {
            let bytes =
                std::fs::metadata(file).ok().filter(|m| m.is_file()).and_then(|_| std::fs::read(file).ok());
            match bytes.filter(|bytes| is_png(bytes) || is_jpeg(bytes)) {
                Some(bytes) => {
                    let mime = mime_of(&bytes, "");
                    Ok(Image::Bytes(bytes.into(), mime))
                }
                None => Ok(Image::Uri(encode_percent(&texture.place_beside(path)?))),
            }
        }
    }
}

fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG")
}

fn is_jpeg(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\xFF\xD8\xFF")
}

fn mime_of(bytes: &[u8], stated: &str) -> &'static str {
    if is_jpeg(bytes) || stated == "image/jpeg" && !is_png(bytes) { "image/jpeg" } else { "image/png" }
}

/// A matte surface, seen from both sides, with the image if there is one.
fn material(buffer: &mut Buffer, image: Option<Image<'_>>) -> Index<json::Material> {
    let base_color_texture = image.map(|image| {
        let (view, mime, uri) = match image {
            Image::Bytes(bytes, mime) => (Some(buffer.view(&bytes, None)), Some(mime), None),
            Image::Uri(uri) => (None, None, Some(uri)),
        };
        let source = buffer.root.push(json::Image {
            buffer_view: view,
            mime_type: mime.map(|mime| json::image::MimeType(mime.to_owned())),
            name: None,
            uri,
            extensions: None,
            extras: Default::default(),
        });
        let texture =
            json::Texture { name: None, sampler: None, source, extensions: None, extras: Default::default() };
        let index = buffer.root.push(texture);
        json::texture::Info { index, tex_coord: 0, extensions: None, extras: Default::default() }
    });
    let surface = json::material::PbrMetallicRoughness {
        base_color_texture,
        metallic_factor: json::material::StrengthFactor(0.0),
        roughness_factor: json::material::StrengthFactor(1.0),
        ..Default::default()
    };
    buffer.root.push(json::Material {
        double_sided: true,
        pbr_metallic_roughness: surface,
        ..Default::default()
    })
}

/// Adds the joints as nodes and binds the mesh to them; returns the roots.
fn skeleton(
    buffer: &mut Buffer,
    skin: &Skin,
    mesh: Index<json::Node>,
) -> Result<Vec<Index<json::Node>>, Misfit> {
    let mut inverses = Vec::with_capacity(skin.joints.len());
    for (i, joint) in skin.joints.iter().enumerate() {
        let singular =
            || (format!("the frame of joint {i} is singular"), "give every joint a frame of full rank");
        inverses.push(matrix4::inverse(&joint.frame).ok_or_else(singular)?);
    }
    let first = buffer.root.nodes.len();
    let index = |joint: usize| Index::new((first + joint) as u32);
    let mut roots = Vec::new();
    for (i, joint) in skin.joints.iter().enumerate() {
        let parent = joint.parent.map(usize::from);
        let local = parent.map_or(joint.frame, |parent| matrix4::product(&inverses[parent], &joint.frame));
        buffer.root.push(json::Node {
            matrix: Some(std::array::from_fn(|k| local[k / 4][k % 4] as f32)),
            name: Some(joint.name.clone()),
            ..Default::default()
        });
        match parent {
            Some(parent) => buffer.root.nodes[first + parent].children.get_or_insert_default().push(index(i)),
            None => roots.push(index(i)),
        }
    }
    let bytes: Vec<u8> =
        inverses.iter().flatten().flatten().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    let numbers = Numbers { kind: ComponentType::F32, components: Type::Mat4, normalized: false };
    let inverse_bind_matrices = (!skin.joints.is_empty()).then(|| buffer.untargeted(&bytes, numbers));
    let skin = buffer.root.push(json::Skin {
        extensions: None,
        extras: Default::default(),
        inverse_bind_matrices,
        joints: (0..skin.joints.len()).map(index).collect(),
        name: None,
        skeleton: None,
    });
    buffer.root.nodes[mesh.value()].skin = Some(skin);
    Ok(roots)
}
