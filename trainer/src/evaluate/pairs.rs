//! Which pairs are evaluated.

use crate::dataset::{Dataset, Split};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a list of pairs cannot be used.
#[derive(Debug, Error)]
pub enum PairError {
    /// The list cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The list.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A line does not name two shapes of one group.
    #[error("{path}, line {line}: {reason}")]
    Line {
        /// The list.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
}

/// At most `count` random ordered pairs (source, target), as indices into the dataset's shapes, of one group within
/// the given splits, drawn by `seed`; a part of a shape is matched to whole shapes of any split, as a whole has no
/// pose of its own to learn by heart.
pub fn random_pairs(dataset: &Dataset, splits: &[Split], count: usize, seed: u64) -> Vec<(usize, usize)> {
    let shapes = &dataset.shapes;
    let fits = |&(s, t): &(usize, usize)| {
        let (source, target) = (&shapes[s], &shapes[t]);
        let in_splits =
            splits.contains(&source.split) && (splits.contains(&target.split) || source.is_part());
        s != t && source.group == target.group && !target.is_part() && in_splits
    };
    let all = (0..shapes.len()).flat_map(|s| (0..shapes.len()).map(move |t| (s, t)));
    let mut pairs: Vec<(usize, usize)> = all.filter(fits).collect();
    pairs.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    pairs.truncate(count);
    pairs
}

/// The pairs (source, target), as indices into the dataset's shapes, of a text file: the names of source and target
/// on each line, `#` begins a comment.
///
/// # Errors
/// If the list cannot be read, or a line does not name two shapes of one group.
pub fn listed_pairs(dataset: &Dataset, path: &Path) -> Result<Vec<(usize, usize)>, PairError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| PairError::Read { path: path.to_path_buf(), source })?;
    let mut pairs = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        if content.trim().is_empty() {
            continue;
        }
        let wrong = |reason| PairError::Line { path: path.to_path_buf(), line: index + 1, reason };
        let names: Vec<&str> = content.split_whitespace().collect();
        let [source, target] = names[..] else {
            return Err(wrong("expected the names of a source and a target".into()));
        };
        let find = |name: &str| {
            let found = dataset.shapes.iter().position(|shape| shape.name == name);
            found.ok_or_else(|| wrong(format!("{} has no shape {name}", dataset.folder.display())))
        };
        let (s, t) = (find(source)?, find(target)?);
        if dataset.shapes[s].group != dataset.shapes[t].group {
            return Err(wrong(format!(
                "{source} and {target} do not correspond: they are of different groups"
            )));
        }
        pairs.push((s, t));
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Correspondence, ShapeEntry};

    fn dataset() -> Dataset {
        let shape = |name: &str, group: &str, split, partial: bool| ShapeEntry {
            name: name.into(),
            mesh: PathBuf::from(name),
            group: group.into(),
            correspondence: Correspondence::Identity,
            split,
            whole: partial.then(|| PathBuf::from("a")),
        };
        let shapes = vec![
            shape("a", "man", Split::Train, false),
            shape("b", "man", Split::Validation, false),
            shape("c", "man", Split::Validation, false),
            shape("d", "dog", Split::Validation, false),
            shape("part", "man", Split::Validation, true),
        ];
        Dataset { layout: "test", folder: "folder".into(), shapes }
    }

    #[test]
    fn random_pairs_are_of_one_group_and_split() {
        let pairs = random_pairs(&dataset(), &[Split::Validation], 100, 1);
        let mut sorted = pairs.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, [(1, 2), (2, 1), (4, 0), (4, 1), (4, 2)]);
        assert_eq!(random_pairs(&dataset(), &[Split::Validation], 2, 1), pairs[..2]);
    }

    #[test]
    fn lists_are_checked_line_by_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pairs.txt");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            listed_pairs(&dataset(), &path).map_err(|e| e.to_string())
        };
        assert_eq!(read("# two\nb c\n\nc b # back\n").unwrap(), [(1, 2), (2, 1)]);
        for (text, part) in
            [("b\n", "line 1: expected"), ("b c\nb x\n", "line 2: folder has no shape x"), ("b d", "groups")]
        {
            let error = read(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
