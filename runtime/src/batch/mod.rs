//! Many pairs: the list of them, the names of their maps, and what a map that is there was made from.
//!
//! These are the rules of `fmnet-infer batch`: a program that follows them, on one machine or many, writes the same
//! files, and each takes up what the other has begun.

mod map_key;
mod pairs;

pub use map_key::{Made, MapKeys, made_from, write_map};
pub use pairs::{Pair, PairsError, decode_pairs, read_pairs};
