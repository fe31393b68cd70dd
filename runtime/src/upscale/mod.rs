//! From the map of two decimated shapes to the map of the full ones.
