//! The histogram of a neighbourhood in its local frame (Tombari et al. 2010, section 4).
//!
//! A neighbour counts in the volume it lies in, at the bin of the cosine between its normal and the z axis. It is
//! shared with the adjacent bin in each of four directions: in cosine within its volume, in distance, elevation and
//! azimuth between volumes. In each direction its own bin gets `1 - t` and the adjacent one `t`, where `t` is how far
//! it is from the centre of its own bin, as a fraction of the way to the centre of the adjacent one. Where
//! there is none, beyond the poles, the centre and the surface of the sphere, that share is dropped.
//!
//! The authors' implementation departs from the paper in how it wraps around, and so does this: the adjacent
//! bin of the cosine wraps modulo the number of intervals, although there is a bin more than those, and the adjacent
//! sector of azimuth modulo 7, although there are 8.

use std::array;

use super::{
    IN_PLANE,
    neighborhood::{Grid, Neighborhood},
};

/// Volumes of the sphere. Number `4 sector + 2 shell + half`: the sectors of azimuth follow each other from -180
/// degrees on, shell 1 is the outer one, half 1 the one with positive z.
pub(super) const VOLUMES: usize = 32;

/// Modulus of the adjacent sector.
const SECTOR_WRAP: i32 = 7;

/// Neighbours whose squared distance is below this, in the unit in which the radius is 9, do not count.
const COINCIDENT: f32 = 1e-6;

/// Neighbours processed at a time.
const BLOCK: usize = 64;

/// A bin of its own and four adjacent ones.
const SHARES: usize = 5;

/// Fills descriptors.
pub(super) struct Histogram {
    bins: i32,
    radius: f32,
    neighbors: Block,
    bin: [[u32; BLOCK]; SHARES],
    weight: [[f32; BLOCK]; SHARES],
}

/// Neighbours in the local frame.
#[derive(Clone)]
struct Block {
    local: [[f32; BLOCK]; 3],
    distance2: [f32; BLOCK],
    /// Cosine between normal and z axis.
    cosine: [f32; BLOCK],
}

impl Histogram {
    /// For `bins` intervals of the cosine, and neighbourhoods of `radius`.
    pub(super) fn new(bins: usize, radius: f64) -> Self {
        let neighbors = Block { local: [[0.0; BLOCK]; 3], distance2: [0.0; BLOCK], cosine: [0.0; BLOCK] };
        Self {
            bins: bins as i32,
            radius: radius as f32,
            neighbors,
            bin: [[0; BLOCK]; SHARES],
            weight: [[0.0; BLOCK]; SHARES],
        }
    }

    /// Adds `neighbors` to `row`, which is all zero, and normalises it; `z_axis` is that of their local frame.
    /// Returns whether there was anything to normalise.
    #[inline(always)]
    pub(super) fn fill(
        &mut self,
        grid: &Grid,
        neighbors: &Neighborhood,
        z_axis: [f64; 3],
        row: &mut [f32],
    ) -> bool {
        let z_axis = z_axis.map(|c| c as f32);
        for start in (0..neighbors.len()).step_by(BLOCK) {
            let len = BLOCK.min(neighbors.len() - start);
            self.neighbors.load(grid, neighbors, z_axis, start, len);
            self.share();
            for l in 0..len {
                for share in 0..SHARES {
                    row[self.bin[share][l] as usize] += self.weight[share][l];
                }
            }
        }
        normalize(row)
    }

    /// Computes for each neighbour of the block the bins it counts in and how much.
    #[inline(always)]
    fn share(&mut self) {
        let Self { bins, radius, neighbors: Block { local: [x, y, z], distance2, cosine }, bin, weight } =
            self;
        let bins_per_volume = *bins + 1;
        for l in 0..BLOCK {
            let in_cosine = share_cosine(cosine[l], *bins);
            let in_distance = share_distance(distance2[l].sqrt(), *radius);
            let in_elevation = share_elevation((x[l] * x[l] + y[l] * y[l]).sqrt(), z[l]);
            let in_azimuth = share_azimuth(x[l], y[l]);

            let in_sector = 2 * in_distance.bin + in_elevation.bin;
            let volume = 4 * in_azimuth.bin + in_sector;
            let own = volume * bins_per_volume + in_cosine.bin;
            bin[0][l] = own as u32;
            bin[1][l] = (volume * bins_per_volume + in_cosine.adjacent_bin) as u32;
            bin[2][l] = (own + (in_distance.adjacent_bin - in_distance.bin) * 2 * bins_per_volume) as u32;
            bin[3][l] = (own + (in_elevation.adjacent_bin - in_elevation.bin) * bins_per_volume) as u32;
            bin[4][l] = (own + (in_azimuth.adjacent_bin - in_azimuth.bin) * 4 * bins_per_volume) as u32;

            let counts = if distance2[l] < COINCIDENT { 0.0 } else { 1.0 };
            weight[0][l] = counts * (in_cosine.own + in_distance.own + in_elevation.own + in_azimuth.own);
            weight[1][l] = counts * in_cosine.adjacent;
            weight[2][l] = counts * in_distance.adjacent;
            weight[3][l] = counts * in_elevation.adjacent;
            weight[4][l] = counts * in_azimuth.adjacent;
        }
    }
}

