//! A folder in which the programs are run as a user runs them.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::Mesh;
use fmnet::io::{Attributes, read_point_map, write_mesh};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// `fmnet-infer`, as built with the tests.
pub fn infer() -> Command {
    program("fmnet-infer")
}

/// `fmnet-train`, as built with the tests.
pub fn train() -> Command {
    program("fmnet-train")
}

/// A program beside the test's own folder.
fn program(name: &str) -> Command {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().unwrap().parent().unwrap();
    let binary = folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(binary.is_file(), "{} is not built; run the tests of the whole workspace", binary.display());
    Command::new(binary)
}

/// SHOT without a network, with a radius that suits the small generated shapes: what costs least.
pub const SHOT: [&str; 6] = ["--descriptor", "shot", "-k", "40", "--shot-radius", "0.2"];

/// A temporary folder, in memory where there is such a disk: tests replace many small files, and each waits for a
/// device.
pub fn scratch() -> tempfile::TempDir {
    let in_memory = Path::new("/dev/shm");
    tempfile::tempdir_in(in_memory).unwrap_or_else(|_| tempfile::tempdir().unwrap())
}

/// A temporary folder with meshes and outputs, the working folder of the programs run in it.
pub struct Workplace {
    folder: tempfile::TempDir,
}

impl Default for Workplace {
    fn default() -> Self {
        Self::new()
    }
}

impl Workplace {
    /// An empty folder.
    pub fn new() -> Self {
        Self { folder: scratch() }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A file of this name in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a mesh.
    pub fn mesh(&self, name: &str, mesh: &Mesh) -> PathBuf {
        let path = self.path(name);
        write_mesh(&path, mesh, &Attributes::default()).unwrap();
        path
    }

    /// Runs `fmnet-infer`.
    pub fn run(&self, arguments: &[&str]) -> Output {
        infer().current_dir(self.folder.path()).args(arguments).output().unwrap()
    }

    /// Runs `fmnet-infer`, which must succeed; its standard output.
    pub fn succeed(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs `fmnet-infer`, which must exit with `code`; its standard error.
    pub fn fail(&self, arguments: &[&str], code: i32) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        stderr
    }

    /// Every file below the folder whose name ends like a temporary one.
    pub fn temporary_files(&self) -> Vec<PathBuf> {
        files_below(self.folder.path())
            .into_iter()
            .filter(|p| p.extension().is_some_and(|e| e == "tmp"))
            .collect()
    }
}

/// Every file below a folder.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files
}

/// The targets of a map file.
pub fn targets(path: &Path) -> Vec<u32> {
    read_point_map(path, None).unwrap().targets
}
