//! One shape: the mesh that quantities live on, the way back to the input's vertices, and a store of named quantities.
//!
//! [`Shape::new`] repairs, and subdivides or decimates. Everything else is a quantity ([`quantities`]), computed when
//! first asked for: the Laplacian, the eigenbasis, gradients of the eigenfunctions, the wave kernel signature, SHOT,
//! the eigenbasis at full resolution. With a [`Cache`] each is kept under (mesh, quantity, its own options, its
//! version), so that another `k` does not compute SHOT anew, and a model that takes no SHOT never computes it.

mod pieces;
pub mod quantities;
mod saved;
mod way_back;

use crate::cache::{Cache, CacheKey, Decoder, Encoder};
use crate::error::Error;
use crate::events::{Event, Observer, timed};
use crate::mesh::{
    DecimateOptions, Mesh, RepairOptions, Subdivided, SurfacePoint, carried_points, decimate, repair,
    subdivide, vertices_on_surface,
};
use quantities::Store;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

pub use way_back::WayBack;

/// Settings of [`Shape::new`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ShapeOptions {
    /// Meshes of more vertices than this are decimated to it; 4 or more, `None`: never. Default 15000, as in the paper.
    pub decimate: Option<usize>,
    /// Meshes of fewer vertices than this are subdivided to so many, or to as many as `decimate` allows; `None`:
    /// never. Default `None`.
    pub subdivide: Option<usize>,
    /// For a part of a shape: the area of the whole, in squared units of the mesh, above 0. The SHOT radius is then
    /// relative to it, and so is [`Shape::unit_basis`]. `None`: the shape is whole. Default `None`.
    pub whole_area: Option<f64>,
}

impl Default for ShapeOptions {
    fn default() -> Self {
        Self { decimate: Some(15_000), subdivide: None, whole_area: None }
    }
}

impl ShapeOptions {
    /// Checks what no stage checks.
    fn check(&self) -> Result<(), Error> {
        match self.whole_area {
            Some(area) if !(area > 0.0 && area.is_finite()) => Err(Error::WholeArea { area }),
            _ => Ok(()),
        }
    }
}

/// Where results are kept, and who is told of stages and warnings.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// The folder of quantities; `None`: nothing is kept on disk.
    pub cache: Option<&'a Cache>,
    /// Receives the events.
    pub observer: Observer<'a>,
}

impl Context<'_> {
    /// Nothing is kept and nobody is told.
    pub const SILENT: Context<'static> = Context { cache: None, observer: &crate::events::ignore };
}

/// A repaired, possibly decimated shape and what was computed of it so far.
#[derive(Debug)]
pub struct Shape {
    /// Name for messages: the file's name, or what the caller chose.
    pub name: String,
    /// The repaired mesh at full resolution, subdivided where it is sparse, `[n_full]` vertices.
    pub full_mesh: Mesh,
    /// The decimated mesh, `[n]` vertices; absent for small meshes.
    decimated: Option<Mesh>,
    /// The mesh as it was read, where repair changed it.
    input: Option<Mesh>,
    /// What the user should know of the mesh, a line each.
    warnings: String,
    /// From the vertices of the meshes to the input's and back.
    pub way_back: WayBack,
    /// For a part of a shape, the area of the whole ([`ShapeOptions::whole_area`]), in squared units of the mesh.
    pub whole_area: Option<f64>,
    key: CacheKey,
    store: Mutex<Store>,
}

impl Clone for Shape {
    fn clone(&self) -> Self {
        Self {
            name: self.name.clone(),
            full_mesh: self.full_mesh.clone(),
            decimated: self.decimated.clone(),
            input: self.input.clone(),
            warnings: self.warnings.clone(),
            way_back: self.way_back.clone(),
            whole_area: self.whole_area,
            key: self.key,
            store: Mutex::new(self.store().clone()),
        }
    }
}

/// A point of one of a shape's meshes is not farther from its place on another than this, relative to sqrt(area).
const CARRIED_WITHIN: f64 = 0.05;

/// Raise where repair, subdivision or decimation give another mesh.
const MESH_VERSION: u32 = 5;

impl Shape {
    /// Repairs and, where it is smaller or larger than the options say, subdivides or decimates a mesh as read;
    /// `name` is for messages.
    ///
    /// # Errors
    /// If repair leaves no face, the area of the whole or the decimation target is out of range, or the cache cannot be
    /// written; it names the shape.
    pub fn new(name: &str, mesh: &Mesh, options: &ShapeOptions, context: Context) -> Result<Self, Error> {
        Self::process(name, mesh, options, context).map_err(|e| e.in_shape(name))
    }

