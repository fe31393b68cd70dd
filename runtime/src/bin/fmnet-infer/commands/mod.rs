//! One file for each command.

pub(crate) mod batch;
pub(crate) mod demo;
pub(crate) mod evaluate;
pub(crate) mod features;
pub(crate) mod inspect;
pub(crate) mod matching;
mod output;
pub(crate) mod transfer;
mod values;

pub(crate) use matching::Doubtful;
