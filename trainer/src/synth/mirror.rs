//! Bodies that are their own mirror image at the plane x = 0, and those that are not: which points, vertices and
//! bones are each other's.

use fmnet::mesh::nearest_vertices;

use super::math::Vec3;
use super::skeleton::Skeleton;

/// How a body is modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Symmetry {
    /// Its left side, x > 0, is modelled; the right one is the mirror image.
    Mirror,
    /// All of it is modelled, as a hand is nobody's mirror image.
    None,
}

impl Symmetry {
    /// `p`, seen on the side that is modelled.
    pub(super) fn folded(self, p: Vec3) -> Vec3 {
        match self {
            Self::Mirror => [p[0].abs(), p[1], p[2]],
            Self::None => p,
        }
    }

    /// Whether `p` is on the side that is modelled; a point on the mirror itself is not.
    pub(super) fn holds(self, p: Vec3) -> bool {
        self == Self::None || p[0] > 0.0
    }

    /// Where `p` is on the other side: itself where there is none.
    pub(super) fn image(self, p: Vec3) -> Vec3 {
        match self {
            Self::Mirror => mirrored(p),
            Self::None => p,
        }
    }

    /// Of every vertex the one at its image; see [`pair_up`].
    pub(super) fn twins(self, points: &mut [Vec3]) -> Vec<u32> {
        match self {
            Self::Mirror => pair_up(points),
            Self::None => (0..points.len() as u32).collect(),
        }
    }

    /// A modelled place and its image, or the place alone where it is its own image.
    pub(super) fn both<T>(self, place: T, image: T) -> impl Iterator<Item = T> {
        [place].into_iter().chain((self == Self::Mirror).then_some(image))
    }
}

/// `p` on the left (`side` 0) or in the mirror (1).
pub(super) fn on_side(p: Vec3, side: usize) -> Vec3 {
    if side == 0 { p } else { mirrored(p) }
}

/// `p` in the mirror.
pub(super) fn mirrored([x, y, z]: Vec3) -> Vec3 {
    [-x, y, z]
}

/// Of every vertex the one at its mirror image. Both are then exactly mirror images: the right one of two is moved,
/// by rounding errors only.
pub(super) fn pair_up(points: &mut [Vec3]) -> Vec<u32> {
    let images: Vec<Vec3> = points.iter().map(|&p| mirrored(p)).collect();
    let twins = nearest_vertices(points, &images);
    for (i, &twin) in twins.iter().enumerate() {
        if points[i][0] > 0.0 {
            points[twin as usize] = mirrored(points[i]);
        }
    }
    twins
}

/// Of every bone the one of the other side, or itself.
pub(super) fn opposite_bones(skeleton: &Skeleton) -> Vec<usize> {
    let other = |name: &str| match (name.strip_suffix("_left"), name.strip_suffix("_right")) {
        (Some(stem), _) => format!("{stem}_right"),
        (_, Some(stem)) => format!("{stem}_left"),
        _ => name.to_owned(),
    };
    let index =
        |(i, name): (usize, String)| skeleton.bones.iter().position(|bone| bone.name == name).unwrap_or(i);
    skeleton.bones.iter().map(|bone| other(&bone.name)).enumerate().map(index).collect()
}
