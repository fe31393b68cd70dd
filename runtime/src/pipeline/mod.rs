//! The order of the stages at deployment: two meshes in, a dense map out.
//!
//! ```text
//! each shape:  repair -> subdivide or decimate                             (Shape::new)
//!              -> quantities that the descriptor asks for -> descriptor    (Matcher::describe)
//! a pair:      functional maps -> point maps -> refine -> judge            (Matcher::match_shapes)
//!              -> other candidates, where the map is doubtful
//!              -> points on the target's surface -> the inputs' vertices
//! ```
//!
//! All is done on the decimated shapes; only the last step sees the full ones.

mod adapt;
mod candidates;
mod describe_pair;
mod described;
mod descriptor;
mod finish;
mod judge;
mod landmarks;
mod options;
mod other_side;
mod pair;
mod part_size;
mod refine;

use crate::cache::{Cache, CacheKey};
use crate::descriptor::ShotOptions;
use crate::error::Error;
use crate::events::{Event, Observer};
use crate::fmap::{FmapInfo, FmapSolver};
use crate::network::DescriptorNetwork;
use crate::point_map::PointMap;
use crate::quality::{Calibration, Estimate, Quality, SPECTRAL_K};
use crate::refine::PmfInfo;
use crate::shape::{Context, Shape, ShapeOptions};
use crate::upscale::AdmmInfo;
use crate::{Matrix, Mesh};
use pair::Pair;
use std::path::Path;
use std::sync::OnceLock;

pub use candidates::Candidate;
pub use describe_pair::Named;
pub use described::DescribedShape;
pub use descriptor::{Descriptor, NetworkDescriptor};
pub use landmarks::LandmarkError;
pub use options::{DescriptorKind, Effort, MatchOptions, ModelSource, Refinement, Resize, Upscaling};

/// Eigenfunctions of the functional map of SHOT descriptors, as in the paper.
const SHOT_K: usize = 120;
/// Meshes of fewer vertices than this are subdivided.
const SPARSE: usize = 2000;
/// The model that is built into the library; `model.onnx` is a link to that of `models/bodies`, which packages follow.
const EMBEDDED_MODEL: &[u8] = include_bytes!("../../model.onnx");
const _: () = assert!(
    EMBEDDED_MODEL.len() > 1000,
    "runtime/model.onnx is no link here: copy models/bodies/model.onnx to it"
);

/// The result for a pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Match {
    /// Target vertex of each source vertex, in the inputs' vertices, `[n_input]` of the source, and its point on the
    /// target's surface; vertices of no face are unmatched. The confidence is what [`crate::quality::doubt`] leaves.
    pub map: PointMap,
    /// The functional map of the working meshes, `[k, k]` (target x source), before refinement; between bases at unit
    /// area ([`Shape::unit_basis`]).
    pub functional_map: Matrix,
    /// How its solution went.
    pub functional_map_info: FmapInfo,
    /// How the product manifold filter went, where it ran.
    pub pmf_info: Option<PmfInfo>,
    /// How the upscaling by a functional map went, where there was one.
    pub upscale_info: Option<AdmmInfo>,
    /// Measures of the map of the working meshes, without ground truth.
    pub quality: Quality,
    /// What they say of its error.
    pub estimate: Estimate,
    /// The ways to a map that were tried.
    pub candidates: Vec<Candidate>,
}

/// Matches shapes; loads the model once.
#[derive(Debug)]
pub struct Matcher {
    shape_options: ShapeOptions,
    /// Eigenfunctions of the functional map.
    k: usize,
    /// Of whole shapes, and of a part and its whole.
    solver: FmapSolver,
    part_solver: FmapSolver,
    /// What was asked for; `None`: what suits the solver.
    refinement: Option<Refinement>,
    upscaling: Upscaling,
    effort: Effort,
    adapt: Option<usize>,
    calibration: Calibration,
    shot: ShotOptions,
    network: Option<NetworkDescriptor>,
    /// What describes shapes where there is no network.
    plain: Box<dyn Descriptor>,
    cache: Option<Cache>,
}