    fn process(name: &str, mesh: &Mesh, options: &ShapeOptions, context: Context) -> Result<Self, Error> {
        options.check()?;
        let key = mesh_key(mesh, options);
        let found = context.cache.and_then(|cache| cache.fetch("mesh", key, context.observer));
        let observer = context.observer;
        if let Some(shape) = found.and_then(|bytes| Self::decode(name, options, key, &bytes)) {
            shape.warn(observer);
            return Ok(shape);
        }
        let repaired = timed(observer, name, "repair", || repair(mesh, &RepairOptions::default()))?;
        let warnings = pieces::warnings(mesh, &repaired);
        let fewest = options.subdivide.map(|n| n.min(options.decimate.unwrap_or(n)));
        let is_sparse = fewest.filter(|&fewest| repaired.mesh.n_vertices() < fewest);
        let (full_mesh, mut way_back) = match is_sparse {
            Some(fewest) => {
                let Subdivided { mesh: fine, nearest } =
                    timed(observer, name, "subdivide", || subdivide(&repaired.mesh, fewest));
                let way_back = WayBack::of_repaired(mesh, &repaired, &fine).subdivided(&nearest);
                (fine, way_back)
            }
            None => {
                let way_back = WayBack::of_repaired(mesh, &repaired, &repaired.mesh);
                (repaired.mesh, way_back)
            }
        };
        let mut decimated = None;
        if let Some(target) = options.decimate.filter(|&target| full_mesh.n_vertices() > target) {
            let result = timed(observer, name, "decimate", || {
                decimate(&full_mesh, target, &DecimateOptions::default())
            })?;
            way_back.full_of_work = Some(result.injection);
            decimated = Some(result.mesh);
        }
        let input = (full_mesh != *mesh).then(|| mesh.clone());
        let shape =
            Self::assemble(name, options, key, Meshes { full_mesh, decimated, input, warnings }, way_back);
        shape.warn(observer);
        if let Some(cache) = context.cache {
            cache.put("mesh", key, &shape.encode())?;
        }
        Ok(shape)
    }

    fn assemble(
        name: &str,
        options: &ShapeOptions,
        key: CacheKey,
        Meshes { full_mesh, decimated, input, warnings }: Meshes,
        way_back: WayBack,
    ) -> Self {
        let (name, whole_area) = (name.to_string(), options.whole_area);
        Self {
            name,
            full_mesh,
            decimated,
            input,
            warnings,
            way_back,
            whole_area,
            key,
            store: Mutex::default(),
        }
    }

    /// Tells what the user should know of the mesh, each time that it is used.
    fn warn(&self, observer: Observer) {
        self.warnings.lines().for_each(|text| observer(Event::Warning(format!("{}: {text}", self.name))));
    }

    /// The key of the processed mesh: the input's content, the options and their version. Quantities derive theirs
    /// from it.
    pub fn key(&self) -> CacheKey {
        self.key
    }

    /// The mesh that quantities live on: the decimated one, or the full one.
    pub fn mesh(&self) -> &Mesh {
        self.decimated.as_ref().unwrap_or(&self.full_mesh)
    }

    /// Whether [`Shape::mesh`] is decimated.
    pub fn is_decimated(&self) -> bool {
        self.decimated.is_some()
    }

    /// Number of vertices `n` of [`Shape::mesh`].
    pub fn n(&self) -> usize {
        self.mesh().n_vertices()
    }

    /// The mesh as it was read.
    pub fn input_mesh(&self) -> &Mesh {
        self.input.as_ref().unwrap_or(&self.full_mesh)
    }

    /// Where the vertices of the full mesh are on the working mesh, `[n_full]`.
    pub fn full_on_work(&self) -> Vec<Option<SurfacePoint>> {
        let Some(full_of_work) = &self.way_back.full_of_work else { return vertices_on_surface(self.mesh()) };
        let mut places = carried_points(
            &vertices_on_surface(&self.full_mesh),
            &self.full_mesh,
            self.mesh(),
            CARRIED_WITHIN,
        );
        // Vertices of both are exactly there.
        for (place, &full) in vertices_on_surface(self.mesh()).into_iter().zip(full_of_work) {
            places[full as usize] = place;
        }
        places
    }

    /// Points of the working mesh as points of the input, `[points]`.
    pub fn on_input(&self, points: &[Option<SurfacePoint>]) -> Vec<Option<SurfacePoint>> {
        let changed = self.decimated.is_some() || self.input.is_some();
        match changed {
            true => carried_points(points, self.mesh(), self.input_mesh(), CARRIED_WITHIN),
            false => points.to_vec(),
        }
    }

