//! A self-contained HTML report.

use std::fmt::Write;

use super::chart::escape;

/// One piece of a section.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Block {
    /// A paragraph of plain text.
    Text(String),
    /// An SVG document, as [`LineChart::to_svg`](super::LineChart::to_svg) makes it, put in as it is.
    Svg(String),
    /// A table of plain text.
    Table {
        /// Heads of the columns.
        header: Vec<String>,
        /// Rows; the first cell names the row.
        rows: Vec<Vec<String>>,
    },
    /// A picture, embedded.
    Image {
        /// Its media type, such as `image/png`.
        media_type: String,
        /// The file's bytes.
        bytes: Vec<u8>,
        /// What it shows.
        caption: String,
    },
}

/// A titled part of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// What it says, in order.
    pub blocks: Vec<Block>,
}

/// A report in one HTML file that opens from disk and loads nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct HtmlReport {
    /// Title of the page.
    pub title: String,
    /// Its sections, in order.
    pub sections: Vec<Section>,
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;color:#222;max-width:64rem;margin:2rem auto;padding:0 1rem}\
h1,h2{line-height:1.2}table{border-collapse:collapse;margin:1rem 0;font-size:.85em;font-variant-numeric:tabular-nums}\
th,td{padding:.3rem .5rem;border-bottom:1px solid #ddd;text-align:right}\
th:first-child,td:first-child{text-align:left}figure{margin:1rem 0}svg,img{max-width:100%;height:auto}\
figcaption{color:#555;font-size:.9em}";

impl HtmlReport {
    /// The report as one HTML document.
    pub fn to_html(&self) -> String {
        let title = escape(&self.title);
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        for section in &self.sections {
            let _ = writeln!(html, "<section>\n<h2>{}</h2>", escape(&section.title));
            for block in &section.blocks {
                block.write_to(&mut html);
            }
            html.push_str("</section>\n");
        }
        html.push_str("</body>\n</html>\n");
        html
    }
}

impl Block {
    fn write_to(&self, html: &mut String) {
        match self {
            Self::Text(text) => {
                let _ = writeln!(html, "<p>{}</p>", escape(text));
            }
            Self::Svg(svg) => {
                let _ = writeln!(html, "<figure>{svg}</figure>");
            }
            Self::Table { header, rows } => {
                html.push_str("<table>\n");
                write_row(html, "th", header);
                rows.iter().for_each(|row| write_row(html, "td", row));
                html.push_str("</table>\n");
            }
            Self::Image { media_type, bytes, caption } => {
                let (media_type, data, caption) = (escape(media_type), base64(bytes), escape(caption));
                let _ = writeln!(
                    html,
                    "<figure><img src=\"data:{media_type};base64,{data}\" alt=\"{caption}\">\
                     <figcaption>{caption}</figcaption></figure>"
                );
            }
        }
    }
}

fn write_row(html: &mut String, tag: &str, cells: &[String]) {
    html.push_str("<tr>");
    for cell in cells {
        let _ = write!(html, "<{tag}>{}</{tag}>", escape(cell));
    }
    html.push_str("</tr>\n");
}

/// Base64 with padding (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = (0..3).fold(0u32, |g, i| g << 8 | u32::from(*chunk.get(i).unwrap_or(&0)));
        for i in 0..4 {
            let letter = ALPHABET[(group >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        let expected = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (n, text) in expected.into_iter().enumerate() {
            assert_eq!(base64(&b"foobar"[..n]), text);
        }
    }

    #[test]
    fn report_escapes_text_and_embeds_the_rest() {
        let report = HtmlReport {
            title: "a & b".into(),
            sections: vec![Section {
                title: "results".into(),
                blocks: vec![
                    Block::Text("x < y".into()),
                    Block::Svg("<svg></svg>".into()),
                    Block::Table { header: vec!["h".into()], rows: vec![vec!["<1>".into()]] },
                    Block::Image {
                        media_type: "image/png".into(),
                        bytes: b"foo".to_vec(),
                        caption: "c\"".into(),
                    },
                ],
            }],
        };
        let html = report.to_html();
        for part in [
            "<title>a &amp; b</title>",
            "<p>x &lt; y</p>",
            "<figure><svg></svg></figure>",
            "<th>h</th>",
            "<td>&lt;1&gt;</td>",
            "src=\"data:image/png;base64,Zm9v\" alt=\"c&quot;\"",
        ] {
            assert!(html.contains(part), "{part} is missing");
        }
        assert!(!html.contains("http"), "loads something");
    }
}
