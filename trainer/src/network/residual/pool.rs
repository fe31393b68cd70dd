//! Buffers that outlive a step, so that activations are not allocated and zeroed anew each time.

use crate::numeric::Real;
use std::sync::{Mutex, PoisonError};

/// Vectors to reuse.
#[derive(Debug, Default)]
pub(super) struct BufferPool<T> {
    free: Mutex<Vec<Vec<T>>>,
}

impl<T: Real> BufferPool<T> {
    /// A vector of `len` arbitrary finite values.
    pub(super) fn take(&self, len: usize) -> Vec<T> {
        let reused = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut buffer = reused.unwrap_or_default();
        buffer.resize(len, T::zero());
        buffer
    }

    /// Takes a vector back.
    pub(super) fn give(&self, buffer: Vec<T>) {
        self.free.lock().unwrap_or_else(PoisonError::into_inner).push(buffer);
    }
}
