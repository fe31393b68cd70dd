//! Identities that hold for every geodesic distance, over a zoo of meshes, for both the exact and the fast one.

use super::{GeodesicOptions, GeodesicSolver, exact, zoo};
use crate::Mesh;
use crate::mesh::shapes::bumpy_sphere;
use crate::mesh::vec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn solver(mesh: &Mesh) -> GeodesicSolver {
    GeodesicSolver::new(mesh, &GeodesicOptions::default())
}

/// A closed or open surface with convex, saddle and flat vertices: a mesh whose vertices are shaken.
fn shaken(mesh: &Mesh, amplitude: f64) -> Mesh {
    let shake =
        |i: usize, j: usize| amplitude * ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43758.5).sin();
    let vertices = mesh.vertices().iter().enumerate();
    let vertices = vertices.map(|(i, p)| [p[0] + shake(i, 0), p[1] + shake(i, 1), p[2] + shake(i, 2)]);
    Mesh::new(vertices.collect(), mesh.faces().to_vec()).unwrap()
}

fn faces_where(mesh: &Mesh, keep: impl Fn([f64; 3]) -> bool) -> Mesh {
    let centre =
        |f: usize| mesh.corners(f).into_iter().fold([0.0; 3], |s, p| vec3::add(s, vec3::scale(p, 1.0 / 3.0)));
    let faces = (0..mesh.n_faces()).filter(|&f| keep(centre(f))).map(|f| mesh.faces()[f]).collect();
    Mesh::new(mesh.vertices().to_vec(), faces).unwrap()
}

#[track_caller]
fn assert_close(found: f64, expected: f64, relative: f64) {
    assert!(
        (found - expected).abs() <= relative * expected.abs().max(1e-12),
        "found {found}, expected {expected}"
    );
}

#[test]
fn plane_is_euclidean() {
    let grid = zoo::grid(23, 17);
    let fast = solver(&grid);
    for source in [0, 200, 23 * 17 - 1] {
        let (exact, fast) = (exact(&grid, source), fast.from_source(source));
        let (mut total, mut count) = (0.0, 0);
        for (v, p) in grid.vertices().iter().enumerate() {
            let expected = vec3::distance(*p, grid.vertices()[source as usize]);
            assert_close(exact[v], expected, 1e-12);
            assert_close(f64::from(fast[v]), expected, if expected < 4.0 { 1e-6 } else { 1e-2 });
            total += (f64::from(fast[v]) - expected) / expected.max(1.0);
            count += 1;
        }
        assert!(total / f64::from(count) < 5e-4, "mean error {}", total / f64::from(count));
    }
}

#[test]
fn opposite_corners_of_the_cube_are_root_five_apart() {
    for n in [1, 2, 5] {
        let cube = zoo::cube(n);
        let last = cube.n_vertices() - 1;
        assert_close(exact(&cube, 0)[last], 5f64.sqrt(), 1e-12);
        assert_close(f64::from(solver(&cube).from_source(0)[last]), 5f64.sqrt(), 1e-2);
    }
}

#[test]
fn sphere_has_great_circles() {
    let sphere = zoo::sphere(5);
    let (exact, fast) = (exact(&sphere, 0), solver(&sphere).from_source(0));
    for (v, p) in sphere.vertices().iter().enumerate().skip(1) {
        let angle = vec3::dot(*p, sphere.vertices()[0]).clamp(-1.0, 1.0).acos();
        assert_close(exact[v], angle, 2e-3);
        assert_close(f64::from(fast[v]), exact[v], 5e-3);
    }
}

#[test]
fn path_bends_around_a_notch_of_the_boundary() {
    let notched = faces_where(&zoo::grid(11, 11), |c| !(c[0] > 5.0 && c[1] > 5.0));
    let at = |x: usize, y: usize| 11 * y + x;
    let expected = 5.0 + 26f64.sqrt();
    assert_close(exact(&notched, at(5, 10) as u32)[at(10, 4)], expected, 1e-12);
    assert_close(f64::from(solver(&notched).from_source(at(5, 10) as u32)[at(10, 4)]), expected, 2e-3);
}

