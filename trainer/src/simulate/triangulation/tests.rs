//! Triangulations of small shapes.

use super::*;
use crate::simulate::random::generator;
use fmnet::mesh::shapes::{bumpy_sphere, icosphere, open_half_sphere, torus, transformed};
use fmnet::mesh::{closest_points, vertices_on_surface};

/// Without any damage, about `vertices` vertices.
fn whole(manner: Manner, vertices: usize) -> TriangulationOptions {
    TriangulationOptions {
        manners: vec![manner],
        min_vertices: vertices,
        typical_vertices: vertices,
        max_vertices: vertices,
        noisy: 0.0,
        holed: 0.0,
        cut: 0.0,
        glued: 0.0,
        stray: 0.0,
        ..TriangulationOptions::default()
    }
}

fn made(mesh: &Mesh, options: &TriangulationOptions, index: u64) -> Triangulated {
    triangulated(mesh, &vertices_on_surface(mesh), options, index).unwrap()
}

/// Distances of the points from where they were, relative to the mean edge length, ascending.
fn distances(mesh: &Mesh, made: &Triangulated) -> Vec<f64> {
    let edge = mean_edge(&made.mesh);
    let there = made.points.iter().zip(mesh.vertices()).filter_map(|(p, q)| Some(((*p)?, q)));
    let mut distances: Vec<f64> =
        there.map(|(p, &q)| vec3::distance(p.position(&made.mesh), q) / edge).collect();
    distances.sort_by(f64::total_cmp);
    distances
}

#[test]
fn every_manner_gives_a_manifold_on_the_surface() {
    for mesh in [bumpy_sphere(4, 1), torus(90, 40, 0.3)] {
        let euler = Topology::new(&mesh).euler_characteristic();
        for manner in Manner::ALL {
            let made = made(&mesh, &whole(manner, 2000), 1);
            let topology = Topology::new(&made.mesh);
            assert!(topology.is_closed() && topology.is_manifold(), "{manner:?}");
            assert!(topology.inconsistent_edges().is_empty());
            assert_eq!(topology.euler_characteristic(), euler, "{manner:?}");
            assert!((made.mesh.area() / mesh.area() - 1.0).abs() < 0.03, "{manner:?}");
            if manner != Manner::Original {
                let ratio = made.mesh.n_vertices() as f64 / 2000.0;
                assert!((0.75..1.25).contains(&ratio), "{manner:?}: {} vertices", made.mesh.n_vertices());
            }
            let distances = distances(&mesh, &made);
            assert!(distances.len() * 100 >= 99 * mesh.n_vertices(), "{manner:?}: {}", distances.len());
            let median = distances[distances.len() / 2];
            assert!(median < 0.06, "{manner:?}: {median}");
            // The vertices themselves lie on the surface, and hardly one is a vertex of the shape.
            let closest = closest_points(&mesh, made.mesh.vertices());
            let same = |(p, q): (&[f64; 3], &Option<SurfacePoint>)| {
                let weights = q.unwrap().weights;
                assert!(vec3::distance(*p, q.unwrap().position(&mesh)) < 0.1 * mesh.scale());
                weights.iter().any(|w| *w > 0.999)
            };
            let same = made.mesh.vertices().iter().zip(&closest).filter(|&pair| same(pair)).count();
            assert!(same * 20 < made.mesh.n_vertices(), "{manner:?}: {same} vertices are the shape's");
        }
    }
}

#[test]
fn quadrilaterals_split_in_any_style_are_a_manifold() {
    let mesh = bumpy_sphere(4, 2);
    for index in 0..8 {
        let made = made(&mesh, &whole(Manner::Quads, 1500), index).mesh;
        let topology = Topology::new(&made);
        assert!(topology.is_closed() && topology.is_manifold(), "{index}");
        assert_eq!(topology.euler_characteristic(), 2, "{index}");
    }
}

