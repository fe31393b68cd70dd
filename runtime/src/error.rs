//! The error of the whole pipeline: the error of a stage, with the shape it happened on.

use crate::descriptor::ShotError;
use crate::fmap::FmapError;
use crate::io::IoError;
use crate::memory::MemoryError;
use crate::mesh::{DecimateError, MeshError, RepairError};
use crate::network::NetworkError;
use crate::pipeline::LandmarkError;
use crate::point_map::RecoverError;
use crate::refine::RefineError;
use crate::spectral::EigenError;
use crate::upscale::UpscaleError;
use thiserror::Error;

/// What can go wrong between two meshes and their map.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// Vertices and faces do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Nothing of the mesh is left after repair.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// The mesh cannot be decimated.
    #[error(transparent)]
    Decimate(#[from] DecimateError),
    /// The eigenbasis cannot be computed.
    #[error(transparent)]
    Eigen(#[from] EigenError),
    /// The SHOT options are out of range.
    #[error(transparent)]
    Shot(#[from] ShotError),
    /// The model cannot be loaded or run.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The functional map cannot be computed.
    #[error(transparent)]
    Fmap(#[from] FmapError),
    /// The point map cannot be recovered.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// The map cannot be refined.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The map cannot be upscaled.
    #[error(transparent)]
    Upscale(#[from] UpscaleError),
    /// Landmarks are not on the shapes.
    #[error(transparent)]
    Landmark(#[from] LandmarkError),
    /// A stage would take more memory than there is.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The area of the whole that a part belongs to is out of range.
    #[error(
        "whole_area is {area}, but must be a finite number above 0: the area of the whole shape in squared units of the mesh"
    )]
    WholeArea {
        /// The area given.
        area: f64,
    },
    /// The target of a pair was described as a part of a shape.
    #[error("a part can only be the source of a map, and its whole the target; exchange the two")]
    PartAsTarget,
    /// Spectral ICP of a part: its maps preserve areas, and those of a part to its whole do not.
    #[error("spectral ICP is for whole shapes only; refine the map of a part with --refine zoomout")]
    IcpOfPart,
    /// A shape was described by another matcher's model, back-end or settings of SHOT.
    #[error(
        "{shape} was described by another model or other settings of SHOT than those of this matcher; describe it again by this matcher"
    )]
    OtherDescriptor {
        /// The name of the shape.
        shape: String,
    },
    /// Any of these, on a known shape or pair.
    #[error("{shape}: {source}")]
    InShape {
        /// The name of the shape, or of both as `source -> target`.
        shape: String,
        /// What happened.
        source: Box<Error>,
    },
}

impl Error {
    /// The same error, naming the shape or pair it happened on; one that names a shape already stays as it is.
    pub fn in_shape(self, shape: &str) -> Self {
        match self {
            Self::InShape { .. } => self,
            other => Self::InShape { shape: shape.to_string(), source: Box::new(other) },
        }
    }

    /// Whether a stage would have taken more memory than there was.
    pub fn is_lack_of_memory(&self) -> bool {
        match self {
            Self::InShape { source, .. } => source.is_lack_of_memory(),
            Self::Memory(_) => true,
            _ => false,
        }
    }

    /// Whether the program or the machine failed (a file that cannot be written, too little memory, a solver that did
    /// not converge), rather than the input or the options being wrong.
    pub fn is_own_failure(&self) -> bool {
        match self {
            Self::InShape { source, .. } => source.is_own_failure(),
            Self::Io(IoError::Write { .. })
            | Self::Eigen(EigenError::NotConverged { .. })
            | Self::Memory(_) => true,
            _ => false,
        }
    }
}

/// An error with its causes, each once: the text of many holds that of their cause.
pub fn causes(error: &(dyn std::error::Error + 'static)) -> String {
    let mut text = error.to_string();
    let further = std::iter::successors(error.source(), |&cause| cause.source());
    for cause in further.map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn a_cause_is_said_once() {
        let source = std::io::Error::other("no such file");
        let error =
            Err::<(), _>(IoError::Read { path: "a.off".into(), source }).context("--target").unwrap_err();
        assert_eq!(causes(error.as_ref()), "--target: cannot read a.off: no such file");
    }
}