#[test]
fn shaken_meshes_are_symmetric_and_keep_the_triangle_inequality() {
    for mesh in [shaken(&zoo::sphere(3), 0.03), shaken(&zoo::grid(12, 12), 0.2), shaken(&zoo::cube(5), 0.04)]
    {
        let sample: Vec<u32> = (0..mesh.n_vertices() as u32).step_by(11).collect();
        let all: Vec<Vec<f64>> = sample.iter().map(|&s| exact(&mesh, s)).collect();
        let fast = solver(&mesh).distances_between(&sample);
        for (i, &a) in sample.iter().enumerate() {
            for (j, &b) in sample.iter().enumerate() {
                assert_close(all[i][b as usize], all[j][a as usize], 1e-9);
                assert_close(f64::from(fast[(i, j)]), all[i][b as usize], 2e-2);
                assert!(f64::from(fast[(i, j)]) >= all[i][b as usize] * (1.0 - 1e-6));
                assert_eq!(fast[(i, j)], fast[(j, i)]);
                for v in 0..mesh.n_vertices() {
                    assert!(all[i][v] <= (all[i][b as usize] + all[j][v]) * (1.0 + 1e-9));
                }
            }
        }
    }
}

#[test]
fn enough_neighbours_make_the_solver_exact() {
    let mesh = shaken(&zoo::sphere(2), 0.1);
    let options = GeodesicOptions { n_neighbors: mesh.n_vertices(), ..Default::default() };
    let solver = GeodesicSolver::new(&mesh, &options);
    for source in 0..mesh.n_vertices() as u32 {
        for (fast, exact) in solver.from_source(source).into_iter().zip(exact(&mesh, source)) {
            assert_close(f64::from(fast), exact, 1e-6);
        }
    }
}

#[test]
fn other_component_is_infinitely_far() {
    let apart = faces_where(&zoo::grid(9, 3), |c| c[0] < 3.0 || c[0] > 5.0);
    let (exact, fast) = (exact(&apart, 0), solver(&apart).from_source(0));
    // Vertex 4 belongs to no face.
    for v in [4, 8] {
        assert!(exact[v].is_infinite() && fast[v].is_infinite());
    }
    assert_eq!((exact[3], fast[3]), (3.0, 3.0));
    assert!(solver(&apart).distances_between(&[0, 8])[(0, 1)].is_infinite());
    assert_eq!(solver(&apart).from_source(4)[4], 0.0);
}

#[test]
fn pages_of_a_book_are_joined_at_the_spine() {
    let book = zoo::book();
    for page in [3, 4] {
        assert_close(exact(&book, 2)[page], 2.0, 1e-12);
        assert_close(f64::from(solver(&book).from_source(2)[page]), 2.0, 1e-6);
    }
}

#[test]
fn surfaces_that_lie_on_each_other_take_bounded_time() {
    // Every square by both diagonals, so that four faces meet at each of its sides; and every face thrice.
    let n = 24;
    let grid = zoo::grid(n, n);
    let side = grid.n_vertices().isqrt() as u32;
    let squares = (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| y * side + x));
    let other = squares.flat_map(|v| {
        [
            [v, v + 1, v + side],
            [v + 1, v + side + 1, v + side],
            [v, v + 1, v + side + 1],
            [v, v + side + 1, v + side],
        ]
    });
    let crossed = Mesh::new(grid.vertices().to_vec(), other.collect()).unwrap();
    let thrice = Mesh::new(grid.vertices().to_vec(), [grid.faces(); 3].concat()).unwrap();
    // Along sides and diagonals no way is longer than this, where the work is cut short.
    for (mesh, most) in [(&crossed, 1.0824), (&thrice, 1.0 + 1e-9)] {
        for (v, distance) in exact(mesh, 0).into_iter().enumerate() {
            let straight = vec3::distance(mesh.vertices()[v], mesh.vertices()[0]);
            assert!(
                (straight * (1.0 - 1e-9)..=straight * most).contains(&distance),
                "{v}: {distance} for {straight}"
            );
        }
    }
}

