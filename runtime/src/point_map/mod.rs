//! From a functional map to a point map: exact nearest neighbours in the spectral embedding.

mod types;

pub use types::PointMap;
