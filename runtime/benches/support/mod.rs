//! What the benches share.

pub(crate) mod report;
pub(crate) mod shapes;
