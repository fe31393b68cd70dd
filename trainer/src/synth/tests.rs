use std::collections::HashMap;

use super::*;
use fmnet::Mesh;
use fmnet::Mesh;
use fmnet::mesh::vec3;

fn edge_counts(mesh: &Mesh) -> HashMap<(u32, u32), usize> {
    let mut counts = HashMap::new();
    for &[a, b, c] in mesh.faces() {
        for edge in [(a, b), (b, c), (c, a)] {
            *counts.entry(edge).or_insert(0) += 1;
        }
    }
    counts
}

/// Every directed edge once and its opposite once; every vertex's faces one fan; one component of genus 0.
fn assert_closed_manifold_sphere(mesh: &Mesh, name: &str) {
    let counts = edge_counts(mesh);
    for (&(a, b), &count) in &counts {
        assert_eq!(count, 1, "{name}: edge {a} {b} is used {count} times in one direction");
        assert!(counts.contains_key(&(b, a)), "{name}: edge {a} {b} is on a border");
    }
    assert_eq!(mesh.n_vertices() + mesh.n_faces() - counts.len() / 2, 2, "{name}: Euler characteristic");
    let labels = adjacency::components(mesh.n_vertices(), mesh.faces());
    assert!(labels.iter().all(|&label| label == 0), "{name}: more than one component");
    assert_single_fans(mesh, name);
}

fn assert_single_fans(mesh: &Mesh, name: &str) {
    let mut links: Vec<HashMap<u32, u32>> = vec![HashMap::new(); mesh.n_vertices()];
    for &[a, b, c] in mesh.faces() {
        for (i, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
            links[i as usize].insert(from, to);
        }
    }
    for (i, link) in links.iter().enumerate() {
        let start = *link.keys().next().unwrap();
        let (mut at, mut steps) = (link[&start], 1);
        while at != start {
            at = link[&at];
            steps += 1;
        }
        assert_eq!(steps, link.len(), "{name}: vertex {i} joins several fans");
    }
}

fn volume(mesh: &Mesh) -> f64 {
    (0..mesh.n_faces()).map(|f| vec3::dot(mesh.corners(f)[0], mesh.face_cross(f)) / 6.0).sum()
}

#[test]
fn templates_are_spheres_of_the_right_size() {
    for species in Species::ALL {
        let template = Template::new(species);
        assert_eq!(Species::from_name(species.name()), Some(species));
        let rest = template.rest_mesh();
        assert_closed_manifold_sphere(&rest, species.name());
        assert!(volume(&rest) > 0.0, "{}: looks inwards", species.name());
        assert!((28_000..52_000).contains(&rest.n_vertices()), "{}: {}", species.name(), rest.n_vertices());
        assert!(
            (2200..4000).contains(&template.n_landmarks()),
            "{}: {}",
            species.name(),
            template.n_landmarks()
        );
    }
}

#[test]
fn individuals_are_spheres_with_good_triangles() {
    for species in [Species::Woman, Species::Ape, Species::Horse] {
        let template = Template::new(species);
        for seed in 0..6 {
            let body = template.body(seed, &SynthOptions::default()).unwrap();
            let name = format!("{} {seed}", species.name());
            assert_closed_manifold_sphere(&body.mesh, &name);
            assert!((5000..=7000).contains(&body.mesh.n_vertices()), "{name}: {}", body.mesh.n_vertices());
            assert!(volume(&body.mesh) > 0.0, "{name}: looks inwards");
            let thinnest = (0..body.mesh.n_faces()).map(|f| shape_quality(&body.mesh, f)).fold(1.0, f64::min);
            assert!(thinnest > 0.04, "{name}: a triangle has quality {thinnest}");
        }
    }
}

/// 1 for an equilateral triangle, 0 for a degenerate one.
fn shape_quality(mesh: &Mesh, face: usize) -> f64 {
    let [a, b, c] = mesh.corners(face);
    let squares: f64 = [(a, b), (b, c), (c, a)].iter().map(|&(p, q)| vec3::distance(p, q).powi(2)).sum();
    2.0 * 3f64.sqrt() * vec3::norm(mesh.face_cross(face)) / squares
}

#[test]
fn same_seed_same_bytes_whatever_the_threads() {
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = SynthOptions { holes: 2, cuts: 1, noise: 0.05, ..SynthOptions::default() };
        pool.install(|| generate(Species::Cat, 7, &options).unwrap())
    };
    let (one, three) = (make(1), make(3));
    assert_eq!(one.mesh, three.mesh);
    assert_eq!((one.landmarks, one.template_vertices), (three.landmarks, three.template_vertices));
}

#[test]
fn other_seed_other_body_and_other_order() {
    let template = Template::new(Species::Dog);
    let [a, b] = [1, 2].map(|seed| template.body(seed, &SynthOptions::default()).unwrap());
    let same = a.landmarks.iter().zip(&b.landmarks).filter(|(i, j)| i == j).count();
    assert!(same < 20, "{same} landmarks have the same index");
    // Of the edges between landmarks, few should be in both meshes, or connectivity would tell the map.
    let edges = |body: &Body| -> std::collections::HashSet<(u32, u32)> {
        let place = |i: u32| body.template_vertices[i as usize];
        edge_counts(&body.mesh).into_keys().map(|(i, j)| (place(i), place(j))).collect()
    };
    let (first, second) = (edges(&a), edges(&b));
    let share = first.intersection(&second).count() as f64 / first.len() as f64;
    assert!(share < 0.35, "{share} of the edges are the same");
}

