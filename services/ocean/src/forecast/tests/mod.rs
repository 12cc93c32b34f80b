//! Closed forms, brute force, and bad inputs.

use super::*;
use crate::dispersion::{Depth, GRAVITY_MPS2};
use crate::{CosTwoS, Jonswap, Spectrum};
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};

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

#[test]
fn a_grid_keeps_the_energy_and_the_direction() {
    let sea = Jonswap::new(0.4, 2.0, 3.3).unwrap();
    let grid = Grid::about_peak(0.5, 30.0, 6.0);
    let prior = grid.spread(|f| sea.density_m2_per_hz(f), 0.8, CosTwoS::new(10.0).unwrap()).unwrap();
    assert!(prior.lines().len() <= Grid::LINES_MAX);
    assert_relative_eq!(prior.sea().elevation_m2, sea.moment(0, 0.25, 2.0), max_relative = 2e-3);
    assert_relative_eq!(
        prior.sea().vertical_speed_m2ps2,
        sea.moment(2, 0.25, 2.0) * std::f64::consts::TAU.powi(2),
        max_relative = 1e-2
    );
    let kept: f64 = prior.lines().iter().map(|l| l.variance_m2).sum();
    assert_relative_eq!(kept + prior.rest().elevation_m2, prior.sea().elevation_m2, max_relative = 1e-9);
    // m1 of cos-2s is s/(s + 1) (Kuik et al. 1988).
    let towards =
        |l: &Line| (l.k_north_radpm * 0.8f64.cos() + l.k_east_radpm * 0.8f64.sin()) / l.omega_radps.powi(2) * GRAVITY_MPS2;
    let m1: f64 = prior.lines().iter().map(|l| l.variance_m2 * towards(l)).sum::<f64>() / kept;
    assert_relative_eq!(m1, 10.0 / 11.0, max_relative = 0.02);
    for bad in [Grid { low_hz: 0.0, ..grid }, Grid { high_hz: f64::NAN, ..grid }, Grid { span_s: -1.0, ..grid }] {
        assert_eq!(bad.directional(|_, _| 1.0), Err(ForecastError::Grid));
    }
    assert_eq!(grid.directional(|_, _| f64::NAN), Err(ForecastError::NoLines));
    assert_eq!(grid.depth, Depth::DEEP);
}

/// Waves of 1.5 s seen over 4 m: 10 s ahead nothing is known of them, and nothing is offered, however high the limits.
#[test]
fn unknown_is_never_calm() {
    let sea = Jonswap::new(0.1, 1.5, 1.0).unwrap();
    let grid = Grid::about_peak(1.0 / 1.5, 40.0, 6.0);
    let prior = grid.spread(|f| sea.density_m2_per_hz(f), 0.0, CosTwoS::new(2.0).unwrap()).unwrap();
    let forecast = Forecast::fit(&array(|_, _, _| 0.0), &prior, 0.0, &Options::default()).unwrap();
    let far = forecast.at(SPOT, 20.0);
    assert!(far.ignorance.elevation > 0.9, "{far:?}");
    assert_relative_eq!(far.elevation_sigma_m, 0.1 / 4.0, max_relative = 0.05);
    let high = Limits { crest_m: 9.0, slope: 9.0, vertical_speed_mps: 9.0 };
    assert_eq!(forecast.calm_windows(SPOT, &high, 15.0, 25.0, 1.0), []);
    // Past what the lines are good for, in time and place, too: they would repeat themselves there.
    assert_eq!(forecast.at(SPOT, 31.0).ignorance.elevation, 1.0);
    assert_eq!(forecast.at(Spot { north_m: 8.0, east_m: 0.0 }, 1.0).ignorance.elevation, 1.0);
    let none = Limits { crest_m: f64::INFINITY, slope: f64::INFINITY, vertical_speed_mps: f64::INFINITY };
    assert_eq!(forecast.calm_windows(SPOT, &none, 15.0, 25.0, 1.0), []);
}

