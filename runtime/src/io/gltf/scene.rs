//! From the nodes that carry meshes to one mesh in world coordinates.

use std::collections::{BTreeMap, HashMap};

use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use super::accessor::Integers;
use super::color::srgb_byte;
use super::document::Document;
use super::influences::{Influences, has_joints};
use super::material::{Look, note};
use super::matrix4::{self, Matrix4};
use super::nodes::Nodes;
use super::skeleton::Skeleton;
use super::uri::{self, Target};
use crate::io::assemble::{MeshBuilder, strip_triangles};
use crate::io::attributes::{IntegerField, IntegerKind, MeshFile, Skin, Texture};
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
    scene.hidden(&nodes);
    scene.finish()
}

struct Scene<'a> {
    document: &'a Document<'a>,
    builder: MeshBuilder,
    /// Linear red, green, blue and alpha.
    colors: Vec<[f64; 4]>,
    uvs: Vec<[f32; 2]>,
    scalars: BTreeMap<String, Vec<f64>>,
    /// The types of the fields of integers.
    integers: BTreeMap<String, IntegerKind>,
    skin: Skin,
    skeletons: HashMap<usize, Skeleton>,
    /// Which image the texture coordinates refer to.
    image: Option<Index<json::Image>>,
    /// Primitives of points and lines, triangles with another image.
    n_without_faces: usize,
    n_other_images: usize,
    n_weaker: usize,
}

/// A node's mesh in one of its places.
#[derive(Clone, Copy)]
struct Instance<'a> {
    world: Matrix4,
    skin: Option<Index<json::Skin>>,
    /// How far each morph target is applied.
    weights: &'a [f32],
}

impl<'a> Scene<'a> {
    fn new(document: &'a Document<'a>) -> Self {
        Self {
            document,
            builder: MeshBuilder::new(MeshFormat::Glb),
            colors: Vec::new(),
            uvs: Vec::new(),
            scalars: BTreeMap::new(),
            integers: BTreeMap::new(),
            skin: Skin::default(),
            skeletons: HashMap::new(),
            image: None,
            n_without_faces: 0,
            n_other_images: 0,
            n_weaker: 0,
        }
    }

