//! Trains the descriptor network through the functional map (Litany et al. 2017, "Deep Functional Maps").

mod device;
pub mod fm_layer;
pub mod loss;
pub mod network;
mod numeric;
pub mod optimizer;
mod projection;
pub mod soft_map;
pub mod step;
#[cfg(test)]
mod testing;
