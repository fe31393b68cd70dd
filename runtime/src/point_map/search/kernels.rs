//! The inner loops of the search, compiled for the instruction sets at hand.
//!
//! The `f64` sums run in one fixed order without fused operations, so that distances are the same on every
//! machine; the `f32` bounds may round differently, which changes the work but not the answer.

/// `f32` lanes of an AVX register.
pub(super) const LANES: usize = 8;
/// Directions of a leaf's local basis: one lane is left for the centre.
pub(super) const LOCAL: usize = LANES - 1;
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
    ($(#[$doc:meta])* $name:ident, ($($arg:ident: $ty:ty),*) $(-> $ret:ty)?) => {
        $(#[$doc])*
        #[inline]
        pub(super) fn $name(self, $($arg: $ty),*) $(-> $ret)? {
            match self {
                #[cfg(target_arch = "x86_64")]
                Kernels::Avx2 => {
                    #[target_feature(enable = "avx2,fma")]
                    fn avx2($($arg: $ty),*) $(-> $ret)? {
                        $name::<true>($($arg),*)
                    }
                    // SAFETY: the variant exists only where detection found AVX2 and FMA.
                    unsafe { avx2($($arg),*) }
                }
                Kernels::Portable => $name::<false>($($arg),*),
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
        dot, (a: &[f64], b: &[f64]) -> f64
    );
    dispatched!(
        /// `y += factor x`.
        add_scaled, (y: &mut [f64], factor: f64, x: &[f64])
    );
    dispatched!(
        /// Squared distance of two rows.
        squared_distance, (a: &[f64], b: &[f64]) -> f64
    );
    dispatched!(
        /// Squared distance of two rows in single precision.
        squared_distance_single, (a: &[f32], b: &[f32]) -> f32
    );
    dispatched!(
        /// Inner products of a vector `[d]` with rows `[rows, d]`.
        inner_products, (rows: &[f32], vector: &[f32], products: &mut [f32])
    );
    dispatched!(
        /// The lowest `squares[j] - products[j]`, and the lowest `j` that has it; infinity and 0 where none is below
        /// infinity.
        lowest_difference, (squares: &[f32], products: &[f32]) -> (f32, u32)
    );
    dispatched!(
        /// Where `square - products[j]` is below `values[j]`, takes its place, and `index` that of `indices[j]`.
        lower_differences,
        (values: &mut [f32], indices: &mut [u32], of_row: (f32, u32), products: &[f32])
    );
    dispatched!(
        /// Inner products of one query `[d]` with the columns of a frame `[d, LANES]`.
        project_one, (frame: &[f32], query: &[f32]) -> [f32; LANES]
    );
    dispatched!(
        /// Inner products of `GROUP` queries, `[d]` each, with the columns of a frame `[d, LANES]`.
        project, (frame: &[f32], queries: [&[f32]; GROUP]) -> [[f32; LANES]; GROUP]
    );
    dispatched!(
        /// Lower bounds of the squared distances to a leaf's points, from their coordinates `[LOCAL, stride]`
        /// and remainders `[stride]`, for a query with coordinates `b` and remainder `w`; returns the lowest.
        /// The stride is a multiple of `LANES`.
        point_bounds,
        (coordinates: &[f32], remainders: &[f32], b: &[f32; LOCAL], w: f32, bounds: &mut [f32]) -> f32
    );
}

/// Sums `term(a, b)` in sixteen interleaved partial sums, which the compiler keeps in vector registers.
#[inline(always)]
fn sum16(a: &[f64], b: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let (a_blocks, a_rest) = a.as_chunks::<16>();
    let (b_blocks, b_rest) = b.as_chunks::<16>();
    let mut sums = [0.0; 16];
    for (x, y) in a_blocks.iter().zip(b_blocks) {
        for lane in 0..16 {
            sums[lane] += term(x[lane], y[lane]);
        }
    }
    for (lane, (&x, &y)) in a_rest.iter().zip(b_rest).enumerate() {
        sums[lane] += term(x, y);
    }
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
    }
    sums[0]
}

#[inline(always)]
fn dot<const FUSED: bool>(a: &[f64], b: &[f64]) -> f64 {
    sum16(a, b, |x, y| x * y)
}

#[inline(always)]
fn add_scaled<const FUSED: bool>(y: &mut [f64], factor: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += factor * x);
}

#[inline(always)]
fn squared_distance<const FUSED: bool>(a: &[f64], b: &[f64]) -> f64 {
    sum16(a, b, |x, y| (x - y) * (x - y))
}

/// `x y + z`, fused where the variant has the instruction.
#[inline(always)]
fn multiply_add<const FUSED: bool>(x: f32, y: f32, z: f32) -> f32 {
    if FUSED { x.mul_add(y, z) } else { x * y + z }
}

#[inline(always)]
fn add_product<const FUSED: bool>(sum: &mut [f32; LANES], row: &[f32; LANES], entry: f32) {
    for lane in 0..LANES {
        sum[lane] = multiply_add::<FUSED>(row[lane], entry, sum[lane]);
    }
}

/// Adds up `term(a, b, sum)` in thirty-two interleaved partial sums.
#[inline(always)]
fn sum32(a: &[f32], b: &[f32], term: impl Fn(f32, f32, f32) -> f32) -> f32 {
    let (a_blocks, a_rest) = a.as_chunks::<32>();
    let (b_blocks, b_rest) = b.as_chunks::<32>();
    let mut sums = [0.0; 32];
    for (x, y) in a_blocks.iter().zip(b_blocks) {
        for lane in 0..32 {
            sums[lane] = term(x[lane], y[lane], sums[lane]);
        }
    }
    for (lane, (&x, &y)) in a_rest.iter().zip(b_rest).enumerate() {
        sums[lane] = term(x, y, sums[lane]);
    }
    for half in [16, 8, 4, 2, 1] {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
    }
    sums[0]
}

#[inline(always)]
fn squared_distance_single<const FUSED: bool>(a: &[f32], b: &[f32]) -> f32 {
    sum32(a, b, |x, y, sum| multiply_add::<FUSED>(x - y, x - y, sum))
}

#[inline(always)]
fn inner_products<const FUSED: bool>(rows: &[f32], vector: &[f32], products: &mut [f32]) {
    for (row, product) in rows.chunks_exact(vector.len().max(1)).zip(products) {
        *product = sum32(row, vector, multiply_add::<FUSED>);
    }
}

#[inline(always)]
fn lowest_difference<const FUSED: bool>(squares: &[f32], products: &[f32]) -> (f32, u32) {
    const WIDE: usize = 2 * LANES;
    let (mut values, mut chunks) = ([f32::INFINITY; WIDE], [0u32; WIDE]);
    let ((squares, squares_rest), (products, products_rest)) =
        (squares.as_chunks::<WIDE>(), products.as_chunks::<WIDE>());
    for (chunk, (squares, products)) in squares.iter().zip(products).enumerate() {
        for lane in 0..WIDE {
            let value = squares[lane] - products[lane];
            let better = value < values[lane];
            values[lane] = if better { value } else { values[lane] };
            chunks[lane] = if better { chunk as u32 } else { chunks[lane] };
        }
    }
    let mut lowest = (f32::INFINITY, 0);
    for lane in 0..WIDE {
        let found = (values[lane], chunks[lane] * WIDE as u32 + lane as u32);
        if values[lane] < f32::INFINITY && found < lowest {
            lowest = found;
        }
    }
    for (i, (square, product)) in squares_rest.iter().zip(products_rest).enumerate() {
        if square - product < lowest.0 {
            lowest = (square - product, (squares.len() * WIDE + i) as u32);
        }
    }
    lowest
}

#[inline(always)]
fn lower_differences<const FUSED: bool>(
    values: &mut [f32],
    indices: &mut [u32],
    (square, index): (f32, u32),
    products: &[f32],
) {
    for ((value, best), product) in values.iter_mut().zip(indices).zip(products) {
        let found = square - product;
        let better = found < *value;
        *value = if better { found } else { *value };
        *best = if better { index } else { *best };
    }
}

#[inline(always)]
fn project_one<const FUSED: bool>(frame: &[f32], query: &[f32]) -> [f32; LANES] {
    // Four sums, so that one fused operation need not wait for the one before it.
    let mut sums = [[0.0; LANES]; 4];
    let (rows, _) = frame.as_chunks::<LANES>();
    let (row_blocks, row_rest) = rows.as_chunks::<4>();
    let (query_blocks, query_rest) = query.as_chunks::<4>();
    for (rows, entries) in row_blocks.iter().zip(query_blocks) {
        for i in 0..4 {
            add_product::<FUSED>(&mut sums[i], &rows[i], entries[i]);
        }
    }
    for (row, &entry) in row_rest.iter().zip(query_rest) {
        add_product::<FUSED>(&mut sums[0], row, entry);
    }
    std::array::from_fn(|lane| (sums[0][lane] + sums[1][lane]) + (sums[2][lane] + sums[3][lane]))
}

#[inline(always)]
fn project<const FUSED: bool>(frame: &[f32], queries: [&[f32]; GROUP]) -> [[f32; LANES]; GROUP] {
    let (rows, _) = frame.as_chunks::<LANES>();
    let [q0, q1, q2, q3] = queries.map(|q| &q[..rows.len()]);
    let (mut even, mut odd) = ([[0.0; LANES]; GROUP], [[0.0; LANES]; GROUP]);
    for t in 0..rows.len() / 2 {
        for (sums, t) in [(&mut even, 2 * t), (&mut odd, 2 * t + 1)] {
            add_product::<FUSED>(&mut sums[0], &rows[t], q0[t]);
            add_product::<FUSED>(&mut sums[1], &rows[t], q1[t]);
            add_product::<FUSED>(&mut sums[2], &rows[t], q2[t]);
            add_product::<FUSED>(&mut sums[3], &rows[t], q3[t]);
        }
    }
    if rows.len() % 2 == 1 {
        let t = rows.len() - 1;
        for (sum, q) in even.iter_mut().zip([q0, q1, q2, q3]) {
            add_product::<FUSED>(sum, &rows[t], q[t]);
        }
    }
    std::array::from_fn(|q| std::array::from_fn(|lane| even[q][lane] + odd[q][lane]))
}

#[inline(always)]
fn point_bounds<const FUSED: bool>(
    coordinates: &[f32],
    remainders: &[f32],
    b: &[f32; LOCAL],
    w: f32,
    bounds: &mut [f32],
) -> f32 {
    let stride = remainders.len();
    let rows: [&[f32]; LOCAL] = std::array::from_fn(|j| &coordinates[j * stride..(j + 1) * stride]);
    let mut lowest = [f32::INFINITY; LANES];
    for block in 0..stride / LANES {
        let at = block * LANES..(block + 1) * LANES;
        let mut sums = [0.0; LANES];
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
        for lane in 0..LANES {
            lowest[lane] = lowest[lane].min(sums[lane]);
        }
        bounds[at].copy_from_slice(&sums);
    }
    lowest.iter().copied().fold(f32::INFINITY, f32::min)
}
