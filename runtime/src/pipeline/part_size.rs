//! Other sizes of a part, tried where its map is doubtful: parts of one shape are often matched to the whole of a
//! larger or smaller one, or come in another unit of length.

use super::DescribedShape;
use super::candidates::Tried;
use super::landmarks::Landmarks;
use super::pair::{LARGEST_SHARE, Pair};
use super::refine::Found;
use crate::error::Error;
use crate::quality::{Estimate, Quality};
use crate::shape::Context;

/// From one size to the next, in area; in length that is a fifth.
const STEP: f64 = std::f64::consts::SQRT_2;

/// Steps to larger and to smaller sizes.
const STEPS: i32 = 3;

/// A map at another size is taken if its expected error is below this share of the one so far. Between unlike bodies
/// four right sizes came to 0.19 to 0.74 of that at the part's own.
const CLEARLY: f64 = 0.75;

impl Pair<'_> {
    /// Goes to larger and to smaller sizes of the part for as long as the expected error falls.
    pub(super) fn try_sizes(&self, tried: &mut Tried, landmarks: Option<&Landmarks>) -> Result<(), Error> {
        let at_own_size = tried.candidates[0].estimate.expected_error;
        let mut taken = None;
        for direction in [1, -1] {
            let mut last = at_own_size;
            for step in 1..=STEPS {
                let times = STEP.powi(direction * step);
                if self.share_of_whole() * times > LARGEST_SHARE {
                    break;
                }
                let source = self.resized(times)?;
                let (found, judged) = self.with_source(&source).first_map(landmarks)?;
                let expected = judged.1.expected_error;
                if tried.add(&format!("part {times:.2} times as large"), found, judged, CLEARLY) {
                    tried.resized = Some(Box::new(source));
                    taken = Some(times);
                }
                if expected >= last {
                    break;
                }
                last = expected;
            }
        }
        if let Some(times) = taken {
            self.warn(&format!(
                "the part fits the whole better with {times:.2} times its area, and was matched so; are both in one unit of length?"
            ));
        }
        Ok(())
    }

    fn first_map(&self, landmarks: Option<&Landmarks>) -> Result<(Found, (Quality, Estimate)), Error> {
        let landmarks = landmarks.map(|landmarks| landmarks.of(self)).transpose()?;
        let found = self.by_first_way(landmarks.as_ref())?;
        let judged = self.judge()?.judge(&found)?;
        Ok((found, judged))
    }

    /// The source as if its area were so many times as large. Nothing of that is kept on disk: few would ask for it
    /// again.
    fn resized(&self, times: f64) -> Result<DescribedShape, Error> {
        let shape = self.source.shape.part_of(self.source.shape.unit_area() / times);
        let descriptors =
            self.matcher.descriptor().describe(&shape, Context { cache: None, ..self.context })?;
        Ok(DescribedShape { shape, descriptors, described_by: self.source.described_by })
    }
}
