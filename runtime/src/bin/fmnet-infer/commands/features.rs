//! `fmnet-infer features`: what other programs need to go on from: eigenbasis, areas, the inputs of the model and its
//! descriptors, all at unit area.

use super::matching::read;
use super::output::{Inputs, create_folder, file_name};
use crate::args::FeaturesArgs;
use crate::console::{Console, shown};
use anyhow::Result;
use fmnet::Matrix;
use fmnet::io::{IoError, MeshFile, write_matrix, write_vector};
use fmnet::network::contract::Quantity;
use fmnet::pipeline::{Matcher, Resize};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Files beside the quantities that a run may write.
const FILES: [&str; 2] = ["descriptors.npy", "vertices.npy"];

pub(crate) fn run(args: &FeaturesArgs, console: &Console) -> Result<()> {
    let mut options = args.shape.to_options();
    // A row for each vertex of the file, unless more are asked for.
    if options.subdivide == Resize::Default {
        options.subdivide = Resize::Never;
    }
    let matcher = Matcher::new(&options)?;
    let observer = |event| console.event(event);
    let file = read(&args.mesh, console)?;
    check_outputs(args, &file)?;
    create_folder(&args.out)?;
    let described = matcher.describe(&file_name(&args.mesh), &file.mesh, &observer)?;
    let (shape, context) = (&described.shape, matcher.context(&observer));
    let described_k = matcher.descriptor().eigenpairs().min(shape.max_eigenpairs());
    let basis = shape.unit_basis(matcher.k().max(described_k), context)?;
    let inputs = match matcher.network_descriptor() {
        Some(network) => network.inputs(shape, context)?,
        None => Vec::new(),
    };
    let vertices: Vec<i32> = (0..shape.n() as u32).map(|v| shape.way_back.input_of_work(v) as i32).collect();
    let n_input = shape.n_input();
    let unchanged = shape.n() == n_input && vertices.iter().enumerate().all(|(i, &v)| i == v as usize);
    // Files of an earlier run must not be taken for those of this mesh, nor the files of an interrupted run for a
    // whole set.
    files(&args.out).iter().try_for_each(|path| remove(path))?;
    let path = |quantity: Quantity| args.out.join(format!("{}.npy", quantity.name()));
    write_vector(&path(Quantity::Eigenvalues), &basis.eigenvalues)?;
    write_matrix(&path(Quantity::Eigenvectors), &basis.eigenvectors)?;
    write_vector(&path(Quantity::Mass), &basis.mass)?;
    for (input, values) in inputs {
        match input.quantity {
            // Written above, in double precision.
            Quantity::Eigenvalues | Quantity::Eigenvectors | Quantity::Mass => {}
            _ => write_matrix(&path(input.quantity), &Matrix::from_vec(shape.n(), input.width, values))?,
        }
    }
    match matcher.network() {
        Some(_) => write_matrix(&args.out.join(FILES[0]), &described.descriptors)?,
        None => write_matrix(&path(Quantity::Shot), &described.descriptors)?,
    }
    if !unchanged {
        write_vector(&args.out.join(FILES[1]), &vertices)?;
    }
    let text = format!("{} vertices, k = {}, written to {}", shape.n(), basis.k(), args.out.display());
    let summary = json!({ "mesh": shown(&args.mesh), "n_input": n_input, "n": shape.n(), "k": matcher.k(),
                          "eigenpairs": basis.k(), "area": shape.unit_area(), "out": shown(&args.out),
                          "rows_are_input_vertices": unchanged });
    Ok(console.result(&text, summary)?)
}

/// Every file that a run may write: a new set replaces the old one.
fn files(folder: &Path) -> Vec<PathBuf> {
    let quantities = Quantity::ALL.map(|quantity| format!("{}.npy", quantity.name()));
    quantities.iter().map(String::as_str).chain(FILES).map(|name| folder.join(name)).collect()
}

/// Refuses a folder whose files would replace what the command reads.
fn check_outputs(args: &FeaturesArgs, file: &MeshFile) -> Result<()> {
    let mut inputs = Inputs::of_model(&args.shape);
    inputs.add_mesh(&args.mesh, file);
    inputs.check(&files(&args.out))
}

fn remove(path: &Path) -> Result<(), IoError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(IoError::Write { path: path.into(), source })
        }
        _ => Ok(()),
    }
}