#[test]
fn landmarks_are_the_same_template_points_and_the_ground_truth_hits_them() {
    let template = Template::new(Species::Child);
    let [a, b] = [3, 4].map(|seed| template.body(seed, &SynthOptions::default()).unwrap());
    let truth = template.ground_truth(&a, &b);
    assert_eq!(truth.len(), a.mesh.n_vertices());
    for (&i, &j) in a.landmarks.iter().zip(&b.landmarks) {
        assert_eq!(a.template_vertices[i as usize], b.template_vertices[j as usize]);
        assert_eq!(truth[i as usize], j);
    }
    let rest = template.rest_mesh();
    let scale = rest.scale();
    let place = |body: &Body, i: u32| rest.vertices()[body.template_vertices[i as usize] as usize];
    for (i, &j) in truth.iter().enumerate() {
        assert_ne!(j, UNMATCHED, "vertex {i}");
        let distance = vec3::distance(place(&a, i as u32), place(&b, j)) / scale;
        assert!(distance < 0.04, "vertex {i} is {distance} from its match");
    }
    let points = template.ground_truth_points(&a, &b);
    let exact = |&(f, weights): &(u32, [f64; 3])| {
        let corners = b.mesh.faces()[f as usize].map(|i| place(&b, i));
        let p: [f64; 3] = std::array::from_fn(|axis| (0..3).map(|c| weights[c] * corners[c][axis]).sum());
        (p, weights.iter().sum::<f64>())
    };
    for (i, point) in points.iter().enumerate() {
        let (p, sum) = exact(point.as_ref().unwrap());
        assert!((sum - 1.0).abs() < 1e-12);
        let distance = vec3::distance(p, place(&a, i as u32)) / scale;
        assert!(distance < 0.012, "vertex {i} is {distance} from its point");
    }
}

#[test]
fn bodies_keep_most_lengths_in_every_pose() {
    for species in [Species::Man, Species::Bear] {
        let template = Template::new(species);
        let rest = template.rest_mesh();
        let mut stretches = Vec::new();
        for seed in 0..6 {
            let posed = template.individual(seed);
            let area = Mesh::new(posed.clone(), rest.faces().to_vec()).unwrap().area();
            let size = (area / rest.area()).sqrt();
            for &[a, b, c] in rest.faces() {
                for (i, j) in [(a, b), (b, c), (c, a)] {
                    let (i, j) = (i as usize, j as usize);
                    let before = vec3::distance(rest.vertices()[i], rest.vertices()[j]);
                    stretches.push((vec3::distance(posed[i], posed[j]) / (size * before)).ln().abs());
                }
            }
        }
        stretches.sort_by(f64::total_cmp);
        let quantile = |q: f64| stretches[(q * (stretches.len() - 1) as f64) as usize];
        assert!(quantile(0.5) < 0.1, "{}: median stretch {}", species.name(), quantile(0.5));
        assert!(quantile(0.95) < 0.45, "{}: 95 % stretch {}", species.name(), quantile(0.95));
    }
}

#[test]
fn damage_opens_the_surface_and_marks_what_is_missing() {
    let template = Template::new(Species::Man);
    let whole = template.body(5, &SynthOptions::default()).unwrap();
    let options = SynthOptions { holes: 3, cuts: 1, noise: 0.1, ..SynthOptions::default() };
    let part = template.body(5, &options).unwrap();
    assert!(part.mesh.n_vertices() < whole.mesh.n_vertices());
    let counts = edge_counts(&part.mesh);
    assert!(counts.keys().any(|&(a, b)| !counts.contains_key(&(b, a))), "no border");
    let missing = part.landmarks.iter().filter(|&&i| i == UNMATCHED).count();
    assert!(missing > 10, "only {missing} landmarks are missing");
    for &i in part.landmarks.iter().filter(|&&i| i != UNMATCHED) {
        assert!((i as usize) < part.mesh.n_vertices());
    }
    let onto_part = template.ground_truth(&whole, &part);
    assert!(onto_part.contains(&UNMATCHED));
    assert!(!template.ground_truth(&part, &whole).contains(&UNMATCHED));
}

#[test]
fn options_out_of_range_are_named() {
    let options = SynthOptions { hole_radius: 0.0, ..SynthOptions::default() };
    let message = generate(Species::Man, 0, &options).unwrap_err().to_string();
    assert!(message.contains("hole_radius"), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let options = DatasetOptions { seed: 1 << 16, ..DatasetOptions::default() };
    let message = write_dataset(folder.path(), &options, &|_, _| {}).unwrap_err().to_string();
    assert!(message.contains("seed") && message.contains("0 to 65535"), "{message}");
}

#[test]
fn dataset_is_complete_and_its_splits_are_disjoint() {
    let folder = tempfile::tempdir().unwrap();
    let species = vec![Species::Man, Species::Slender];
    let options = DatasetOptions { species, per_species: 3, validation: 0.3, ..DatasetOptions::default() };
    let count = std::sync::atomic::AtomicUsize::new(0);
    write_dataset(folder.path(), &options, &|_, total| {
        assert_eq!(total, 6);
        count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    })
    .unwrap();
    assert_eq!(count.into_inner(), 6);
    let manifest = std::fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    assert_eq!(manifest.matches("[[shape]]").count(), 6);
    for (split, times) in [("train", 2), ("validation", 1), ("test", 3)] {
        assert_eq!(manifest.matches(&format!("split = \"{split}\"")).count(), times, "{split}");
    }
    let vts = std::fs::read_to_string(folder.path().join("man/man_000.vts")).unwrap();
    let template = Template::new(Species::Man);
    assert_eq!(vts.lines().count(), template.n_landmarks());
    assert!(folder.path().join("slender/slender_002.ply").exists());
}
