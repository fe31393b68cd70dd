//! How bodies are triangulated and damaged.

use super::SynthError;

/// How an individual is triangulated and damaged. The default is a clean closed body.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthOptions {
    /// Fewest vertices, from 4000 up to `max_vertices`; default 5000. The number is drawn between the two, before
    /// damage takes some away.
    pub min_vertices: usize,
    /// Most vertices, up to 15000; default 7000.
    pub max_vertices: usize,
    /// Number of round holes, 0 to 20; default 0.
    pub holes: usize,
    /// Largest geodesic radius of a hole, relative to the square root of the area, in (0, 0.5]; default 0.1. The
    /// radius is drawn between half of it and it.
    pub hole_radius: f64,
    /// Number of limbs cut off at a random place, 0 to 3; default 0.
    pub cuts: usize,
    /// Standard deviation of the noise on every coordinate, relative to the mean edge length, in [0, 0.5]; default 0.
    pub noise: f64,
}

impl Default for SynthOptions {
    fn default() -> Self {
        Self { min_vertices: 5000, max_vertices: 7000, holes: 0, hole_radius: 0.1, cuts: 0, noise: 0.0 }
    }
}

impl SynthOptions {
    /// Checks every option against its range.
    pub(super) fn check(&self) -> Result<(), SynthError> {
        let refuse = |option, value: String, range| Err(SynthError::Option { option, value, range });
        if !(4000..=self.max_vertices).contains(&self.min_vertices) {
            return refuse("min_vertices", self.min_vertices.to_string(), "4000 to max_vertices");
        }
        if self.max_vertices > 15000 {
            return refuse("max_vertices", self.max_vertices.to_string(), "min_vertices to 15000");
        }
        if self.holes > 20 {
            return refuse("holes", self.holes.to_string(), "0 to 20");
        }
        if !(self.hole_radius > 0.0 && self.hole_radius <= 0.5) {
            return refuse("hole_radius", self.hole_radius.to_string(), "above 0, at most 0.5");
        }
        if self.cuts > 3 {
            return refuse("cuts", self.cuts.to_string(), "0 to 3");
        }
        if !(0.0..=0.5).contains(&self.noise) {
            return refuse("noise", self.noise.to_string(), "0 to 0.5");
        }
        Ok(())
    }
}
