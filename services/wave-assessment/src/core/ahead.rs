//! Quiet moments of the next seconds, by the waves that the window has seen.

use halcyon_model::{CalmForecast, CalmWindow, Directional, LocalPoint, Stamp};
use halcyon_ocean::forecast::grid::interpolated;
use halcyon_ocean::forecast::{Forecast, Grid, Level, Limits, Options, Reading, Spot};
use halcyon_ocean::{CosTwoS, SampledSpectrum};

use super::spectrum::Spectral;
use super::window::Window;
use crate::config::Config;

/// How far ahead is looked, seconds: further, nothing is known of waves that long.
const AHEAD_S: f64 = 10.0;
/// Shorter quiet moments are of no use to something that has to settle, seconds.
const LEAST_S: f64 = 1.5;
/// Where the expected error is stated, seconds ahead.
const ERROR_AHEAD_S: f64 = 3.0;

/// The forecast at `place`; `None` where waves are not known well enough for one.
pub(crate) fn calm(
    window: &Window,
    spectral: &Spectral,
    direction: &Directional,
    place: LocalPoint,
    config: &Config,
) -> Option<CalmForecast> {
    let newest = window.newest()?.stamp;
    let readings = readings(window, newest);
    let options = Options { level: Level::Free, ..Options::default() };
    let table = SampledSpectrum::new(spectral.spectrum.df_hz, spectral.spectrum.density_m2_per_hz.clone()).ok()?;
    // m1 = s/(s + 1) for cos-2s, and the circular spread is √(2 (1 − m1)).
    let m1 = (1.0 - 0.5 * direction.spread_rad.powi(2)).clamp(0.1, 0.98);
    let spread = CosTwoS::new(m1 / (1.0 - m1)).ok()?;
    let towards_rad = direction.from_rad.value + std::f64::consts::PI;
    let footprint_m = window.newest()?.footprint_m;
    let grid = Grid::about_peak(1.0 / spectral.t_p_s.value, options.span_s + AHEAD_S, 2.0 * footprint_m);
    let prior = grid.spread(interpolated(&table), towards_rad, spread).ok()?;
    let sea_m2 = prior.sea().elevation_m2;
    let forecast = Forecast::fit(&readings, &prior, 0.0, &options).ok()?;

    let airframe = config.airframe.resolved().ok()?;
    let kept = 1.0 - config.airframe.margin;
    let limits = Limits {
        crest_m: (airframe.float_depth_m * kept).min(0.5 * config.h_highest_m_max),
        slope: (airframe.tip_angle_rad * kept).tan(),
        vertical_speed_mps: (airframe.touchdown_speed_mps * kept - config.airframe.descent_mps).max(0.0),
    };
    let spot = Spot { north_m: place.north_m, east_m: place.east_m };
    let outlook = forecast.at(spot, ERROR_AHEAD_S);
    let windows = forecast.calm_windows(spot, &limits, 0.0, AHEAD_S, LEAST_S);
    let error_share = outlook.elevation_sigma_m / sea_m2.sqrt();
    error_share.is_finite().then(|| CalmForecast {
        place,
        from: newest,
        error_share,
        windows: windows
            .iter()
            .map(|w| CalmWindow { from: newest.plus_secs_f64(w.from_s), to: newest.plus_secs_f64(w.to_s) })
            .collect(),
    })
}

/// The gauges' readings, seconds before `newest`, each frame with its own unknown level.
fn readings(window: &Window, newest: Stamp) -> Vec<Reading> {
    let of_frame = |(group, frame): (usize, &super::window::Frame)| {
        let t_s = frame.stamp.seconds_since(newest);
        let readings = frame.readings.iter().flatten().map(move |reading| Reading {
            north_m: reading.place.north_m,
            east_m: reading.place.east_m,
            t_s,
            elevation_m: reading.samples[0].elevation_m,
            sigma_m: reading.samples[0].sigma_m,
            group: u32::try_from(group).unwrap_or(u32::MAX),
        });
        readings.collect::<Vec<_>>()
    };
    window.frames().iter().enumerate().flat_map(of_frame).collect()
}
