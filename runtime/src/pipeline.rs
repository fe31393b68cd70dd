//! The order of the stages at deployment: two meshes in, a dense map out.
//!
//! ```text
//! each shape:  repair -> decimate -> eigenbasis -> SHOT            (Shape::process)
//!              -> descriptor network                               (Matcher::describe)
//! a pair:      functional map -> point map -> refine -> upscale    (Matcher::match_shapes)
//!              -> the map in the input's vertices
//! ```
//!
//! Refinement comes before upscaling: it needs many iterations, which are cheap on the decimated shapes.

use crate::cache::{Cache, CacheKey, Decoder, Encoder};
use crate::descriptor::ShotOptions;
use crate::error::Error;
use crate::events::{Event, Observer, timed};
use crate::fmap::{BothMaps, FmapInfo, FmapSolver, functional_maps};
use crate::memory;
use crate::network::{Backend, DescriptorNetwork};
use crate::point_map::PointMap;
use crate::refine::{
    IcpOptions, PmfHints, PmfInfo, PmfOptions, WaveletOptions, ZoomOutOptions, icp, pmf, wavelet, zoomout,
};
use crate::shape::{Shape, ShapeOptions};
use crate::spectral::{EigenOptions, Eigenbasis, Laplacian, eigenbasis};
use crate::upscale::{
    AdmmInfo, AdmmOptions, delta_coefficients, full_point_map, l21_functional_map,
    least_squares_functional_map,
};
use crate::{Matrix, Mesh};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The pointwise descriptors that the functional map is computed from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum DescriptorKind {
    /// SHOT through the network of a model.
    #[default]
    Learned,
    /// SHOT itself: the paper's baseline.
    Shot,
}

/// What happens to the map of the working meshes before it is upscaled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Refinement {
    /// Nothing: the raw map.
    None,
    /// Spectral ICP (Ovsjanikov et al. 2012).
    Icp,
    /// ZoomOut (Melzi et al. 2019).
    #[default]
    Zoomout,
    /// The wavelet filter, coarse to fine, in both directions (Hu, Li, Liu et al. 2021); for whole shapes only.
    Wavelet,
    /// ZoomOut, then the product manifold filter (Vestner et al. 2017) with SHOT, which takes longer: one-to-one between
    /// meshes of equally many vertices, injective where the source has fewer.
    #[serde(alias = "pmf-geometry")]
    #[value(alias = "pmf-geometry")]
    Pmf,
    /// The product manifold filter, then along the triangulation, where both meshes turn out to have the same, as
    /// registrations of one template do: the map then is exact, whatever the shapes.
    SharedTriangulation,
}

/// How the map of decimated meshes becomes one of the full meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Upscaling {
    /// The robust l2,1 problem of the paper.
    #[default]
    L21,
    /// Plain least squares, which wrong matches bend.
    LeastSquares,
}

/// Which model computes the descriptors.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ModelSource {
    /// The model built into the library.
    #[default]
    Embedded,
    /// A model file.
    File(PathBuf),
}

/// Settings of a [`Matcher`]. What is `None` comes from the model, or without one from the paper.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MatchOptions {
    /// Learned descriptors, which are the default, or SHOT.
    pub descriptor: DescriptorKind,
    /// The model, for learned descriptors. Default: the one that is built in.
    pub model: ModelSource,
    /// What computes the network. Default: tract.
    pub backend: Backend,
    /// Number of eigenfunctions of the functional map, from 1 to what [`eigenbasis`] gives of the working meshes. Default:
    /// the model's; 120 for SHOT.
    pub k: Option<usize>,
    /// Solver of the functional map. Default: what suits the model, [`FmapSolver::for_matching`]; least squares for SHOT;
    /// [`FmapSolver::Part`] for a part and its whole.
    pub solver: Option<FmapSolver>,
    /// SHOT radius relative to sqrt(area), above 0. Default: the model's; that of [`ShotOptions`] for SHOT.
    pub shot_radius: Option<f64>,
    /// Meshes of more vertices are decimated to so many, 4 or more; `Some(None)`: never. Default: the model's; 15000 for
    /// SHOT.
    pub decimate: Option<Option<usize>>,
    /// Refinement. Default: ZoomOut for learned descriptors, none for SHOT.
    pub refinement: Option<Refinement>,
    /// Upscaling of the map of decimated meshes. Default: the l2,1 problem.
    pub upscaling: Upscaling,
    /// Folder of results kept for each shape; `None`, the default: nothing is kept.
    pub cache: Option<PathBuf>,
}

