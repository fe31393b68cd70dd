//! Writing a map in whatever form its file's extension asks for.

use crate::args::ShapeArgs;
use anyhow::{Context, Result, bail};
use fmnet::Mesh;
use fmnet::io::{IoError, MeshFile, PointMapFormat, write_atomically, write_mesh, write_point_map};
use fmnet::point_map::PointMap;
use fmnet::render::{ViewerPair, pair_picture, side_by_side, viewer_html};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A map with its two meshes and what people should read beside it.
pub(crate) struct MapOutput<'a> {
    pub(crate) source: &'a Mesh,
    pub(crate) target: &'a Mesh,
    pub(crate) name_source: &'a str,
    pub(crate) name_target: &'a str,
    pub(crate) map: &'a PointMap,
    pub(crate) caption: &'a str,
}

/// What an output file will hold.
enum Kind {
    Map,
    ColoredPair,
    Picture,
    Viewer,
}

/// Columns of a picture of a pair.
const PICTURE_WIDTH: usize = 1200;

fn kind(path: &Path) -> Result<Kind> {
    if PointMapFormat::from_path(path).is_some() {
        return Ok(Kind::Map);
    }
    match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("ply" | "glb" | "off" | "obj") => Ok(Kind::ColoredPair),
        Some("png") => Ok(Kind::Picture),
        Some("html") => Ok(Kind::Viewer),
        _ => bail!(
            "{}: unknown kind of output; use {} for a map, .ply or .glb for the coloured pair, .png for its picture, .html for the viewer",
            path.display(),
            PointMapFormat::EXTENSIONS
        ),
    }
}

/// Refuses outputs of a map that could not be written, before any work is done.
pub(crate) fn check(outputs: &[PathBuf]) -> Result<()> {
    for path in outputs {
        kind(path)?;
    }
    check_places(outputs)
}

/// Refuses outputs that could not be written: in a folder that does not exist or takes no files, the same file twice,
/// a folder.
pub(crate) fn check_places(outputs: &[PathBuf]) -> Result<()> {
    for (i, path) in outputs.iter().enumerate() {
        let folder = folder_of(path);
        if !folder.is_dir() {
            bail!("{}: the folder {} does not exist; create it first", path.display(), folder.display());
        }
        if path.is_dir() {
            bail!("{} is a folder; name a file in it", path.display());
        }
        if is_device(path) {
            continue;
        }
        // A folder may take no files, whoever asks.
        tempfile::tempfile_in(folder).map_err(|source| IoError::Write { path: path.clone(), source })?;
        if let Some(other) = outputs[..i].iter().find(|other| place(other) == place(path)) {
            bail!(
                "{} and {} are the same file; give each output a name of its own",
                other.display(),
                path.display()
            );
        }
    }
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether there is something that is neither a file nor a folder, such as `/dev/null`.
fn is_device(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// The same for every way to write the path of one file, which may be absent.
fn place(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| {
        let folder = std::fs::canonicalize(folder_of(path)).unwrap_or_else(|_| folder_of(path).into());
        path.file_name().map_or(folder.clone(), |name| folder.join(name))
    })
}

/// The files that a command reads, which no output may replace.
#[derive(Default)]
pub(crate) struct Inputs {
    /// What the file at each place is.
    files: BTreeMap<PathBuf, String>,
}

impl Inputs {
    /// The model file, if one is named.
    pub(crate) fn of_model(args: &ShapeArgs) -> Self {
        let mut inputs = Self::default();
        if let Some(path) = args.model_file() {
            inputs.add(&path, "the model");
        }
        inputs
    }

    /// Adds a file; `what` is a noun.
    pub(crate) fn add(&mut self, path: &Path, what: &str) {
        self.files.entry(place(path)).or_insert_with(|| what.to_owned());
    }

    /// Adds a mesh with its materials, images and buffers.
    pub(crate) fn add_mesh(&mut self, path: &Path, file: &MeshFile) {
        self.add(path, "an input");
        for part in &file.info.files {
            self.add(part, &format!("a part of the input {}", path.display()));
        }
    }

    /// Refuses outputs that would replace an input.
    pub(crate) fn check(&self, outputs: &[PathBuf]) -> Result<()> {
        for output in outputs.iter().filter(|output| !is_device(output)) {
            if let Some(what) = self.files.get(&place(output)) {
                bail!(
                    "{} is {what} and would be overwritten; give the output another name",
                    output.display()
                );
            }
        }
        Ok(())
    }
}

/// Creates a folder for outputs, and those it is in.
pub(crate) fn create_folder(path: &Path) -> Result<()> {
    if path.exists() && !path.is_dir() {
        bail!("{} is a file; name a folder", path.display());
    }
    let created = std::fs::create_dir_all(path).and_then(|()| tempfile::tempfile_in(path).map(|_| ()));
    Ok(created.map_err(|source| IoError::Write { path: path.into(), source })?)
}

/// Writes one output.
pub(crate) fn write(path: &Path, output: &MapOutput) -> Result<()> {
    match kind(path)? {
        Kind::Map => write_point_map(path, output.map)?,
        Kind::ColoredPair => {
            let (mesh, attributes) = side_by_side(output.source, output.target, output.map)
                .with_context(|| path.display().to_string())?;
            write_mesh(path, &mesh, &attributes)?;
        }
        Kind::Picture => {
            let picture = pair_picture(output.source, output.target, output.map, PICTURE_WIDTH)
                .with_context(|| path.display().to_string())?;
            write_atomically(path, |out| out.write_all(&picture.to_png()))?;
        }
        Kind::Viewer => {
            let page = viewer_html(&ViewerPair {
                title: &format!("{} → {}", output.name_source, output.name_target),
                name_source: output.name_source,
                name_target: output.name_target,
                source: output.source,
                target: output.target,
                map: output.map,
                caption: output.caption,
            })
            .with_context(|| path.display().to_string())?;
            write_atomically(path, |out| out.write_all(page.as_bytes()))?;
        }
    }
    Ok(())
}

/// A file's name without its folder, for titles and messages.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The first names of a list.
pub(crate) fn some_of(names: &[String]) -> String {
    const SHOWN: usize = 8;
    let more = if names.len() > SHOWN { ", ..." } else { "" };
    format!("{}{more}", names[..names.len().min(SHOWN)].join(", "))
}
