//! Points on a mesh in files: `.corr` correspondences, and the `.baryc_gt` ground truth of SHREC'16.
//!
//! A line for each point: a triangle, 1-based in the order of the mesh file, and three barycentric weights. The
//! triangle is -1 where a mesh lacks the point; what follows on such a line does not matter.

use std::path::Path;

use super::error::{ParseError, Parsed};
use super::text::{Lines, Words, quote};
use super::{IoError, Position, write_atomically};
use crate::mesh::SurfacePoint;

/// Weights may be off by this much, as in files of few digits; they are then set right.
const TOLERANCE: f64 = 0.02;
/// Weights whose sum is off by less are taken as they are.
const ROUNDING: f64 = 1e-12;

/// Reads the points of a mesh of `n_faces` triangles, `[points]`, `None` where the mesh lacks one.
///
/// # Errors
/// If the file cannot be read or a line is neither a triangle of the mesh with three weights that sum to 1 nor -1.
pub fn read_surface_points(path: &Path, n_faces: usize) -> Result<Vec<Option<SurfacePoint>>, IoError> {
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    decode(&bytes, n_faces).map_err(|e| e.in_file(path))
}

/// Writes points, a line for each. Reading them gives the same points again.
///
/// # Errors
/// If the file cannot be written.
pub fn write_surface_points(path: &Path, points: &[Option<SurfacePoint>]) -> Result<(), IoError> {
    write_atomically(path, |w| {
        points.iter().try_for_each(|point| match point {
            Some(SurfacePoint { face, weights: [u, v, t] }) => {
                writeln!(w, "{} {u} {v} {t}", u64::from(*face) + 1)
            }
            None => writeln!(w, "-1 0 0 0"),
        })
    })
}

fn decode(bytes: &[u8], n_faces: usize) -> Parsed<Vec<Option<SurfacePoint>>> {
    let mut lines = Lines::new(bytes);
    let mut points = Vec::new();
    while let Some(mut words) = lines.next_data() {
        points.push(point(&mut words, n_faces)?);
    }
    Ok(points)
}

fn point(words: &mut Words<'_>, n_faces: usize) -> Parsed<Option<SurfacePoint>> {
    let wrong = |words: &Words<'_>, problem: String| {
        ParseError::new(
            Position::Line(words.line()),
            problem,
            "write the triangle's number and three weights that sum to 1, or -1",
        )
    };
    let number = words.integer("the triangle")?;
    if number == -1 {
        return Ok(None);
    }
    if number < 1 || number as u64 > n_faces as u64 {
        return Err(wrong(words, format!("triangle {number}, but the mesh has triangles 1 to {n_faces}")));
    }
    let face = u32::try_from(number - 1)
        .map_err(|_| wrong(words, format!("triangle {number} does not fit 32 bits")))?;
    let weights = words.point("a barycentric weight")?;
    if let Some(word) = words.next() {
        return Err(wrong(words, format!("{} follows the three weights", quote(word))));
    }
    if let Some(weight) = weights.iter().find(|w| **w < -TOLERANCE) {
        return Err(wrong(
            words,
            format!("the weight {weight} is negative, so the point is off its triangle"),
        ));
    }
    let sum: f64 = weights.iter().sum();
    if (sum - 1.0).abs() > TOLERANCE {
        return Err(wrong(words, format!("the weights sum to {sum}, not 1")));
    }
    Ok(Some(SurfacePoint { face, weights: proper(weights) }))
}

/// The weights without rounding errors of the file: none negative, the sum 1.
fn proper(weights: [f64; 3]) -> [f64; 3] {
    let positive = weights.map(|w| w.max(0.0));
    let sum: f64 = positive.iter().sum();
    if (sum - 1.0).abs() <= ROUNDING { positive } else { positive.map(|w| w / sum) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        decode(text.as_bytes(), 4).unwrap_err().in_file(Path::new("cat.corr")).to_string()
    }

    #[test]
    fn points_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cat.corr");
        let third = 1.0 / 3.0;
        let points = vec![
            Some(SurfacePoint { face: 3, weights: [third, third, 1.0 - 2.0 * third] }),
            None,
            Some(SurfacePoint::at_corner(0, 1)),
            Some(SurfacePoint { face: 1, weights: [1e-17, 0.1, 0.9 - 1e-17] }),
        ];
        write_surface_points(&path, &points).unwrap();
        assert_eq!(read_surface_points(&path, 4).unwrap(), points);
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().nth(1), Some("-1 0 0 0"));
        assert_eq!(text.lines().nth(2), Some("1 0 1 0"));
        write_surface_points(&path, &[]).unwrap();
        assert_eq!(read_surface_points(&path, 4).unwrap(), []);
    }

    #[test]
    fn weights_of_few_digits_are_set_right() {
        let points =
            decode(b"# by hand\n2.0000e+00 0.333 0.333 0.333\n\n-1\n-1 -1 -1 -1\r\n4 -0.001 0.5 0.501\n", 4);
        let points = points.unwrap();
        assert_eq!(points.len(), 4);
        let first = points[0].unwrap();
        assert_eq!(first.face, 1);
        assert!(first.weights.iter().all(|w| (w - 1.0 / 3.0).abs() < 1e-15));
        assert_eq!(points[1..3], [None, None]);
        let last = points[3].unwrap().weights;
        assert!(last[0] == 0.0 && (last.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn errors_say_file_line_and_remedy() {
        for (line, expected) in [
            ("5 1 0 0", "triangle 5, but the mesh has triangles 1 to 4"),
            ("0 1 0 0", "triangle 0, but"),
            ("-2 1 0 0", "triangle -2, but"),
            ("1.5 1 0 0", "the triangle is not an integer: '1.5'"),
            ("x 1 0 0", "the triangle is not an integer: 'x'"),
            ("1 0.5 0.5", "a barycentric weight is missing at the end of the line"),
            ("1 1 0 0 0", "'0' follows the three weights"),
            ("1 1 x 0", "a barycentric weight is not a number: 'x'"),
            ("1 1 NaN 0", "a barycentric weight is not finite: 'NaN'"),
            ("1 1.5 -0.5 0", "the weight -0.5 is negative"),
            ("1 0.5 0.3 0", "the weights sum to 0.8, not 1"),
        ] {
            let error = error(&format!("1 1 0 0\n{line}\n"));
            assert!(error.starts_with("cat.corr, line 2: ") && error.contains(expected), "{error}");
        }
        let missing = read_surface_points(Path::new("/nowhere/cat.corr"), 4).unwrap_err().to_string();
        assert!(missing.contains("/nowhere/cat.corr"), "{missing}");
    }
}
