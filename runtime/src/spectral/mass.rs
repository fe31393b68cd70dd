//! The lumped mass matrix.

use crate::mesh::Mesh;

/// Least area of a vertex, relative to the mean over the vertices.
const MIN_RELATIVE_AREA: f64 = 1e-8;

/// The lumped barycentric mass `A`, the diagonal `[n]`: a third of the area of the triangles around each
/// vertex, in squared units of the mesh. It sums to the area, but for the floor below.
///
/// Always positive, so that `W phi = lambda A phi` is a definite problem: a vertex of less than 1e-8 of the
/// mean area (unreferenced, or in degenerate triangles only) gets that much.
pub fn lumped_mass(mesh: &Mesh) -> Vec<f64> {
    let mut mass = mesh.vertex_areas();
    let mean = mass.iter().sum::<f64>() / mass.len().max(1) as f64;
    let floor = (MIN_RELATIVE_AREA * mean).max(f64::MIN_POSITIVE);
    mass.iter_mut().for_each(|area| *area = area.max(floor));
    mass
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::test_shapes::zoo;

    #[test]
    fn mass_is_positive_and_sums_to_the_area() {
        for (name, mesh) in zoo() {
            let mass = lumped_mass(&mesh);
            let sum: f64 = mass.iter().sum();
            assert!((sum / mesh.area() - 1.0).abs() < 1e-7, "{name}: {sum} of {}", mesh.area());
            assert!(mass.iter().all(|&a| a > 0.0), "{name}");
        }
    }

    #[test]
    fn mesh_without_faces_has_positive_mass() {
        let mesh = Mesh::new(vec![[0.0; 3]; 3], vec![]).unwrap();
        assert!(lumped_mass(&mesh).iter().all(|&a| a > 0.0));
    }
}
