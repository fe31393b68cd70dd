//! One file for each command.

pub(crate) mod calibrate;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod preprocess;
pub(crate) mod reproduce;
pub(crate) mod simulate;
pub(crate) mod synth;
pub(crate) mod train;
