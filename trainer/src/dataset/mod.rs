//! Datasets: shapes on disk, which of them correspond, and how they are split.
//!
//! [`Dataset::open`] recognises the layouts of FAUST (registrations, remeshed, scans), SCAPE, TOSCA and SHREC'16
//! partial, and any folder with a `dataset.toml` ([`manifest`]). Whatever the layout, the result is the same: shapes in
//! groups, and for each shape the vertex of every *point* of its group. Shapes of one group correspond point by point.

mod layouts;
pub mod manifest;
mod shrec16;

pub(crate) use layouts::{faust_numbers, mesh_files};
pub(crate) use shrec16::TRAINING_PARTS;

use fmnet::Mesh;
use fmnet::io::{IoError, read_mesh, read_point_map, read_surface_points};
use fmnet::mesh::{
    RepairError, RepairOptions, SurfacePoint, closest_points, repair, vec3, vertices_on_surface,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Which part of a dataset a shape belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Gradients are taken on it.
    Train,
    /// Settings are chosen on it.
    Validation,
    /// Results are reported on it.
    Test,
}

/// How the points of a group lie on a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Correspondence {
    /// Point `i` is vertex `i`, for all vertices.
    Identity,
    /// Point `i` is vertex `i` for the first so many vertices; the others are no points.
    First(usize),
    /// Line `i` of a `.vts` file holds the 1-based vertex of point `i`, 0 where the shape lacks it.
    Vts(PathBuf),
    /// Line `i` of a `.corr` file holds the 1-based triangle of point `i` and its three weights, -1 where the shape
    /// lacks it.
    Surface(PathBuf),
    /// Point `i` is the vertex nearest to vertex `i` of a registered template, which lies in the same place; the
    /// shape lacks it where none is within 0.02 sqrt(area), or an edge of a coarse scan, as in a hole.
    NearestTo(PathBuf),
    /// Line `v` of a SHREC'16 `.baryc_gt` file says where vertex `v` lies on the whole shape (the second path).
    Barycentric(PathBuf, PathBuf),
}

/// A shape of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeEntry {
    /// Unique name, the stem of the file where possible.
    pub name: String,
    /// The mesh file.
    pub mesh: PathBuf,
    /// Shapes of one group correspond with each other.
    pub group: String,
    /// Where the group's points lie on it.
    pub correspondence: Correspondence,
    /// Its part of the dataset.
    pub split: Split,
    /// For a part of a shape: the mesh of a whole of its group in the same unit, in whatever pose. A part may be a
    /// source, never a target.
    pub whole: Option<PathBuf>,
}

/// All shapes of a dataset, in a fixed order.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// The layout that was recognised, for messages.
    pub layout: &'static str,
    /// The folder.
    pub folder: PathBuf,
    /// Its shapes, sorted by name.
    pub shapes: Vec<ShapeEntry>,
}

