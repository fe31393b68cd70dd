//! Turns faces round so that neighbours agree and closed surfaces have their normals outside.

use super::{RepairReport, Sheets};
use crate::Mesh;
use crate::mesh::{Topology, vec3};

/// Which faces are to be turned round. In each component the orientation with the larger area stays, but where the
/// component is closed, or nearly (its boundary is shorter than half the square root of its area), it encloses a
/// positive volume.
pub(super) fn orient(mesh: &Mesh, sheets: &Sheets, report: &mut RepairReport) -> Vec<bool> {
    let topology = Topology::of_faces(&sheets.faces, sheets.vertex_of_fan.len());
    let mut flipped = vec![None; sheets.faces.len()];
    for seed in 0..sheets.faces.len() {
        if flipped[seed].is_none() {
            let patch = spread(&topology, seed, &mut flipped);
            if is_inside_out(mesh, sheets, &topology, &patch, &flipped) {
                for &f in &patch {
                    flipped[f] = flipped[f].map(|flip| !flip);
                }
            }
        }
    }
    let flipped: Vec<bool> = flipped.into_iter().map(|flip| flip == Some(true)).collect();
    report.flipped_faces = flipped.iter().filter(|&&flip| flip).count();
    report.unorientable_edges =
        (0..topology.edges().len()).filter(|&e| !agree(&topology, e, &flipped)).count();
    flipped
}

/// Gives all faces that edges connect to `seed` the orientation of `seed`, and returns them.
fn spread(topology: &Topology, seed: usize, flipped: &mut [Option<bool>]) -> Vec<usize> {
    flipped[seed] = Some(false);
    let mut patch = vec![seed];
    let mut next = 0;
    while next < patch.len() {
        let face = patch[next];
        next += 1;
        for half_edge in [0, 1, 2].map(|c| (3 * face + c) as u32) {
            let &[g, h] = topology.half_edges(topology.edge_of(half_edge) as usize) else { continue };
            let other = if g == half_edge { h } else { g };
            let neighbor = other as usize / 3;
            if flipped[neighbor].is_none() {
                let same_direction = topology.ends(half_edge)[0] == topology.ends(other)[0];
                flipped[neighbor] = flipped[face].map(|flip| flip != same_direction);
                patch.push(neighbor);
            }
        }
    }
    patch
}

/// Whether the two faces of an edge, turned as they are to be, run along it in opposite directions.
fn agree(topology: &Topology, edge: usize, flipped: &[bool]) -> bool {
    let &[g, h] = topology.half_edges(edge) else { return true };
    let same_direction = topology.ends(g)[0] == topology.ends(h)[0];
    same_direction == (flipped[g as usize / 3] != flipped[h as usize / 3])
}

/// Whether a consistently oriented patch is to be turned round as a whole.
fn is_inside_out(
    mesh: &Mesh,
    sheets: &Sheets,
    topology: &Topology,
    patch: &[usize],
    flipped: &[Option<bool>],
) -> bool {
    let input = |f: usize| sheets.input_faces[f] as usize;
    let (mut area, mut flipped_area, mut boundary) = (0.0, 0.0, 0.0);
    let mut center = [0.0; 3];
    for &f in patch {
        let corners = mesh.corners(input(f));
        let face_area = mesh.face_area(input(f));
        area += face_area;
        flipped_area += if flipped[f] == Some(true) { face_area } else { 0.0 };
        let sum = vec3::add(vec3::add(corners[0], corners[1]), corners[2]);
        center = vec3::add(center, vec3::scale(sum, face_area / 3.0));
        for k in 0..3 {
            if topology.n_faces_of(topology.edge_of((3 * f + k) as u32) as usize) == 1 {
                boundary += vec3::distance(corners[k], corners[(k + 1) % 3]);
            }
        }
    }
    if boundary > 0.5 * area.sqrt() {
        return flipped_area > 0.5 * area;
    }
    // Six times the volume between the patch and its centre, which a cone over each hole closes.
    center = vec3::scale(center, 1.0 / area);
    let volume = patch.iter().fold(0.0, |volume, &f| {
        let [a, b, c] = mesh.corners(input(f)).map(|p| vec3::sub(p, center));
        let cone = vec3::dot(a, vec3::cross(b, c));
        if flipped[f] == Some(true) { volume - cone } else { volume + cone }
    });
    // A pillow of two like faces encloses nothing.
    if volume.abs() > 1e-9 * area.powf(1.5) { volume < 0.0 } else { flipped_area > 0.5 * area }
}
