//! What is drawn round every chart: axes, grid and names.

use plotters::chart::MeshStyle;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

use super::ChartError;

/// Room for the names of `names` series above the highest value, so that they cover none.
pub(super) fn with_room_for_names(range: (f64, f64), names: usize) -> (f64, f64) {
    (range.0, range.1 + 0.08 * names as f64 * (range.1 - range.0))
}

/// What every mesh has in common; labels and special cases are the caller's.
pub(super) fn style<'a, 'b, X, Y, DB>(mesh: &mut MeshStyle<'a, 'b, X, Y, DB>)
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    DB: DrawingBackend,
{
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13));
}

/// The box with the names of the series.
pub(super) fn names<'a, DB, CT>(chart: &mut ChartContext<'a, DB, CT>, position: SeriesLabelPosition) -> Result<(), ChartError>
where
    DB: DrawingBackend + 'a,
    CT: CoordTranslate,
{
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.2))
        .label_font(("sans-serif", 13))
        .draw()
        .map_err(ChartError::draw)
}
