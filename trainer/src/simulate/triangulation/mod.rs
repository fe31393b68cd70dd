//! Other triangulations of a shape, as other people and programs would have made them, with points that correspond.
//!
//! The shape is rounded between its vertices, so that its facets are not seen, and sampled anew in one of several
//! [`Manner`]s. Correspondences are points on the new surface where the shape's own points lie, whatever vertices are
//! near: no connectivity, order or place of vertices tells which points correspond.

mod manner;
mod metric;
mod options;
mod quads;
mod remesh;
mod sheet;
mod surface;
#[cfg(test)]
mod tests;

pub use manner::Manner;
pub use options::{Plan, TriangulationOptions};

use super::SimulateError;
use super::carve::{carve, disc, largest_component};
use super::random::{uniform, weighted};
use super::scan::{closed, roughen, solid, with_pieces};
use super::smooth::refine;
use fmnet::Mesh;
use fmnet::mesh::{RepairOptions, SurfacePoint, Topology, carried_points, repair, vec3};
use manner::triangulate;
use metric::extremities;
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use surface::Surface;

/// A shape with a triangulation of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangulated {
    /// The mesh, in the place of the shape.
    pub mesh: Mesh,
    /// Where on it each of the shape's points lies, `None` where it lacks the point.
    pub points: Vec<Option<SurfacePoint>>,
    /// What was drawn for it.
    pub plan: Plan,
}

/// A point is missing where the new surface, before noise, is farther from it than this, relative to the mean edge
/// length: it lies in a contact that has grown together, or on a part too thin for the triangles.
const NEAR: f64 = 0.3;
/// Surfaces that come nearer than this grow together, relative to sqrt(area): least and most.
const CONTACT: [f64; 2] = [0.008, 0.02];
/// Spacing of the grid on which they do, relative to sqrt(area): least, and relative to an edge.
const GRID: (f64, f64) = (0.0055, 0.5);

/// A triangulation of `mesh`, whose `points` correspond with other shapes' points. `index` is the number of the
/// shape: another one, another triangulation.
///
/// The result is a manifold, but where holes, cuts and pieces meet in a vertex. Without noise, holes, cuts, contacts
/// and pieces each point lies within 0.3 mean edge lengths of where it was, mostly far nearer.
///
/// # Errors
/// If an option is out of range, or no surface is left of the mesh.
///
/// # Panics
/// If a point names a triangle that the mesh does not have.
pub fn triangulated(
    mesh: &Mesh,
    points: &[Option<SurfacePoint>],
    options: &TriangulationOptions,
    index: u64,
) -> Result<Triangulated, SimulateError> {
    options.check()?;
    let plain = repair(mesh, &RepairOptions::default())?.mesh;
    let (plan, mut rng) = Plan::draw(options, index, closed(&plain).is_ok());
    let rounded = refine(&plain);
    let dense = if plan.glued { glued(&rounded, &plan, &mut rng)? } else { rounded };
    let surface = Surface::new(&dense);
    let even = if plan.glued { &dense } else { &plain };
    let new = triangulate(plan.manner, &surface, even, plan.vertices, &mut rng)?;
    let edge = mean_edge(&new);
    let carried = carried_points(points, mesh, &new, NEAR * edge / mesh.scale());
    let mut draft = Draft { mesh: new, points: carried };
    draft.damage(&plan, edge, &mut rng)?;
    draft.shuffle(&mut rng);
    Ok(Triangulated { mesh: draft.mesh, points: draft.points, plan })
}

fn glued(mesh: &Mesh, plan: &Plan, rng: &mut ChaCha8Rng) -> Result<Mesh, SimulateError> {
    let unit = mesh.scale();
    let contact = uniform(rng, CONTACT[0], CONTACT[1]);
    // An even triangulation by equilateral triangles of side s has 2 / (sqrt(3) s^2) vertices per area.
    let edge = (2.0 / (3f64.sqrt() * plan.vertices as f64)).sqrt();
    solid(mesh, unit * (GRID.1 * edge).clamp(GRID.0, 2.0 * GRID.0), unit * contact, rng)
}

fn mean_edge(mesh: &Mesh) -> f64 {
    let topology = Topology::new(mesh);
    let length =
        |[i, j]: &[u32; 2]| vec3::distance(mesh.vertices()[*i as usize], mesh.vertices()[*j as usize]);
    topology.edges().iter().map(length).sum::<f64>() / topology.edges().len().max(1) as f64
}