/// Eigenfunctions that ZoomOut and the wavelet filter go up to and the product manifold filter takes; 500 in the latter gained nothing.
const REFINED_K: usize = 200;
/// Eigenfunctions of the full meshes in upscaling.
const UPSCALE_K: usize = 100;

/// The model that is built into the library.
const EMBEDDED_MODEL: &[u8] = include_bytes!("../../models/bodies/model.onnx");

/// A shape with its descriptors.
#[derive(Clone, Debug, PartialEq)]
pub struct DescribedShape {
    /// The processed shape.
    pub shape: Shape,
    /// Descriptors of its working mesh, `[n, 352]`.
    pub descriptors: Matrix<f32>,
    key: CacheKey,
}

/// The result for a pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Match {
    /// Target vertex of each source vertex, in the inputs' vertices, `[n_input]` of the source; those that repair dropped are
    /// unmatched.
    pub map: PointMap,
    /// The functional map of the working meshes, `[k, k]` (target x source), before refinement; between bases at unit area
    /// ([`Shape::unit_basis`]).
    pub functional_map: Matrix,
    /// How its solution went.
    pub functional_map_info: FmapInfo,
    /// How the product manifold filter went, where it ran.
    pub pmf_info: Option<PmfInfo>,
    /// How the upscaling went, where there was one.
    pub upscale_info: Option<AdmmInfo>,
}

/// Matches shapes; loads the model once.
#[derive(Debug)]
pub struct Matcher {
    shape_options: ShapeOptions,
    k: usize,
    /// Of whole shapes, and of a part and its whole.
    solver: FmapSolver,
    part_solver: FmapSolver,
    refinement: Refinement,
    upscaling: Upscaling,
    network: Option<DescriptorNetwork>,
    cache: Option<Cache>,
}

impl Matcher {
    /// Loads the model and settles every option.
    ///
    /// # Errors
    /// If the model cannot be read or breaks its contract, this build lacks the back-end, or the cache's folder cannot be
    /// made.
    pub fn new(options: &MatchOptions) -> Result<Self, Error> {
        let network = match (options.descriptor, &options.model) {
            (DescriptorKind::Shot, _) => None,
            (_, ModelSource::File(path)) => Some(DescriptorNetwork::load(path, options.backend)?),
            (_, ModelSource::Embedded) => Some(DescriptorNetwork::from_bytes(
                Path::new("embedded model"),
                EMBEDDED_MODEL,
                options.backend,
            )?),
        };
        let mut shape_options = network.as_ref().map_or_else(ShapeOptions::default, |n| {
            let metadata = n.metadata();
            ShapeOptions { decimate: metadata.decimate, k: metadata.k, shot: metadata.shot, whole_area: None }
        });
        let model_k = shape_options.k;
        let k = options.k.unwrap_or(model_k);
        if let Some(radius) = options.shot_radius {
            shape_options.shot = ShotOptions { radius, ..shape_options.shot };
        }
        shape_options.decimate = options.decimate.unwrap_or(shape_options.decimate);
        let default_refinement = if network.is_some() { Refinement::Zoomout } else { Refinement::None };
        let refinement = options.refinement.unwrap_or(default_refinement);
        shape_options.k = match refinement {
            Refinement::None | Refinement::Icp => k,
            Refinement::Zoomout | Refinement::Wavelet | Refinement::Pmf | Refinement::SharedTriangulation => {
                k.max(REFINED_K)
            }
        };
        let default_solver =
            network.as_ref().map_or(FmapSolver::LeastSquares, |n| n.metadata().solver.for_matching());
        Ok(Self {
            shape_options,
            k,
            solver: options.solver.unwrap_or(default_solver),
            part_solver: FmapSolver::for_part(options.solver),
            refinement,
            upscaling: options.upscaling,
            network,
            cache: options.cache.as_deref().map(Cache::open).transpose()?,
        })
    }

