//! Polygons of an implicit surface on a sparse grid by dual marching cubes (Nielson 2004): one vertex per sheet of the
//! surface in a cell, which keeps the mesh manifold where two sheets pass one cell, and one quadrilateral per crossed
//! grid edge. The vertices are then put on the surface.

use rayon::prelude::*;

use fmnet::mesh::vec3;

use super::implicit::{Part, field};
use super::math::Vec3;
use super::mirror::Symmetry;

/// Cells along each side of a block of the grid.
const BLOCK: usize = 4;
const CORNERS: usize = BLOCK + 1;

/// A closed triangle mesh, and for each vertex the parts of the body that shape its neighbourhood.
pub(super) struct Surface {
    pub(super) vertices: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Indices into the parts, one list per block of the grid.
    pub(super) active: Vec<Vec<u16>>,
    /// For each vertex its list in `active`.
    pub(super) block_of: Vec<u32>,
    /// Of every vertex the one at its image.
    pub(super) twins: Vec<u32>,
    symmetry: Symmetry,
}

struct Grid {
    origin: Vec3,
    cell: f64,
    blocks: [usize; 3],
    symmetry: Symmetry,
}

#[derive(Default)]
struct Block {
    active: Vec<u16>,
    /// Whether its centre is inside, which stands for all of it where `values` is empty.
    inside: bool,
    /// Values at its own corners, x fastest; empty where the surface does not pass.
    values: Vec<f64>,
    vertices: Vertices,
}

/// Where the surface crosses the cells of a block.
#[derive(Default)]
struct Vertices {
    positions: Vec<Vec3>,
    /// First vertex of each cell, or `NONE`; empty where the surface does not pass.
    cells: Vec<u32>,
    /// `(cell, edge, vertex)` for the edges on the further sheets of a cell.
    sheets: Vec<(u16, u8, u32)>,
}

const NONE: u32 = u32::MAX;

/// The zero set of the smooth union of `parts`, sampled at the grid spacing `cell`; faces look outwards.
pub(super) fn polygonize(parts: &[Part], cell: f64, symmetry: Symmetry) -> Surface {
    let grid = Grid::around(parts, cell, symmetry);
    let mut blocks = grid.sample(parts);
    let n_blocks = blocks.len();
    let meshed: Vec<_> = (0..n_blocks).into_par_iter().map(|b| grid.place_vertices(&blocks, b)).collect();
    blocks.iter_mut().zip(meshed).for_each(|(block, vertices)| block.vertices = vertices);
    let mut first = Vec::with_capacity(n_blocks);
    let (mut vertices, mut block_of) = (Vec::new(), Vec::new());
    for (b, block) in blocks.iter().enumerate() {
        first.push(vertices.len() as u32);
        vertices.extend_from_slice(&block.vertices.positions);
        block_of.extend(std::iter::repeat_n(b as u32, block.vertices.positions.len()));
    }
    let quads: Vec<Vec<[u32; 4]>> =
        (0..n_blocks).into_par_iter().map(|b| grid.quads(&blocks, &first, b)).collect();
    let active = blocks.into_iter().map(|block| block.active).collect();
    let twins = symmetry.twins(&mut vertices);
    let mut surface = Surface { vertices, faces: Vec::new(), active, block_of, twins, symmetry };
    let quads = quads.concat();
    surface.project(parts, cell, 2);
    surface.even_out(&quads);
    surface.project(parts, cell, 3);
    surface.faces = quads.iter().flat_map(|&quad| split(quad, &surface.vertices)).collect();
    surface
}

/// Two triangles of a quadrilateral, cut along the shorter diagonal.
fn split([a, b, c, d]: [u32; 4], vertices: &[Vec3]) -> [[u32; 3]; 2] {
    let length = |i: u32, j: u32| vec3::distance(vertices[i as usize], vertices[j as usize]);
    if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] }
}

impl Surface {
    /// Value of the body's field near vertex `i`.
    fn value(&self, parts: &[Part], i: usize, p: Vec3) -> f64 {
        let near = self.active[self.block_of[i] as usize].iter().map(|&part| &parts[part as usize]);
        field(near, self.symmetry.folded(p))
    }

