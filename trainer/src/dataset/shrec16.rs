//! The SHREC'16 partial correspondence benchmark: whole shapes in `null/CLASS.off`, parts in `holes/` or `cuts/`
//! `holes_CLASS_shape_N.off`, with `.baryc_gt` files that say where each vertex of the part lies on the whole shape:
//! line `v` holds a 1-based triangle of the whole and three barycentric weights.

use super::layouts::{mesh_files, stem};
use super::{Correspondence, DatasetError, MISSING, ShapeEntry, Split};
use fmnet::io::read_mesh;
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

/// For each vertex of the whole shape the vertex, below `n`, of the part that lies nearest to it by barycentric weight, or
/// [`MISSING`].
pub(super) fn points(ground_truth: &Path, whole: &Path, n: usize) -> Result<Vec<u32>, DatasetError> {
    let whole = read_mesh(whole)?.mesh;
    let text = std::fs::read_to_string(ground_truth)
        .map_err(|source| DatasetError::Folder { path: ground_truth.to_path_buf(), source })?;
    let wrong = |reason| DatasetError::Correspondence { path: ground_truth.to_path_buf(), reason };
    let mut points = vec![MISSING; whole.n_vertices()];
    let mut best = vec![0.0; whole.n_vertices()];
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let mut count = 0;
    for (vertex, (number, line)) in lines.enumerate() {
        let (face, weights) =
            parse(line, whole.n_faces()).map_err(|reason| wrong(format!("line {}: {reason}", number + 1)))?;
        let heaviest = (0..3).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
        let corner = whole.faces()[face][heaviest] as usize;
        if weights[heaviest] > best[corner] {
            best[corner] = weights[heaviest];
            points[corner] = vertex as u32;
        }
        count += 1;
    }
    match count == n {
        true => Ok(points),
        false => {
            Err(wrong(format!("{count} lines, but the part has {n} vertices; expected a line for each")))
        }
    }
}

/// The 0-based triangle and the weights of a line.
fn parse(line: &str, n_faces: usize) -> Result<(usize, [f64; 3]), String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [face, weights @ ..] = words.as_slice() else { return Err("empty".into()) };
    let &[a, b, c] = weights else {
        return Err(format!("{} numbers; expected a triangle and three barycentric weights", words.len()));
    };
    let number = |word: &str| match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!("{word:?} is no number")),
    };
    // MATLAB may have written the index as a float.
    let index = number(face)?;
    if index.fract() != 0.0 || index < 1.0 || index > n_faces as f64 {
        return Err(format!("triangle {face}, but the whole shape has triangles 1 to {n_faces}"));
    }
    Ok((index as usize - 1, [number(a)?, number(b)?, number(c)?]))
}
