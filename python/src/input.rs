//! Meshes as people have them: a file, arrays, an object with `.vertices` and `.faces`, or a shape that was described
//! before.

use crate::arrays::{integers, reals};
use crate::errors::{Failure, wrong};
use crate::shape::Shape;
use fmnet::Mesh;
use fmnet::events::{Event, Observer};
use fmnet::io::read_mesh;
use fmnet::pipeline::DescribedShape;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use std::path::PathBuf;
use std::sync::Arc;

pub(crate) enum Input {
    File(PathBuf),
    Mesh(Mesh),
    Shape(Arc<DescribedShape>),
}

/// A mesh with its name in messages, or a shape.
pub(crate) enum Loaded {
    Mesh(String, Mesh),
    Shape(Arc<DescribedShape>),
}

impl Input {
    /// What an argument holds; `what` is its name.
    pub(crate) fn new(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        match object.cast::<Shape>() {
            Ok(shape) => Ok(Self::Shape(shape.get().inner.clone())),
            Err(_) => Self::mesh(object, what),
        }
    }

    /// The same where a described shape will not do.
    pub(crate) fn mesh(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        let py = object.py();
        if let Ok(path) = object.extract::<PathBuf>() {
            return Ok(Self::File(path));
        }
        if object.is_instance_of::<PyTuple>() || object.is_instance_of::<PyList>() {
            if object.len()? != 2 {
                return Err(wrong(format!(
                    "{what}: {} parts, expected two: (vertices, faces)",
                    object.len()?
                )));
            }
            return Ok(Self::Mesh(mesh_of(&object.get_item(0)?, &object.get_item(1)?, what)?));
        }
        let attribute = |name| object.getattr_opt(name);
        let (vertices, faces) = (attribute(intern!(py, "vertices"))?, attribute(intern!(py, "faces"))?);
        if object.is_instance_of::<Shape>() {
            return Err(wrong(format!("{what}: a described shape, expected the mesh itself")));
        }
        match (vertices, faces) {
            (Some(vertices), Some(faces)) => Ok(Self::Mesh(mesh_of(&vertices, &faces, what)?)),
            _ => Err(wrong(format!(
                "{what}: {} is no mesh; pass a path, (vertices, faces), or an object with .vertices and .faces",
                object.get_type().name()?
            ))),
        }
    }

    /// Reads the file, if it is one; its warnings go to the observer. `what` is the name of arrays.
    pub(crate) fn load(self, what: &str, observer: Observer) -> Result<Loaded, Failure> {
        Ok(match self {
            Self::Shape(shape) => Loaded::Shape(shape),
            Self::Mesh(mesh) => Loaded::Mesh(what.to_owned(), mesh),
            Self::File(path) => {
                let file = read_mesh(&path)?;
                for warning in &file.info.warnings {
                    observer(Event::Warning(format!("{}: {warning}", path.display())));
                }
                let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
                Loaded::Mesh(name, file.mesh)
            }
        })
    }

    /// The mesh alone.
    pub(crate) fn load_mesh(self, what: &str, observer: Observer) -> Result<Mesh, Failure> {
        match self.load(what, observer)? {
            Loaded::Mesh(_, mesh) => Ok(mesh),
            Loaded::Shape(_) => {
                Err(Failure::Said(format!("{what}: a described shape, expected the mesh itself")))
            }
        }
    }
}

fn mesh_of(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>, what: &str) -> PyResult<Mesh> {
    let (vertices, _) = reals(vertices, &[None, Some(3)], &format!("{what}, vertices"))?;
    let (faces, _) = integers(faces, &[None, Some(3)], &format!("{what}, faces"))?;
    let n = vertices.len() / 3;
    let index = |(at, &v): (usize, &i64)| {
        u32::try_from(v).map_err(|_| {
            let face = at / 3;
            wrong(format!(
                "{what}: face {face} refers to vertex {v}, but there are only {n} vertices (0-based); correct it or remove the face"
            ))
        })
    };
    let faces = faces.iter().enumerate().map(index).collect::<PyResult<Vec<u32>>>()?;
    let vertices: Vec<[f64; 3]> = bytemuck::allocation::cast_vec(vertices);
    let faces: Vec<[u32; 3]> = faces.as_chunks().0.to_vec();
    Mesh::new(vertices, faces).map_err(|e| wrong(format!("{what}: {e}")))
}
