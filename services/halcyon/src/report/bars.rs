//! Named values, side by side in groups.

use plotters::prelude::*;

use super::{ChartError, HEIGHT_PX, WIDTH_PX, frame, scale};

/// Bars in groups: such as left and right for each view.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    y_label: String,
    groups: Vec<String>,
    series: Vec<(String, Vec<f64>)>,
}

impl Bars {
    /// One group of bars for each name.
    pub fn new(y_label: impl Into<String>, groups: Vec<String>) -> Self {
        Self { y_label: y_label.into(), groups, series: Vec::new() }
    }

    /// Adds a bar to each group; a value that is not finite leaves its place empty.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, values: Vec<f64>) -> Self {
        self.series.push((name.into(), values));
        self
    }

    /// The chart as an SVG element.
    ///
    /// # Errors
    /// [`ChartError::Empty`] without a finite value.
    pub fn svg(&self) -> Result<String, ChartError> {
        let values = self.series.iter().flat_map(|(_, values)| values.iter().copied());
        let mut y = scale::range(values, true).ok_or(ChartError::Empty)?;
        if self.series.len() > 1 {
            y = frame::with_room_for_names(y, self.series.len());
        }
        let groups = self.groups.len().max(1);
        let mut svg = String::new();
        let area = SVGBackend::with_string(&mut svg, (WIDTH_PX, HEIGHT_PX)).into_drawing_area();
        area.fill(&WHITE).map_err(ChartError::draw)?;
        let mut builder = ChartBuilder::on(&area);
        builder.margin(12).x_label_area_size(44).y_label_area_size(68);
        let mut chart = builder.build_cartesian_2d(-0.5..groups as f64 - 0.5, y.0..y.1).map_err(ChartError::draw)?;
        let name_of = |at: &f64| {
            let index = at.round();
            let is_group = (at - index).abs() < 1e-6 && index >= 0.0;
            if is_group { self.groups.get(index as usize).cloned().unwrap_or_default() } else { String::new() }
        };
        let (x_text, y_text) = (name_of, |y: &f64| scale::label(*y));
        let mut mesh = chart.configure_mesh();
        frame::style(&mut mesh);
        mesh.disable_x_mesh()
            .x_labels(groups.min(40))
            .x_label_formatter(&x_text)
            .y_desc(&self.y_label)
            .y_label_formatter(&y_text);
        mesh.draw().map_err(ChartError::draw)?;
        // Four fifths of a group's width are bars.
        let width = 0.8 / self.series.len().max(1) as f64;
        for (index, (name, values)) in self.series.iter().enumerate() {
            let colour = scale::colour(index);
            let bars = values.iter().enumerate().filter(|(_, value)| value.is_finite()).map(|(group, value)| {
                let left = group as f64 - 0.4 + width * index as f64;
                Rectangle::new([(left, 0.0), (left + width, *value)], colour.filled())
            });
            let drawn = chart.draw_series(bars).map_err(ChartError::draw)?;
            drawn.label(name).legend(move |(x, y)| Rectangle::new([(x + 4, y - 5), (x + 16, y + 5)], colour.filled()));
        }
        if self.series.len() > 1 {
            frame::names(&mut chart, SeriesLabelPosition::UpperRight)?;
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
    fn bars_have_their_groups_and_names() {
        let bars = Bars::new("error, px", vec!["one".into(), "two".into()])
            .with("left", vec![0.1, 0.2])
            .with("right", vec![f64::NAN, 0.3]);
        let svg = bars.svg().unwrap();
        for part in ["left", "right", "one", "two", "error, px"] {
            assert!(svg.contains(part), "{part}");
        }
        assert_eq!(Bars::new("", Vec::new()).svg(), Err(ChartError::Empty));
    }
}
