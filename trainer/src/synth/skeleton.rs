//! Bones, their places at rest, and the motion that a pose gives each of them.

use fmnet::mesh::vec3;

use super::math::{Quat, Rigid, Vec3, perpendicular, unit};
use super::mirror::on_side;

/// A bone: it turns about its `head` and carries its children along.
#[derive(Clone, Debug)]
pub(super) struct Bone {
    pub(super) name: String,
    /// Index of the bone that carries this one; always smaller than its own. `None` for the root.
    pub(super) parent: Option<usize>,
    pub(super) head: Vec3,
    pub(super) tail: Vec3,
    /// How far skin weights spread across its joint, in `[0, 1]`; 1 for the trunk.
    pub(super) softness: f64,
}

/// Bones at rest, parents before children.
#[derive(Clone, Debug, Default)]
pub(super) struct Skeleton {
    pub(super) bones: Vec<Bone>,
}

impl Skeleton {
    /// Appends a bone and returns its index.
    pub(super) fn add(
        &mut self,
        name: &str,
        parent: Option<usize>,
        head: Vec3,
        tail: Vec3,
        softness: f64,
    ) -> usize {
        self.bones.push(Bone { name: name.to_owned(), parent, head, tail, softness });
        self.bones.len() - 1
    }

    /// Appends bones: of each its name, parent, head, tail and softness.
    pub(super) fn add_all(&mut self, bones: &[(&str, Option<usize>, Vec3, Vec3, f64)]) {
        for &(name, parent, head, tail, softness) in bones {
            self.add(name, parent, head, tail, softness);
        }
    }

    /// Appends the given bones of the left side, then their mirror images: `NAME_left`, `NAME_right`. A parent is a
    /// bone that is already there, or one of the same side.
    pub(super) fn add_pairs(&mut self, bones: &[(&str, usize, Vec3, Vec3, f64)]) {
        let first = self.len();
        for (side, side_name) in ["left", "right"].into_iter().enumerate() {
            for &(name, parent, head, tail, softness) in bones {
                let parent = if parent < first { parent } else { parent + side * bones.len() };
                let name = format!("{name}_{side_name}");
                self.add(&name, Some(parent), on_side(head, side), on_side(tail, side), softness);
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        self.bones.len()
    }

    /// Of `candidates`, the bone whose segment is nearest to `p`.
    pub(super) fn nearest(&self, candidates: &[usize], p: Vec3) -> usize {
        let distance = |&bone: &usize| segment_distance(p, self.bones[bone].head, self.bones[bone].tail);
        let nearest = candidates.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        *nearest.expect("a part names at least one bone")
    }

    /// Bones of arms and legs, without those of the shoulder girdle.
    pub(super) fn limbs(&self) -> Vec<usize> {
        let of_limb = |bone: &Bone| {
            let sided = bone.name.ends_with("_left") || bone.name.ends_with("_right");
            sided && !bone.name.starts_with("clavicle") && !bone.name.starts_with("blade")
        };
        (0..self.len()).filter(|&bone| of_limb(&self.bones[bone])).collect()
    }

    /// Whether `bone` is `ancestor` or is carried by it.
    pub(super) fn descends(&self, bone: usize, ancestor: usize) -> bool {
        let mut current = Some(bone);
        while let Some(b) = current {
            if b == ancestor {
                return true;
            }
            current = self.bones[b].parent;
        }
        false
    }

    /// Orthonormal frame of a bone: along it, then sideways or upwards, then the third.
    pub(super) fn frame(&self, bone: usize) -> [Vec3; 3] {
        let along = unit(vec3::sub(self.bones[bone].tail, self.bones[bone].head));
        let hint = if along[2].abs() < 0.75 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
        let depth = perpendicular(along, hint);
        [along, vec3::cross(depth, along), depth]
    }

    /// Motion of every bone when its local rotation is `rotations[bone]`, in axes parallel to the world's at rest,
    /// about `joints[bone]`, where the bone's head is before the pose.
    pub(super) fn motions(&self, joints: &[Vec3], rotations: &[Quat]) -> Vec<Rigid> {
        let mut motions: Vec<Rigid> = Vec::with_capacity(self.len());
        for (bone, (&joint, &local)) in joints.iter().zip(rotations).enumerate() {
            let (rotation, place) = match self.bones[bone].parent {
                Some(parent) => (motions[parent].rotation.then_after(local), motions[parent].apply(joint)),
                None => (local, joint),
            };
            motions.push(Rigid { rotation, translation: vec3::sub(place, rotation.rotate(joint)) });
        }
        motions
    }
}

fn segment_distance(p: Vec3, a: Vec3, b: Vec3) -> f64 {
    let (ab, ap) = (vec3::sub(b, a), vec3::sub(p, a));
    let t = (vec3::dot(ap, ab) / vec3::dot(ab, ab).max(1e-300)).clamp(0.0, 1.0);
    vec3::norm(vec3::sub(ap, vec3::scale(ab, t)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn child_follows_its_parent() {
        let mut skeleton = Skeleton::default();
        let upper = skeleton.add("upper", None, [0.0; 3], [1.0, 0.0, 0.0], 1.0);
        let lower = skeleton.add("lower", Some(upper), [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], 1.0);
        let joints = [[0.0; 3], [1.0, 0.0, 0.0]];
        let motions = skeleton.motions(&joints, &[Quat::z(90.0), Quat::z(90.0)]);
        assert!(vec3::distance(motions[lower].apply([2.0, 0.0, 0.0]), [-1.0, 1.0, 0.0]) < 1e-15);
        assert!(skeleton.descends(lower, upper) && !skeleton.descends(upper, lower));
        assert_eq!(skeleton.nearest(&[upper, lower], [1.7, 0.3, 0.0]), lower);
    }
}
