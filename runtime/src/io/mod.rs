//! Files: meshes, point maps, matrices; read with bounded memory, written to a temporary name and renamed.
