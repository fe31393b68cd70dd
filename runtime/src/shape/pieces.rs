//! What the pieces of a mesh mean for its map.

use crate::Mesh;
use crate::mesh::{Repaired, Topology};

/// Pieces of which the largest has less than this share of the area may be a surface whose triangles share no vertices.
const LARGEST: f64 = 0.05;

/// What the user should know, a line each.
pub(super) fn warnings(mesh: &Mesh, repaired: &Repaired) -> String {
    let mut lines = Vec::new();
    let dropped = repaired.dropped_vertices.len();
    if dropped > 0 {
        let pieces = match repaired.report.dropped_components {
            0 => "faces without area".into(),
            count => format!("{count} small pieces"),
        };
        lines.push(format!(
            "{dropped} of {} vertices, of {pieces}, follow the nearest vertex of the rest",
            mesh.n_vertices()
        ));
    }
    let (count, largest) = pieces(&repaired.mesh);
    if largest < LARGEST {
        lines.push(format!(
            "the mesh is {count} pieces, of which the largest has {:.2} % of the area; a map of them means little: merge vertices \
             that are near each other in the program that made the file",
            100.0 * largest
        ));
    }
    lines.join("\n")
}

/// How many connected components there are, and the share of the area that the largest has.
fn pieces(mesh: &Mesh) -> (usize, f64) {
    let components = Topology::new(mesh).components();
    let mut areas = vec![0.0; components.count];
    for (face, area) in mesh.faces().iter().zip(mesh.face_areas()) {
        areas[components.of_vertex[face[0] as usize] as usize] += area;
    }
    (components.count, areas.iter().fold(0.0, |a: f64, &b| a.max(b)) / mesh.area())
}
