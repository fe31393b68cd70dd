use super::*;
use crate::mesh::shapes::{icosphere, permuted};
use crate::mesh::{nearest_vertices, vertices_on_surface};
use crate::point_map::PointMap;

/// Longitude and latitude as texture coordinates, with a seam where the longitude wraps.
fn globe(mesh: &Mesh) -> Vec<[Uv; 3]> {
    let place = |v: u32| {
        let [x, y, z] = mesh.vertices()[v as usize];
        [(y.atan2(x) / std::f64::consts::TAU + 0.5) as f32, (0.5 + 0.5 * z) as f32]
    };
    let unwrapped = |corners: [Uv; 3]| {
        let largest = corners.iter().map(|c| c[0]).fold(0.0, f32::max);
        corners.map(|[u, v]| [if largest - u > 0.5 { u + 1.0 } else { u }, v])
    };
    mesh.faces().iter().map(|face| unwrapped(face.map(place))).collect()
}

/// The sides of a die as charts, each in its part of the image, with margins between them.
fn die(mesh: &Mesh) -> Vec<[Uv; 3]> {
    let chart = |f: usize| {
        let [a, b, c] = mesh.corners(f);
        let middle = vec3::add(vec3::add(a, b), c);
        let axis = (0..3).max_by(|&i, &j| middle[i].abs().total_cmp(&middle[j].abs())).unwrap();
        let side = 2 * axis + usize::from(middle[axis] < 0.0);
        mesh.corners(f).map(|p| {
            let [s, t] = [p[(axis + 1) % 3], p[(axis + 2) % 3]];
            [side as f32 + 0.5 + 0.4 * s as f32, 0.5 + 0.4 * t as f32]
        })
    };
    (0..mesh.n_faces()).map(chart).collect()
}

fn donors_of(fine: &Mesh, coarse: &Mesh) -> Donors {
    let nearest = nearest_vertices(coarse.vertices(), fine.vertices());
    Donors::of_source(&PointMap::new(nearest, coarse.n_vertices()))
}

fn largest(uvs: &[[Uv; 3]]) -> f64 {
    uvs.iter().map(|uvs| extent(*uvs)).fold(0.0, f64::max)
}

#[test]
fn a_texture_moves_to_a_finer_mesh_without_steps_or_smears() {
    let (coarse, fine) = (icosphere(2), icosphere(4));
    let donors = donors_of(&fine, &coarse);
    let (uvs, own) = (globe(&coarse), globe(&fine));
    let error = |donors: &Donors| {
        let moved = corner_uvs(&coarse, &uvs, &fine, donors);
        assert!(largest(&moved) <= largest(&uvs), "a triangle spans the seam");
        // Away from the poles, where the longitude means nothing, and from the seam.
        let counts = |t: &[Uv; 3]| t.iter().all(|[u, v]| (0.2..0.8).contains(v) && (0.1..0.9).contains(u));
        let pairs: Vec<_> = moved.iter().zip(&own).filter(|(_, own)| counts(own)).collect();
        let off = |(a, b): &(&[Uv; 3], &[Uv; 3])| (0..3).map(|i| (a[i][0] - b[i][0]).abs()).sum::<f32>();
        pairs.iter().map(off).sum::<f32>() / (3 * pairs.len()) as f32
    };
    let (steps, smooth) = (error(&donors), error(&donors.clone().interpolated(&fine, &coarse).unwrap()));
    assert!(smooth < 0.6 * steps, "{smooth} interpolated, {steps} from the nearest vertex");
}