    /// The settings that shapes are processed with; small meshes get fewer eigenfunctions for refinement than its `k` says.
    pub fn shape_options(&self) -> &ShapeOptions {
        &self.shape_options
    }

    /// Number of eigenfunctions of the functional map.
    pub fn k(&self) -> usize {
        self.k
    }

    /// The model, unless descriptors are SHOT.
    pub fn network(&self) -> Option<&DescriptorNetwork> {
        self.network.as_ref()
    }

    /// Processes a shape and computes its descriptors; `name` is for messages.
    ///
    /// # Errors
    /// If the mesh has no surface left after repair, is too small for `k` eigenfunctions or too large for the memory, if the
    /// radius is out of range, the network fails, or the cache cannot be written; it names the shape.
    pub fn describe(&self, name: &str, mesh: &Mesh, observer: Observer) -> Result<DescribedShape, Error> {
        self.describe_by(&self.options_for(mesh), name, mesh, observer)
    }

    /// As [`Matcher::describe`], for a part of a shape in the unit of the whole: `whole_area` is the area of that, in
    /// squared units of the mesh, above 0. A part may be the source of a map to the whole, in whatever pose, and is matched
    /// as a part.
    ///
    /// # Errors
    /// As [`Matcher::describe`], and if `whole_area` is out of range.
    pub fn describe_part(
        &self,
        name: &str,
        mesh: &Mesh,
        whole_area: f64,
        observer: Observer,
    ) -> Result<DescribedShape, Error> {
        let options = ShapeOptions { whole_area: Some(whole_area), ..self.options_for(mesh) };
        self.describe_by(&options, name, mesh, observer)
    }

    fn describe_by(
        &self,
        options: &ShapeOptions,
        name: &str,
        mesh: &Mesh,
        observer: Observer,
    ) -> Result<DescribedShape, Error> {
        let in_shape = |e: Error| e.in_shape(name);
        let cache = self.cache.as_ref();
        let shape = Shape::process_cached(name, mesh, options, cache, observer).map_err(in_shape)?;
        let key = Shape::cache_key(mesh, options);
        let Some(network) = &self.network else {
            let descriptors = shape.shot.clone();
            return Ok(DescribedShape { shape, descriptors, key });
        };
        let network_key =
            CacheKey::of(&[key.as_bytes(), network.fingerprint(), network.backend().to_string().as_bytes()]);
        if let Some(descriptors) =
            cache.and_then(|cache| cached_matrix(cache, "descriptors", network_key, observer))
        {
            return Ok(DescribedShape { shape, descriptors, key });
        }
        let descriptors =
            timed(observer, name, "network", || network.descriptors(shape.n(), &[shape.shot.data()]))
                .map_err(|e| in_shape(e.into()))?;
        if let Some(cache) = cache {
            let mut out = Encoder::default();
            out.matrix(&descriptors);
            cache.put("descriptors", network_key, &out.finish()).map_err(|e| in_shape(e.into()))?;
        }
        Ok(DescribedShape { shape, descriptors, key })
    }

    /// Small meshes do not have so many eigenfunctions as refinement would like.
    fn options_for(&self, mesh: &Mesh) -> ShapeOptions {
        let n = self.shape_options.decimate.map_or(mesh.n_vertices(), |most| mesh.n_vertices().min(most));
        let available = (n / 4).max(self.k);
        ShapeOptions { k: self.shape_options.k.min(available), ..self.shape_options.clone() }
    }