    /// Newton steps onto the zero set, each at most a cell long, on the modelled side; the other one is its image.
    fn project(&mut self, parts: &[Part], cell: f64, steps: usize) {
        let modelled: Vec<usize> =
            (0..self.vertices.len()).filter(|&i| self.symmetry.holds(self.vertices[i])).collect();
        let projected = modelled.par_iter().map(|&i| {
            let (mut p, delta) = (self.vertices[i], 0.05 * cell);
            for _ in 0..steps {
                let value = self.value(parts, i, p);
                let gradient: Vec3 = std::array::from_fn(|axis| {
                    let mut q = p;
                    q[axis] += delta;
                    (self.value(parts, i, q) - value) / delta
                });
                let step = (value / vec3::dot(gradient, gradient).max(0.05)).clamp(-cell, cell);
                p = vec3::sub(p, vec3::scale(gradient, step.clamp(-0.5 * cell, 0.5 * cell)));
            }
            p
        });
        let projected: Vec<Vec3> = projected.collect();
        for (i, p) in modelled.into_iter().zip(projected) {
            self.vertices[i] = p;
            self.vertices[self.twins[i] as usize] = self.symmetry.image(p);
        }
    }

    /// Moves every vertex half-way to the mean of its neighbours, which evens out the triangles.
    fn even_out(&mut self, quads: &[[u32; 4]]) {
        let mut sums = vec![[0.0; 4]; self.vertices.len()];
        for quad in quads {
            for corner in 0..4 {
                let (i, j) = (quad[corner] as usize, quad[(corner + 1) % 4] as usize);
                for (to, from) in [(i, j), (j, i)] {
                    let p = self.vertices[from];
                    for axis in 0..3 {
                        sums[to][axis] += p[axis];
                    }
                    sums[to][3] += 1.0;
                }
            }
        }
        for (p, sum) in self.vertices.iter_mut().zip(sums) {
            for axis in 0..3 {
                p[axis] = 0.5 * (p[axis] + sum[axis] / sum[3]);
            }
        }
    }
}

impl Grid {
    fn around(parts: &[Part], cell: f64, symmetry: Symmetry) -> Self {
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        for part in parts.iter().filter(|part| !part.carve) {
            let (center, radius) = part.solid.bound();
            for axis in 0..3 {
                low[axis] = low[axis].min(center[axis] - radius - part.blend);
                high[axis] = high[axis].max(center[axis] + radius + part.blend);
            }
        }
        let span = cell * BLOCK as f64;
        let mut origin = low.map(|x| x - 1.5 * cell);
        let mut blocks: [usize; 3] =
            std::array::from_fn(|axis| ((high[axis] + 1.5 * cell - origin[axis]) / span).ceil() as usize);
        // As many blocks on the left as on the right, so that the grid is its own mirror image.
        let half = ((high[0].max(-low[0]) + 1.5 * cell) / span).ceil();
        (origin[0], blocks[0]) = (-half * span, 2 * half as usize);
        Self { origin, cell, blocks, symmetry }
    }

    /// Position of the block with index `b` in the grid of blocks.
    fn place(&self, b: usize) -> [usize; 3] {
        let [nx, ny, _] = self.blocks;
        [b % nx, (b / nx) % ny, b / (nx * ny)]
    }

    fn corner(&self, place: [usize; 3], offset: [usize; 3]) -> Vec3 {
        std::array::from_fn(|i| self.origin[i] + self.cell * (place[i] * BLOCK + offset[i]) as f64)
    }

    /// Evaluates the field in all blocks that the surface may pass: those near it by the value at their centre, and
    /// those that a neighbour disagrees with about where the inside is, until none is left.
    fn sample(&self, parts: &[Part]) -> Vec<Block> {
        let n_blocks = self.blocks.iter().product();
        let mut blocks: Vec<Block> = (0..n_blocks).into_par_iter().map(|b| self.survey(parts, b)).collect();
        let mut wanted: Vec<usize> = (0..n_blocks).filter(|&b| !blocks[b].values.is_empty()).collect();
        while !wanted.is_empty() {
            let values: Vec<Vec<f64>> = wanted.par_iter().map(|&b| self.values(parts, &blocks, b)).collect();
            wanted.iter().zip(values).for_each(|(&b, values)| blocks[b].values = values);
            let doubtful =
                wanted.iter().flat_map(|&b| self.neighbors(b).into_iter().map(move |other| (b, other)));
            let unseen = |&(_, other): &(usize, usize)| blocks[other].values.is_empty();
            let touching = |&(b, other): &(usize, usize)| self.sides_disagree(&blocks, b, other);
            let mut next: Vec<usize> =
                doubtful.filter(unseen).filter(touching).map(|(_, other)| other).collect();
            next.sort_unstable();
            next.dedup();
            wanted = next;
        }
        blocks
    }

