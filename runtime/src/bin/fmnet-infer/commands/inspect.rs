//! `fmnet-infer inspect`: what a mesh or a model is, and what is wrong with it.

use super::output::{file_name, some_of};
use crate::args::InspectArgs;
use crate::console::{Console, shown};
use anyhow::Result;
use fmnet::io::{IoError, MeshFile, MeshFormat, decode_mesh};
use fmnet::mesh::inspect;
use fmnet::network::contract::read_contract;
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &InspectArgs, console: &Console) -> Result<()> {
    let bytes =
        std::fs::read(&args.file).map_err(|source| IoError::Read { path: args.file.clone(), source })?;
    let named = args.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("onnx"));
    // A model is a Protobuf message, which begins with the number of its version.
    let unnamed = MeshFormat::from_path(&args.file).is_none() && bytes.first() == Some(&0x08);
    if named || unnamed {
        inspect_model(&args.file, &bytes, console)
    } else {
        inspect_mesh(&args.file, &bytes, console)
    }
}

fn inspect_mesh(path: &Path, bytes: &[u8], console: &Console) -> Result<()> {
    let file = decode_mesh(bytes, path)?;
    let info = &file.info;
    for warning in &info.warnings {
        console.warn(&format!("{}: {warning}", path.display()));
    }
    for what in &info.left_out {
        console.warn(&format!("{}: left out: {what}", path.display()));
    }
    let report = inspect(&file.mesh);
    let carried = carried(&file);
    let mut text = format!("{}\n{report}", file_name(path));
    if info.n_polygons > 0 {
        let split = format!(" faces ({} polygons of the file split into triangles)", info.n_polygons);
        text = text.replacen(" faces", &split, 1);
    }
    if !carried.is_empty() {
        text.push_str(&format!("\ncarries     {}", carried.join("; ")));
    }
    let summary = json!({ "file": shown(path), "report": report, "carries": carried, "left_out": info.left_out,
                          "warnings": info.warnings, "groups": info.groups, "polygons": info.n_polygons });
    Ok(console.result(&text, summary)?)
}

/// What the file carries besides triangles.
fn carried(file: &MeshFile) -> Vec<String> {
    let mut carried = file.attributes.names();
    let info = &file.info;
    if info.n_polygons > 0 {
        carried.push(format!("{} polygons of more than three corners, read as triangles", info.n_polygons));
    }
    if !info.groups.is_empty() {
        carried.push(format!("{} groups: {}", info.groups.len(), some_of(&info.groups)));
    }
    carried
}

fn inspect_model(path: &Path, bytes: &[u8], console: &Console) -> Result<()> {
    let contract = read_contract(path, bytes)?;
    let inputs: Vec<String> = contract
        .inputs
        .iter()
        .map(|input| match input.width {
            0 => input.quantity.name().to_string(),
            width => format!("{} ({width})", input.quantity.name()),
        })
        .collect();
    let lines: Vec<String> =
        contract.metadata.to_pairs().iter().map(|(key, value)| format!("  {key}: {value}")).collect();
    let text = format!(
        "{}: a descriptor network of fmnet\n  from {} to {} descriptors\n{}",
        file_name(path),
        inputs.join(", "),
        contract.outputs,
        lines.join("\n")
    );
    let widths: serde_json::Map<String, serde_json::Value> =
        contract.inputs.iter().map(|input| (input.quantity.name().to_string(), json!(input.width))).collect();
    let summary = json!({ "file": shown(path), "metadata": contract.metadata, "inputs": widths, "outputs": contract.outputs });
    Ok(console.result(&text, summary)?)
}