#[test]
fn triangulations_have_the_character_of_their_manner() {
    let mesh = torus(90, 40, 0.25);
    let areas = |manner| {
        let mut areas = made(&mesh, &whole(manner, 1500), 2).mesh.face_areas();
        areas.sort_by(f64::total_cmp);
        areas[areas.len() * 9 / 10] / areas[areas.len() / 10]
    };
    let isotropic = areas(Manner::Isotropic);
    assert!(isotropic < 2.2, "{isotropic}");
    assert!(areas(Manner::Uneven) > 2.0 * isotropic);
    let thinness = |manner| {
        let mesh = made(&mesh, &whole(manner, 1500), 2).mesh;
        let thin = |f: usize| {
            let [a, b, c] = mesh.corners(f);
            let sides = [vec3::distance(a, b), vec3::distance(b, c), vec3::distance(c, a)];
            sides.iter().map(|s| s * s).sum::<f64>() / (4.0 * 3f64.sqrt() * mesh.face_area(f))
        };
        (0..mesh.n_faces()).map(thin).sum::<f64>() / mesh.n_faces() as f64
    };
    let isotropic = thinness(Manner::Isotropic);
    assert!(isotropic < 1.12, "{isotropic}");
    assert!(thinness(Manner::Anisotropic) > 1.2);
}

#[test]
fn damage_is_what_the_options_say() {
    let mesh = bumpy_sphere(4, 1);
    let isotropic = whole(Manner::Isotropic, 1500);
    let plain = made(&mesh, &isotropic, 0);
    let noisy = made(&mesh, &TriangulationOptions { noisy: 1.0, ..isotropic.clone() }, 0);
    assert_eq!(noisy.mesh.n_vertices(), plain.mesh.n_vertices());
    let moved = distances(&mesh, &noisy);
    assert!(moved[moved.len() / 2] > 0.005 && moved[moved.len() - 1] < 0.6, "{:?}", moved.last());
    for options in [
        TriangulationOptions { holed: 1.0, ..isotropic.clone() },
        TriangulationOptions { cut: 1.0, ..isotropic.clone() },
    ] {
        let damaged = made(&mesh, &options, 0);
        let topology = Topology::new(&damaged.mesh);
        assert!(!topology.boundary_edges().is_empty() && topology.components().count == 1);
        assert!(damaged.mesh.area() < 0.999 * plain.mesh.area());
        let missing = damaged.points.iter().filter(|p| p.is_none()).count();
        assert!(missing > 0 && missing < mesh.n_vertices() / 2, "{missing}");
        // Those that are left are where they were.
        assert!(distances(&mesh, &damaged).last().unwrap() <= &0.31);
    }
    let stray = made(&mesh, &TriangulationOptions { stray: 1.0, ..isotropic }, 0);
    assert!(Topology::new(&stray.mesh).components().count > 1);
    assert!(distances(&mesh, &stray).last().unwrap() <= &0.31, "no point lies on a stray piece");
}

#[test]
fn contacts_grow_together_and_lose_their_points() {
    // A sausage bent until its ends nearly touch.
    let bent = |p: &[f64; 3]| {
        let (sin, cos) = (p[2] * (std::f64::consts::PI - 0.003)).sin_cos();
        [(1.0 + 0.25 * p[0]) * cos, (1.0 + 0.25 * p[0]) * sin, 0.25 * p[1]]
    };
    let ball = icosphere(4);
    let faces = ball.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
    let sausage = Mesh::new(ball.vertices().iter().map(bent).collect(), faces).unwrap();
    let options = TriangulationOptions { glued: 1.0, ..whole(Manner::Isotropic, 1500) };
    let made = made(&sausage, &options, 0);
    assert!(made.plan.glued);
    let topology = Topology::new(&made.mesh);
    assert!(topology.is_closed() && topology.is_manifold());
    assert_eq!(topology.euler_characteristic(), 0, "a ring");
    assert!(distances(&sausage, &made).last().unwrap() <= &0.31);
    let lost = (made.points.iter().zip(sausage.vertices())).filter(|(p, _)| p.is_none());
    for (_, q) in lost {
        assert!(q[0] < -0.9 && q[1].abs() < 0.15, "{q:?} is lost, far from the contact");
    }
}

#[test]
fn open_surfaces_keep_their_boundary() {
    let mesh = open_half_sphere(4);
    for manner in [Manner::Isotropic, Manner::Anisotropic, Manner::Quads, Manner::Quadrics, Manner::Marching]
    {
        let options = TriangulationOptions { glued: 1.0, ..whole(manner, 600) };
        let made = made(&mesh, &options, 3);
        assert!(!made.plan.glued && made.plan.manner != Manner::Marching);
        let topology = Topology::new(&made.mesh);
        assert!(topology.is_manifold() && topology.euler_characteristic() == 1, "{manner:?}");
        for &[i, j] in topology.boundary_edges().iter().map(|&e| &topology.edges()[e as usize]) {
            assert!([i, j].iter().all(|&v| made.mesh.vertices()[v as usize][2].abs() < 0.02), "{manner:?}");
        }
        assert!((made.mesh.area() / mesh.area() - 1.0).abs() < 0.03);
    }
}

