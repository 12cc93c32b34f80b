//! Closed forms, brute force, and bad inputs.

use super::*;
use crate::dispersion::{Depth, GRAVITY_MPS2};
use crate::{CosTwoS, Jonswap, Spectrum};
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

mod calm;
mod priors;

fn line(f_hz: f64, towards_rad: f64, variance_m2: f64) -> Line {
    let omega_radps = std::f64::consts::TAU * f_hz;
    let k = omega_radps * omega_radps / GRAVITY_MPS2;
    Line { k_north_radpm: k * towards_rad.cos(), k_east_radpm: k * towards_rad.sin(), omega_radps, variance_m2 }
}

/// A wave of amplitude `a` and phase at a place and time: elevation, slopes, vertical speed.
fn wave(line: &Line, a: f64, phase: f64, north_m: f64, east_m: f64, t_s: f64) -> [f64; 4] {
    let p = line.k_north_radpm * north_m + line.k_east_radpm * east_m - line.omega_radps * t_s + phase;
    [a * p.cos(), -a * line.k_north_radpm * p.sin(), -a * line.k_east_radpm * p.sin(), a * line.omega_radps * p.sin()]
}

fn reading(north_m: f64, east_m: f64, t_s: f64, elevation_m: f64) -> Reading {
    Reading { north_m, east_m, t_s, elevation_m, sigma_m: 1e-3, group: (t_s * 100.0).round() as i64 as u32 }
}

/// Readings of `f` on a 3 by 3 array, 2 m wide, at 4 Hz for 10 s up to 0.
fn array(f: impl Fn(f64, f64, f64) -> f64) -> Vec<Reading> {
    let mut readings = Vec::new();
    for frame in 0..=40 {
        for place in 0..9 {
            let (north_m, east_m, t_s) = (f64::from(place / 3) - 1.0, f64::from(place % 3) - 1.0, -0.25 * f64::from(frame));
            readings.push(reading(north_m, east_m, t_s, f(north_m, east_m, t_s)));
        }
    }
    readings
}

const SPOT: Spot = Spot { north_m: 0.4, east_m: -0.3 };

/// One wave, seen, is known for ever: all four numbers are its closed form, whatever levels and tilts frames have been given.
#[test]
fn a_single_wave_is_recovered() {
    let truth = line(0.4, 0.7, 0.01);
    let prior = Prior::new([truth]).unwrap();
    for (level, offset) in [(Level::Known, 0.0), (Level::Free, 3.0), (Level::FreeWithTilt, 3.0)] {
        let tilt = if level == Level::FreeWithTilt { 0.2 } else { 0.0 };
        let readings = array(|n, e, t| wave(&truth, 0.13, 1.1, n, e, t)[0] + offset * (7.0 * t).sin() + tilt * (n * t - e));
        let forecast = Forecast::fit(&readings, &prior, 0.0, &Options { level, ..Options::default() }).unwrap();
        for t_s in [0.0, 1.3, 8.0, -4.0] {
            let found = forecast.at(SPOT, t_s);
            let expected = wave(&truth, 0.13, 1.1, SPOT.north_m, SPOT.east_m, t_s);
            let means = [found.elevation_m, found.slope_north, found.slope_east, found.vertical_speed_mps];
            for (mean, expected) in means.iter().zip(expected) {
                assert_relative_eq!(*mean, expected, epsilon = 2e-4);
            }
            assert!(found.elevation_sigma_m < 1e-3 && found.ignorance.elevation < 1e-3, "{level:?} {found:?}");
        }
    }
}

/// Σ σ² cos(k·Δx − ωΔt), and its derivatives by the first place and time: what the mean and variance are made of.
fn covariance(lines: &[Line], a: (f64, f64, f64), b: (f64, f64, f64)) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for line in lines {
        let part = wave(line, line.variance_m2, 0.0, a.0 - b.0, a.1 - b.1, a.2 - b.2);
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
    }
    sum
}

