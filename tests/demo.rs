//! The demo's bodies are what the generator makes, and the built-in model matches them.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet_tests::{Workplace, root};
use fmnet_trainer::synth::{DEMO_FILES, write_demo};

#[test]
fn bodies_of_the_demo_are_those_of_the_generator() {
    let folder = tempfile::tempdir().unwrap();
    write_demo(folder.path()).unwrap();
    let mut total = 0;
    for file in DEMO_FILES {
        let made = std::fs::read(folder.path().join(file)).unwrap();
        let kept = std::fs::read(root().join("runtime/demo").join(file)).unwrap();
        assert!(made == kept, "{file} is out of date: run `fmnet-train synth --demo runtime/demo`");
        total += kept.len();
    }
    assert!(total < 150_000, "{total} bytes");
}

/// Mean geodesic error of the demo, relative to sqrt(area), that the built-in model must not exceed. A model or a
/// default that does better may lower it.
const MOST: f64 = 0.075;

#[test]
fn the_built_in_model_matches_the_bodies_of_the_demo() {
    let summary = Workplace::new().succeed(&["demo", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let mean = summary["summary"]["mean"].as_f64().unwrap();
    assert!(mean > 0.0 && mean < MOST, "mean error x 100: {}", 100.0 * mean);
}
