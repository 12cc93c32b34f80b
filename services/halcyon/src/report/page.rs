//! A report: headings, text, tables and figures in one HTML file.

use std::fmt::Write as _;

use base64::prelude::{BASE64_STANDARD, Engine as _};

/// A page that grows from top to bottom. Text is escaped; figures are taken as they are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    title: String,
    body: String,
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1b1b1b;background:#fff}\
h1{font-size:1.7rem;margin-bottom:.2rem}h2{font-size:1.2rem;margin-top:2rem;border-bottom:1px solid #ddd}\
table{border-collapse:collapse;margin:.8rem 0;font-variant-numeric:tabular-nums}\
td,th{padding:.2rem .8rem;border-bottom:1px solid #e3e3e3;text-align:right}td:first-child,th:first-child,td.text{text-align:left}\
figure{margin:1rem 0}figcaption{color:#555;font-size:.9rem}svg,img{max-width:100%;height:auto}";

/// A cell of more is a sentence.
const SENTENCE_LEN: usize = 48;

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), body: String::new() }
    }

    /// A heading within the page.
    pub fn heading(&mut self, text: &str) -> &mut Self {
        // Writing to a string cannot fail.
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
        self
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) -> &mut Self {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
        self
    }

    /// A table; the first column holds names.
    pub fn table<R: AsRef<[String]>>(&mut self, header: &[&str], rows: &[R]) -> &mut Self {
        self.body.push_str("<table><tr>");
        for name in header {
            let _ = write!(self.body, "<th>{}</th>", escaped(name));
        }
        self.body.push_str("</tr>\n");
        for row in rows {
            self.body.push_str("<tr>");
            for cell in row.as_ref() {
                // Sentences read from the left, numbers line up on the right.
                let class = if cell.len() > SENTENCE_LEN { " class=\"text\"" } else { "" };
                let _ = write!(self.body, "<td{class}>{}</td>", escaped(cell));
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</table>\n");
        self
    }

    /// An SVG element with what it shows.
    pub fn figure(&mut self, svg: &str, caption: &str) -> &mut Self {
        let _ = writeln!(self.body, "<figure>{svg}<figcaption>{}</figcaption></figure>", escaped(caption));
        self
    }

    /// A picture (PNG) with what it shows; it travels inside the page.
    pub fn picture(&mut self, png: &[u8], caption: &str) -> &mut Self {
        let data = BASE64_STANDARD.encode(png);
        let caption = escaped(caption);
        let _ = writeln!(
            self.body,
            "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>"
        );
        self
    }

    /// The whole page.
    #[must_use]
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
             <meta name=\"viewport\" content=\"width=device-width\"><style>{STYLE}</style></head>\n\
             <body><h1>{title}</h1>\n{}</body></html>\n",
            self.body
        )
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_never_markup() {
        let mut page = Page::new("a < b & c");
        page.heading("<h>").paragraph("\"<script>\"").table(&["<n>"], &[vec!["<v>".to_owned()]]).figure("<svg/>", "<c>");
        let html = page.html();
        assert!(html.contains("a &lt; b &amp; c") && html.contains("&lt;script&gt;") && html.contains("<figure><svg/>"));
        for bad in ["<script>", "<h>", "<n>", "<v>", "<c>"] {
            assert!(!html.contains(bad), "{bad}");
        }
    }
}
