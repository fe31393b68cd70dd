//! The two built-in shapes of the demo.

use super::{Body, Species, SynthOptions, Template};

/// Two individuals of one species in different poses, and which points correspond.
#[derive(Clone, Debug)]
pub struct DemoPair {
    /// The shape to map from.
    pub source: Body,
    /// The shape to map to.
    pub target: Body,
    /// For every source vertex the corresponding target vertex, `[n_source]`.
    pub ground_truth: Vec<u32>,
}

/// Seeds from here on are used by no dataset, whatever its seed and size.
const UNSEEN: u64 = 1 << 40;

/// Two different individuals of `species`, with seeds that no dataset uses; another `pair`, other two.
pub fn demo_pair(species: Species, pair: u32) -> DemoPair {
    let template = Template::new(species);
    let first = UNSEEN + 2 * u64::from(pair);
    let body =
        |seed: u64| template.body(seed, &SynthOptions::default()).expect("the default options are in range");
    let (source, target) = rayon::join(|| body(first), || body(first + 1));
    let ground_truth = template.ground_truth(&source, &target);
    DemoPair { source, target, ground_truth }
}