/// One wave, known: the sea is within limits exactly while its crest, slope and speed are.
#[test]
fn windows_of_a_known_wave_are_its_closed_form() {
    // A crest at the spot at 0 and every 5 s: a cos(2π t/5) is under a/2 from 5/6 s to 25/6 s.
    let truth = line(0.2, 0.0, 0.01);
    let phase = -truth.k_north_radpm * SPOT.north_m;
    let readings = array(|n, e, t| wave(&truth, 0.13, phase, n, e, t)[0]);
    let forecast = Forecast::fit(&readings, &Prior::new([truth]).unwrap(), 0.0, &Options::default()).unwrap();
    let limits = Limits { crest_m: 0.065, slope: f64::INFINITY, vertical_speed_mps: f64::INFINITY };
    let windows = forecast.calm_windows(SPOT, &limits, 0.0, 10.0, 1.0);
    assert_eq!(windows.len(), 2, "{windows:?}");
    for (window, crest_s) in windows.iter().zip([0.0, 5.0]) {
        assert!((window.from_s - crest_s - 5.0 / 6.0).abs() <= Forecast::STEP_S, "{window:?}");
        assert!((window.to_s - crest_s - 25.0 / 6.0).abs() <= Forecast::STEP_S, "{window:?}");
        assert!(window.worst.crest_m <= 0.065);
    }
    assert_eq!(forecast.calm_windows(SPOT, &limits, 0.0, 10.0, 4.0), []);
    // Its speed is under half of its highest about crest and trough: a third of each half period.
    let slow = Limits { crest_m: f64::INFINITY, slope: 9.0, vertical_speed_mps: 0.5 * 0.13 * truth.omega_radps };
    let windows = forecast.calm_windows(SPOT, &slow, 1.0, 4.0, 0.5);
    assert_eq!(windows.len(), 1);
    assert!((windows[0].from_s - (2.5 - 5.0 / 12.0)).abs() <= Forecast::STEP_S, "{windows:?}");
    for (from_s, to_s, least_s) in
        [(f64::NAN, 9.0, 1.0), (0.0, f64::NAN, 1.0), (0.0, 9.0, f64::NAN), (9.0, 0.0, 1.0), (0.0, 9.0, 0.0)]
    {
        assert_eq!(forecast.calm_windows(SPOT, &limits, from_s, to_s, least_s), []);
    }
    let broken = Limits { crest_m: f64::NAN, ..limits };
    assert_eq!(forecast.calm_windows(SPOT, &broken, 0.0, 10.0, 1.0), []);
}

/// Waves four times as long as believed from 90° elsewhere: errors grow rather than stay those of the belief.
#[test]
fn readings_that_contradict_the_prior_raise_errors() {
    let truth = line(0.25, 1.5, 0.01);
    let believed = Prior::new((0..20).map(|i| line(0.4 + 0.01 * f64::from(i), 0.0, 0.01 / 20.0))).unwrap();
    let readings = array(|n, e, t| wave(&truth, 0.13, 0.4, n, e, t)[0]);
    let forecast = Forecast::fit(&readings, &believed, 0.0, &Options::default()).unwrap();
    assert!(forecast.inflation() > 100.0, "{}", forecast.inflation());
}

/// A sea of T_p = 2 s towards 0.3 rad, believed to be of 1.7 s towards 0.8 rad: the readings tell. One direction and a narrow band, so that what the
/// answer is is clear.
#[test]
fn the_evidence_finds_period_and_direction() {
    let waves: Vec<(Line, f64)> = (0..12)
        .map(|i| (line(0.45 + 0.01 * f64::from(i), 0.3 + 0.04 * (f64::from(i) - 5.5), 0.0), 2.4 * f64::from(i * i)))
        .collect();
    let readings = array(|n, e, t| waves.iter().map(|(l, phase)| wave(l, 0.03, *phase, n, e, t)[0]).sum());
    let believed = Jonswap::new(0.3, 1.7, 3.3).unwrap();
    let spread = CosTwoS::new(20.0).unwrap();
    let density = |f: f64, rad: f64| believed.density_m2_per_hz(f) * spread.density_per_rad(rad - 0.8);
    let grid = Grid::about_peak(1.0 / 1.7, 26.0, 4.0);
    let tune = |search: &Search| grid.tuned(density, &readings, 0.0, &Options::default(), search);
    let tuned = tune(&Search::near()).unwrap();
    assert!((tuned.turn_rad + 0.5).abs() < 0.15, "{} {}", tuned.turn_rad, tuned.period_factor);
    assert!((tuned.period_factor - 2.0 / 1.7).abs() < 0.1, "{} {}", tuned.turn_rad, tuned.period_factor);
    assert!(tuned.share > 0.2 && tuned.share <= 1.0);
    let empty = Search { turns_rad: Vec::new(), ..Search::near() };
    assert_eq!(tune(&empty).unwrap_err(), ForecastError::NoLines);
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
