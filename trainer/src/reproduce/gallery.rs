//! Meshes without ground truth, matched and pictured.

use super::ReproduceError;
use crate::dataset::mesh_files;
use fmnet::eval::{Block, Section};
use fmnet::events::{Event, Observer};
use fmnet::io::read_mesh;
use fmnet::pipeline::{MatchOptions, Matcher, ModelSource};
use fmnet::render::pair_picture;
use std::path::Path;
use std::time::Instant;

/// Columns of a picture.
const WIDTH: usize = 900;

/// Every second mesh of a folder matched to the next one, in the order of their names.
pub(super) fn section(folder: &Path, model: &Path, observer: Observer) -> Result<Section, ReproduceError> {
    let options = MatchOptions::default().model(ModelSource::File(model.into()));
    let failed = |e: fmnet::Error| ReproduceError::Evaluate(Box::new(e).into());
    let matcher = Matcher::new(&options).map_err(failed)?;
    let files = mesh_files(folder)?;
    let mut blocks = Vec::new();
    for pair in files.chunks_exact(2) {
        let start = Instant::now();
        let (source, target) = (read_mesh(&pair[0])?.mesh, read_mesh(&pair[1])?.mesh);
        let [name_source, name_target] =
            [0, 1].map(|i| pair[i].file_stem().unwrap_or_default().to_string_lossy().into_owned());
        let described_source = matcher.describe(&name_source, &source, observer).map_err(failed)?;
        let described_target = matcher.describe(&name_target, &target, observer).map_err(failed)?;
        let found = matcher.match_shapes(&described_source, &described_target, observer).map_err(failed)?;
        let seconds = start.elapsed().as_secs_f64();
        let matched = found.map.iter().flatten().count();
        let caption = format!(
            "{name_source} (left) to {name_target}: {matched} of {} vertices matched, {seconds:.1} s in all",
            found.map.len()
        );
        if let Ok(picture) = pair_picture(&source, &target, &found.map, WIDTH) {
            blocks.push(Block::Image { media_type: "image/png".into(), bytes: picture.to_png(), caption });
        }
        let subject = format!("{name_source} -> {name_target}");
        observer(Event::Finished { subject, stage: "pictured", seconds });
    }
    Ok(Section { title: format!("{} without ground truth", folder.display()), blocks })
}
