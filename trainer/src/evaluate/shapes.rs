//! The shapes of a dataset as evaluation needs them: meshes as they are on disk, their points, geodesics on the targets.

use crate::dataset::{Dataset, DatasetError, MISSING};
use fmnet::Mesh;
use fmnet::eval::{EvalError, GroundTruth};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use std::collections::BTreeMap;

/// A shape in the vertices of its file.
pub(super) struct LoadedShape {
    pub(super) name: String,
    pub(super) mesh: Mesh,
    pub(super) area: f64,
    /// Whether it is a part of a shape.
    pub(super) is_part: bool,
    /// Vertex of every point of the group.
    points: Vec<u32>,
    /// Vertex of the mirror image of every point, where the dataset knows it.
    mirrored: Option<Vec<u32>>,
    /// Distances on it, for targets.
    pub(super) solver: Option<GeodesicSolver>,
}

/// Loads the shapes that occur in the pairs.
pub(super) fn load(
    dataset: &Dataset,
    pairs: &[(usize, usize)],
) -> Result<BTreeMap<usize, LoadedShape>, DatasetError> {
    let mut shapes = BTreeMap::new();
    for &(source, target) in pairs {
        for index in [source, target] {
            if let std::collections::btree_map::Entry::Vacant(slot) = shapes.entry(index) {
                let is_target = pairs.iter().any(|&(_, t)| t == index);
                slot.insert(load_one(dataset, index, is_target)?);
            }
        }
    }
    Ok(shapes)
}

fn load_one(dataset: &Dataset, index: usize, is_target: bool) -> Result<LoadedShape, DatasetError> {
    let entry = &dataset.shapes[index];
    let mesh = entry.read()?;
    Ok(LoadedShape {
        name: entry.name.clone(),
        area: mesh.area(),
        is_part: entry.is_part(),
        points: entry.points(&mesh)?,
        mirrored: entry.mirrored_points(&mesh)?,
        solver: is_target.then(|| GeodesicSolver::new(&mesh, &GeodesicOptions::default())),
        mesh,
    })
}

impl LoadedShape {
    /// The correct matches with another shape.
    pub(super) fn ground_truth(&self, target: &Self) -> Result<GroundTruth, EvalError> {
        self.matches(target, &target.points)
    }

    /// The left-right mirrored matches, where the target's mirror images are known.
    pub(super) fn mirrored_ground_truth(&self, target: &Self) -> Result<Option<GroundTruth>, EvalError> {
        target.mirrored.as_ref().map(|mirrored| self.matches(target, mirrored)).transpose()
    }

    fn matches(&self, target: &Self, points_target: &[u32]) -> Result<GroundTruth, EvalError> {
        let pairs = self.points.iter().zip(points_target).map(|(&s, &t)| (s, t));
        let known = pairs.filter(|&(s, t)| s != MISSING && t != MISSING).collect();
        GroundTruth::new(known, self.mesh.n_vertices(), target.mesh.n_vertices())
    }
}
