//! `fmnet-infer batch`: many pairs, each shape processed once.

use super::matching::read;
use super::output::{Inputs, create_folder, file_name};
use crate::args::BatchArgs;
use crate::console::{Console, causes, shown};
use anyhow::{Result, bail};
use fmnet::batch::{Made, MapKeys, Pair, decode_pairs, made_from, read_pairs, write_map};
use fmnet::io::IoError;
use fmnet::pipeline::{DescribedShape, MatchOptions, Matcher};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Processed shapes kept in memory; others come back from the cache folder.
const KEPT_SHAPES: usize = 8;

pub(crate) fn run(args: &BatchArgs, console: &Console) -> Result<()> {
    let pairs = pairs(args)?;
    create_folder(&args.out)?;
    let options = args.pipeline.to_options();
    let cache = options.cache.clone().unwrap_or_else(|| args.out.join("cache"));
    let matcher = Matcher::new(&MatchOptions { cache: Some(cache), ..options.clone() })?;
    check_outputs(args, &pairs)?;
    let mut keys = MapKeys::new(&matcher, &options, args.partial);
    let mut shapes = Shapes { matcher: &matcher, kept: BTreeMap::new(), order: Vec::new() };
    let (mut done, mut renewed, mut skipped, mut failures) = (0, 0, 0, Vec::new());
    for (number, pair) in pairs.iter().enumerate() {
        let outcome = keys.of(pair).map_err(Into::into).and_then(|key| match made_from(&pair.out) {
            Made::From(old) if old == key => Ok(Outcome::Kept),
            made => {
                match_pair(pair, &key, args.partial, &mut shapes, console)?;
                Ok(if matches!(made, Made::Not) { Outcome::New } else { Outcome::Renewed })
            }
        });
        let place = format!("{} of {}", number + 1, pairs.len());
        match outcome {
            Ok(Outcome::Kept) => skipped += 1,
            Ok(outcome) => {
                done += 1;
                let anew = matches!(outcome, Outcome::Renewed);
                renewed += usize::from(anew);
                let why = if anew {
                    ", made anew: a mesh, the model or an option is another than before"
                } else {
                    ""
                };
                console.say(&format!("{place}: {}{why}", pair.out.display()));
            }
            Err(error) => {
                let error = causes(&error);
                console.warn(&format!("{place}: {error}"));
                let (source, target) = (shown(&pair.source), shown(&pair.target));
                failures.push(json!({ "source": source, "target": target, "error": error }));
            }
        }
    }
    let anew = if renewed > 0 { format!(" ({renewed} of them anew)") } else { String::new() };
    let text = format!("{done} matched{anew}, {skipped} were there already, {} failed", failures.len());
    let failed = failures.len();
    let summary = json!({ "matched": done, "renewed": renewed, "skipped": skipped, "failed": Value::Array(failures),
                          "out": shown(&args.out) });
    console.result(&text, summary)?;
    if failed > 0 {
        bail!("{failed} of {} pairs failed; mend or remove them and run the same command again", pairs.len());
    }
    Ok(())
}

/// The pairs of the list, which may be standard input.
fn pairs(args: &BatchArgs) -> Result<Vec<Pair>> {
    let (root, out) = (args.root.as_deref(), args.out.as_path());
    if args.pairs.as_os_str() != "-" {
        return Ok(read_pairs(&args.pairs, root, out, &args.format)?);
    }
    let mut bytes = Vec::new();
    let read = std::io::stdin().read_to_end(&mut bytes);
    read.map_err(|source| IoError::Read { path: args.pairs.clone(), source })?;
    Ok(decode_pairs(&bytes, &args.pairs, root, out, &args.format)?)
}

enum Outcome {
    Kept,
    New,
    Renewed,
}

/// Refuses a folder whose maps would replace what the command reads.
fn check_outputs(args: &BatchArgs, pairs: &[Pair]) -> Result<()> {
    let mut inputs = Inputs::of_model(&args.pipeline.shape);
    inputs.add(&args.pairs, "the list of pairs");
    for pair in pairs {
        inputs.add(&pair.source, "an input");
        inputs.add(&pair.target, "an input");
    }
    let outs: Vec<PathBuf> = pairs.iter().map(|pair| pair.out.clone()).collect();
    inputs.check(&outs)
}

fn match_pair(pair: &Pair, key: &str, partial: bool, shapes: &mut Shapes, console: &Console) -> Result<()> {
    let target = shapes.get(&pair.target, None, console)?;
    let whole_area = partial.then(|| target.shape.full_mesh.area());
    let source = shapes.get(&pair.source, whole_area, console)?;
    let result = shapes.matcher.match_shapes(&source, &target, &|event| console.event(event))?;
    Ok(write_map(&pair.out, &result.map, key)?)
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
        let (mesh, name) = (read(path, console)?.mesh, file_name(path));
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
