//! `.csv`: a line for each source vertex, with all that is known of its match.

use super::{finish, no_such_target, point, target};
use crate::io::error::Parsed;
use crate::io::text::{Lines, Words, float, integer, quote};
use crate::mesh::SurfacePoint;
use crate::point_map::PointMap;

pub(super) fn encode(map: &PointMap) -> Vec<u8> {
    let finer = if map.points.is_some() { ",face,u,v,w" } else { "" };
    let marked = if map.followers.is_empty() { "" } else { ",follows" };
    let mut text = format!(
        "# source->target, 0-based, n_source={}, n_target={}\nsource,target,confidence{finer}{marked}\n",
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
        if !map.followers.is_empty() {
            text += if map.follows(source) { ",1" } else { ",0" };
        }
        text.push('\n');
    }
    text.into_bytes()
}

pub(super) fn decode(bytes: &[u8], n_target: Option<usize>) -> Parsed<PointMap> {
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
    followers: Vec<u32>,
    columns: Columns,
}

/// Where the columns after source and target stand; without a line that names them, confidence and point follow in
/// this order.
struct Columns {
    confidence: Option<usize>,
    point: [Option<usize>; 4],
    follows: Option<usize>,
}

impl Default for Columns {
    fn default() -> Self {
        Self { confidence: Some(2), point: [Some(3), Some(4), Some(5), Some(6)], follows: None }
    }
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

    fn header(&mut self, line: &[u8], words: &Words<'_>) -> Parsed<()> {
        let names: Vec<&[u8]> = line.split(|&b| b == b',').map(|name| name.trim_ascii()).collect();
        if !names.starts_with(&[b"source", b"target"]) {
            return Err(
                words.error(format!("the columns are {}, not 'source,target,confidence'", quote(line)))
            );
        }
        let at = |wanted: &str| names.iter().position(|name| *name == wanted.as_bytes());
        self.columns = Columns {
            confidence: at("confidence"),
            point: ["face", "u", "v", "w"].map(at),
            follows: at("follows"),
        };
        Ok(())
    }

    fn row(&mut self, line: &[u8], n_bytes: usize, words: &Words<'_>) -> Parsed<()> {
        let columns: Vec<&[u8]> = line.split(|&b| b == b',').map(|column| column.trim_ascii()).collect();
        let column = |at: usize| columns.get(at).copied().filter(|column| !column.is_empty());
        let named = |at: Option<usize>| at.and_then(column);
        let number = |name: &str, column: Option<&[u8]>| {
            let column = column.unwrap_or_default();
            integer(column)
                .ok_or_else(|| words.error(format!("the {name} is not an integer: {}", quote(column))))
        };
        let source = number("source", column(0))?;
        let n_source = self.n_source.unwrap_or(n_bytes);
        let source = usize::try_from(source).ok().filter(|&s| s < n_source).ok_or_else(|| {
            words.error(format!("source vertex {source} does not exist: there are at most {n_source}"))
        })?;
        let index = number("target", column(1))?;
        let target = target(index, self.n_target)
            .ok_or_else(|| words.error(no_such_target(index, 0, self.n_target)))?;
        let confidence = named(self.columns.confidence).map(|column| {
            float(column)
                .ok_or_else(|| words.error(format!("the confidence is not a number: {}", quote(column))))
        });
        let [face, u, v, w] = self.columns.point.map(named);
        let point = match face {
            Some(face) => {
                let weights = [u, v, w].map(|column| float(column.unwrap_or_default()).unwrap_or(f64::NAN));
                let face = number("face", Some(face))?;
                Some(point(face, weights).map_err(|problem| words.error(problem))?)
            }
            None => None,
        };
        let follows = match named(self.columns.follows) {
            None | Some(b"0") => false,
            Some(b"1") => true,
            Some(other) => return Err(words.error(format!("follows is {}, not 0 or 1", quote(other)))),
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
        if follows {
            self.followers.push(source as u32);
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
        self.followers.sort_unstable();
        PointMap { points: self.has_points.then_some(self.points), followers: self.followers, ..map }
    }
}