impl Block {
    /// Takes `len` of the `neighbors` from `start` on. The rest of the block keeps what it held.
    #[inline(always)]
    fn load(&mut self, grid: &Grid, neighbors: &Neighborhood, z_axis: [f32; 3], start: usize, len: usize) {
        for (block, all) in self.local.iter_mut().zip(&neighbors.local) {
            block[..len].copy_from_slice(&all[start..start + len]);
        }
        for (block, &all) in self.distance2.iter_mut().zip(&neighbors.distances2[start..start + len]) {
            *block = all as f32;
        }
        for (cosine, &point) in self.cosine.iter_mut().zip(&neighbors.points[start..start + len]) {
            let normal = grid.normal(point);
            *cosine = normal[0] * z_axis[0] + normal[1] * z_axis[1] + normal[2] * z_axis[2];
        }
    }
}

/// How a neighbour is shared in one direction.
struct Share {
    bin: i32,
    adjacent_bin: i32,
    own: f32,
    adjacent: f32,
}

/// A share `t` for the adjacent one of two bins; what is beyond the outer half of the own bin is dropped.
#[inline(always)]
fn share_two(bin: i32, from_center: f32) -> Share {
    Share { bin, adjacent_bin: 1 - bin, own: 1.0 - from_center.abs(), adjacent: positive(from_center) }
}

#[inline(always)]
fn share_cosine(cosine: f32, bins: i32) -> Share {
    let position = positive(0.5 * (1.0 + cosine)) * bins as f32;
    let bin = nearest_integer(position).min(bins);
    let from_center = position - bin as f32;
    let above = if bin + 1 == bins { 0 } else { bin + 1 };
    let below = if bin == 0 { bins - 1 } else { bin - 1 };
    let t = from_center.abs();
    Share { bin, adjacent_bin: if from_center > 0.0 { above } else { below }, own: 1.0 - t, adjacent: t }
}

#[inline(always)]
fn share_distance(distance: f32, radius: f32) -> Share {
    let halves = distance * (2.0 / radius);
    // Both shells share with each other across their common border, at 1.
    if halves > 1.0 { share_two(1, 1.5 - halves) } else { share_two(0, halves - 0.5) }
}

/// `horizontal` is the distance from the z axis.
#[inline(always)]
fn share_elevation(horizontal: f32, z: f32) -> Share {
    let vertical = z.abs();
    let from_pole = octant_fraction(horizontal, vertical);
    let right_angles = 0.5 * if horizontal > vertical { 2.0 - from_pole } else { from_pole };
    // On a flat patch all neighbours are in the plane; they are to stay together, in the lower half.
    share_two(i32::from(z > IN_PLANE as f32), right_angles - 0.5)
}

#[inline(always)]
fn share_azimuth(x: f32, y: f32) -> Share {
    let steep = y.abs() > x.abs();
    // Quadrants from -180 degrees on, two sectors each.
    let quadrant = if y > 0.0 {
        if x > 0.0 { 2 } else { 3 }
    } else if x > 0.0 {
        1
    } else {
        0
    };
    let steep_first = quadrant == 1 || quadrant == 3;
    let sector = 2 * quadrant + i32::from(steep != steep_first);
    // Even sectors begin at an axis, odd ones end at one; the fraction is the angle from that axis.
    let from_axis = octant_fraction(x.abs(), y.abs());
    let from_center = if sector & 1 == 0 { from_axis - 0.5 } else { 0.5 - from_axis };
    let next = if from_center > 0.0 { sector + 1 } else { sector + SECTOR_WRAP - 1 };
    let next = if next >= 2 * SECTOR_WRAP { next - 2 * SECTOR_WRAP } else { next };
    let adjacent_bin = if next >= SECTOR_WRAP { next - SECTOR_WRAP } else { next };
    // On the z axis there is no azimuth to count.
    let counts = if x == 0.0 && y == 0.0 { 0.0 } else { 1.0 };
    let t = from_center.abs();
    Share { bin: sector, adjacent_bin, own: counts * (1.0 - t), adjacent: counts * t }
}

