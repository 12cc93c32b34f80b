//! Lines and points over two axes.

use plotters::prelude::*;

use super::{ChartError, HEIGHT_PX, WIDTH_PX, frame, scale};

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    Line,
    Dashed,
    Points,
}

/// Some points with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    name: String,
    points: Vec<(f64, f64)>,
    style: Style,
}

impl Series {
    /// Points joined by a line, in the order given. A point that is not finite breaks the line.
    pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, style: Style::Line }
    }

    /// A dashed line: for theory, limits and other people's values.
    pub fn dashed(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, style: Style::Dashed }
    }

    /// Single points.
    pub fn points(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, style: Style::Points }
    }
}

/// A chart of one or more series.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    x_label: String,
    y_label: String,
    series: Vec<Series>,
    from_zero: bool,
    log_y: bool,
    equal_scales: bool,
    low_legend: bool,
}

impl Chart {
    /// An empty chart; labels name quantity and unit.
    pub fn new(x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            x_label: x_label.into(),
            y_label: y_label.into(),
            series: Vec::new(),
            from_zero: false,
            log_y: false,
            equal_scales: false,
            low_legend: false,
        }
    }

    /// Adds a series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Lets the y axis begin at zero.
    #[must_use]
    pub fn from_zero(mut self) -> Self {
        self.from_zero = true;
        self
    }

    /// A logarithmic y axis; values of zero and below are left out.
    #[must_use]
    pub fn log_y(mut self) -> Self {
        self.log_y = true;
        self
    }

    /// Names the series in the lower right corner: for curves that rise.
    #[must_use]
    pub fn low_legend(mut self) -> Self {
        self.low_legend = true;
        self
    }

    /// The same length for a unit on both axes: for maps and scatter of residuals.
    #[must_use]
    pub fn equal_scales(mut self) -> Self {
        self.equal_scales = true;
        self
    }

    /// The chart as an SVG element.
    ///
    /// # Errors
    /// [`ChartError::Empty`] without a finite point.
    pub fn svg(&self) -> Result<String, ChartError> {
        // A logarithmic axis is a linear one of logarithms with other labels; the logarithm of what it cannot show is no number.
        let place = |(x, y): (f64, f64)| (x, if self.log_y { y.log10() } else { y });
        let is_shown = |(x, y): (f64, f64)| x.is_finite() && y.is_finite();
        let all = || self.series.iter().flat_map(|series| series.points.iter().map(|p| place(*p))).filter(|p| is_shown(*p));
        let mut x = scale::range(all().map(|point| point.0), false).ok_or(ChartError::Empty)?;
        let mut y = scale::range(all().map(|point| point.1), self.from_zero && !self.log_y).ok_or(ChartError::Empty)?;
        let names = self.series.iter().filter(|series| !series.name.is_empty()).count();
        if names > 1 && !self.low_legend && !self.equal_scales {
            y = frame::with_room_for_names(y, names);
        }
        let mut height_px = HEIGHT_PX;
        if self.equal_scales {
            // Square but for the axis labels.
            height_px = WIDTH_PX - 24;
            let half = (x.1 - x.0).max(y.1 - y.0) / 2.0;
            let (x_middle, y_middle) = (f64::midpoint(x.0, x.1), f64::midpoint(y.0, y.1));
            (x, y) = ((x_middle - half, x_middle + half), (y_middle - half, y_middle + half));
        }
        let mut svg = String::new();
        let area = SVGBackend::with_string(&mut svg, (WIDTH_PX, height_px)).into_drawing_area();
        area.fill(&WHITE).map_err(ChartError::draw)?;
        let mut builder = ChartBuilder::on(&area);
        builder.margin(12).x_label_area_size(44).y_label_area_size(68);
        let mut chart = builder.build_cartesian_2d(x.0..x.1, y.0..y.1).map_err(ChartError::draw)?;
        // On a logarithmic axis two digits tell all, and four would run into the axis's name.
        let two_digits = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
        let (x_span, y_span) = (x.1 - x.0, y.1 - y.0);
        let y_text = |value: &f64| {
            if self.log_y { scale::label(two_digits(10_f64.powf(*value))) } else { scale::label_in(*value, y_span) }
        };
        let x_text = |value: &f64| scale::label_in(*value, x_span);
        let mut mesh = chart.configure_mesh();
        frame::style(&mut mesh);
        mesh.x_desc(&self.x_label).y_desc(&self.y_label).x_label_formatter(&x_text).y_label_formatter(&y_text);
        mesh.draw().map_err(ChartError::draw)?;
        for (index, series) in self.series.iter().enumerate() {
            let colour = scale::colour(index);
            let points: Vec<(f64, f64)> = series.points.iter().map(|point| place(*point)).collect();
            let name = &series.name;
            match series.style {
                Style::Points => {
                    let dots = points.into_iter().filter(|p| is_shown(*p)).map(|p| Circle::new(p, 3, colour.mix(0.8).filled()));
                    let drawn = chart.draw_series(dots).map_err(ChartError::draw)?;
                    if !name.is_empty() {
                        drawn.label(name).legend(move |(x, y)| Circle::new((x + 10, y), 3, colour.filled()));
                    }
                }
                Style::Line | Style::Dashed => {
                    for (part, run) in points.split(|point| !is_shown(*point)).enumerate() {
                        let run = run.iter().copied();
                        let stroke = colour.stroke_width(2);
                        let drawn = if series.style == Style::Dashed {
                            chart.draw_series(DashedLineSeries::new(run, 6, 4, stroke))
                        } else {
                            chart.draw_series(LineSeries::new(run, stroke))
                        };
                        let drawn = drawn.map_err(ChartError::draw)?;
                        // One name, however often the line is broken.
                        if part == 0 && !name.is_empty() {
                            let drawn = drawn.label(name);
                            if series.style == Style::Dashed {
                                drawn.legend(move |(x, y)| {
                                    plotters::element::DashedPathElement::new([(x, y), (x + 20, y)], 6, 4, stroke)
                                });
                            } else {
                                drawn.legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], stroke));
                            }
                        }
                    }
                }
            }
        }
        if names > 0 {
            let position = if self.low_legend { SeriesLabelPosition::LowerRight } else { SeriesLabelPosition::UpperRight };
            frame::names(&mut chart, position)?;
        }
        area.present().map_err(ChartError::draw)?;
        drop(chart);
        drop(area);
        Ok(svg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_is_an_svg_with_its_names() {
        let chart = Chart::new("time, s", "height, m")
            .with(Series::line("stereo", vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)]))
            .with(Series::dashed("probe", vec![(0.0, 1.0), (2.0, 2.0)]))
            .with(Series::points("", vec![(1.0, 2.0)]));
        let svg = chart.svg().unwrap();
        for part in ["<svg", "stereo", "probe", "time, s", "height, m"] {
            assert!(svg.contains(part), "{part}");
        }
    }

    #[test]
    fn what_cannot_be_shown_is_left_out() {
        let nothing = Chart::new("", "").log_y().with(Series::line("", vec![(1.0, 0.0), (2.0, -1.0), (f64::NAN, 1.0)]));
        assert_eq!(nothing.svg(), Err(ChartError::Empty));
        assert!(nothing.with(Series::points("", vec![(1.0, 1e-9), (2.0, 1e9)])).svg().is_ok());
    }
}
