//! Refinement of a map: spectral ICP, ZoomOut, the product manifold filter.