/// Rasmussen & Williams (2006), eq. 2.25 and 2.26, by inverting the covariance of the readings.
#[test]
fn the_posterior_is_that_of_the_gaussian_process() {
    let lines: Vec<Line> =
        (0..30).map(|i| line(0.3 + 0.02 * f64::from(i), 0.3 * f64::from(i), 1e-3 / f64::from(1 + i))).collect();
    let prior = Prior::new(lines.clone()).unwrap();
    let readings: Vec<Reading> = (0..25)
        .map(|i| {
            let i = f64::from(i);
            Reading { sigma_m: 0.01, ..reading((1.7 * i).sin(), (2.9 * i).cos(), -0.37 * i, 0.05 * (1.3 * i).sin()) }
        })
        .collect();
    let place = |r: &Reading| (r.north_m, r.east_m, r.t_s);
    let n = readings.len();
    let k = DMatrix::from_fn(n, n, |i, j| {
        covariance(&lines, place(&readings[i]), place(&readings[j]))[0] + if i == j { 1e-4 } else { 0.0 }
    });
    let inverse = k.try_inverse().unwrap();
    let y = DVector::from_fn(n, |i, _| readings[i].elevation_m);
    let forecast = Forecast::fit(&readings, &prior, 0.0, &Options::default()).unwrap();
    let misfit = (y.transpose() * &inverse * &y)[0] / n as f64;
    assert_relative_eq!(forecast.inflation(), misfit.max(1.0), max_relative = 1e-9);
    for t_s in [0.5, 3.0] {
        let at = (SPOT.north_m, SPOT.east_m, t_s);
        let found = forecast.at(SPOT, t_s);
        let means = [found.elevation_m, found.slope_north, found.slope_east, found.vertical_speed_mps];
        let sigmas = [found.elevation_sigma_m, found.slope_north_sigma, found.slope_east_sigma, found.vertical_speed_sigma_mps];
        for q in 0..4 {
            let c = DVector::from_fn(n, |i, _| covariance(&lines, at, place(&readings[i]))[q]);
            let weight = |l: &Line| [1.0, l.k_north_radpm, l.k_east_radpm, l.omega_radps][q].powi(2) * l.variance_m2;
            let own: f64 = lines.iter().map(weight).sum();
            assert_relative_eq!(means[q], (c.transpose() * &inverse * &y)[0], epsilon = 1e-12, max_relative = 1e-8);
            let variance = own - (c.transpose() * &inverse * &c)[0];
            assert_relative_eq!(sigmas[q].powi(2), variance * misfit.max(1.0), max_relative = 1e-7);
        }
    }
}

/// A frame's level taken out by the caller or not: the same forecast. Readings of single places tell nothing then.
#[test]
fn a_free_level_makes_means_irrelevant() {
    let truth = line(0.4, 0.7, 0.01);
    let prior = Prior::new([truth, line(0.5, 0.2, 0.01), line(0.33, -0.6, 0.01)]).unwrap();
    let options = Options { level: Level::Free, ..Options::default() };
    let raw = array(|n, e, t| wave(&truth, 0.13, 1.1, n, e, t)[0]);
    let mut centred = raw.clone();
    for frame in centred.chunk_by_mut(|a, b| a.group == b.group) {
        let mean = frame.iter().map(|r| r.elevation_m).sum::<f64>() / frame.len() as f64;
        frame.iter_mut().for_each(|r| r.elevation_m -= mean);
    }
    let [a, b] = [&raw, &centred].map(|r| Forecast::fit(r, &prior, 0.0, &options).unwrap().at(SPOT, 2.0));
    assert_relative_eq!(a.elevation_m, b.elevation_m, epsilon = 1e-9);
    assert_relative_eq!(a.elevation_sigma_m, b.elevation_sigma_m, max_relative = 1e-9);
    let alone: Vec<Reading> = raw.iter().step_by(9).copied().collect();
    let found = Forecast::fit(&alone, &prior, 0.0, &options).unwrap().at(SPOT, 0.0);
    assert!(found.ignorance.elevation > 0.95, "{found:?}");
}

#[test]
fn bad_inputs_are_errors_or_unknown() {
    let good = line(0.4, 0.7, 0.01);
    assert_eq!(Prior::new([]), Err(ForecastError::NoLines));
    assert_eq!(Prior::new([Line { variance_m2: 0.0, ..good }]), Err(ForecastError::NoLines));
    for bad in [Line { variance_m2: -1.0, ..good }, Line { omega_radps: f64::NAN, ..good }] {
        assert_eq!(Prior::new([good, bad]), Err(ForecastError::Line { index: 1 }));
    }
    let prior = Prior::new([good]).unwrap();
    let fit = |readings: &[Reading], now_s| Forecast::fit(readings, &prior, now_s, &Options::default());
    assert_eq!(fit(&[], 0.0).unwrap_err(), ForecastError::NoReadings { given: 0 });
    let fine = reading(0.0, 0.0, -1.0, 0.1);
    assert_eq!(fit(&[fine], f64::NAN).unwrap_err(), ForecastError::Now);
    let bad = [
        Reading { elevation_m: f64::NAN, ..fine },
        Reading { sigma_m: 0.0, ..fine },
        Reading { sigma_m: f64::NAN, ..fine },
        Reading { t_s: 0.1, ..fine },
        Reading { t_s: -16.1, ..fine },
        Reading { north_m: f64::INFINITY, ..fine },
    ];
    assert_eq!(fit(&bad, 0.0).unwrap_err(), ForecastError::NoReadings { given: 6 });
    let forecast = fit(&[&bad[..], &[fine, fine]].concat(), 0.0).unwrap();
    assert_eq!((forecast.used(), forecast.dropped()), (2, 6));
    let nowhere = forecast.at(Spot { north_m: f64::NAN, east_m: 0.0 }, 1.0);
    let never = forecast.at(SPOT, f64::NAN);
    for unknown in [nowhere, never] {
        assert_eq!(unknown.ignorance.elevation, 1.0);
        assert!(unknown.elevation_sigma_m >= 0.1 && unknown.elevation_m == 0.0);
    }
}

