//! One shape, from the mesh as read to everything the matching needs of it.
//!
//! `repair -> decimate -> Laplacian -> eigenbasis -> SHOT`, in [`Shape::process`]. A shape keeps the index maps back to
//! the input, so that every result can be given in the input's vertices.

use crate::cache::{Cache, CacheKey, Decoder, Encoder};
use crate::descriptor::{ShotOptions, shot};
use crate::error::Error;
use crate::events::{Event, Observer, timed};
use crate::memory;
use crate::mesh::{DecimateOptions, RepairOptions, decimate, repair};
use crate::spectral::{EigenOptions, Eigenbasis, Laplacian, eigenbasis};
use crate::{Matrix, Mesh};
use serde::{Deserialize, Serialize};

/// Settings of [`Shape::process`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShapeOptions {
    /// Meshes of more vertices than this are decimated to it; 4 or more, `None`: never. Default 15000, as in the paper.
    pub decimate: Option<usize>,
    /// Number of eigenpairs. From 1 to what [`eigenbasis`] gives of the mesh, a sixth of its vertices at least; default 120.
    pub k: usize,
    /// Settings of the SHOT descriptor.
    pub shot: ShotOptions,
    /// For a part of a shape: the area of the whole, in squared units of the mesh, above 0. The SHOT radius is then relative
    /// to it, and so is [`Shape::unit_basis`]. `None`: the shape is whole. Default `None`.
    pub whole_area: Option<f64>,
}

impl Default for ShapeOptions {
    fn default() -> Self {
        Self { decimate: Some(15_000), k: 120, shot: ShotOptions::default(), whole_area: None }
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

/// A repaired, possibly decimated shape with its eigenbasis and SHOT descriptors.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Name for messages: the file's name, or what the caller chose.
    pub name: String,
    /// Number of vertices of the input mesh.
    pub n_input: usize,
    /// The repaired mesh at full resolution, `[n_full]` vertices.
    pub full_mesh: Mesh,
    /// Input vertex of each vertex of `full_mesh`, `[n_full]`.
    pub input_of_full: Vec<u32>,
    /// For each input vertex its vertex in `full_mesh`, [`Shape::NONE`] where repair dropped it, `[n_input]`.
    pub full_of_input: Vec<u32>,
    /// The decimated mesh and, for each of its vertices, the vertex of `full_mesh`, `[n]`; absent for small meshes.
    pub decimated: Option<(Mesh, Vec<u32>)>,
    /// Eigenbasis of the working mesh, `[n, k]`, in the mesh's own unit.
    pub basis: Eigenbasis,
    /// SHOT descriptors of the working mesh, `[n, 32 (bins + 1)]`: `[n, 352]` by default.
    pub shot: Matrix<f32>,
    /// For a part of a shape, the area of the whole ([`ShapeOptions::whole_area`]), in squared units of the mesh.
    pub whole_area: Option<f64>,
}

impl Shape {
    /// Stands in index maps for "no such vertex".
    pub const NONE: u32 = u32::MAX;

    /// Runs every stage on a mesh as read.
    ///
    /// # Errors
    /// If repair leaves no face, the area of the whole, the decimation target or the SHOT radius is out of range, the
    /// eigenbasis cannot be computed or would take more memory than there is; it names the shape.
    pub fn process(
        name: &str,
        mesh: &Mesh,
        options: &ShapeOptions,
        observer: Observer,
    ) -> Result<Self, Error> {
        let in_shape = |e: Error| e.in_shape(name);
        options.check().map_err(in_shape)?;
        let repaired = timed(observer, name, "repair", || repair(mesh, &RepairOptions::default()))
            .map_err(|e| in_shape(e.into()))?;
        let full_mesh = repaired.mesh;
        let decimated = match options.decimate {
            Some(target) if full_mesh.n_vertices() > target => {
                let result = timed(observer, name, "decimate", || {
                    decimate(&full_mesh, target, &DecimateOptions::default())
                })
                .map_err(|e| in_shape(e.into()))?;
                Some((result.mesh, result.injection))
            }
            _ => None,
        };
        let work = decimated.as_ref().map_or(&full_mesh, |(mesh, _)| mesh);
        let (n, k) = (work.n_vertices(), options.k);
        let needed = memory::eigenbasis_bytes(n, k).max(memory::descriptor_bytes(n, k));
        let reserved =
            memory::reserve("the eigenbasis", needed, memory::DECIMATE).map_err(|e| in_shape(e.into()))?;
        let (basis, _) = timed(observer, name, "eigenbasis", || {
            eigenbasis(&Laplacian::new(work), options.k, &EigenOptions::default())
        })
        .map_err(|e| in_shape(e.into()))?;
        let relative_scale = options.whole_area.map_or(1.0, |whole| (whole / work.area()).sqrt());
        let shot_options = ShotOptions { radius: options.shot.radius * relative_scale, ..options.shot };
        let (shot, info) =
            timed(observer, name, "shot", || shot(work, &shot_options)).map_err(|e| in_shape(e.into()))?;
        drop(reserved);
        if info.zero_rows > work.n_vertices() / 10 {
            observer(Event::Warning(format!(
                "{name}: {} of {} vertices have too few neighbours for a descriptor; a larger SHOT radius may help",
                info.zero_rows,
                work.n_vertices()
            )));
        }
        Ok(Self {
            name: name.to_string(),
            n_input: mesh.n_vertices(),
            input_of_full: repaired.input_of_repaired,
            full_of_input: repaired.repaired_of_input.iter().map(|v| v.unwrap_or(Self::NONE)).collect(),
            full_mesh,
            decimated,
            basis,
            shot,
            whole_area: options.whole_area,
        })
    }