    /// Computes the map of a pair, from the source to the target; that of a part to its whole where the source was
    /// described as one.
    ///
    /// # Errors
    /// If a shape was described with fewer eigenfunctions than [`Matcher::k`], by another matcher, the descriptors are not
    /// finite, a stage would take more memory than there is, the refinement fails, or the matches are too few to be
    /// upscaled; it names the shape or the pair.
    pub fn match_shapes(
        &self,
        source: &DescribedShape,
        target: &DescribedShape,
        observer: Observer,
    ) -> Result<Match, Error> {
        for shape in [&source.shape, &target.shape] {
            if shape.basis.k() < self.k {
                let (found, expected) = (shape.basis.k(), self.k);
                return Err(Error::TooFewEigenpairs { found, expected }.in_shape(&shape.name));
            }
        }
        let pair = format!("{} -> {}", source.shape.name, target.shape.name);
        self.match_pair(source, target, &pair, observer).map_err(|e| e.in_shape(&pair))
    }

    fn match_pair(
        &self,
        source: &DescribedShape,
        target: &DescribedShape,
        pair: &str,
        observer: Observer,
    ) -> Result<Match, Error> {
        let (basis_source, basis_target) = (source.shape.unit_basis(self.k), target.shape.unit_basis(self.k));
        let solver = if source.shape.whole_area.is_some() { self.part_solver } else { self.solver };
        let (maps, functional_map_info) = timed(observer, pair, "functional map", || {
            let (f, g) =
                (basis_source.project(&source.descriptors), basis_target.project(&target.descriptors));
            functional_maps(&basis_source, &basis_target, &f, &g, solver)
        })?;
        if functional_map_info.rank < self.k {
            observer(Event::Warning(format!(
                "{pair}: the descriptors determine only {} of {} dimensions of the functional map",
                functional_map_info.rank, self.k
            )));
        }
        let is_joint = matches!(solver, FmapSolver::Joint { .. }) || self.refinement == Refinement::Wavelet;
        let width = basis_target.k().max(self.shape_options.k) * if is_joint { 2 } else { 1 };
        let needed = memory::search_bytes(source.shape.n(), target.shape.n(), width);
        let reserved = memory::reserve("the search for nearest neighbours", needed, memory::DECIMATE)?;
        let raw = timed(observer, pair, "point map", || {
            maps.point_map(solver.comparison(), &basis_source, &basis_target)
        })?;
        let (map, pmf_info) = self.refine(source, target, &maps, solver, raw, pair, observer)?;
        drop(reserved);
        let (map, upscale_info) = self.upscale(source, target, map, pair, observer)?;
        let map = in_input_vertices(&source.shape, &target.shape, &map);
        Ok(Match { map, functional_map: maps.forth, functional_map_info, pmf_info, upscale_info })
    }

