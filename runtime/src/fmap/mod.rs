//! Functional maps: least squares, the regularised solve, soft correspondence.
