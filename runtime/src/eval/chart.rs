//! Line charts as SVG.

use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 420.0;
/// Left, right, top and bottom margin around the plotting area.
const MARGINS: [f64; 4] = [64.0, 20.0, 40.0, 52.0];

/// Colours that readers with any colour vision tell apart (Okabe and Ito 2008), with a dash pattern each so that
/// they do in print.
const STYLES: [(&str, &str); 8] = [
    ("#0072b2", ""),
    ("#d55e00", "7 3"),
    ("#009e73", "2 3"),
    ("#cc79a7", "9 3 2 3"),
    ("#e69f00", "12 4"),
    ("#56b4e9", "4 2"),
    ("#000000", "1 2"),
    ("#8c6d31", "9 3 2 3 2 3"),
];

/// How an axis is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AxisScale {
    /// Evenly.
    #[default]
    Linear,
    /// By powers of ten; points that are not positive are left out.
    Log10,
}

impl AxisScale {
    /// Where a value lies along the axis.
    fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log10 => value.log10(),
        }
    }

    /// Round values between two places, four to eight where the axis is even.
    fn ticks(self, [from, to]: [f64; 2]) -> Vec<f64> {
        if self == Self::Linear {
            return ticks([from, to]);
        }
        let steps: &[f64] = if to - from < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let powers = from.floor() as i32..=to.floor() as i32;
        let all = powers.flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)));
        all.filter(|tick| (from - 1e-9..=to + 1e-9).contains(&tick.log10())).collect()
    }
}

/// One line of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What the legend calls it.
    pub name: String,
    /// Points `(x, y)` in order. Points that are not finite are left out.
    pub points: Vec<(f64, f64)>,
}

/// A chart of several lines with axes, grid and legend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineChart {
    /// Above the chart; may be empty.
    pub title: String,
    /// Below the horizontal axis.
    pub x_label: String,
    /// Beside the vertical axis.
    pub y_label: String,
    /// How the horizontal axis is divided.
    pub x_scale: AxisScale,
    /// How the vertical axis is divided.
    pub y_scale: AxisScale,
    /// Range of the vertical axis; `None` fits it to the data, from 0 where it is divided evenly.
    pub y_range: Option<[f64; 2]>,
    /// The lines, drawn in order.
    pub series: Vec<Series>,
}

impl LineChart {
    /// A chart of cumulative error curves, as in the paper: percent of matches over normalised geodesic error.
    pub fn error_curves(title: &str, curves: &[(&str, &super::ErrorCurve)]) -> Self {
        let series = curves.iter().map(|(name, c)| Series { name: (*name).into(), points: c.points() });
        Self {
            title: title.into(),
            x_label: "Geodesic error / sqrt(area)".into(),
            y_label: "% of correspondences".into(),
            x_scale: AxisScale::Linear,
            y_scale: AxisScale::Linear,
            y_range: Some([0.0, 100.0]),
            series: series.collect(),
        }
    }

    /// The chart as a self-contained SVG document.
    pub fn to_svg(&self) -> String {
        let frame = Frame::fit(self);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" \
             height=\"{HEIGHT}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#222\">\n\
             <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n"
        );
        frame.draw_axes(&mut svg, self);
        for (i, series) in self.series.iter().enumerate() {
            frame.draw_line(&mut svg, series, i);
        }
        frame.draw_legend(&mut svg, self);
        svg.push_str("</svg>\n");
        svg
    }
}

/// The plotting area and the ranges that it shows.
struct Frame {
    x_scale: AxisScale,
    y_scale: AxisScale,
    /// Ranges of the places along the axes.
    x: [f64; 2],
    y: [f64; 2],
}

impl Frame {
    fn fit(chart: &LineChart) -> Self {
        let (x_scale, y_scale) = (chart.x_scale, chart.y_scale);
        let places =
            chart.series.iter().flat_map(|s| &s.points).map(|&(x, y)| (x_scale.place(x), y_scale.place(y)));
        let finite: Vec<(f64, f64)> = places.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        let x = range(finite.iter().map(|p| p.0));
        let y = match (chart.y_range.map(|range| range.map(|y| y_scale.place(y))), y_scale) {
            (Some(given), _) if given.iter().all(|y| y.is_finite()) => given,
            (_, AxisScale::Log10) => range(finite.iter().map(|p| p.1)),
            (_, AxisScale::Linear) => {
                let top = finite.iter().map(|p| p.1).fold(0.0, f64::max);
                [0.0, if top > 0.0 { 1.05 * top } else { 1.0 }]
            }
        };
        Self { x_scale, y_scale, x, y }
    }