#[test]
fn degenerate_meshes_do_no_harm() {
    let empty = Mesh::default();
    assert_eq!(solver(&empty).all_pairs().rows(), 0);
    let grid = zoo::grid(4, 4);
    let mut vertices = grid.vertices().to_vec();
    vertices.push(vertices[5]);
    let mut faces = grid.faces().to_vec();
    // A face without area, one that names a vertex twice, a doubled one, and one with an edge of no length.
    faces.extend([[0, 1, 2], [15, 15, 16], grid.faces()[3], [5, 16, 6]]);
    let mesh = Mesh::new(vertices, faces).unwrap();
    let (exact, fast) = (exact(&mesh, 0), solver(&mesh).from_source(0));
    for (v, p) in mesh.vertices().iter().enumerate() {
        let expected = vec3::distance(*p, mesh.vertices()[0]);
        assert_close(exact[v], expected, 1e-9);
        assert_close(f64::from(fast[v]), expected, 1e-5);
    }
}

#[test]
fn all_queries_agree_whatever_the_threads() {
    let mesh = shaken(&zoo::sphere(3), 0.03);
    let fast = solver(&mesh);
    let n = mesh.n_vertices() as u32;
    let from_7 = fast.from_source(7);
    let mut into = vec![0.0; n as usize];
    fast.from_source_into(7, &mut into);
    assert_eq!(from_7, into);
    assert_eq!(fast.from_sources(&[3, 7]).row(1), from_7);
    let pairs: Vec<(u32, u32)> = (0..n).map(|v| (v, 7)).chain([(7, 7), (1, 0)]).collect();
    assert_eq!(fast.pair_distances(&pairs)[..n as usize], from_7);
    assert_eq!(fast.to_targets(7, &[50, 2, 50]), [50, 2, 50].map(|v: usize| from_7[v]));
    let nearest = fast.from_nearest(&[7, 40]);
    let from_40 = fast.from_source(40);
    // From the nearer of two sources, paths arrive from elsewhere and so may be pruned differently.
    for (v, distance) in nearest.into_iter().enumerate() {
        assert_close(f64::from(distance), f64::from(from_7[v].min(from_40[v])), 1e-3);
    }
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let three_threads = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let alone = one_thread.install(|| solver(&mesh).all_pairs());
    assert_eq!(alone, three_threads.install(|| solver(&mesh).all_pairs()));
}

#[test]
fn distances_scale_with_the_mesh() {
    let mesh = shaken(&zoo::sphere(3), 0.03);
    for factor in [1e-4, 1e5] {
        let scaled = mesh.vertices().iter().map(|&p| vec3::scale(p, factor)).collect();
        let scaled = Mesh::new(scaled, mesh.faces().to_vec()).unwrap();
        for (big, small) in solver(&scaled).from_source(3).into_iter().zip(solver(&mesh).from_source(3)) {
            assert_close(f64::from(big), f64::from(small) * factor, 1e-5);
        }
    }
}

/// Every face twice: each crossing could go on in three ways, and the number of windows would grow without bound.
#[test]
fn faces_on_top_of_each_other_end_in_time() {
    let mesh = crate::mesh::shapes::bumpy_sphere(3, 1);
    let doubled = Mesh::new(mesh.vertices().to_vec(), [mesh.faces(), mesh.faces()].concat()).unwrap();
    let options = GeodesicOptions::default();
    let single = GeodesicSolver::new(&mesh, &options).from_source(5);
    let found = GeodesicSolver::new(&doubled, &options).from_source(5);
    let worst = single.iter().zip(&found).map(|(a, b)| (a - b).abs() / a.max(0.1)).fold(0.0, f32::max);
    assert!(worst < 0.05, "distances differ by {worst}");
}

#[test]
fn every_vertex_of_a_rough_surface_is_reached() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let smooth = bumpy_sphere(4, 2);
    let rough = |size: f64, rng: &mut ChaCha8Rng| {
        let moved = smooth.vertices().iter().map(|p| p.map(|x| x + size * rng.random_range(-1.0..1.0)));
        Mesh::new(moved.collect(), smooth.faces().to_vec()).unwrap()
    };
    for size in [0.005, 0.02, 0.05] {
        let mesh = rough(size, &mut rng);
        let solver =
            GeodesicSolver::new(&mesh, &GeodesicOptions { n_neighbors: 40, ..GeodesicOptions::default() });
        for source in 0..20 {
            let distances = solver.from_source(source * 100);
            assert!(distances.iter().all(|d| d.is_finite()), "{size}, from {}", source * 100);
        }
    }
}
