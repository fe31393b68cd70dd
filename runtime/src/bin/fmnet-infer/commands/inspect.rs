//! `fmnet-infer inspect`: what a mesh or a model is, and what is wrong with it.

use super::output::file_name;
use crate::args::InspectArgs;
use crate::console::Console;
use anyhow::{Context, Result};
use fmnet::io::read_mesh;
use fmnet::mesh::inspect;
use fmnet::network::contract::read_contract;
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &InspectArgs, console: &Console) -> Result<()> {
    if args.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("onnx")) {
        inspect_model(&args.file, console)
    } else {
        inspect_mesh(&args.file, console)
    }
}

fn inspect_mesh(path: &Path, console: &Console) -> Result<()> {
    let file = read_mesh(path)?;
    for warning in &file.info.warnings {
        console.warn(&format!("{}: {warning}", path.display()));
    }
    let report = inspect(&file.mesh);
    console.result(&format!("{}\n{report}", file_name(path)), json!({ "file": path, "report": report }));
    Ok(())
}

fn inspect_model(path: &Path, console: &Console) -> Result<()> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let contract = read_contract(path, &bytes)?;
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
    let summary =
        json!({ "file": path, "metadata": contract.metadata, "inputs": widths, "outputs": contract.outputs });
    console.result(&text, summary);
    Ok(())
}