    /// Whether a corner of the evaluated block `b` next to the block `other` is on the other side of the surface.
    fn sides_disagree(&self, blocks: &[Block], b: usize, other: usize) -> bool {
        let (from, to) = (self.place(b), self.place(other));
        let next_to = |c: usize| {
            let offset = [c % BLOCK, (c / BLOCK) % BLOCK, c / BLOCK.pow(2)];
            (0..3).all(|i| match to[i].cmp(&from[i]) {
                std::cmp::Ordering::Less => offset[i] == 0,
                std::cmp::Ordering::Equal => true,
                std::cmp::Ordering::Greater => offset[i] == BLOCK - 1,
            })
        };
        let values = blocks[b].values.iter().enumerate();
        values.filter(|&(c, _)| next_to(c)).any(|(_, &value)| (value < 0.0) != blocks[other].inside)
    }

    /// The blocks that share a corner with block `b`.
    fn neighbors(&self, b: usize) -> Vec<usize> {
        let place = self.place(b);
        let offsets = (0..27).map(|c| [c % 3, (c / 3) % 3, c / 9]);
        let shifted = offsets.filter_map(|offset| {
            let mut other = [0; 3];
            for i in 0..3 {
                other[i] = (place[i] + offset[i]).checked_sub(1).filter(|&x| x < self.blocks[i])?;
            }
            Some(other[0] + self.blocks[0] * (other[1] + self.blocks[1] * other[2]))
        });
        shifted.filter(|&other| other != b).collect()
    }

    /// The parts that matter in block `b`, which side its centre is on, and, as one placeholder value, whether the
    /// surface may pass.
    fn survey(&self, parts: &[Part], b: usize) -> Block {
        let half = 0.5 * self.cell * BLOCK as f64;
        let center = self.corner(self.place(b), [0; 3]).map(|x| x + half);
        let reach = 3f64.sqrt() * half;
        let active = self.active(parts, center, reach);
        if active.iter().all(|&part| parts[part as usize].carve) {
            return Block { active, ..Block::default() };
        }
        let near = active.iter().map(|&part| &parts[part as usize]);
        let value = field(near, self.symmetry.folded(center));
        let values = if value.abs() < 1.4 * reach { vec![value] } else { vec![] };
        Block { active, inside: value < 0.0, values, ..Block::default() }
    }

    /// Values at the block's own corners. A corner on the right is judged by the parts of the block that owns its
    /// mirror image, so that both have the same value.
    fn values(&self, parts: &[Part], blocks: &[Block], b: usize) -> Vec<f64> {
        let place = self.place(b);
        let width = self.blocks[0] * BLOCK;
        let at = |c: usize| {
            let offset = [c % BLOCK, (c / BLOCK) % BLOCK, c / BLOCK.pow(2)];
            let x = place[0] * BLOCK + offset[0];
            let right = self.symmetry == Symmetry::Mirror && x > 0 && 2 * x < width;
            let owner = if right { b - place[0] + (width - x) / BLOCK } else { b };
            let near = blocks[owner].active.iter().map(|&part| &parts[part as usize]);
            field(near, self.symmetry.folded(self.corner(place, offset)))
        };
        (0..BLOCK.pow(3)).map(at).collect()
    }

    /// Values at the corners of the cells of block `b`, `CORNERS` along each side: its own and its neighbours'.
    fn corner_values(&self, blocks: &[Block], b: usize) -> Vec<f64> {
        let place = self.place(b);
        let value = |c: usize| {
            let corner = [c % CORNERS, (c / CORNERS) % CORNERS, c / CORNERS.pow(2)];
            let owner: [usize; 3] = std::array::from_fn(|i| place[i] + corner[i] / BLOCK);
            if (0..3).any(|i| owner[i] >= self.blocks[i]) {
                return f64::INFINITY;
            }
            let block = &blocks[owner[0] + self.blocks[0] * (owner[1] + self.blocks[1] * owner[2])];
            let [i, j, k] = corner.map(|c| c % BLOCK);
            let far = if block.inside { f64::NEG_INFINITY } else { f64::INFINITY };
            block.values.get(i + BLOCK * (j + BLOCK * k)).copied().unwrap_or(far)
        };
        (0..CORNERS.pow(3)).map(value).collect()
    }

