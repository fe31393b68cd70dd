//! Trunks: a smooth tube through elliptic cross-sections.

use fmnet::mesh::vec3;

use super::math::Vec3;

/// A cross-section of a tube.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    pub(super) center: Vec3,
    /// Half-width along the x axis.
    pub(super) side: f64,
    /// Extent to the front (upwards on a quadruped), and to the back (downwards).
    pub(super) front: f64,
    pub(super) back: f64,
}

/// A tube along the y axis (of an upright body) or the z axis, through at least two stations in ascending order.
/// Between them centres and extents are Catmull and Rom's cubic; the ends are rounded.
#[derive(Clone, Debug)]
pub(super) struct Loft {
    pub(super) stations: Vec<Station>,
    /// Whether it runs along y, with its front at +z; else along z, with its front at +y.
    pub(super) upright: bool,
    /// Roundness of the ends: how far they reach, relative to the extents there.
    pub(super) cap: f64,
}

impl Loft {
    fn axes(&self) -> (usize, usize) {
        if self.upright { (1, 2) } else { (2, 1) }
    }

    /// First-order approximation of the signed distance of `p`, negative inside.
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        let (along, depth) = self.axes();
        let (i, t, beyond) = self.locate(p[along]);
        let section = self.section(i, t);
        let side = section.side;
        let offset = p[depth] - section.center[depth];
        let reach = if offset > 0.0 { section.front } else { section.back };
        let cap = self.cap * side.min(reach);
        let q = [p[0] / side, offset / reach, beyond / cap];
        let level = vec3::norm(q);
        let gradient = vec3::norm([q[0] / side, q[1] / reach, q[2] / cap]);
        let least = side.min(reach);
        if gradient > 0.0 { (level * (level - 1.0) / gradient).max(-least) } else { -least }
    }

    /// Where `p` goes when this tube becomes `to`, which has as many stations: it keeps its place along the tube and
    /// its distance from the centre relative to the extents there.
    pub(super) fn carry(&self, to: &Self, p: Vec3) -> Vec3 {
        let (along, depth) = self.axes();
        let (i, t, beyond) = self.locate(p[along]);
        let (from, other) = (self.section(i, t), to.section(i, t));
        let offset = p[depth] - from.center[depth];
        let reach = |s: &Station| if offset > 0.0 { s.front } else { s.back };
        let cap = |tube: &Self, s: &Station| tube.cap * s.side.min(reach(s));
        let mut result = other.center;
        result[0] += p[0] * other.side / from.side;
        result[along] += beyond * cap(to, &other) / cap(self, &from);
        result[depth] += offset * reach(&other) / reach(&from);
        result
    }

    /// Index of the station before the place `along` the tube, how far it is to the next, and how far beyond the ends.
    fn locate(&self, along: f64) -> (usize, f64, f64) {
        let place = |i: usize| self.stations[i].center[self.axes().0];
        let last = self.stations.len() - 1;
        let clamped = along.clamp(place(0), place(last));
        let i = (1..last).find(|&i| clamped < place(i)).unwrap_or(last) - 1;
        (i, (clamped - place(i)) / (place(i + 1) - place(i)), along - clamped)
    }

    /// The cross-section between station `i` and the next at `t` in [0, 1].
    fn section(&self, i: usize, t: f64) -> Station {
        let (along, depth) = self.axes();
        let value = |of: &dyn Fn(&Station) -> f64| self.interpolate(i, t, of);
        let mut center = [0.0; 3];
        let [low, high] = [i, i + 1].map(|i| self.stations[i].center[along]);
        center[along] = low + t * (high - low);
        center[depth] = value(&|s| s.center[depth]);
        Station { center, side: value(&|s| s.side), front: value(&|s| s.front), back: value(&|s| s.back) }
    }

    /// Cubic through the stations' values, between station `i` and the next at `t` in [0, 1].
    fn interpolate(&self, i: usize, t: f64, of: &dyn Fn(&Station) -> f64) -> f64 {
        let (along, _) = self.axes();
        let place = |i: usize| self.stations[i].center[along];
        let value = |i: usize| of(&self.stations[i]);
        let span = place(i + 1) - place(i);
        let slope = |i: usize| {
            let (low, high) = (i.saturating_sub(1), (i + 1).min(self.stations.len() - 1));
            (value(high) - value(low)) / (place(high) - place(low))
        };
        let (t2, t3) = (t * t, t * t * t);
        value(i) * (2.0 * t3 - 3.0 * t2 + 1.0)
            + value(i + 1) * (3.0 * t2 - 2.0 * t3)
            + span * (slope(i) * (t3 - 2.0 * t2 + t) + slope(i + 1) * (t3 - t2))
    }

    /// A ball that holds the tube: centre and radius.
    pub(super) fn bound(&self) -> (Vec3, f64) {
        let ends = [self.stations[0].center, self.stations[self.stations.len() - 1].center];
        let center = super::math::lerp(ends[0], ends[1], 0.5);
        let reach = |s: &Station| vec3::distance(s.center, center) + 1.1 * s.side.max(s.front).max(s.back);
        (center, self.stations.iter().map(reach).fold(0.0, f64::max))
    }

    /// Multiplies every length by `factor`.
    pub(super) fn scale(&mut self, factor: f64) {
        for station in &mut self.stations {
            station.center = vec3::scale(station.center, factor);
            for extent in [&mut station.side, &mut station.front, &mut station.back] {
                *extent *= factor;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tube_passes_through_its_stations() {
        let station = |y: f64, side: f64| Station { center: [0.0, y, 0.0], side, front: 0.3, back: 0.2 };
        let stations = vec![station(0.0, 0.4), station(1.0, 0.5), station(3.0, 0.2)];
        let tube = Loft { stations, upright: true, cap: 0.8 };
        for surface in [[0.4, 0.0, 0.0], [0.5, 1.0, 0.0], [0.0, 1.0, 0.3], [0.0, 2.5, -0.2], [0.0, 3.16, 0.0]]
        {
            assert!(tube.distance(surface).abs() < 1e-12, "{surface:?}: {}", tube.distance(surface));
        }
    }
}
