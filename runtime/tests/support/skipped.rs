//! What a test does where something that it needs is not at hand.

#![allow(unreachable_pub, reason = "one of the crates that share this file exports it")]

use std::fmt::Display;

/// Says what was left out and why; with `FMNET_REQUIRE_ALL=1` the test fails instead.
///
/// # Panics
/// With `FMNET_REQUIRE_ALL=1`.
pub fn skipped(what: impl Display) {
    let required = std::env::var_os("FMNET_REQUIRE_ALL").is_some_and(|value| value == "1");
    assert!(!required, "FMNET_REQUIRE_ALL=1 lets nothing be skipped: {what}");
    eprintln!("skipped: {what}");
}
