//! The null space of the stiffness matrix: functions constant on each connected component.

use crate::spectral::SparseMatrix;

/// Weight of an edge, relative to the larger diagonal entry of its ends, below which it connects nothing.
const NEGLIGIBLE: f64 = 1e-14;

/// Connected components of the graph of a stiffness matrix.
pub(super) struct Components {
    /// Component of every vertex, `[n]`; components are numbered by descending area.
    pub(super) of_vertex: Vec<u32>,
    /// Sum of the masses of each component, descending.
    pub(super) areas: Vec<f64>,
}

impl Components {
    pub(super) fn new(stiffness: &SparseMatrix, mass: &[f64]) -> Self {
        let mut parents: Vec<u32> = (0..stiffness.n() as u32).collect();
        let diagonal = stiffness.diagonal();
        for i in 0..stiffness.n() {
            for (j, weight) in stiffness.row(i).take_while(|&(j, _)| j < i) {
                if weight.abs() > NEGLIGIBLE * diagonal[i].abs().max(diagonal[j].abs()) {
                    union(&mut parents, i as u32, j as u32);
                }
            }
        }
        Self::number(&mut parents, mass)
    }

    fn number(parents: &mut [u32], mass: &[f64]) -> Self {
        let roots: Vec<u32> = (0..parents.len() as u32).map(|i| root(parents, i)).collect();
        let mut area_of_root = vec![0.0; mass.len()];
        for (&r, &area) in roots.iter().zip(mass) {
            area_of_root[r as usize] += area;
        }
        let mut order: Vec<usize> = (0..roots.len()).filter(|&i| roots[i] as usize == i).collect();
        order.sort_by(|&a, &b| area_of_root[b].total_cmp(&area_of_root[a]));
        let mut number_of_root = vec![0_u32; mass.len()];
        for (number, &r) in order.iter().enumerate() {
            number_of_root[r] = number as u32;
        }
        Self {
            of_vertex: roots.iter().map(|&r| number_of_root[r as usize]).collect(),
            areas: order.iter().map(|&r| area_of_root[r]).collect(),
        }
    }

    /// Number of components.
    pub(super) fn len(&self) -> usize {
        self.areas.len()
    }
}

/// The smallest vertex of `i`'s tree, halving the path on the way.
fn root(parents: &mut [u32], mut i: u32) -> u32 {
    while parents[i as usize] != i {
        let grandparent = parents[parents[i as usize] as usize];
        parents[i as usize] = grandparent;
        i = grandparent;
    }
    i
}

fn union(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_come_by_descending_area() {
        let stiffness =
            SparseMatrix::with_zero_row_sums(6, &[(0, 1, -1.0), (2, 4, -1.0), (4, 5, -1.0), (1, 4, 1e-18)]);
        let components = Components::new(&stiffness, &[1.0; 6]);
        assert_eq!(components.of_vertex, &[1, 1, 0, 2, 0, 0]);
        assert_eq!(components.areas, &[3.0, 2.0, 1.0]);
    }
}