impl Matcher {
    /// Loads the model and settles every option.
    ///
    /// # Errors
    /// If the model cannot be read or breaks its contract, this build lacks the back-end, or the cache's folder
    /// cannot be made.
    pub fn new(options: &MatchOptions) -> Result<Self, Error> {
        let network = match (options.descriptor, &options.model) {
            (DescriptorKind::Learned, ModelSource::File(path)) => {
                Some(DescriptorNetwork::load(path, options.backend)?)
            }
            (DescriptorKind::Learned, ModelSource::Embedded) => Some(DescriptorNetwork::from_bytes(
                Path::new("embedded model"),
                EMBEDDED_MODEL,
                options.backend,
            )?),
            (DescriptorKind::Shot, _) => None,
        };
        let metadata = network.as_ref().map(DescriptorNetwork::metadata);
        let mut shot = metadata.map_or_else(ShotOptions::default, |m| m.shot);
        shot.radius = options.shot_radius.unwrap_or(shot.radius);
        let default_decimate = metadata.map_or(ShapeOptions::default().decimate, |m| m.decimate);
        let solver = metadata.map_or(FmapSolver::LeastSquares, |m| m.solver.for_matching());
        let k = options.k.unwrap_or_else(|| metadata.map_or(SHOT_K, |m| m.k));
        // Subdivided meshes would not be triangulated alike, nor would a bijection of theirs be one of the inputs'
        // vertices.
        let one_to_one =
            matches!(options.refinement, Some(Refinement::Pmf | Refinement::SharedTriangulation));
        let by_default = if network.is_some() { None } else { Some(Refinement::None) };
        Ok(Self {
            shape_options: ShapeOptions {
                decimate: options.decimate.or(default_decimate),
                subdivide: options.subdivide.or((!one_to_one).then_some(SPARSE)),
                whole_area: None,
            },
            k,
            solver: options.solver.unwrap_or(solver),
            part_solver: FmapSolver::for_part(options.solver, solver),
            refinement: options.refinement.or(by_default),
            upscaling: options.upscaling,
            effort: options.effort,
            adapt: options.adapt,
            calibration: metadata.and_then(|m| m.calibration).unwrap_or_default(),
            shot,
            plain: Box::new(shot),
            network: network.map(|network| NetworkDescriptor { network, shot }),
            cache: options.cache.as_deref().map(Cache::open).transpose()?,
        })
    }

    /// How shapes are repaired and decimated.
    pub fn shape_options(&self) -> &ShapeOptions {
        &self.shape_options
    }

    /// Settings of SHOT, where it is computed.
    pub fn shot_options(&self) -> &ShotOptions {
        &self.shot
    }

    /// Number of eigenfunctions of the functional map.
    pub fn k(&self) -> usize {
        self.k
    }

    /// The solver of the functional map of whole shapes, or of a part and its whole.
    fn solver(&self, is_part: bool) -> FmapSolver {
        if is_part { self.part_solver } else { self.solver }
    }

    /// What refines the maps of whole shapes, or of a part and its whole.
    pub fn refinement(&self, is_part: bool) -> Refinement {
        self.refinement.unwrap_or_else(|| Refinement::suiting(self.solver(is_part)))
    }

    /// What turns the measures of a map of whole shapes, or of a part and its whole, into an estimate of its error.
    pub fn calibration(&self, is_part: bool) -> Calibration {
        if is_part { Calibration::of_parts() } else { self.calibration }
    }

    /// The model, unless descriptors are SHOT.
    pub fn network(&self) -> Option<&DescriptorNetwork> {
        self.network.as_ref().map(|descriptor| &descriptor.network)
    }

    /// The network with what computes its inputs, unless descriptors are SHOT.
    pub fn network_descriptor(&self) -> Option<&NetworkDescriptor> {
        self.network.as_ref()
    }

    /// What describes shapes.
    pub fn descriptor(&self) -> &dyn Descriptor {
        match &self.network {
            Some(network) => network,
            None => &*self.plain,
        }
    }

    /// What tells descriptors of this matcher from those of another: its model, back-end and settings of SHOT.
    pub fn descriptor_key(&self) -> CacheKey {
        let descriptor = self.descriptor();
        CacheKey::of(&[descriptor.kind().as_bytes(), &descriptor.settings()])
    }

    /// Whether a shape, which may come from a file, has descriptors as this matcher makes them.
    ///
    /// # Errors
    /// If it was described by another model, back-end or settings of SHOT.
    pub fn check(&self, shape: &DescribedShape) -> Result<(), Error> {
        match shape.described_by == self.descriptor_key() {
            true => Ok(()),
            false => Err(Error::OtherDescriptor { shape: shape.shape.name.clone() }),
        }
    }

    /// Eigenfunctions that refinement uses of a shape: small meshes do not have so many as it would like.
    fn refined_k(&self, shape: &Shape) -> usize {
        let wanted = self.refinement(shape.whole_area.is_some()).eigenpairs(self.k);
        wanted.min((shape.n() / 4).max(self.k))
    }

    /// The matcher's cache, and who is told.
    pub fn context<'a>(&'a self, observer: Observer<'a>) -> Context<'a> {
        Context { cache: self.cache.as_ref(), observer }
    }

    /// Processes a shape and computes its descriptors; `name` is for messages.
    ///
    /// # Errors
    /// If the mesh has no surface left after repair, is too small for `k` eigenfunctions or too large for the memory,
    /// if the radius is out of range, the network fails, or the cache cannot be written; it names the shape.
    pub fn describe(&self, name: &str, mesh: &Mesh, observer: Observer) -> Result<DescribedShape, Error> {
        self.describe_by(&self.shape_options, name, mesh, observer)
    }

