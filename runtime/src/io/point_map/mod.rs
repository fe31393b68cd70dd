//! Point maps in files.
//!
//! | | content | unmatched |
//! |---|---|---|
//! | `.txt` | one 0-based target index a line, as `numpy.loadtxt` takes it | -1 |
//! | `.vts` | one 1-based target index a line, as in the FAUST and TOSCA correspondences | 0 |
//! | `.npy` | int32 `[n_source]`, 0-based | -1 |
//! | `.csv` | a comment with direction, base and sizes, then `source,target,confidence` and, where the map is finer than a vertex, `face,u,v,w` | -1 |
//! | `.npz` | arrays `targets`, `confidence`, `faces`, `weights` for NumPy; written only | -1 |

use std::path::Path;

use super::error::{ParseError, Parsed};
use super::text::{Lines, Words, decode_text, float, integer, quote};
use super::{IoError, matrix, write_atomically};
use crate::mesh::SurfacePoint;
use crate::point_map::PointMap;

/// A format of point map files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PointMapFormat {
    /// `.txt`
    Txt,
    /// `.vts`
    Vts,
    /// `.npy`
    Npy,
    /// `.csv`
    Csv,
    /// `.npz`, which is written only.
    Npz,
}

impl PointMapFormat {
    /// The extensions of point maps.
    pub const EXTENSIONS: &'static str = ".txt, .vts, .npy, .csv, .npz";

    /// The format that the extension of `path` names, whatever its case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "txt" => Some(Self::Txt),
            "vts" => Some(Self::Vts),
            "npy" => Some(Self::Npy),
            "csv" => Some(Self::Csv),
            "npz" => Some(Self::Npz),
            _ => None,
        }
    }

    /// [`PointMapFormat::from_path`], or an error that lists what there is.
    fn of(path: &Path) -> Result<Self, IoError> {
        Self::from_path(path)
            .ok_or_else(|| IoError::UnknownFormat { path: path.into(), known: Self::EXTENSIONS })
    }
}

/// Reads a point map; the extension decides on the format, but NumPy's is known by its first bytes. Text may be in UTF-8 or UTF-16.
///
/// `n_target` is the number of target vertices, against which every index is checked; where it is `None` it is
/// what the file states (`.csv`), else one more than the largest index.
///
/// # Errors
/// If the file cannot be read, its extension is none of [`PointMapFormat::EXTENSIONS`], a line or entry is no index of a
/// target vertex, or a `.csv` states another number of targets than `n_target`.
pub fn read_point_map(path: &Path, n_target: Option<usize>) -> Result<PointMap, IoError> {
    let format = PointMapFormat::of(path)?;
    let bytes = std::fs::read(path).map_err(|source| IoError::Read { path: path.into(), source })?;
    decode(&bytes, format, n_target).map_err(|e| e.in_file(path))
}

/// Writes a point map; the extension decides on the format. Confidences are kept by `.csv` only.
///
/// # Errors
/// If the extension is none of [`PointMapFormat::EXTENSIONS`], the file cannot be written, or an index does not fit
/// `.npy`'s int32.
pub fn write_point_map(path: &Path, map: &PointMap) -> Result<(), IoError> {
    let bytes = encode_point_map(path, map)?;
    write_atomically(path, |w| w.write_all(&bytes))
}

/// The bytes that [`write_point_map`] writes; `path` gives the format and the name in errors.
///
/// # Errors
/// As [`write_point_map`], but for those of the file.
pub fn encode_point_map(path: &Path, map: &PointMap) -> Result<Vec<u8>, IoError> {
    match PointMapFormat::of(path)? {
        PointMapFormat::Txt => Ok(lines(map.iter().map(|target| target.map_or(-1, i64::from)))),
        PointMapFormat::Vts => Ok(lines(map.iter().map(|target| target.map_or(0, |t| i64::from(t) + 1)))),
        PointMapFormat::Npy => {
            let targets: Option<Vec<i32>> =
                map.iter().map(|target| target.map_or(Some(-1), |t| i32::try_from(t).ok())).collect();
            let targets = targets.ok_or_else(|| IoError::Unwritable {
                path: path.into(),
                problem: "a target index does not fit int32".into(),
                remedy: "write a .txt file",
            })?;
            Ok(matrix::encode(&[targets.len()], &targets))
        }
        PointMapFormat::Csv => Ok(csv(map)),
        PointMapFormat::Npz => npz(path, map),
    }
}

