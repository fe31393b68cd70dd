//! What an evaluation came to, as tables (CSV), plots (SVG), map files and one HTML page with the worst pairs pictured.

use super::{DescriptorFigures, EvaluateError, MeanSummary, MethodResult};
use crate::dataset::Dataset;
use fmnet::eval::{
    AxisScale, Block, ErrorCurve, Histogram, HtmlReport, LineChart, Section, Series, curves_csv,
};
use fmnet::io::{IoError, write_atomically, write_point_map};
use fmnet::render::pair_picture;
use std::fmt::Write;
use std::path::Path;

/// Bins of the histogram of descriptor distances.
const BINS: usize = 60;
/// Columns of a picture of a pair.
const PICTURE_WIDTH: usize = 900;
/// Pairs pictured: the worst ones of the first method.
const PICTURES: usize = 3;

/// One evaluation to be reported.
#[derive(Clone, Copy, Debug)]
pub struct Chapter<'a> {
    /// Its heading.
    pub title: &'a str,
    /// What was done, in plain text.
    pub text: &'a str,
    /// The dataset that pairs are of.
    pub dataset: &'a Dataset,
    /// What came of it.
    pub results: &'a [MethodResult],
    /// Curves of others, drawn beside.
    pub references: &'a [(String, ErrorCurve)],
}

impl Chapter<'_> {
    /// Writes `summary.csv`, `pairs.csv`, `curves.csv`, `curves.svg`, where there are descriptors `cmc.svg` and
    /// `histogram.svg`, and `maps/METHOD/SOURCE__TARGET.txt`.
    ///
    /// # Errors
    /// If a file or folder cannot be written.
    pub fn write_files(&self, folder: &Path) -> Result<(), EvaluateError> {
        let write = |name: &str, text: String| {
            write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()))
        };
        create(folder)?;
        write("summary.csv", self.summary_csv())?;
        write("pairs.csv", self.pairs_csv())?;
        write("curves.csv", curves_csv(&self.curves()))?;
        for (name, chart) in self.charts() {
            write(&format!("{name}.svg"), chart.to_svg())?;
        }
        for method in self.results {
            let maps = folder.join("maps").join(file_safe(&method.label));
            create(&maps)?;
            for pair in &method.pairs {
                write_point_map(&maps.join(format!("{}__{}.txt", pair.source, pair.target)), &pair.map)?;
            }
        }
        Ok(())
    }

    /// The chapter as a section of an HTML page.
    ///
    /// # Errors
    /// If a mesh of a pictured pair cannot be read.
    pub fn section(&self) -> Result<Section, EvaluateError> {
        let mut blocks = vec![Block::Text(self.text.into()), self.table()];
        blocks.extend(self.charts().into_iter().map(|(_, chart)| Block::Svg(chart.to_svg())));
        blocks.extend(self.pictures()?);
        Ok(Section { title: self.title.into(), blocks })
    }

    fn curves(&self) -> Vec<(&str, &ErrorCurve)> {
        let own = self.results.iter().map(|r| (r.label.as_str(), &r.curve));
        own.chain(self.references.iter().map(|(name, curve)| (name.as_str(), curve))).collect()
    }

    fn charts(&self) -> Vec<(&'static str, LineChart)> {
        let mut charts = vec![("curves", LineChart::error_curves(self.title, &self.curves()))];
        let described = self.described();
        if described.is_empty() {
            return charts;
        }
        let cmc = described.iter().map(|(label, figures)| Series {
            name: (*label).into(),
            points: figures.cmc.iter().enumerate().map(|(i, p)| ((i + 1) as f64, 100.0 * p)).collect(),
        });
        charts.push((
            "cmc",
            LineChart {
                title: format!("{}: descriptors", self.title),
                x_label: "Number of nearest descriptors".into(),
                y_label: "% with the right match among them".into(),
                x_scale: AxisScale::Linear,
                y_scale: AxisScale::Linear,
                y_range: Some([0.0, 100.0]),
                series: cmc.collect(),
            },
        ));
        let histogram = described.iter().map(|(label, figures)| Series {
            name: (*label).into(),
            points: Histogram::new(&figures.distances, BINS, 1.5).points(),
        });
        charts.push((
            "histogram",
            LineChart {
                title: format!("{}: distances of correct matches", self.title),
                x_label: "Descriptor distance / mean of wrong matches".into(),
                y_label: "% of correct matches".into(),
                x_scale: AxisScale::Linear,
                y_scale: AxisScale::Linear,
                y_range: None,
                series: histogram.collect(),
            },
        ));
        charts
    }

    /// Methods with descriptors; of several with the same ones, which differ in what follows, the first.
    fn described(&self) -> Vec<(&str, &DescriptorFigures)> {
        let mut described: Vec<(&str, &DescriptorFigures)> = Vec::new();
        for result in self.results {
            if let Some(figures) = &result.descriptors
                && described.iter().all(|(_, other)| *other != figures)
            {
                described.push((&result.label, figures));
            }
        }
        described
    }

    fn table(&self) -> Block {
        let header = HEADER.iter().map(|h| (*h).to_string()).collect();
        let row = |r: &MethodResult| {
            let cells = cells(&r.mean());
            std::iter::once(r.label.clone()).chain([r.pairs.len().to_string()]).chain(cells).collect()
        };
        Block::Table { header, rows: self.results.iter().map(row).collect() }
    }

    fn summary_csv(&self) -> String {
        let mut csv = String::from(
            "method,pairs,mean_x100,median_x100,exact_percent,within_0.05_percent,auc,coverage_percent,worst_x100,\
             mean_length,worst_length,seconds\n",
        );
        for result in self.results {
            let m = result.mean();
            let _ = writeln!(
                csv,
                "\"{}\",{},{:.4},{:.4},{:.3},{:.3},{:.5},{:.3},{:.3},{:.5},{:.5},{:.3}",
                result.label.replace('"', "\"\""),
                result.pairs.len(),
                100.0 * m.mean,
                100.0 * m.median,
                100.0 * m.exact,
                100.0 * m.within_005,
                m.auc,
                100.0 * m.coverage,
                100.0 * m.worst,
                m.mean_length,
                m.worst_length,
                m.seconds
            );
        }
        csv
    }

    fn pairs_csv(&self) -> String {
        let mut csv = String::from(
            "method,source,target,mean_x100,exact_percent,within_0.05_percent,worst_x100,mirrored,seconds\n",
        );
        for (result, pair) in self.results.iter().flat_map(|r| r.pairs.iter().map(move |p| (r, p))) {
            let s = &pair.summary;
            let _ = writeln!(
                csv,
                "\"{}\",{},{},{:.4},{:.3},{:.3},{:.3},{},{:.3}",
                result.label.replace('"', "\"\""),
                pair.source,
                pair.target,
                100.0 * s.mean,
                100.0 * s.exact,
                100.0 * s.within_005,
                100.0 * s.worst,
                pair.mirrored,
                pair.seconds
            );
        }
        csv
    }

    /// The worst pairs of the first method: source coloured by the map, target by position.
    fn pictures(&self) -> Result<Vec<Block>, EvaluateError> {
        let Some(result) = self.results.first() else { return Ok(Vec::new()) };
        let mut worst: Vec<_> = result.pairs.iter().collect();
        worst.sort_by(|a, b| b.summary.mean.total_cmp(&a.summary.mean));
        let mut blocks = Vec::new();
        for pair in worst.into_iter().take(PICTURES) {
            let shape = |name: &str| self.dataset.shapes.iter().find(|s| s.name == name);
            let (Some(source), Some(target)) = (shape(&pair.source), shape(&pair.target)) else { continue };
            let Ok(picture) = pair_picture(&source.read()?, &target.read()?, &pair.map, PICTURE_WIDTH) else {
                continue;
            };
            let caption = format!(
                "{}, among its worst pairs: {} (left) to {}, mean error x 100: {:.2}",
                result.label,
                pair.source,
                pair.target,
                100.0 * pair.summary.mean
            );
            blocks.push(Block::Image { media_type: "image/png".into(), bytes: picture.to_png(), caption });
        }
        Ok(blocks)
    }
}

