//! Where the waves come from, by the window's film.

use std::f64::consts::TAU;

use halcyon_model::{Directional, Estimate};
use halcyon_ocean::space::{Array, DirectionalSpectrum, Film, Gauges, Removed, Water};

/// Segments, seconds: a third of a minute resolves a peak and leaves a few of them in a window.
const SEGMENT_S: f64 = 20.0;
/// Frequencies looked at, over the mean zero-crossing one.
const BAND: (f64, f64) = (0.6, 1.5);
/// And waves of at least so many cells: of shorter ones too little is left, and noise passes for them.
const WAVE_CELLS_MIN: f64 = 4.0;
/// Gauges are about so wide, metres.
const GAUGE_M: f64 = 0.3;
/// A direction this uncertain is none, radians.
const UNCERTAIN_RAD: f64 = 0.5;

/// Where the waves come from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Directions {
    /// Of all waves together.
    pub overall: Directional,
    /// By frequency, about that of most waves.
    pub spectrum: DirectionalSpectrum,
}

/// Directions of a film of waves of the period `t_z_s`; `freedom` is that of the window's variance. `None` where waves come from
/// everywhere, or too few of them came.
pub(crate) fn directional(film: &Film, t_z_s: f64, freedom: f64) -> Option<Directions> {
    let segment = (SEGMENT_S.min(0.5 * film.duration_s()) * film.rate_hz()).round() as usize;
    let f_z_hz = 1.0 / t_z_s;
    let water = Water::DEEP;
    let shortest_hz = water.omega_radps(TAU / (WAVE_CELLS_MIN * film.cell_m()), 0.0) / TAU;
    let band_hz = (BAND.0 * f_z_hz, (BAND.1 * f_z_hz).min(0.45 * film.rate_hz()).min(shortest_hz));
    let gauges = Gauges::Points { side: 4, cells: ((GAUGE_M / film.cell_m()).round() as usize).clamp(1, 3) };
    let spectrum = Array { gauges, ..Array::new(Removed::Mean, segment, band_hz) }.spectrum(film, &water).ok()?;
    let overall = spectrum.overall()?;
    let (from_rad, spread_rad) = (overall.direction_from_rad(), overall.spread_rad());
    let (wavelength_peak_m, _) = spectrum.wavelengths_m(&water)?;
    // The mean of as many directions as the variance has degrees of freedom.
    let error_rad = 1.96 * spread_rad / freedom.max(1.0).sqrt();
    let known = from_rad.is_finite() && spread_rad.is_finite() && wavelength_peak_m > 0.0 && error_rad < UNCERTAIN_RAD;
    let from_rad = Estimate { value: from_rad, low: from_rad - error_rad, high: from_rad + error_rad };
    known.then_some(Directions { overall: Directional { from_rad, spread_rad, wavelength_peak_m }, spectrum })
}
