//! From averages to an assignment: which targets a source vertex may take, at what gain, and what to do with the rest.

use super::auction::{Gains, NONE, assign};
use super::neighborhood::Neighborhoods;
use crate::Matrix;
use crate::point_map::PointMap;
use crate::point_map::search::squared_distance;
use rayon::prelude::*;

/// A vertex goes without a match rather than take one that is worse than its worst candidate by so many squared
/// spacings.
const MARGIN: f64 = 100.0;
/// The auction's precision, in squared spacings.
const PRECISION: f64 = 0.0005;
/// Neighbours of a vertex whose matches the search for candidates starts from, and targets around each of these.
const STARTS: usize = 6;
const AROUND_START: usize = 8;
/// Free targets that a vertex left over may take in one round of filling.
const FREE_CANDIDATES: usize = 48;

/// Assigns source vertices to the rows of the target's embedding.
pub(super) struct Assigner<'a> {
    rows: &'a Matrix,
    neighborhoods: &'a Neighborhoods,
    candidates: usize,
    /// The median of the squared distance of a row to its nearest other.
    squared_spacing: f64,
    descriptors: Option<DescriptorTerm<'a>>,
}

/// The part of the gain that compares pointwise descriptors.
pub(super) struct DescriptorTerm<'a> {
    source: &'a Matrix<f32>,
    target: &'a Matrix<f32>,
    /// Weight of the squared distance of two descriptors.
    factor: f64,
}

impl<'a> DescriptorTerm<'a> {
    /// `weight` is that of one squared distance as is usual between neighbours on the target.
    pub(super) fn new(
        [source, target]: [&'a Matrix<f32>; 2],
        neighborhoods: &Neighborhoods,
        weight: f64,
    ) -> Self {
        let to_next = |vertex: u32| {
            let next = neighborhoods.of(vertex).get(1).copied().unwrap_or(vertex);
            descriptor_distance(target.row(vertex as usize), target.row(next as usize))
        };
        let usual = median((0..target.rows() as u32).map(to_next).collect());
        Self { source, target, factor: weight / usual }
    }

    fn cost(&self, x: usize, y: u32) -> f64 {
        self.factor * descriptor_distance(self.source.row(x), self.target.row(y as usize))
    }
}

impl<'a> Assigner<'a> {
    pub(super) fn new(
        rows: &'a Matrix,
        neighborhoods: &'a Neighborhoods,
        candidates: usize,
        descriptors: Option<DescriptorTerm<'a>>,
    ) -> Self {
        let to_next = |vertex: u32| {
            let next = neighborhoods.of(vertex).get(1).copied().unwrap_or(vertex);
            squared_distance(rows.row(vertex as usize), rows.row(next as usize))
        };
        let squared_spacing = median((0..rows.rows() as u32).map(to_next).collect());
        Self { rows, neighborhoods, candidates, squared_spacing, descriptors }
    }

    /// Whether a source of so many vertices gets an injective map.
    pub(super) fn is_injective(&self, n_source: usize) -> bool {
        n_source <= self.rows.rows()
    }

    /// The assignment of least squared distance between `averages`, `[n_source, k]`, and the embedding, in which no
    /// target is taken twice and some vertices may be left without. `around` holds neighbours of the source vertices.
    pub(super) fn assign(&self, averages: &Matrix, around: &Neighborhoods, present: &[u32]) -> Vec<u32> {
        let row = |x: usize| {
            let mut near = self.nearest(averages.row(x), x as u32, around, present);
            near.truncate(self.candidates);
            let mut vertices: Vec<u32> = near.into_iter().map(|entry| entry.0).collect();
            if present[x] != PointMap::UNMATCHED && !vertices.contains(&present[x]) {
                vertices.push(present[x]);
            }
            self.gains(averages.row(x), x, &vertices)
        };
        let rows = (0..averages.rows()).into_par_iter().map(row).collect();
        let gains = Gains::from_rows(rows, self.rows.rows());
        if self.is_injective(averages.rows()) {
            return auction(&gains);
        }
        let mut targets = vec![PointMap::UNMATCHED; averages.rows()];
        for (target, source) in auction(&gains.transposed()).into_iter().enumerate() {
            if source != NONE {
                targets[source as usize] = target as u32;
            }
        }
        targets
    }

    /// The nearest target of each unmatched source vertex, taken or not.
    pub(super) fn complete(&self, averages: &Matrix, around: &Neighborhoods, targets: &mut [u32]) {
        let nearest = |x: usize| match targets[x] {
            PointMap::UNMATCHED => self.nearest(averages.row(x), x as u32, around, targets)[0].0,
            target => target,
        };
        let completed: Vec<u32> = (0..targets.len()).into_par_iter().map(nearest).collect();
        targets.copy_from_slice(&completed);
    }

