//! Repair: from any triangles to an oriented manifold with boundary, with the way back to the input's vertices.

mod cut;
mod faces;
pub(crate) use faces::repeated_faces;
pub(super) use faces::weld;
mod near;
pub(crate) use near::weld_near;
mod orient;

use super::Mesh;
use super::topology::{NONE, components};
use serde::{Deserialize, Serialize};
use std::fmt;
use thiserror::Error;

/// What [`repair`](repair()) does besides the necessary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct RepairOptions {
    /// Take vertices at one position, or on a boundary and 1e-5 of the bounding box's diagonal apart, as one where
    /// their faces fit together. Default true.
    pub weld: bool,
    /// Drop connected components whose area is below this share of the largest component's. Range 0 (keep all) to 1,
    /// default 0.01: such are buttons, teeth, eyes and debris of the scanner. Each would take an eigenfunction from
    /// the body.
    pub min_component_area: f64,
}

impl Default for RepairOptions {
    fn default() -> Self {
        Self { weld: true, min_component_area: 0.01 }
    }
}

/// A mesh fit for the Laplacian, and how it relates to the input.
#[derive(Clone, Debug, PartialEq)]
pub struct Repaired {
    /// An oriented manifold with boundary: each edge has one or two faces, each vertex one fan of faces and at least
    /// one.
    pub mesh: Mesh,
    /// For every input vertex its vertex in `mesh`, at its position or near it, `[n_input]`. `None`: it has no
    /// counterpart, as no face that remains has a vertex there.
    pub repaired_of_input: Vec<Option<u32>>,
    /// For every vertex of `mesh` an input vertex at the same position, `[n_repaired]`.
    pub input_of_repaired: Vec<u32>,
    /// Input vertices without counterpart that have a place on the surface, ascending: all their faces were of tiny
    /// components or without area.
    pub dropped_vertices: Vec<u32>,
    /// What was done.
    pub report: RepairReport,
}

/// What [`repair`](repair()) did, by counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RepairReport {
    /// Input vertices joined to another one at the same position or near it.
    pub welded_vertices: usize,
    /// Faces dropped as they repeat a vertex or have no area.
    pub degenerate_faces: usize,
    /// Faces dropped as an earlier face has the same vertices.
    pub duplicate_faces: usize,
    /// Copies of vertices made to cut sheets apart at non-manifold edges and vertices.
    pub cut_vertices: usize,
    /// Faces turned round.
    pub flipped_faces: usize,
    /// Edges where the orientation cannot be made consistent, as on a Moebius strip.
    pub unorientable_edges: usize,
    /// Components dropped for their size.
    pub dropped_components: usize,
    /// Input vertices of those and of degenerate faces, which follow the nearest vertex that remains.
    pub dropped_vertices: usize,
    /// Input vertices of no face.
    pub unmatched_vertices: usize,
}

impl RepairReport {
    /// Whether the mesh was returned as it came.
    pub fn is_unchanged(&self) -> bool {
        Self { unorientable_edges: 0, ..*self } == Self::default()
    }
}

impl fmt::Display for RepairReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let parts = [
            (self.welded_vertices, "duplicate vertices welded"),
            (self.degenerate_faces, "degenerate faces dropped"),
            (self.duplicate_faces, "duplicate faces dropped"),
            (self.cut_vertices, "vertices added to cut non-manifold places apart"),
            (self.flipped_faces, "faces turned round"),
            (self.unorientable_edges, "edges left that cannot be oriented"),
            (self.dropped_components, "tiny components left out"),
            (self.dropped_vertices, "vertices without a face left follow the nearest of the rest"),
            (self.unmatched_vertices, "vertices left without a match"),
        ];
        let done: Vec<String> =
            parts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
        f.write_str(if done.is_empty() { "nothing to repair" } else { "" })?;
        f.write_str(&done.join(", "))
    }
}

/// Why a mesh cannot be repaired.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RepairError {
    /// There are no faces, as in a point cloud.
    #[error("the mesh has {n_vertices} vertices but no faces; reconstruct a surface from the points first")]
    NoFaces {
        /// How many vertices there are.
        n_vertices: usize,
    },
    /// All faces repeat a vertex or have no area.
    #[error(
        "none of the {n_faces} faces has an area (face {example} has the corners {corners:?}); check the file's \
         coordinates and the precision it was written with"
    )]
    NoArea {
        /// How many faces there are.
        n_faces: usize,
        /// One of them, 0-based.
        example: usize,
        /// The positions of its corners.
        corners: [[f64; 3]; 3],
    },
    /// An option is out of range.
    #[error("min_component_area is {value}, but must be between 0 and 1")]
    MinComponentArea {
        /// The value given.
        value: f64,
    },
}

