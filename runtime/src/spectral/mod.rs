//! The Laplace-Beltrami operator and its eigenbasis.

mod basis;

pub use basis::Eigenbasis;
