//! The demo's bodies are what the generator makes.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet_tests::root;
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
