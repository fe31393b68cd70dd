use super::*;
use crate::mesh::shapes::{bumpy_sphere, permuted, rotation, transformed};
use crate::spectral::{EigenOptions, eigenbasis};

/// What the measures need of a mesh.
struct Measured {
    mesh: Mesh,
    laplacian: Laplacian,
    basis: Eigenbasis,
    frame: SurfaceFrame,
}

impl Measured {
    fn new(mesh: Mesh) -> Self {
        let laplacian = Laplacian::new(&mesh);
        let basis = eigenbasis(&laplacian, 30, &EigenOptions::default()).unwrap().0.at_unit_area(30);
        let frame = SurfaceFrame::new(&mesh);
        Self { mesh, laplacian, basis, frame }
    }

    fn side(&self) -> Side<'_> {
        Side { mesh: &self.mesh, laplacian: &self.laplacian, basis: &self.basis, frame: &self.frame }
    }
}

const STRAIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn identity(n: usize) -> PointMap {
    PointMap::new((0..n as u32).collect(), n)
}

#[test]
fn a_right_map_has_nothing_wrong() {
    let source = Measured::new(bumpy_sphere(3, 1));
    let turned = transformed(&source.mesh, rotation([1.0, 2.0, 3.0], 0.7), 20.0, [3.0, 4.0, 5.0]);
    let (target, new_of_old) = permuted(&turned, 5);
    let target = Measured::new(target);
    let n = source.mesh.n_vertices();
    let mut back = vec![0; n];
    new_of_old.iter().enumerate().for_each(|(old, &new)| back[new as usize] = old as u32);
    let (map, back) = (PointMap::new(new_of_old, n), PointMap::new(back, n));
    let quality = Quality::measure(&map, Some(&back), source.side(), target.side()).unwrap();
    assert!(quality.commutativity < 1e-9 && quality.orthogonality < 1e-9, "{quality:?}");
    assert!((quality.dirichlet - 2.0).abs() < 1e-9, "{quality:?}");
    assert_eq!((quality.stretched, quality.reversed, quality.cycle), (0.0, 0.0, Some(0.0)));
    assert!((quality.coverage - 1.0).abs() < 1e-12);
    let doubt = doubt(&map, Some(&back), source.side(), target.side());
    assert!(doubt.iter().all(|&doubt| doubt == 0.0));
}

#[test]
fn a_mirrored_map_is_reversed_everywhere() {
    let source = Measured::new(bumpy_sphere(3, 1));
    let vertices = source.mesh.vertices().iter().map(|&[x, y, z]| [-x, y, z]).collect();
    // Outward normals, as repair leaves them.
    let faces = source.mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
    let target = Measured::new(Mesh::new(vertices, faces).unwrap());
    let map = identity(source.mesh.n_vertices());
    let quality = Quality::measure(&map, None, source.side(), target.side()).unwrap();
    assert!(quality.is_mirrored() && quality.reversed > 0.999, "{quality:?}");
    assert!(quality.commutativity < 1e-9, "no other measure sees it: {quality:?}");
    let doubt = doubt(&map, None, source.side(), target.side());
    assert!(doubt.iter().all(|&doubt| doubt > 0.9));
}

#[test]
fn doubt_is_where_the_map_is_wrong() {
    let source = Measured::new(transformed(&bumpy_sphere(4, 2), STRAIGHT, 3.0, [0.0; 3]));
    let n = source.mesh.n_vertices();
    let mut map = identity(n);
    // A cap goes to random places.
    let wrong: Vec<usize> = (0..n).filter(|&v| source.mesh.vertices()[v][2] > 2.0).collect();
    wrong.iter().for_each(|&v| map.targets[v] = ((v * 7919) % n) as u32);
    let quality = Quality::measure(&map, None, source.side(), source.side()).unwrap();
    let right = Quality::measure(&identity(n), None, source.side(), source.side()).unwrap();
    assert!(quality.commutativity > right.commutativity + 0.01 && quality.dirichlet > 3.0 * right.dirichlet);
    assert!(quality.stretched > 0.01 && quality.coverage < 1.0);
    let doubt = doubt(&map, None, source.side(), source.side());
    let mean = |vertices: &mut dyn Iterator<Item = usize>| {
        let values: Vec<f32> = vertices.map(|v| doubt[v]).collect();
        values.iter().sum::<f32>() / values.len() as f32
    };
    assert!(mean(&mut wrong.iter().copied()) > 0.6);
    assert!(mean(&mut (0..n).filter(|&v| source.mesh.vertices()[v][2] < 0.0)) < 0.02);
    map.targets[0] = PointMap::UNMATCHED;
    assert_eq!(super::doubt(&map, None, source.side(), source.side())[0], 1.0);
    let calibration = Calibration::default();
    let [good, bad] = [right, quality].map(|quality| calibration.estimate(&quality));
    assert!(good.expected_error < bad.expected_error && good.bad < bad.bad);
}

