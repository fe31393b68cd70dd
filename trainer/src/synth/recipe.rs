//! What a species is made of: the solids of its body at rest, its bones, and where individuals differ.

use super::implicit::{Part, Solid};
use super::loft::{Loft, Station};
use super::math::{Vec3, perpendicular, unit};
use super::mirror::Symmetry;
use super::skeleton::Skeleton;
use fmnet::mesh::vec3;

/// A place where flesh varies between individuals, or from left to right.
#[derive(Clone, Debug)]
pub(super) struct Feature {
    pub(super) kind: FeatureKind,
    pub(super) center: Vec3,
    pub(super) radius: f64,
    /// Unit direction of the displacement; only skin that faces it moves.
    pub(super) direction: Vec3,
}

/// Features that vary together share a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FeatureKind {
    /// Fat of the belly.
    Belly,
    /// Fat of hips, thighs and buttocks.
    Hips,
    /// Breast or brisket.
    Chest,
    /// Muscles of limbs, shoulders and neck.
    Muscle,
    /// Details of head and face.
    Face,
}

/// Everything needed to build a species' template.
#[derive(Clone, Debug)]
pub(super) struct Recipe {
    pub(super) skeleton: Skeleton,
    pub(super) parts: Vec<Part>,
    pub(super) features: Vec<Feature>,
    /// Of every bone, how much larger the solids show it than it is: fine detail (fingers, face) is modelled
    /// enlarged, so that a uniform grid resolves it.
    pub(super) magnified: Vec<f64>,
    /// Grid spacing of the template, a length.
    pub(super) cell: f64,
    /// Bones that clothes keep near their rest.
    pub(super) bound: Vec<usize>,
    /// How much larger the body is than it was modelled.
    pub(super) scale: f64,
    pub(super) symmetry: Symmetry,
}

/// How the next solids are joined; see [`Part`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Join<'a> {
    pub(super) bones: &'a [usize],
    pub(super) blend: f64,
}

/// Radii of a spindle: at its start, at its end, and what is added half-way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Girth(pub(super) f64, pub(super) f64, pub(super) f64);

impl Recipe {
    /// Nothing yet; `cell` is the grid spacing of the template.
    pub(super) fn new(cell: f64) -> Self {
        let (skeleton, parts, features) = Default::default();
        let (magnified, bound, symmetry) = (Vec::new(), Vec::new(), Symmetry::Mirror);
        Self { skeleton, parts, features, magnified, cell, bound, scale: 1.0, symmetry }
    }

    /// Adds a round spindle from `a` to `b`.
    pub(super) fn spindle(&mut self, join: Join, a: Vec3, b: Vec3, girth: Girth) {
        self.flat_spindle(join, a, b, girth, [0.0, 0.0, 1.0], 1.0);
    }

    /// Adds a spindle squeezed by `flatten` along the direction nearest to `axis` that is perpendicular to it.
    pub(super) fn flat_spindle(
        &mut self,
        join: Join,
        a: Vec3,
        b: Vec3,
        girth: Girth,
        axis: Vec3,
        flatten: f64,
    ) {
        let Girth(ra, rb, bulge) = girth;
        let along = unit(vec3::sub(b, a));
        let axis = if flatten == 1.0 { axis } else { perpendicular(along, axis) };
        self.push(join, Solid::Spindle { a, b, ra, rb, bulge, axis, flatten }, false);
    }

    /// Adds an ellipsoid with its semi-axes along the world's.
    pub(super) fn ellipsoid(&mut self, join: Join, center: Vec3, radii: Vec3) {
        self.tilted_ellipsoid(join, center, radii, [0.0, 1.0, 0.0]);
    }

    /// Adds an ellipsoid whose second semi-axis lies along `up` and whose third is as near as can be to the z axis.
    pub(super) fn tilted_ellipsoid(&mut self, join: Join, center: Vec3, radii: Vec3, up: Vec3) {
        self.push(join, Solid::Ellipsoid { center, radii, axes: upright(up) }, false);
    }

    /// Adds a tube through cross-sections; see [`Loft`].
    pub(super) fn tube(&mut self, join: Join, stations: Vec<Station>, upright: bool) {
        self.loft(join, Loft { stations, upright, cap: 0.8 });
    }

    /// Adds a tube.
    pub(super) fn loft(&mut self, join: Join, loft: Loft) {
        self.push(join, Solid::Tube(loft), false);
    }

    /// Takes an ellipsoid away.
    pub(super) fn carve(&mut self, join: Join, center: Vec3, radii: Vec3) {
        self.push(join, Solid::Ellipsoid { center, radii, axes: upright([0.0, 1.0, 0.0]) }, true);
    }

    /// Adds a place where individuals differ.
    pub(super) fn feature(&mut self, kind: FeatureKind, center: Vec3, radius: f64, direction: Vec3) {
        self.features.push(Feature { kind, center, radius, direction: unit(direction) });
    }

    /// Multiplies every length by `factor`.
    pub(super) fn scaled(mut self, factor: f64) -> Self {
        let by = |p: &mut Vec3| *p = vec3::scale(*p, factor);
        for bone in &mut self.skeleton.bones {
            by(&mut bone.head);
            by(&mut bone.tail);
        }
        for part in &mut self.parts {
            let mut solid = part.solid.clone();
            match &mut solid {
                Solid::Tube(loft) => loft.scale(factor),
                Solid::Spindle { a, b, ra, rb, bulge, .. } => {
                    by(a);
                    by(b);
                    for radius in [ra, rb, bulge] {
                        *radius *= factor;
                    }
                }
                Solid::Ellipsoid { center, radii, .. } => {
                    by(center);
                    by(radii);
                }
            }
            *part = Part::new(solid, factor * part.blend, part.carve, &part.bones);
        }
        for feature in &mut self.features {
            by(&mut feature.center);
            feature.radius *= factor;
        }
        self.cell *= factor;
        self.scale *= factor;
        self
    }

    fn push(&mut self, join: Join, solid: Solid, carve: bool) {
        self.parts.push(Part::new(solid, join.blend, carve, join.bones));
    }
}

/// An orthonormal frame whose second axis is `up`.
fn upright(up: Vec3) -> [Vec3; 3] {
    let up = unit(up);
    let hint = if up[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
    let depth = perpendicular(up, hint);
    [vec3::cross(up, depth), up, depth]
}