/// Writes one HTML page.
///
/// # Errors
/// If the file cannot be written.
pub fn write_html(path: &Path, title: &str, sections: Vec<Section>) -> Result<(), IoError> {
    let html = HtmlReport { title: title.into(), sections }.to_html();
    write_atomically(path, |out| out.write_all(html.as_bytes()))
}

const HEADER: [&str; 11] = [
    "method",
    "pairs",
    "mean x 100",
    "median x 100",
    "exact %",
    "within 0.05 %",
    "AUC",
    "coverage %",
    "mean length",
    "worst length",
    "s / pair",
];

fn cells(mean: &MeanSummary) -> [String; 9] {
    [
        format!("{:.2}", 100.0 * mean.mean),
        format!("{:.2}", 100.0 * mean.median),
        format!("{:.1}", 100.0 * mean.exact),
        format!("{:.1}", 100.0 * mean.within_005),
        format!("{:.4}", mean.auc),
        format!("{:.1}", 100.0 * mean.coverage),
        format!("{:.3}", mean.mean_length),
        format!("{:.3}", mean.worst_length),
        format!("{:.2}", mean.seconds),
    ]
}

fn create(folder: &Path) -> Result<(), IoError> {
    std::fs::create_dir_all(folder).map_err(|source| IoError::Write { path: folder.to_path_buf(), source })
}

/// A label as the name of a folder.
fn file_safe(label: &str) -> String {
    label.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}
