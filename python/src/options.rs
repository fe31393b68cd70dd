//! Keyword arguments, which are the program's options, as options of the library.

use crate::errors::wrong;
use fmnet::fmap::{FmapSolver, SolverKind};
use fmnet::pipeline::{MatchOptions, ModelSource, Resize};
use pyo3::prelude::*;
use serde::Deserialize;
use serde::de::value::{Error as NameError, StrDeserializer};
use std::path::PathBuf;

/// The options of `Matcher`, as given.
pub(crate) struct Given<'a, 'py> {
    pub(crate) model: Option<PathBuf>,
    pub(crate) descriptor: &'a str,
    pub(crate) k: Option<usize>,
    pub(crate) fm: Option<&'a str>,
    pub(crate) mask_weight: Option<f64>,
    pub(crate) refine: Option<&'a str>,
    pub(crate) upscale: &'a str,
    pub(crate) effort: &'a str,
    pub(crate) adapt: Option<usize>,
    pub(crate) backend: &'a str,
    pub(crate) decimate: Option<Bound<'py, PyAny>>,
    pub(crate) subdivide: Option<Bound<'py, PyAny>>,
    pub(crate) shot_radius: Option<f64>,
    pub(crate) cache: Option<PathBuf>,
}

impl Given<'_, '_> {
    pub(crate) fn options(self) -> PyResult<MatchOptions> {
        let in_range = |k: &usize| (1..=500).contains(k);
        if let Some(k) = self.k.filter(|k| !in_range(k)) {
            return Err(wrong(format!("k is {k}, expected 1 to 500")));
        }
        if let Some(radius) = self.shot_radius.filter(|&r| !(r > 0.0 && r < 1.0)) {
            return Err(wrong(format!("shot_radius is {radius}, expected a number between 0 and 1")));
        }
        if let Some(steps) = self.adapt.filter(|&steps| steps > 100) {
            return Err(wrong(format!("adapt is {steps}, expected 0 to 100")));
        }
        let fm: Option<SolverKind> = self.fm.map(|name| named("fm", name)).transpose()?;
        let mut options = MatchOptions::default();
        options.descriptor = named("descriptor", self.descriptor)?;
        options.model = self.model.map_or(ModelSource::Embedded, ModelSource::File);
        options.k = self.k;
        options.solver = FmapSolver::chosen(fm, weight(self.mask_weight)?);
        options.refinement = self.refine.map(|name| named("refine", name)).transpose()?;
        options.upscaling = named("upscale", self.upscale)?;
        options.effort = named("effort", self.effort)?;
        options.adapt = self.adapt;
        options.backend = named("backend", self.backend)?;
        options.decimate = resize("decimate", self.decimate.as_ref())?;
        options.subdivide = resize("subdivide", self.subdivide.as_ref())?;
        options.shot_radius = self.shot_radius;
        options.cache = self.cache;
        Ok(options)
    }
}

/// A choice by its name; the error lists the choices.
pub(crate) fn named<'a, T: Deserialize<'a>>(option: &str, name: &'a str) -> PyResult<T> {
    let name: StrDeserializer<'a, NameError> = StrDeserializer::new(name);
    T::deserialize(name).map_err(|e| wrong(format!("{option}: {e}")))
}

pub(crate) fn weight(mask_weight: Option<f64>) -> PyResult<Option<f64>> {
    match mask_weight {
        Some(weight) if !(weight.is_finite() && weight >= 0.0) => {
            Err(wrong(format!("mask_weight is {weight}, expected 0 or more")))
        }
        fine => Ok(fine),
    }
}

/// A number of vertices, or never.
fn resize(option: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Resize> {
    let Some(value) = value else { return Ok(Resize::Default) };
    let is_off = value.extract::<String>().is_ok_and(|text| text == "off");
    match value.extract::<usize>() {
        _ if is_off => Ok(Resize::Never),
        Ok(n) if n >= 100 => Ok(Resize::To(n)),
        _ => {
            Err(wrong(format!("{option} is {value}, expected a number of vertices, 100 or more, or \"off\"")))
        }
    }
}