#[test]
fn a_calibration_is_read_as_it_is_written() {
    let calibration = Calibration { doubtful: 0.25, ..Calibration::default() };
    assert_eq!(Calibration::from_json(&calibration.to_json()), Ok(calibration));
    assert!(Calibration::from_json("{}").unwrap_err().contains("does not parse"));
    let wrong = Calibration { doubtful: 2.0, ..calibration };
    assert!(Calibration::from_json(&wrong.to_json()).unwrap_err().contains("probability"));
    let likeness = Calibration { agreement: Some(0.7), ..calibration };
    assert_eq!(Calibration::from_json(&likeness.to_json()), Ok(likeness));
    let wrong = Calibration { agreement: Some(1.5), ..calibration };
    assert!(Calibration::from_json(&wrong.to_json()).unwrap_err().contains("cosine"));
}

/// A smooth map between what the descriptors hold for unlike is doubtful, though nothing else is wrong with it.
#[test]
fn a_map_without_likeness_is_doubtful() {
    let source = Measured::new(bumpy_sphere(4, 2));
    let n = source.mesh.n_vertices();
    let right = Quality::measure(&identity(n), None, source.side(), source.side()).unwrap();
    let areas = source.mesh.vertex_areas();
    // A cosine of .55.
    let [own, other] = [1.0, -0.2].map(|x: f32| Matrix::from_vec(n, 2, [1.0, x].repeat(n)));
    let calibration = Calibration { agreement: Some(0.7), ..Calibration::default() };
    let doubtful = |target: &Matrix<f32>, calibration: &Calibration| {
        calibration.estimate(&right.with_descriptors(&identity(n), &areas, &own, target)).doubtful
    };
    assert!(!doubtful(&own, &calibration));
    assert!(doubtful(&other, &calibration) && !doubtful(&other, &Calibration::default()));
    assert!(!calibration.estimate(&right).doubtful);
}

/// Measures of maps of parts of a dog, of mean errors 38.4, 21.5, 2.1 and 1.3.
#[test]
fn parts_have_a_calibration_of_their_own() {
    let quality = |[commutativity, dirichlet, orthogonality, stretched, reversed]: [f64; 5]| Quality {
        commutativity,
        orthogonality,
        dirichlet,
        stretched,
        reversed,
        cycle: None,
        coverage: 0.4,
        agreement: None,
    };
    let estimate = |measures| Calibration::of_parts().estimate(&quality(measures));
    let bad = [[0.241, 16.425, 0.382, 0.011, 0.156], [0.194, 9.138, 0.250, 0.012, 0.146]].map(estimate);
    let good = [[0.075, 6.089, 0.160, 0.006, 0.081], [0.388, 1.624, 0.634, 0.003, 0.030]].map(estimate);
    assert!(bad.iter().all(|estimate| estimate.doubtful && estimate.expected_error > 10.0));
    assert!(good.iter().all(|estimate| !estimate.doubtful && estimate.expected_error < 9.0));
}

/// Two arms of a cross exchange places: each is a region elsewhere. Stretched or reversed places alone are none.
#[test]
fn exchanged_limbs_are_displaced_regions() {
    let source = Measured::new(limbs());
    let n = source.mesh.n_vertices();
    let regions = |map: &PointMap| displaced_regions(map, source.side(), source.side());
    assert!(regions(&identity(n)).is_empty());
    let at = |v: usize| source.mesh.vertices()[v];
    let arm = |side: f64| move |v: &usize| side * at(*v)[0] > 1.0;
    let mut map = identity(n);
    for v in (0..n).filter(|v| arm(1.0)(v) || arm(-1.0)(v)) {
        let [x, y, z] = at(v);
        // Turned half round the vertical axis, so that the orientation stays.
        let wanted = [-x, y, -z];
        let nearest = crate::mesh::nearest_vertices(source.mesh.vertices(), &[wanted]);
        map.targets[v] = nearest[0];
    }
    let found = regions(&map);
    assert_eq!(found.len(), 2, "{:?}", found.iter().map(Vec::len).collect::<Vec<_>>());
    for region in &found {
        let right = region.iter().filter(|&&v| at(v as usize)[0].abs() > 1.0).count();
        assert!(right as f64 > 0.9 * region.len() as f64, "{right} of {}", region.len());
    }
    // All of it turned inside out is one region.
    let mirrored = |v: usize| {
        let [x, y, z] = at(v);
        crate::mesh::nearest_vertices(source.mesh.vertices(), &[[-x, y, z]])[0]
    };
    let mirrored = PointMap::new((0..n).map(mirrored).collect(), n);
    let found = regions(&mirrored);
    assert!(found.len() == 1 && found[0].len() > n * 9 / 10);
}

/// A ball with arms along the first axis and a longer one along the second, exactly symmetric.
fn limbs() -> Mesh {
    let ball = crate::mesh::shapes::icosphere(4);
    let reach = |[x, y, z]: [f64; 3]| {
        let along = |c: f64, others: f64, length: f64| {
            if c > 0.0 { 1.0 + length * (-others / 0.1).exp() } else { 1.0 }
        };
        let factor = along(x.abs(), y * y + z * z, 2.0) * along(y, x * x + z * z, 3.0);
        [x, y, z].map(|c| factor * c)
    };
    let vertices = ball.vertices().iter().map(|&p| reach(p)).collect();
    Mesh::new(vertices, ball.faces().to_vec()).unwrap()
}
