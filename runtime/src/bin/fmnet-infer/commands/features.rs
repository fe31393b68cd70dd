//! `fmnet-infer features`: what other programs need to go on from: eigenbasis, areas and descriptors.

use super::matching::read;
use super::output::{create_folder, file_name};
use crate::args::FeaturesArgs;
use crate::console::Console;
use anyhow::Result;
use fmnet::Matrix;
use fmnet::io::{write_matrix, write_vector};
use fmnet::network::contract::Quantity;
use fmnet::pipeline::Matcher;
use serde_json::json;

pub(crate) fn run(args: &FeaturesArgs, console: &Console) -> Result<()> {
    let matcher = Matcher::new(&args.shape.to_options())?;
    let observer = |event| console.event(event);
    let mesh = read(&args.mesh, console)?;
    let described = matcher.describe(&file_name(&args.mesh), &mesh, &observer)?;
    let (shape, context) = (&described.shape, matcher.context(&observer));
    let k = matcher.k().max(matcher.descriptor().eigenpairs());
    let basis = shape.unit_basis(k, context)?;
    create_folder(&args.out)?;
    write_vector(&args.out.join("eigenvalues.npy"), &basis.eigenvalues)?;
    write_matrix(&args.out.join("eigenvectors.npy"), &basis.eigenvectors)?;
    write_vector(&args.out.join("mass.npy"), &basis.mass)?;
    let inputs = match matcher.network_descriptor() {
        Some(network) => network.inputs(shape, context)?,
        None => Vec::new(),
    };
    for (input, values) in inputs {
        let path = args.out.join(format!("{}.npy", input.quantity.name()));
        match input.quantity {
            // Written above, in double precision.
            Quantity::Eigenvalues | Quantity::Eigenvectors | Quantity::Mass => {}
            _ => write_matrix(&path, &Matrix::from_vec(shape.n(), input.width, values))?,
        }
    }
    let descriptors = if matcher.network().is_some() { "descriptors.npy" } else { "shot.npy" };
    write_matrix(&args.out.join(descriptors), &described.descriptors)?;
    let vertices: Vec<i32> = (0..shape.n() as u32).map(|v| shape.way_back.input_of_work(v) as i32).collect();
    let n_input = shape.n_input();
    let unchanged = shape.n() == n_input && vertices.iter().enumerate().all(|(i, &v)| i == v as usize);
    if !unchanged {
        write_vector(&args.out.join("vertices.npy"), &vertices)?;
    }
    let text = format!("{} vertices, k = {}, written to {}", shape.n(), basis.k(), args.out.display());
    let summary = json!({ "mesh": args.mesh, "n_input": n_input, "n": shape.n(), "k": matcher.k(), "eigenpairs": basis.k(), "area": shape.unit_area(), "out": args.out,
                          "rows_are_input_vertices": unchanged });
    console.result(&text, summary);
    Ok(())
}