    fn node(&mut self, i: usize, nodes: &Nodes) -> Parsed<()> {
        let document = self.document;
        let node = &document.root.nodes[i];
        let Some(index) = node.mesh else { return Ok(()) };
        let mesh = document.root.get(index);
        let mesh = mesh.ok_or_else(|| {
            ParseError::part(format!("node {i}"), format!("its mesh {index} does not exist"))
        })?;
        if let Some(skin) = node.skin.filter(|skin| !self.skeletons.contains_key(&skin.value())) {
            let skeleton = Skeleton::load(document, nodes, skin, &mut self.skin.joints)?;
            self.skeletons.insert(skin.value(), skeleton);
        }
        if let Some(name) =
            node.name.as_ref().or(mesh.name.as_ref()).filter(|_| self.builder.info.groups.len() < 256)
        {
            self.builder.info.groups.push(name.clone());
        }
        let weights = node.weights.as_deref().or(mesh.weights.as_deref()).unwrap_or_default();
        let places =
            instances(document, node, &nodes.placed[i].world).map_err(|e| e.within(format!("node {i}")))?;
        if places.len() > 1 {
            let n = places.len();
            let repeated = format!("node {i} repeats its mesh {n} times ({INSTANCING}); all are read");
            self.builder.info.warnings.push(repeated);
        }
        for world in places {
            let instance = Instance { world, skin: node.skin, weights };
            let mut base_of_vertices = HashMap::new();
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                self.primitive(primitive, &instance, &mut base_of_vertices)
                    .map_err(|e| e.within(format!("primitive {p} of mesh {index}")))?;
            }
        }
        Ok(())
    }

    /// Adds a primitive. Primitives of one mesh often share their vertices: those are added once.
    fn primitive(
        &mut self,
        primitive: &'a Primitive,
        instance: &Instance,
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
        let look = Look::of(self.document, primitive, &mut self.builder.info.left_out)?;
        let positions = attribute(primitive, Semantic::Positions)
            .ok_or_else(|| ParseError::part("scene", "it has no positions"))?;
        self.document.check_compression(primitive, positions)?;
        let (_, n) = self.document.shape(positions)?;
        let base = match base_of_vertices.get(&(&primitive.attributes, look.uv_set)) {
            Some(&base) => base,
            None => {
                let base = self.vertices(primitive, positions, &look, instance)?;
                base_of_vertices.insert((&primitive.attributes, look.uv_set), base);
                base
            }
        };
        // A skinned mesh is placed by its joints, not by its node.
        let mirrored = instance.skin.is_none() && matrix4::determinant(&instance.world) < 0.0;
        let first = self.builder.faces.len();
        self.faces(primitive, mode, base, n, mirrored)?;
        match (self.image, look.image) {
            (Some(kept), Some(image)) if kept != image => {
                self.n_other_images += self.builder.faces.len() - first;
            }
            (None, Some(image)) => self.image = Some(image),
            _ => {}
        }
        Ok(())
    }

    /// Adds the vertices of a primitive; returns the index of the first.
    fn vertices(
        &mut self,
        primitive: &Primitive,
        positions: Index<Accessor>,
        look: &Look,
        instance: &Instance,
    ) -> Parsed<usize> {
        let base = self.builder.vertices.len();
        let mut positions = self.document.read::<3>(positions, Integers::AsStated)?;
        let n = positions.len();
        self.document.charge(n)?;
        self.morph(primitive, instance.weights, &mut positions)?;
        let influences = self.influences(primitive, instance.skin, base, n)?;
        let skeleton = instance.skin.and_then(|skin| self.skeletons.get(&skin.value()));
        for (i, &position) in positions.iter().enumerate() {
            let posed =
                influences.as_ref().zip(skeleton).and_then(|(all, skeleton)| all.pose(i, position, skeleton));
            let place = posed.unwrap_or_else(|| matrix4::apply(&instance.world, position));
            let problem = (!place.iter().all(|x| x.is_finite()))
                .then(|| ParseError::part("scene", format!("vertex {i} is not finite: {place:?}")));
            self.builder.vertex((place, problem));
        }
        self.vertex_colors(primitive, look, base, n)?;
        if let Some(accessor) = attribute(primitive, Semantic::TexCoords(look.uv_set)) {
            let uvs = self.document.read::<2>(accessor, Integers::AsStated)?;
            let placed = uvs.iter().map(|&uv| look.placement.apply(uv));
            append(&mut self.uvs, base, [0.0; 2], n, placed.map(|[u, v]| [u as f32, (1.0 - v) as f32]))?;
        }
        self.fields(primitive, base, n)?;
        self.note_attributes(primitive, look.uv_set);
        Ok(base)
    }

    /// Adds the morph targets, as far as the mesh shows them without animation.
    fn morph(&mut self, primitive: &Primitive, weights: &[f32], positions: &mut [[f64; 3]]) -> Parsed<()> {
        let targets = primitive.targets.as_deref().unwrap_or_default();
        for (t, target) in targets.iter().enumerate() {
            let weight = f64::from(weights.get(t).copied().unwrap_or(0.0));
            let Some(accessor) = target.positions.filter(|_| weight != 0.0) else { continue };
            let moves = self.document.read::<3>(accessor, Integers::AsStated)?;
            if moves.len() != positions.len() {
                let problem =
                    format!("morph target {t} has {} values for {} vertices", moves.len(), positions.len());
                return Err(ParseError::part("scene", problem));
            }
            for (position, by) in positions.iter_mut().zip(moves) {
                *position = [0, 1, 2].map(|axis| position[axis] + weight * by[axis]);
            }
        }
        if !targets.is_empty() {
            let left_out = &mut self.builder.info.left_out;
            note(
                left_out,
                format!("{} morph targets, beyond the weights that the file gives them", targets.len()),
            );
        }
        Ok(())
    }

    /// Adds the colours of the vertices, times the factor of the material where no image is multiplied by it too.
    fn vertex_colors(&mut self, primitive: &Primitive, look: &Look, base: usize, n: usize) -> Parsed<()> {
        let factor = if look.image.is_some() { [1.0; 4] } else { look.factor };
        let colors: Vec<[f64; 4]> = match attribute(primitive, Semantic::Colors(0)) {
            Some(accessor) if self.document.shape(accessor)?.0 == 4 => {
                self.document.read::<4>(accessor, Integers::Fractions)?
            }
            Some(accessor) => {
                let colors = self.document.read::<3>(accessor, Integers::Fractions)?;
                colors.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect()
            }
            None if factor != [1.0; 4] => vec![[1.0; 4]; n],
            None => return Ok(()),
        };
        if factor != [1.0; 4] {
            let what = format!(
                "the colour factor {factor:?} of a material as such: it became colours of the vertices"
            );
            note(&mut self.builder.info.left_out, what);
        }
        let shaded = colors.iter().map(|c| [0, 1, 2, 3].map(|i| c[i] * factor[i]));
        append(&mut self.colors, base, [1.0; 4], n, shaded)
    }

    /// Adds the custom attributes of one component.
    fn fields(&mut self, primitive: &Primitive, base: usize, n: usize) -> Parsed<()> {
        for (name, accessor) in custom_attributes(primitive) {
            if self.document.shape(accessor)?.0 != 1 {
                note(
                    &mut self.builder.info.left_out,
                    format!("the attribute '_{name}', of several components"),
                );
                continue;
            }
            let values = self.document.read::<1>(accessor, Integers::AsStated)?;
            let kind = self.document.integer_kind(accessor);
            match (self.integers.get(name).copied(), kind) {
                // Parts of different types are numbers.
                (Some(known), Some(kind)) if known == kind => {}
                (None, Some(kind)) if !self.scalars.contains_key(name) => {
                    self.integers.insert(name.to_owned(), kind);
                }
                _ => {
                    self.integers.remove(name);
                }
            }
            let field = self.scalars.entry(name.to_owned()).or_default();
            append(field, base, f64::NAN, n, values.iter().map(|[x]| *x))?;
        }
        Ok(())
    }

    /// Adds the strongest joints and weights of a skinned primitive's vertices; returns all of them.
    fn influences(
        &mut self,
        primitive: &Primitive,
        skin: Option<Index<json::Skin>>,
        base: usize,
        n: usize,
    ) -> Parsed<Option<Influences>> {
        let Some(skeleton) = skin.and_then(|skin| self.skeletons.get(&skin.value())) else {
            if has_joints(primitive) {
                note(
                    &mut self.builder.info.left_out,
                    "joint weights of a mesh whose node has no skin".into(),
                );
            }
            return Ok(None);
        };
        if !has_joints(primitive) {
            return Ok(None);
        }
        let influences = Influences::read(self.document, primitive, n)?;
        let (mut indices, mut weights) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for vertex in 0..n {
            let (joints, strengths, has_more) = influences.strongest(vertex, skeleton)?;
            indices.push(joints);
            weights.push(strengths);
            self.n_weaker += usize::from(has_more);
        }
        append(&mut self.skin.indices, base, [0; 4], n, indices.into_iter())?;
        append(&mut self.skin.weights, base, [0.0; 4], n, weights.into_iter())?;
        Ok(Some(influences))
    }

    /// Notes the attributes that are not kept. Normals and tangents follow from the surface.
    fn note_attributes(&mut self, primitive: &Primitive, uv_set: u32) {
        for semantic in primitive.attributes.keys() {
            let what = match semantic {
                Checked::Valid(Semantic::Colors(set)) if *set > 0 => format!("the attribute COLOR_{set}"),
                Checked::Valid(Semantic::TexCoords(set)) if *set != uv_set => {
                    format!("the attribute TEXCOORD_{set}")
                }
                Checked::Invalid => "an attribute of a name that glTF does not know".to_owned(),
                _ => continue,
            };
            note(&mut self.builder.info.left_out, what);
        }
    }

    /// Says what is in no scene that is shown.
    fn hidden(&mut self, nodes: &Nodes) {
        let all = self.document.root.nodes.iter().enumerate();
        let hidden: Vec<String> = all
            .filter(|(i, node)| node.mesh.is_some() && !nodes.placed[*i].in_scene)
            .map(|(i, node)| {
                node.name.as_ref().map_or(format!("node {i}"), |name| format!("'{}'", name.escape_debug()))
            })
            .collect();
        if !hidden.is_empty() {
            let named = hidden[..hidden.len().min(4)].join(", ");
            let more = if hidden.len() > 4 { ", ..." } else { "" };
            self.builder.info.warnings.push(format!(
                "{} nodes with a mesh are not in the scene that the file shows and were left out: {named}{more}",
                hidden.len()
            ));
        }
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

    fn finish(mut self) -> Parsed<MeshFile> {
        let n = self.builder.vertices.len();
        if n == 0 {
            return Err(ParseError::part("scene", "there are no triangles in it"));
        }
        if !self.uvs.is_empty() {
            self.uvs.resize(n, [0.0; 2]);
            self.builder.spread_uvs(&self.uvs);
            self.builder.attributes.texture = self.texture()?;
        }
        if !self.colors.is_empty() {
            self.colors.resize(n, [1.0; 4]);
            let bytes = |[r, g, b, a]: &[f64; 4]| {
                [srgb_byte(*r), srgb_byte(*g), srgb_byte(*b), (a * 255.0).round() as u8]
            };
            self.builder.attributes.vertex_colors = Some(self.colors.iter().map(bytes).collect());
        }
        if !self.skin.indices.is_empty() {
            self.skin.indices.resize(n, [0; 4]);
            self.skin.weights.resize(n, [0.0; 4]);
            self.builder.attributes.skin = Some(std::mem::take(&mut self.skin));
        }
        for (name, mut values) in std::mem::take(&mut self.scalars) {
            values.resize(n, f64::NAN);
            match self.integers.get(&name) {
                Some(&kind) => {
                    let value = |x: f64| if x.is_nan() { kind.missing() } else { x as i64 };
                    let values = values.into_iter().map(value).collect();
                    self.builder.attributes.vertex_integers.push(IntegerField { name, kind, values });
                }
                None => self.builder.attributes.vertex_scalars.push((name, values)),
            }
        }
        self.note_the_rest();
        self.builder.finish()
    }

    fn note_the_rest(&mut self) {
        let (root, info) = (&self.document.root, &mut self.builder.info);
        info.files.extend(self.document.files().iter().cloned());
        // A single mesh is no group.
        if info.groups.len() < 2 {
            info.groups.clear();
        }
        if self.n_without_faces > 0 {
            info.warnings
                .push(format!("{} primitives of points or lines were left out", self.n_without_faces));
        }
        let counted = [
            (self.n_other_images, "triangles' image, which is another than the first one"),
            (self.n_weaker, "vertices' weaker joints, of which each keeps the four strongest"),
            (root.animations.len(), "animations"),
            (root.cameras.len(), "cameras"),
        ];
        for (count, what) in counted.into_iter().filter(|(count, _)| *count > 0) {
            note(&mut info.left_out, format!("{count} {what}"));
        }
        for name in root.extensions_used.iter().filter(|name| !is_handled(name)) {
            note(&mut info.left_out, format!("what the extension '{}' adds", name.escape_debug()));
        }
    }

    fn texture(&mut self) -> Parsed<Option<Texture>> {
        let Some(image) = self.image.and_then(|index| self.document.root.get(index)) else { return Ok(None) };
        let mime = image.mime_type.as_ref().map(|mime| mime.0.clone()).unwrap_or_default();
        let texture = match (image.buffer_view, &image.uri) {
            (Some(view), _) => {
                let (bytes, _) = self.document.view(view)?;
                Texture::Embedded { bytes: bytes.to_vec(), mime }
            }
            (None, Some(uri)) => match uri::resolve(uri, &self.document.folder) {
                Ok(Target::Data(bytes, mime)) => Texture::Embedded { bytes, mime },
                Ok(Target::File(path)) => {
                    self.builder.info.files.push(path.clone());
                    Texture::File(path)
                }
                Err(problem) => {
                    note(&mut self.builder.info.left_out, format!("the image: {problem}"));
                    return Ok(None);
                }
            },
            (None, None) => return Ok(None),
        };
        let problem = match &texture {
            Texture::File(path) if !path.is_file() => {
                format!("the image {}, which is not there; put it beside the mesh", path.display())
            }
            Texture::Embedded { bytes, .. } if is_of_an_extension(bytes) => {
                "the image, in a format of an extension; export it as PNG or JPEG".to_owned()
            }
            _ => return Ok(Some(texture)),
        };
        note(&mut self.builder.info.left_out, problem);
        Ok(None)
    }
}

