//! A skeleton that comes with weights over a map, brought to the place and size of the mesh that receives them.

use super::{Donors, RenderError};
use crate::Mesh;
use crate::io::Skin;
use crate::mesh::vec3;
use faer::{Mat, MatRef};

/// Sizes within this factor are the same unit of length.
const SAME_SIZE: f64 = 1.25;
/// Turned by less, in radians, is the same orientation: poses differ by as much.
const SAME_TURN: f64 = 0.35;
/// As far apart, in diagonals of the receiver, is the same place.
const SAME_PLACE: f64 = 0.5;

/// Moves, turns and scales the skeleton as the receiver's vertices lie to those that they take from, where the two
/// meshes are in another unit, place or orientation; says what was done. Where they are not, the skeleton stays as it
/// is.
///
/// The similarity is that of least squares (Umeyama 1991), its scale the ratio of the spreads, which does not shrink
/// where the map is poor.
///
/// # Errors
/// If the donors are not those of both meshes.
pub fn fit_skeleton(
    skin: &mut Skin,
    giver: &Mesh,
    receiver: &Mesh,
    donors: &Donors,
) -> Result<Option<String>, RenderError> {
    donors.check(receiver, giver)?;
    Ok(fitted(skin, giver, receiver, donors))
}

fn fitted(skin: &mut Skin, giver: &Mesh, receiver: &Mesh, donors: &Donors) -> Option<String> {
    let pairs = donors.nearest_vertices().enumerate();
    let pairs: Vec<([f64; 3], [f64; 3])> =
        pairs.filter_map(|(r, g)| Some((giver.vertices()[g?], receiver.vertices()[r]))).collect();
    let from = Spread::of(pairs.iter().map(|pair| pair.0));
    let to = Spread::of(pairs.iter().map(|pair| pair.1));
    if pairs.len() < 3 || !(from.size > 0.0 && to.size > 0.0) {
        return None;
    }
    let scale = to.size / from.size;
    let turn = rotation(&pairs, from.middle, to.middle)?;
    let angle = ((turn[0][0] + turn[1][1] + turn[2][2] - 1.0) / 2.0).clamp(-1.0, 1.0).acos();
    let offset = vec3::distance(from.middle, to.middle);
    let same_size = (1.0 / SAME_SIZE..SAME_SIZE).contains(&scale);
    if same_size && angle < SAME_TURN && offset < SAME_PLACE * receiver.diagonal() {
        return None;
    }
    let rotated = |p: [f64; 3]| [0, 1, 2].map(|row| (0..3).map(|k| turn[k][row] * p[k]).sum::<f64>());
    let shift = vec3::sub(to.middle, vec3::scale(rotated(from.middle), scale));
    let moved = |column: [f64; 4]| {
        let [x, y, z] = vec3::scale(rotated([column[0], column[1], column[2]]), scale);
        [x + column[3] * shift[0], y + column[3] * shift[1], z + column[3] * shift[2], column[3]]
    };
    skin.joints.iter_mut().for_each(|joint| joint.frame = joint.frame.map(moved));
    Some(format!("scaled by {scale:.4}, turned by {:.1} degrees, moved by {offset:.4}", angle.to_degrees()))
}

/// The middle of points and their root mean square distance from it.
struct Spread {
    middle: [f64; 3],
    size: f64,
}

impl Spread {
    fn of(points: impl Iterator<Item = [f64; 3]> + Clone) -> Self {
        let n = points.clone().count().max(1) as f64;
        let middle = vec3::scale(points.clone().fold([0.0; 3], vec3::add), 1.0 / n);
        let size = (points.map(|p| vec3::distance(p, middle).powi(2)).sum::<f64>() / n).sqrt();
        Self { middle, size }
    }
}

/// The rotation, by columns, that brings the first of each pair closest to the second.
fn rotation(pairs: &[([f64; 3], [f64; 3])], from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let mut covariance = Mat::<f64>::zeros(3, 3);
    for (p, q) in pairs {
        let (p, q) = (vec3::sub(*p, from), vec3::sub(*q, to));
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            covariance[(row, column)] += q[row] * p[column];
        }
    }
    let svd = covariance.svd().ok()?;
    let (u, v) = (svd.U(), svd.V());
    // A mirror image is no rotation: the least direction is turned round.
    let determinant = |m: MatRef<'_, f64>| {
        let column = |c: usize| [m[(0, c)], m[(1, c)], m[(2, c)]];
        vec3::dot(column(0), vec3::cross(column(1), column(2)))
    };
    let sign = (determinant(u) * determinant(v)).signum();
    let entry = |row: usize, column: usize| {
        (0..3).map(|k| u[(row, k)] * v[(column, k)] * if k == 2 { sign } else { 1.0 }).sum::<f64>()
    };
    Some([0, 1, 2].map(|column| [0, 1, 2].map(|row| entry(row, column))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Joint;
    use crate::mesh::shapes::{bumpy_sphere, transformed};
    use crate::point_map::PointMap;

    const TURN: [[f64; 3]; 3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];

    fn skin() -> Skin {
        let frame = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.2, 0.3, 0.4, 1.0]];
        Skin { joints: vec![Joint { name: String::new(), parent: None, frame }], ..Skin::default() }
    }

    #[test]
    fn a_skeleton_follows_the_mesh_into_another_unit_place_and_orientation() {
        let giver = bumpy_sphere(3, 1);
        let receiver = transformed(&giver, TURN, 100.0, [1000.0, 0.0, 0.0]);
        let n = giver.n_vertices();
        let donors = Donors::of_source(&PointMap::new((0..n as u32).collect(), n));
        let mut fitted = skin();
        let said = fit_skeleton(&mut fitted, &giver, &receiver, &donors).unwrap().unwrap();
        assert!(said.contains("scaled by 100.0") && said.contains("turned by 90.0 degrees"), "{said}");
        let joint = Mesh::new(vec![[0.2, 0.3, 0.4]], Vec::new()).unwrap();
        let expected = transformed(&joint, TURN, 100.0, [1000.0, 0.0, 0.0]).vertices()[0];
        let found = fitted.joints[0].frame[3];
        assert!((0..3).all(|i| (found[i] - expected[i]).abs() < 1e-6), "{found:?} {expected:?}");
    }

    #[test]
    fn a_skeleton_of_the_same_place_stays() {
        let giver = bumpy_sphere(3, 1);
        let receiver =
            transformed(&giver, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1.1, [0.1, 0.0, 0.0]);
        let n = giver.n_vertices();
        let donors = Donors::of_source(&PointMap::new((0..n as u32).collect(), n));
        let mut same = skin();
        assert_eq!(fit_skeleton(&mut same, &giver, &receiver, &donors), Ok(None));
        assert_eq!(same, skin());
    }
}
