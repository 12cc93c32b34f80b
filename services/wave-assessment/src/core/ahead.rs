//! Quiet moments of the next seconds, by the waves that the window has seen.

use std::f64::consts::PI;

use halcyon_model::{CalmForecast, CalmWindow, Directional, LocalPoint, Stamp, WaveSpectrum};
use halcyon_ocean::forecast::grid::interpolated;
use halcyon_ocean::forecast::{Forecast, Grid, Level, Limits, Options, Prior, Reading, Spot};
use halcyon_ocean::space::{DirectionalSpectrum, FourierMoments};
use halcyon_ocean::{CosTwoS, SampledSpectrum};

use super::direction::Directions;
use super::spectrum::Spectral;
use super::window::Window;
use crate::config::Config;

/// How far ahead is looked, seconds: further, nothing is known of waves that long.
const AHEAD_S: f64 = 10.0;
/// Shorter quiet moments are of no use to something that has to settle, seconds.
const LEAST_S: f64 = 1.5;
/// Where the expected error is stated, seconds ahead.
const ERROR_AHEAD_S: f64 = 3.0;
/// Longer waves than those below which so small a share of the variance lies are held to be no part of the sea.
const LONG_SHARE: f64 = 0.01;
/// Directions of so many frequencies to either side are taken together.
const SMOOTHED: usize = 2;
/// Logarithm of how many times as likely the readings must be with each frequency's own directions as with one direction for all.
const EVIDENCE_MIN: f64 = 3.0;

/// The forecast at `place`; `None` where waves are not known well enough for one.
pub(crate) fn calm(
    window: &Window,
    spectral: &Spectral,
    directions: &Directions,
    place: LocalPoint,
    config: &Config,
) -> Option<CalmForecast> {
    let newest = window.newest()?.stamp;
    let forecast = forecast(&readings(window, newest), &grid(window, spectral, config)?, spectral, directions)?;

    let airframe = config.airframe.resolved().ok()?;
    let kept = 1.0 - config.airframe.margin;
    let limits = Limits {
        crest_m: (airframe.float_depth_m * kept).min(0.5 * config.h_highest_m_max),
        slope: (airframe.tip_angle_rad * kept).tan(),
        vertical_speed_mps: (airframe.touchdown_speed_mps * kept - config.airframe.descent_mps).max(0.0),
    };
    let spot = Spot { north_m: place.north_m, east_m: place.east_m };
    let (forecast, sea_sigma_m) = forecast;
    let outlook = forecast.at(spot, ERROR_AHEAD_S);
    let windows = forecast.calm_windows(spot, &limits, 0.0, AHEAD_S, LEAST_S);
    let error_share = outlook.elevation_sigma_m / sea_sigma_m;
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

fn options() -> Options {
    Options { level: Level::Free, ..Options::default() }
}

/// How the sea is cut into lines: about the peak, and down to the waves of a swell below it, which may be of another system.
fn grid(window: &Window, spectral: &Spectral, config: &Config) -> Option<Grid> {
    let footprint_m = window.newest()?.footprint_m;
    let about_peak = Grid::about_peak(1.0 / spectral.t_p_s.value, options().span_s + AHEAD_S, 2.0 * footprint_m);
    let WaveSpectrum { df_hz, density_m2_per_hz, .. } = &spectral.spectrum;
    let least = LONG_SHARE * density_m2_per_hz.iter().sum::<f64>();
    let mut sum = 0.0;
    let first = density_m2_per_hz.iter().position(|density| {
        sum += density;
        sum > least
    })?;
    // Straight between frequencies, densities begin at the one before; below the limit an autopilot's height wanders.
    let low_hz = ((first as f64 - 1.0) * df_hz).max(config.wave_hz_min);
    Some(Grid { low_hz: about_peak.low_hz.min(low_hz), ..about_peak })
}

/// The sea given the readings, and its standard deviation before them, metres; of the prior that suits them better.
///
/// In a crossing sea the mean direction of all waves is that of none. But in a sea of one system each frequency's own directions are that mean
/// direction measured worse. So they are taken where the readings say so.
fn forecast(readings: &[Reading], grid: &Grid, spectral: &Spectral, directions: &Directions) -> Option<(Forecast, f64)> {
    let fitted = |prior: Prior| {
        let forecast = Forecast::fit(readings, &prior, 0.0, &options()).ok()?;
        Some((forecast, prior.sea().elevation_m2.sqrt()))
    };
    let one = one_system(grid, spectral, &directions.overall).and_then(fitted);
    let many = by_frequency(grid, spectral, &directions.spectrum).and_then(fitted);
    match (one, many) {
        (Some(one), Some(many)) if many.0.log_evidence() > one.0.log_evidence() + EVIDENCE_MIN => Some(many),
        (one, many) => one.or(many),
    }
}

/// The window's spectrum, all of it spread about the mean direction.
fn one_system(grid: &Grid, spectral: &Spectral, overall: &Directional) -> Option<Prior> {
    let m1 = 1.0 - 0.5 * overall.spread_rad.powi(2);
    grid.spread(interpolated(&table(spectral)?), overall.from_rad.value + PI, spread(m1)?).ok()
}

/// The window's spectrum, each frequency spread about its own mean direction.
///
/// Of the measured distribution no more than the mean direction and the spread is taken: of a minute, whose few segments have to tell a dozen
/// gauges' cross spectra, the shape is mostly chance, and to believe it makes forecasts worse.
fn by_frequency(grid: &Grid, spectral: &Spectral, directions: &DirectionalSpectrum) -> Option<Prior> {
    let density = table(spectral)?;
    let density = interpolated(&density);
    let moments = directions.moments();
    let spreads = (0..moments.len()).map(|i| {
        let near = &moments[i.saturating_sub(SMOOTHED)..(i + SMOOTHED + 1).min(moments.len())];
        let overall = FourierMoments::overall(near)?;
        Some((spread(overall.a1.hypot(overall.b1))?, overall.direction_from_rad() + PI))
    });
    let spreads: Vec<(CosTwoS, f64)> = spreads.collect::<Option<_>>()?;
    let first_hz = moments.first()?.f_hz;
    let at = |f_hz: f64| {
        // Beyond the frequencies looked at waves come from where the nearest do.
        let place = ((f_hz - first_hz) / directions.df_hz()).clamp(0.0, (spreads.len() - 1) as f64);
        (spreads[place.floor() as usize], spreads[place.ceil() as usize], place.fract())
    };
    let prior = grid.directional(|f_hz, towards_rad| {
        let (below, above, share) = at(f_hz);
        let of = |(spread, mean_rad): (CosTwoS, f64)| spread.density_per_rad(towards_rad - mean_rad);
        density(f_hz) * ((1.0 - share) * of(below) + share * of(above))
    });
    prior.ok()
}

fn table(spectral: &Spectral) -> Option<SampledSpectrum> {
    SampledSpectrum::new(spectral.spectrum.df_hz, spectral.spectrum.density_m2_per_hz.clone()).ok()
}

/// Of the first moment m1 = s/(s + 1) of cos-2s; the circular spread is √(2 (1 − m1)).
fn spread(m1: f64) -> Option<CosTwoS> {
    let m1 = m1.clamp(0.1, 0.98);
    CosTwoS::new(m1 / (1.0 - m1)).ok()
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

#[cfg(test)]
mod tests;
