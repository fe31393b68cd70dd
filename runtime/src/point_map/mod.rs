//! From a functional map to a point map: exact nearest neighbours in the spectral embedding.
