//! From a functional map to a point map: exact nearest neighbours in the spectral embedding.

mod embedding;
mod precise;
mod recover;
pub mod search;
mod types;

pub use embedding::Embedding;
pub use precise::EmbeddedSurface;
pub use recover::{Comparison, RecoverError, recover, recover_by};
pub use types::PointMap;

pub(crate) use recover::{check_shape, cosines, recover_transported, transport};
