//! The SHREC'16 partial correspondence benchmark: whole shapes in `null/CLASS.off`, parts in `holes/` or `cuts/`
//! `holes_CLASS_shape_N.off`, with `.baryc_gt` files that say where each vertex of the part lies on the whole shape:
//! line `v` holds a 1-based triangle of the whole and three barycentric weights.

use super::layouts::{mesh_files, stem};
use super::{Correspondence, DatasetError, MISSING, ShapeEntry, Split};
use fmnet::io::{read_mesh, read_surface_points};
use std::path::Path;

/// Parts at the beginning of the list are for training, as in the paper's experiment.
pub(crate) const TRAINING_PARTS: usize = 10;

pub(super) fn shapes(folder: &Path) -> Result<Vec<ShapeEntry>, DatasetError> {
    let mut shapes = Vec::new();
    for whole in mesh_files(&folder.join("null"))? {
        let class = stem(&whole);
        for kind in ["holes", "cuts"] {
            let parts = folder.join(kind);
            if parts.is_dir() {
                let prefix = format!("{kind}_{class}_");
                let mut of_class = mesh_files(&parts)?;
                of_class.retain(|p| stem(p).starts_with(&prefix));
                of_class.sort_by_key(|p| (number(&stem(p)), stem(p)));
                shapes.extend(of_class.into_iter().enumerate().map(|(i, mesh)| ShapeEntry {
                    name: stem(&mesh),
                    group: class.clone(),
                    correspondence: Correspondence::Barycentric(
                        mesh.with_extension("baryc_gt"),
                        whole.clone(),
                    ),
                    split: if i < TRAINING_PARTS { Split::Train } else { Split::Test },
                    whole: Some(whole.clone()),
                    mesh,
                }));
            }
        }
        shapes.push(ShapeEntry {
            name: class.clone(),
            mesh: whole,
            group: class,
            correspondence: Correspondence::Identity,
            split: Split::Train,
            whole: None,
        });
    }
    Ok(shapes)
}

/// The number at the end of a name: part 2 comes before part 10.
fn number(name: &str) -> Option<u64> {
    name[name.trim_end_matches(|c: char| c.is_ascii_digit()).len()..].parse().ok()
}

/// For each vertex of the whole shape the vertex, below `n`, of the part that lies nearest to it by barycentric
/// weight, or [`MISSING`].
pub(super) fn points(ground_truth: &Path, whole: &Path, n: usize) -> Result<Vec<u32>, DatasetError> {
    let whole = read_mesh(whole)?.mesh;
    let on_whole = read_surface_points(ground_truth, whole.n_faces())?;
    if on_whole.len() != n {
        let reason =
            format!("{} lines, but the part has {n} vertices; expected a line for each", on_whole.len());
        return Err(DatasetError::Correspondence { path: ground_truth.to_path_buf(), reason });
    }
    let mut points = vec![MISSING; whole.n_vertices()];
    let mut best = vec![0.0; whole.n_vertices()];
    for (vertex, point) in on_whole.iter().enumerate().filter_map(|(v, point)| Some((v, (*point)?))) {
        let corner = point.nearest_vertex(&whole) as usize;
        let weight = point.weights.into_iter().fold(0.0, f64::max);
        if weight > best[corner] {
            best[corner] = weight;
            points[corner] = vertex as u32;
        }
    }
    Ok(points)
}
