//! Puts a mesh together while its file is read.

use super::attributes::{Attributes, MeshFile, ReadInfo};
use super::error::{ParseError, Parsed};
use super::format::MeshFormat;
use crate::Mesh;

/// Vertices, triangles and attributes read so far.
pub(super) struct MeshBuilder {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) corner_uvs: Vec<[[f32; 2]; 3]>,
    pub(super) attributes: Attributes,
    pub(super) info: ReadInfo,
}

impl MeshBuilder {
    pub(super) fn new(format: MeshFormat) -> Self {
        let info = ReadInfo { format, n_polygons: 0, n_ignored_faces: 0, warnings: Vec::new() };
        Self {
            vertices: Vec::new(),
            faces: Vec::new(),
            corner_uvs: Vec::new(),
            attributes: Attributes::default(),
            info,
        }
    }

    /// Adds a polygon as a fan of triangles; fewer than three corners are counted and left out.
    pub(super) fn polygon(&mut self, corners: &[u32]) {
        match corners.len() {
            0..3 => self.info.n_ignored_faces += 1,
            3 => {}
            4.. => self.info.n_polygons += 1,
        }
        self.faces.extend(fan(corners));
    }

    /// Adds a polygon with texture coordinates; where it has none they are `(0, 0)`.
    pub(super) fn polygon_with_uvs(&mut self, corners: &[u32], uvs: Option<&[[f32; 2]]>) {
        match uvs {
            Some(uvs) if uvs.len() == corners.len() => {
                self.fill_uvs();
                self.polygon(corners);
                self.corner_uvs.extend(fan(uvs));
            }
            _ => self.polygon(corners),
        }
    }

    /// Gives the faces that have no texture coordinates yet the coordinates `(0, 0)`.
    fn fill_uvs(&mut self) {
        self.corner_uvs.resize(self.faces.len(), [[0.0; 2]; 3]);
    }

    /// Takes texture coordinates per vertex to the corners.
    pub(super) fn spread_uvs(&mut self, vertex_uvs: &[[f32; 2]]) {
        let uv = |&i: &u32| vertex_uvs.get(i as usize).copied().unwrap_or_default();
        self.corner_uvs = self.faces.iter().map(|face| [uv(&face[0]), uv(&face[1]), uv(&face[2])]).collect();
    }

    pub(super) fn finish(mut self) -> Parsed<MeshFile> {
        if !self.corner_uvs.is_empty() {
            self.fill_uvs();
            self.attributes.corner_uvs = Some(self.corner_uvs);
        }
        let mesh =
            Mesh::new(self.vertices, self.faces).map_err(|e| ParseError::part("mesh", e.to_string()))?;
        Ok(MeshFile { mesh, attributes: self.attributes, info: self.info })
    }
}

/// The triangles `(0, i, i + 1)` of a polygon.
fn fan<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 3]> {
    (2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]])
}

/// The triangles of a strip, every second one turned round; a negative entry begins a new strip.
pub(super) fn strip_triangles(strip: &[i64]) -> impl Iterator<Item = [i64; 3]> {
    strip.split(|&i| i < 0).flat_map(|strip| {
        strip
            .windows(3)
            .enumerate()
            .map(|(k, t)| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
    })
}

/// Colours given as numbers, three or four components each, to bytes.
///
/// Text formats do not say whether 1 is full or nearly black: where no component of the whole file exceeds 1, it is full.
pub(super) fn colors_to_bytes(colors: &[[f32; 4]], alpha: bool) -> Vec<[u8; 4]> {
    let n_components = if alpha { 4 } else { 3 };
    let unit = colors.iter().all(|c| c[..n_components].iter().all(|&x| x <= 1.0));
    let scale = if unit { 255.0 } else { 1.0 };
    let byte = |x: f32| (x * scale).round() as u8;
    colors
        .iter()
        .map(|c| [byte(c[0]), byte(c[1]), byte(c[2]), if alpha { byte(c[3]) } else { 255 }])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_become_fans() {
        let mut builder = MeshBuilder::new(MeshFormat::Off);
        builder.vertices = vec![[0.0; 3]; 5];
        builder.polygon(&[0, 1]);
        builder.polygon(&[0, 1, 2, 3, 4]);
        builder.polygon_with_uvs(&[0, 1, 2], Some(&[[0.5; 2]; 3]));
        builder.polygon(&[2, 1, 0]);
        let file = builder.finish().unwrap();
        assert_eq!(file.mesh.faces(), [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2], [2, 1, 0]]);
        assert_eq!((file.info.n_polygons, file.info.n_ignored_faces), (1, 1));
        let uvs = file.attributes.corner_uvs.unwrap();
        assert_eq!((uvs.len(), uvs[2], uvs[3], uvs[4]), (5, [[0.0; 2]; 3], [[0.5; 2]; 3], [[0.0; 2]; 3]));
    }

    #[test]
    fn strips_keep_their_orientation() {
        let triangles: Vec<_> = strip_triangles(&[0, 1, 2, 3, -1, 4, 5, 6]).collect();
        assert_eq!(triangles, [[0, 1, 2], [2, 1, 3], [4, 5, 6]]);
    }

    #[test]
    fn colors_of_either_range() {
        assert_eq!(colors_to_bytes(&[[1.0, 0.5, 0.0, 0.0]], false), [[255, 128, 0, 255]]);
        assert_eq!(colors_to_bytes(&[[1.0, 200.0, 300.0, 255.0]], true), [[1, 200, 255, 255]]);
    }
}
