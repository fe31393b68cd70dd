//! Trains the descriptor network through the functional map (Litany et al. 2017, "Deep Functional Maps").

pub mod checkpoint;
pub mod config;
pub mod dataset;
mod device;
pub mod events;
pub mod export;
pub mod fm_layer;
pub mod loss;
pub mod network;
mod numeric;
pub mod optimizer;
pub mod plot;
pub mod precompute;
mod projection;
pub mod sampler;
pub mod simulate;
pub mod soft_map;
pub mod step;
#[cfg(test)]
mod testing;
pub mod train;
pub mod validate;
