//! All vertices within a fixed radius of a vertex: a grid of cells, of which only the occupied ones are stored.

use std::ops::Range;

/// Cells along one radius. More of them enclose the sphere more tightly, but are more to visit.
const CELLS_PER_RADIUS: i64 = 2;

/// Rows of cells that a sphere around a point of a cell can touch; a row runs along x.
const ROWS: usize = (2 * CELLS_PER_RADIUS as usize + 1).pow(2);

/// Bits of a cell's coordinate. A mesh of more cells in one direction keeps its far points in the last
/// cell, which costs time, not neighbours: clamping never moves two cells apart.
const BITS: u32 = 21;

/// Coordinate of the cell in the middle.
const CENTER: i64 = 1 << (BITS - 1);

/// Number that the buffers of a neighbourhood are padded to a multiple of, for loops of fixed length.
pub(super) const LANES: usize = 8;

/// The points with a normal, sorted by cell, x fastest.
pub(super) struct Grid {
    /// Square of the radius.
    radius2: f64,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    normals: Vec<[f32; 3]>,
    /// Where each vertex stands in the order of the grid, and its cell; `None` for those without a normal.
    slots: Vec<Option<Slot>>,
    /// For each cell the ranges of points in the rows of cells around it.
    rows: Vec<[Range<u32>; ROWS]>,
}

#[derive(Clone, Copy)]
struct Slot {
    point: u32,
    cell: u32,
}

/// The neighbours of a vertex, without the vertex itself, as seen from it. The buffers are padded to a multiple of
/// [`LANES`] with zeros.
#[derive(Default)]
pub(super) struct Neighborhood {
    len: usize,
    /// Positions in the order of the grid, `[len]`.
    pub(super) points: Vec<u32>,
    /// Offsets from the vertex, by coordinate.
    pub(super) offsets: [Vec<f64>; 3],
    /// Squared distances.
    pub(super) distances2: Vec<f64>,
    /// Offsets in the local frame; filled by [`super::frame`].
    pub(super) local: [Vec<f32>; 3],
}

impl Neighborhood {
    /// Number of neighbours.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Length of the padded buffers.
    pub(super) fn padded_len(&self) -> usize {
        self.len.next_multiple_of(LANES)
    }

    fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    fn resize_buffers(&mut self, len: usize) {
        self.len = len;
        let padded = self.padded_len();
        if self.distances2.len() < padded {
            self.distances2.resize(padded, 0.0);
            self.offsets.iter_mut().for_each(|o| o.resize(padded, 0.0));
            self.local.iter_mut().for_each(|l| l.resize(padded, 0.0));
        }
        self.distances2[len..padded].fill(0.0);
        self.offsets.iter_mut().for_each(|o| o[len..padded].fill(0.0));
    }
}

impl Grid {
    /// A grid of those `positions` that have a normal, for neighbourhoods of `radius`.
    pub(super) fn new(positions: &[[f64; 3]], normals: &[Option<[f64; 3]>], radius: f64) -> Self {
        let origin = medians(positions);
        let cells_per_unit = CELLS_PER_RADIUS as f64 / radius;
        let mut keyed: Vec<(u64, u32)> = (0u32..)
            .zip(positions.iter().zip(normals))
            .filter(|(_, (_, normal))| normal.is_some())
            .map(|(i, (p, _))| {
                (key([0, 1, 2].map(|k| cell_coordinate((p[k] - origin[k]) * cells_per_unit))), i)
            })
            .collect();
        keyed.sort_unstable();

        let mut cells: Vec<(u64, u32)> = Vec::new();
        let mut slots = vec![None; positions.len()];
        for (point, &(key, vertex)) in (0u32..).zip(&keyed) {
            if cells.last().is_none_or(|&(last, _)| last != key) {
                cells.push((key, point));
            }
            slots[vertex as usize] = Some(Slot { point, cell: cells.len() as u32 - 1 });
        }
        let coordinate = |k: usize| keyed.iter().map(|&(_, i)| positions[i as usize][k]).collect();
        let normal = |&(_, i): &(u64, u32)| normals[i as usize].unwrap_or_default().map(|x| x as f32);
        Self {
            radius2: radius * radius,
            x: coordinate(0),
            y: coordinate(1),
            z: coordinate(2),
            normals: keyed.iter().map(normal).collect(),
            slots,
            rows: rows_around(&cells, keyed.len() as u32),
        }
    }

