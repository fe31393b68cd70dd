//! The SHREC'16 partial correspondence benchmark: whole shapes in `null/CLASS.off`, parts in `holes/` or `cuts/`
//! `holes_CLASS_shape_N.off`, with `.baryc_gt` files that say where each vertex of the part lies on the whole shape:
//! line `v` holds a 1-based triangle of the whole and three barycentric weights.

use super::layouts::{mesh_files, stem};
use super::{Correspondence, DatasetError, MISSING, ShapeEntry, Split};
use fmnet::io::read_mesh;
use std::path::Path;

/// Parts at the beginning of the list are for training, as in the paper's experiment.
const TRAINING_PARTS: usize = 10;

pub(super) fn shapes(folder: &Path) -> Result<Vec<ShapeEntry>, DatasetError> {
    let mut shapes = Vec::new();
    for whole in mesh_files(&folder.join("null"))? {
        let class = stem(&whole);
        for kind in ["holes", "cuts"] {
            let parts = folder.join(kind);
            if parts.is_dir() {
                let prefix = format!("{kind}_{class}_");
                let of_class = mesh_files(&parts)?.into_iter().filter(|p| stem(p).starts_with(&prefix));
                shapes.extend(of_class.enumerate().map(|(i, mesh)| ShapeEntry {
                    name: stem(&mesh),
                    group: class.clone(),
                    correspondence: Correspondence::Barycentric(
                        mesh.with_extension("baryc_gt"),
                        whole.clone(),
                    ),
                    split: if i < TRAINING_PARTS { Split::Train } else { Split::Test },
                    partial: true,
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
            partial: false,
        });
    }
    Ok(shapes)
}

/// For each vertex of the whole shape the vertex of the part that lies nearest to it by barycentric weight, or [`MISSING`].
pub(super) fn points(ground_truth: &Path, whole: &Path) -> Result<Vec<u32>, DatasetError> {
    let whole = read_mesh(whole)?.mesh;
    let text = std::fs::read_to_string(ground_truth)
        .map_err(|source| DatasetError::Folder { path: ground_truth.to_path_buf(), source })?;
    let mut points = vec![MISSING; whole.n_vertices()];
    let mut best = vec![0.0; whole.n_vertices()];
    for (vertex, line) in text.lines().filter(|l| !l.trim().is_empty()).enumerate() {
        let wrong = |reason: &str| DatasetError::Correspondence {
            path: ground_truth.to_path_buf(),
            reason: format!("line {}: {reason}", vertex + 1),
        };
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|x| x.parse().ok()).collect();
        let [face, weights @ ..] = numbers.as_slice() else { return Err(wrong("empty")) };
        if weights.len() != 3 {
            return Err(wrong("expected a triangle and three barycentric weights"));
        }
        if !(*face >= 1.0 && *face <= whole.n_faces() as f64) {
            return Err(wrong(&format!("triangle {face}, but the whole shape has {}", whole.n_faces())));
        }
        let corners = whole.faces()[*face as usize - 1];
        let (corner, &weight) =
            corners.iter().zip(weights).max_by(|a, b| a.1.total_cmp(b.1)).expect("a triangle has corners");
        if weight > best[*corner as usize] {
            best[*corner as usize] = weight;
            points[*corner as usize] = vertex as u32;
        }
    }
    Ok(points)
}
