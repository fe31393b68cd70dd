//! What a mesh is and what is wrong with it.

use super::geometry::is_degenerate;
use super::repair::{RepairOptions, RepairReport, repair, repeated_faces, weld};
use super::topology::NONE;
use super::{Mesh, Topology, vec3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// How many elements of each defect, and how many components, a report names.
const MAX_EXAMPLES: usize = 5;

/// The elements with a defect: how many, and the first few. Vertices and faces are indices, edges pairs of vertices.
#[derive(Clone, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Found<T> {
    /// How many there are.
    pub count: usize,
    /// The first five at most, by index.
    pub examples: Vec<T>,
}

impl<T: Clone> Found<T> {
    fn new(all: &[T]) -> Self {
        Self { count: all.len(), examples: all[..all.len().min(MAX_EXAMPLES)].to_vec() }
    }
}

/// The size of a connected component.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct ComponentSize {
    /// Its vertices.
    pub n_vertices: usize,
    /// Its faces.
    pub n_faces: usize,
    /// Its area, in squared units of the file.
    pub area: f64,
}

/// What [`inspect`] finds. Indices are 0-based, lengths in the file's unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshReport {
    /// Number of vertices.
    pub n_vertices: usize,
    /// Number of faces.
    pub n_faces: usize,
    /// Total area, in squared units of the file.
    pub area: f64,
    /// Lowest and highest coordinates; none without vertices.
    pub bounding_box: Option<[[f64; 3]; 2]>,
    /// Mean length of the edges; 0 without edges.
    pub mean_edge_length: f64,
    /// Vertices at the position of an earlier one.
    pub duplicate_vertices: Found<u32>,
    /// Vertices of no face, or only of faces that repeat a vertex.
    pub unreferenced_vertices: Found<u32>,
    /// Faces that repeat a vertex or have no area.
    pub degenerate_faces: Found<u32>,
    /// Faces with the vertices of an earlier one.
    pub duplicate_faces: Found<u32>,
    /// Edges of more than two faces.
    pub non_manifold_edges: Found<[u32; 2]>,
    /// Vertices where surfaces touch in a point only.
    pub non_manifold_vertices: Found<u32>,
    /// Edges whose two faces have opposite orientations.
    pub inconsistent_edges: Found<[u32; 2]>,
    /// Number of connected components.
    pub n_components: usize,
    /// The five largest components at most, by descending area.
    pub largest_components: Vec<ComponentSize>,
    /// Number of boundary loops.
    pub n_boundary_loops: usize,
    /// Length of the longest boundary loop; 0 without boundary.
    pub longest_boundary_loop: f64,
    /// Vertices minus edges plus faces.
    pub euler_characteristic: i64,
    /// Number of handles of all components together, where the surface is closed, manifold and orientable.
    pub genus: Option<usize>,
    /// What [`repair`](repair()) with default options does to the mesh, or why it cannot.
    pub repair: Result<RepairReport, String>,
}

impl MeshReport {
    /// Whether nothing is wrong: the pipeline takes the mesh as it is.
    pub fn is_clean(&self) -> bool {
        matches!(self.repair, Ok(report) if report.is_unchanged())
    }
}

/// Measures a mesh and looks for every defect that [`repair`](repair()) treats.
pub fn inspect(mesh: &Mesh) -> MeshReport {
    let topology = Topology::new(mesh);
    let components = component_sizes(mesh, &topology);
    let loops: Vec<f64> = topology.boundary_loops().iter().map(|l| loop_length(mesh, l)).collect();
    let lengths = topology.edges().iter().map(|&[i, j]| length(mesh, i, j));
    let ends = |edges: Vec<u32>| -> Vec<[u32; 2]> {
        edges.into_iter().map(|e| topology.edges()[e as usize]).collect()
    };
    let repair =
        repair(mesh, &RepairOptions::default()).map(|repaired| repaired.report).map_err(|e| e.to_string());
    let euler_characteristic = topology.euler_characteristic();
    let is_orientable = matches!(repair, Ok(report) if report.unorientable_edges == 0);
    let has_genus = topology.is_closed() && topology.is_manifold() && is_orientable;
    MeshReport {
        n_vertices: mesh.n_vertices(),
        n_faces: mesh.n_faces(),
        area: mesh.area(),
        bounding_box: mesh.bounding_box(),
        mean_edge_length: lengths.sum::<f64>() / topology.edges().len().max(1) as f64,
        duplicate_vertices: Found::new(&duplicate_vertices(mesh)),
        unreferenced_vertices: Found::new(&unreferenced_vertices(&topology)),
        degenerate_faces: Found::new(&degenerate_faces(mesh)),
        duplicate_faces: Found::new(&duplicate_faces(mesh)),
        non_manifold_edges: Found::new(&ends(topology.non_manifold_edges())),
        non_manifold_vertices: Found::new(&topology.non_manifold_vertices()),
        inconsistent_edges: Found::new(&ends(topology.inconsistent_edges())),
        n_components: components.len(),
        largest_components: components[..components.len().min(MAX_EXAMPLES)].to_vec(),
        n_boundary_loops: loops.len(),
        longest_boundary_loop: loops.iter().fold(0.0, |a, &b| a.max(b)),
        euler_characteristic,
        genus: has_genus.then(|| ((2 * components.len() as i64 - euler_characteristic) / 2) as usize),
        repair,
    }
}