    /// Normal of a point of a [`Neighborhood`].
    #[inline(always)]
    pub(super) fn normal(&self, point: u32) -> [f32; 3] {
        self.normals[point as usize]
    }

    /// Collects the points within the radius of `vertex`, the bound included, `vertex` itself excluded. A vertex
    /// without a normal has none.
    #[inline(always)]
    pub(super) fn gather(&self, vertex: usize, out: &mut Neighborhood) {
        out.clear();
        let Some(Slot { point, cell }) = self.slots[vertex] else { return };
        let center = [self.x[point as usize], self.y[point as usize], self.z[point as usize]];
        let rows = &self.rows[cell as usize];
        let n_candidates: usize = rows.iter().map(|row| row.len()).sum();
        if out.points.len() < n_candidates {
            out.points.resize(n_candidates, 0);
        }
        let mut len = 0;
        for row in rows {
            if row.contains(&point) {
                len = self.select(row.start..point, center, &mut out.points, len);
                len = self.select(point + 1..row.end, center, &mut out.points, len);
            } else {
                len = self.select(row.clone(), center, &mut out.points, len);
            }
        }
        out.resize_buffers(len);
        let [dx, dy, dz] = &mut out.offsets;
        let buffers = dx.iter_mut().zip(dy).zip(dz).zip(&mut out.distances2);
        for (&point, (((dx, dy), dz), distance2)) in out.points[..len].iter().zip(buffers) {
            let i = point as usize;
            let d = [self.x[i] - center[0], self.y[i] - center[1], self.z[i] - center[2]];
            (*dx, *dy, *dz) = (d[0], d[1], d[2]);
            *distance2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        }
    }

    /// Appends those of the points in `range` that are within the radius to the first `len` of `points`; returns the
    /// new length.
    #[inline(always)]
    fn select(&self, range: Range<u32>, center: [f64; 3], points: &mut [u32], mut len: usize) -> usize {
        const BLOCK: usize = 32;
        let radius2 = self.radius2;
        for start in range.clone().step_by(BLOCK) {
            let block = start as usize..range.end.min(start + BLOCK as u32) as usize;
            let coordinates =
                self.x[block.clone()].iter().zip(&self.y[block.clone()]).zip(&self.z[block.clone()]);
            let mut distances2 = [0.0; BLOCK];
            for (distance2, ((x, y), z)) in distances2.iter_mut().zip(coordinates) {
                let d = [x - center[0], y - center[1], z - center[2]];
                *distance2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            }
            for (point, distance2) in (start..).zip(&distances2[..block.len()]) {
                // Written in any case and kept if it counts: a branch would be mispredicted every third time.
                points[len] = point;
                len += usize::from(*distance2 <= radius2);
            }
        }
        len
    }
}

/// Median of each coordinate: the middle of the mesh, wherever single vertices may have gone.
fn medians(positions: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let mut values: Vec<f64> = positions.iter().map(|p| p[k]).collect();
        let middle = values.len() / 2;
        if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
    })
}

/// Clamped so far from the bounds that a neighbouring cell is within them.
fn cell_coordinate(cells_from_origin: f64) -> i64 {
    let bound = CENTER - 1 - CELLS_PER_RADIUS;
    (cells_from_origin.floor() as i64).clamp(-bound, bound) + CENTER
}

fn key([x, y, z]: [i64; 3]) -> u64 {
    ((z << (2 * BITS)) | (y << BITS) | x) as u64
}

