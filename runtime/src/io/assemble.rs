//! Puts a mesh together while its file is read.

use super::attributes::{Attributes, MeshFile, ReadInfo};
use super::error::{ParseError, Parsed};
use super::format::MeshFormat;
use super::unmeasured::Unmeasured;
use crate::Mesh;

/// Vertices, triangles and attributes read so far.
pub(super) struct MeshBuilder {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) corner_uvs: Vec<[[f32; 2]; 3]>,
    pub(super) attributes: Attributes,
    pub(super) info: ReadInfo,
    unmeasured: Unmeasured,
}

impl MeshBuilder {
    pub(super) fn new(format: MeshFormat) -> Self {
        let info = ReadInfo::new(format);
        Self {
            vertices: Vec::new(),
            faces: Vec::new(),
            corner_uvs: Vec::new(),
            attributes: Attributes::default(),
            info,
            unmeasured: Unmeasured::default(),
        }
    }

    /// Adds a vertex, and what is wrong where its position is not finite: an error once a face has it.
    pub(super) fn vertex(&mut self, (place, problem): ([f64; 3], Option<ParseError>)) {
        if let Some(problem) = problem {
            self.unmeasured.add(self.vertices.len(), problem);
        }
        self.vertices.push(place);
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

    /// Gives each vertex the mean colour of the faces around it, white where none has one; what the colours are of is
    /// noted. Colours that the vertices have already stay.
    pub(super) fn spread_face_colors(&mut self, of_face: &[Option<[u8; 4]>], what: &str) {
        if of_face.iter().all(Option::is_none) {
            return;
        }
        if self.attributes.vertex_colors.is_some() {
            self.info.left_out.push(format!("the colours of the {what}, since the vertices have their own"));
            return;
        }
        let mut sums = vec![([0u32; 4], 0u32); self.vertices.len()];
        for (face, color) in self.faces.iter().zip(of_face) {
            let Some(color) = color else { continue };
            for &v in face {
                if let Some((sum, count)) = sums.get_mut(v as usize) {
                    sum.iter_mut().zip(color).for_each(|(s, &c)| *s += u32::from(c));
                    *count += 1;
                }
            }
        }
        let mean = |&(sum, count): &([u32; 4], u32)| match count {
            0 => [255; 4],
            _ => sum.map(|s| ((s + count / 2) / count) as u8),
        };
        self.attributes.vertex_colors = Some(sums.iter().map(mean).collect());
        self.info
            .left_out
            .push(format!("the borders of the colours of the {what}, which became colours of the vertices"));
    }

    pub(super) fn finish(mut self) -> Parsed<MeshFile> {
        if !self.corner_uvs.is_empty() {
            self.fill_uvs();
            self.attributes.corner_uvs = Some(self.corner_uvs);
        }
        self.info.warnings.extend(self.unmeasured.settle(&mut self.vertices, &self.faces)?);
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
/// Most formats do not say which number is full: 1 where no component of the whole file exceeds 1, else 255, else 65535. An alpha may have
/// a range of its own, since some programs write a 1 behind bytes.
pub(super) fn colors_to_bytes(colors: &[[f32; 4]], alpha: bool) -> Vec<[u8; 4]> {
    let largest = |range: std::ops::Range<usize>| {
        colors.iter().flat_map(|c| &c[range.clone()]).copied().filter(|x| x.is_finite()).fold(0.0, f32::max)
    };
    let alpha_largest = if alpha { largest(3..4) } else { 0.0 };
    let of_color = full(largest(0..3).max(alpha_largest));
    // Bytes of nothing but zeros and ones would be all but transparent.
    let of_alpha = if alpha_largest <= 1.0 { 1.0 } else { of_color };
    let byte = |x: f32, full: f32| (x / full * 255.0).round() as u8;
    let convert = |c: &[f32; 4]| {
        let a = if alpha { byte(c[3], of_alpha) } else { 255 };
        [byte(c[0], of_color), byte(c[1], of_color), byte(c[2], of_color), a]
    };
    colors.iter().map(convert).collect()
}

/// The number that stands for a full component, where the largest is this.
fn full(largest: f32) -> f32 {
    match largest {
        // Rounding may have made it a little more than 1.
        x if x <= 1.01 => 1.0,
        x if x <= 255.0 => 255.0,
        _ => 65535.0,
    }
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
        assert_eq!(colors_to_bytes(&[[1.0, 200.0, 255.0, 128.0]], true), [[1, 200, 255, 128]]);
        assert_eq!(colors_to_bytes(&[[0.0, 32768.0, 65535.0, 0.0]], false), [[0, 128, 255, 255]]);
        assert_eq!(colors_to_bytes(&[[1.0, 200.0, 255.0, 1.0]], true), [[1, 200, 255, 255]]);
        assert_eq!(colors_to_bytes(&[[-1.0, f32::NAN, 1.0, 0.5]], true), [[0, 0, 255, 128]]);
        assert_eq!(colors_to_bytes(&[[1.0, 0.0, 1.0, 255.0]], true), [[1, 0, 1, 255]]);
    }

    #[test]
    fn colors_of_faces_are_averaged_at_the_vertices() {
        let mut builder = MeshBuilder::new(MeshFormat::Off);
        builder.vertices = vec![[0.0; 3]; 5];
        builder.polygon(&[0, 1, 2]);
        builder.polygon(&[1, 2, 3]);
        builder.spread_face_colors(&[Some([255, 0, 0, 255]), Some([0, 0, 101, 255])], "faces");
        let file = builder.finish().unwrap();
        let both = [128, 0, 51, 255];
        let expected = [[255, 0, 0, 255], both, both, [0, 0, 101, 255], [255; 4]];
        assert_eq!(file.attributes.vertex_colors.unwrap(), expected);
        assert!(file.info.left_out[0].contains("colours of the faces"));
    }
}