fn length(mesh: &Mesh, i: u32, j: u32) -> f64 {
    vec3::distance(mesh.vertices()[i as usize], mesh.vertices()[j as usize])
}

fn loop_length(mesh: &Mesh, vertices: &[u32]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    vertices.iter().zip(next).map(|(&i, &j)| length(mesh, i, j)).sum()
}

fn duplicate_vertices(mesh: &Mesh) -> Vec<u32> {
    (0..).zip(weld(mesh)).filter(|(i, first)| i != first).map(|(i, _)| i).collect()
}

fn unreferenced_vertices(topology: &Topology) -> Vec<u32> {
    let labels = topology.components().of_vertex;
    (0..).zip(labels).filter(|&(_, label)| label == NONE).map(|(i, _)| i).collect()
}

fn degenerate_faces(mesh: &Mesh) -> Vec<u32> {
    let diagonal = mesh.diagonal();
    (0..mesh.n_faces() as u32).filter(|&f| is_degenerate(mesh.corners(f as usize), diagonal)).collect()
}

fn duplicate_faces(mesh: &Mesh) -> Vec<u32> {
    let proper = |&(_, [a, b, c]): &(u32, [u32; 3])| a != b && b != c && c != a;
    repeated_faces(&(0..).zip(mesh.faces().iter().copied()).filter(proper).collect::<Vec<_>>())
}

/// The components, the largest area first.
fn component_sizes(mesh: &Mesh, topology: &Topology) -> Vec<ComponentSize> {
    let components = topology.components();
    let mut sizes = vec![ComponentSize::default(); components.count];
    for &label in components.of_vertex.iter().filter(|&&label| label != NONE) {
        sizes[label as usize].n_vertices += 1;
    }
    for f in (0..mesh.n_faces()).filter(|&f| topology.edge_of(3 * f as u32) != NONE) {
        let size = &mut sizes[components.of_vertex[mesh.faces()[f][0] as usize] as usize];
        size.n_faces += 1;
        size.area += mesh.face_area(f);
    }
    sizes.sort_by(|a, b| b.area.total_cmp(&a.area));
    sizes
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "size        {} vertices, {} faces", self.n_vertices, self.n_faces)?;
        if let Some([low, high]) = self.bounding_box {
            let sides = [0, 1, 2].map(|i| high[i] - low[i]);
            writeln!(f, "extent      {:.4} x {:.4} x {:.4}, from {low:.4?}", sides[0], sides[1], sides[2])?;
        }
        writeln!(f, "area        {:.6}, mean edge {:.6}", self.area, self.mean_edge_length)?;
        self.write_topology(f)?;
        self.write_defects(f)?;
        match &self.repair {
            Ok(report) => write!(f, "repair      {report}"),
            Err(reason) => write!(f, "repair      impossible: {reason}"),
        }
    }
}

impl MeshReport {
    fn write_topology(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let genus = self.genus.map_or(String::new(), |genus| format!(", genus {genus}"));
        let boundary = match self.n_boundary_loops {
            0 => "closed".to_string(),
            n => format!("{n} boundary loops, the longest {:.4}", self.longest_boundary_loop),
        };
        writeln!(f, "topology    {boundary}, Euler characteristic {}{genus}", self.euler_characteristic)?;
        if self.n_components > 1 {
            let share = |c: &ComponentSize| {
                format!("{} vertices ({:.3} %)", c.n_vertices, 100.0 * c.area / self.area)
            };
            let sizes: Vec<String> = self.largest_components.iter().map(share).collect();
            let rest = if self.n_components > sizes.len() { ", ..." } else { "" };
            writeln!(f, "components  {}: {}{rest}", self.n_components, sizes.join(", "))?;
        }
        Ok(())
    }

    fn write_defects(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let vertices = [
            (&self.duplicate_vertices, "vertices at the position of an earlier one"),
            (&self.unreferenced_vertices, "vertices of no face"),
            (&self.non_manifold_vertices, "vertices where surfaces touch in a point"),
            (&self.degenerate_faces, "faces without area"),
            (&self.duplicate_faces, "faces with the vertices of an earlier one"),
        ];
        let edges = [
            (&self.non_manifold_edges, "edges of more than two faces"),
            (&self.inconsistent_edges, "edges between faces of opposite orientation"),
        ];
        vertices.iter().try_for_each(|(found, what)| write_found(f, found, what, u32::to_string))?;
        edges.iter().try_for_each(|(found, what)| write_found(f, found, what, |[i, j]| format!("{i}-{j}")))
    }
}