#[test]
fn seed_and_number_decide_not_the_threads() {
    let mesh = bumpy_sphere(3, 1);
    for manner in Manner::ALL {
        let options = TriangulationOptions { seed: 5, ..whole(manner, 700) };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| made(&mesh, &options, 0))
        };
        let first = on(1);
        assert!(first == on(3), "{manner:?}");
        assert!(first.mesh != made(&mesh, &options, 1).mesh, "{manner:?}");
        let other = TriangulationOptions { seed: 6, ..options.clone() };
        assert!(first.mesh != made(&mesh, &other, 0).mesh, "{manner:?}");
    }
}

#[test]
fn size_and_place_do_not_matter() {
    // A power of two scales without rounding.
    let mesh = bumpy_sphere(3, 1);
    let straight = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let large = transformed(&mesh, straight, 64.0, [0.0; 3]);
    for manner in [Manner::Isotropic, Manner::Adaptive, Manner::Uneven] {
        let (small, large) = (made(&mesh, &whole(manner, 700), 0), made(&large, &whole(manner, 700), 0));
        assert!(large.mesh == transformed(&small.mesh, straight, 64.0, [0.0; 3]), "{manner:?}");
    }
}

#[test]
fn shares_and_sizes_are_drawn_as_asked_for() {
    let options = TriangulationOptions { holed: 0.5, ..TriangulationOptions::default() };
    let plans: Vec<Plan> = (0..4000).map(|i| Plan::draw(&options, i, true).0).collect();
    let share = |test: &dyn Fn(&Plan) -> bool| plans.iter().filter(|p| test(p)).count() as f64 / 4000.0;
    assert!((share(&|p| p.vertices < 5000) - 0.46).abs() < 0.05, "fewer where fingers would be lost");
    assert!(plans.iter().all(|p| (1000..=15_000).contains(&p.vertices)));
    assert!((share(&|p| p.holes > 0) - 0.5).abs() < 0.03);
    assert!((share(&|p| p.noise > 0.0) - 0.2).abs() < 0.03);
    for manner in Manner::ALL {
        assert!((share(&|p| p.manner == manner) - manner.share()).abs() < 0.03, "{manner:?}");
    }
    assert!((0..200).all(|i| Plan::draw(&options, i, false).0.manner != Manner::Marching));
    for (wrong, reason) in [
        (TriangulationOptions { manners: Vec::new(), ..options.clone() }, "option manners is []"),
        (TriangulationOptions { min_vertices: 50, ..options.clone() }, "option min-vertices is 50"),
        (TriangulationOptions { typical_vertices: 500, ..options.clone() }, "option typical-vertices is 500"),
        (TriangulationOptions { cut: 1.5, ..options.clone() }, "option cut is 1.5"),
        (TriangulationOptions { noise: -0.1, ..options.clone() }, "option noise is -0.1"),
        (TriangulationOptions { copies: 0, ..options.clone() }, "option copies is 0"),
    ] {
        let error = wrong.check().unwrap_err().to_string();
        assert!(error.starts_with(reason), "{error}");
    }
}

#[test]
fn shuffling_moves_no_point() {
    let mesh = bumpy_sphere(2, 1);
    let points: Vec<Option<SurfacePoint>> = (0..mesh.n_faces() as u32)
        .map(|face| (face % 5 > 0).then_some(SurfacePoint { face, weights: [0.5, 0.375, 0.125] }))
        .collect();
    let mut draft = Draft { mesh: mesh.clone(), points: points.clone() };
    draft.shuffle(&mut generator(1, 2));
    assert_ne!(draft.mesh, mesh);
    for (before, after) in points.iter().zip(&draft.points) {
        let positions = (before.map(|p| p.position(&mesh)), after.map(|p| p.position(&draft.mesh)));
        match positions {
            (Some(p), Some(q)) => assert!(vec3::distance(p, q) < 1e-14),
            (p, q) => assert_eq!(p, q),
        }
    }
}