/// A number a line.
fn lines(numbers: impl Iterator<Item = i64>) -> Vec<u8> {
    numbers.flat_map(|number| format!("{number}\n").into_bytes()).collect()
}

/// `targets` int32 `[n]`, `confidence` float32 `[n]`, `faces` int32 `[n]`, `weights` float64 `[n, 3]`: what the map has of them.
fn npz(path: &Path, map: &PointMap) -> Result<Vec<u8>, IoError> {
    let index = |value: Option<u32>| value.map_or(Some(-1), |value| i32::try_from(value).ok());
    let faces =
        |points: &Vec<Option<SurfacePoint>>| points.iter().map(|p| index(p.map(|p| p.face))).collect();
    let targets: Option<Vec<i32>> = map.iter().map(index).collect();
    let faces: Option<Option<Vec<i32>>> = map.points.as_ref().map(faces);
    let (Some(targets), Some(faces)) = (targets, faces.map_or(Some(None), |faces| faces.map(Some))) else {
        return Err(IoError::Unwritable {
            path: path.into(),
            problem: "an index does not fit int32".into(),
            remedy: "write a .csv file",
        });
    };
    let n = map.len();
    let mut arrays = vec![("targets", matrix::encode(&[n], &targets))];
    arrays.extend(map.confidence.as_ref().map(|values| ("confidence", matrix::encode(&[n], values))));
    arrays.extend(faces.map(|faces| ("faces", matrix::encode(&[n], &faces))));
    arrays.extend(map.points.as_ref().map(|points| {
        let weights: Vec<f64> = points.iter().flat_map(|p| p.map_or([0.0; 3], |p| p.weights)).collect();
        ("weights", matrix::encode(&[n, 3], &weights))
    }));
    matrix::npz(path, &arrays)
}

fn csv(map: &PointMap) -> Vec<u8> {
    let finer = if map.points.is_some() { ",face,u,v,w" } else { "" };
    let mut text = format!(
        "# source->target, 0-based, n_source={}, n_target={}\nsource,target,confidence{finer}\n",
        map.len(),
        map.n_target
    );
    for (source, target) in map.iter().enumerate() {
        text += &format!("{source},{},", target.map_or(-1, i64::from));
        if let Some(confidence) = map.confidence.as_ref().and_then(|c| c.get(source)) {
            text += &confidence.to_string();
        }
        match map.points.as_ref().map(|points| points.get(source).copied().flatten()) {
            Some(Some(SurfacePoint { face, weights: [u, v, w] })) => {
                text += &format!(",{face},{u},{v},{w}");
            }
            Some(None) => text += ",-1,0,0,0",
            None => {}
        }
        text.push('\n');
    }
    text.into_bytes()
}

pub(super) fn decode(bytes: &[u8], format: PointMapFormat, n_target: Option<usize>) -> Parsed<PointMap> {
    if matrix::is_npy(bytes) {
        return decode_npy(bytes, n_target);
    }
    let bytes = &*decode_text(bytes);
    match format {
        PointMapFormat::Txt => decode_lines(bytes, 0, n_target),
        PointMapFormat::Vts => decode_lines(bytes, 1, n_target),
        PointMapFormat::Npy => decode_npy(bytes, n_target),
        PointMapFormat::Csv => decode_csv(bytes, n_target),
        PointMapFormat::Npz => {
            let error = ParseError::part("file", ".npz maps are not read");
            Err(error.with_remedy("write the map as .csv, or its targets as .npy"))
        }
    }
}

/// One index a line; `base` is that of the first vertex, `base - 1` stands for none.
fn decode_lines(bytes: &[u8], base: i64, n_target: Option<usize>) -> Parsed<PointMap> {
    let mut lines = Lines::new(bytes);
    let mut targets = Vec::new();
    while let Some(mut words) = lines.next_data() {
        let index = words.integer("the target")?;
        if let Some(word) = words.next() {
            return Err(
                words.error(format!("{} follows the target; one index a line is expected", quote(word)))
            );
        }
        targets.push(
            target(index - base, n_target)
                .ok_or_else(|| words.error(no_such_target(index, base, n_target)))?,
        );
    }
    Ok(finish(targets, None, n_target))
}

