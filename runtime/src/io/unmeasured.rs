//! Vertices without a finite position, as organised scans have them where nothing was measured. Of no face, they keep
//! their number.

use super::error::{ParseError, Parsed};
use crate::mesh::vec3;

/// Places of such vertices that are kept for an error; a file of nothing else must not take more memory than its size.
const KEPT_PLACES: usize = 64;

/// The vertices without a finite position that were read so far.
#[derive(Default)]
pub(super) struct Unmeasured {
    vertices: Vec<u32>,
    /// What is wrong with the first ones, and where.
    places: Vec<ParseError>,
}

impl Unmeasured {
    /// Notes a vertex and what is wrong with it.
    pub(super) fn add(&mut self, vertex: usize, problem: ParseError) {
        self.vertices.push(vertex as u32);
        if self.places.len() < KEPT_PLACES {
            self.places.push(problem);
        }
    }

    /// Puts them where no other vertex is; returns what is to be said about it.
    ///
    /// # Errors
    /// If a face has such a vertex, or there is no face or no position at all: then what is wrong with the first one.
    pub(super) fn settle(mut self, vertices: &mut [[f64; 3]], faces: &[[u32; 3]]) -> Parsed<Option<String>> {
        let Some(&first) = self.vertices.first() else { return Ok(None) };
        let mut is_unmeasured = vec![false; vertices.len()];
        self.vertices.iter().for_each(|&v| is_unmeasured[v as usize] = true);
        let mut is_used = vec![false; vertices.len()];
        // Faces of vertices that do not exist are refused later.
        let exists = |v: &&u32| (**v as usize) < vertices.len();
        faces.iter().flatten().filter(exists).for_each(|&v| is_used[v as usize] = true);
        // Of points alone none can be told from the others.
        let needed = self.vertices.iter().position(|&v| faces.is_empty() || is_used[v as usize]);
        let free = free_place(vertices, &is_unmeasured);
        let (Some(free), None) = (free, needed) else {
            let at = needed.unwrap_or(0);
            let vertex = self.vertices[at] as usize;
            return Err(match at < self.places.len() {
                true => self.places.swap_remove(at),
                false => ParseError::part(
                    format!("vertex {vertex}"),
                    format!("the position is not finite: {:?}", vertices[vertex]),
                ),
            });
        };
        self.vertices.iter().for_each(|&v| vertices[v as usize] = free);
        Ok(Some(format!(
            "{} of {} vertices, the first {first} (counted from 0), have no finite position and no face: they are put at \
             the centre and stay without a match",
            self.vertices.len(),
            vertices.len()
        )))
    }
}

/// The centre of the other vertices' bounding box, or beside it where one of them is there.
fn free_place(vertices: &[[f64; 3]], left_out: &[bool]) -> Option<[f64; 3]> {
    let measured = || vertices.iter().zip(left_out).filter(|(_, out)| !**out).map(|(p, _)| *p);
    let first = measured().next()?;
    let [low, high] = measured().fold([first, first], |[low, high], p| {
        [[0, 1, 2].map(|i| low[i].min(p[i])), [0, 1, 2].map(|i| high[i].max(p[i]))]
    });
    let mut place = [0, 1, 2].map(|i| 0.5 * low[i] + 0.5 * high[i]);
    let step = vec3::distance(low, high) * 1e-3;
    while step > 0.0 && measured().any(|p| p == place) && place[0] + step <= high[0] {
        place[0] += step;
    }
    Some(place)
}

#[cfg(test)]
mod tests {
    use super::super::decode_mesh;
    use std::path::Path;

    #[test]
    fn vertices_without_a_position_keep_their_number_where_no_face_has_them() {
        let files = [
            ("a.off", "OFF\n5 1 0\nnan nan nan\n0 0 0\n2 0 0\n0 2 1.#INF\n0 2 0\n3 1 2 4\n"),
            ("a.obj", "v nan nan nan\nv 0 0 0\nv 2 0 0\nv 0 -inf 0\nv 0 2 0\nf 2 3 5\n"),
            (
                "a.ply",
                "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                 nan nan nan\n0 0 0\n2 0 0\n0 2 inf\n0 2 0\n3 1 2 4\n",
            ),
        ];
        for (name, text) in files {
            let file = decode_mesh(text.as_bytes(), Path::new(name)).unwrap();
            let vertices = file.mesh.vertices();
            assert_eq!(vertices[1..3], [[0.0; 3], [2.0, 0.0, 0.0]], "{name}");
            assert_eq!([vertices[0], vertices[3]], [[1.0, 1.0, 0.0]; 2], "{name}");
            assert_eq!(file.mesh.faces(), [[1, 2, 4]], "{name}");
            assert!(
                file.info.warnings[0].starts_with("2 of 5 vertices, the first 0 "),
                "{:?}",
                file.info.warnings
            );
            let used = text.replace("3 1 2 4\n", "3 1 2 3\n").replace("f 2 3 5\n", "f 2 3 4\n");
            let error = decode_mesh(used.as_bytes(), Path::new(name)).unwrap_err().to_string();
            assert!(error.contains("finite") && error.contains("line "), "{error}");
        }
    }

    #[test]
    fn the_centre_may_be_taken() {
        let text = "OFF\n6 2 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n1 1 0\nnan 0 0\n3 0 1 4\n3 2 3 4\n";
        let file = decode_mesh(text.as_bytes(), Path::new("a.off")).unwrap();
        let [x, y, z] = file.mesh.vertices()[5];
        assert!(x > 1.0 && x < 1.01 && (y, z) == (1.0, 0.0));
    }

    #[test]
    fn a_file_of_nothing_else_is_refused_with_the_first() {
        let points = decode_mesh(b"v nan 0 0\nv 1 0 0\n", Path::new("a.obj")).unwrap_err().to_string();
        assert!(points.contains("line 1: a coordinate is not finite"), "{points}");
        let mut text = String::from("OFF\n3000 0 0\n");
        (0..3000).for_each(|_| text.push_str("nan nan nan\n"));
        let error = decode_mesh(text.as_bytes(), Path::new("a.off")).unwrap_err().to_string();
        assert!(error.contains("line 3: a coordinate is not finite: 'nan'"), "{error}");
    }
}
