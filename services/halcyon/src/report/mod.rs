//! Pictures and pages for people: charts as SVG, reports as one self-contained HTML file.
//!
//! Nothing is loaded from anywhere when a report is opened: it works on a boat. What is drawn comes ready from the services;
//! nothing is measured here.
//!
//! ```
//! use halcyon::report::{Chart, Page, Series};
//! let chart = Chart::new("distance, m", "error, mm").with(Series::line("measured", vec![(0.5, 0.3), (1.0, 0.9)]));
//! let mut page = Page::new("Rig");
//! page.paragraph("What this rig can measure.").figure(&chart.svg().unwrap(), "Error against distance");
//! assert!(page.html().contains("<svg"));
//! ```

mod bars;
mod chart;
mod frame;
mod heat;
mod page;
mod scale;

pub use bars::Bars;
pub use chart::{Chart, Series};
pub use heat::HeatMap;
pub use page::Page;

/// Why a chart could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChartError {
    /// Nothing to show.
    #[error("the chart has no finite value")]
    Empty,
    /// What the drawing library says.
    #[error("the chart could not be drawn: {0}")]
    Draw(String),
}

impl ChartError {
    fn draw(error: impl std::fmt::Display) -> Self {
        Self::Draw(error.to_string())
    }
}

/// Width of every chart, pixels; height is a chart's own.
const WIDTH_PX: u32 = 760;
/// Height of line and bar charts, pixels.
const HEIGHT_PX: u32 = 360;
