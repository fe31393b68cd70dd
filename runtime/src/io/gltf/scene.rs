//! From the nodes that carry meshes to one mesh in world coordinates.

use std::collections::{BTreeMap, HashMap};

use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use super::accessor::Integers;
use super::document::Document;
use super::matrix4;
use super::nodes::{Nodes, Placed};
use super::skeleton::Skeleton;
use super::uri::{self, Target};
use crate::io::assemble::{MeshBuilder, strip_triangles};
use crate::io::attributes::{MeshFile, Skin, Texture};
use crate::io::error::{ParseError, Parsed};
use crate::io::format::MeshFormat;

/// The vertices of a primitive: which accessors they come from, and the set of texture coordinates.
type VertexKey<'a> = (&'a BTreeMap<Checked<Semantic>, Index<Accessor>>, u32);

pub(super) fn read(document: &Document<'_>) -> Parsed<MeshFile> {
    let nodes = Nodes::place(&document.root)?;
    let mut scene = Scene::new(document);
    for &i in &nodes.order {
        if nodes.placed[i].in_scene {
            scene.node(i, &nodes)?;
        }
    }
    scene.finish()
}

struct Scene<'a> {
    document: &'a Document<'a>,
    builder: MeshBuilder,
    colors: Vec<[u8; 4]>,
    uvs: Vec<[f32; 2]>,
    scalars: BTreeMap<String, Vec<f32>>,
    skin: Skin,
    skeletons: HashMap<usize, Skeleton>,
    /// Which image the texture coordinates refer to.
    image: Option<Index<json::Image>>,
    /// Primitives of points and lines, primitives with another image.
    n_without_faces: usize,
    n_other_images: usize,
}

impl<'a> Scene<'a> {
    fn new(document: &'a Document<'a>) -> Self {
        Self {
            document,
            builder: MeshBuilder::new(MeshFormat::Glb),
            colors: Vec::new(),
            uvs: Vec::new(),
            scalars: BTreeMap::new(),
            skin: Skin::default(),
            skeletons: HashMap::new(),
            image: None,
            n_without_faces: 0,
            n_other_images: 0,
        }
    }