    /// As [`Matcher::describe`], for a part of a shape in the unit of the whole: `whole_area` is the area of that, in
    /// squared units of the mesh, above 0. A part may be the source of a map to the whole, in whatever pose, and is
    /// matched as a part.
    ///
    /// # Errors
    /// As [`Matcher::describe`], and if `whole_area` is out of range or the refinement is for whole shapes only.
    pub fn describe_part(
        &self,
        name: &str,
        mesh: &Mesh,
        whole_area: f64,
        observer: Observer,
    ) -> Result<DescribedShape, Error> {
        if self.refinement(true) == Refinement::Icp {
            return Err(Error::IcpOfPart.in_shape(name));
        }
        let options = ShapeOptions { whole_area: Some(whole_area), ..self.shape_options.clone() };
        self.describe_by(&options, name, mesh, observer)
    }

    fn describe_by(
        &self,
        options: &ShapeOptions,
        name: &str,
        mesh: &Mesh,
        observer: Observer,
    ) -> Result<DescribedShape, Error> {
        let context = self.context(observer);
        if let Some(network) = &self.network
            && network.network.metadata().shot.radius != network.shot.radius
        {
            observer(Event::Warning(format!(
                "{name}: the SHOT radius is {}, but the model was trained with {}; leave it as it is for a better map",
                network.shot.radius,
                network.network.metadata().shot.radius
            )));
        }
        let shape = Shape::new(name, mesh, options, context)?;
        let described_k = self.descriptor().eigenpairs();
        if described_k > shape.max_eigenpairs() {
            observer(Event::Warning(format!(
                "{name}: {} vertices are few, of which the model sees less than of finer meshes; subdivide the mesh for a better map (--subdivide N)",
                shape.n()
            )));
        }
        // Asked for once at its largest, the eigenbasis serves every smaller one, the same for every pair.
        let wanted = self.refined_k(&shape).max(described_k.max(SPECTRAL_K).min(shape.max_eigenpairs()));
        shape.eigenbasis(wanted, context)?;
        let descriptors = self.descriptor().describe(&shape, context)?;
        Ok(DescribedShape { shape, descriptors, described_by: self.descriptor_key() })
    }

    /// Computes the map of a pair, from the source to the target; that of a part to its whole where the source was
    /// described as one.
    ///
    /// # Errors
    /// If the target is a part, a shape was described by another model or other settings, the descriptors are not
    /// finite, a shape has too few eigenfunctions, a stage would take more memory than there is, the refinement
    /// fails, or the matches are too few to be upscaled; it names the shape or the pair.
    pub fn match_shapes(
        &self,
        source: &DescribedShape,
        target: &DescribedShape,
        observer: Observer,
    ) -> Result<Match, Error> {
        self.match_with_landmarks(source, target, &[], observer)
    }

    /// As [`Matcher::match_shapes`], with matches that are known: pairs of a vertex of the source's input and one of
    /// the target's. They are kept exactly, and pull the rest of the map: in the functional map's system, and in
    /// refinement by the wavelet filter.
    ///
    /// # Errors
    /// As [`Matcher::match_shapes`], and if a vertex does not exist or is on no surface.
    pub fn match_with_landmarks(
        &self,
        source: &DescribedShape,
        target: &DescribedShape,
        landmarks: &[(u32, u32)],
        observer: Observer,
    ) -> Result<Match, Error> {
        let names = format!("{} -> {}", source.shape.name, target.shape.name);
        [source, target]
            .into_iter()
            .try_for_each(|shape| self.check(shape))
            .map_err(|e| e.in_shape(&names))?;
        let pair = Pair {
            matcher: self,
            source,
            target,
            names: &names,
            context: self.context(observer),
            edges: OnceLock::new(),
        };
        pair.run(landmarks).map_err(|e| e.in_shape(&names))
    }
}

