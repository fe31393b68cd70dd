//! Sparse linear assignment by auction (Bertsekas 1992, "Auction algorithms for network flow problems"; Bertsekas and
//! Castañon 1992, "A forward/reverse auction algorithm for asymmetric assignment problems").
//!
//! Persons bid for objects. Person `i` gains `a_ij` from object `j` and `r_i`, its reserve, from having none; the sum
//! of gains is maximised. With prices `p_j` and profits `q_i` the auction keeps, for all `i` and `j`,
//!
//! `q_i >= a_ij - p_j - e`,  `q_i >= r_i - e`,  `p_j >= 0`,
//!
//! with near equality where `j` is assigned to `i`, and ends with price 0 on every object that is left over. The sum
//! is then within `n_persons e` of the optimum. Bidding alone (forward) leaves prices on objects that lost their
//! person in an earlier phase of larger `e`; such objects then look for a person themselves (reverse), until their
//! price is gone.

use std::collections::VecDeque;

/// Stands for "no object" and "no person".
pub(super) const NONE: u32 = u32::MAX;

/// Gains of persons from objects, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Gains {
    /// Where each person's row begins, and the end, `[n_persons + 1]`.
    pub(super) starts: Vec<u32>,
    /// The objects of each row, distinct.
    pub(super) objects: Vec<u32>,
    /// The gains, finite.
    pub(super) values: Vec<f64>,
    /// Number of objects.
    pub(super) n_objects: usize,
}

impl Gains {
    /// From the rows of `(object, gain)`.
    pub(super) fn from_rows(rows: Vec<Vec<(u32, f64)>>, n_objects: usize) -> Self {
        let mut gains = Self { starts: vec![0], n_objects, ..Self::default() };
        for row in rows {
            gains.objects.extend(row.iter().map(|entry| entry.0));
            gains.values.extend(row.iter().map(|entry| entry.1));
            gains.starts.push(gains.objects.len() as u32);
        }
        gains
    }

    /// Number of persons.
    pub(super) fn n_persons(&self) -> usize {
        self.starts.len() - 1
    }

    /// The objects and gains of a person.
    pub(super) fn row(&self, person: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = self.starts[person] as usize..self.starts[person + 1] as usize;
        self.objects[range.clone()].iter().copied().zip(self.values[range].iter().copied())
    }

    /// The same with persons and objects exchanged.
    pub(super) fn transposed(&self) -> Self {
        let mut rows = vec![Vec::new(); self.n_objects];
        for person in 0..self.n_persons() {
            for (object, gain) in self.row(person) {
                rows[object as usize].push((person as u32, gain));
            }
        }
        Self::from_rows(rows, self.n_persons())
    }
}

/// The object of each person, [`NONE`] where the person does better without, `[n_persons]`.
///
/// `reserve`, `[n_persons]`, is what each person gains without an object. The result is within
/// `n_persons * precision` of the optimum. Ties go to the entry that comes first.
pub(super) fn assign(gains: &Gains, reserve: &[f64], precision: f64) -> Vec<u32> {
    let mut auction = Auction::new(gains, reserve);
    let mut epsilon = auction.spread().max(precision);
    loop {
        auction.phase(epsilon);
        if epsilon <= precision {
            return auction.object_of;
        }
        epsilon = (epsilon / 5.0).max(precision);
    }
}

struct Auction<'a> {
    gains: &'a Gains,
    by_object: Gains,
    reserve: &'a [f64],
    prices: Vec<f64>,
    profits: Vec<f64>,
    object_of: Vec<u32>,
    person_of: Vec<u32>,
}

impl<'a> Auction<'a> {
    fn new(gains: &'a Gains, reserve: &'a [f64]) -> Self {
        Self {
            gains,
            by_object: gains.transposed(),
            reserve,
            prices: vec![0.0; gains.n_objects],
            profits: reserve.to_vec(),
            object_of: vec![NONE; gains.n_persons()],
            person_of: vec![NONE; gains.n_objects],
        }
    }