    fn node(&mut self, i: usize, nodes: &Nodes) -> Parsed<()> {
        let node = &self.document.root.nodes[i];
        let Some(index) = node.mesh else { return Ok(()) };
        let mesh = self.document.root.get(index);
        let mesh = mesh.ok_or_else(|| {
            ParseError::part(format!("node {i}"), format!("its mesh {index} does not exist"))
        })?;
        if let Some(skin) = node.skin.filter(|skin| !self.skeletons.contains_key(&skin.value())) {
            let skeleton = Skeleton::load(self.document, nodes, skin, &mut self.skin.joints)?;
            self.skeletons.insert(skin.value(), skeleton);
        }
        let mut base_of_vertices = HashMap::new();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            self.primitive(primitive, &nodes.placed[i], node.skin, &mut base_of_vertices)
                .map_err(|e| e.within(format!("primitive {p} of mesh {index}")))?;
        }
        Ok(())
    }

    /// Adds a primitive. Primitives of one mesh often share their vertices: those are added once.
    fn primitive(
        &mut self,
        primitive: &'a Primitive,
        placed: &Placed,
        skin: Option<Index<json::Skin>>,
        base_of_vertices: &mut HashMap<VertexKey<'a>, usize>,
    ) -> Parsed<()> {
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Checked::Valid(_) => {
                self.n_without_faces += 1;
                return Ok(());
            }
            Checked::Invalid => return Err(ParseError::part("scene", "its mode is not valid")),
        };
        let uv_set = self.material(primitive)?;
        let positions = attribute(primitive, Semantic::Positions)
            .ok_or_else(|| ParseError::part("scene", "it has no positions"))?;
        let (_, n) = self.document.shape(positions)?;
        let base = match base_of_vertices.get(&(&primitive.attributes, uv_set)) {
            Some(&base) => base,
            None => {
                let base = self.vertices(primitive, positions, uv_set, placed, skin)?;
                base_of_vertices.insert((&primitive.attributes, uv_set), base);
                base
            }
        };
        // A skinned mesh is placed by its joints, not by its node.
        let mirrored = skin.is_none() && matrix4::determinant(&placed.world) < 0.0;
        self.faces(primitive, mode, base, n, mirrored)
    }

    /// Adds the vertices of a primitive; returns the index of the first.
    fn vertices(
        &mut self,
        primitive: &Primitive,
        positions: Index<Accessor>,
        uv_set: u32,
        placed: &Placed,
        skin: Option<Index<json::Skin>>,
    ) -> Parsed<usize> {
        let base = self.builder.vertices.len();
        let positions = self.document.read::<3>(positions, Integers::AsStated)?;
        let n = positions.len();
        self.document.charge(n)?;
        let weights = self.skin_weights(primitive, skin, base, n)?;
        for (i, &position) in positions.iter().enumerate() {
            let posed = weights
                .as_ref()
                .zip(skin.and_then(|skin| self.skeletons.get(&skin.value())))
                .and_then(|((joints, weights), skeleton)| skeleton.pose(position, &joints[i], &weights[i]));
            let place = posed.unwrap_or_else(|| matrix4::apply(&placed.world, position));
            if !place.iter().all(|x| x.is_finite()) {
                return Err(ParseError::part("scene", format!("vertex {i} is not finite: {place:?}")));
            }
            self.builder.vertices.push(place);
        }
        if let Some(accessor) = attribute(primitive, Semantic::Colors(0)) {
            let colors = match self.document.shape(accessor)? {
                (4, _) => self.document.read::<4>(accessor, Integers::Fractions)?,
                _ => {
                    let colors = self.document.read::<3>(accessor, Integers::Fractions)?;
                    colors.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect()
                }
            };
            let colors = colors.iter().map(|c| c.map(|x| (x * 255.0).round() as u8));
            append(&mut self.colors, base, [255; 4], n, colors)?;
        }
        if let Some(accessor) = attribute(primitive, Semantic::TexCoords(uv_set)) {
            let uvs = self.document.read::<2>(accessor, Integers::Fractions)?;
            append(&mut self.uvs, base, [0.0; 2], n, uvs.iter().map(|[u, v]| [*u as f32, (1.0 - v) as f32]))?;
        }
        for (name, accessor) in custom_attributes(primitive) {
            if self.document.shape(accessor)?.0 == 1 {
                let values = self.document.read::<1>(accessor, Integers::AsStated)?;
                let field = self.scalars.entry(name.to_owned()).or_default();
                append(field, base, f32::NAN, n, values.iter().map(|[x]| *x as f32))?;
            }
        }
        Ok(base)
    }

    /// Adds the joints and weights of a skinned primitive's vertices; returns them in the skin's own numbering.
    #[allow(clippy::type_complexity)]
    fn skin_weights(
        &mut self,
        primitive: &Primitive,
        skin: Option<Index<json::Skin>>,
        base: usize,
        n: usize,
    ) -> Parsed<Option<(Vec<[f64; 4]>, Vec<[f32; 4]>)>> {
        let accessors =
            attribute(primitive, Semantic::Joints(0)).zip(attribute(primitive, Semantic::Weights(0)));
        let skeleton = skin.and_then(|skin| self.skeletons.get(&skin.value()));
        let (Some((joints, weights)), Some(skeleton)) = (accessors, skeleton) else { return Ok(None) };
        let joints = self.document.read::<4>(joints, Integers::AsStated)?;
        let weights = self.document.read::<4>(weights, Integers::Fractions)?;
        let weights: Vec<[f32; 4]> = weights.iter().map(|w| w.map(|x| x as f32)).collect();
        if joints.len() != n || weights.len() != n {
            return Err(ParseError::part("scene", "joints or weights are not as many as positions"));
        }
        let mut indices = Vec::with_capacity(n);
        for (vertex, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
            let found = skeleton.indices(joints, weights).ok_or_else(|| {
                ParseError::part(
                    "scene",
                    format!("vertex {vertex} has a joint that does not exist: {joints:?}"),
                )
            });
            indices.push(found?);
        }
        append(&mut self.skin.indices, base, [0; 4], n, indices.into_iter())?;
        append(&mut self.skin.weights, base, [0.0; 4], n, weights.iter().copied())?;
        Ok(Some((joints, weights)))
    }

    fn faces(
        &mut self,
        primitive: &Primitive,
        mode: Mode,
        base: usize,
        n: usize,
        mirrored: bool,
    ) -> Parsed<()> {
        let indices: Vec<i64> = match primitive.indices {
            Some(accessor) => {
                let indices = self.document.read::<1>(accessor, Integers::AsStated)?;
                self.document.charge(indices.len())?;
                if let Some([i]) = indices.iter().find(|&&[i]| i < 0.0 || i >= n as f64 || i.fract() != 0.0) {
                    let problem =
                        format!("index {i} is out of range: there are {n} vertices, counted from 0");
                    return Err(ParseError::part(format!("accessor {accessor}"), problem));
                }
                indices.iter().map(|&[i]| i as i64).collect()
            }
            None => (0..n as i64).collect(),
        };
        let face = |triangle: [i64; 3]| {
            let [a, b, c] = triangle.map(|i| (i as usize + base) as u32);
            if mirrored { [a, c, b] } else { [a, b, c] }
        };
        let faces = &mut self.builder.faces;
        match mode {
            Mode::TriangleStrip => faces.extend(strip_triangles(&indices).map(face)),
            Mode::TriangleFan => {
                faces.extend(indices.windows(2).skip(1).map(|w| face([indices[0], w[0], w[1]])));
            }
            _ if !indices.len().is_multiple_of(3) => {
                return Err(ParseError::part(
                    "scene",
                    format!("{} corners do not make triangles", indices.len()),
                ));
            }
            _ => faces.extend(indices.chunks_exact(3).map(|t| face([t[0], t[1], t[2]]))),
        }
        Ok(())
    }

    /// Notes the image of a primitive's material; returns which set of texture coordinates it uses.
    fn material(&mut self, primitive: &Primitive) -> Parsed<u32> {
        let Some(index) = primitive.material else { return Ok(0) };
        let missing = || ParseError::part(format!("material {index}"), "it or its texture does not exist");
        let material = self.document.root.get(index).ok_or_else(missing)?;
        let Some(info) = &material.pbr_metallic_roughness.base_color_texture else { return Ok(0) };
        let texture = self.document.root.get(info.index).ok_or_else(missing)?;
        match self.image {
            Some(image) if image != texture.source => self.n_other_images += 1,
            _ => self.image = Some(texture.source),
        }
        Ok(info.tex_coord)
    }

    fn finish(mut self) -> Parsed<MeshFile> {
        let n = self.builder.vertices.len();
        if n == 0 {
            return Err(ParseError::part("scene", "there are no triangles in it"));
        }
        let fill = |column: &mut Vec<[f32; 2]>| column.resize(n, [0.0; 2]);
        if !self.uvs.is_empty() {
            fill(&mut self.uvs);
            self.builder.spread_uvs(&self.uvs);
            self.builder.attributes.texture = self.texture()?;
        }
        if !self.colors.is_empty() {
            self.colors.resize(n, [255; 4]);
            self.builder.attributes.vertex_colors = Some(self.colors);
        }
        if !self.skin.indices.is_empty() {
            self.skin.indices.resize(n, [0; 4]);
            self.skin.weights.resize(n, [0.0; 4]);
            self.builder.attributes.skin = Some(self.skin);
        }
        self.builder.attributes.vertex_scalars = self
            .scalars
            .into_iter()
            .map(|(name, mut values)| {
                values.resize(n, f32::NAN);
                (name, values)
            })
            .collect();
        for (count, what) in [
            (self.n_without_faces, "of points or lines were left out"),
            (self.n_other_images, "have another image than the first one, which alone is kept"),
        ] {
            if count > 0 {
                self.builder.info.warnings.push(format!("{count} primitives {what}"));
            }
        }
        self.builder.finish()
    }

    fn texture(&mut self) -> Parsed<Option<Texture>> {
        // An index beyond the last image stands for a texture in a format of an extension.
        let Some(image) = self.image.and_then(|index| self.document.root.get(index)) else { return Ok(None) };
        let mime = image.mime_type.as_ref().map(|mime| mime.0.clone()).unwrap_or_default();
        if let Some(view) = image.buffer_view {
            let (bytes, _) = self.document.view(view)?;
            return Ok(Some(Texture::Embedded { bytes: bytes.to_vec(), mime }));
        }
        let Some(uri) = &image.uri else { return Ok(None) };
        match uri::resolve(uri, &self.document.folder) {
            Ok(Target::Data(bytes, mime)) => Ok(Some(Texture::Embedded { bytes, mime })),
            Ok(Target::File(path)) => Ok(Some(Texture::File(path))),
            Err(problem) => {
                self.builder.info.warnings.push(format!("the image was left out: {problem}"));
                Ok(None)
            }
        }
    }
}

fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
    primitive.attributes.get(&Checked::Valid(semantic)).copied()
}

/// The attributes whose names begin with an underscore, without it.
fn custom_attributes(primitive: &Primitive) -> impl Iterator<Item = (&str, Index<Accessor>)> {
    primitive.attributes.iter().filter_map(|(semantic, &accessor)| match semantic {
        Checked::Valid(Semantic::Extras(name)) => Some((name.as_str(), accessor)),
        _ => None,
    })
}

/// Appends the values of `n` vertices to a column of which earlier vertices may be missing.
fn append<T: Copy>(
    column: &mut Vec<T>,
    base: usize,
    missing: T,
    n: usize,
    values: impl ExactSizeIterator<Item = T>,
) -> Parsed<()> {
    if values.len() != n {
        let problem = format!("an attribute has {} values for {n} vertices", values.len());
        return Err(ParseError::part("scene", problem));
    }
    column.resize(base, missing);
    column.extend(values);
    Ok(())
}
