//! Arguments that do not belong together give errors, never a panic.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::io::{Attributes, Skin};
use fmnet::mesh::shapes::{bumpy_sphere, icosphere};
use fmnet::mesh::{SurfacePoint, vertices_on_surface};
use fmnet::network::{Backend, DescriptorNetwork, NetworkError};
use fmnet::pipeline::{DescriptorKind, MatchOptions, Resize, match_meshes};
use fmnet::point_map::PointMap;
use fmnet::quality::{Quality, Side, SurfaceFrame};
use fmnet::refine::{RefineError, WaveletHints, WaveletOptions, wavelet};
use fmnet::render::{
    Donors, RenderError, fit_skeleton, transfer_attributes, transfer_landmarks, transfer_values,
};
use fmnet::spectral::{EigenOptions, Laplacian, eigenbasis};
use fmnet::{Matrix, Mesh};
use std::path::Path;

fn identity(n: usize) -> PointMap {
    PointMap::new((0..n as u32).collect(), n)
}

#[test]
fn donors_of_other_meshes_are_refused() {
    let (small, large) = (icosphere(0), icosphere(1));
    let donors = Donors::of_source(&identity(42));
    let receiver = RenderError::Receiver { found: 42, n_receiver: 12 };
    let giver = RenderError::Giver { vertex: 41, n_giver: 12 };
    assert_eq!(donors.clone().interpolated(&small, &large).unwrap_err(), receiver);
    assert_eq!(donors.clone().interpolated(&large, &small).unwrap_err(), giver);
    assert_eq!(transfer_values(&Matrix::zeros(12, 1), &donors).unwrap_err(), giver);
    assert_eq!(transfer_landmarks(&[], &small, &large, &donors).unwrap_err(), giver);
    let landmark = RenderError::Giver { vertex: 42, n_giver: 42 };
    assert_eq!(transfer_landmarks(&[0, 42], &large, &large, &donors).unwrap_err(), landmark);
    assert_eq!(fit_skeleton(&mut Skin::default(), &small, &large, &donors).unwrap_err(), giver);
    let none = Attributes::default();
    assert_eq!(transfer_attributes(&small, &none, &large, &donors).unwrap_err(), giver);
    assert_eq!(transfer_attributes(&large, &none, &small, &donors).unwrap_err(), receiver);
    let few = Attributes { vertex_colors: Some(vec![[0; 4]; 3]), ..none };
    let error = transfer_attributes(&large, &few, &large, &donors).unwrap_err().to_string();
    assert!(error.contains("3 vertex colours"), "{error}");
}

#[test]
fn points_on_other_surfaces_are_refused() {
    let (small, large) = (icosphere(0), icosphere(1));
    let map = PointMap { points: Some(vertices_on_surface(&large)), ..identity(42) };
    let n_faces = small.n_faces();
    let error = Donors::of_source(&map).on_surface(&map, &small).unwrap_err();
    assert!(matches!(error, RenderError::Face { n_faces: n, .. } if n == n_faces), "{error}");
    let beyond = vec![Some(SurfacePoint { face: u32::MAX, weights: [1.0, 0.0, 0.0] }); 42];
    let map = PointMap { points: Some(beyond), ..identity(42) };
    let error = Donors::of_source(&map).on_surface(&map, &large).unwrap_err().to_string();
    assert!(error.contains("triangle 4294967295, but the target mesh has 80"), "{error}");
}

#[test]
fn a_map_tells_of_vertices_that_it_lacks() {
    assert_eq!((identity(3).get(2), identity(3).get(3)), (Some(2), None));
}

#[test]
#[cfg(feature = "tract")]
fn a_network_refuses_other_inputs() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("model.onnx");
    let network = DescriptorNetwork::load(&path, Backend::default()).unwrap();
    let expected = network.contract().inputs.len();
    let error = network.descriptors(3, &[]).unwrap_err();
    assert!(matches!(error, NetworkError::InputCount { found: 0, expected: e } if e == expected), "{error}");
    let arrays = vec![&[0.0f32][..]; expected];
    assert!(matches!(network.descriptors(3, &arrays), Err(NetworkError::InputSize { .. })));
}

#[test]
fn anchors_and_maps_back_of_other_shapes_are_refused() {
    let mesh = bumpy_sphere(2, 1);
    let laplacian = Laplacian::new(&mesh);
    let (basis, _) = eigenbasis(&laplacian, 20, &EigenOptions::default()).unwrap();
    let map = identity(mesh.n_vertices());
    let options = WaveletOptions::coarse_to_fine(20, 20);
    let other = bumpy_sphere(1, 1);
    let hints = WaveletHints { anchors: None, meshes: Some([&mesh, &other]) };
    let refused = wavelet([&map, &map], &basis, &basis, hints, &options);
    assert!(matches!(refused, Err(RefineError::Meshes { .. })), "{refused:?}");
    for shape in [(3, 1), (mesh.n_vertices(), 2)] {
        let anchors = [Matrix::zeros(mesh.n_vertices(), 1), Matrix::zeros(shape.0, shape.1)];
        let hints = WaveletHints { anchors: Some(&anchors), meshes: None };
        let refused = wavelet([&map, &map], &basis, &basis, hints, &options);
        assert!(matches!(refused, Err(RefineError::Descriptors { .. })), "{refused:?}");
    }
    let frame = SurfaceFrame::new(&mesh);
    let side = Side { mesh: &mesh, laplacian: &laplacian, basis: &basis, frame: &frame };
    assert!(Quality::measure(&map, Some(&map), side, side).is_ok());
    for other in [identity(3), PointMap::new(vec![u32::MAX - 1; map.len()], map.len())] {
        assert!(Quality::measure(&map, Some(&other), side, side).is_err());
        assert!(Quality::measure(&other, None, side, side).is_err());
    }
}

#[test]
fn options_out_of_range_are_errors() {
    let mesh = bumpy_sphere(2, 1);
    let shot = MatchOptions::default().descriptor(DescriptorKind::Shot).subdivide(Resize::Never);
    let refused = |options: MatchOptions| match_meshes(&mesh, &mesh, &options).unwrap_err().to_string();
    for options in [
        shot.clone().k(0),
        shot.clone().k(usize::MAX),
        shot.clone().k(20).shot_radius(0.0),
        shot.clone().k(20).shot_radius(f64::NAN),
        shot.clone().k(20).decimate(Resize::To(0)),
    ] {
        assert!(!refused(options).is_empty());
    }
    let empty = match_meshes(&Mesh::default(), &mesh, &shot.k(20)).unwrap_err().to_string();
    assert!(empty.contains("source"), "{empty}");
}
