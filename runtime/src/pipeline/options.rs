//! Settings of a [`Matcher`](super::Matcher).

use crate::fmap::FmapSolver;
use crate::network::Backend;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Eigenfunctions that refinement goes up to; 500 in the product manifold filter gained nothing.
const REFINED_K: usize = 200;

/// The pointwise descriptors that the functional map is computed from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum DescriptorKind {
    /// By the network of a model.
    #[default]
    Learned,
    /// SHOT itself: the paper's baseline.
    Shot,
}

/// What happens to the map of the working meshes before it is upscaled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Refinement {
    /// Nothing: the raw map.
    None,
    /// Spectral ICP (Ovsjanikov et al. 2012).
    Icp,
    /// ZoomOut (Melzi et al. 2019).
    #[default]
    Zoomout,
    /// The wavelet filter, coarse to fine (Hu, Li, Liu et al. 2021): in both directions, of a part in that to its
    /// whole.
    Wavelet,
    /// ZoomOut, then the product manifold filter (Vestner et al. 2017) with SHOT, which takes longer: one-to-one
    /// between meshes of equally many vertices, injective where the source has fewer.
    #[serde(alias = "pmf-geometry")]
    #[cfg_attr(feature = "cli", value(alias = "pmf-geometry"))]
    Pmf,
    /// The product manifold filter, then along the triangulation, where both meshes turn out to have the same, as
    /// registrations of one template do: the map then is exact, whatever the shapes.
    SharedTriangulation,
}

impl Refinement {
    /// What suits the maps of a solver: the wavelet filter for those of both directions or of a part, ZoomOut for
    /// others.
    pub fn suiting(solver: FmapSolver) -> Self {
        match solver {
            FmapSolver::Joint { .. } | FmapSolver::Part { .. } => Self::Wavelet,
            _ => Self::Zoomout,
        }
    }

    /// Eigenfunctions that it uses of each shape, where the functional map has `k`.
    pub(super) fn eigenpairs(self, k: usize) -> usize {
        match self {
            Self::None | Self::Icp => k,
            Self::Zoomout | Self::Wavelet | Self::Pmf | Self::SharedTriangulation => k.max(REFINED_K),
        }
    }
}

/// How the map of decimated meshes becomes one of the full meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Upscaling {
    /// Along the surface: a vertex of the full source goes where its place on the decimated one goes. Maps that come
    /// from no functional map, those of the product manifold filter, take the l2,1 problem instead.
    #[default]
    Surface,
    /// The robust l2,1 problem of the paper.
    L21,
    /// Plain least squares, which wrong matches bend.
    LeastSquares,
}

/// How much is tried to find a good map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Effort {
    /// One way to the map.
    Low,
    /// Others where the first map is doubtful.
    #[default]
    Normal,
    /// All of them, always.
    High,
}

/// Which model computes the descriptors.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ModelSource {
    /// The model built into the library.
    #[default]
    Embedded,
    /// A model file.
    File(PathBuf),
}

/// The number of vertices that a mesh is brought to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Resize {
    /// What suits the model.
    #[default]
    Default,
    /// The mesh stays as it is.
    Never,
    /// So many.
    To(usize),
}

impl Resize {
    /// The number, with the default filled in; `None`: never.
    pub(super) fn or(self, default: Option<usize>) -> Option<usize> {
        match self {
            Self::Default => default,
            Self::Never => None,
            Self::To(n) => Some(n),
        }
    }
}

/// Settings of a [`Matcher`](super::Matcher). What is `None` comes from the model, or without one from the paper.
///
/// ```
/// use fmnet::pipeline::{DescriptorKind, MatchOptions, Resize};
///
/// let options = MatchOptions::default().descriptor(DescriptorKind::Shot).k(40).decimate(Resize::To(5000));
/// assert_eq!((options.k, options.shot_radius), (Some(40), None));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MatchOptions {
    /// Learned descriptors, which are the default, or SHOT.
    pub descriptor: DescriptorKind,
    /// The model, for learned descriptors. Default: the one that is built in.
    pub model: ModelSource,
    /// What computes the network. Default: tract.
    pub backend: Backend,
    /// Number of eigenfunctions of the functional map, from 1 to what [`crate::spectral::eigenbasis`] gives of the
    /// working meshes. Default: the model's; 120 for SHOT.
    pub k: Option<usize>,
    /// Solver of the functional map. Default: what suits the model, [`FmapSolver::for_matching`]; least squares for
    /// SHOT; [`FmapSolver::Part`] for a part and its whole.
    pub solver: Option<FmapSolver>,
    /// SHOT radius relative to sqrt(area), above 0. Default: the model's; that of [`crate::descriptor::ShotOptions`]
    /// for SHOT.
    pub shot_radius: Option<f64>,
    /// Meshes of more vertices are decimated to so many, 4 or more. Default: the model's; 15000 for SHOT.
    pub decimate: Resize,
    /// Meshes of fewer vertices are subdivided to so many. Default: 2000; never where the refinement is the product
    /// manifold filter, whose map is one of the vertices that there are.
    pub subdivide: Resize,
    /// Refinement. Default: what suits the solver, [`Refinement::suiting`]; none for SHOT.
    pub refinement: Option<Refinement>,
    /// Upscaling of the map of decimated meshes. Default: along the surface.
    pub upscaling: Upscaling,
    /// How much is tried to find a good map. Default: other ways where the first map is doubtful.
    pub effort: Effort,
    /// Steps by which the network is adapted to the pair, 0 for none. Default: 10 where the first map is doubtful,
    /// else none. Only for models that [`crate::network::DescriptorNetwork::native`] knows.
    pub adapt: Option<usize>,
    /// Folder of results kept for each shape; `None`, the default: nothing is kept.
    pub cache: Option<PathBuf>,
}

/// For each option a function of its name, which sets it and gives the options back.
macro_rules! setters {
    ($($name:ident: $kind:ty),* $(,)?) => {
        impl MatchOptions {
            $(
                #[doc = concat!("Sets [`", stringify!($name), "`](field@MatchOptions::", stringify!($name), ").")]
                #[must_use]
                pub fn $name(mut self, $name: impl Into<$kind>) -> Self {
                    self.$name = $name.into();
                    self
                }
            )*
        }
    };
}

setters! {
    descriptor: DescriptorKind,
    model: ModelSource,
    backend: Backend,
    k: Option<usize>,
    solver: Option<FmapSolver>,
    shot_radius: Option<f64>,
    decimate: Resize,
    subdivide: Resize,
    refinement: Option<Refinement>,
    upscaling: Upscaling,
    effort: Effort,
    adapt: Option<usize>,
    cache: Option<PathBuf>,
}
