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
td,th{padding:.2rem .8rem;border-bottom:1px solid #e3e3e3;text-align:right}td:first-child,th:first-child,.text{text-align:left}\
figure{margin:1rem 0}figcaption{color:#555;font-size:.9rem}svg,img{max-width:100%;height:auto}";

/// Whether a cell holds a number, with or without a unit, or stands for one.
fn is_number(cell: &str) -> bool {
    let cell = cell.trim().trim_start_matches(['-', '+', '−', '±', ' ']);
    cell.is_empty() || cell == "none" || cell.starts_with(|c: char| c.is_ascii_digit())
}

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

    /// A heading that [`Self::contents`] leads to.
    pub fn anchored_heading(&mut self, anchor: &str, text: &str) -> &mut Self {
        let _ = writeln!(self.body, "<h2 id=\"{}\">{}</h2>", escaped(anchor), escaped(text));
        self
    }

    /// A list of links to anchored headings: anchors and texts.
    pub fn contents(&mut self, headings: &[(String, String)]) -> &mut Self {
        self.body.push_str("<nav><ul>\n");
        for (anchor, text) in headings {
            let _ = writeln!(self.body, "<li><a href=\"#{}\">{}</a></li>", escaped(anchor), escaped(text));
        }
        self.body.push_str("</ul></nav>\n");
        self
    }

    /// What another page's [`Self::into_body`] has given.
    pub fn append(&mut self, body: &str) -> &mut Self {
        self.body.push_str(body);
        self
    }

    /// Everything below the title, as HTML.
    #[must_use]
    pub fn into_body(self) -> String {
        self.body
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) -> &mut Self {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
        self
    }

    /// A table; the first column holds names.
    pub fn table<R: AsRef<[String]>>(&mut self, header: &[&str], rows: &[R]) -> &mut Self {
        // Words read from the left, numbers line up on the right.
        let is_words = |column: usize| rows.iter().filter_map(|row| row.as_ref().get(column)).any(|cell| !is_number(cell));
        let classes: Vec<&str> = (0..header.len()).map(|i| if is_words(i) { " class=\"text\"" } else { "" }).collect();
        self.body.push_str("<table><tr>");
        for (name, class) in header.iter().zip(&classes) {
            let _ = write!(self.body, "<th{class}>{}</th>", escaped(name));
        }
        self.body.push_str("</tr>\n");
        for row in rows {
            self.body.push_str("<tr>");
            for (i, cell) in row.as_ref().iter().enumerate() {
                let _ = write!(self.body, "<td{}>{}</td>", classes.get(i).unwrap_or(&""), escaped(cell));
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

    /// A picture (PNG or JPEG) with what it shows; it travels inside the page.
    pub fn picture(&mut self, picture: &[u8], caption: &str) -> &mut Self {
        let kind = if picture.starts_with(&[0xff, 0xd8]) { "jpeg" } else { "png" };
        let data = BASE64_STANDARD.encode(picture);
        let caption = escaped(caption);
        let _ = writeln!(
            self.body,
            "<figure><img alt=\"{caption}\" src=\"data:image/{kind};base64,{data}\"><figcaption>{caption}</figcaption></figure>"
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
