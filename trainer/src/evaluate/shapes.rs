//! The shapes of a dataset as evaluation needs them: meshes as they are on disk, their points, geodesics on the
//! targets.

use crate::dataset::{Dataset, DatasetError, MISSING, check_groups};
use fmnet::Mesh;
use fmnet::eval::{EvalError, GroundTruth};
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver};
use std::collections::BTreeMap;

/// A shape in the vertices of its file.
pub(super) struct LoadedShape {
    pub(super) name: String,
    pub(super) mesh: Mesh,
    pub(super) area: f64,
    /// For a part of a shape, the area of the whole, in squared units of the mesh.
    pub(super) whole_area: Option<f64>,
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
    check_groups(shapes.iter().map(|(&index, shape)| (&dataset.shapes[index], shape.points.len())))?;
    Ok(shapes)
}

fn load_one(dataset: &Dataset, index: usize, is_target: bool) -> Result<LoadedShape, DatasetError> {
    let entry = &dataset.shapes[index];
    let mesh = entry.read()?;
    Ok(LoadedShape {
        name: entry.name.clone(),
        area: mesh.area(),
        whole_area: entry.whole_area()?,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Correspondence, ShapeEntry, Split};
    use fmnet::io::{Attributes, write_mesh};
    use fmnet::mesh::shapes::{bumpy_sphere, transformed};

    #[test]
    fn a_part_knows_the_area_of_its_own_whole() {
        let folder = tempfile::tempdir().unwrap();
        let whole = bumpy_sphere(2, 1);
        let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let larger = transformed(&whole, upright, 3.0, [0.0; 3]);
        let part = Mesh::new(whole.vertices().to_vec(), whole.faces()[40..].to_vec()).unwrap();
        let shapes = [("larger", &larger, false), ("part", &part, true), ("whole", &whole, false)];
        let entry = |(name, mesh, is_part): (&str, &Mesh, bool)| {
            let path = folder.path().join(format!("{name}.off"));
            write_mesh(&path, mesh, &Attributes::default()).unwrap();
            ShapeEntry {
                name: name.into(),
                mesh: path,
                group: "sphere".into(),
                correspondence: Correspondence::Identity,
                split: Split::Test,
                whole: is_part.then(|| folder.path().join("whole.off")),
            }
        };
        let shapes = shapes.map(entry).to_vec();
        let dataset = Dataset { layout: "test", folder: folder.path().into(), shapes };
        let loaded = load(&dataset, &[(1, 0), (1, 2)]).unwrap();
        let area = loaded[&1].whole_area.unwrap();
        assert!((area / whole.area() - 1.0).abs() < 1e-6, "{area}");
        assert_eq!([loaded[&0].whole_area, loaded[&2].whole_area], [None, None]);
    }
}