    fn at(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (x, y) = (self.x_scale.place(x), self.y_scale.place(y));
        if !x.is_finite() || !y.is_finite() {
            return None;
        }
        let part = |v: f64, [from, to]: [f64; 2]| (v - from) / (to - from);
        let [left, right, top, bottom] = MARGINS;
        let px = left + part(x, self.x) * (WIDTH - left - right);
        let py = HEIGHT - bottom - part(y, self.y).clamp(-0.01, 1.01) * (HEIGHT - top - bottom);
        (px.is_finite() && py.is_finite()).then_some((px, py))
    }

    fn draw_axes(&self, svg: &mut String, chart: &LineChart) {
        let [left, right, top, bottom] = MARGINS;
        let (x1, y1) = (WIDTH - right, HEIGHT - bottom);
        for tick in self.x_scale.ticks(self.x) {
            let part = (self.x_scale.place(tick) - self.x[0]) / (self.x[1] - self.x[0]);
            let x = left + part * (x1 - left);
            let label = number(tick);
            put(svg, format_args!("<path d=\"M{x:.2} {top}V{y1}\" stroke=\"#ddd\"/>"));
            put(
                svg,
                format_args!("<text x=\"{x:.2}\" y=\"{}\" text-anchor=\"middle\">{label}</text>", y1 + 17.0),
            );
        }
        for tick in self.y_scale.ticks(self.y) {
            let part = (self.y_scale.place(tick) - self.y[0]) / (self.y[1] - self.y[0]);
            let y = y1 - part * (y1 - top);
            let label = number(tick);
            put(svg, format_args!("<path d=\"M{left} {y:.2}H{x1}\" stroke=\"#ddd\"/>"));
            let (x, y) = (left - 7.0, y + 4.0);
            put(svg, format_args!("<text x=\"{x}\" y=\"{y:.2}\" text-anchor=\"end\">{label}</text>"));
        }
        put(svg, format_args!("<path d=\"M{left} {top}V{y1}H{x1}\" fill=\"none\" stroke=\"#222\"/>"));
        let (x_mid, y_mid) = ((left + x1) / 2.0, (top + y1) / 2.0);
        let [title, x_label, y_label] = [&chart.title, &chart.x_label, &chart.y_label].map(|t| escape(t));
        put(
            svg,
            format_args!(
                "<text x=\"{x_mid}\" y=\"24\" text-anchor=\"middle\" font-size=\"15\">{title}</text>"
            ),
        );
        let y = HEIGHT - 12.0;
        put(svg, format_args!("<text x=\"{x_mid}\" y=\"{y}\" text-anchor=\"middle\">{x_label}</text>"));
        put(
            svg,
            format_args!(
                "<text transform=\"translate(18 {y_mid}) rotate(-90)\" text-anchor=\"middle\">{y_label}</text>"
            ),
        );
    }

    fn draw_line(&self, svg: &mut String, series: &Series, index: usize) {
        let points = series.points.iter().filter_map(|&(x, y)| self.at(x, y));
        let coordinates: Vec<String> = points.map(|(x, y)| format!("{x:.2},{y:.2}")).collect();
        let (stroke, title) = (stroke(index), escape(&series.name));
        let path = coordinates.join(" ");
        put(
            svg,
            format_args!(
                "<polyline points=\"{path}\" fill=\"none\" {stroke}><title>{title}</title></polyline>"
            ),
        );
    }

    /// Puts the legend in the corner, of the two on the right, that the lines leave freer.
    fn draw_legend(&self, svg: &mut String, chart: &LineChart) {
        let [_, right, top, bottom] = MARGINS;
        let longest = chart.series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        let (width, height) = (54.0 + 7.0 * longest as f64, 10.0 + 18.0 * chart.series.len() as f64);
        let x = (WIDTH - right - width - 8.0).max(MARGINS[0] + 4.0);
        let centre = (HEIGHT + top - bottom) / 2.0;
        let drawn = chart.series.iter().flat_map(|s| &s.points).filter_map(|&(px, py)| self.at(px, py));
        let (upper, lower): (Vec<_>, Vec<_>) = drawn.filter(|p| p.0 >= x).partition(|p| p.1 < centre);
        let y = if upper.len() < lower.len() { top + 8.0 } else { HEIGHT - bottom - height - 8.0 };
        put(
            svg,
            format_args!(
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"#fff\" \
                 fill-opacity=\"0.85\" stroke=\"#bbb\"/>"
            ),
        );
        for (i, series) in chart.series.iter().enumerate() {
            let (line_y, stroke, name) = (y + 14.0 + 18.0 * i as f64, stroke(i), escape(&series.name));
            put(svg, format_args!("<path d=\"M{:.1} {line_y:.1}h28\" fill=\"none\" {stroke}/>", x + 8.0));
            put(svg, format_args!("<text x=\"{:.1}\" y=\"{:.1}\">{name}</text>", x + 44.0, line_y + 4.0));
        }
    }
}

