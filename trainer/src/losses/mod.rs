//! What a step minimises: a weighted sum of losses, one file each.

mod contrastive;
mod siamese;
mod spectral;
mod unsupervised;

pub(crate) use contrastive::contrastive;
pub(crate) use siamese::siamese;
pub(crate) use spectral::spectral;
pub(crate) use unsupervised::{SoftAssignment, bijectivity, coupling, orthogonality};

use fmnet::fmap::ColumnNorm;
use serde::{Deserialize, Serialize};

/// The table `[loss]`: the weight of each loss, 0 to leave it out, and their settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct LossOptions {
    /// `|C - C_gt|^2`, the functional maps of both directions against those of the ground truth (GeomFmaps, Donati et
    /// al. 2020); default 0.02.
    pub spectral: f64,
    /// InfoNCE over corresponding points (van den Oord et al. 2018); default 1.
    pub contrastive: f64,
    /// Temperature of the contrastive loss and of the coupling; above 0, default 0.07.
    pub temperature: f64,
    /// The soft error of the soft correspondence (the paper's equation "lossf"); needs geodesic distances; default 0.
    pub soft_error: f64,
    /// Soft error: the norm that columns of the soft correspondence are divided by; default l2.
    pub column_norm: ColumnNorm,
    /// The contrastive loss of the paper's equation "siam", without the functional map; default 0.
    pub siamese: f64,
    /// Siamese loss: distance that points which do not correspond should keep; above 0, default 1.
    pub margin: f64,
    /// Siamese loss: share of similar points against dissimilar ones; 0 to 1, default 0.5.
    pub gamma: f64,
    /// `|C12 C21 - I|^2 + |C21 C12 - I|^2`; needs no ground truth; default 0.
    pub bijectivity: f64,
    /// `|C^T C - I|^2`, both directions; needs no ground truth; default 0.
    pub orthogonality: f64,
    /// `|C - Psi^+ P Phi|^2` with `P` the soft assignment by the descriptors (Cao, Roetzer and Bernard 2023), both
    /// directions; needs no ground truth; default 0.
    pub coupling: f64,
}

impl Default for LossOptions {
    fn default() -> Self {
        Self { spectral: 0.02, contrastive: 1.0, ..Self::none() }
    }
}

impl LossOptions {
    pub(crate) fn none() -> Self {
        Self {
            spectral: 0.0,
            contrastive: 0.0,
            temperature: 0.07,
            soft_error: 0.0,
            column_norm: ColumnNorm::L2,
            siamese: 0.0,
            margin: 1.0,
            gamma: 0.5,
            bijectivity: 0.0,
            orthogonality: 0.0,
            coupling: 0.0,
        }
    }

    /// The paper's soft error alone.
    pub fn soft_error() -> Self {
        Self { soft_error: 1.0, ..Self::none() }
    }

    /// The paper's siamese loss alone.
    pub fn siamese() -> Self {
        Self { siamese: 1.0, ..Self::none() }
    }

    /// Whether a loss needs functional maps.
    pub(crate) fn needs_maps(&self) -> bool {
        self.needs_both_maps() || self.soft_error > 0.0
    }

    /// Whether a loss needs the functional maps of both directions.
    pub(crate) fn needs_both_maps(&self) -> bool {
        self.spectral + self.bijectivity + self.orthogonality + self.coupling > 0.0
    }

    /// Whether a loss needs corresponding points.
    pub(crate) fn needs_points(&self) -> bool {
        self.contrastive + self.soft_error + self.siamese > 0.0
    }

    /// The weights by name.
    pub(crate) fn weights(&self) -> [(&'static str, f64); 7] {
        [
            ("spectral", self.spectral),
            ("contrastive", self.contrastive),
            ("soft-error", self.soft_error),
            ("siamese", self.siamese),
            ("bijectivity", self.bijectivity),
            ("orthogonality", self.orthogonality),
            ("coupling", self.coupling),
        ]
    }
}