fn decode_npy(bytes: &[u8], n_target: Option<usize>) -> Parsed<PointMap> {
    let array = matrix::decode::<i64>(bytes)?;
    if array.rows() != 1 && array.cols() != 1 {
        let problem = format!("the array is [{}, {}], not a vector", array.rows(), array.cols());
        return Err(ParseError::part("header", problem));
    }
    let checked = array.data().iter().enumerate().map(|(source, &index)| {
        target(index, n_target)
            .ok_or_else(|| ParseError::part(format!("entry {source}"), no_such_target(index, 0, n_target)))
    });
    let targets: Parsed<Vec<u32>> = checked.collect();
    Ok(finish(targets?, None, n_target))
}

/// The target vertex of a 0-based index, where -1 stands for none; `None` where there is no such vertex.
fn target(index: i64, n_target: Option<usize>) -> Option<u32> {
    if index == -1 {
        return Some(PointMap::UNMATCHED);
    }
    let target = u32::try_from(index).ok().filter(|&t| t != PointMap::UNMATCHED)?;
    n_target.is_none_or(|n| (target as usize) < n).then_some(target)
}

fn no_such_target(index: i64, base: i64, n_target: Option<usize>) -> String {
    let count = n_target.map_or(String::new(), |n| format!(": there are {n}, counted from {base}"));
    format!("target vertex {index} does not exist{count}")
}

fn finish(targets: Vec<u32>, confidence: Option<Vec<f32>>, n_target: Option<usize>) -> PointMap {
    let largest = targets.iter().filter(|&&t| t != PointMap::UNMATCHED).max();
    let n_target = n_target.unwrap_or(largest.map_or(0, |&t| t as usize + 1));
    PointMap { targets, confidence, points: None, n_target }
}

fn decode_csv(bytes: &[u8], n_target: Option<usize>) -> Parsed<PointMap> {
    let mut lines = Lines::new(bytes);
    let mut table = Table { n_target, ..Default::default() };
    while let Some(line) = lines.next() {
        let line = line.trim_ascii();
        let words = Words::new(line, lines.number());
        match line.first() {
            None => {}
            Some(b'#') => table.comment(line, bytes.len(), &words)?,
            Some(c) if c.is_ascii_alphabetic() => table.header(line, &words)?,
            Some(_) => table.row(line, bytes.len(), &words)?,
        }
    }
    Ok(table.finish())
}

/// The rows of a `.csv` map read so far.
#[derive(Default)]
struct Table {
    n_source: Option<usize>,
    n_target: Option<usize>,
    targets: Vec<u32>,
    given: Vec<bool>,
    confidence: Vec<f32>,
    has_confidence: bool,
    points: Vec<Option<SurfacePoint>>,
    has_points: bool,
}