fn stroke(index: usize) -> String {
    // From the second time round, colours go with other dashes.
    let round = index / STYLES.len();
    let (colour, dashes) = (STYLES[index % STYLES.len()].0, STYLES[(index + 3 * round) % STYLES.len()].1);
    let dashes = if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dashes}\"") };
    format!("stroke=\"{colour}\" stroke-width=\"2\"{dashes}")
}

fn put(svg: &mut String, element: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = writeln!(svg, "{element}");
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    if low < high {
        [low, high]
    } else if low.is_finite() {
        [low - 0.5, low + 0.5]
    } else {
        [0.0, 1.0]
    }
}

/// Round values at steps of 1, 2 or 5 times a power of ten, four to eight in the range.
fn ticks([from, to]: [f64; 2]) -> Vec<f64> {
    let rough = (to - from) / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|&s| s >= 0.7 * rough);
    let step = step.unwrap_or(rough);
    let first = (from / step - 1e-9).ceil();
    let last = (to / step + 1e-9).floor();
    (0..=(last - first).max(0.0) as usize).map(|i| (first + i as f64) * step).collect()
}

/// A tick's value without the digits that rounding left.
fn number(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 {
        let digits = format!("{value:.2e}");
        let (mantissa, power) = digits.split_once('e').unwrap_or((&digits, "0"));
        return format!("{}e{power}", mantissa.trim_end_matches('0').trim_end_matches('.'));
    }
    let rounded = format!("{value:.6}");
    rounded.trim_end_matches('0').trim_end_matches('.').into()
}

/// Text for XML and HTML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::ErrorCurve;

    #[test]
    fn chart_names_everything_and_escapes_it() {
        let curve = ErrorCurve::princeton(&[0.0, 0.02, 0.05]);
        let svg = LineChart::error_curves("A < B", &[("ours", &curve), ("R&D", &curve)]).to_svg();
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        for part in ["A &lt; B", ">R&amp;D<", ">ours<", "sqrt(area)", ">0.02<", ">100<"] {
            assert!(svg.contains(part), "{part} is missing");
        }
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn no_two_lines_look_alike() {
        let strokes: std::collections::BTreeSet<String> = (0..3 * STYLES.len()).map(stroke).collect();
        assert_eq!(strokes.len(), 3 * STYLES.len());
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks([0.0, 100.0]), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(
            ticks([0.0, 0.1]).into_iter().map(number).collect::<Vec<_>>(),
            ["0", "0.02", "0.04", "0.06", "0.08", "0.1"]
        );
        assert_eq!(ticks([-1.0, 1.0]), [-1.0, -0.5, 0.0, 0.5, 1.0]);
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten_or_what_lies_between() {
        let labels = |range| AxisScale::Log10.ticks(range).into_iter().map(number).collect::<Vec<_>>();
        assert_eq!(labels([-5.2, -1.9]), ["1e-5", "1e-4", "0.001", "0.01"]);
        assert_eq!(labels([-4.0, -3.2]), ["1e-4", "2e-4", "5e-4"]);
    }

    #[test]
    fn a_decade_has_the_same_height_everywhere() {
        let points = vec![(1.0, 1e-4), (2.0, 1e-2), (3.0, 0.0), (4.0, 1.0)];
        let series = vec![Series { name: "s".into(), points }];
        let chart = LineChart { y_scale: AxisScale::Log10, series, ..LineChart::default() };
        let frame = Frame::fit(&chart);
        let height = |y: f64| frame.at(1.0, y).unwrap().1;
        assert!((height(1e-4) - height(1e-2) - (height(1e-2) - height(1.0))).abs() < 1e-9);
        assert_eq!(frame.at(1.0, 0.0), None);
    }

    #[test]
    fn odd_data_makes_a_chart_all_the_same() {
        let series = |points: &[(f64, f64)]| Series { name: "s".into(), points: points.to_vec() };
        for points in
            [&[][..], &[(1.0, 1.0)], &[(f64::NAN, 1.0), (0.0, f64::INFINITY)], &[(0.0, 0.0), (10.0, 3.0)]]
        {
            for scale in [AxisScale::Linear, AxisScale::Log10] {
                let series = vec![series(points)];
                let chart = LineChart { x_scale: scale, y_scale: scale, series, ..LineChart::default() };
                let svg = chart.to_svg();
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            }
        }
    }
}
