//! What the fused CPU kernels of networks share: the scalar type, run-time dispatch to wide vectors, and matrix
//! products.

mod matmul;

pub use matmul::{MatrixView, matmul, matmul_split, par_matmul};

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A floating-point type of the kernels: `f32` to run and train, `f64` to check gradients.
pub trait Real:
    Copy
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Sum
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;

    /// The nearest value.
    fn from_double(value: f64) -> Self;

    /// The value in double precision.
    fn to_double(self) -> f64;

    /// `exp(x) - 1` for `x <= 0`, accurate near zero, free of branches so that loops over it vectorise. Keeps NaN.
    fn exp_m1_nonpositive(self) -> Self;

    /// Absolute value.
    fn abs(self) -> Self;

    /// Hyperbolic tangent, free of branches so that loops over it vectorise. Keeps NaN.
    #[inline(always)]
    fn tanh(self) -> Self {
        let magnitude = self.abs();
        let fall = (-(magnitude + magnitude)).exp_m1_nonpositive();
        let tanh = -fall / (fall + Self::ONE + Self::ONE);
        if self < Self::ZERO { -tanh } else { tanh }
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn from_double(value: f64) -> Self {
        value as f32
    }

    #[inline(always)]
    fn to_double(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn exp_m1_nonpositive(self) -> Self {
        // exp(x) = 2^n exp(r) with n = round(x / ln 2). Adding 1.5 * 2^23 rounds to an integer and leaves n in the low
        // bits. Below -30 the result is -1 in single precision.
        const ROUND: f32 = 12_582_912.0;
        const LN2_HIGH: f32 = 0.693_359_4;
        const LN2_LOW: f32 = -2.121_944_4e-4;
        let x = if self < -30.0 { -30.0 } else { self };
        let shifted = x * std::f32::consts::LOG2_E + ROUND;
        let n = shifted - ROUND;
        let r = (x - n * LN2_HIGH) - n * LN2_LOW;
        let scale = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
        let tail = 1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0));
        let series = r + r * r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * tail)));
        scale * series + (scale - 1.0)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn from_double(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn to_double(self) -> f64 {
        self
    }

    #[inline(always)]
    fn exp_m1_nonpositive(self) -> Self {
        self.exp_m1()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
}

/// Runs `kernel` compiled for the widest vectors this CPU has. The loops in it must be inlinable.
///
/// No fused multiply-adds are introduced, so the bits are the same on every CPU.
#[inline(always)]
pub fn vectorized<R>(kernel: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl")]
        fn avx512<R>(kernel: impl FnOnce() -> R) -> R {
            kernel()
        }

        #[target_feature(enable = "avx2")]
        fn avx2<R>(kernel: impl FnOnce() -> R) -> R {
            kernel()
        }

        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512vl")
        {
            // SAFETY: the features were detected on the line above.
            return unsafe { avx512(kernel) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the feature was detected on the line above.
            return unsafe { avx2(kernel) };
        }
    }
    kernel()
}

/// Splits the rows of a row-major `[n, width]` slice at the given lengths.
///
/// # Panics
/// If they do not add up to `n`.
pub fn split_rows<T>(
    mut data: &mut [T],
    width: usize,
    lengths: impl Iterator<Item = usize>,
) -> Vec<&mut [T]> {
    let parts = lengths
        .map(|rows| {
            let (head, tail) = std::mem::take(&mut data).split_at_mut(rows * width);
            data = tail;
            head
        })
        .collect();
    assert!(data.is_empty(), "the parts cover all rows");
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_exponential_is_accurate_to_two_ulp() {
        let worst = (0..200_000)
            .map(|i| {
                let x = -(1.3f32.powf((i as f32 - 150_000.0) / 2000.0));
                let exact = f64::from(x).exp_m1();
                (f64::from(x.exp_m1_nonpositive()) - exact).abs() / exact.abs()
            })
            .fold(0.0, f64::max);
        assert!(worst < 2.4e-7, "worst relative error {worst:e}");
        for x in [-40f32, -3.0, -0.7, -1e-4, 0.0, 1e-4, 0.7, 3.0, 40.0] {
            let exact = f64::from(x).tanh();
            assert!((f64::from(Real::tanh(x)) - exact).abs() <= 3e-7 * exact.abs(), "tanh of {x}");
        }
        assert!(Real::tanh(f32::NAN).is_nan());
        assert_eq!(0f32.exp_m1_nonpositive(), 0.0);
        assert_eq!(f32::NEG_INFINITY.exp_m1_nonpositive(), -1.0);
        assert!(f32::NAN.exp_m1_nonpositive().is_nan());
    }
}
