//! From the vertices that quantities live on to those of the input, and back.

use crate::Mesh;

/// Index maps between the input mesh, the repaired mesh ("full") and the mesh that quantities live on ("work"), which is the
/// full one or a decimated one.
#[derive(Clone, Debug, PartialEq)]
pub struct WayBack {
    /// Input vertex of each vertex of the full mesh, `[n_full]`.
    pub input_of_full: Vec<u32>,
    /// For each input vertex its vertex of the full mesh, [`WayBack::NONE`] where repair dropped it, `[n_input]`.
    pub full_of_input: Vec<u32>,
    /// For each vertex of the decimated mesh its vertex of the full mesh, `[n]`; `None` where nothing was decimated.
    pub full_of_work: Option<Vec<u32>>,
}

impl WayBack {
    /// Stands in index maps for "no such vertex".
    pub const NONE: u32 = u32::MAX;

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
    }
}
