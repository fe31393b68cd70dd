//! Small generated meshes for tests, examples and benchmarks: clean ones, and one of every defect a scan may have.

mod defects;
mod edit;

pub use defects::{
    bowtie_vertex, flipped_faces, non_manifold_edge, triangle_soup, two_components, with_degenerate_faces,
    with_duplicates, with_unreferenced_vertices,
};
pub use edit::{joined, permuted, rotation, subdivide, transformed};

use super::{Mesh, vec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Every generated shape, small and named after its function: the input of tests that must hold for any mesh.
pub fn zoo() -> Vec<(&'static str, Mesh)> {
    vec![
        ("icosphere", icosphere(3)),
        ("grid", grid(8, 5)),
        ("torus", torus(24, 12, 0.4)),
        ("bumpy_sphere", bumpy_sphere(3, 7)),
        ("open_half_sphere", open_half_sphere(3)),
        ("two_components", two_components()),
        ("non_manifold_edge", non_manifold_edge()),
        ("bowtie_vertex", bowtie_vertex()),
        ("with_degenerate_faces", with_degenerate_faces()),
        ("with_duplicates", with_duplicates()),
        ("with_unreferenced_vertices", with_unreferenced_vertices()),
        ("flipped_faces", flipped_faces()),
        ("triangle_soup", triangle_soup()),
    ]
}

/// The unit sphere: an icosahedron, each triangle split in four `subdivisions` times; `10 * 4^subdivisions + 2`
/// vertices.
pub fn icosphere(subdivisions: u32) -> Mesh {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        vertices.extend([[0.0, s, t * g], [s, t * g, 0.0], [t * g, 0.0, s]]);
    }
    project(sphere_hull(&vertices), subdivisions)
}

