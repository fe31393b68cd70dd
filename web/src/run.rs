//! A match from two files to everything that the page shows, as `fmnet-infer match` does it.

use crate::send;
use fmnet::events::Event;
use fmnet::io::{decode_mesh, encode_glb, encode_point_map};
use fmnet::network::Backend;
use fmnet::pipeline::{DescribedShape, Match, MatchOptions, Matcher};
use fmnet::render::{ViewerPair, side_by_side, viewer_html};
use serde_json::{Value, json};
use std::error::Error;
use std::path::Path;

/// Below this confidence a vertex counts as doubtful.
const CONFIDENT: f32 = 0.5;

fn matcher() -> Result<Matcher, fmnet::Error> {
    // The library's own kernels: nothing else has to be compiled into the module.
    let mut options = MatchOptions::default();
    options.backend = Backend::Native;
    Matcher::new(&options)
}

pub(crate) fn describe(name: &str, file: Box<[u8]>, whole_area: Option<f64>) -> Result<(), Box<dyn Error>> {
    let decoded = decode_mesh(&file, Path::new(name))?;
    drop(file);
    for warning in &decoded.info.warnings {
        tell(Event::Warning(format!("{name}: {warning}")));
    }
    let (matcher, mesh) = (matcher()?, decoded.mesh);
    let described = match whole_area {
        Some(area) => matcher.describe_part(name, &mesh, area, &tell)?,
        None => matcher.describe(name, &mesh, &tell)?,
    };
    let shape = json!({ "area": described.shape.full_mesh.area() });
    send("shape", shape.to_string().as_bytes());
    send("described", &described.encode());
    Ok(())
}

pub(crate) fn match_described(source: Box<[u8]>, target: Box<[u8]>) -> Result<(), Box<dyn Error>> {
    let decoded = |bytes: Box<[u8]>, name| DescribedShape::decode(&bytes, Path::new(name));
    let (source, target) = (decoded(source, "source")?, decoded(target, "target")?);
    let result = matcher()?.match_shapes(&source, &target, &tell)?;
    let (source, target) = (&source.shape, &target.shape);
    let (name_source, name_target) = (source.name.as_str(), target.name.as_str());
    let (source, target) = (source.input_mesh(), target.input_mesh());
    let caption = caption(&result);
    let page = viewer_html(&ViewerPair {
        title: &format!("{name_source} → {name_target}"),
        name_source,
        name_target,
        source,
        target,
        map: &result.map,
        caption: &caption,
    })?;
    send("viewer", page.as_bytes());
    drop(page);
    for name in ["map.txt", "map.csv"] {
        send(name, &encode_point_map(Path::new(name), &result.map)?);
    }
    let (mesh, attributes) = side_by_side(source, target, &result.map)?;
    send("pair.glb", &encode_glb(Path::new("pair.glb"), &mesh, &attributes)?);
    send("summary", summary(&result).to_string().as_bytes());
    Ok(())
}

fn tell(event: Event) {
    let value = match event {
        Event::Started { subject, stage } => json!({ "started": stage, "subject": subject }),
        Event::Finished { subject, stage, .. } => json!({ "finished": stage, "subject": subject }),
        Event::Warning(text) => json!({ "warning": text }),
        _ => return,
    };
    send("event", value.to_string().as_bytes());
}

fn caption(result: &Match) -> String {
    let matched = result.map.iter().flatten().count();
    format!(
        "{matched} of {} source vertices matched; expected mean error {:.1} % of sqrt(area)",
        result.map.len(),
        result.estimate.expected_error
    )
}

fn summary(result: &Match) -> Value {
    let (quality, estimate) = (&result.quality, &result.estimate);
    let confidence = result.map.confidence.as_deref().unwrap_or_default();
    json!({
        "n_source": result.map.len(),
        "n_target": result.map.n_target,
        "matched": result.map.iter().flatten().count(),
        "doubtful_vertices": confidence.iter().filter(|&&c| c < CONFIDENT).count(),
        "doubtful": estimate.doubtful || quality.is_mirrored(),
        "mirrored": quality.is_mirrored(),
        "expected_error": estimate.expected_error,
        "probability_bad": estimate.bad,
        "quality": quality,
        "way": result.candidates.iter().find(|candidate| candidate.taken).map(|candidate| &candidate.name),
    })
}