/// Whether the bytes are those of a WebP, KTX2 or DDS image, or of AVIF.
fn is_of_an_extension(bytes: &[u8]) -> bool {
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    let avif = bytes.get(4..8) == Some(b"ftyp");
    webp || avif || bytes.starts_with(b"\xABKTX 20\xBB") || bytes.starts_with(b"DDS ")
}

/// Whether everything that an extension adds is kept or named elsewhere, or does not touch what is read.
fn is_handled(extension: &str) -> bool {
    let named = [
        "KHR_texture_",
        "EXT_texture_",
        "MSFT_texture_",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_unlit",
    ];
    extension == "KHR_mesh_quantization"
        || extension == INSTANCING
        || named.iter().any(|known| extension.starts_with(known))
}

const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// The places of a node's mesh: its own, or those of the instances that it lists.
fn instances(document: &Document<'_>, node: &json::Node, world: &Matrix4) -> Parsed<Vec<Matrix4>> {
    let Some(listed) = node.extensions.as_ref().and_then(|e| e.others.get(INSTANCING)) else {
        return Ok(vec![*world]);
    };
    let accessor = |name: &str| {
        let index = listed["attributes"][name].as_u64().and_then(|i| u32::try_from(i).ok());
        index.map(Index::<Accessor>::new)
    };
    let read3 = |name| accessor(name).map(|a| document.read::<3>(a, Integers::AsStated)).transpose();
    let (translations, scales) = (read3("TRANSLATION")?, read3("SCALE")?);
    let rotations = accessor("ROTATION").map(|a| document.read::<4>(a, Integers::AsStated)).transpose()?;
    let counts = [
        translations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
    ];
    let Some(n) = counts.iter().flatten().next().copied() else { return Ok(vec![*world]) };
    if counts.iter().flatten().any(|&count| count != n) {
        return Err(ParseError::part(
            "scene",
            format!("the attributes of {INSTANCING} are not equally many"),
        ));
    }
    document.charge(n)?;
    let place = |i: usize| {
        let translation = translations.as_ref().map_or([0.0; 3], |t| t[i]);
        let rotation = rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i]);
        let scale = scales.as_ref().map_or([1.0; 3], |s| s[i]);
        matrix4::product(world, &matrix4::from_parts(translation, rotation, scale))
    };
    Ok((0..n).map(place).collect())
}

pub(super) fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
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