/// Matches two meshes with the given options: one pair, everything computed anew.
///
/// # Errors
/// As [`Matcher::new`], [`Matcher::describe`] and [`Matcher::match_shapes`].
pub fn match_meshes(source: &Mesh, target: &Mesh, options: &MatchOptions) -> Result<Match, Error> {
    let matcher = Matcher::new(options)?;
    let observer: Observer = &crate::events::ignore;
    let [source, target] = matcher.describe_pair(("source", source), ("target", target), false, observer)?;
    matcher.match_shapes(&source, &target, observer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::ignore;
    use crate::mesh::shapes::bumpy_sphere;

    fn matcher(k: usize) -> Matcher {
        let (descriptor, k) = (DescriptorKind::Shot, Some(k));
        Matcher::new(&MatchOptions { descriptor, k, subdivide: Resize::Never, ..MatchOptions::default() })
            .unwrap()
    }

    #[test]
    fn errors_of_a_pair_name_what_they_are_of() {
        let (mesh, matcher, other) = (bumpy_sphere(2, 1), matcher(20), matcher(10));
        let good = matcher.describe("good", &mesh, &ignore).unwrap();
        let few = other.describe("few", &mesh, &ignore).unwrap();
        matcher.match_shapes(&good, &few, &ignore).unwrap();
        other.match_shapes(&good, &few, &ignore).unwrap();
        let mut wrong = good.clone();
        wrong.descriptors.data_mut()[0] = f32::NAN;
        let error = matcher.match_shapes(&good, &wrong, &ignore).unwrap_err().to_string();
        assert!(error.starts_with("good -> good: row "), "{error}");
        let error = matcher.describe("tiny", &bumpy_sphere(0, 1), &ignore).unwrap_err().to_string();
        assert!(error.starts_with("tiny: 20 eigenpairs"), "{error}");
    }

    /// On a torus nothing tells how far round a point is but landmarks.
    #[test]
    fn landmarks_are_kept_and_pull_the_rest() {
        let source = crate::mesh::shapes::torus(48, 20, 0.4);
        let (target, new_of_old) = crate::mesh::shapes::permuted(&source, 3);
        // A quarter of the way round.
        let expected = |x: usize| new_of_old[(x + 12 * 20) % 960];
        let options = MatchOptions {
            descriptor: DescriptorKind::Shot,
            k: Some(30),
            shot_radius: Some(0.1),
            solver: Some(FmapSolver::Joint { weight: 0.1 }),
            refinement: Some(Refinement::Wavelet),
            effort: Effort::Low,
            ..MatchOptions::default()
        };
        let matcher = Matcher::new(&options).unwrap();
        let source = matcher.describe("source", &source, &ignore).unwrap();
        let target = matcher.describe("target", &target, &ignore).unwrap();
        let right: Vec<(u32, u32)> = [0, 333, 500, 777, 901].map(|v: u32| (v, expected(v as usize))).to_vec();
        let error = |landmarks: &[(u32, u32)]| {
            let found = matcher.match_with_landmarks(&source, &target, landmarks, &ignore).unwrap();
            for &(x, y) in landmarks {
                assert_eq!(
                    (found.map.get(x as usize), found.map.confidence.as_ref().unwrap()[x as usize]),
                    (Some(y), 1.0)
                );
            }
            let vertices = target.shape.input_mesh().vertices();
            let miss = |(x, y): (usize, Option<u32>)| {
                crate::mesh::vec3::distance(vertices[y.unwrap() as usize], vertices[expected(x) as usize])
            };
            found.map.iter().enumerate().map(miss).sum::<f64>() / found.map.len() as f64
        };
        let (with, without) = (error(&right), error(&[]));
        assert!(with < 0.2 && without > 3.0 * with, "{with} with landmarks, {without} without");
        for (wrong, part) in [((5000, 0), "source vertex 5000"), ((0, 5000), "target vertex 5000")] {
            let failed = matcher.match_with_landmarks(&source, &target, &[wrong], &ignore);
            let error = failed.unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("960"), "{error}");
        }
    }

    #[test]
    fn maps_of_a_part_of_the_vertices_come_back_to_all_of_the_input() {
        // Decimated on both sides, the map goes by the surface.
        let source = bumpy_sphere(4, 1);
        let (target, new_of_old) = crate::mesh::shapes::permuted(&source, 8);
        let options = MatchOptions {
            descriptor: DescriptorKind::Shot,
            k: Some(40),
            shot_radius: Some(0.2),
            decimate: Resize::To(900),
            solver: Some(FmapSolver::Joint { weight: 0.1 }),
            refinement: Some(Refinement::Wavelet),
            ..MatchOptions::default()
        };
        let found = match_meshes(&source, &target, &options).unwrap();
        assert_eq!(found.map.len(), source.n_vertices());
        let points = found.map.points.as_ref().unwrap();
        let mut worst: f64 = 0.0;
        let mut sum = 0.0;
        for (x, y) in found.map.iter().enumerate() {
            let right = target.vertices()[new_of_old[x] as usize];
            let at = points[x].unwrap().position(&target);
            sum += crate::mesh::vec3::distance(at, right);
            worst = worst.max(crate::mesh::vec3::distance(target.vertices()[y.unwrap() as usize], right));
        }
        let mean = sum / source.n_vertices() as f64 / target.scale();
        assert!(mean < 0.01 && worst < 0.1 * target.scale(), "mean {mean}, worst {worst}");
        assert!(
            found.estimate.expected_error < 5.0 && !found.estimate.doubtful && found.candidates.len() == 1
        );
    }
}
