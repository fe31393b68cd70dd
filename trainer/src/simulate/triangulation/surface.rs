//! The surface that is to be triangulated.

use crate::simulate::visibility::{unit, vertex_normals};
use fmnet::Mesh;
use fmnet::mesh::{ClosestPoint, vec3};

type Vec3 = [f64; 3];

/// A dense mesh whose vertices are not to be seen in what is made of it.
pub(super) struct Surface<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) normals: Vec<Vec3>,
    tree: ClosestPoint<'a>,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) position: Vec3,
    /// Unit normal, interpolated.
    pub(super) normal: Vec3,
    /// The nearest vertex of the dense mesh.
    pub(super) vertex: u32,
}

impl<'a> Surface<'a> {
    pub(super) fn new(mesh: &'a Mesh) -> Self {
        Self { mesh, normals: vertex_normals(mesh), tree: ClosestPoint::new(mesh) }
    }

    /// The closest point of the skin that faces the way of `normal`.
    pub(super) fn closest(&self, position: Vec3, normal: Vec3) -> Option<Place> {
        let point = self.tree.find_facing(position, normal)?;
        let corners = self.mesh.faces()[point.face as usize];
        let terms = corners.iter().zip(point.weights);
        let sum =
            terms.fold([0.0; 3], |sum, (&i, w)| vec3::add(sum, vec3::scale(self.normals[i as usize], w)));
        let vertex = point.nearest_vertex(self.mesh);
        Some(Place { position: point.position(self.mesh), normal: unit(sum), vertex })
    }

    /// The middle of some places, put on the surface.
    pub(super) fn middle(&self, places: &[Place]) -> Option<Place> {
        let mean = |field: fn(&Place) -> Vec3| {
            let sum = places.iter().fold([0.0; 3], |sum, place| vec3::add(sum, field(place)));
            vec3::scale(sum, 1.0 / places.len() as f64)
        };
        self.closest(mean(|p| p.position), mean(|p| p.normal))
    }

    /// The places of the vertices of a mesh that lies on the surface.
    pub(super) fn places(&self, mesh: &Mesh) -> Vec<Place> {
        let normals = vertex_normals(mesh);
        let place = |(&p, normal): (&Vec3, Vec3)| {
            let at = Place { position: p, normal, vertex: 0 };
            self.closest(p, normal).unwrap_or(at)
        };
        mesh.vertices().iter().zip(normals).map(place).collect()
    }
}