    /// A quarter of the mean range of a person's gains: the precision of the first phase.
    fn spread(&self) -> f64 {
        let range = |person: usize| {
            let (low, high) =
                self.gains.row(person).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, gain)| {
                    (low.min(gain), high.max(gain))
                });
            (high - low).max(0.0)
        };
        let n = self.gains.n_persons();
        0.25 * (0..n).map(range).sum::<f64>() / n.max(1) as f64
    }

    /// A complete auction at one `epsilon`, from the prices at hand.
    fn phase(&mut self, epsilon: f64) {
        self.object_of.fill(NONE);
        self.person_of.fill(NONE);
        let mut bidders: VecDeque<u32> = (0..self.gains.n_persons() as u32).collect();
        while let Some(person) = bidders.pop_front() {
            if let Some(loser) = self.bid(person as usize, epsilon) {
                bidders.push_back(loser);
            }
        }
        let priced =
            |object: &u32| self.person_of[*object as usize] == NONE && self.prices[*object as usize] > 0.0;
        let mut sellers: VecDeque<u32> = (0..self.gains.n_objects as u32).filter(priced).collect();
        while let Some(object) = sellers.pop_front() {
            if let Some(left) = self.offer(object as usize, epsilon) {
                sellers.push_back(left);
            }
        }
    }

    /// The person takes the object it gains most from and raises its price; returns who had it.
    fn bid(&mut self, person: usize, epsilon: f64) -> Option<u32> {
        let (mut best, mut first, mut second) = (NONE, f64::NEG_INFINITY, self.reserve[person]);
        for (object, gain) in self.gains.row(person) {
            let value = gain - self.prices[object as usize];
            if value > first {
                second = second.max(first);
                (best, first) = (object, value);
            } else {
                second = second.max(value);
            }
        }
        if best == NONE || first < self.reserve[person] {
            self.profits[person] = self.reserve[person];
            return None;
        }
        let object = best as usize;
        self.prices[object] += first - second + epsilon;
        self.profits[person] = second - epsilon;
        self.object_of[person] = best;
        let loser = std::mem::replace(&mut self.person_of[object], person as u32);
        (loser != NONE).then(|| {
            self.object_of[loser as usize] = NONE;
            loser
        })
    }

    /// The object lowers its price until a person prefers it; returns the object that this person leaves, if that has
    /// a price.
    fn offer(&mut self, object: usize, epsilon: f64) -> Option<u32> {
        let (mut best, mut first, mut second) = (NONE, f64::NEG_INFINITY, 0.0f64);
        for (person, gain) in self.by_object.row(object) {
            let value = gain - self.profits[person as usize];
            if value > first {
                second = second.max(first);
                (best, first) = (person, value);
            } else {
                second = second.max(value);
            }
        }
        if first <= epsilon {
            self.prices[object] = 0.0;
            return None;
        }
        let person = best as usize;
        self.prices[object] = (second - epsilon).max(0.0);
        self.profits[person] += first - self.prices[object];
        self.person_of[object] = best;
        let left = std::mem::replace(&mut self.object_of[person], object as u32);
        if left == NONE {
            return None;
        }
        self.person_of[left as usize] = NONE;
        (self.prices[left as usize] > 0.0).then_some(left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(n_persons: usize, n_objects: usize, density: f64, rng: &mut ChaCha8Rng) -> Gains {
        let mut row = || {
            let mut row = Vec::new();
            for object in 0..n_objects as u32 {
                if rng.random_bool(density) {
                    row.push((object, rng.random_range(-1.0..1.0)));
                }
            }
            row
        };
        Gains::from_rows((0..n_persons).map(|_| row()).collect(), n_objects)
    }

    fn total(gains: &Gains, reserve: &[f64], object_of: &[u32]) -> f64 {
        let mut taken = vec![false; gains.n_objects];
        let value = |(person, &object): (usize, &u32)| {
            if object == NONE {
                return reserve[person];
            }
            assert!(
                !std::mem::replace(&mut taken[object as usize], true),
                "object {object} is assigned twice"
            );
            gains.row(person).find(|entry| entry.0 == object).expect("only gains are assigned").1
        };
        object_of.iter().enumerate().map(value).sum()
    }

    /// The optimum by trying everything.
    fn optimum(gains: &Gains, reserve: &[f64], person: usize, taken: &mut Vec<bool>) -> f64 {
        if person == gains.n_persons() {
            return 0.0;
        }
        let mut best = reserve[person] + optimum(gains, reserve, person + 1, taken);
        for (object, gain) in gains.row(person) {
            if !taken[object as usize] {
                taken[object as usize] = true;
                best = best.max(gain + optimum(gains, reserve, person + 1, taken));
                taken[object as usize] = false;
            }
        }
        best
    }

    #[test]
    fn small_random_problems_reach_the_optimum() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let precision = 1e-4;
        for trial in 0..300 {
            let (n_persons, n_objects) = (1 + trial % 6, 1 + (trial / 6) % 7);
            let gains = random(n_persons, n_objects, [0.4, 0.7, 1.0][trial % 3], &mut rng);
            let low = if trial % 2 == 0 { -0.5 } else { -50.0 };
            let reserve: Vec<f64> = (0..n_persons).map(|_| low + rng.random_range(-0.2..0.2)).collect();
            let found = total(&gains, &reserve, &assign(&gains, &reserve, precision));
            let best = optimum(&gains, &reserve, 0, &mut vec![false; n_objects]);
            assert!(
                found <= best + 1e-9 && found >= best - n_persons as f64 * precision - 1e-9,
                "trial {trial}: {found} instead of {best}"
            );
        }
    }

    /// With gains `u_i + v_j - c_ij`, `c` zero on a permutation and positive elsewhere, the permutation is the optimum.
    #[test]
    fn a_planted_permutation_is_found() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let n = 300u32;
        let offsets: Vec<f64> = (0..2 * n).map(|_| rng.random_range(-3.0..3.0)).collect();
        let mate = |person: u32| (person * 7 + 5) % n;
        let row = |person: u32| {
            let gain = |object: u32| {
                let cost =
                    if object == mate(person) { 0.0 } else { 0.01 + f64::from(person ^ object) / 300.0 };
                offsets[person as usize] + offsets[(n + object) as usize] - cost
            };
            (0..n).map(|object| (object, gain(object))).collect()
        };
        let gains = Gains::from_rows((0..n).map(row).collect(), n as usize);
        let object_of = assign(&gains, &vec![-1e6; n as usize], 1e-6);
        assert_eq!(object_of, (0..n).map(mate).collect::<Vec<_>>());
    }

    #[test]
    fn persons_without_objects_stay_without() {
        let gains = Gains::from_rows(vec![vec![], vec![(0, 1.0)], vec![(0, 2.0)]], 1);
        assert_eq!(assign(&gains, &[0.0; 3], 1e-3), [NONE, NONE, 0]);
        assert!(assign(&Gains::from_rows(vec![], 4), &[], 1e-3).is_empty());
    }

    #[test]
    fn transposed_twice_is_the_same() {
        let gains = random(5, 8, 0.5, &mut ChaCha8Rng::seed_from_u64(3));
        assert_eq!(gains.transposed().transposed(), gains);
    }
}