    /// The vertices of the cells of block `b`.
    fn place_vertices(&self, blocks: &[Block], b: usize) -> Vertices {
        let mut result = Vertices::default();
        let place = self.place(b);
        let values = self.corner_values(blocks, b);
        if values.iter().all(|&x| x < 0.0) || values.iter().all(|&x| x >= 0.0) {
            return result;
        }
        for c in 0..BLOCK.pow(3) {
            let cell = [c % BLOCK, (c / BLOCK) % BLOCK, c / BLOCK.pow(2)];
            let corner = self.corner(place, cell);
            let sheets = sheets(&values, cell);
            result.cells.push(if sheets.is_empty() { NONE } else { result.positions.len() as u32 });
            for (sheet, edges) in sheets.into_iter().enumerate() {
                if sheet > 0 {
                    let vertex = result.positions.len() as u32;
                    result.sheets.extend(edges.iter().map(|&edge| (c as u16, edge, vertex)));
                }
                let offset = mean_crossing(&values, cell, &edges);
                result.positions.push(std::array::from_fn(|i| corner[i] + self.cell * offset[i]));
            }
        }
        result
    }

    /// Parts whose distance at `center` is small enough to matter within `reach` of it.
    fn active(&self, parts: &[Part], center: Vec3, reach: f64) -> Vec<u16> {
        let center = self.symmetry.folded(center);
        let matters = |part: &Part| {
            let limit = 1.5 * reach + part.blend + 0.5 * self.cell;
            !part.is_beyond(center, limit + part.blend) && part.solid.distance(center) < limit
        };
        (0..parts.len()).filter(|&i| matters(&parts[i])).map(|i| i as u16).collect()
    }

    /// The quadrilaterals around the crossed grid edges that start in block `b`, counter-clockwise from outside.
    fn quads(&self, blocks: &[Block], first: &[u32], b: usize) -> Vec<[u32; 4]> {
        let (block, place, mut quads) = (&blocks[b], self.place(b), Vec::new());
        if block.vertices.cells.is_empty() {
            return quads;
        }
        let values = self.corner_values(blocks, b);
        let inside = |c: [usize; 3]| values[c[0] + CORNERS * (c[1] + CORNERS * c[2])] < 0.0;
        for c in 0..BLOCK.pow(3) {
            let corner = [c % BLOCK, (c / BLOCK) % BLOCK, c / BLOCK.pow(2)];
            for axis in 0..3 {
                let mut end = corner;
                end[axis] += 1;
                if inside(corner) == inside(end) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let around = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                    let mut cell: [usize; 3] = std::array::from_fn(|i| place[i] * BLOCK + corner[i]);
                    cell[u] = cell[u].checked_sub(du)?;
                    cell[v] = cell[v].checked_sub(dv)?;
                    self.vertex(blocks, first, cell, (4 * axis + du + 2 * dv) as u8)
                });
                if let [Some(p), Some(q), Some(r), Some(s)] = around {
                    quads.push(if inside(corner) { [p, q, r, s] } else { [s, r, q, p] });
                }
            }
        }
        quads
    }

    /// The vertex of `cell` on the sheet that crosses its edge with the index `edge`.
    fn vertex(&self, blocks: &[Block], first: &[u32], cell: [usize; 3], edge: u8) -> Option<u32> {
        let [x, y, z] = cell.map(|c| c / BLOCK);
        let b = x + self.blocks[0] * (y + self.blocks[1] * z);
        let [i, j, k] = cell.map(|c| c % BLOCK);
        let c = i + BLOCK * (j + BLOCK * k);
        let sheet =
            blocks[b].vertices.sheets.iter().find(|&&(cell, other, _)| (cell as usize, other) == (c, edge));
        let local = sheet.map_or(*blocks[b].vertices.cells.get(c)?, |&(_, _, vertex)| vertex);
        (local != NONE).then(|| first[b] + local)
    }
}

/// Value at a corner of a cell, whose bits are its offsets along x, y, z.
fn corner_value(values: &[f64], [i, j, k]: [usize; 3], corner: usize) -> f64 {
    values[i + (corner & 1) + CORNERS * (j + ((corner >> 1) & 1) + CORNERS * (k + (corner >> 2)))]
}

