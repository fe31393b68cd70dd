use super::*;
use crate::descriptor::ShotOptions;
use crate::events::Event;
use crate::mesh::shapes::{bumpy_sphere, icosphere};
use std::sync::Mutex as StdMutex;

/// Stages that ran.
fn stages(events: &StdMutex<Vec<Event>>) -> Vec<&'static str> {
    let taken = std::mem::take(&mut *events.lock().unwrap());
    let finished = |event| match event {
        Event::Finished { stage, .. } => Some(stage),
        _ => None,
    };
    taken.into_iter().filter_map(finished).collect()
}

#[test]
fn the_area_of_a_whole_is_checked_before_any_work() {
    for area in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = ShapeOptions { whole_area: Some(area), ..ShapeOptions::default() };
        let error = Shape::new("part", &icosphere(2), &options, Context::SILENT).unwrap_err().to_string();
        assert!(error.starts_with("part: whole_area is "), "{error}");
    }
}

#[test]
fn each_quantity_is_computed_once_and_comes_back_from_the_cache_alone() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::open(folder.path()).unwrap();
    let events = StdMutex::new(Vec::new());
    let observer = |event| events.lock().unwrap().push(event);
    let context = Context { cache: Some(&cache), observer: &observer };
    let mesh = bumpy_sphere(3, 1);
    let shape = || Shape::new("sphere", &mesh, &ShapeOptions::default(), context).unwrap();
    let radius = |radius| ShotOptions { radius, ..ShotOptions::default() };

    let first = shape();
    let basis = first.unit_basis(20, context).unwrap();
    assert_eq!(stages(&events), ["repair", "eigenbasis"]);
    assert_eq!(first.unit_basis(12, context).unwrap(), basis.truncated(12));
    let gradients = first.gradients(8, context).unwrap();
    let shot = first.shot(&radius(0.2), context).unwrap();
    assert_eq!(stages(&events), ["gradients", "shot"], "a smaller k is served by the larger");

    let second = shape();
    assert_eq!(second.unit_basis(20, context).unwrap(), basis);
    assert_eq!(second.gradients(8, context).unwrap(), gradients);
    assert_eq!(second.shot(&radius(0.2), context).unwrap(), shot);
    assert_eq!(stages(&events), [""; 0], "everything was in the cache");
    second.unit_basis(25, context).unwrap();
    assert_eq!(stages(&events), ["eigenbasis"], "another k computes the eigenbasis alone");
    second.shot(&radius(0.3), context).unwrap();
    assert_eq!(stages(&events), ["shot"], "another radius computes SHOT alone");
}

#[test]
fn quantities_do_not_change_with_the_scale_of_the_mesh() {
    let mesh = bumpy_sphere(3, 2);
    let scaled: Vec<[f64; 3]> = mesh.vertices().iter().map(|v| v.map(|x| 37.0 * x)).collect();
    let scaled = Mesh::new(scaled, mesh.faces().to_vec()).unwrap();
    let shapes = [&mesh, &scaled]
        .map(|mesh| Shape::new("sphere", mesh, &ShapeOptions::default(), Context::SILENT).unwrap());
    let bases = shapes.each_ref().map(|shape| shape.unit_basis(15, Context::SILENT).unwrap());
    let gradients = shapes.each_ref().map(|shape| shape.gradients(15, Context::SILENT).unwrap());
    let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6 * (1.0 + b.abs()));
    assert!(close(&bases[0].eigenvalues, &bases[1].eigenvalues));
    assert!(close(bases[0].eigenvectors.data(), bases[1].eigenvectors.data()));
    assert!(close(gradients[0].x.data(), gradients[1].x.data()));
}

#[test]
fn the_way_back_leads_to_the_same_place() {
    let mesh = bumpy_sphere(4, 1);
    let options = ShapeOptions { decimate: Some(600), ..ShapeOptions::default() };
    let shape = Shape::new("sphere", &mesh, &options, Context::SILENT).unwrap();
    assert!(shape.is_decimated() && shape.n() <= 600);
    let work_of_input = shape.way_back.work_of_input();
    for v in 0..shape.n() as u32 {
        let input = shape.way_back.input_of_work(v);
        assert_eq!(work_of_input[input as usize], v);
        assert_eq!(shape.mesh().vertices()[v as usize], mesh.vertices()[input as usize]);
    }
}

#[test]
fn a_sparse_mesh_is_subdivided_and_its_vertices_come_first() {
    let sparse = bumpy_sphere(2, 1);
    let options = ShapeOptions { subdivide: Some(700), ..ShapeOptions::default() };
    let shape = Shape::new("sphere", &sparse, &options, Context::SILENT).unwrap();
    assert_eq!((shape.n(), shape.n_input()), (700, 162));
    assert_eq!(shape.input_mesh(), &sparse);
    assert_eq!(shape.way_back.work_of_input(), (0..162).collect::<Vec<u32>>());
    for v in 0..700u32 {
        let input = shape.way_back.input_of_work(v);
        assert!(v >= 162 || input == v);
        let distance =
            |i: usize| crate::mesh::vec3::distance(shape.mesh().vertices()[v as usize], sparse.vertices()[i]);
        let edge = 2.0 * (sparse.area() / 162.0).sqrt();
        assert!(distance(input as usize) < edge, "vertex {v}");
    }
    // Never beyond what decimation would leave.
    let options = ShapeOptions { decimate: Some(400), ..options };
    assert_eq!(Shape::new("sphere", &sparse, &options, Context::SILENT).unwrap().n(), 400);
}

#[test]
fn small_pieces_follow_the_rest_and_are_named_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::open(folder.path()).unwrap();
    let body = bumpy_sphere(3, 1);
    let at = body.vertices()[100];
    let button = crate::mesh::shapes::transformed(
        &icosphere(1),
        crate::mesh::shapes::rotation([0.0, 0.0, 1.0], 0.0),
        0.02,
        at.map(|x| 1.05 * x),
    );
    let mesh = crate::mesh::shapes::joined(&[&button, &body]);
    for _ in 0..2 {
        let events = StdMutex::new(Vec::new());
        let observer = |event| events.lock().unwrap().push(event);
        let context = Context { cache: Some(&cache), observer: &observer };
        let shape = Shape::new("coat", &mesh, &ShapeOptions::default(), context).unwrap();
        assert_eq!(shape.mesh(), &body);
        let events = events.into_inner().unwrap();
        let named = events.iter().any(|event| matches!(event, Event::Warning(text) if text.starts_with("coat: 42 of 684 vertices, of 1 small pieces, ")));
        assert!(named, "{events:?}");
        assert_eq!(shape.way_back.followers, (0..42).collect::<Vec<u32>>());
        for v in 0..42 {
            let full = shape.way_back.full_of_input[v];
            let distance = crate::mesh::vec3::distance(body.vertices()[full as usize], at);
            assert!(distance < 0.3, "vertex {v} follows one {distance} away");
        }
    }
}
