//! The descriptor network: the model file's contract, and its back-ends.
