//! Trains the descriptor network through the functional map (Litany et al. 2017, "Deep Functional Maps") and exports
//! it to ONNX.
//!
//! What the program `fmnet-train` does, as a library. Geometry, caching and evaluation come from the crate `fmnet`;
//! this one adds datasets, a network with gradients and the loop around them.
//!
//! | | module |
//! |---|---|
//! | settings: one type for file, command line, saved copy and defaults | [`config`] |
//! | which shapes there are, which correspond, how they are split | [`dataset`] |
//! | eigenbasis, SHOT and geodesic distances of each shape, once | [`precompute`] |
//! | which pair and which points make minibatch `b` | [`sampler`] |
//! | residual blocks on SHOT descriptors | [`network`] |
//! | `C` from the projected descriptors, with its gradient | [`fm_layer`] |
//! | the soft correspondence and its error; the siamese loss | [`soft_map`], [`losses`] |
//! | one minibatch, forward and backward; Adam | [`step`], [`optimizer`] |
//! | the loop: resume, validation, checkpoints | [`train`](mod@train), [`validate`], [`checkpoint`] |
//! | statistics folded, graph and metadata written | [`export`] |
//!
//! A run in a few lines (it takes minutes to hours; `tests/resume.rs` of the repository runs a small one):
//!
//! ```no_run
//! use candle_core::Device;
//! use fmnet_trainer::config::{List, TrainConfig};
//! use fmnet_trainer::train::train;
//! use std::sync::atomic::AtomicBool;
//!
//! let config = TrainConfig {
//!     dataset: List(vec!["data/bodies".into()]),
//!     out: "runs/bodies".into(),
//!     ..TrainConfig::default()
//! };
//! let stop = AtomicBool::new(false);
//! let summary = train(&config, &Device::Cpu, &|event| eprintln!("{event:?}"), &stop)?;
//! println!("{} minibatches, best error {}", summary.step, summary.best_error);
//! # Ok::<(), fmnet_trainer::train::TrainError>(())
//! ```

pub mod calibrate;
pub mod checkpoint;
pub mod config;
pub mod dataset;
mod device;
pub mod evaluate;
pub mod events;
pub mod export;
pub mod fm_layer;
mod initial;
pub mod losses;
pub mod network;
mod numeric;
pub mod optimizer;
pub mod plot;
pub mod precompute;
mod projection;
pub mod reproduce;
pub mod sampler;
pub mod simulate;
pub mod soft_map;
pub mod step;
pub mod synth;
#[cfg(test)]
mod testing;
pub mod train;
pub mod validate;