/// Why a dataset cannot be used.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// The folder has no known layout.
    #[error(
        "{folder}: no known dataset layout; expected tr_reg_NNN.ply (FAUST registrations), tr_reg_NNN.off with corres/*.vts \
         (FAUST remeshed), scans/ and registrations/ (FAUST scans), meshNNN.off (SCAPE), CLASSn.off (TOSCA), null/ with \
         holes/ or cuts/ (SHREC'16 partial), or a dataset.toml"
    )]
    UnknownLayout {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder or a file in it cannot be read.
    #[error("{path}: {source}")]
    Folder {
        /// What could not be read.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A mesh or correspondence file is wrong.
    #[error(transparent)]
    File(#[from] IoError),
    /// The manifest is wrong.
    #[error("{path}: {reason}")]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong, and where.
        reason: String,
    },
    /// A mesh cannot be used.
    #[error("{path}: {reason}")]
    Mesh {
        /// The mesh file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A correspondence does not fit its mesh.
    #[error("{path}: {reason}")]
    Correspondence {
        /// The correspondence file.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
}

/// Stands in [`ShapeEntry::points`] for a point that the shape lacks.
pub const MISSING: u32 = u32::MAX;

impl Dataset {
    /// Recognises the layout of a folder.
    ///
    /// # Errors
    /// If the folder has no known layout, or it or its manifest cannot be read.
    pub fn open(folder: &Path) -> Result<Self, DatasetError> {
        let manifest = folder.join(manifest::FILE_NAME);
        let (layout, mut shapes) = if manifest.is_file() {
            ("manifest", manifest::read(&manifest)?)
        } else if let Some(found) = layouts::recognise(folder)? {
            found
        } else {
            return Err(DatasetError::UnknownLayout { folder: folder.to_path_buf() });
        };
        shapes.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self { layout, folder: folder.to_path_buf(), shapes })
    }

    /// The shapes of the given splits.
    pub fn of_splits<'a>(&'a self, splits: &'a [Split]) -> impl Iterator<Item = &'a ShapeEntry> {
        self.shapes.iter().filter(|shape| splits.contains(&shape.split))
    }
}

/// Checks that the shapes of each group have equally many points, given the number of each: else they do not
/// correspond, whatever their names say.
///
/// # Errors
/// If two shapes of a group do not.
pub fn check_groups<'a>(
    shapes: impl IntoIterator<Item = (&'a ShapeEntry, usize)>,
) -> Result<(), DatasetError> {
    let mut first: BTreeMap<&str, (&ShapeEntry, usize)> = BTreeMap::new();
    for (shape, points) in shapes {
        let (other, expected) = *first.entry(&shape.group).or_insert((shape, points));
        if points != expected {
            let reason = format!(
                "{points} points, but {}, of the same group '{}', has {expected}: the shapes do not correspond point by point; \
                 move them apart, or say in a {} which of them do",
                other.mesh.display(),
                shape.group,
                manifest::FILE_NAME
            );
            return Err(DatasetError::Mesh { path: shape.mesh.clone(), reason });
        }
    }
    Ok(())
}

impl ShapeEntry {
    /// Whether it is a part of a shape.
    pub fn is_part(&self) -> bool {
        self.whole.is_some()
    }

    /// For a part, the area of the whole, in squared units of its mesh; that of the repaired mesh, as in matching.
    ///
    /// # Errors
    /// If the whole cannot be read or repaired.
    pub fn whole_area(&self) -> Result<Option<f64>, DatasetError> {
        let area = |path: &PathBuf| {
            let repaired = repair(&read_mesh(path)?.mesh, &RepairOptions::default());
            let wrong = |e: RepairError| DatasetError::Mesh { path: path.clone(), reason: e.to_string() };
            Ok(repaired.map_err(wrong)?.mesh.area())
        };
        self.whole.as_ref().map(area).transpose()
    }

    /// Reads the mesh.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read(&self) -> Result<Mesh, DatasetError> {
        Ok(read_mesh(&self.mesh)?.mesh)
    }

    /// The vertex of `mesh` of every point of the group, `[points]`, [`MISSING`] where the shape lacks it.
    ///
    /// # Errors
    /// If the correspondence cannot be read or does not fit the mesh.
    pub fn points(&self, mesh: &Mesh) -> Result<Vec<u32>, DatasetError> {
        let n = mesh.n_vertices();
        match &self.correspondence {
            Correspondence::Identity => Ok((0..n as u32).collect()),
            Correspondence::First(count) if *count <= n => Ok((0..*count as u32).collect()),
            Correspondence::First(count) => Err(DatasetError::Correspondence {
                path: self.mesh.clone(),
                reason: format!("{n} vertices, but the first {count} should correspond"),
            }),
            Correspondence::Vts(path) => vts_points(path, n),
            Correspondence::Surface(path) => {
                let points = read_surface_points(path, mesh.n_faces())?;
                Ok(points.iter().map(|p| p.map_or(MISSING, |p| p.nearest_vertex(mesh))).collect())
            }
            Correspondence::NearestTo(path) => {
                let template = read_mesh(path)?.mesh;
                if mesh.n_vertices() == 0 {
                    return Ok(vec![MISSING; template.n_vertices()]);
                }
                Ok(nearest_points(mesh, &template))
            }
            Correspondence::Barycentric(path, whole) => shrec16::points(path, whole, n),
        }
    }

    /// Where on `mesh`, as read, every point of the group lies, `[points]`, `None` where the shape lacks it. A point
    /// that is a vertex of no triangle is on no surface, so it is `None` as well.
    ///
    /// [`fmnet::mesh::carried_points`] takes them to the repaired and the decimated mesh, whose triangles are others:
    /// each to the closest point of the same skin.
    ///
    /// # Errors
    /// If the correspondence cannot be read or does not fit the mesh.
    pub fn surface_points(&self, mesh: &Mesh) -> Result<Vec<Option<SurfacePoint>>, DatasetError> {
        match &self.correspondence {
            Correspondence::Surface(path) => Ok(read_surface_points(path, mesh.n_faces())?),
            Correspondence::NearestTo(path) => Ok(closest_on_scan(mesh, &read_mesh(path)?.mesh)),
            _ => {
                let on_surface = vertices_on_surface(mesh);
                let place = |&v: &u32| on_surface.get(v as usize).copied().flatten();
                Ok(self.points(mesh)?.iter().map(place).collect())
            }
        }
    }
}

/// Vertices of a scan farther than this from a vertex of its registration do not show it, relative to sqrt(area).
const NEAR: f64 = 0.02;

/// How far from the template the nearest vertex of a scan may be, in its unit.
fn near(mesh: &Mesh, template: &Mesh) -> f64 {
    // An even triangulation of n vertices has edges of about sqrt(area / n).
    let edge = 1.0 / (mesh.n_vertices() as f64).sqrt();
    NEAR.max(edge) * template.scale()
}

/// The points of the scan closest to the template's vertices, where one is near.
fn closest_on_scan(mesh: &Mesh, template: &Mesh) -> Vec<Option<SurfacePoint>> {
    let limit = near(mesh, template);
    let near = |(&p, point): (&[f64; 3], Option<SurfacePoint>)| {
        point.filter(|point| vec3::distance(p, point.position(mesh)) <= limit)
    };
    template.vertices().iter().zip(closest_points(mesh, template.vertices())).map(near).collect()
}

fn nearest_points(mesh: &Mesh, template: &Mesh) -> Vec<u32> {
    let limit = near(mesh, template);
    let nearest = fmnet::mesh::nearest_vertices(mesh.vertices(), template.vertices());
    let near = |(&p, v): (&[f64; 3], u32)| match vec3::distance(p, mesh.vertices()[v as usize]) <= limit {
        true => v,
        false => MISSING,
    };
    template.vertices().iter().zip(nearest).map(near).collect()
}

impl ShapeEntry {
    /// The vertex of the left-right mirror image of every point, `[points]`, where a file `NAME.sym.vts` beside
    /// `NAME.vts` says.
    ///
    /// # Errors
    /// If that file cannot be read or does not fit the mesh.
    pub fn mirrored_points(&self, mesh: &Mesh) -> Result<Option<Vec<u32>>, DatasetError> {
        let Correspondence::Vts(path) = &self.correspondence else { return Ok(None) };
        let mirrored = path.with_extension("sym.vts");
        if mirrored.is_file() { vts_points(&mirrored, mesh.n_vertices()).map(Some) } else { Ok(None) }
    }
}

fn vts_points(path: &Path, n: usize) -> Result<Vec<u32>, DatasetError> {
    let map = read_point_map(path, None)?;
    let points: Vec<u32> = (0..map.len()).map(|i| map.get(i).unwrap_or(MISSING)).collect();
    match points.iter().position(|&v| v != MISSING && v as usize >= n) {
        None => Ok(points),
        Some(line) => Err(DatasetError::Correspondence {
            path: path.to_path_buf(),
            reason: format!("line {}: vertex {}, but the mesh has {n} vertices", line + 1, points[line] + 1),
        }),
    }
}

#[cfg(test)]
mod tests;
