//! One file for each command.

pub(crate) mod export;
pub(crate) mod preprocess;
pub(crate) mod simulate;
pub(crate) mod synth;
pub(crate) mod train;
