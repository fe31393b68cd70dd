//! Descriptors behind one trait: what each needs of a shape, and the matrix that it gives.

use crate::Matrix;
use crate::cache::{CacheKey, Decoder, Encoder};
use crate::descriptor::ShotOptions;
use crate::error::Error;
use crate::events::timed;
use crate::memory::{self, Remedy};
use crate::network::DescriptorNetwork;
use crate::network::contract::{ModelInput, Quantity};
use crate::shape::{Context, Shape};

/// Pointwise descriptors of a shape.
pub trait Descriptor: std::fmt::Debug + Send + Sync {
    /// The kind, by which results of different kinds are told apart.
    fn kind(&self) -> &'static str;

    /// Eigenpairs that it needs of a shape, 0 where none.
    fn eigenpairs(&self) -> usize;

    /// Its settings as bytes, which tell it from every other of its kind.
    fn settings(&self) -> Vec<u8>;

    /// A value for each vertex of [`Shape::mesh`], `[n, d]`. Quantities are taken from the shape, which computes
    /// those that are asked for.
    ///
    /// # Errors
    /// If a quantity that it needs cannot be computed, or the descriptor itself fails; it names the shape.
    fn describe(&self, shape: &Shape, context: Context) -> Result<Matrix<f32>, Error>;
}

/// SHOT itself: the paper's baseline.
impl Descriptor for ShotOptions {
    fn kind(&self) -> &'static str {
        "shot"
    }

    fn eigenpairs(&self) -> usize {
        0
    }

    fn settings(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    fn describe(&self, shape: &Shape, context: Context) -> Result<Matrix<f32>, Error> {
        Ok(shape.shot(self, context)?.as_ref().clone())
    }
}

/// Descriptors by a network of a model file.
#[derive(Debug)]
pub struct NetworkDescriptor {
    /// The network.
    pub network: DescriptorNetwork,
    /// SHOT, if it takes it.
    pub shot: ShotOptions,
}

/// Raise where the inputs of networks change.
const INPUTS_VERSION: u32 = 1;

impl Descriptor for NetworkDescriptor {
    fn kind(&self) -> &'static str {
        "network"
    }

    fn eigenpairs(&self) -> usize {
        self.network.contract().eigenpairs()
    }

    fn settings(&self) -> Vec<u8> {
        let backend = self.network.backend().to_string();
        let shot = serde_json::to_vec(&self.shot).unwrap_or_default();
        [self.network.fingerprint().as_slice(), backend.as_bytes(), &shot].concat()
    }

    fn describe(&self, shape: &Shape, context: Context) -> Result<Matrix<f32>, Error> {
        let key: CacheKey = shape.quantity_key("descriptors", INPUTS_VERSION, &self.settings());
        let found = context.cache.and_then(|cache| cache.fetch("descriptors", key, context.observer));
        if let Some(descriptors) = found
            .and_then(|bytes| Decoder::new(&bytes).matrix())
            .filter(|m: &Matrix<f32>| (m.rows(), m.cols()) == (shape.n(), self.network.contract().outputs))
        {
            return Ok(descriptors);
        }
        let width = self.network.contract().inputs.iter().map(|input| input.width).sum();
        let needed = memory::network_bytes(shape.n(), width);
        let remedy = Remedy::Decimate { vertices: shape.n() };
        let _reserved = memory::reserve("the network", needed, remedy)
            .map_err(|e| Error::from(e).in_shape(&shape.name))?;
        let inputs = self.inputs(shape, context)?;
        let arrays: Vec<&[f32]> = inputs.iter().map(|(_, values)| values.as_slice()).collect();
        let run = || self.network.descriptors(shape.n(), &arrays);
        let descriptors = timed(context.observer, &shape.name, "network", run)
            .map_err(|e| Error::from(e).in_shape(&shape.name))?;
        let mut out = Encoder::default();
        out.matrix(&descriptors);
        shape.keep("descriptors", key, &out.finish(), context)?;
        Ok(descriptors)
    }
}

impl NetworkDescriptor {
    /// The network's inputs in its order, each row-major in single precision, at unit area. Eigenpairs that a small
    /// mesh does not have are zero, which adds nothing to any sum over eigenpairs.
    ///
    /// # Errors
    /// If a quantity cannot be computed; it names the shape.
    pub fn inputs(&self, shape: &Shape, context: Context) -> Result<Vec<(ModelInput, Vec<f32>)>, Error> {
        let inputs = &self.network.contract().inputs;
        inputs.iter().map(|&input| Ok((input, self.input(input, shape, context)?))).collect()
    }

    fn input(&self, input: ModelInput, shape: &Shape, context: Context) -> Result<Vec<f32>, Error> {
        let width = input.width;
        let k = width.min(shape.max_eigenpairs());
        let columns = |matrix: &Matrix| -> Vec<f32> {
            let row =
                |i: usize| matrix.row(i).iter().map(|&x| x as f32).chain(std::iter::repeat_n(0.0, width - k));
            (0..matrix.rows()).flat_map(row).collect()
        };
        Ok(match input.quantity {
            Quantity::Shot => shape.shot(&self.shot, context)?.data().to_vec(),
            Quantity::Mass => shape.unit_basis(1, context)?.mass.iter().map(|&x| x as f32).collect(),
            Quantity::Eigenvalues => {
                let values = shape.unit_basis(k, context)?.eigenvalues;
                values.into_iter().map(|x| x as f32).chain(std::iter::repeat_n(0.0, width - k)).collect()
            }
            Quantity::Eigenvectors => columns(&shape.unit_basis(k, context)?.eigenvectors),
            Quantity::GradientsX => columns(&shape.gradients(k, context)?.x),
            Quantity::GradientsY => columns(&shape.gradients(k, context)?.y),
        })
    }
}
