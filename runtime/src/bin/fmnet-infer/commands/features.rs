//! `fmnet-infer features`: what other programs need to go on from: eigenbasis, areas and descriptors.

use super::matching::read;
use super::output::{create_folder, file_name};
use crate::args::FeaturesArgs;
use crate::console::Console;
use anyhow::Result;
use fmnet::io::{write_matrix, write_vector};
use fmnet::pipeline::Matcher;
use serde_json::json;

pub(crate) fn run(args: &FeaturesArgs, console: &Console) -> Result<()> {
    let matcher = Matcher::new(&args.shape.to_options())?;
    let mesh = read(&args.mesh, console)?;
    let described = matcher.describe(&file_name(&args.mesh), &mesh, &|event| console.event(event))?;
    create_folder(&args.out)?;
    let shape = &described.shape;
    let basis = shape.basis.truncated(matcher.k());
    write_vector(&args.out.join("eigenvalues.npy"), &basis.eigenvalues)?;
    write_matrix(&args.out.join("eigenvectors.npy"), &basis.eigenvectors)?;
    write_vector(&args.out.join("mass.npy"), &basis.mass)?;
    write_matrix(&args.out.join("shot.npy"), &shape.shot)?;
    if matcher.network().is_some() {
        write_matrix(&args.out.join("descriptors.npy"), &described.descriptors)?;
    }
    let vertices: Vec<i32> =
        (0..shape.n() as u32).map(|v| shape.input_of_full[shape.full_of_work(v) as usize] as i32).collect();
    let unchanged = shape.n() == shape.n_input && vertices.iter().enumerate().all(|(i, &v)| i == v as usize);
    if !unchanged {
        write_vector(&args.out.join("vertices.npy"), &vertices)?;
    }
    let text = format!("{} vertices, k = {}, written to {}", shape.n(), basis.k(), args.out.display());
    let summary = json!({ "mesh": args.mesh, "n_input": shape.n_input, "n": shape.n(), "k": basis.k(), "out": args.out,
                          "rows_are_input_vertices": unchanged });
    console.result(&text, summary);
    Ok(())
}
