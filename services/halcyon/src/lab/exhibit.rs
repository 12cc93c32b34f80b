//! What an experiment has to show.

use halcyon_reconstruction::core::cloud::PointCloud;
use halcyon_reconstruction::core::show;
use halcyon_reconstruction::files::ply;
use serde::Serialize;

use crate::report::{ChartError, Page};

/// One figure, beside the thesis's where it has one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Which figure of the experiment.
    pub figure: String,
    /// Its unit; 1 for counts and ratios.
    pub unit: &'static str,
    /// What came out; null where nothing did.
    pub value: f64,
    /// What the thesis reached, where it says.
    pub thesis: Option<f64>,
}

/// A file beside the report.
#[derive(Debug, Clone, PartialEq)]
pub struct File {
    /// Its name, no folder.
    pub name: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

/// A table: header and rows.
type Table = (Vec<&'static str>, Vec<Vec<String>>);

/// A piece of the page.
#[derive(Debug, Clone, PartialEq)]
enum Part {
    Text(String),
    Table(Table),
    Svg(String, String),
    Png(Vec<u8>, String),
}

/// Width of the widest pictures, pixels: that of the page, and half as much for sharp screens.
const SHOWN_PX: u32 = 1200;

/// What an experiment has to show, from top to bottom.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Exhibit {
    parts: Vec<Part>,
    /// Figures that stand against the thesis's.
    pub findings: Vec<Finding>,
    /// Clouds and meshes for other programs.
    pub files: Vec<File>,
}

impl Exhibit {
    /// A figure of ours, and the thesis's.
    pub(super) fn find(&mut self, figure: impl Into<String>, unit: &'static str, value: f64, thesis: Option<f64>) {
        self.findings.push(Finding { figure: figure.into(), unit, value, thesis });
    }

    pub(super) fn text(&mut self, text: impl Into<String>) {
        self.parts.push(Part::Text(text.into()));
    }

    pub(super) fn table(&mut self, header: Vec<&'static str>, rows: Vec<Vec<String>>) {
        self.parts.push(Part::Table((header, rows)));
    }

    /// A chart; one that has nothing to show says so in its place.
    pub(super) fn chart(&mut self, svg: Result<String, ChartError>, caption: impl Into<String>) -> Result<(), ChartError> {
        let caption = caption.into();
        match svg {
            Ok(svg) => self.parts.push(Part::Svg(svg, caption)),
            Err(ChartError::Empty) => self.parts.push(Part::Text(format!("{caption}: nothing to show"))),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// A picture, made as large as a page shows it.
    pub(super) fn png(&mut self, png: Vec<u8>, caption: impl Into<String>) {
        // What cannot be made smaller is shown as it is.
        let picture = show::for_page(&png, SHOWN_PX).unwrap_or(png);
        self.parts.push(Part::Png(picture, caption.into()));
    }

    /// A cloud as a PLY file.
    pub(super) fn cloud(&mut self, name: &str, cloud: &PointCloud) {
        self.files.push(File { name: format!("{name}.ply"), bytes: ply::encode_cloud(cloud) });
    }

    pub(super) fn add_to(&self, page: &mut Page) {
        for part in &self.parts {
            match part {
                Part::Text(text) => page.paragraph(text),
                Part::Table((header, rows)) => page.table(header, rows),
                Part::Svg(svg, caption) => page.figure(svg, caption),
                Part::Png(png, caption) => page.picture(png, caption),
            };
        }
        if !self.files.is_empty() {
            let names: Vec<&str> = self.files.iter().map(|file| file.name.as_str()).collect();
            page.paragraph(&format!("Files beside this page: {}", names.join(", ")));
        }
    }

    /// The findings as rows of a table.
    pub(super) fn rows(&self, experiment: &str) -> Vec<Vec<String>> {
        let row = |finding: &Finding| {
            let thesis = finding.thesis.map_or_else(|| "-".to_owned(), number);
            // 1 is no unit to a reader.
            let unit = if finding.unit == "1" { "" } else { finding.unit };
            vec![experiment.to_owned(), finding.figure.clone(), unit.to_owned(), number(finding.value), thesis]
        };
        self.findings.iter().map(row).collect()
    }
}

/// A number for a table: whole ones whole, others with four digits.
#[must_use]
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "none".to_owned();
    }
    if value.fract() == 0.0 && value.abs() < 1e7 {
        return format!("{value:.0}");
    }
    let size = value.abs();
    if !(1e-3..1e6).contains(&size) {
        return format!("{value:.3e}");
    }
    let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        let text = [3.0, 145_445.0, 0.465, -12.345_6, 7.5094e-8, 2e9, f64::NAN].map(number);
        assert_eq!(text, ["3", "145445", "0.4650", "-12.35", "7.509e-8", "2.000e9", "none"]);
    }
}
