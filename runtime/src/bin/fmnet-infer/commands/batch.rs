//! `fmnet-infer batch`: many pairs, each shape processed once.

use super::matching::{quality, read};
use super::output::{Inputs, create_folder, file_name};
use crate::args::BatchArgs;
use crate::console::{Console, shown};
use anyhow::{Result, bail};
use fmnet::batch::{Made, MapKeys, Pair, decode_pairs, made_from, read_pairs, write_map};
use fmnet::causes;
use fmnet::io::IoError;
use fmnet::pipeline::{DescribedShape, Match, Matcher};
use serde_json::{Value, json};
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
    let matcher = Matcher::new(&options.clone().cache(cache))?;
    check_outputs(args, &pairs)?;
    let mut keys = MapKeys::new(&matcher, &options, args.partial);
    let mut shapes = Shapes { matcher: &matcher, kept: Vec::new() };
    let (mut done, mut renewed, mut skipped, mut failures) = (0, 0, 0, Vec::new());
    let (mut maps, mut doubtful) = (Vec::new(), 0);
    for (number, pair) in pairs.iter().enumerate() {
        let outcome = keys.of(pair).map_err(anyhow::Error::from).and_then(|key| match made_from(&pair.out) {
            Made::From(old) if old == key => Ok(Outcome::Kept),
            made => {
                let result = match_pair(pair, &key, args.partial, &mut shapes, console)?;
                let anew = !matches!(made, Made::Not);
                Ok(Outcome::Made { anew, quality: quality(&result.quality, &result.estimate) })
            }
        });
        let place = format!("{} of {}", number + 1, pairs.len());
        match outcome {
            Ok(Outcome::Kept) => skipped += 1,
            Ok(Outcome::Made { anew, quality }) => {
                done += 1;
                renewed += usize::from(anew);
                let is_doubtful = quality["doubtful"] == true;
                doubtful += usize::from(is_doubtful);
                let trust = if is_doubtful { ", DOUBTFUL" } else { "" };
                let error = quality["expected_error"].as_f64().unwrap_or_default();
                let why = if anew {
                    ", made anew: a mesh, the model or an option is another than before"
                } else {
                    ""
                };
                console.say(&format!(
                    "{place}: {}, expected mean error {error:.1} % of sqrt(area){trust}{why}",
                    pair.out.display()
                ));
                maps.push(json!({ "source": shown(&pair.source), "target": shown(&pair.target),
                                  "map": shown(&pair.out), "quality": quality }));
            }
            Err(error) => {
                let error = causes(error.as_ref());
                console.warn(&format!("{place}: {error}"));
                let (source, target) = (shown(&pair.source), shown(&pair.target));
                failures.push(json!({ "source": source, "target": target, "error": error }));
            }
        }
    }
    let anew = if renewed > 0 { format!(" ({renewed} of them anew)") } else { String::new() };
    let uncertain = if doubtful > 0 { format!(", {doubtful} of them doubtful") } else { String::new() };
    let text =
        format!("{done} matched{anew}{uncertain}, {skipped} were there already, {} failed", failures.len());
    let failed = failures.len();
    let summary = json!({ "matched": done, "renewed": renewed, "skipped": skipped, "doubtful": doubtful,
                          "failed": Value::Array(failures), "maps": maps,
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
    /// Made now, in place of an older one or for the first time.
    Made {
        anew: bool,
        quality: Value,
    },
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

fn match_pair(
    pair: &Pair,
    key: &str,
    partial: bool,
    shapes: &mut Shapes,
    console: &Console,
) -> Result<Match> {
    let target = shapes.get(&pair.target, None, console)?;
    let whole_area = partial.then(|| target.shape.full_mesh.area());
    let source = shapes.get(&pair.source, whole_area, console)?;
    let result = shapes.matcher.match_shapes(&source, &target, &|event| console.event(event))?;
    write_map(&pair.out, &result.map, key)?;
    Ok(result)
}

/// A shape's file and, where it is a part, the bits of the area of the whole.
type ShapeKey = (PathBuf, Option<u64>);

/// The shapes used last, the latest at the end.
struct Shapes<'a> {
    matcher: &'a Matcher,
    kept: Vec<(ShapeKey, Arc<DescribedShape>)>,
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
        if let Some(at) = self.kept.iter().position(|(other, _)| *other == key) {
            let (key, shape) = self.kept.remove(at);
            self.kept.push((key, shape.clone()));
            return Ok(shape);
        }
        let (mesh, name) = (read(path, console)?.mesh, file_name(path));
        let observer = |event| console.event(event);
        let shape = Arc::new(match whole_area {
            Some(area) => self.matcher.describe_part(&name, &mesh, area, &observer)?,
            None => self.matcher.describe(&name, &mesh, &observer)?,
        });
        self.kept.push((key, shape.clone()));
        if self.kept.len() > KEPT_SHAPES {
            self.kept.remove(0);
        }
        Ok(shape)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Common;
    use fmnet::io::{Attributes, write_mesh};
    use fmnet::mesh::shapes::bumpy_sphere;
    use fmnet::pipeline::{DescriptorKind, MatchOptions, Resize};

    #[test]
    fn shapes_that_fail_do_not_make_the_store_grow() {
        let folder = tempfile::tempdir().unwrap();
        let options = MatchOptions::default().descriptor(DescriptorKind::Shot).k(8).subdivide(Resize::Never);
        let matcher = Matcher::new(&options).unwrap();
        let console = Console::new(&Common { threads: None, quiet: true, json: false });
        let mut shapes = Shapes { matcher: &matcher, kept: Vec::new() };
        std::fs::write(folder.path().join("bad.off"), "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n").unwrap();
        for seed in 0..3 * KEPT_SHAPES as u64 {
            let path = folder.path().join(format!("s{seed}.off"));
            write_mesh(&path, &bumpy_sphere(1, seed), &Attributes::default()).unwrap();
            assert!(shapes.get(&folder.path().join("bad.off"), None, &console).is_err());
            let shape = shapes.get(&path, None, &console).unwrap();
            assert!(Arc::ptr_eq(&shape, &shapes.get(&path, None, &console).unwrap()), "it is kept");
            assert!(shapes.kept.len() <= KEPT_SHAPES);
        }
    }
}
