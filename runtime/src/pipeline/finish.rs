//! From a map of the working meshes to one of the inputs.

use super::Upscaling;
use super::pair::Pair;
use crate::error::Error;
use crate::mesh::{Mesh, SurfacePoint, vec3};
use crate::point_map::{EmbeddedSurface, Embedding, PointMap};
use crate::shape::{Shape, WayBack};
use crate::upscale::{
    AdmmInfo, AdmmOptions, delta_coefficients, full_point_map, l21_functional_map,
    least_squares_functional_map,
};
use rayon::prelude::*;

/// Eigenfunctions of the full meshes in upscaling.
const UPSCALE_K: usize = 100;

/// The map of the inputs' vertices by way of the surface: every vertex of the source has a place on the working mesh,
/// that place a row in the embedding, the row a nearest point on the target's working mesh, and that point a place on
/// the target's input.
///
/// `map` is the map of the working meshes, `doubt`, `[n]`, how doubtful it is at each vertex of the source's.
pub(super) fn on_inputs(
    source: &Shape,
    target: &Shape,
    map: &PointMap,
    embedding: &Embedding<f32>,
    doubt: &[f32],
) -> PointMap {
    let surface = EmbeddedSurface::new(target.mesh(), &embedding.target);
    let places = source.full_on_work();
    let projected: Vec<Option<SurfacePoint>> = places
        .par_iter()
        .map(|place| {
            let place = (*place)?;
            let starts = starts(&place, source.mesh(), map);
            let row = place.interpolate(source.mesh(), &embedding.source);
            Some(surface.project(&row, &starts)?.point)
        })
        .collect();
    let points = target.on_input(&projected);
    let input = target.input_mesh();
    let vertex_of = |full: usize| -> u32 {
        // Between meshes that are not decimated, the nearest vertex itself.
        if !source.is_decimated() && !target.is_decimated() {
            return map.get(full).map_or(PointMap::UNMATCHED, |y| target.way_back.input_of_work(y));
        }
        points[full].map_or(PointMap::UNMATCHED, |point| nearest_corner(&point, input))
    };
    let n_full = places.len();
    let targets: Vec<u32> = (0..n_full).map(vertex_of).collect();
    let confidence = confidence(&places, source.mesh(), doubt);
    in_input_vertices(source, target, &targets, &confidence, Some(&points))
}

/// Vertices of the target to look from: the images of the corners that a place is near to.
fn starts(place: &SurfacePoint, mesh: &Mesh, map: &PointMap) -> Vec<u32> {
    let corners = mesh.faces()[place.face as usize];
    let near = |(&v, &w): (&u32, &f64)| if w > 0.0 { map.get(v as usize) } else { None };
    corners.iter().zip(&place.weights).filter_map(near).collect()
}

/// What the doubt of a mesh's vertices leaves at places on it; 0 at those that are nowhere.
fn confidence(places: &[Option<SurfacePoint>], mesh: &Mesh, doubt: &[f32]) -> Vec<f32> {
    let left = |place: &Option<SurfacePoint>| {
        let Some(place) = place else { return 0.0 };
        let corners = mesh.faces()[place.face as usize];
        let doubt: f64 =
            corners.iter().zip(place.weights).map(|(&v, w)| w * f64::from(doubt[v as usize])).sum();
        (1.0 - doubt).clamp(0.0, 1.0) as f32
    };
    places.iter().map(left).collect()
}

/// The corner of a point's triangle that is nearest to the point, the first of several.
fn nearest_corner(point: &SurfacePoint, mesh: &Mesh) -> u32 {
    let position = point.position(mesh);
    let distance = |v: u32| vec3::distance(mesh.vertices()[v as usize], position);
    let [a, b, c] = mesh.faces()[point.face as usize];
    [b, c].into_iter().fold(a, |best, v| if distance(v) < distance(best) { v } else { best })
}

/// Takes a map of the full repaired source, whose targets are vertices of the input, to the vertices of the source's
/// input.
fn in_input_vertices(
    source: &Shape,
    target: &Shape,
    targets: &[u32],
    confidence: &[f32],
    points: Option<&[Option<SurfacePoint>]>,
) -> PointMap {
    let full: Vec<Option<usize>> =
        source.way_back.full_of_input.iter().map(|&v| (v != WayBack::NONE).then_some(v as usize)).collect();
    PointMap {
        targets: full.iter().map(|v| v.map_or(PointMap::UNMATCHED, |v| targets[v])).collect(),
        confidence: Some(full.iter().map(|v| v.map_or(0.0, |v| confidence[v])).collect()),
        points: points.map(|points| full.iter().map(|v| v.and_then(|v| points[v])).collect()),
        followers: source.way_back.followers.clone(),
        n_target: target.n_input(),
    }
}

/// The map of the inputs' vertices by a functional map of the full meshes that agrees with the map of the working
/// ones (the paper's upscaling); where nothing was decimated, the map itself.
pub(super) fn full_by_functional_map(
    pair: &Pair,
    map: &PointMap,
    upscaling: Upscaling,
    doubt: &[f32],
) -> Result<(PointMap, Option<AdmmInfo>), Error> {
    let (source, target) = (&pair.source.shape, &pair.target.shape);
    if !source.is_decimated() && !target.is_decimated() {
        let confidence: Vec<f32> = doubt.iter().map(|doubt| 1.0 - doubt).collect();
        let input = |y: Option<u32>| y.map_or(PointMap::UNMATCHED, |y| target.way_back.input_of_work(y));
        let targets: Vec<u32> = map.iter().map(input).collect();
        return Ok((in_input_vertices(source, target, &targets, &confidence, None), None));
    }
    let full_source = source.full_basis(UPSCALE_K, pair.context)?;
    let full_target = target.full_basis(UPSCALE_K, pair.context)?;
    let full = |i: usize| {
        let target_vertex = target.way_back.full_of_work(map.get(i)?);
        Some((source.way_back.full_of_work(i as u32), target_vertex))
    };
    let matches: Vec<(u32, u32)> = (0..map.len()).filter_map(full).collect();
    let (phi, psi) = delta_coefficients(&full_source, &full_target, &matches);
    let (c, info) = pair.timed("upscale", || match upscaling {
        Upscaling::LeastSquares => least_squares_functional_map(&phi, &psi).map(|c| (c, None)),
        Upscaling::L21 | Upscaling::Surface => {
            l21_functional_map(&phi, &psi, &AdmmOptions::default()).map(|(c, info)| (c, Some(info)))
        }
    })?;
    let map = pair.timed("full point map", || {
        let vertices = source.full_mesh.vertices();
        full_point_map(&c, &full_source, &full_target, vertices, &matches)
    })?;
    let input = |y: Option<u32>| y.map_or(PointMap::UNMATCHED, |y| target.way_back.input_of_full[y as usize]);
    let targets: Vec<u32> = map.iter().map(input).collect();
    let confidence = confidence(&source.full_on_work(), source.mesh(), doubt);
    Ok((in_input_vertices(source, target, &targets, &confidence, None), info))
}