/// Makes an oriented manifold with boundary of any mesh.
///
/// In order: vertices at identical positions, and near ones on a boundary, are taken as one; faces without area and
/// repeated faces go; sheets that meet in a non-manifold edge or vertex are cut apart there, each with a copy of the
/// vertices; components that are tiny and vertices without a face go; faces are turned round to agree with their
/// neighbours, and so that a closed surface has its normals outside.
///
/// Vertices are welded per fan: two vertices at one place become one only where edges join their faces around that
/// position. Surfaces that merely touch stay apart, and a mesh in which nothing is wrong comes back bit for bit with
/// the identity as its map.
///
/// Left alone are holes, self-intersections, the seam of a surface that cannot be oriented, and slivers that have some
/// area: the Laplacian has to bear large cotangents of either sign there.
///
/// # Errors
/// If there are no faces, none of them has an area, or an option is out of range.
pub fn repair(mesh: &Mesh, options: &RepairOptions) -> Result<Repaired, RepairError> {
    if !(0.0..=1.0).contains(&options.min_component_area) {
        return Err(RepairError::MinComponentArea { value: options.min_component_area });
    }
    if mesh.n_faces() == 0 {
        return Err(RepairError::NoFaces { n_vertices: mesh.n_vertices() });
    }
    let mut report = RepairReport::default();
    let welded = if options.weld { weld_near(mesh) } else { (0..mesh.n_vertices() as u32).collect() };
    let (kept, degenerate) = faces::proper_faces(mesh, &welded, &mut report);
    if kept.is_empty() {
        let corners = mesh.corners(0);
        return Err(RepairError::NoArea { n_faces: mesh.n_faces(), example: 0, corners });
    }
    let mut sheets = cut::cut_apart(mesh, &welded, kept);
    sheets.dropped_faces = degenerate;
    drop_tiny_components(mesh, &mut sheets, options.min_component_area, &mut report);
    let flipped = orient::orient(mesh, &sheets, &mut report);
    Ok(assemble(mesh, &welded, &sheets, &flipped, report))
}

/// The faces that remain, on vertices that are fans of the welded mesh.
struct Sheets {
    /// The input face of each.
    input_faces: Vec<u32>,
    /// Fans of the corners, in the order of the input face's corners.
    faces: Vec<[u32; 3]>,
    /// The welded vertex of each fan, ascending.
    vertex_of_fan: Vec<u32>,
    /// The input faces without area and those of dropped components.
    dropped_faces: Vec<u32>,
}

impl Sheets {
    /// The fans with their vertices as the faces of the input name them.
    fn corners<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = (u32, u32, u32)> + 'a {
        self.faces.iter().zip(&self.input_faces).flat_map(|(fans, &input_face)| {
            let vertices = mesh.faces()[input_face as usize];
            (0..3).map(move |c| (fans[c], vertices[c], input_face))
        })
    }
}

fn drop_tiny_components(mesh: &Mesh, sheets: &mut Sheets, min_area: f64, report: &mut RepairReport) {
    let components = components(sheets.faces.iter().copied(), sheets.vertex_of_fan.len());
    let component_of = |face: &[u32; 3]| components.of_vertex[face[0] as usize] as usize;
    let mut areas = vec![0.0; components.count];
    for (face, &input_face) in sheets.faces.iter().zip(&sheets.input_faces) {
        areas[component_of(face)] += mesh.face_area(input_face as usize);
    }
    let limit = min_area * areas.iter().fold(0.0, |a: f64, &b| a.max(b));
    report.dropped_components = areas.iter().filter(|&&area| area < limit).count();
    if report.dropped_components > 0 {
        let keep: Vec<bool> = sheets.faces.iter().map(|face| areas[component_of(face)] >= limit).collect();
        let mut kept = keep.iter();
        sheets.faces.retain(|_| *kept.next().expect("one flag per face"));
        let dropped = sheets.input_faces.iter().zip(&keep).filter(|(_, keep)| !**keep);
        sheets.dropped_faces.extend(dropped.map(|(&face, _)| face));
        let mut kept = keep.iter();
        sheets.input_faces.retain(|_| *kept.next().expect("one flag per face"));
    }
}