impl Table {
    fn comment(&mut self, line: &[u8], n_bytes: usize, words: &Words<'_>) -> Parsed<()> {
        let text = String::from_utf8_lossy(line);
        if text.contains("1-based") || text.contains("target->source") {
            return Err(words.error("only maps source->target, 0-based are read"));
        }
        let size = |key: &str| {
            let (_, rest) = text.split_once(key)?;
            rest.split(|c: char| !c.is_ascii_digit()).next()?.parse::<usize>().ok()
        };
        if let Some(n_source) = size("n_source=") {
            // Every source vertex takes a line, so the file bounds their number.
            if n_source > n_bytes {
                return Err(
                    words.error(format!("n_source={n_source}, but the file has only {n_bytes} bytes"))
                );
            }
            self.n_source = Some(n_source);
        }
        match (size("n_target="), self.n_target) {
            (Some(stated), Some(known)) if stated != known => {
                let problem = format!("the map is to {stated} vertices, but the target has {known}");
                Err(words.error(problem).with_remedy("pass the map of these two meshes, in this order"))
            }
            (Some(stated), _) => {
                self.n_target = Some(stated);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn header(&self, line: &[u8], words: &Words<'_>) -> Parsed<()> {
        let mut names = line.split(|&b| b == b',').map(|name| name.trim_ascii());
        if names.next() == Some(b"source") && names.next() == Some(b"target") {
            return Ok(());
        }
        Err(words.error(format!("the columns are {}, not 'source,target,confidence'", quote(line))))
    }

    fn row(&mut self, line: &[u8], n_bytes: usize, words: &Words<'_>) -> Parsed<()> {
        let mut columns = line.split(|&b| b == b',').map(|column| column.trim_ascii());
        let mut column = || columns.next().filter(|column| !column.is_empty());
        let number = |name: &str, column: Option<&[u8]>| {
            let column = column.unwrap_or_default();
            integer(column)
                .ok_or_else(|| words.error(format!("the {name} is not an integer: {}", quote(column))))
        };
        let source = number("source", column())?;
        let n_source = self.n_source.unwrap_or(n_bytes);
        let source = usize::try_from(source).ok().filter(|&s| s < n_source).ok_or_else(|| {
            words.error(format!("source vertex {source} does not exist: there are at most {n_source}"))
        })?;
        let index = number("target", column())?;
        let target = target(index, self.n_target)
            .ok_or_else(|| words.error(no_such_target(index, 0, self.n_target)))?;
        let confidence = column().map(|column| {
            float(column)
                .ok_or_else(|| words.error(format!("the confidence is not a number: {}", quote(column))))
        });
        let point = match column() {
            Some(face) => Some(point(number("face", Some(face))?, [column(), column(), column()], words)?),
            None => None,
        };
        self.resize((source + 1).max(self.targets.len()));
        if std::mem::replace(&mut self.given[source], true) {
            return Err(words.error(format!("source vertex {source} is there a second time")));
        }
        self.targets[source] = target;
        if let Some(point) = point {
            self.points[source] = point;
            self.has_points = true;
        }
        if let Some(confidence) = confidence.transpose()? {
            self.confidence[source] = confidence as f32;
            self.has_confidence = true;
        }
        Ok(())
    }

    fn resize(&mut self, n_source: usize) {
        self.targets.resize(n_source, PointMap::UNMATCHED);
        self.given.resize(n_source, false);
        self.confidence.resize(n_source, 0.0);
        self.points.resize(n_source, None);
    }

    fn finish(mut self) -> PointMap {
        self.resize(self.n_source.unwrap_or(self.targets.len()));
        let map = finish(self.targets, self.has_confidence.then_some(self.confidence), self.n_target);
        PointMap { points: self.has_points.then_some(self.points), ..map }
    }
}

/// A point on a triangle, -1 for none, by the three columns of its weights.
fn point(face: i64, weights: [Option<&[u8]>; 3], words: &Words<'_>) -> Parsed<Option<SurfacePoint>> {
    if face == -1 {
        return Ok(None);
    }
    let face = u32::try_from(face).map_err(|_| words.error(format!("face {face} does not exist")))?;
    let weights = weights.map(|column| float(column.unwrap_or_default()).filter(|w| (0.0..=1.0).contains(w)));
    match weights {
        [Some(u), Some(v), Some(w)] if (u + v + w - 1.0).abs() < 1e-3 => {
            Ok(Some(SurfacePoint { face, weights: [u, v, w] }))
        }
        _ => Err(words.error("the weights u, v, w are not three numbers from 0 to 1 that sum to 1")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use PointMapFormat::{Csv, Npy, Txt, Vts};

    fn map() -> PointMap {
        PointMap {
            targets: vec![2, PointMap::UNMATCHED, 0],
            confidence: Some(vec![0.5, 0.0, 1.0]),
            points: Some(vec![
                Some(SurfacePoint { face: 7, weights: [0.25, 0.5, 0.25] }),
                None,
                Some(SurfacePoint::at_corner(0, 2)),
            ]),
            n_target: 4,
        }
    }

    #[test]
    fn every_format_round_trips() {
        let folder = tempfile::tempdir().unwrap();
        for extension in ["txt", "vts", "npy", "CSV"] {
            let path = folder.path().join(format!("map.{extension}"));
            write_point_map(&path, &map()).unwrap();
            let read = read_point_map(&path, Some(4)).unwrap();
            let [confidence, points] = [extension == "CSV"; 2];
            let confidence = map().confidence.filter(|_| confidence);
            let points = map().points.filter(|_| points);
            assert_eq!(read, PointMap { confidence, points, ..map() });
        }
        let path = folder.path().join("map.npz");
        write_point_map(&path, &map()).unwrap();
        let mut archive = npyz::npz::NpzArchive::open(&path).unwrap();
        let mut floats = |name: &str| -> (Vec<u64>, Vec<f64>) {
            let array = archive.by_name(name).unwrap().unwrap();
            (array.shape().to_vec(), array.into_vec().unwrap())
        };
        let (shape, weights) = floats("weights");
        assert_eq!((shape, &weights[..4]), (vec![3, 3], &[0.25, 0.5, 0.25, 0.0][..]));
        let faces: Vec<i32> = archive.by_name("faces").unwrap().unwrap().into_vec().unwrap();
        assert_eq!(faces, [7, -1, 0]);
        let targets: Vec<i32> = archive.by_name("targets").unwrap().unwrap().into_vec().unwrap();
        assert_eq!(targets, [2, -1, 0]);
        assert!(read_point_map(&path, None).unwrap_err().to_string().contains(".csv"));
        assert!(
            write_point_map(&folder.path().join("map.map"), &map()).unwrap_err().to_string().contains(".txt")
        );
        assert_eq!(std::fs::read_to_string(folder.path().join("map.txt")).unwrap(), "2\n-1\n0\n");
        assert_eq!(std::fs::read_to_string(folder.path().join("map.vts")).unwrap(), "3\n0\n1\n");
        assert_eq!(
            std::fs::read_to_string(folder.path().join("map.CSV")).unwrap(),
            "# source->target, 0-based, n_source=3, n_target=4\nsource,target,confidence,face,u,v,w\n\
             0,2,0.5,7,0.25,0.5,0.25\n1,-1,0,-1,0,0,0\n2,0,1,0,0,0,1\n"
        );
        let wrong = decode(b"source,target\n0,1,,3,0.9,0.9,0\n", Csv, None).unwrap_err();
        assert!(format!("{wrong:?}").contains("sum to 1"));
    }

    #[test]
    fn the_number_of_targets_is_found_where_it_is_not_given() {
        assert_eq!(decode(b"# by hand\n1\n\n 5.0e0\n", Txt, None).unwrap(), PointMap::new(vec![1, 5], 6));
        assert_eq!(decode(b"1\n0\n", Vts, None).unwrap(), PointMap::new(vec![0, PointMap::UNMATCHED], 1));
        let csv = decode(b"# n_source=3, n_target=9\n1,4\n", Csv, None).unwrap();
        assert_eq!(csv, PointMap::new(vec![PointMap::UNMATCHED, 4, PointMap::UNMATCHED], 9));
        assert_eq!(decode(b"source, target\n0, 1\n", Csv, None).unwrap(), PointMap::new(vec![1], 2));
    }

    #[test]
    fn errors_say_line_and_range() {
        for (bytes, format, expected) in [
            (&b"0\n3\n"[..], Txt, "line 2: target vertex 3 does not exist: there are 3, counted from 0"),
            (b"4\n", Vts, "target vertex 4 does not exist: there are 3, counted from 1"),
            (b"-1\n", Vts, "target vertex -1 does not exist"),
            (b"-2\n", Txt, "target vertex -2 does not exist"),
            (b"0 1\n", Txt, "line 1: '1' follows the target"),
            (b"a\n", Txt, "line 1: the target is not an integer: 'a'"),
            (b"0", Npy, "does not begin as a .npy file"),
            (b"x,y\n", Csv, "the columns are 'x,y'"),
            (b"# n_source=99\n", Csv, "n_source=99, but the file has only 14 bytes"),
            (b"# n_target=4\n", Csv, "the map is to 4 vertices, but the target has 3"),
            (b"# source->target, 1-based\n", Csv, "0-based are read"),
            (b"0,0\n0,0\n", Csv, "line 2: source vertex 0 is there a second time"),
            (b"99999999,0\n", Csv, "source vertex 99999999 does not exist"),
            (b"0,0,high\n", Csv, "the confidence is not a number: 'high'"),
            (b"0\n", Csv, "the target is not an integer: ''"),
        ] {
            let error = decode(bytes, format, Some(3)).unwrap_err().in_file(Path::new("map")).to_string();
            assert!(error.contains(expected), "{error}");
        }
        let large = format!("{}\n", u32::MAX);
        assert!(
            decode(large.as_bytes(), Txt, None)
                .unwrap_err()
                .in_file(Path::new("map"))
                .to_string()
                .contains("exist")
        );
    }
}
