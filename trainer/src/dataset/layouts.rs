//! Recognition of the field's dataset folders by their file names.
//!
//! FAUST: 10 subjects of 10 poses, `tr_reg_SPP`; the paper trains on subjects 0-7 and tests on 8-9. Settings are
//! chosen on subjects 6-7, so the splits are 000-059 train, 060-079 validation, 080-099 test. SCAPE: 71 poses, the
//! last 20 test, as the successors of the paper do. TOSCA: one group for each class, every fifth shape validation.

use super::{Correspondence, DatasetError, ShapeEntry, Split, shrec16};
use fmnet::io::MeshFormat;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Vertices of a FAUST registration: in remeshed shapes of more vertices these come first.
const FAUST_VERTICES: usize = 6890;

type Found = (&'static str, Vec<ShapeEntry>);

/// The layout of a folder and its shapes, if it has a known one.
pub(super) fn recognise(folder: &Path) -> Result<Option<Found>, DatasetError> {
    if folder.join("scans").is_dir() && folder.join("registrations").is_dir() {
        return Ok(Some(("FAUST scans", faust_scans(folder)?)));
    }
    if folder.join("null").is_dir() {
        return Ok(Some(("SHREC'16 partial", shrec16::shapes(folder)?)));
    }
    let meshes = mesh_files(folder)?;
    let all = |test: fn(&str) -> bool| !meshes.is_empty() && meshes.iter().all(|m| test(&stem(m)));
    if all(|name| numbered(name, "tr_reg_").is_some()) {
        return Ok(Some(faust_registered(folder, meshes)));
    }
    if all(|name| numbered(name, "mesh").is_some()) {
        return Ok(Some(("SCAPE", meshes.into_iter().map(scape_shape).collect())));
    }
    if all(|name| class_and_number(name).is_some()) {
        return Ok(Some(("TOSCA", meshes.into_iter().map(tosca_shape).collect())));
    }
    Ok(None)
}

fn faust_registered(folder: &Path, meshes: Vec<PathBuf>) -> Found {
    let corres = folder.join("corres");
    let by_vts = corres.is_dir();
    let is_ply = |m: &PathBuf| m.extension().is_some_and(|e| e == "ply");
    let remeshed = meshes.iter().any(|m| !is_ply(m));
    let shapes = meshes.into_iter().map(|mesh| {
        let name = stem(&mesh);
        let correspondence = match (by_vts, remeshed) {
            (true, _) => Correspondence::Vts(corres.join(format!("{name}.vts"))),
            (false, true) => Correspondence::First(FAUST_VERTICES),
            (false, false) => Correspondence::Identity,
        };
        let split = faust_split(numbered(&name, "tr_reg_").unwrap_or(0));
        ShapeEntry { name, mesh, group: "faust".into(), correspondence, split, whole: None }
    });
    let layout = if remeshed { "FAUST remeshed" } else { "FAUST registrations" };
    (layout, shapes.collect())
}

fn faust_scans(folder: &Path) -> Result<Vec<ShapeEntry>, DatasetError> {
    let scans = mesh_files(&folder.join("scans"))?;
    let registrations = folder.join("registrations");
    let registration = |name: &str| {
        let name = name.replace("scan", "reg");
        ["ply", "off", "obj"].iter().map(|e| registrations.join(format!("{name}.{e}"))).find(|p| p.is_file())
    };
    // FAUST publishes no registrations of its test scans.
    let scans = scans.into_iter().filter(|mesh| !stem(mesh).starts_with("test_scan_"));
    let shape = |mesh: PathBuf| {
        let name = stem(&mesh);
        let split = faust_split(numbered(&name, "tr_scan_").unwrap_or(0));
        let Some(registration) = registration(&name) else {
            let reason = format!(
                "there is no registration {}.ply of it in {}; put it there or take the scan away",
                name.replace("scan", "reg"),
                registrations.display()
            );
            return Err(DatasetError::Mesh { path: mesh, reason });
        };
        let correspondence = Correspondence::NearestTo(registration);
        Ok(ShapeEntry { name, mesh, group: "faust".into(), correspondence, split, whole: None })
    };
    scans.map(shape).collect()
}

fn faust_split(index: usize) -> Split {
    let splits = [Split::Train, Split::Validation, Split::Test];
    splits.into_iter().find(|&split| faust_numbers(split).contains(&index)).unwrap_or(Split::Test)
}

/// The numbers that a split has in FAUST.
pub(crate) fn faust_numbers(split: Split) -> Range<usize> {
    match split {
        Split::Train => 0..60,
        Split::Validation => 60..80,
        Split::Test => 80..1000,
    }
}

fn scape_shape(mesh: PathBuf) -> ShapeEntry {
    let name = stem(&mesh);
    let split = if numbered(&name, "mesh").unwrap_or(0) < 51 { Split::Train } else { Split::Test };
    let correspondence = Correspondence::Identity;
    ShapeEntry { name, mesh, group: "scape".into(), correspondence, split, whole: None }
}

fn tosca_shape(mesh: PathBuf) -> ShapeEntry {
    let name = stem(&mesh);
    let (class, number) = class_and_number(&name).unwrap_or_default();
    let split = if number % 5 == 4 { Split::Validation } else { Split::Train };
    let correspondence = Correspondence::Identity;
    ShapeEntry { name, mesh, group: class, correspondence, split, whole: None }
}

/// The mesh files directly in a folder, sorted by name.
pub(crate) fn mesh_files(folder: &Path) -> Result<Vec<PathBuf>, DatasetError> {
    let wrong = |source| DatasetError::Folder { path: folder.to_path_buf(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        if MeshFormat::from_path(&path).is_some() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// A file's name without folder and extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn numbered(name: &str, prefix: &str) -> Option<usize> {
    name.strip_prefix(prefix)?.parse().ok()
}

fn class_and_number(name: &str) -> Option<(String, usize)> {
    let digits = name.trim_start_matches(|c: char| c.is_ascii_alphabetic());
    let class = &name[..name.len() - digits.len()];
    if class.is_empty() { None } else { Some((class.to_string(), digits.parse().ok()?)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        folder
    }

    #[test]
    fn each_layout_is_recognised_by_its_names() {
        for (files, layout, group) in [
            (&["tr_reg_000.ply", "tr_reg_085.ply"][..], "FAUST registrations", "faust"),
            (&["tr_reg_000.off", "corres/tr_reg_000.vts"], "FAUST remeshed", "faust"),
            (&["scans/tr_scan_000.ply", "registrations/tr_reg_000.ply"], "FAUST scans", "faust"),
            (&["mesh000.off"], "SCAPE", "scape"),
            (&["dog0.off", "dog7.off"], "TOSCA", "dog"),
            (&["null/dog.off", "holes/holes_dog_shape_1.off"], "SHREC'16 partial", "dog"),
        ] {
            let folder = folder_with(files);
            let (found, shapes) = recognise(folder.path()).unwrap().unwrap();
            assert_eq!(found, layout);
            assert!(!shapes.is_empty() && shapes.iter().all(|s| s.group == group), "{layout}: {shapes:?}");
        }
        assert!(recognise(folder_with(&["notes.txt"]).path()).unwrap().is_none());
    }

    #[test]
    fn a_scan_without_registration_is_named_unless_it_is_of_the_test_set() {
        let registered = ["scans/tr_scan_000.ply", "registrations/tr_reg_000.ply"];
        let folder = folder_with(&[&registered[..], &["scans/test_scan_000.ply"]].concat());
        assert_eq!(recognise(folder.path()).unwrap().unwrap().1.len(), 1);
        let folder = folder_with(&[&registered[..], &["scans/tr_scan_001.ply"]].concat());
        let error = recognise(folder.path()).unwrap_err().to_string();
        assert!(error.contains("tr_scan_001.ply: there is no registration tr_reg_001.ply"), "{error}");
    }

    #[test]
    fn the_papers_test_subjects_are_never_trained_on() {
        assert_eq!(
            [59, 60, 79, 80].map(faust_split),
            [Split::Train, Split::Validation, Split::Validation, Split::Test]
        );
    }
}
