//! Which vertices are the same and which faces are worth keeping.

use super::RepairReport;
use crate::Mesh;
use crate::mesh::geometry::is_degenerate;
use std::collections::HashMap;

/// For every vertex the first one at the identical position. Zeros of either sign are identical.
pub(crate) fn weld(mesh: &Mesh) -> Vec<u32> {
    let mut first: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.n_vertices());
    let key = |p: &[f64; 3]| p.map(|x| (x + 0.0).to_bits());
    mesh.vertices().iter().enumerate().map(|(i, p)| *first.entry(key(p)).or_insert(i as u32)).collect()
}

/// The faces, by index and welded vertices, that have an area and whose vertices no earlier face has; and those
/// without area.
pub(super) fn proper_faces(
    mesh: &Mesh,
    welded: &[u32],
    report: &mut RepairReport,
) -> (Vec<(u32, [u32; 3])>, Vec<u32>) {
    let diagonal = mesh.diagonal();
    let faces = mesh.faces().iter().map(|face| face.map(|i| welded[i as usize]));
    let mut kept: Vec<(u32, [u32; 3])> = (0..).zip(faces).collect();
    let mut degenerate = Vec::new();
    kept.retain(|&(f, [a, b, c])| {
        let proper = a != b && b != c && c != a && !is_degenerate(mesh.corners(f as usize), diagonal);
        if !proper {
            degenerate.push(f);
        }
        proper
    });
    report.degenerate_faces = degenerate.len();
    let repeated = repeated_faces(&kept);
    report.duplicate_faces = repeated.len();
    kept.retain(|(f, _)| repeated.binary_search(f).is_err());
    (kept, degenerate)
}

/// The faces, ascending, whose vertices are those of an earlier one in whatever order.
pub(crate) fn repeated_faces(faces: &[(u32, [u32; 3])]) -> Vec<u32> {
    let mut keyed: Vec<([u32; 3], u32)> = faces
        .iter()
        .map(|&(f, mut face)| {
            face.sort_unstable();
            (face, f)
        })
        .collect();
    keyed.sort_unstable();
    let mut repeated: Vec<u32> = keyed.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1).collect();
    repeated.sort_unstable();
    repeated
}