    fn refine(
        &self,
        source: &DescribedShape,
        target: &DescribedShape,
        maps: &BothMaps,
        solver: FmapSolver,
        raw: PointMap,
        pair: &str,
        observer: Observer,
    ) -> Result<(PointMap, Option<PmfInfo>), Error> {
        let at_k = |described: &DescribedShape| described.shape.unit_basis(self.k);
        let whole = |described: &DescribedShape| described.shape.unit_basis(described.shape.basis.k());
        let zoomout_options =
            ZoomOutOptions { part: source.shape.whole_area.is_some(), ..ZoomOutOptions::default() };
        let by_zoomout = || {
            timed(observer, pair, "zoomout", || {
                zoomout(&raw, &whole(source), &whole(target), &zoomout_options)
            })
        };
        Ok(match self.refinement {
            Refinement::None => (raw, None),
            Refinement::Icp => {
                let refine = || icp(&maps.forth, &at_k(source), &at_k(target), &IcpOptions::default());
                (timed(observer, pair, "icp", refine)?.map, None)
            }
            Refinement::Zoomout => (by_zoomout()?.map, None),
            Refinement::Wavelet => {
                let (basis_source, basis_target) = (whole(source), whole(target));
                let options = WaveletOptions {
                    part: source.shape.whole_area.is_some(),
                    ..WaveletOptions::between(self.k, basis_source.k().min(basis_target.k()))
                };
                let refine = || -> Result<PointMap, Error> {
                    let back = maps.clone().reversed();
                    let back = back.point_map(solver.comparison(), &at_k(target), &at_k(source))?;
                    Ok(wavelet([&raw, &back], &basis_source, &basis_target, &options)?.map)
                };
                (timed(observer, pair, "wavelet", refine)?, None)
            }
            Refinement::Pmf | Refinement::SharedTriangulation => {
                let start = by_zoomout()?.map;
                let meshes = [source.shape.mesh(), target.shape.mesh()];
                // SHOT tells neighbouring vertices apart; learned descriptors only have to span the right functions.
                let hints = PmfHints {
                    descriptors: Some([&source.shape.shot, &target.shape.shot]),
                    meshes: (self.refinement == Refinement::SharedTriangulation).then_some(meshes),
                };
                let (basis_source, basis_target) = (whole(source), whole(target));
                let filtered = timed(observer, pair, "pmf", || {
                    pmf(&start, &basis_source, &basis_target, hints, &PmfOptions::default())
                })?;
                if self.refinement == Refinement::SharedTriangulation && filtered.info.edges_kept.is_none() {
                    observer(Event::Warning(format!(
                        "{pair}: the meshes are not triangulated alike; the map is that of the product manifold filter"
                    )));
                }
                (filtered.map, Some(filtered.info))
            }
        })
    }

    /// From the working meshes to the full ones, where they differ.
    fn upscale(
        &self,
        source: &DescribedShape,
        target: &DescribedShape,
        map: PointMap,
        pair: &str,
        observer: Observer,
    ) -> Result<(PointMap, Option<AdmmInfo>), Error> {
        if source.shape.decimated.is_none() && target.shape.decimated.is_none() {
            return Ok((map, None));
        }
        let full_source = self.full_basis(source, observer)?;
        let full_target = self.full_basis(target, observer)?;
        let matches: Vec<(u32, u32)> = (0..map.len())
            .filter_map(|i| {
                Some((source.shape.full_of_work(i as u32), target.shape.full_of_work(map.get(i)?)))
            })
            .collect();
        let (phi, psi) = delta_coefficients(&full_source, &full_target, &matches);
        let (full_map, info) = timed(observer, pair, "upscale", || match self.upscaling {
            Upscaling::L21 => {
                l21_functional_map(&phi, &psi, &AdmmOptions::default()).map(|(c, info)| (c, Some(info)))
            }
            Upscaling::LeastSquares => least_squares_functional_map(&phi, &psi).map(|c| (c, None)),
        })?;
        let map = timed(observer, pair, "full point map", || {
            let vertices = source.shape.full_mesh.vertices();
            full_point_map(&full_map, &full_source, &full_target, vertices, &matches)
        })?;
        Ok((map, info))
    }

    /// The eigenbasis of the full mesh at unit area, `[n_full, UPSCALE_K]`.
    fn full_basis(&self, described: &DescribedShape, observer: Observer) -> Result<Eigenbasis, Error> {
        let shape = &described.shape;
        if shape.decimated.is_none() {
            return Ok(shape.basis.at_unit_area(UPSCALE_K.min(shape.basis.k())));
        }
        let key = CacheKey::of(&[described.key.as_bytes(), &UPSCALE_K.to_le_bytes()]);
        if let Some(basis) = self.cache.as_ref().and_then(|cache| cached_basis(cache, key, observer)) {
            return Ok(basis.at_unit_area(basis.k()));
        }
        let needed = memory::eigenbasis_bytes(shape.full_mesh.n_vertices(), UPSCALE_K);
        let _reserved = memory::reserve("the eigenbasis of the full mesh", needed, memory::FULL)
            .map_err(|e| Error::from(e).in_shape(&shape.name))?;
        let (basis, _) = timed(observer, &shape.name, "full eigenbasis", || {
            eigenbasis(&Laplacian::new(&shape.full_mesh), UPSCALE_K, &EigenOptions::default())
        })
        .map_err(|e| Error::from(e).in_shape(&shape.name))?;
        if let Some(cache) = &self.cache {
            let mut out = Encoder::default();
            out.slice(&basis.eigenvalues).slice(&basis.mass).matrix(&basis.eigenvectors);
            cache.put("full-basis", key, &out.finish())?;
        }
        Ok(basis.at_unit_area(basis.k()))
    }
}

