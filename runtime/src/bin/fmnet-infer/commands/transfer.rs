//! `fmnet-infer transfer`: attributes over a map.

use crate::args::{Receiver, TransferArgs};
use crate::console::Console;
use anyhow::{Context, Result, bail};
use fmnet::Mesh;
use fmnet::io::{
    MeshFile, read_matrix, read_mesh, read_point_map, write_atomically, write_matrix, write_mesh,
};
use fmnet::render::{Donors, transfer_attributes, transfer_landmarks, transfer_values};
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &TransferArgs, console: &Console) -> Result<()> {
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
    let mut values = args.values.iter();
    for output in &args.outputs {
        if is_mesh(output) {
            write_transferred_mesh(output, giver, &receiver.mesh, &donors)?;
        } else {
            let input = values.next().with_context(|| {
                format!(
                    "{}: no --values file is left for this output; give one --values for each",
                    output.display()
                )
            })?;
            write_transferred_values(input, output, &giver.mesh, &receiver.mesh, &donors)?;
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
    if input.extension().is_some_and(|e| e == "txt") {
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
    Ok(write_matrix(output, &transfer_values(&values, donors))?)
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

fn is_mesh(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    matches!(extension.as_deref(), Some("ply" | "obj" | "glb" | "off"))
}
