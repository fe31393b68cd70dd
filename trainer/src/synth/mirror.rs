//! Bodies that are their own mirror image at the plane x = 0: which vertices and bones are each other's.

use fmnet::mesh::nearest_vertices;

use super::math::Vec3;
use super::skeleton::Skeleton;

/// `p` in the mirror.
pub(super) fn mirrored([x, y, z]: Vec3) -> Vec3 {
    [-x, y, z]
}

/// Of every vertex the one at its mirror image. Both are then exactly mirror images: the right one of two is moved, by rounding
/// errors only.
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
