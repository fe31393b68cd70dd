//! `fmnet-infer features`: what other programs need to go on from: eigenbasis, areas and descriptors.

use super::matching::read;
use super::output::{Inputs, create_folder, file_name};
use crate::args::FeaturesArgs;
use crate::console::{Console, shown};
use anyhow::Result;
use fmnet::io::{IoError, MeshFile, write_matrix, write_vector};
use fmnet::pipeline::Matcher;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Every file that a run may write: a new set replaces the old one.
const FILES: [&str; 6] =
    ["eigenvalues.npy", "eigenvectors.npy", "mass.npy", "shot.npy", "descriptors.npy", "vertices.npy"];

pub(crate) fn run(args: &FeaturesArgs, console: &Console) -> Result<()> {
    let matcher = Matcher::new(&args.shape.to_options())?;
    let file = read(&args.mesh, console)?;
    check_outputs(args, &file)?;
    create_folder(&args.out)?;
    let described = matcher.describe(&file_name(&args.mesh), &file.mesh, &|event| console.event(event))?;
    let shape = &described.shape;
    let basis = shape.basis.truncated(matcher.k());
    let vertices: Vec<i32> =
        (0..shape.n() as u32).map(|v| shape.input_of_full[shape.full_of_work(v) as usize] as i32).collect();
    let unchanged = shape.n() == shape.n_input && vertices.iter().enumerate().all(|(i, &v)| i == v as usize);
    // Files of an earlier run must not be taken for those of this mesh, nor the files of an interrupted run for a whole set.
    FILES.iter().try_for_each(|name| remove(&args.out.join(name)))?;
    write_vector(&args.out.join("eigenvalues.npy"), &basis.eigenvalues)?;
    write_matrix(&args.out.join("eigenvectors.npy"), &basis.eigenvectors)?;
    write_vector(&args.out.join("mass.npy"), &basis.mass)?;
    write_matrix(&args.out.join("shot.npy"), &shape.shot)?;
    if matcher.network().is_some() {
        write_matrix(&args.out.join("descriptors.npy"), &described.descriptors)?;
    }
    if !unchanged {
        write_vector(&args.out.join("vertices.npy"), &vertices)?;
    }
    let text = format!("{} vertices, k = {}, written to {}", shape.n(), basis.k(), args.out.display());
    let summary = json!({ "mesh": shown(&args.mesh), "n_input": shape.n_input, "n": shape.n(), "k": basis.k(), "out": shown(&args.out),
                          "rows_are_input_vertices": unchanged });
    Ok(console.result(&text, summary)?)
}

/// Refuses a folder whose files would replace what the command reads.
fn check_outputs(args: &FeaturesArgs, file: &MeshFile) -> Result<()> {
    let mut inputs = Inputs::of_model(&args.shape);
    inputs.add_mesh(&args.mesh, file);
    let outputs: Vec<PathBuf> = FILES.iter().map(|name| args.out.join(name)).collect();
    inputs.check(&outputs)
}

fn remove(path: &Path) -> Result<(), IoError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(IoError::Write { path: path.into(), source })
        }
        _ => Ok(()),
    }
}