/// For each of the sorted `cells` (key, first point) the points in the rows of cells around it.
fn rows_around(cells: &[(u64, u32)], n_points: u32) -> Vec<[Range<u32>; ROWS]> {
    let first_point = |cell: usize| cells.get(cell).map_or(n_points, |&(_, first)| first);
    let mut rows = vec![[const { 0..0 }; ROWS]; cells.len()];
    let reach = -CELLS_PER_RADIUS..=CELLS_PER_RADIUS;
    let offsets = reach.clone().flat_map(|z| reach.clone().map(move |y| (z << (2 * BITS)) + (y << BITS)));
    for (row, offset) in offsets.enumerate() {
        // Keys ascend, so both ends of the row only move forward from one cell to the next.
        let (mut start, mut end) = (0, 0);
        for (around, &(key, _)) in rows.iter_mut().zip(cells) {
            let middle = key as i64 + offset;
            while start < cells.len() && (cells[start].0 as i64) < middle - CELLS_PER_RADIUS {
                start += 1;
            }
            end = end.max(start);
            while end < cells.len() && cells[end].0 as i64 <= middle + CELLS_PER_RADIUS {
                end += 1;
            }
            around[row] = first_point(start)..first_point(end);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn neighbors(grid: &Grid, order: &[usize], vertex: usize) -> Vec<usize> {
        let mut neighborhood = Neighborhood::default();
        grid.gather(vertex, &mut neighborhood);
        let mut found: Vec<usize> =
            neighborhood.points[..neighborhood.len()].iter().map(|&p| order[p as usize]).collect();
        found.sort_unstable();
        found
    }

    /// Vertex of each point of the grid.
    fn order(grid: &Grid) -> Vec<usize> {
        let mut order = vec![usize::MAX; grid.x.len()];
        for (vertex, slot) in grid.slots.iter().enumerate() {
            if let Some(slot) = slot {
                order[slot.point as usize] = vertex;
            }
        }
        order
    }

    fn check_against_brute_force(positions: &[[f64; 3]], normals: &[Option<[f64; 3]>], radius: f64) {
        let grid = Grid::new(positions, normals, radius);
        let order = order(&grid);
        for (i, p) in positions.iter().enumerate() {
            let within = |q: &[f64; 3]| (0..3).map(|k| (q[k] - p[k]).powi(2)).sum::<f64>() <= radius * radius;
            let expected: Vec<usize> = (0..positions.len())
                .filter(|&j| j != i && normals[i].is_some() && normals[j].is_some() && within(&positions[j]))
                .collect();
            assert_eq!(neighbors(&grid, &order, i), expected, "neighbours of {i}");
        }
    }

    proptest! {
        #[test]
        fn finds_what_brute_force_finds(
            points in prop::collection::vec((prop::array::uniform3(-3.0f64..3.0), any::<bool>()), 0..80),
            radius in 0.05f64..5.0,
        ) {
            let positions: Vec<_> = points.iter().map(|p| p.0).collect();
            let normals: Vec<_> = points.iter().map(|p| p.1.then_some([0.0, 0.0, 1.0])).collect();
            check_against_brute_force(&positions, &normals, radius);
        }
    }

    #[test]
    fn lattice_points_on_cell_borders_and_on_the_sphere_are_found() {
        let positions: Vec<_> = (0..343).map(|i| [i % 7, i / 7 % 7, i / 49].map(f64::from)).collect();
        check_against_brute_force(&positions, &vec![Some([0.0; 3]); positions.len()], 2.0);
    }

    #[test]
    fn points_beyond_the_last_cell_keep_their_neighbors() {
        let mut positions: Vec<_> = (0..20).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        positions.extend([1e9, 1e9 + 1.0, -1e300, 1e300].map(|x| [x, 0.0, 0.0]));
        positions.push([f64::INFINITY; 3]);
        check_against_brute_force(&positions, &vec![Some([0.0; 3]); positions.len()], 1.5);
    }
}
