//! Adam (Kingma and Ba 2015) on one flat variable, with a state that can be saved and restored exactly.

use crate::device::contiguous;
use crate::numeric::vectorized;
use candle_core::{CpuStorage, DType, InplaceOp2, InplaceOp3, Layout, Result, Tensor, Var, bail};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Elements of a task.
const CHUNK: usize = 1 << 15;

/// Parameters of Adam but for the learning rate, which is given at each step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AdamOptions {
    /// Decay of the mean of the gradients; 0 to below 1, default 0.9.
    pub beta1: f64,
    /// Decay of the mean of the squared gradients; 0 to below 1, default 0.999.
    pub beta2: f64,
    /// Added to the root of the squared gradients; above 0, default 1e-8.
    pub epsilon: f64,
}

impl Default for AdamOptions {
    fn default() -> Self {
        Self { beta1: 0.9, beta2: 0.999, epsilon: 1e-8 }
    }
}

/// Everything that Adam remembers, to be saved.
#[derive(Clone, Debug, PartialEq)]
pub struct AdamState {
    /// Steps taken.
    pub step: u64,
    /// Mean of the gradients, `[p]`.
    pub first: Vec<f32>,
    /// Mean of the squared gradients, `[p]`.
    pub second: Vec<f32>,
}

/// The optimiser of one flat variable `[p]`.
pub struct Adam {
    options: AdamOptions,
    step: u64,
    first: Tensor,
    second: Tensor,
}

impl Adam {
    /// A fresh optimiser for `variable`.
    pub fn new(variable: &Var, options: AdamOptions) -> Result<Self> {
        // Two separate tensors: they are updated in place.
        let (first, second) = (variable.zeros_like()?, variable.zeros_like()?);
        Ok(Self { options, step: 0, first, second })
    }

    /// A copy of what it remembers.
    pub fn state(&self) -> Result<AdamState> {
        Ok(AdamState { step: self.step, first: self.first.to_vec1()?, second: self.second.to_vec1()? })
    }

    /// Continues from a saved state.
    ///
    /// # Errors
    /// If the state is of another number of parameters.
    pub fn restore(&mut self, state: AdamState) -> Result<()> {
        let len = self.first.dims1()?;
        if state.first.len() != len || state.second.len() != len {
            bail!("an optimiser state of {} parameters for {len}", state.first.len());
        }
        let device = self.first.device();
        (self.first, self.second) =
            (Tensor::from_vec(state.first, len, device)?, Tensor::from_vec(state.second, len, device)?);
        self.step = state.step;
        Ok(())
    }

    /// Moves `variable`, `[p]`, against `gradient`, `[p]` (Kingma and Ba 2015, algorithm 1).
    pub fn update(&mut self, variable: &Var, gradient: &Tensor, learning_rate: f64) -> Result<()> {
        self.step += 1;
        let AdamOptions { beta1, beta2, epsilon } = self.options;
        let correction = |beta: f64| 1.0 - beta.powf(self.step as f64);
        let (correction1, correction2) = (correction(beta1), correction(beta2));
        if variable.device().is_cpu() && variable.dtype() == DType::F32 {
            let gradient = gradient.contiguous()?;
            self.first.inplace_op2(&gradient, &Decay { beta: beta1 as f32, square: false })?;
            self.second.inplace_op2(&gradient, &Decay { beta: beta2 as f32, square: true })?;
            let apply = Apply {
                rate: (learning_rate / correction1) as f32,
                scale: (1.0 / correction2) as f32,
                epsilon: epsilon as f32,
            };
            return variable.inplace_op3(&self.first, &self.second, &apply);
        }
        self.first = ((&self.first * beta1)? + (gradient * (1.0 - beta1))?)?;
        self.second = ((&self.second * beta2)? + (gradient.sqr()? * (1.0 - beta2))?)?;
        let root = ((&self.second / correction2)?.sqrt()? + epsilon)?;
        let moved =
            (variable.as_detached_tensor() - ((&self.first * (learning_rate / correction1))? / root)?)?;
        variable.set(&moved)
    }
}

/// `moment = beta moment + (1 - beta) gradient` (or its square).
struct Decay {
    beta: f32,
    square: bool,
}

/// `variable -= rate first / (sqrt(scale second) + epsilon)`.
struct Apply {
    rate: f32,
    scale: f32,
    epsilon: f32,
}

