//! The Python package `fmnet`: the library for NumPy. Nothing is computed here; inputs are checked and passed on.

mod arrays;
mod batch;
mod carry;
mod errors;
mod evaluate;
mod features;
mod input;
mod matcher;
mod options;
mod result;
mod run;
mod shape;
mod stages;

use pyo3::prelude::*;

/// Removes half-written files of work that goes on in the background when the interpreter ends.
#[pyfunction]
fn remove_temporary_files() {
    fmnet::io::remove_temporary_files();
}

#[pymodule]
fn _fmnet(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("Error", py.get_type::<errors::Error>())?;
    module.add("FmnetWarning", py.get_type::<errors::FmnetWarning>())?;
    module.add_class::<matcher::Matcher>()?;
    module.add_class::<shape::Shape>()?;
    module.add_class::<result::Match>()?;
    module.add_class::<evaluate::Evaluation>()?;
    for function in [
        wrap_pyfunction!(matcher::match_, module)?,
        wrap_pyfunction!(features::features, module)?,
        wrap_pyfunction!(stages::eigenbasis, module)?,
        wrap_pyfunction!(stages::shot, module)?,
        wrap_pyfunction!(stages::functional_map, module)?,
        wrap_pyfunction!(stages::point_map, module)?,
        wrap_pyfunction!(stages::zoomout, module)?,
        wrap_pyfunction!(evaluate::geodesic_distances, module)?,
        wrap_pyfunction!(evaluate::evaluate, module)?,
        wrap_pyfunction!(carry::transfer, module)?,
        wrap_pyfunction!(carry::transfer_landmarks, module)?,
        wrap_pyfunction!(carry::transfer_uvs, module)?,
        wrap_pyfunction!(batch::read_pairs, module)?,
        wrap_pyfunction!(batch::mesh_hash, module)?,
    ] {
        module.add_function(function)?;
    }
    let clean_up = wrap_pyfunction!(remove_temporary_files, module)?;
    py.import("atexit")?.call_method1("register", (clean_up,))?;
    Ok(())
}
