//! Straight geodesics out of one vertex, by unfolding the faces they cross into the plane.
//!
//! A window is a cone of straight lines from the source that enters a face through one of its sides, as in the
//! exact algorithms of Mitchell, Mount and Papadimitriou (1987) and of Chen and Han (1990). The unfolded side is
//! kept in the plane of the source, which sits in the origin, so that crossing a face costs neither a root nor a
//! trigonometric function. Windows that cannot hold a shortest path are dropped by the test of Xin and Wang
//! (2009, "Improving Chen and Han's algorithm on the discrete geodesic problem").

use super::surface::{Surface, rotate};

pub(super) type Point = [f64; 2];

/// Relative tolerance within which a line meets a vertex.
const ON_RAY: f64 = 1e-11;

/// A cone of straight lines about to enter a face through `side`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// The side of the face entered.
    pub(super) side: u32,
    /// Whether `right` is the second end of the side.
    pub(super) from_second: bool,
    /// Unfolded ends of the side, right and left as seen from the source.
    pub(super) ends: [Point; 2],
    /// Directions of the right and left border of the cone.
    pub(super) rays: [Point; 2],
    /// Direction at the source of the x axis of the plane.
    pub(super) axis: f64,
}

/// A vertex met by a straight line from the source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub(super) vertex: u32,
    /// Length of the straight line.
    pub(super) distance: f64,
    /// Direction in which it leaves the source.
    pub(super) departure: f64,
    /// Direction at `vertex` from which it came.
    pub(super) arrival: f64,
}

/// The unfolded part of its side that a window covers.
pub(super) struct Span {
    right: Point,
    left: Point,
    /// Distance from the source to the right and left end of the span.
    radii: [f64; 2],
    /// Distance from the source to the nearest point of the span.
    pub(super) nearest: f64,
}

impl Window {
    /// Ids of the right and left end of the side.
    pub(super) fn end_vertices(&self, surface: &Surface) -> [u32; 2] {
        let [first, second] = surface.ends(self.side);
        if self.from_second { [second, first] } else { [first, second] }
    }

    pub(super) fn span(&self) -> Span {
        let [a, b] = self.ends;
        let edge = sub(b, a);
        let right = if self.rays[0] == a { a } else { intersection(a, edge, self.rays[0]) };
        let left = if self.rays[1] == b { b } else { intersection(a, edge, self.rays[1]) };
        let radii = [norm(right), norm(left)];
        // The foot of the perpendicular is inside where the distance falls going inwards at both ends.
        let nearest = if dot(right, edge) < 0.0 && dot(left, edge) > 0.0 {
            cross(a, b).abs() / norm(edge)
        } else {
            radii[0].min(radii[1])
        };
        Span { right, left, radii, nearest }
    }

    /// Crosses the face: reports the apex if the cone meets it, and the one or two windows beyond.
    pub(super) fn cross_face(
        &self,
        surface: &Surface,
        mut on_hit: impl FnMut(Hit),
        mut on_window: impl FnMut(Window),
    ) {
        let [a, b] = self.ends;
        let (along, height) = surface.apex(self.side, self.from_second);
        let edge = sub(b, a);
        let apex = [a[0] + along * edge[0] + height * edge[1], a[1] + along * edge[1] - height * edge[0]];
        let [right, left] = self.rays;
        let (from_right, to_left) = (cross(right, apex), cross(apex, left));
        if from_right >= -ON_RAY * l1(right) * l1(apex) && to_left >= -ON_RAY * l1(apex) * l1(left) {
            on_hit(self.hit(surface, apex));
        }
        let ids = self.end_vertices(surface);
        // Sides between the apex and the first and second end of the side entered.
        let (at_first, at_second) = (rotate(self.side, 2), rotate(self.side, 1));
        let (side_right, side_left) =
            if self.from_second { (at_second, at_first) } else { (at_first, at_second) };
        let mut pass = |side, right_id, ends, rays: [Point; 2]| {
            if cross(rays[0], rays[1]) > ON_RAY * 1e-2 * l1(rays[0]) * l1(rays[1]) {
                for entered in surface.across(side) {
                    let from_second = surface.ends(entered)[0] != right_id;
                    on_window(Window { side: entered, from_second, ends, rays, axis: self.axis });
                }
            }
        };
        if from_right > 0.0 {
            let border = if to_left > 0.0 { apex } else { left };
            pass(side_right, ids[0], [a, apex], [right, border]);
        }
        if to_left > 0.0 {
            let border = if from_right > 0.0 { apex } else { right };
            pass(side_left, surface.vertex(self.side), [apex, b], [border, left]);
        }
    }