fn contiguous_mut<'a>(storage: &'a mut CpuStorage, layout: &Layout) -> Result<&'a mut [f32]> {
    match (storage, layout.contiguous_offsets()) {
        (CpuStorage::F32(data), Some((start, end))) => Ok(&mut data[start..end]),
        _ => bail!("Adam's moments and variable are contiguous and of type f32"),
    }
}

impl InplaceOp2 for Decay {
    fn name(&self) -> &'static str {
        "adam-decay"
    }

    fn cpu_fwd(
        &self,
        moment: &mut CpuStorage,
        moment_layout: &Layout,
        gradient: &CpuStorage,
        gradient_layout: &Layout,
    ) -> Result<()> {
        let moment = contiguous_mut(moment, moment_layout)?;
        let gradient: &[f32] = contiguous(gradient, gradient_layout)?;
        let (beta, rest) = (self.beta, 1.0 - self.beta);
        moment.par_chunks_mut(CHUNK).zip(gradient.par_chunks(CHUNK)).for_each(|(moment, gradient)| {
            vectorized(|| {
                for (moment, &gradient) in moment.iter_mut().zip(gradient) {
                    let sample = if self.square { gradient * gradient } else { gradient };
                    *moment = beta * *moment + rest * sample;
                }
            });
        });
        Ok(())
    }
}

impl InplaceOp3 for Apply {
    fn name(&self) -> &'static str {
        "adam-apply"
    }

    fn cpu_fwd(
        &self,
        variable: &mut CpuStorage,
        variable_layout: &Layout,
        first: &CpuStorage,
        first_layout: &Layout,
        second: &CpuStorage,
        second_layout: &Layout,
    ) -> Result<()> {
        let variable = contiguous_mut(variable, variable_layout)?;
        let first: &[f32] = contiguous(first, first_layout)?;
        let second: &[f32] = contiguous(second, second_layout)?;
        let moments = first.par_chunks(CHUNK).zip(second.par_chunks(CHUNK));
        variable.par_chunks_mut(CHUNK).zip(moments).for_each(|(variable, (first, second))| {
            vectorized(|| {
                for ((value, &first), &second) in variable.iter_mut().zip(first).zip(second) {
                    *value -= self.rate * first / ((self.scale * second).sqrt() + self.epsilon);
                }
            });
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;

    fn gradient(step: u64) -> [f32; 3] {
        [0.5, -2.0 * step as f32, 1e-3 * (step as f32 - 2.0)]
    }

    fn run(adam: &mut Adam, variable: &Var, steps: std::ops::Range<u64>) {
        for step in steps {
            let gradient = Tensor::new(&gradient(step), &Device::Cpu).unwrap();
            adam.update(variable, &gradient, 1e-3).unwrap();
        }
    }

    #[test]
    fn five_steps_equal_the_algorithm_by_hand() {
        let variable = Var::new(&[1f32, -1.0, 0.25], &Device::Cpu).unwrap();
        let mut adam = Adam::new(&variable, AdamOptions::default()).unwrap();
        run(&mut adam, &variable, 0..5);
        let values: Vec<f32> = variable.to_vec1().unwrap();
        for (c, start) in [1f64, -1.0, 0.25].into_iter().enumerate() {
            let (mut value, mut m, mut v) = (start, 0.0, 0.0);
            for step in 0..5u64 {
                let g = f64::from(gradient(step)[c]);
                m = 0.9 * m + 0.1 * g;
                v = 0.999 * v + 0.001 * g * g;
                let t = (step + 1) as i32;
                let (m_hat, v_hat) = (m / (1.0 - 0.9f64.powi(t)), v / (1.0 - 0.999f64.powi(t)));
                value -= 1e-3 * m_hat / (v_hat.sqrt() + 1e-8);
            }
            assert!((f64::from(values[c]) - value).abs() < 1e-6, "parameter {c}: {} vs {value}", values[c]);
        }
    }

    #[test]
    fn restored_state_continues_to_the_same_bits() {
        let fresh = || Var::new(&[1f32, -1.0, 0.25], &Device::Cpu).unwrap();
        let through = fresh();
        run(&mut Adam::new(&through, AdamOptions::default()).unwrap(), &through, 0..6);

        let stopped = fresh();
        let mut first = Adam::new(&stopped, AdamOptions::default()).unwrap();
        run(&mut first, &stopped, 0..3);
        let mut second = Adam::new(&stopped, AdamOptions::default()).unwrap();
        second.restore(first.state().unwrap()).unwrap();
        run(&mut second, &stopped, 3..6);
        assert_eq!(stopped.to_vec1::<f32>().unwrap(), through.to_vec1::<f32>().unwrap());
    }
}
