//! What several tests need: the Python and JavaScript environments, the real data, small models, a place to run the
//! programs in.

#[path = "../../runtime/tests/support/skipped.rs"]
mod skip;
mod workplace;

use fmnet::network::contract::{FORMAT_VERSION, ModelMetadata};
use fmnet::{Matrix, descriptor, fmap};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

pub use skip::skipped;
pub use workplace::{SHOT, Workplace, files_below, infer, scratch, targets, train};

/// The workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The research data, where it is at hand: `FMNET_DATA`, or `shared/data` beside the workspace.
pub fn research_data() -> Option<PathBuf> {
    let folder = std::env::var_os("FMNET_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    skipped(format!("no research data at {}; set FMNET_DATA to its folder", folder.display()));
    None
}

/// A Python interpreter with the pinned packages of `python/requirements.txt`, prepared once; `None`, with a message,
/// where there is no Python or no package registry.
pub fn python() -> Option<PathBuf> {
    static PYTHON: OnceLock<Option<PathBuf>> = OnceLock::new();
    PYTHON.get_or_init(|| prepared("python", &prepare_python)).clone()
}

/// A folder in which Node.js finds the packages of `javascript/package.json`, prepared once; `None`, with a message,
/// where there is no Node.js or no package registry.
pub fn javascript() -> Option<PathBuf> {
    static FOLDER: OnceLock<Option<PathBuf>> = OnceLock::new();
    FOLDER.get_or_init(|| prepared("javascript", &prepare_javascript)).clone()
}

/// The onnxruntime library that came with the Python environment.
pub fn onnxruntime_library() -> Option<PathBuf> {
    let script = "import onnxruntime, pathlib; print(pathlib.Path(onnxruntime.__file__).parent / 'capi')";
    let output = Command::new(python()?).args(["-c", script]).output().ok()?;
    let folder = PathBuf::from(String::from_utf8(output.stdout).ok()?.trim());
    let is_library = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.starts_with("libonnxruntime.") || name == "onnxruntime.dll"
    };
    std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path())).find(is_library)
}

fn prepared(name: &str, prepare: &dyn Fn(&Path) -> Result<PathBuf, String>) -> Option<PathBuf> {
    let folder = environments().join(name);
    match prepare(&folder) {
        Ok(path) => Some(path),
        Err(reason) => {
            skipped(format!("what needs {name}: {reason}"));
            None
        }
    }
}

/// Beside the build: `target/environments`, wherever the target folder is.
fn environments() -> PathBuf {
    let test = std::env::current_exe().unwrap_or_default();
    let target = test.ancestors().find(|folder| folder.join("CACHEDIR.TAG").is_file());
    target.map_or_else(std::env::temp_dir, Path::to_path_buf).join("environments")
}

fn prepare_python(folder: &Path) -> Result<PathBuf, String> {
    let requirements = root().join("tests/python/requirements.txt");
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    once(folder, &requirements, || {
        let system =
            ["python3", "python"].into_iter().find(|p| run(Command::new(p).arg("--version")).is_ok());
        run(Command::new(system.ok_or("no python3 on the PATH")?).args(["-m", "venv"]).arg(folder))?;
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"];
        run(Command::new(&python).args(install).arg(&requirements))
    })?;
    Ok(python)
}

fn prepare_javascript(folder: &Path) -> Result<PathBuf, String> {
    let manifest = root().join("tests/javascript/package.json");
    once(folder, &manifest, || {
        run(Command::new("node").arg("--version"))?;
        std::fs::create_dir_all(folder).map_err(|e| e.to_string())?;
        std::fs::copy(&manifest, folder.join("package.json")).map_err(|e| e.to_string())?;
        let install = ["install", "--ignore-scripts", "--no-audit", "--no-fund", "--prefix"];
        run(Command::new("npm").args(install).arg(folder))
    })?;
    Ok(folder.to_path_buf())
}

/// Runs `prepare` unless a file in the folder says that it succeeded with the same requirements.
fn once(
    folder: &Path,
    requirements: &Path,
    prepare: impl FnOnce() -> Result<(), String>,
) -> Result<(), String> {
    let wanted = std::fs::read_to_string(requirements).map_err(|e| e.to_string())?;
    let marker = folder.join("prepared");
    if std::fs::read_to_string(&marker).is_ok_and(|found| found == wanted) {
        return Ok(());
    }
    prepare()?;
    std::fs::write(marker, wanted).map_err(|e| e.to_string())
}

/// Runs a command; the error holds what it said.
pub fn run(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|e| format!("{:?}: {e}", command.get_program()))?;
    if output.status.success() {
        return Ok(());
    }
    Err(format!("{:?} failed: {}", command.get_program(), String::from_utf8_lossy(&output.stderr).trim()))
}

/// Metadata of a model made for a test.
pub fn test_metadata(per_shape_statistics: bool) -> ModelMetadata {
    ModelMetadata {
        format_version: FORMAT_VERSION,
        shot: descriptor::ShotOptions::default(),
        k: 60,
        solver: fmap::FmapSolver::Regularized { weight: 0.1 },
        decimate: Some(15_000),
        per_shape_statistics,
        calibration: None,
        training_set: "none".into(),
        seed: 1,
        steps: 0,
        commit: "test".into(),
        license: "MIT OR Apache-2.0".into(),
    }
}

/// Largest difference of two matrices, relative to the largest entry of the first.
pub fn relative_difference(a: &Matrix<f32>, b: &Matrix<f32>) -> f32 {
    assert_eq!((a.rows(), a.cols()), (b.rows(), b.cols()));
    let largest = a.data().iter().fold(0.0f32, |m, x| m.max(x.abs()));
    a.data().iter().zip(b.data()).fold(0.0f32, |m, (x, y)| m.max((x - y).abs())) / largest
}
