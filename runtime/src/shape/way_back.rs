//! From the vertices that quantities live on to those of the input, and back.

use crate::Mesh;
use crate::mesh::{Repaired, nearest_vertices};

/// Index maps between the input mesh, the repaired mesh ("full") and the mesh that quantities live on ("work"), which
/// is the full one or a decimated one.
#[derive(Clone, Debug, PartialEq)]
pub struct WayBack {
    /// Input vertex of each vertex of the full mesh, of one that subdivision made the nearest, `[n_full]`.
    pub input_of_full: Vec<u32>,
    /// For each input vertex its vertex of the full mesh, `[n_input]`: of one that repair left out the nearest, of
    /// one without a face [`WayBack::NONE`].
    pub full_of_input: Vec<u32>,
    /// Input vertices that repair left out, ascending: of small pieces and of faces without area.
    pub followers: Vec<u32>,
    /// For each vertex of the decimated mesh its vertex of the full mesh, `[n]`; `None` where nothing was decimated.
    pub full_of_work: Option<Vec<u32>>,
}

impl WayBack {
    /// Stands in index maps for "no such vertex".
    pub const NONE: u32 = u32::MAX;

    /// From the repaired mesh of an input; `full` is the repaired mesh or one that begins with its vertices.
    pub(super) fn of_repaired(input: &Mesh, repaired: &Repaired, full: &Mesh) -> Self {
        let mut full_of_input: Vec<u32> =
            repaired.repaired_of_input.iter().map(|v| v.unwrap_or(Self::NONE)).collect();
        let dropped = &repaired.dropped_vertices;
        let places: Vec<[f64; 3]> = dropped.iter().map(|&v| input.vertices()[v as usize]).collect();
        for (&vertex, nearest) in dropped.iter().zip(nearest_vertices(full.vertices(), &places)) {
            full_of_input[vertex as usize] = nearest;
        }
        let followers = dropped.clone();
        Self {
            input_of_full: repaired.input_of_repaired.clone(),
            full_of_input,
            followers,
            full_of_work: None,
        }
    }

    /// Of a mesh that nothing was done to.
    pub(super) fn identity(n: usize) -> Self {
        let all: Vec<u32> = (0..n as u32).collect();
        Self { input_of_full: all.clone(), full_of_input: all, followers: Vec::new(), full_of_work: None }
    }

    /// The same for a subdivided full mesh, of which the nearest vertices of the one before are given, `[n_full]`.
    pub(super) fn subdivided(self, nearest: &[u32]) -> Self {
        let input_of_full = nearest.iter().map(|&v| self.input_of_full[v as usize]).collect();
        Self { input_of_full, ..self }
    }

    /// Vertex of the full mesh of a vertex of the working mesh.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn full_of_work(&self, vertex: u32) -> u32 {
        self.full_of_work.as_ref().map_or(vertex, |injection| injection[vertex as usize])
    }

    /// Input vertex of a vertex of the working mesh.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn input_of_work(&self, vertex: u32) -> u32 {
        self.input_of_full[self.full_of_work(vertex) as usize]
    }

    /// For each input vertex its vertex of the working mesh, [`WayBack::NONE`] where it has none, `[n_input]`.
    pub fn work_of_input(&self) -> Vec<u32> {
        let Some(injection) = &self.full_of_work else { return self.full_of_input.clone() };
        let mut work_of_full = vec![Self::NONE; self.input_of_full.len()];
        for (work, &full) in injection.iter().enumerate() {
            work_of_full[full as usize] = work as u32;
        }
        let work_of = |&full: &u32| work_of_full.get(full as usize).copied().unwrap_or(Self::NONE);
        self.full_of_input.iter().map(work_of).collect()
    }

    /// Whether every index exists.
    pub(super) fn fits(&self, full: &Mesh, work: Option<&Mesh>) -> bool {
        let below = |indices: &[u32], limit: usize| indices.iter().all(|&i| (i as usize) < limit);
        let or_none = |&i: &u32| i == Self::NONE || (i as usize) < full.n_vertices();
        let injected = match (&self.full_of_work, work) {
            (None, None) => true,
            (Some(injection), Some(work)) => {
                injection.len() == work.n_vertices() && below(injection, full.n_vertices())
            }
            _ => false,
        };
        injected
            && self.input_of_full.len() == full.n_vertices()
            && below(&self.input_of_full, self.full_of_input.len())
            && self.full_of_input.iter().all(or_none)
            && below(&self.followers, self.full_of_input.len())
    }
}
