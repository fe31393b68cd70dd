//! `fmnet-infer batch`: many pairs, each shape processed once.

use super::matching::read;
use super::output::{create_folder, file_name};
use crate::args::BatchArgs;
use crate::console::Console;
use anyhow::{Context, Result, bail};
use fmnet::io::write_point_map;
use fmnet::pipeline::{DescribedShape, MatchOptions, Matcher};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Processed shapes kept in memory; others come back from the cache folder.
const KEPT_SHAPES: usize = 8;

struct Pair {
    source: PathBuf,
    target: PathBuf,
    out: PathBuf,
}

pub(crate) fn run(args: &BatchArgs, console: &Console) -> Result<()> {
    let pairs = read_pairs(args)?;
    create_folder(&args.out)?;
    let options = args.pipeline.to_options();
    let cache = options.cache.clone().unwrap_or_else(|| args.out.join("cache"));
    let matcher = Matcher::new(&MatchOptions { cache: Some(cache), ..options })?;
    let mut shapes = Shapes { matcher: &matcher, kept: BTreeMap::new(), order: Vec::new() };
    let (mut done, mut skipped, mut failures) = (0, 0, Vec::new());
    for (number, pair) in pairs.iter().enumerate() {
        if pair.out.is_file() {
            skipped += 1;
            continue;
        }
        match match_pair(pair, args.partial, &mut shapes, console) {
            Ok(()) => {
                done += 1;
                console.say(&format!("{} of {}: {}", number + 1, pairs.len(), pair.out.display()));
            }
            Err(error) => {
                console.warn(&format!("{} of {}: {error:#}", number + 1, pairs.len()));
                failures.push(
                    json!({ "source": pair.source, "target": pair.target, "error": format!("{error:#}") }),
                );
            }
        }
    }
    let text = format!("{done} matched, {skipped} were there already, {} failed", failures.len());
    let failed = failures.len();
    let summary =
        json!({ "matched": done, "skipped": skipped, "failed": Value::Array(failures), "out": args.out });
    console.result(&text, summary);
    if failed > 0 {
        bail!("{failed} of {} pairs failed; mend or remove them and run the same command again", pairs.len());
    }
    Ok(())
}

fn match_pair(pair: &Pair, partial: bool, shapes: &mut Shapes, console: &Console) -> Result<()> {
    let target = shapes.get(&pair.target, None, console)?;
    let whole_area = partial.then(|| target.shape.full_mesh.area());
    let source = shapes.get(&pair.source, whole_area, console)?;
    let result = shapes.matcher.match_shapes(&source, &target, &|event| console.event(event))?;
    Ok(write_point_map(&pair.out, &result.map)?)
}

/// A shape's file and, where it is a part, the bits of the area of the whole.
type ShapeKey = (PathBuf, Option<u64>);

/// The shapes used last.
struct Shapes<'a> {
    matcher: &'a Matcher,
    kept: BTreeMap<ShapeKey, Arc<DescribedShape>>,
    order: Vec<ShapeKey>,
}

impl Shapes<'_> {
    /// The shape of a file; with the area of the whole, as a part.
    fn get(
        &mut self,
        path: &Path,
        whole_area: Option<f64>,
        console: &Console,
    ) -> Result<Arc<DescribedShape>> {
        let key = (path.to_path_buf(), whole_area.map(f64::to_bits));
        self.order.retain(|other| *other != key);
        self.order.push(key.clone());
        if let Some(shape) = self.kept.get(&key) {
            return Ok(shape.clone());
        }
        let (mesh, name) = (read(path, console)?, file_name(path));
        let observer = |event| console.event(event);
        let shape = Arc::new(match whole_area {
            Some(area) => self.matcher.describe_part(&name, &mesh, area, &observer)?,
            None => self.matcher.describe(&name, &mesh, &observer)?,
        });
        if self.kept.len() == KEPT_SHAPES {
            let oldest = self.order.remove(0);
            self.kept.remove(&oldest);
        }
        self.kept.insert(key, shape.clone());
        Ok(shape)
    }
}

fn read_pairs(args: &BatchArgs) -> Result<Vec<Pair>> {
    let text = std::fs::read_to_string(&args.pairs)
        .with_context(|| format!("cannot read {}", args.pairs.display()))?;
    let root = args.root.as_deref().or(args.pairs.parent()).unwrap_or(Path::new("."));
    let mut pairs = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let separator: &[char] = if line.contains('\t') { &['\t'] } else { &[' '] };
        let names: Vec<&str> = line.split(separator).map(str::trim).filter(|s| !s.is_empty()).collect();
        let [source, target] = names.as_slice() else {
            bail!(
                "{}, line {}: expected two mesh files, found {}; separate names that contain spaces by a tab",
                args.pairs.display(),
                number + 1,
                names.len()
            );
        };
        let out = args.out.join(format!("{}__{}.{}", stem(source), stem(target), args.format));
        pairs.push(Pair { source: root.join(source), target: root.join(target), out });
    }
    check_names(&pairs)?;
    Ok(pairs)
}

/// Two pairs must not write the same file.
fn check_names(pairs: &[Pair]) -> Result<()> {
    let mut seen: BTreeMap<&Path, &Pair> = BTreeMap::new();
    for pair in pairs {
        if let Some(other) = seen.insert(&pair.out, pair)
            && (&other.source, &other.target) != (&pair.source, &pair.target)
        {
            bail!(
                "{} -> {} and {} -> {} would both be written to {}; give the files different names",
                other.source.display(),
                other.target.display(),
                pair.source.display(),
                pair.target.display(),
                pair.out.display()
            );
        }
    }
    Ok(())
}

fn stem(name: &str) -> String {
    Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
