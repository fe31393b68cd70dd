//! Geodesic distances on a triangle mesh.