/// Arc tangent of the smaller over the larger of two magnitudes as a fraction of 45 degrees, within 2.2e-6.
///
/// An odd polynomial: least maximum error on 0 to 1, found by iteratively reweighted least squares.
#[inline(always)]
fn octant_fraction(a: f32, b: f32) -> f32 {
    let (smaller, larger) = if a < b { (a, b) } else { (b, a) };
    let ratio = smaller / if larger > f32::MIN_POSITIVE { larger } else { f32::MIN_POSITIVE };
    let s = ratio * ratio;
    let high = (-0.014_921_243 * s + 0.067_032_63) * s - 0.148_238_74;
    ratio * (((high * s + 0.246_423_24) * s - 0.423_508_53) * s + 1.273_210_5)
}

/// The nearest integer to a number of 0 or more: adding 2^23 leaves no bits for a fraction. Unlike a cast, which
/// treats NaN and overflow, this is a single operation on a register of many numbers.
#[inline(always)]
fn nearest_integer(x: f32) -> i32 {
    const SHIFT: f32 = 8_388_608.0;
    (x + SHIFT).to_bits() as i32 - SHIFT.to_bits() as i32
}

#[inline(always)]
fn positive(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// Scales `row` to unit l2 norm; false if it is zero.
#[inline(always)]
fn normalize(row: &mut [f32]) -> bool {
    /// Independent partial sums.
    const SUMS: usize = 8;
    let (chunks, _) = row.as_chunks::<SUMS>();
    debug_assert_eq!(chunks.len() * SUMS, row.len());
    let squares =
        chunks.iter().fold([0.0; SUMS], |sums, chunk| array::from_fn(|l| sums[l] + chunk[l] * chunk[l]));
    let norm = squares.iter().sum::<f32>().sqrt();
    if norm > 0.0 {
        let inverse = 1.0 / norm;
        row.iter_mut().for_each(|x| *x *= inverse);
    }
    norm > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    #[test]
    fn octant_fraction_is_the_arc_tangent() {
        for i in 0..=1000 {
            let (a, b) = (i as f32 * 1e-3, 1.0);
            let expected = a.atan2(b) / FRAC_PI_4;
            for found in [octant_fraction(a, b), octant_fraction(b, a), octant_fraction(7.0 * a, 7.0 * b)] {
                assert!((found - expected).abs() < 3e-6, "{a}: {found}, not {expected}");
            }
        }
        assert_eq!(octant_fraction(0.0, 0.0), 0.0);
    }

    proptest! {
        #[test]
        fn sectors_follow_the_azimuth(azimuth in -PI..PI) {
            let sectors_from_start = (azimuth + PI) / FRAC_PI_4;
            prop_assume!((sectors_from_start - sectors_from_start.round()).abs() > 1e-4);
            let share = share_azimuth(2.0 * azimuth.cos(), 2.0 * azimuth.sin());
            let sector = sectors_from_start.floor();
            let from_center = sectors_from_start - sector - 0.5;
            prop_assert_eq!(share.bin, sector as i32);
            prop_assert!((share.adjacent - from_center.abs()).abs() < 1e-5);
            let step = if from_center > 0.0 { 1 } else { -1 };
            if share.adjacent > 1e-5 {
                prop_assert_eq!(share.adjacent_bin, (share.bin + step).rem_euclid(SECTOR_WRAP));
            }
        }

        #[test]
        fn halves_follow_the_inclination(inclination in 0.0..PI) {
            let share = share_elevation(3.0 * inclination.sin(), 3.0 * inclination.cos());
            let from_equator = (inclination - FRAC_PI_2).abs() / FRAC_PI_2;
            prop_assume!(from_equator > 1e-5);
            prop_assert_eq!(share.bin, i32::from(inclination < FRAC_PI_2));
            prop_assert!((share.adjacent - (0.5 - from_equator).max(0.0)).abs() < 1e-5);
            prop_assert!((share.own - 1.0 + (0.5 - from_equator).abs()).abs() < 1e-5);
        }

        #[test]
        fn shells_share_across_their_border_alone(distance in 0.0f32..9.0) {
            let share = share_distance(distance, 9.0);
            prop_assert_eq!(share.bin, i32::from(distance > 4.5));
            prop_assert!((share.adjacent - (0.5 - (distance - 4.5).abs() / 4.5).max(0.0)).abs() < 1e-5);
        }

        #[test]
        fn bins_follow_the_cosine(cosine in -1.0f32..=1.0, bins in 1i32..100) {
            let share = share_cosine(cosine, bins);
            let position = 0.5 * (1.0 + cosine) * bins as f32;
            prop_assert!((position - share.bin as f32).abs() <= 0.5 + 1e-5);
            prop_assert!((0..bins).contains(&share.adjacent_bin));
            prop_assert_eq!(share.own + share.adjacent, 1.0);
        }
    }

    #[test]
    fn on_the_axis_there_is_no_azimuth() {
        let share = share_azimuth(0.0, 0.0);
        assert_eq!((share.own, share.adjacent), (0.0, 0.0));
    }
}