    fn hit(&self, surface: &Surface, apex: Point) -> Hit {
        let to_right = sub(self.ends[0], apex);
        let to_source = [-apex[0], -apex[1]];
        let angle = cross(to_right, to_source).abs().atan2(dot(to_right, to_source));
        let right_id = self.end_vertices(surface)[0];
        Hit {
            vertex: surface.vertex(self.side),
            distance: norm(apex),
            departure: self.axis + apex[1].atan2(apex[0]),
            arrival: surface.direction(self.side, right_id, angle),
        }
    }
}

impl Span {
    /// Whether every point of the span is reached more quickly through an end of its side, given the distances
    /// of the two ends, for a source that is itself at distance `base`.
    ///
    /// Moving away from an end, the distance through that end grows at least as fast as the distance from the
    /// source, so that the far end of the span decides.
    pub(super) fn is_dominated(&self, ends: [Point; 2], distances: [f64; 2], base: f64) -> bool {
        let through = |i: usize, point: Point| distances[i] + norm(sub(point, ends[i]));
        let slack = 1.0 + 1e-12;
        through(0, self.left) * slack < base + self.radii[1]
            || through(1, self.right) * slack < base + self.radii[0]
    }
}

/// Reports the neighbours of `source` and the windows over the faces around it, cut to the directions of `sector`.
///
/// `sector` gets the start direction and the angle of a corner and returns the part `[from, to]` of `[0, angle]`
/// to look at.
pub(super) fn open_windows(
    surface: &Surface,
    source: u32,
    sector: impl Fn(f64, f64) -> Option<[f64; 2]>,
    mut on_hit: impl FnMut(Hit),
    mut on_window: impl FnMut(Window),
) {
    for &corner in surface.corners_of(source) {
        let (start, angle, sides) = surface.corner(corner);
        let neighbors = sides.map(|side| other_end(surface, side, source));
        let lengths = sides.map(|side| surface.length(side));
        for (i, departure) in [start, start + angle].into_iter().enumerate() {
            // The corner at the neighbour is opposite the other bounding side.
            let arrival = surface.direction(sides[1 - i], source, 0.0);
            on_hit(Hit { vertex: neighbors[i], distance: lengths[i], departure, arrival });
        }
        let Some([from, to]) = sector(start, angle) else { continue };
        let ends = [[lengths[0], 0.0], [lengths[1] * angle.cos(), lengths[1] * angle.sin()]];
        let right = if from <= 0.0 { ends[0] } else { [from.cos(), from.sin()] };
        let left = if to >= angle { ends[1] } else { [to.cos(), to.sin()] };
        if cross(right, left) <= 0.0 {
            continue;
        }
        for side in surface.across(corner) {
            let from_second = surface.ends(side)[0] != neighbors[0];
            on_window(Window { side, from_second, ends, rays: [right, left], axis: start });
        }
    }
}

fn other_end(surface: &Surface, side: u32, vertex: u32) -> u32 {
    let [first, second] = surface.ends(side);
    if first == vertex { second } else { first }
}

/// Where the line from the origin along `ray` meets the line through `a` along `edge`.
fn intersection(a: Point, edge: Point, ray: Point) -> Point {
    let t = (-cross(a, ray) / cross(edge, ray)).clamp(0.0, 1.0);
    let t = if t.is_nan() { 0.5 } else { t };
    [a[0] + t * edge[0], a[1] + t * edge[1]]
}

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

fn l1(a: Point) -> f64 {
    a[0].abs() + a[1].abs()
}
