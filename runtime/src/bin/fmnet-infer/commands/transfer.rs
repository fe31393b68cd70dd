//! `fmnet-infer transfer`: attributes over a map.

use super::output::check_folder;
use crate::args::{Receiver, TransferArgs};
use crate::console::Console;
use anyhow::{Context, Result, bail};
use fmnet::Mesh;
use fmnet::io::{
    MeshFile, read_matrix, read_mesh, read_point_map, write_atomically, write_matrix, write_mesh,
    write_vector,
};
use fmnet::render::{Donors, transfer_attributes, transfer_landmarks, transfer_values};
use serde_json::json;
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &TransferArgs, console: &Console) -> Result<()> {
    let values_of_outputs = values_of_outputs(args)?;
    let (source, target) = (read_mesh(&args.source)?, read_mesh(&args.target)?);
    let map = read_point_map(&args.map, Some(target.mesh.n_vertices()))?;
    if map.len() != source.mesh.n_vertices() {
        bail!(
            "{} maps {} source vertices, but {} has {}; pass the map of these two meshes, in this order",
            args.map.display(),
            map.len(),
            args.source.display(),
            source.mesh.n_vertices()
        );
    }
    let (giver, receiver, donors) = match args.to {
        Receiver::Source => (&target, &source, Donors::of_source(&map)),
        Receiver::Target => (&source, &target, Donors::of_target(&map, &target.mesh)),
    };
    let donors = donors.interpolated(&receiver.mesh, &giver.mesh);
    let path_of_giver = if args.to == Receiver::Source { &args.target } else { &args.source };
    for warning in &giver.info.warnings {
        console.warn(&format!("{}: {warning}", path_of_giver.display()));
    }
    for (output, values) in args.outputs.iter().zip(values_of_outputs) {
        match values {
            None => write_transferred_mesh(output, giver, &receiver.mesh, &donors)?,
            Some(input) => write_transferred_values(input, output, &giver.mesh, &receiver.mesh, &donors)?,
        }
    }
    let without = donors.iter().filter(|d| d.is_none()).count();
    let text = format!("{} vertices received, {without} have no match", donors.len() - without);
    console.result(
        &text,
        json!({ "received": donors.len() - without, "without_match": without, "outputs": args.outputs }),
    );
    Ok(())
}

/// For each output the file of values that it is made from; `None` for a mesh. Refuses what could not be written, before any work.
fn values_of_outputs(args: &TransferArgs) -> Result<Vec<Option<&PathBuf>>> {
    let mut values = args.values.iter();
    let of_output = |output: &PathBuf| {
        check_folder(output)?;
        let extension = extension(output);
        match extension.as_str() {
            "ply" | "obj" | "glb" | "off" => Ok(None),
            "npy" | "txt" => {
                let input = values.next().with_context(|| {
                    format!(
                        "{}: no --values file is left for this output; give one --values for each",
                        output.display()
                    )
                })?;
                let of_input = if is_landmarks(input) { "txt" } else { "npy" };
                if extension != of_input {
                    bail!(
                        "{}: what comes of {} is a .{of_input} file; name the output so",
                        output.display(),
                        input.display()
                    );
                }
                Ok(Some(input))
            }
            _ => bail!(
                "{}: unknown kind of output; use .ply, .obj, .glb or .off for the mesh, .npy or .txt for --values",
                output.display()
            ),
        }
    };
    let inputs = args.outputs.iter().map(of_output).collect::<Result<_>>()?;
    match values.next() {
        Some(left) => bail!("{}: no output is left for these --values; add -o FILE for them", left.display()),
        None => Ok(inputs),
    }
}

fn write_transferred_mesh(output: &Path, giver: &MeshFile, receiver: &Mesh, donors: &Donors) -> Result<()> {
    let attributes = transfer_attributes(&giver.mesh, &giver.attributes, receiver, donors);
    Ok(write_mesh(output, receiver, &attributes)?)
}

fn write_transferred_values(
    input: &Path,
    output: &Path,
    giver: &Mesh,
    receiver: &Mesh,
    donors: &Donors,
) -> Result<()> {
    if is_landmarks(input) {
        let landmarks = transfer_landmarks(&read_landmarks(input, giver)?, giver, receiver, donors);
        let lines: String = landmarks.iter().map(|l| l.map_or("-1\n".into(), |v| format!("{v}\n"))).collect();
        return Ok(write_atomically(output, |out| out.write_all(lines.as_bytes()))?);
    }
    let values = read_matrix::<f64>(input)?;
    if values.rows() != giver.n_vertices() {
        bail!(
            "{}: {} rows, but the giving mesh has {} vertices",
            input.display(),
            values.rows(),
            giver.n_vertices()
        );
    }
    let moved = transfer_values(&values, donors);
    match moved.cols() {
        1 => write_vector(output, moved.data())?,
        _ => write_matrix(output, &moved)?,
    }
    Ok(())
}

fn read_landmarks(path: &Path, mesh: &Mesh) -> Result<Vec<u32>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    lines
        .map(|(number, line)| match line.trim().parse::<u32>() {
            Ok(vertex) if (vertex as usize) < mesh.n_vertices() => Ok(vertex),
            _ => bail!(
                "{}, line {}: expected a vertex from 0 to {}, found {line:?}",
                path.display(),
                number + 1,
                mesh.n_vertices() - 1
            ),
        })
        .collect()
}

/// The extension in lower case.
fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Whether a file of values is one of landmarks.
fn is_landmarks(path: &Path) -> bool {
    extension(path) == "txt"
}
