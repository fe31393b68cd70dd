//! Evaluation of a point map against ground truth.