/// From coarse to fine and from fine to coarse, with places within triangles and without.
#[test]
fn every_triangle_is_in_one_chart() {
    let (coarse, fine) = (icosphere(2), permuted(&icosphere(4), 5).0);
    for (giver, receiver) in [(&coarse, &fine), (&fine, &coarse)] {
        let donors = donors_of(receiver, giver);
        for donors in [donors.clone().interpolated(receiver, giver).unwrap(), donors] {
            let moved = corner_uvs(giver, &die(giver), receiver, &donors);
            let side = |uv: Uv| uv[0].floor();
            let crossing = moved.iter().filter(|[a, b, c]| side(*a) != side(*b) || side(*a) != side(*c));
            assert_eq!(crossing.count(), 0, "from {} vertices", giver.n_vertices());
            // The right chart: the one whose middle is on the triangle's side of the body, up to a triangle at its
            // edges.
            let own = die(receiver);
            let wrong = moved.iter().zip(&own).filter(|(a, b)| side(a[0]) != side(b[0])).count();
            assert!(wrong < receiver.n_faces() / 4, "{wrong} triangles are in another chart");
        }
    }
}

#[test]
fn a_mesh_gives_itself_its_own_coordinates() {
    let mesh = icosphere(3);
    let map = PointMap::new((0..642).collect(), 642);
    let points = PointMap { points: Some(vertices_on_surface(&mesh)), ..map.clone() };
    let donors = Donors::of_source(&map);
    let on_surface = donors.clone().on_surface(&points, &mesh).unwrap();
    for donors in [donors, on_surface] {
        for uvs in [globe(&mesh), die(&mesh)] {
            assert_eq!(corner_uvs(&mesh, &uvs, &mesh, &donors), uvs);
        }
    }
}

#[test]
fn a_place_on_the_edge_of_a_seam_takes_either_side() {
    let mesh = icosphere(1);
    let uvs = die(&mesh);
    let giver = Giver::new(&mesh, &uvs);
    let chart = |f: u32| giver.chart_of_face[f as usize];
    let on_edge = |face: u32, outer: usize| {
        let mut weights = [0.5; 3];
        weights[outer] = 0.0;
        let point = combine(weights, mesh.corners(face as usize));
        (face, Spot { point, vertex: 0, blend: Some(Blend { face, weights }) })
    };
    let mut seams = 0;
    for (face, spot) in (0..80).flat_map(|face| [0, 1, 2].map(|outer| on_edge(face, outer))) {
        let choices = giver.choices(&spot);
        assert_eq!(choices.len(), 2);
        assert_eq!(choices[0].1, chart(face));
        if choices[1].1 == chart(face) {
            assert_eq!(choices[0], choices[1]);
        } else {
            seams += 1;
        }
    }
    assert!(seams > 20, "{seams}");
}

#[test]
fn corners_without_a_match_do_not_reach_for_the_origin() {
    let mesh = icosphere(1);
    let uvs: Vec<[Uv; 3]> = die(&mesh).iter().map(|uvs| uvs.map(|[u, v]| [u + 1.0, v + 1.0])).collect();
    let mut map: Vec<u32> = (0..42).collect();
    let [a, b, c] = mesh.faces()[0];
    map[a as usize] = PointMap::UNMATCHED;
    let moved = corner_uvs(&mesh, &uvs, &mesh, &Donors::of_source(&PointMap::new(map.clone(), 42)));
    assert!(moved.as_flattened().iter().all(|uv| *uv != [0.0; 2]));
    [b, c].into_iter().for_each(|v| map[v as usize] = PointMap::UNMATCHED);
    let moved = corner_uvs(&mesh, &uvs, &mesh, &Donors::of_source(&PointMap::new(map, 42)));
    assert_eq!(moved[0], [[0.0; 2]; 3]);
}

#[test]
fn choices_of_one_chart_only() {
    let choices = [&[([0.0, 0.5], 0), ([1.0, 0.5], 1)][..], &[([0.1, 0.5], 1)][..], &[([0.95, 0.6], 1)][..]];
    assert_eq!(closest_together(choices), Some([[1.0, 0.5], [0.1, 0.5], [0.95, 0.6]]));
    assert_eq!(closest_together([choices[0], choices[1], &[([0.9, 0.5], 0)]]), None);
}
