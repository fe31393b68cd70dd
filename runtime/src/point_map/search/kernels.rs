//! The inner loops of the search, compiled for the instruction sets at hand.
//!
//! The `f64` sums run in one fixed order without fused operations, so that distances are the same on every
//! machine; the `f32` bounds may round differently, which changes the work but not the answer.

/// Directions of a leaf's local basis: one AVX register of `f32`.
pub(super) const LOCAL: usize = 8;
/// Queries projected together.
pub(super) const GROUP: usize = 4;

/// Which compiled variant of the loops to call.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kernels {
    /// AVX2 with fused multiply-add. Made only by [`Kernels::detect`], where the processor has both.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Whatever the build targets.
    Portable,
}

/// Defines a method of [`Kernels`] that calls the named generic loop in the variant chosen.
macro_rules! dispatched {
    ($(#[$doc:meta])* $name:ident, $generic:ident, ($($arg:ident: $ty:ty),*) $(-> $ret:ty)?) => {
        $(#[$doc])*
        #[inline]
        pub(super) fn $name(self, $($arg: $ty),*) $(-> $ret)? {
            match self {
                #[cfg(target_arch = "x86_64")]
                Kernels::Avx2 => {
                    #[target_feature(enable = "avx2,fma")]
                    fn avx2($($arg: $ty),*) $(-> $ret)? {
                        $generic::<true>($($arg),*)
                    }
                    // SAFETY: the variant exists only where detection found AVX2 and FMA.
                    unsafe { avx2($($arg),*) }
                }
                Kernels::Portable => $generic::<false>($($arg),*),
            }
        }
    };
}

impl Kernels {
    /// The best variant this processor runs.
    pub(super) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return Kernels::Avx2;
        }
        Kernels::Portable
    }

    dispatched!(
        /// Inner product of two rows.
        dot, dot, (a: &[f64], b: &[f64]) -> f64
    );
    dispatched!(
        /// Squared distance of two rows.
        squared_distance, squared_distance, (a: &[f64], b: &[f64]) -> f64
    );
    dispatched!(
        /// Coordinates of `GROUP` queries, `[d]` each, in a basis stored as `[d, LOCAL]`.
        project, project, (basis: &[f32], queries: [&[f32]; GROUP]) -> [[f32; LOCAL]; GROUP]
    );
    dispatched!(
        /// Lower bounds of the squared distances to a leaf's points, from their coordinates `[LOCAL, stride]`
        /// and remainders `[stride]`, for a query with coordinates `b` and remainder `w`. The stride is a multiple of 8.
        point_bounds, point_bounds, (coordinates: &[f32], remainders: &[f32], b: &[f32; LOCAL], w: f32, bounds: &mut [f32])
    );
}

/// Sums `term(i)` for `i < n` in eight interleaved partial sums, which the compiler keeps in vector registers.
#[inline(always)]
fn sum8(a: &[f64], b: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let (a_blocks, a_rest) = a.as_chunks::<8>();
    let (b_blocks, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (x, y) in a_blocks.iter().zip(b_blocks) {
        for lane in 0..8 {
            sums[lane] += term(x[lane], y[lane]);
        }
    }
    for (lane, (&x, &y)) in a_rest.iter().zip(b_rest).enumerate() {
        sums[lane] += term(x, y);
    }
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))
}

#[inline(always)]
fn dot<const FUSED: bool>(a: &[f64], b: &[f64]) -> f64 {
    sum8(a, b, |x, y| x * y)
}

#[inline(always)]
fn squared_distance<const FUSED: bool>(a: &[f64], b: &[f64]) -> f64 {
    sum8(a, b, |x, y| (x - y) * (x - y))
}

/// `x y + z`, fused where the variant has the instruction.
#[inline(always)]
fn multiply_add<const FUSED: bool>(x: f32, y: f32, z: f32) -> f32 {
    if FUSED { x.mul_add(y, z) } else { x * y + z }
}

#[inline(always)]
fn project<const FUSED: bool>(basis: &[f32], queries: [&[f32]; GROUP]) -> [[f32; LOCAL]; GROUP] {
    let (rows, _) = basis.as_chunks::<LOCAL>();
    let [q0, q1, q2, q3] = queries.map(|q| &q[..rows.len()]);
    let mut sums = [[0.0; LOCAL]; GROUP];
    for (t, row) in rows.iter().enumerate() {
        let entries = [q0[t], q1[t], q2[t], q3[t]];
        for (sum, entry) in sums.iter_mut().zip(entries) {
            for lane in 0..LOCAL {
                sum[lane] = multiply_add::<FUSED>(row[lane], entry, sum[lane]);
            }
        }
    }
    sums
}

#[inline(always)]
fn point_bounds<const FUSED: bool>(
    coordinates: &[f32],
    remainders: &[f32],
    b: &[f32; LOCAL],
    w: f32,
    bounds: &mut [f32],
) {
    let stride = remainders.len();
    let rows: [&[f32]; LOCAL] = std::array::from_fn(|j| &coordinates[j * stride..(j + 1) * stride]);
    let blocks = stride / 8;
    for block in 0..blocks {
        let at = block * 8..block * 8 + 8;
        let mut sums = [0.0; 8];
        for (lane, e) in remainders[at.clone()].iter().enumerate() {
            let gap = (w - e).max(0.0);
            sums[lane] = gap * gap;
        }
        for (row, &coordinate) in rows.iter().zip(b) {
            for (lane, a) in row[at.clone()].iter().enumerate() {
                let difference = coordinate - a;
                sums[lane] = multiply_add::<FUSED>(difference, difference, sums[lane]);
            }
        }
        bounds[at].copy_from_slice(&sums);
    }
}