/// The two corners of an edge of a cell. Edge `4 axis + u + 2 v` runs along `axis`, at the offsets `u` and `v` along
/// the two axes that follow cyclically.
fn ends(edge: u8) -> [usize; 2] {
    let (axis, u, v) = (edge as usize / 4, edge as usize & 1, (edge as usize >> 1) & 1);
    let start = (u << ((axis + 1) % 3)) | (v << ((axis + 2) % 3));
    [start, start | (1 << axis)]
}

/// The sheets of the surface in a cell, each as the edges it crosses. Where a face is crossed four times, its inside
/// corners are taken to be apart, in both cells that share it.
fn sheets(values: &[f64], cell: [usize; 3]) -> Vec<Vec<u8>> {
    let inside: [bool; 8] = std::array::from_fn(|corner| corner_value(values, cell, corner) < 0.0);
    if inside.iter().all(|&x| x) || !inside.iter().any(|&x| x) {
        return Vec::new();
    }
    let crossed = |edge: u8| inside[ends(edge)[0]] != inside[ends(edge)[1]];
    let mut sheet: [u8; 12] = std::array::from_fn(|edge| edge as u8);
    for (normal, offset) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
        let on_face = |&edge: &u8| ends(edge).iter().all(|corner| (corner >> normal) & 1 == offset);
        let edges: Vec<u8> = (0..12).filter(|edge| crossed(*edge)).filter(on_face).collect();
        for (place, &a) in edges.iter().enumerate() {
            for &b in &edges[place + 1..] {
                let shared = ends(a).into_iter().find(|corner| ends(b).contains(corner));
                if edges.len() == 2 || shared.is_some_and(|corner| inside[corner]) {
                    let (from, to) = (sheet[a as usize], sheet[b as usize]);
                    sheet.iter_mut().filter(|s| **s == from).for_each(|s| *s = to);
                }
            }
        }
    }
    let mut result: Vec<(u8, Vec<u8>)> = Vec::new();
    for edge in (0..12).filter(|&edge| crossed(edge)) {
        let label = sheet[edge as usize];
        match result.iter_mut().find(|(known, _)| *known == label) {
            Some((_, edges)) => edges.push(edge),
            None => result.push((label, vec![edge])),
        }
    }
    result.into_iter().map(|(_, edges)| edges).collect()
}

/// Where a field of these values at the ends of an edge crosses zero, from 0 to 1. Far from the surface the field is
/// infinite: the crossing then is at the other end.
fn crossing(low: f64, high: f64) -> f64 {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => low / (low - high),
        (true, false) => 0.0,
        (false, true) => 1.0,
        (false, false) => 0.5,
    }
}

/// Mean of the points where the surface crosses the given edges of a cell, in units of the cell.
fn mean_crossing(values: &[f64], cell: [usize; 3], edges: &[u8]) -> Vec3 {
    let mut sum = [0.0; 3];
    for &edge in edges {
        let [start, end] = ends(edge);
        let (low, high) = (corner_value(values, cell, start), corner_value(values, cell, end));
        for (axis, coordinate) in sum.iter_mut().enumerate() {
            *coordinate +=
                if axis == edge as usize / 4 { crossing(low, high) } else { ((start >> axis) & 1) as f64 };
        }
    }
    sum.map(|x| x / edges.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::super::implicit::Solid;
    use super::*;

    #[test]
    fn ball_has_the_area_of_a_ball_and_looks_outwards() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let solid = Solid::Ellipsoid { center: [0.0, 0.1, 0.2], radii: [1.0; 3], axes };
        let ball = polygonize(&[Part::new(solid, 0.1, false, &[0])], 0.05, Symmetry::Mirror);
        let mesh = fmnet::Mesh::new(ball.vertices, ball.faces).unwrap();
        assert_eq!(mesh.n_faces(), 2 * mesh.n_vertices() - 4);
        let volume: f64 =
            (0..mesh.n_faces()).map(|f| vec3::dot(mesh.corners(f)[0], mesh.face_cross(f)) / 6.0).sum();
        assert!((mesh.area() / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3, "area {}", mesh.area());
        assert!((volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 4e-3, "volume {volume}");
    }
}