    /// As [`Shape::process`], but looks into the cache first and leaves the result there.
    ///
    /// # Errors
    /// As [`Shape::process`], and if the cache cannot be written.
    pub fn process_cached(
        name: &str,
        mesh: &Mesh,
        options: &ShapeOptions,
        cache: Option<&Cache>,
        observer: Observer,
    ) -> Result<Self, Error> {
        options.check().map_err(|e| e.in_shape(name))?;
        let Some(cache) = cache else { return Self::process(name, mesh, options, observer) };
        let key = Self::cache_key(mesh, options);
        let found = timed(observer, name, "cache", || cache.fetch("shape", key, observer));
        if let Some(shape) = found.and_then(|bytes| Self::decode(name, &bytes)) {
            return Ok(shape);
        }
        let shape = Self::process(name, mesh, options, observer)?;
        cache.put("shape", key, &shape.encode())?;
        Ok(shape)
    }

    /// The key of a shape: the mesh's content, the options and the version of the library.
    pub fn cache_key(mesh: &Mesh, options: &ShapeOptions) -> CacheKey {
        let options = serde_json::to_vec(options).expect("plain data serialises");
        CacheKey::of(&[
            bytemuck::cast_slice(mesh.vertices()),
            bytemuck::cast_slice(mesh.faces()),
            &options,
            env!("CARGO_PKG_VERSION").as_bytes(),
        ])
    }

    /// The mesh that basis and descriptors live on: the decimated one, or the full one.
    pub fn mesh(&self) -> &Mesh {
        self.decimated.as_ref().map_or(&self.full_mesh, |(mesh, _)| mesh)
    }

    /// Number of vertices `n` of the working mesh.
    pub fn n(&self) -> usize {
        self.mesh().n_vertices()
    }

    /// The first `k` eigenpairs where the area of the shape, or of the whole that it is a part of, counts as 1.
    ///
    /// # Panics
    /// If the shape has fewer than `k` eigenpairs.
    pub fn unit_basis(&self, k: usize) -> Eigenbasis {
        self.basis.in_unit(self.whole_area.unwrap_or_else(|| self.basis.area()), k)
    }

    /// Vertex of `full_mesh` of a vertex of the working mesh.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn full_of_work(&self, vertex: u32) -> u32 {
        self.decimated.as_ref().map_or(vertex, |(_, injection)| injection[vertex as usize])
    }

    /// For each input vertex its vertex of the working mesh, [`Shape::NONE`] where it has none, `[n_input]`.
    pub fn work_of_input(&self) -> Vec<u32> {
        let Some((_, injection)) = &self.decimated else { return self.full_of_input.clone() };
        let mut work_of_full = vec![Self::NONE; self.full_mesh.n_vertices()];
        for (work, &full) in injection.iter().enumerate() {
            work_of_full[full as usize] = work as u32;
        }
        let work_of = |&full: &u32| work_of_full.get(full as usize).copied().unwrap_or(Self::NONE);
        self.full_of_input.iter().map(work_of).collect()
    }

    fn encode(&self) -> Vec<u8> {
        let mut out = Encoder::default();
        out.value(self.n_input as u64);
        encode_mesh(&mut out, &self.full_mesh);
        out.slice(&self.input_of_full).slice(&self.full_of_input);
        out.value(u8::from(self.decimated.is_some()));
        if let Some((mesh, injection)) = &self.decimated {
            encode_mesh(&mut out, mesh);
            out.slice(injection);
        }
        out.slice(&self.basis.eigenvalues).matrix(&self.basis.eigenvectors).slice(&self.basis.mass);
        out.matrix(&self.shot).value(self.whole_area.unwrap_or(f64::NAN));
        out.finish()
    }

    fn decode(name: &str, bytes: &[u8]) -> Option<Self> {
        let mut input = Decoder::new(bytes);
        let n_input = usize::try_from(input.value::<u64>()?).ok()?;
        let full_mesh = decode_mesh(&mut input)?;
        let (input_of_full, full_of_input) = (input.slice()?, input.slice()?);
        let decimated = match input.value::<u8>()? {
            0 => None,
            _ => Some((decode_mesh(&mut input)?, input.slice()?)),
        };
        let basis =
            Eigenbasis { eigenvalues: input.slice()?, eigenvectors: input.matrix()?, mass: input.slice()? };
        let shot = input.matrix()?;
        let whole_area = Some(input.value::<f64>()?).filter(|area| area.is_finite());
        let name = name.to_string();
        Some(Self {
            name,
            n_input,
            full_mesh,
            input_of_full,
            full_of_input,
            decimated,
            basis,
            shot,
            whole_area,
        })
    }
}

fn encode_mesh(out: &mut Encoder, mesh: &Mesh) {
    out.slice(mesh.vertices()).slice(mesh.faces());
}

fn decode_mesh(input: &mut Decoder) -> Option<Mesh> {
    Mesh::new(input.slice()?, input.slice()?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::ignore;
    use crate::mesh::shapes::icosphere;

    #[test]
    fn the_area_of_a_whole_is_checked_before_any_work() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::open(folder.path()).unwrap();
        let whole = ShapeOptions { k: 5, ..ShapeOptions::default() };
        Shape::process_cached("whole", &icosphere(2), &whole, Some(&cache), &ignore).unwrap();
        let silent: Observer = &|_| panic!("no stage may run");
        for area in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let options = ShapeOptions { whole_area: Some(area), ..whole.clone() };
            for cache in [None, Some(&cache)] {
                let error =
                    Shape::process_cached("part", &icosphere(2), &options, cache, silent).unwrap_err();
                let message = error.to_string();
                assert!(message.starts_with("part: whole_area is "), "{message}");
            }
        }
    }
}
