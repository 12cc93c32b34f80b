//! Lines for a sea of which only densities are known.

use std::f64::consts::TAU;

use super::{ForecastError, Prior, line::Line};
use crate::dispersion::{Depth, wavenumber_radpm};
use crate::{CosTwoS, SampledSpectrum};

/// How a directional spectrum is cut into lines.
///
/// A sum of lines has the spectrum's covariance as long as it is not asked too far away: lines `df` apart repeat themselves after
/// 1/`df`, and n directions tell no more than n/k metres apart. So cells are 1/(2 `span_s`) high (at 1/(1.25 `span_s`) down to 91 % of errors
/// were within their 95 %), and each has k·`extent_m` + 6 directions, up to [`Self::DIRECTIONS_MAX`]. Directions turn by the golden ratio
/// from frequency to frequency, and frequencies within a cell do so from direction to direction (a rank-1 lattice: Niederreiter 1992, ch.
/// 5), so that what errors are left do not add up.
///
/// Lines needed for a sea seen for 16 s over 4 m and forecast for 10 s: the [`Self::LINES_MAX`] strongest hold 97 % of the variance at T_p =
/// 1.5 s, over 99 % from 2.5 s. The weakest are the short waves, which no reading foretells for long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Lowest frequency, hertz.
    pub low_hz: f64,
    /// Highest frequency, hertz: shorter waves are held to be no part of the sea.
    pub high_hz: f64,
    /// From the oldest reading to the last forecast, seconds.
    pub span_s: f64,
    /// Across the readings and the spots forecast, metres.
    pub extent_m: f64,
    /// Lines at most; the weakest are left out.
    pub lines_max: usize,
    /// Depth of the water.
    pub depth: Depth,
}

/// The golden ratio less 1: its multiples spread most evenly over the unit circle.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Grid {
    /// Lines at most, where nothing else is asked for.
    pub const LINES_MAX: usize = 500;
    /// Cells in frequency for each 1/`span_s`.
    const FINENESS: f64 = 2.0;
    /// Cells in frequency at most: for a longer span they are wider.
    pub const FREQUENCIES_MAX: usize = 256;
    /// Directions of one frequency at most.
    pub const DIRECTIONS_MAX: usize = 48;

    /// Deep water from half to four times the peak's frequency, for readings over `extent_m` that span `span_s` with the forecast.
    #[must_use]
    pub fn about_peak(peak_hz: f64, span_s: f64, extent_m: f64) -> Self {
        let (low_hz, high_hz) = (0.5 * peak_hz, 4.0 * peak_hz);
        Self { low_hz, high_hz, span_s, extent_m, lines_max: Self::LINES_MAX, depth: Depth::DEEP }
    }

    /// Lines of `density`: m²/Hz/rad at a frequency, hertz, and the direction waves travel towards, radians clockwise from north. What is
    /// not a density (negative, NaN) is none.
    ///
    /// # Errors
    /// [`ForecastError::Grid`] for a grid that is none; [`ForecastError::NoLines`] where there is no energy in it.
    pub fn directional(&self, density: impl Fn(f64, f64) -> f64) -> Result<Prior, ForecastError> {
        let Self { low_hz, high_hz, span_s, extent_m, .. } = *self;
        let band = low_hz > 0.0 && high_hz > low_hz && high_hz < 1e3;
        if !(band && span_s > 0.0 && extent_m >= 0.0) {
            return Err(ForecastError::Grid);
        }
        let cells = ((high_hz - low_hz) * span_s * Self::FINENESS).ceil().clamp(1.0, Self::FREQUENCIES_MAX as f64);
        let df_hz = (high_hz - low_hz) / cells;
        let mut lines = Vec::new();
        for cell in 0..cells as u32 {
            let cell_hz = low_hz + f64::from(cell) * df_hz;
            let k_radpm = wavenumber_radpm(TAU * (cell_hz + 0.5 * df_hz), self.depth);
            let directions = (k_radpm * extent_m + 6.0).ceil().clamp(6.0, Self::DIRECTIONS_MAX as f64);
            let step_rad = TAU / directions;
            for i in 0..directions as u32 {
                let towards_rad = (f64::from(i) + (f64::from(cell) * GOLDEN).fract()) * step_rad;
                let f_hz = cell_hz + ((f64::from(i) + 0.5) * GOLDEN).fract() * df_hz;
                // The mean over the cell, so that no energy is lost between lines: a peak may be narrower than its cell.
                let mean =
                    [1.0, 3.0, 5.0].map(|sixth| density(cell_hz + sixth / 6.0 * df_hz, towards_rad)).iter().sum::<f64>() / 3.0;
                if mean > 0.0 {
                    let omega_radps = TAU * f_hz;
                    let k_radpm = wavenumber_radpm(omega_radps, self.depth);
                    let (east, north) = towards_rad.sin_cos();
                    let variance_m2 = mean * df_hz * step_rad;
                    lines.push(Line { k_north_radpm: k_radpm * north, k_east_radpm: k_radpm * east, omega_radps, variance_m2 });
                }
            }
        }
        Ok(Prior { span_s, extent_m, ..Prior::new(lines)? }.with_at_most(self.lines_max))
    }

    /// Lines of a frequency spectrum, m²/Hz, spread about `towards_rad`, the direction waves travel towards, radians clockwise from
    /// north. A [`CosTwoS`] of 0 is all round.
    ///
    /// # Errors
    /// As [`Self::directional`].
    pub fn spread(&self, spectrum: impl Fn(f64) -> f64, towards_rad: f64, spread: CosTwoS) -> Result<Prior, ForecastError> {
        self.directional(|f_hz, rad| spectrum(f_hz) * spread.density_per_rad(rad - towards_rad))
    }
}

/// A table as a density at any frequency, m²/Hz: straight between its frequencies, 0 beyond them.
pub fn interpolated(table: &SampledSpectrum) -> impl Fn(f64) -> f64 {
    move |f_hz| {
        let place = f_hz / table.df_hz();
        let below = place.floor();
        let at = |i: f64| if i >= 0.0 { table.density_m2_per_hz().get(i as usize).copied().unwrap_or(0.0) } else { 0.0 };
        at(below) + (at(below + 1.0) - at(below)) * (place - below)
    }
}
