//! Writing a map in whatever form its file's extension asks for.

use anyhow::{Context, Result, bail};
use fmnet::Mesh;
use fmnet::io::{IoError, PointMapFormat, write_atomically, write_mesh, write_point_map};
use fmnet::point_map::PointMap;
use fmnet::render::{ViewerPair, pair_picture, side_by_side, viewer_html};
use std::path::Path;

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

/// Refuses outputs that could not be written, before any work is done.
pub(crate) fn check(outputs: &[std::path::PathBuf]) -> Result<()> {
    for path in outputs {
        kind(path)?;
        check_folder(path)?;
    }
    Ok(())
}

/// Refuses an output in a folder that does not exist.
pub(crate) fn check_folder(path: &Path) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        bail!("{}: the folder {} does not exist; create it first", path.display(), folder.display());
    }
    Ok(())
}

/// Creates a folder for outputs, and those it is in.
pub(crate) fn create_folder(path: &Path) -> Result<(), IoError> {
    std::fs::create_dir_all(path).map_err(|source| IoError::Write { path: path.into(), source })
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
            });
            write_atomically(path, |out| out.write_all(page.as_bytes()))?;
        }
    }
    Ok(())
}

/// A file's name without its folder, for titles and messages.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