    /// Number of vertices of the input mesh.
    pub fn n_input(&self) -> usize {
        self.way_back.full_of_input.len()
    }

    /// The area that counts as 1: that of the mesh, or of the whole that it is a part of.
    pub fn unit_area(&self) -> f64 {
        self.whole_area.unwrap_or_else(|| self.mesh().area())
    }

    /// The shape as a part of a whole of another area, in squared units of the mesh; what does not depend on that
    /// stays computed.
    pub(crate) fn part_of(&self, whole_area: f64) -> Self {
        let mut part = self.clone();
        part.whole_area = Some(whole_area);
        part.key = CacheKey::of(&[self.key.as_bytes(), &whole_area.to_le_bytes()]);
        part.store().forget_sizes();
        part
    }

    /// The mirror image of the working mesh, whose vertices are those of this one and whose faces are turned round,
    /// so that its normals are outside again. It is whole.
    pub fn mirrored(&self) -> Self {
        let mesh = self.mesh();
        let vertices = mesh.vertices().iter().map(|&[x, y, z]| [-x, y, z]).collect();
        let faces = mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
        Self {
            name: self.name.clone(),
            full_mesh: Mesh::new(vertices, faces).expect("the mirror image of a valid mesh is valid"),
            decimated: None,
            input: None,
            warnings: String::new(),
            way_back: WayBack::identity(mesh.n_vertices()),
            whole_area: None,
            key: CacheKey::of(&[self.key.as_bytes(), b"mirrored"]),
            store: Mutex::new(self.store().of_mirror_image()),
        }
    }

    fn encode(&self) -> Vec<u8> {
        let mut out = Encoder::default();
        encode_mesh(&mut out, &self.full_mesh);
        out.value(u8::from(self.input.is_some()));
        self.input.iter().for_each(|input| encode_mesh(&mut out, input));
        out.slice(self.warnings.as_bytes());
        let WayBack { input_of_full, full_of_input, followers, .. } = &self.way_back;
        out.slice(input_of_full).slice(full_of_input).slice(followers);
        let decimated = self.decimated.as_ref().zip(self.way_back.full_of_work.as_ref());
        out.value(u8::from(decimated.is_some()));
        if let Some((mesh, injection)) = decimated {
            encode_mesh(&mut out, mesh);
            out.slice(injection);
        }
        out.finish()
    }

    fn decode(name: &str, options: &ShapeOptions, key: CacheKey, bytes: &[u8]) -> Option<Self> {
        let mut input = Decoder::new(bytes);
        let full_mesh = decode_mesh(&mut input)?;
        let as_read = match input.value::<u8>()? {
            0 => None,
            _ => Some(decode_mesh(&mut input)?),
        };
        let warnings = String::from_utf8(input.slice()?).ok()?;
        let (input_of_full, full_of_input, followers) = (input.slice()?, input.slice()?, input.slice()?);
        let (mut decimated, mut full_of_work) = (None, None);
        if input.value::<u8>()? != 0 {
            decimated = Some(decode_mesh(&mut input)?);
            full_of_work = Some(input.slice()?);
        }
        let way_back = WayBack { input_of_full, full_of_input, followers, full_of_work };
        let n_input = as_read.as_ref().unwrap_or(&full_mesh).n_vertices();
        let fits = way_back.fits(&full_mesh, decimated.as_ref()) && way_back.full_of_input.len() == n_input;
        let meshes = Meshes { full_mesh, decimated, input: as_read, warnings };
        fits.then(|| Self::assemble(name, options, key, meshes, way_back))
    }
}

/// The meshes of a shape, as its fields of the same names.
struct Meshes {
    full_mesh: Mesh,
    decimated: Option<Mesh>,
    input: Option<Mesh>,
    warnings: String,
}

fn mesh_key(mesh: &Mesh, options: &ShapeOptions) -> CacheKey {
    let options = serde_json::to_vec(options).unwrap_or_default();
    CacheKey::of(&[
        bytemuck::cast_slice(mesh.vertices()),
        bytemuck::cast_slice(mesh.faces()),
        &options,
        &MESH_VERSION.to_le_bytes(),
    ])
}

fn encode_mesh(out: &mut Encoder, mesh: &Mesh) {
    out.slice(mesh.vertices()).slice(mesh.faces());
}

fn decode_mesh(input: &mut Decoder) -> Option<Mesh> {
    Mesh::new(input.slice()?, input.slice()?).ok()
}

#[cfg(test)]
mod tests;