/// Numbers the vertices that remain by input vertex and makes the maps.
fn assemble(
    mesh: &Mesh,
    welded: &[u32],
    sheets: &Sheets,
    flipped: &[bool],
    mut report: RepairReport,
) -> Repaired {
    let n_fans = sheets.vertex_of_fan.len();
    let mut input_of_fan = vec![NONE; n_fans];
    for (fan, vertex, _) in sheets.corners(mesh) {
        let input = &mut input_of_fan[fan as usize];
        *input = vertex.min(*input);
    }
    let mut order: Vec<u32> = (0..n_fans as u32).filter(|&fan| input_of_fan[fan as usize] != NONE).collect();
    order.sort_by_key(|&fan| (input_of_fan[fan as usize], fan));
    let mut repaired_of_fan = vec![NONE; n_fans];
    for (new, &fan) in order.iter().enumerate() {
        repaired_of_fan[fan as usize] = new as u32;
    }
    let input_of_repaired: Vec<u32> = order.iter().map(|&fan| input_of_fan[fan as usize]).collect();
    let vertices = input_of_repaired.iter().map(|&i| mesh.vertices()[i as usize]).collect();
    let faces = sheets.faces.iter().zip(flipped).map(|(&[a, b, c], &flip)| {
        let face = if flip { [a, c, b] } else { [a, b, c] };
        face.map(|fan| repaired_of_fan[fan as usize])
    });
    let mesh_out = Mesh::new(vertices, faces.collect()).expect("a part of a valid mesh is valid");
    let fan_of_input = largest_fans(mesh, welded, sheets);
    let repaired_of_input: Vec<Option<u32>> =
        fan_of_input.iter().map(|&fan| (fan != NONE).then(|| repaired_of_fan[fan as usize])).collect();
    let dropped_vertices = dropped_vertices(mesh, welded, &sheets.dropped_faces, &repaired_of_input);
    report.dropped_vertices = dropped_vertices.len();
    report.unmatched_vertices =
        repaired_of_input.iter().filter(|r| r.is_none()).count() - dropped_vertices.len();
    let mut is_image = vec![false; input_of_repaired.len()];
    repaired_of_input.iter().flatten().for_each(|&r| is_image[r as usize] = true);
    let n_images = is_image.iter().filter(|&&i| i).count();
    report.cut_vertices = input_of_repaired.len() - n_images;
    report.welded_vertices =
        mesh.n_vertices() - report.unmatched_vertices - report.dropped_vertices - n_images;
    Repaired { mesh: mesh_out, repaired_of_input, input_of_repaired, dropped_vertices, report }
}

/// The vertices without counterpart at the places of dropped faces.
fn dropped_vertices(
    mesh: &Mesh,
    welded: &[u32],
    dropped_faces: &[u32],
    repaired_of_input: &[Option<u32>],
) -> Vec<u32> {
    let mut is_dropped = vec![false; mesh.n_vertices()];
    for &face in dropped_faces {
        mesh.faces()[face as usize].iter().for_each(|&v| is_dropped[welded[v as usize] as usize] = true);
    }
    let lost = |&v: &u32| repaired_of_input[v as usize].is_none() && is_dropped[welded[v as usize] as usize];
    (0..mesh.n_vertices() as u32).filter(lost).collect()
}

/// For every input vertex the fan with the largest area among those its own corners are in, else among all at its
/// position; the first of equals.
fn largest_fans(mesh: &Mesh, welded: &[u32], sheets: &Sheets) -> Vec<u32> {
    let mut area_of_fan = vec![0.0; sheets.vertex_of_fan.len()];
    for (fan, _, face) in sheets.corners(mesh) {
        area_of_fan[fan as usize] += mesh.face_area(face as usize);
    }
    let better = |fan: u32, best: u32| {
        best == NONE
            || (area_of_fan[fan as usize], std::cmp::Reverse(fan))
                > (area_of_fan[best as usize], std::cmp::Reverse(best))
    };
    let mut own = vec![NONE; mesh.n_vertices()];
    let mut at_position = vec![NONE; mesh.n_vertices()];
    for (fan, vertex, _) in sheets.corners(mesh) {
        for best in [&mut own[vertex as usize], &mut at_position[welded[vertex as usize] as usize]] {
            if better(fan, *best) {
                *best = fan;
            }
        }
    }
    own.iter().zip(welded).map(|(&own, &w)| if own == NONE { at_position[w as usize] } else { own }).collect()
}

#[cfg(test)]
mod tests;
