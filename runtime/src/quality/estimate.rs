//! From measures to an estimate of the error.

use super::Quality;
use serde::{Deserialize, Serialize};

/// How measures of a map become an estimate of its error; fitted on maps with known errors, in the model's metadata.
///
/// Both are linear in `log(measure + a small number)` of each measure: the logarithm of the expected mean error, and
/// the log-odds that it is above 0.1 sqrt(area).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Constant and weights of the logarithm of the expected error.
    pub error: [f64; Calibration::WIDTH],
    /// Constant and weights of the log-odds that the map is bad.
    pub bad: [f64; Calibration::WIDTH],
    /// The probability from which a map is called doubtful.
    pub doubtful: f64,
    /// The agreement of descriptors below which a map is doubtful whatever the other measures say; none for
    /// descriptors whose cosines mean little.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agreement: Option<f64>,
}

/// What the measures say of a map's error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean error to expect, in units of sqrt(area), times 100.
    pub expected_error: f64,
    /// The probability that the mean error is above 10.
    pub bad: f64,
    /// Whether that is so probable that the map should not be used without a look; of a pair also where it has
    /// [displaced regions](super::displaced_regions).
    pub doubtful: bool,
}

impl Default for Calibration {
    /// Fitted on 715 maps, 115 of them bad, of several models and refinements between people and animals of four
    /// makers.
    fn default() -> Self {
        Self {
            error: [3.722, 0.178, 0.090, 0.221, 0.191, 0.150],
            bad: [10.927, 1.272, 0.489, 0.249, 0.346, 2.489],
            doubtful: 0.7,
            agreement: None,
        }
    }
}

impl Calibration {
    /// That of maps of parts to their wholes, whose measures are worse for being parts: fitted on 560 maps, 390 of
    /// them bad, by four models, of synthetic people, bipeds and quadrupeds cut in pieces onto others of their kind,
    /// of the same size and of another. The odds follow the expected error: weights of their own for each measure
    /// told these parts apart a little better, but not those of a real dog.
    pub fn of_parts() -> Self {
        Self {
            error: [4.594, 0.605, 0.095, 0.080, 0.108, 0.415],
            bad: [7.801, 2.426, 0.379, 0.321, 0.431, 1.665],
            doubtful: 0.3,
            agreement: None,
        }
    }

    /// A constant and a weight for each measure.
    pub const WIDTH: usize = 6;

    /// The features that the weights are for: 1 and the logarithms of commutativity, Dirichlet energy, orthogonality,
    /// stretched and reversed share.
    pub fn features(quality: &Quality) -> [f64; Self::WIDTH] {
        let log = |value: f64, floor: f64| (value.max(0.0) + floor).ln();
        [
            1.0,
            log(quality.commutativity, 1e-3),
            log(quality.dirichlet, 1e-2),
            log(quality.orthogonality, 1e-3),
            log(quality.stretched, 1e-3),
            log(quality.reversed, 1e-2),
        ]
    }

    /// As in a model's metadata.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("plain numbers serialise")
    }

    /// Reads what [`Calibration::to_json`] writes.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn from_json(text: &str) -> Result<Self, String> {
        let calibration: Self = serde_json::from_str(text).map_err(|e| format!("does not parse ({e})"))?;
        let mut weights = calibration.error.iter().chain(&calibration.bad);
        let cosine = calibration.agreement.is_none_or(|least| (-1.0..=1.0).contains(&least));
        match weights.all(|w| w.is_finite()) && (0.0..=1.0).contains(&calibration.doubtful) && cosine {
            true => Ok(calibration),
            false => {
                Err("has a weight that is not finite, a threshold that is no probability, or an agreement that is no cosine"
                    .to_string())
            }
        }
    }

    /// The estimate for a map of these measures.
    pub fn estimate(&self, quality: &Quality) -> Estimate {
        let features = Self::features(quality);
        let linear = |weights: &[f64]| weights.iter().zip(features).map(|(w, x)| w * x).sum::<f64>();
        let bad = 1.0 / (1.0 + (-linear(&self.bad)).exp());
        let doubtful = bad >= self.doubtful || self.sees_no_likeness(quality);
        Estimate { expected_error: linear(&self.error).exp().min(100.0), bad, doubtful }
    }

    /// Whether the descriptors of what is matched are too unlike.
    pub fn sees_no_likeness(&self, quality: &Quality) -> bool {
        matches!((quality.agreement, self.agreement), (Some(found), Some(least)) if found < least)
    }
}
