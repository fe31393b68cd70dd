//! Nothing goes wrong in silence: what a command cannot carry, keep or measure it says, and no output replaces an
//! input.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

mod attributes;
mod meshes;
mod outputs;
mod paths;
mod trainer;

use fmnet::Mesh;
use fmnet::mesh::shapes::bumpy_sphere;
use fmnet_tests::Workplace;

/// A folder with a mesh `a.off`, a stretched one `b.off` of the same vertices, and the identity `id.txt`.
fn workplace() -> (Workplace, Mesh) {
    let work = Workplace::new();
    let mesh = bumpy_sphere(3, 1);
    work.mesh("a.off", &mesh);
    work.mesh("b.off", &bumpy_sphere(3, 2));
    let identity: String = (0..mesh.n_vertices()).map(|i| format!("{i}\n")).collect();
    std::fs::write(work.path("id.txt"), identity).unwrap();
    (work, mesh)
}

/// Runs `fmnet-infer`, which must succeed; its standard output and standard error.
fn run(work: &Workplace, arguments: &[&str]) -> (String, String) {
    let output = work.run(arguments);
    let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(output.status.success(), "{arguments:?}: {err}");
    (out, err)
}
