//! Skin weights by diffusion over the surface, and the deformation of a template into an individual in a pose:
//! bones are lengthened and thickened by blended affine maps, then posed by dual quaternions (Kavan et al. 2008),
//! which keep the volume of twisted and bent joints.

use rayon::prelude::*;

use fmnet::mesh::vec3;

use super::adjacency::Adjacency;
use super::math::{Quat, Vec3, rigid_of};
use super::skeleton::Skeleton;

/// Bones that may move one vertex.
const INFLUENCES: usize = 6;
/// Most bones of a skeleton: a row of weights.
const ROW: usize = 32;
/// Time of the diffusion in explicit steps: weights spread over about the square root of this many edges.
const DIFFUSION_TIME: f32 = 80.0;
/// The diffusion is done in this many steps of this many stages each.
const STEPS: usize = 2;
const STAGES: usize = 9;

/// The bones that move a vertex, and their shares, which sum to 1; unused places have share 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Influences {
    pub(super) bones: [u8; INFLUENCES],
    pub(super) weights: [f64; INFLUENCES],
}

impl Influences {
    /// Bone and share of all bones that move the vertex.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.bones.iter().zip(&self.weights).filter(|(_, w)| **w > 0.0).map(|(&bone, &w)| (bone as usize, w))
    }

    /// The bone with the largest share.
    pub(super) fn strongest(&self) -> usize {
        self.bones[0] as usize
    }

    /// The largest shares of a dense row of weights, scaled to sum to 1.
    fn from_row(row: &[f32]) -> Self {
        let mut order: Vec<usize> = (0..row.len()).filter(|&bone| row[bone] > 1e-3).collect();
        order.sort_by(|&a, &b| row[b].total_cmp(&row[a]).then(a.cmp(&b)));
        order.truncate(INFLUENCES);
        let sum: f64 = order.iter().map(|&bone| f64::from(row[bone])).sum();
        let mut influences = Self::default();
        for (place, bone) in order.into_iter().enumerate() {
            influences.bones[place] = bone as u8;
            influences.weights[place] = f64::from(row[bone]) / sum;
        }
        influences
    }
}

/// Weights that start at 1 for the bone of each vertex and spread over the surface, so that they follow the skin
/// and do not leak from the arm to the trunk. How far they spread is the softness of the bone around.
///
/// The time stepping is RKL1 (Meyer, Balsara and Aslam 2012): `s` stages take a step of up to `(s^2 + s) / 2` explicit
/// ones, and weights stay between 0 and 1.
pub(super) fn diffused_weights(
    skeleton: &Skeleton,
    bone_of: &[u8],
    neighbors: &Adjacency,
) -> Vec<Influences> {
    assert!(skeleton.len() <= ROW, "a skeleton has at most {ROW} bones");
    let n = bone_of.len();
    let mut softness: Vec<f32> =
        bone_of.iter().map(|&b| skeleton.bones[b as usize].softness as f32).collect();
    for _ in 0..12 {
        softness =
            (0..n).into_par_iter().map(|i| 0.5 * (softness[i] + neighbors.mean(i, &softness))).collect();
    }
    let one_bone = |&bone: &u8| std::array::from_fn(|b| if b == bone as usize { 1.0 } else { 0.0 });
    let mut weights: Vec<[f32; ROW]> = bone_of.iter().map(one_bone).collect();
    let time = DIFFUSION_TIME / STEPS as f32;
    let stages = STAGES as f32;
    for _ in 0..STEPS {
        let mut before = weights.clone();
        for stage in 1..=STAGES {
            let j = stage as f32;
            let (mu, nu) = ((2.0 * j - 1.0) / j, (1.0 - j) / j);
            let step = mu * 2.0 * time / (stages * stages + stages);
            // `before` holds the stage before the last, and takes the next one.
            before.par_iter_mut().enumerate().for_each(|(i, row)| {
                let (last, around) = (&weights[i], neighbors.of(i));
                let take = step * softness[i] / around.len().max(1) as f32;
                let keep = mu - step * softness[i];
                for (x, y) in row.iter_mut().zip(last) {
                    *x = nu * *x + keep * y;
                }
                for &j in around {
                    for (x, y) in row.iter_mut().zip(&weights[j as usize]) {
                        *x += take * y;
                    }
                }
            });
            std::mem::swap(&mut weights, &mut before);
        }
    }
    weights.par_iter().map(|row| Influences::from_row(row)).collect()
}

/// Where joints go when every bone is scaled by `scales[bone]` along the axes of its frame.
pub(super) fn scaled_joints(skeleton: &Skeleton, scales: &[Vec3]) -> Vec<Vec3> {
    let mut joints: Vec<Vec3> = Vec::with_capacity(skeleton.len());
    for bone in &skeleton.bones {
        let joint = match bone.parent {
            Some(parent) => scale_about(skeleton, parent, joints[parent], scales[parent], bone.head),
            None => bone.head,
        };
        joints.push(joint);
    }
    joints
}

/// Scales `p` with `bone`, whose head moves to `joint`.
pub(super) fn scale_about(skeleton: &Skeleton, bone: usize, joint: Vec3, scale: Vec3, p: Vec3) -> Vec3 {
    let offset = vec3::sub(p, skeleton.bones[bone].head);
    let frame = skeleton.frame(bone);
    let mut result = joint;
    for axis in 0..3 {
        result = vec3::add(result, vec3::scale(frame[axis], scale[axis] * vec3::dot(offset, frame[axis])));
    }
    result
}

/// The skin at rest after every bone is scaled.
pub(super) fn scale_bones(
    skeleton: &Skeleton,
    influences: &[Influences],
    points: &[Vec3],
    scales: &[Vec3],
) -> Vec<Vec3> {
    let joints = scaled_joints(skeleton, scales);
    let maps: Vec<[Vec3; 4]> = (0..skeleton.len())
        .map(|bone| {
            let map = |p: Vec3| scale_about(skeleton, bone, joints[bone], scales[bone], p);
            let zero = map([0.0; 3]);
            let column =
                |axis: usize| vec3::sub(map(std::array::from_fn(|i| f64::from(u8::from(i == axis)))), zero);
            [column(0), column(1), column(2), zero]
        })
        .collect();
    let scaled = points.par_iter().zip(influences).map(|(&p, influences)| {
        let mut result = [0.0; 3];
        for (bone, weight) in influences.iter() {
            let [x, y, z, zero] = &maps[bone];
            for i in 0..3 {
                result[i] += weight * (x[i] * p[0] + y[i] * p[1] + z[i] * p[2] + zero[i]);
            }
        }
        result
    });
    scaled.collect()
}

/// The skin in a pose: each point moves by its blend of the bones' dual quaternions.
pub(super) fn pose_skin(
    skeleton: &Skeleton,
    influences: &[Influences],
    points: &[Vec3],
    joints: &[Vec3],
    rotations: &[Quat],
) -> Vec<Vec3> {
    let motions: Vec<[f64; 8]> =
        skeleton.motions(joints, rotations).iter().map(|motion| motion.dual_quaternion()).collect();
    let posed = points.par_iter().zip(influences).map(|(&p, influences)| {
        let pivot = motions[influences.strongest()];
        let mut blend = [0.0; 8];
        for (bone, weight) in influences.iter() {
            let motion = &motions[bone];
            let same_side = (0..4).map(|i| motion[i] * pivot[i]).sum::<f64>() >= 0.0;
            let share = if same_side { weight } else { -weight };
            blend.iter_mut().zip(motion).for_each(|(sum, x)| *sum += share * x);
        }
        rigid_of(blend).apply(p)
    });
    posed.collect()
}