    /// Targets near an average with their squared distances, nearest first, at least one.
    ///
    /// The search begins where the neighbours of `x` go and then walks downhill; all targets are looked at where no
    /// neighbour is matched.
    fn nearest(&self, average: &[f64], x: u32, around: &Neighborhoods, present: &[u32]) -> Vec<(u32, f64)> {
        let starts = around.of(x).iter().take(STARTS).map(|&v| present[v as usize]);
        let mut open: Vec<u32> = starts
            .filter(|&target| target != PointMap::UNMATCHED)
            .flat_map(|target| self.neighborhoods.of(target).iter().take(AROUND_START).copied())
            .collect();
        if open.is_empty() {
            open.extend(0..self.rows.rows() as u32);
        }
        let mut seen: Vec<u32> = Vec::new();
        let mut found: Vec<(u32, f64)> = Vec::new();
        let mut best = (PointMap::UNMATCHED, f64::INFINITY);
        loop {
            open.sort_unstable();
            open.dedup();
            open.retain(|y| seen.binary_search(y).is_err());
            found.extend(open.iter().map(|&y| (y, squared_distance(average, self.rows.row(y as usize)))));
            seen.append(&mut open);
            seen.sort_unstable();
            let order = |a: &&(u32, f64), b: &&(u32, f64)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
            match found.iter().min_by(order) {
                Some(&nearest) if nearest.0 != best.0 => best = nearest,
                _ => break,
            }
            open.extend_from_slice(self.neighborhoods.of(best.0));
        }
        found.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        found
    }

    /// Gives each unmatched source vertex a target that is free, near where its surroundings go as far as possible.
    /// There must be enough targets.
    pub(super) fn fill(&self, averages: &Matrix, targets: &mut [u32]) {
        loop {
            let open: Vec<usize> =
                (0..targets.len()).filter(|&x| targets[x] == PointMap::UNMATCHED).collect();
            if open.is_empty() {
                return;
            }
            let mut is_free = vec![true; self.rows.rows()];
            let taken = targets.iter().filter(|&&t| t != PointMap::UNMATCHED);
            taken.for_each(|&t| is_free[t as usize] = false);
            let free: Vec<u32> = (0..is_free.len() as u32).filter(|&y| is_free[y as usize]).collect();
            let rows = open.par_iter().map(|&x| self.free_candidates(averages.row(x), x, &free)).collect();
            let found = auction(&Gains::from_rows(rows, self.rows.rows()));
            open.into_iter().zip(found).for_each(|(x, target)| targets[x] = target);
        }
    }

    fn free_candidates(&self, average: &[f64], x: usize, free: &[u32]) -> Vec<(u32, f64)> {
        let mut gains = self.gains(average, x, free);
        if gains.len() > FREE_CANDIDATES {
            gains.select_nth_unstable_by(FREE_CANDIDATES - 1, |a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            gains.truncate(FREE_CANDIDATES);
            gains.sort_unstable_by_key(|entry| entry.0);
        }
        gains
    }

    /// Minus the squared distances of embeddings, in squared spacings, and of descriptors, less that of the best.
    fn gains(&self, average: &[f64], x: usize, candidates: &[u32]) -> Vec<(u32, f64)> {
        let gain = |&y: &u32| {
            let distance = squared_distance(average, self.rows.row(y as usize)) / self.squared_spacing;
            let unlike = self.descriptors.as_ref().map_or(0.0, |term| term.cost(x, y));
            (y, -distance - unlike)
        };
        let mut gains: Vec<(u32, f64)> = candidates.iter().map(gain).collect();
        let best = gains.iter().map(|entry| entry.1).fold(f64::NEG_INFINITY, f64::max);
        gains.iter_mut().for_each(|entry| entry.1 -= best);
        gains
    }
}

fn auction(gains: &Gains) -> Vec<u32> {
    let worst = |person: usize| gains.row(person).map(|entry| entry.1).fold(0.0, f64::min);
    let reserve: Vec<f64> = (0..gains.n_persons()).map(|person| worst(person) - MARGIN).collect();
    assign(gains, &reserve, PRECISION)
}

/// The median, or 1 where it is 0.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().filter(|&median| median > 0.0).unwrap_or(1.0)
}

fn descriptor_distance(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0f32; 8];
    for (x, y) in a.chunks(8).zip(b.chunks(8)) {
        for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
            *sum += (x - y) * (x - y);
        }
    }
    sums.iter().map(|&sum| f64::from(sum)).sum()
}