/// The unit square in the plane z = 0, seen from above, in `nx * ny` cells (1 or more each way) of two triangles;
/// `(nx + 1) * (ny + 1)` vertices.
pub fn grid(nx: usize, ny: usize) -> Mesh {
    let at = |i: usize, j: usize| (j * (nx + 1) + i) as u32;
    let mut vertices = Vec::with_capacity((nx + 1) * (ny + 1));
    for j in 0..=ny {
        vertices.extend((0..=nx).map(|i| [i as f64 / nx as f64, j as f64 / ny as f64, 0.0]));
    }
    let mut faces = Vec::with_capacity(2 * nx * ny);
    for j in 0..ny {
        for i in 0..nx {
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    build(vertices, faces)
}

/// A torus about the z axis: a ring of radius 1, the tube of radius `tube_radius` (above 0, below 1);
/// `n_ring * n_tube` vertices (both at least 3).
pub fn torus(n_ring: usize, n_tube: usize, tube_radius: f64) -> Mesh {
    let at = |i: usize, j: usize| ((i % n_ring) * n_tube + j % n_tube) as u32;
    let mut vertices = Vec::with_capacity(n_ring * n_tube);
    let mut faces = Vec::with_capacity(2 * n_ring * n_tube);
    for i in 0..n_ring {
        let (sin_ring, cos_ring) = (TAU * i as f64 / n_ring as f64).sin_cos();
        for j in 0..n_tube {
            let (sin_tube, cos_tube) = (TAU * j as f64 / n_tube as f64).sin_cos();
            let r = 1.0 + tube_radius * cos_tube;
            vertices.push([r * cos_ring, r * sin_ring, tube_radius * sin_tube]);
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    build(vertices, faces)
}

/// A sphere with a few smooth bumps and dents on three unequal axes: closed, of no symmetry, the spectrum without
/// multiple eigenvalues. A different `seed` is a different shape of the same connectivity.
pub fn bumpy_sphere(subdivisions: u32, seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let bumps: Vec<([f64; 3], f64, f64)> = (0..9)
        .map(|i| {
            let height = rng.random_range(0.15..0.45) * if i % 3 == 2 { -0.6 } else { 1.0 };
            (random_direction(&mut rng), height, rng.random_range(4.0..10.0))
        })
        .collect();
    map_vertices(&icosphere(subdivisions), |p| {
        let log_radius: f64 = bumps
            .iter()
            .map(|&(axis, height, width)| height * (width * (vec3::dot(axis, p) - 1.0)).exp())
            .sum();
        let [x, y, z] = vec3::scale(p, log_radius.exp());
        [x, 0.8 * y, 1.3 * z]
    })
}

/// The half of the unit sphere with z >= 0; its boundary is the equator of `4 * 2^subdivisions` vertices.
pub fn open_half_sphere(subdivisions: u32) -> Mesh {
    let vertices =
        vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    let faces = (0..4).map(|i| [0, 1 + i, 1 + (i + 1) % 4]).collect();
    project(build(vertices, faces), subdivisions)
}

/// Convex hull of the 12 vertices of a regular icosahedron, by its edge length: all triangles of mutual neighbours.
fn sphere_hull(vertices: &[[f64; 3]]) -> Mesh {
    let adjacent = |i: usize, j: usize| vec3::distance(vertices[i], vertices[j]) < 2.1;
    let mut faces = Vec::with_capacity(20);
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if adjacent(i, j) && adjacent(j, k) && adjacent(i, k) {
                    let normal =
                        vec3::cross(vec3::sub(vertices[j], vertices[i]), vec3::sub(vertices[k], vertices[i]));
                    let outward = vec3::dot(normal, vertices[i]) > 0.0;
                    faces.push(if outward { [i, j, k] } else { [i, k, j] }.map(|v| v as u32));
                }
            }
        }
    }
    build(vertices.to_vec(), faces)
}

/// Splits every triangle in four, `subdivisions` times, each time back on the unit sphere.
fn project(mut mesh: Mesh, subdivisions: u32) -> Mesh {
    let unit = |p: [f64; 3]| vec3::scale(p, 1.0 / vec3::norm(p));
    mesh = map_vertices(&mesh, unit);
    for _ in 0..subdivisions {
        mesh = map_vertices(&subdivide(&mesh), unit);
    }
    mesh
}

/// A direction uniform on the sphere (Archimedes: z and the longitude are uniform).
fn random_direction(rng: &mut ChaCha8Rng) -> [f64; 3] {
    let z: f64 = rng.random_range(-1.0..1.0);
    let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
    let r = (1.0 - z * z).sqrt();
    [r * cos, r * sin, z]
}

/// The same connectivity with every vertex moved by `f`.
fn map_vertices(mesh: &Mesh, f: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    build(mesh.vertices().iter().map(|&p| f(p)).collect(), mesh.faces().to_vec())
}

/// A mesh from generated, hence valid, parts.
fn build(vertices: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Mesh {
    Mesh::new(vertices, faces).expect("generated shapes have finite vertices and indices in range")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn sizes_are_as_documented() {
        for s in 0..4 {
            assert_eq!(icosphere(s).n_vertices(), 10 * 4usize.pow(s) + 2);
            assert_eq!(icosphere(s).n_faces(), 20 * 4usize.pow(s));
        }
        assert_eq!((grid(3, 2).n_vertices(), grid(3, 2).n_faces()), (12, 12));
        assert_eq!((torus(5, 4, 0.3).n_vertices(), torus(5, 4, 0.3).n_faces()), (20, 40));
    }

    #[test]
    fn areas_approach_the_smooth_ones_from_below() {
        for (mesh, exact) in [
            (icosphere(4), 4.0 * PI),
            (open_half_sphere(5), 2.0 * PI),
            (torus(160, 80, 0.4), 0.4 * 4.0 * PI * PI),
        ] {
            let area = mesh.area();
            assert!(area < exact && area > 0.995 * exact, "{area} against {exact}");
        }
        assert!((grid(7, 3).area() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn normals_point_outward() {
        for mesh in [icosphere(2), open_half_sphere(2), bumpy_sphere(3, 1)] {
            for f in 0..mesh.n_faces() {
                assert!(vec3::dot(mesh.face_cross(f), mesh.corners(f)[0]) > 0.0, "face {f}");
            }
        }
        assert!((0..12).all(|f| grid(3, 2).face_cross(f)[2] > 0.0));
    }

    #[test]
    fn seeds_make_different_shapes() {
        assert_eq!(bumpy_sphere(2, 3), bumpy_sphere(2, 3));
        assert_ne!(bumpy_sphere(2, 3), bumpy_sphere(2, 4));
    }
}