fn write_found<T>(
    f: &mut fmt::Formatter,
    found: &Found<T>,
    what: &str,
    name: impl Fn(&T) -> String,
) -> fmt::Result {
    if found.count == 0 {
        return Ok(());
    }
    let names: Vec<String> = found.examples.iter().map(name).collect();
    let rest = if found.count > names.len() { ", ..." } else { "" };
    writeln!(f, "problem     {} {what}: {}{rest}", found.count, names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn report(name: &str) -> MeshReport {
        inspect(&shapes::zoo().into_iter().find(|(n, _)| *n == name).expect("a shape of the zoo").1)
    }

    #[test]
    fn every_defect_of_the_zoo_is_reported() {
        assert_eq!(report("with_unreferenced_vertices").unreferenced_vertices.examples, [0, 21, 164]);
        assert_eq!(report("with_degenerate_faces").degenerate_faces.examples, [0, 321, 322]);
        let duplicates = report("with_duplicates");
        assert_eq!((duplicates.duplicate_vertices.count, duplicates.duplicate_faces.count), (16, 2));
        assert_eq!(duplicates.duplicate_vertices.examples.len(), MAX_EXAMPLES);
        assert_eq!(report("bowtie_vertex").non_manifold_vertices.examples, [0]);
        assert_eq!(report("non_manifold_edge").non_manifold_edges.examples, [[0, 1], [1, 2], [2, 3], [3, 4]]);
        assert!(report("flipped_faces").inconsistent_edges.count > 0);
        let two = report("two_components");
        assert_eq!((two.n_components, two.largest_components[0].n_vertices), (2, 162));
        assert_eq!(two.largest_components.iter().map(|c| c.n_faces).sum::<usize>(), two.n_faces);
        let half = report("open_half_sphere");
        assert_eq!(half.n_boundary_loops, 1);
        assert!((half.longest_boundary_loop / std::f64::consts::TAU - 1.0).abs() < 0.01);
    }

    #[test]
    fn clean_is_what_the_pipeline_leaves_alone() {
        let clean = ["icosphere", "grid", "torus", "bumpy_sphere", "open_half_sphere", "two_components"];
        for (name, mesh) in shapes::zoo() {
            assert_eq!(inspect(&mesh).is_clean(), clean.contains(&name), "{name}");
        }
    }

    #[test]
    fn genus_of_closed_surfaces() {
        for (name, genus) in [
            ("icosphere", Some(0)),
            ("torus", Some(1)),
            ("two_components", Some(0)),
            ("grid", None),
            ("bowtie_vertex", None),
        ] {
            assert_eq!(report(name).genus, genus, "{name}");
        }
    }

    #[test]
    fn measures_of_a_square() {
        let square = report("grid");
        assert_eq!(square.bounding_box, Some([[0.0; 3], [1.0, 1.0, 0.0]]));
        assert!((square.area - 1.0).abs() < 1e-14);
        assert!((square.longest_boundary_loop - 4.0).abs() < 1e-14);
        assert!(square.mean_edge_length > 0.125 && square.mean_edge_length < 0.25);
    }

    #[test]
    fn text_names_the_problems_and_the_repair() {
        let text = report("with_degenerate_faces").to_string();
        assert!(text.contains("3 faces without area: 0, 321, 322"), "{text}");
        assert!(text.contains("3 degenerate faces dropped"), "{text}");
        let text = report("icosphere").to_string();
        assert!(
            text.contains("closed") && text.contains("genus 0") && text.contains("nothing to repair"),
            "{text}"
        );
        let text = inspect(&Mesh::new(vec![[0.0; 3]; 3], vec![]).unwrap()).to_string();
        assert!(text.contains("impossible"), "{text}");
    }

    #[test]
    fn report_round_trips_through_json() {
        for (name, mesh) in shapes::zoo() {
            let report = inspect(&mesh);
            let parsed: MeshReport = serde_json::from_str(&serde_json::to_string(&report).unwrap()).unwrap();
            // By their text, as the parser may round the last digit of a number.
            assert_eq!(parsed.to_string(), report.to_string(), "{name}");
        }
    }

    #[test]
    fn an_empty_mesh_has_a_report() {
        let report = inspect(&Mesh::default());
        assert_eq!((report.area, report.bounding_box, report.mean_edge_length), (0.0, None, 0.0));
        assert!(report.repair.is_err());
    }
}
