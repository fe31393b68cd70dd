//! Pointwise descriptors: SHOT-352, the input of the network.