/// A mesh in the making, and the points on it.
struct Draft {
    mesh: Mesh,
    points: Vec<Option<SurfacePoint>>,
}

impl Draft {
    fn damage(&mut self, plan: &Plan, edge: f64, rng: &mut ChaCha8Rng) -> Result<(), SimulateError> {
        let unit = self.mesh.scale();
        if plan.cuts > 0 {
            let adjacency = Topology::new(&self.mesh).adjacency();
            let mut ends = extremities(&self.mesh, &adjacency, 6, rng);
            ends.shuffle(rng);
            let beyond = |&end: &u32| disc(&self.mesh, &adjacency, end, unit * uniform(rng, 0.06, 0.18));
            let removed: Vec<u32> = ends.iter().take(plan.cuts).flat_map(beyond).collect();
            self.remove(&removed);
        }
        for _ in 0..plan.holes {
            let adjacency = Topology::new(&self.mesh).adjacency();
            let center = weighted(rng, &self.mesh.vertex_areas());
            // No smaller than what one vertex leaves.
            let radius = (unit * uniform(rng, 0.01, 0.05)).max(0.5 * edge);
            self.remove(&disc(&self.mesh, &adjacency, center, radius));
        }
        if plan.noise > 0.0 {
            self.mesh = roughen(&self.mesh, plan.noise * edge, rng)?;
        }
        if plan.pieces > 0 {
            let whole = std::mem::take(&mut self.mesh);
            // A piece smaller than a triangle would have none.
            let radii = [0.012, 0.03].map(|r: f64| (r * unit).max(2.0 * edge));
            self.mesh = with_pieces(whole, plan.pieces, radii, rng);
        }
        Ok(())
    }

    /// Takes vertices away, and all but the largest component of what is left.
    fn remove(&mut self, vertices: &[u32]) {
        let mut kept = vec![true; self.mesh.n_vertices()];
        vertices.iter().for_each(|&i| kept[i as usize] = false);
        let carved = carve(&self.mesh, |i| kept[i as usize]);
        let largest = largest_component(&carved.mesh);
        if largest.mesh.n_faces() == 0 {
            return;
        }
        kept.fill(false);
        largest.origin.iter().for_each(|&i| kept[carved.origin[i as usize] as usize] = true);
        // What `carve` keeps stays in its order.
        let mut next = 0;
        let place: Vec<Option<u32>> = (self.mesh.faces().iter())
            .map(|face| {
                let stays = face.iter().all(|&i| kept[i as usize]);
                next += u32::from(stays);
                stays.then(|| next - 1)
            })
            .collect();
        for point in &mut self.points {
            let face = point.and_then(|p| place[p.face as usize]);
            *point = point.zip(face).map(|(p, face)| SurfacePoint { face, ..p });
        }
        self.mesh = carve(&self.mesh, |i| kept[i as usize]).mesh;
    }

    /// Puts vertices, faces and the corners of each face in random order.
    fn shuffle(&mut self, rng: &mut ChaCha8Rng) {
        let order = |n: usize, rng: &mut ChaCha8Rng| {
            let mut order: Vec<u32> = (0..n as u32).collect();
            order.shuffle(rng);
            let mut place = vec![0; n];
            order.iter().enumerate().for_each(|(new, &old)| place[old as usize] = new as u32);
            (order, place)
        };
        let (vertex_order, vertex_place) = order(self.mesh.n_vertices(), rng);
        let (face_order, face_place) = order(self.mesh.n_faces(), rng);
        let turns: Vec<usize> = (0..self.mesh.n_faces()).map(|_| rng.random_range(0..3)).collect();
        let vertices = vertex_order.iter().map(|&i| self.mesh.vertices()[i as usize]).collect();
        let faces = face_order
            .iter()
            .map(|&f| {
                let mut face = self.mesh.faces()[f as usize].map(|i| vertex_place[i as usize]);
                face.rotate_left(turns[f as usize]);
                face
            })
            .collect();
        for point in self.points.iter_mut().flatten() {
            point.weights.rotate_left(turns[point.face as usize]);
            point.face = face_place[point.face as usize];
        }
        self.mesh = Mesh::new(vertices, faces).expect("a permuted mesh is as valid as it was");
    }
}