/// Matches two meshes with the given options: one pair, everything computed anew.
///
/// # Errors
/// As [`Matcher::new`], [`Matcher::describe`] and [`Matcher::match_shapes`].
pub fn match_meshes(source: &Mesh, target: &Mesh, options: &MatchOptions) -> Result<Match, Error> {
    let matcher = Matcher::new(options)?;
    let observer: Observer = &crate::events::ignore;
    let source = matcher.describe("source", source, observer)?;
    let target = matcher.describe("target", target, observer)?;
    matcher.match_shapes(&source, &target, observer)
}

/// Takes a map of the full repaired meshes to the vertices of the input meshes.
fn in_input_vertices(source: &Shape, target: &Shape, map: &PointMap) -> PointMap {
    let full: Vec<Option<usize>> =
        source.full_of_input.iter().map(|&v| (v != Shape::NONE).then_some(v as usize)).collect();
    let target_of = |v: &Option<usize>| {
        v.and_then(|v| map.get(v)).map_or(PointMap::UNMATCHED, |t| target.input_of_full[t as usize])
    };
    let confidence =
        map.confidence.as_ref().map(|values| full.iter().map(|v| v.map_or(0.0, |v| values[v])).collect());
    PointMap { targets: full.iter().map(target_of).collect(), confidence, n_target: target.n_input }
}

fn cached_matrix(cache: &Cache, kind: &str, key: CacheKey, observer: Observer) -> Option<Matrix<f32>> {
    Decoder::new(&cache.fetch(kind, key, observer)?).matrix()
}

fn cached_basis(cache: &Cache, key: CacheKey, observer: Observer) -> Option<Eigenbasis> {
    let bytes = cache.fetch("full-basis", key, observer)?;
    let mut input = Decoder::new(&bytes);
    Some(Eigenbasis { eigenvalues: input.slice()?, mass: input.slice()?, eigenvectors: input.matrix()? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::ignore;
    use crate::mesh::shapes::bumpy_sphere;

    fn matcher(k: usize) -> Matcher {
        let (descriptor, k) = (DescriptorKind::Shot, Some(k));
        Matcher::new(&MatchOptions { descriptor, k, ..MatchOptions::default() }).unwrap()
    }

    #[test]
    fn errors_of_a_pair_name_what_they_are_of() {
        let (mesh, matcher, other) = (bumpy_sphere(2, 1), matcher(20), matcher(10));
        let good = matcher.describe("good", &mesh, &ignore).unwrap();
        let few = other.describe("few", &mesh, &ignore).unwrap();
        for (source, target) in [(&good, &few), (&few, &good)] {
            let error = matcher.match_shapes(source, target, &ignore).unwrap_err().to_string();
            assert!(
                error.starts_with("few: described with 10 eigenpairs, but the matcher takes 20; "),
                "{error}"
            );
        }
        other.match_shapes(&good, &few, &ignore).unwrap();
        let mut wrong = good.clone();
        wrong.descriptors.data_mut()[0] = f32::NAN;
        let error = matcher.match_shapes(&good, &wrong, &ignore).unwrap_err().to_string();
        assert!(error.starts_with("good -> good: row "), "{error}");
        let error = matcher.describe("tiny", &bumpy_sphere(0, 1), &ignore).unwrap_err().to_string();
        assert!(error.starts_with("tiny: 20 eigenpairs"), "{error}");
    }
}
