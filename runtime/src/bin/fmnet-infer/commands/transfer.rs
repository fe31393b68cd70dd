//! `fmnet-infer transfer`: attributes over a map.

use super::matching::read;
use super::output::{Inputs, check_places, some_of};
use super::values::{self, Moved, Values};
use crate::args::{Receiver, TransferArgs};
use crate::console::{Console, shown};
use anyhow::{Context, Result, bail};
use fmnet::Mesh;
use fmnet::io::{Attributes, MeshFile, read_point_map, write_mesh};
use fmnet::render::{Donors, fit_skeleton, transfer_attributes};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &TransferArgs, console: &Console) -> Result<()> {
    let values_of_outputs = values_of_outputs(args)?;
    check_places(&args.outputs)?;
    let (source, target) = (read(&args.source, console)?, read(&args.target, console)?);
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
    let n_faces = target.mesh.n_faces();
    if let Some(point) = map.points.iter().flatten().flatten().find(|point| point.face as usize >= n_faces) {
        bail!(
            "{}: face {} does not exist, {} has {n_faces}; pass the map of these two meshes, in this order",
            args.map.display(),
            point.face,
            args.target.display()
        );
    }
    let (giver, receiver, donors) = match args.to {
        Receiver::Source => ((&*args.target, &target), (&*args.source, &source), Donors::of_source(&map)),
        Receiver::Target => {
            ((&*args.source, &source), (&*args.target, &target), Donors::of_target(&map, &target.mesh)?)
        }
    };
    let known = args.to == Receiver::Source && map.points.is_some();
    let donors = match known {
        true => donors.on_surface(&map, &target.mesh),
        false => donors.interpolated(&receiver.1.mesh, &giver.1.mesh),
    }?;
    let has_mesh = values_of_outputs.iter().any(Option::is_none);
    let attributes =
        if has_mesh { carried(giver, receiver, &donors, console)? } else { Attributes::default() };
    check_inputs(args, &source, &target, &attributes)?;
    let meshes = (&giver.1.mesh, &receiver.1.mesh);
    let carry = |path: &PathBuf| -> Result<Moved> {
        Ok(Values::read(path, meshes.0)?.carried(meshes.0, meshes.1, &donors)?)
    };
    let moved = values_of_outputs.iter().map(|values| values.map(carry).transpose());
    let moved = moved.collect::<Result<Vec<_>>>()?;
    for (output, moved) in args.outputs.iter().zip(&moved) {
        match moved {
            None => write_with(&attributes, output, &receiver.1.mesh, console)?,
            Some(moved) => write_values(moved, output, console)?,
        }
    }
    let mut carried: Vec<String> = if has_mesh { giver.1.attributes.names() } else { Vec::new() };
    carried.extend(args.values.iter().map(|path| format!("the values of {}", path.display())));
    report(args, &donors, carried, console)
}

fn write_with(attributes: &Attributes, output: &Path, mesh: &Mesh, console: &Console) -> Result<()> {
    for what in attributes.not_held_by(output) {
        console.warn(&format!("{}: cannot hold {what}", output.display()));
    }
    Ok(write_mesh(output, mesh, attributes)?)
}

fn write_values(moved: &Moved, output: &Path, console: &Console) -> Result<()> {
    let n_missing = moved.write(output)?;
    if n_missing > 0 {
        let why = "have 0, as its type has no other sign for them";
        console.warn(&format!("{}: {n_missing} vertices without a match {why}", output.display()));
    }
    Ok(())
}

fn report(args: &TransferArgs, donors: &Donors, carried: Vec<String>, console: &Console) -> Result<()> {
    let without = donors.iter().filter(Option::is_none).count();
    let received = if carried.is_empty() { 0 } else { donors.len() - without };
    let what = if carried.is_empty() { "nothing".into() } else { some_of(&carried) };
    let text = format!("{received} vertices received {what}, {without} have no match");
    let outputs: Vec<Value> = args.outputs.iter().map(|path| shown(path).into()).collect();
    let summary =
        json!({ "received": received, "carried": carried, "without_match": without, "outputs": outputs });
    Ok(console.result(&text, summary)?)
}

/// The giver's attributes on the receiver, beside those of its own that the giver has none of. What is lost is said.
fn carried(
    (giver_path, giver): (&Path, &MeshFile),
    (receiver_path, receiver): (&Path, &MeshFile),
    donors: &Donors,
    console: &Console,
) -> Result<Attributes> {
    for what in &giver.info.left_out {
        console.warn(&format!("{}: not carried: {what}", giver_path.display()));
    }
    for what in lost_by_receiver(receiver) {
        console.warn(&format!("{}: not kept: {what}", receiver_path.display()));
    }
    if giver.attributes.is_empty() {
        console.warn(&format!(
            "{}: there is nothing to carry in this file; if the other mesh has the attributes, exchange --to source and \
             --to target",
            giver_path.display()
        ));
    }
    let mut moved = transfer_attributes(&giver.mesh, &giver.attributes, &receiver.mesh, donors)?;
    if let Some(skin) = &mut moved.skin
        && let Some(fitted) = fit_skeleton(skin, &giver.mesh, &receiver.mesh, donors)?
    {
        let skeleton = "the skeleton was fitted to";
        console.warn(&format!("{skeleton} {}: {fitted}", receiver_path.display()));
    }
    let (merged, replaced) = moved.beside(&receiver.attributes);
    if !replaced.is_empty() {
        let (own, others) = (receiver_path.display(), giver_path.display());
        console.warn(&format!("{own}: replaced by what {others} has: {}", some_of(&replaced)));
    }
    Ok(merged)
}

/// What the receiving file carries that no output will.
fn lost_by_receiver(receiver: &MeshFile) -> Vec<String> {
    let info = &receiver.info;
    let mut lost = info.left_out.clone();
    if info.n_polygons > 0 {
        lost.push(format!("{} polygons of more than three corners, written as triangles", info.n_polygons));
    }
    if !info.groups.is_empty() {
        lost.push(format!("{} groups ({})", info.groups.len(), some_of(&info.groups)));
    }
    lost
}

/// Refuses outputs, with the images and materials beside them, that would replace an input or each other.
fn check_inputs(
    args: &TransferArgs,
    source: &MeshFile,
    target: &MeshFile,
    attributes: &Attributes,
) -> Result<()> {
    let mut inputs = Inputs::default();
    inputs.add_mesh(&args.source, source);
    inputs.add_mesh(&args.target, target);
    inputs.add(&args.map, "the map");
    args.values.iter().for_each(|path| inputs.add(path, "an input"));
    let written: Vec<PathBuf> = args.outputs.iter().flat_map(|path| attributes.files_written(path)).collect();
    inputs.check(&written)?;
    check_places(&written)
}

/// For each output the file of values that it is made from; `None` for a mesh. Refuses what could not be written,
/// before any work.
fn values_of_outputs(args: &TransferArgs) -> Result<Vec<Option<&PathBuf>>> {
    let mut values = args.values.iter();
    let of_output = |output: &PathBuf| {
        let extension = values::extension(output);
        match extension.as_str() {
            "ply" | "obj" | "glb" | "off" => Ok(None),
            "npy" | "txt" => {
                let input = values.next().with_context(|| {
                    format!(
                        "{}: no --values file is left for this output; give one --values for each",
                        output.display()
                    )
                })?;
                let of_input = if values::is_landmarks(input) { "txt" } else { "npy" };
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
