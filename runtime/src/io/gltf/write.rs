//! Writing GLB: one mesh of one primitive, everything in the binary chunk. Positions are in single precision, of a
//! mesh far from the origin relative to its middle, which is then the place of its node.

mod buffer;
mod seams;

use std::borrow::Cow;
use std::path::Path;

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;
use gltf::json::{self, Index};

use super::color;
use super::matrix4::{self, Matrix4};
use super::uri::encode_percent;
use crate::Mesh;
use crate::io::IoError;
use crate::io::attributes::{Attributes, Skin, Texture};
use crate::io::carried::GlbIntegers;
use crate::io::reference::bytes_of_path;
use crate::io::texture::{is_jpeg, is_png};
use crate::mesh::vec3;
use buffer::{Buffer, Numbers};
use seams::Split;

/// What does not fit, and what to do about it.
type Misfit = (String, &'static str);

/// The bytes of the file; `path` is for messages and for the folder of an image.
pub(in crate::io) fn encode(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<Vec<u8>, IoError> {
    let unwritable = |(problem, remedy): Misfit| IoError::Unwritable { path: path.into(), problem, remedy };
    if mesh.n_vertices() == 0 || mesh.n_faces() == 0 {
        return Err(unwritable(("glTF has no empty meshes".into(), "write a .ply or .off file")));
    }
    let image = match attributes.texture.as_ref().filter(|_| attributes.corner_uvs.is_some()) {
        Some(texture) => image(texture, path)?,
        None => None,
    };
    let mut buffer = Buffer::default();
    let place = far_place(mesh);
    let primitive = primitive(&mut buffer, mesh, place, attributes).map_err(unwritable)?;
    let primitive = Primitive { material: Some(material(&mut buffer, image)), ..primitive };
    let mesh = buffer.root.push(json::Mesh {
        extensions: None,
        extras: Default::default(),
        name: None,
        primitives: vec![primitive],
        weights: None,
    });
    let translation = (place != [0.0; 3]).then(|| place.map(|x| x as f32));
    let node = buffer.root.push(json::Node { mesh: Some(mesh), translation, ..Default::default() });
    let mut nodes = vec![node];
    if let Some(skin) = &attributes.skin {
        let roots = skeleton(&mut buffer, skin, place, node).map_err(unwritable)?;
        // The joints alone place a skinned mesh, so they are moved as it is.
        match translation {
            Some(_) => nodes.push(buffer.root.push(json::Node {
                translation,
                children: Some(roots),
                ..Default::default()
            })),
            None => nodes.extend(roots),
        }
    }
    let scene =
        buffer.root.push(json::Scene { extensions: None, extras: Default::default(), name: None, nodes });
    buffer.root.scene = Some(scene);
    buffer.into_glb().map_err(unwritable)
}

/// On each axis along which the mesh is so far from the origin that single precision would show, a place near the
/// middle of the mesh; else
/// 0. It is a multiple of a power of two, so that its few decimals say it exactly to readers of either precision.
fn far_place(mesh: &Mesh) -> [f64; 3] {
    /// In diagonals of the mesh. At this distance coordinates are off by a millionth of the diagonal.
    const FAR: f64 = 10.0;
    let diagonal = mesh.diagonal();
    let step = if diagonal > 0.0 { diagonal.log2().floor().exp2() } else { 1.0 };
    [0, 1, 2].map(|axis| {
        let coordinates = mesh.vertices().iter().map(|p| p[axis]);
        let (low, high) =
            coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let middle = f64::from(((0.5 * low + 0.5 * high) / step).round() as f32) * step;
        let is_far = middle.abs() > FAR * diagonal && f64::from(middle as f32) == middle;
        if is_far { middle } else { 0.0 }
    })
}

fn primitive(
    buffer: &mut Buffer,
    mesh: &Mesh,
    place: [f64; 3],
    attributes: &Attributes,
) -> Result<Primitive, Misfit> {
    let split = Split::at_seams(mesh, attributes.corner_uvs.as_deref());
    let local = |v: u32| vec3::sub(mesh.vertices()[v as usize], place).map(|x| x as f32);
    let positions: Vec<[f32; 3]> = split.vertices.iter().map(|&v| local(v)).collect();
    if let Some(vertex) = positions.iter().position(|p| p.iter().any(|x| x.is_infinite())) {
        let problem = format!("vertex {vertex} is too far away for single precision");
        return Err((problem, "scale the mesh or write a .ply file"));
    }
    let mut list = vec![(Semantic::Positions, buffer.positions(&positions))];
    let floats = |components, normalized| Numbers { kind: ComponentType::F32, components, normalized };
    if let Some(colors) = &attributes.vertex_colors {
        list.push((Semantic::Colors(0), linear_colors(buffer, &split, colors)));
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
        let bytes: Vec<u8> =
            split.vertices.iter().flat_map(|&v| (values[v as usize] as f32).to_le_bytes()).collect();
        list.push((Semantic::Extras(name.clone()), buffer.array(&bytes, floats(Type::Scalar, false))));
    }
    for field in &attributes.vertex_integers {
        let values = split.vertices.iter().map(|&v| field.values[v as usize]);
        let accessor = match field.in_glb() {
            Some(GlbIntegers::As(kind)) => buffer.integers(values, kind),
            Some(GlbIntegers::Floats) => {
                let bytes: Vec<u8> = values.flat_map(|x| (x as f32).to_le_bytes()).collect();
                buffer.array(&bytes, floats(Type::Scalar, false))
            }
            None => continue,
        };
        list.push((Semantic::Extras(field.name.clone()), accessor));
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

/// Adds colours: eight bits where they bring every colour back, else sixteen, since dark ones are close together in
/// linear light.
fn linear_colors(buffer: &mut Buffer, split: &Split, colors: &[[u8; 4]]) -> Index<Accessor> {
    let is_fine = colors.iter().any(|c| !c[..3].iter().all(|&x| color::fits_a_byte(x)));
    let components = Type::Vec4;
    let rows = split.vertices.iter().map(|&v| {
        let [r, g, b, a] = colors[v as usize];
        [color::linear(r), color::linear(g), color::linear(b), f64::from(a) / 255.0]
    });
    if is_fine {
        let bytes: Vec<u8> =
            rows.flatten().flat_map(|x| ((65535.0 * x).round() as u16).to_le_bytes()).collect();
        buffer.array(&bytes, Numbers { kind: ComponentType::U16, components, normalized: true })
    } else {
        let bytes: Vec<u8> = rows.flatten().map(|x| (255.0 * x).round() as u8).collect();
        buffer.array(&bytes, Numbers { kind: ComponentType::U8, components, normalized: true })
    }
}

/// An image to embed, or a reference to one.
enum Image<'a> {
    Bytes(Cow<'a, [u8]>, &'static str),
    Uri(String),
}

/// The image's bytes where it is a PNG or JPEG file that can be read, else a reference; `None` where there is no such
/// file.
fn image<'a>(texture: &'a Texture, path: &Path) -> Result<Option<Image<'a>>, IoError> {
    let bytes: Cow<'a, [u8]> = match texture {
        Texture::Embedded { bytes, .. } => bytes.into(),
        Texture::File(file) if texture.exists() => {
            std::fs::read(file).map_err(|source| IoError::Read { path: file.clone(), source })?.into()
        }
        Texture::File(_) => return Ok(None),
    };
    if is_png(&bytes) || is_jpeg(&bytes) || matches!(texture, Texture::Embedded { .. }) {
        let stated = if let Texture::Embedded { mime, .. } = texture { mime.as_str() } else { "" };
        let mime = mime_of(&bytes, stated);
        return Ok(Some(Image::Bytes(bytes, mime)));
    }
    Ok(texture.place_beside(path)?.map(|name| Image::Uri(encode_percent(&bytes_of_path(&name)))))
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
    place: [f64; 3],
    mesh: Index<json::Node>,
) -> Result<Vec<Index<json::Node>>, Misfit> {
    let moved = |mut frame: Matrix4| {
        (0..3).for_each(|axis| frame[3][axis] -= place[axis]);
        frame
    };
    let frames: Vec<Matrix4> = skin.joints.iter().map(|joint| moved(joint.frame)).collect();
    let mut inverses = Vec::with_capacity(skin.joints.len());
    for (i, frame) in frames.iter().enumerate() {
        let singular =
            || (format!("the frame of joint {i} is singular"), "give every joint a frame of full rank");
        inverses.push(matrix4::inverse(frame).ok_or_else(singular)?);
    }
    let first = buffer.root.nodes.len();
    let index = |joint: usize| Index::new((first + joint) as u32);
    let mut roots = Vec::new();
    for (i, joint) in skin.joints.iter().enumerate() {
        let parent = joint.parent.map(usize::from);
        let local = parent.map_or(frames[i], |parent| matrix4::product(&inverses[parent], &frames[i]));
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