/// Too many readings: as many as allowed, all frames spread in age, and of each frame the corners first.
#[test]
fn thinning_keeps_the_bounds_and_the_span() {
    let mut many = Vec::new();
    for frame in 0..400 {
        for place in 0..81 {
            many.push(reading(f64::from(place / 9) * 0.5, f64::from(place % 9) * 0.5, -0.04 * f64::from(frame), 0.0));
        }
    }
    let options = Options::default();
    let kept = reading::chosen(&many, 0.0, &options);
    assert_eq!(kept.len(), options.readings_max);
    let mut ages_s: Vec<f64> = kept.iter().map(|r| -r.t_s).collect();
    ages_s.sort_by(f64::total_cmp);
    ages_s.dedup();
    assert_eq!(ages_s.len(), 20);
    assert!(ages_s[0] == 0.0 && ages_s[19] > 14.0, "{ages_s:?}");
    // Evenly in ln(age + dense_s): the median is √(1 + 16) − 1 = 3.1 s.
    assert!((2.5..4.0).contains(&ages_s[10]), "{ages_s:?}");
    for frame in kept.chunk_by(|a, b| a.t_s == b.t_s) {
        assert_eq!(frame.len(), 16);
        let gaps = frame.iter().flat_map(|a| frame.iter().map(move |b| (a.north_m - b.north_m).hypot(a.east_m - b.east_m)));
        assert!(gaps.filter(|g| *g > 0.0).fold(f64::INFINITY, f64::min) >= 0.5);
    }
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -20.0..20.0f64, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY), 1 => Just(-1e300), 1 => Just(0.0), 1 => Just(1e-300)]
}

proptest! {
    /// Whatever comes in, there is an error or an outlook whose errors are numbers: no panic, and nothing calm by accident.
    #[test]
    fn nothing_that_comes_in_panics(
        raw in prop::collection::vec((any_number(), any_number(), any_number(), any_number(), any_number(), 0..5u32), 0..40),
        spot in (any_number(), any_number()),
        times in (any_number(), any_number(), any_number()),
        bound in 0..30usize,
        level in 0..3usize,
    ) {
        let readings: Vec<Reading> = raw
            .into_iter()
            .map(|(north_m, east_m, t_s, elevation_m, sigma_m, group)| Reading { north_m, east_m, t_s, elevation_m, sigma_m, group })
            .collect();
        let prior = Prior::new((0..5).map(|i| line(0.3 + 0.1 * f64::from(i), f64::from(i), 0.01))).unwrap();
        let level = [Level::Known, Level::Free, Level::FreeWithTilt][level];
        let options = Options { level, readings_max: bound, per_frame_max: bound / 3, dense_s: times.2, ..Options::default() };
        if let Ok(forecast) = Forecast::fit(&readings, &prior, times.0, &options) {
            prop_assert!(forecast.used() <= bound.max(1));
            let spot = Spot { north_m: spot.0, east_m: spot.1 };
            let outlook = forecast.at(spot, times.1);
            prop_assert!(outlook.elevation_sigma_m.is_finite() && outlook.elevation_m.is_finite(), "{outlook:?}");
            prop_assert!(forecast.at_times(spot, &[]).is_empty());
            let limits = Limits { crest_m: times.1, slope: times.2, vertical_speed_mps: times.1 };
            for window in forecast.calm_windows(spot, &limits, times.0, times.1, times.2) {
                prop_assert!(window.worst.crest_m <= limits.crest_m && window.worst.vertical_speed_mps <= limits.vertical_speed_mps);
            }
        }
    }
}
