//! A number for each place of a grid, as colour.

use plotters::prelude::*;

use super::{ChartError, WIDTH_PX, scale};

/// A coloured map: coverage of a picture, uncertainty over it, elevation.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    cols: usize,
    values: Vec<f64>,
    x: (f64, f64),
    y: (f64, f64),
    x_label: String,
    y_label: String,
    unit: String,
}

impl HeatMap {
    /// `values` are row-major, `cols` in a row. `x` and `y` are what the outer edges of the map stand for: first column to last,
    /// first row to last; a `y` that falls puts the first row on top. NaN is drawn grey.
    #[must_use]
    pub fn new(cols: usize, values: Vec<f64>, x: (f64, f64), y: (f64, f64)) -> Self {
        Self { cols: cols.max(1), values, x, y, x_label: String::new(), y_label: String::new(), unit: String::new() }
    }

    /// Names of the axes, and of what the colours mean, with units.
    #[must_use]
    pub fn labelled(mut self, x: impl Into<String>, y: impl Into<String>, unit: impl Into<String>) -> Self {
        (self.x_label, self.y_label, self.unit) = (x.into(), y.into(), unit.into());
        self
    }

    /// The map and its scale as an SVG element.
    ///
    /// # Errors
    /// [`ChartError::Empty`] without a finite value.
    pub fn svg(&self) -> Result<String, ChartError> {
        let rows = self.values.len().div_ceil(self.cols).max(1);
        let finite = || self.values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        if low > high {
            return Err(ChartError::Empty);
        }
        let span = if high > low { high - low } else { 1.0 };
        // Places keep their shape: the plot is 560 px wide, and as high as the map asks for within reason.
        let shape = ((self.y.1 - self.y.0) / (self.x.1 - self.x.0)).abs();
        let height_px = (560.0 * if shape.is_finite() { shape.clamp(0.2, 1.3) } else { 1.0 }) as u32 + 68;
        let mut svg = String::new();
        let area = SVGBackend::with_string(&mut svg, (WIDTH_PX, height_px)).into_drawing_area();
        area.fill(&WHITE).map_err(ChartError::draw)?;
        let (map, key) = area.split_horizontally(WIDTH_PX - 110);
        let mut builder = ChartBuilder::on(&map);
        builder.margin(12).x_label_area_size(44).y_label_area_size(58);
        let mut chart = builder.build_cartesian_2d(self.x.0..self.x.1, self.y.0..self.y.1).map_err(ChartError::draw)?;
        self.axes(&mut chart)?;
        let (dx, dy) = ((self.x.1 - self.x.0) / self.cols as f64, (self.y.1 - self.y.0) / rows as f64);
        let cells = self.values.iter().enumerate().map(|(i, value)| {
            let (row, col) = ((i / self.cols) as f64, (i % self.cols) as f64);
            let (x, y) = (self.x.0 + dx * col, self.y.0 + dy * row);
            let colour = if value.is_finite() { scale::viridis((value - low) / span) } else { RGBColor(200, 200, 200) };
            Rectangle::new([(x, y), (x + dx, y + dy)], colour.filled())
        });
        chart.draw_series(cells).map_err(ChartError::draw)?;
        self.key(&key, low, high.max(low + f64::MIN_POSITIVE), span)?;
        area.present().map_err(ChartError::draw)?;
        drop((chart, map, key));
        drop(area);
        Ok(svg)
    }

    fn axes<'a, DB: DrawingBackend + 'a>(
        &self,
        chart: &mut ChartContext<
            'a,
            DB,
            Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
        >,
    ) -> Result<(), ChartError> {
        chart
            .configure_mesh()
            .disable_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&|x| scale::label(*x))
            .y_label_formatter(&|y| scale::label(*y))
            .axis_desc_style(("sans-serif", 15))
            .label_style(("sans-serif", 13))
            .draw()
            .map_err(ChartError::draw)
    }

    /// What the colours mean.
    fn key<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, plotters::coord::Shift>,
        low: f64,
        high: f64,
        span: f64,
    ) -> Result<(), ChartError> {
        const STEPS: usize = 64;
        let mut builder = ChartBuilder::on(area);
        builder.margin_top(12).margin_bottom(56).margin_left(4).margin_right(12).y_label_area_size(70);
        let top = low + span;
        let mut chart = builder.build_cartesian_2d(0.0..1.0, low..top.max(high)).map_err(ChartError::draw)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .disable_x_axis()
            .y_desc(&self.unit)
            .y_label_formatter(&|y| scale::label(*y))
            .axis_desc_style(("sans-serif", 15))
            .label_style(("sans-serif", 13))
            .draw()
            .map_err(ChartError::draw)?;
        let step = span / STEPS as f64;
        let bands = (0..STEPS).map(|i| {
            let y = low + step * i as f64;
            Rectangle::new([(0.0, y), (1.0, y + step)], scale::viridis((i as f64 + 0.5) / STEPS as f64).filled())
        });
        chart.draw_series(bands).map_err(ChartError::draw)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_has_a_colour_for_every_cell() {
        let svg = HeatMap::new(3, vec![1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0], (0.0, 640.0), (480.0, 0.0))
            .labelled("x, px", "y, px", "corners")
            .svg()
            .unwrap();
        assert!(svg.matches("<rect").count() >= 6 + 64, "six cells and the key");
        assert!(svg.contains("corners") && svg.contains("#C8C8C8"), "a cell without a value is grey");
        assert_eq!(HeatMap::new(2, vec![f64::NAN; 4], (0.0, 1.0), (0.0, 1.0)).svg(), Err(ChartError::Empty));
        assert!(HeatMap::new(2, vec![3.0; 4], (0.0, 1.0), (0.0, 1.0)).svg().is_ok(), "all alike");
    }
}
