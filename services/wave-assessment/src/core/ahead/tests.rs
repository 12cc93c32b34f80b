//! Forecasts of seas whose directional spectrum and whose future are known.

use std::f64::consts::TAU;

use super::*;
use crate::core::direction::directional;
use crate::core::film::film;
use crate::core::hidden::hidden;
use crate::core::series::Series;
use crate::core::statistics::Statistics;
use crate::core::synthetic::{Rig, System, Water};

/// Five metres over the water with the default rig, for a minute.
const RIG: Rig = Rig { rows: 14, cols: 18, cell_m: 0.25, rate_hz: 5.0, frames: 301, sigma_m: 0.002 };
const TIMES_S: [f64; 3] = [1.0, 3.0, 5.0];

fn seen(water: &Water, seed: u64) -> Window {
    let mut window = Window::default();
    RIG.film(water, seed).iter().for_each(|patch| window.add(patch, None, &Config::default()));
    window
}

/// What is measured of a window: spectrum and directions.
fn measured(window: &Window) -> Option<(Spectral, Directions)> {
    let config = Config::default();
    let interval_s = window.interval_s()?;
    let hidden = hidden(window, &config, interval_s);
    let series = Series::new(window, &hidden, config.gap_s_max);
    let statistics = Statistics::of(window, &series, &hidden, interval_s, config.wave_hz_min)?;
    let directions = directional(&film(window, interval_s)?, statistics.t_z_s?.value, statistics.freedom)?;
    Some((statistics.spectral?, directions))
}

/// Of one prior and sea, over the sea's variance: squared errors of the elevation at each time, variances stated, and whether each frequency's own
/// directions were taken.
struct Score {
    squares: [f64; 3],
    stated: [f64; 3],
    own: bool,
}

/// Forecasts with the directional spectrum that the sea was made of, with one direction, with each frequency's own, and the one that is given out.
const PRIORS: [&str; 4] = ["known", "one", "own", "given"];

fn scores(systems: &[System], seed: u64) -> Option<[Score; 4]> {
    let water = Water::new(systems, seed);
    let window = seen(&water, seed);
    let (spectral, directions) = measured(&window)?;
    let grid = grid(&window, &spectral, &Config::default())?;
    let readings = readings(&window, window.newest()?.stamp);
    let fitted = |prior: Prior| Forecast::fit(&readings, &prior, 0.0, &options()).unwrap();
    let densities: Vec<_> = systems.iter().map(System::density).collect();
    let known = grid.directional(|f_hz, rad| densities.iter().map(|density| density(f_hz, rad)).sum()).unwrap();
    let given = forecast(&readings, &grid, &spectral, &directions)?.0;
    let one = fitted(one_system(&grid, &spectral, &directions.overall)?);
    let own = given.log_evidence() > one.log_evidence();
    let own_fit = fitted(by_frequency(&grid, &spectral, &directions.spectrum)?);
    let (north_m, east_m) = RIG.middle_m();
    let variance_m2: f64 = systems.iter().map(System::variance_m2).sum();
    Some([fitted(known), one, own_fit, given].map(|forecast| {
        let outlooks = forecast.at_times(Spot { north_m, east_m }, &TIMES_S);
        let error_m = |i: usize| outlooks[i].elevation_m - water.at(north_m, east_m, TIMES_S[i])[0];
        Score {
            squares: [0, 1, 2].map(|i| error_m(i).powi(2) / variance_m2),
            stated: [0, 1, 2].map(|i| outlooks[i].elevation_sigma_m.powi(2) / variance_m2),
            own,
        }
    }))
}

fn all_scores(systems: &[System], seeds: u64) -> Vec<[Score; 4]> {
    std::thread::scope(|scope| {
        let one = move |first: u64| (first..seeds).step_by(2).filter_map(|seed| scores(systems, seed)).collect::<Vec<_>>();
        let workers = [0, 1].map(|first| scope.spawn(move || one(first)));
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    })
}

fn seas() -> Vec<(&'static str, Vec<System>)> {
    let system = System::new;
    vec![
        ("one, T_p 2.0 s, s 10", vec![system(0.12, 2.0, 10.0, 60.0)]),
        ("one, T_p 1.4 s, s 10", vec![system(0.10, 1.4, 10.0, 200.0)]),
        ("one, T_p 2.5 s, s 40", vec![system(0.15, 2.5, 40.0, 310.0)]),
        ("one, T_p 1.6 s, s 2", vec![system(0.10, 1.6, 2.0, 120.0)]),
        ("crossing, T_p 3.0 and 1.5 s", vec![system(0.12, 3.0, 40.0, 90.0), system(0.10, 1.5, 10.0, 180.0)]),
        ("crossing, T_p 2.2 and 1.3 s", vec![system(0.10, 2.2, 25.0, 20.0), system(0.08, 1.3, 10.0, 290.0)]),
        ("crossing, T_p 2.5 and 1.5 s", vec![system(0.08, 2.5, 25.0, 20.0), system(0.08, 1.5, 25.0, 110.0)]),
    ]
}

/// A swell towards the east and a wind sea towards the south: each has its own direction, where the mean of all is that of neither.
#[test]
fn crossing_systems_keep_their_directions() {
    let systems = [System::new(0.12, 3.0, 40.0, 90.0), System::new(0.10, 1.5, 10.0, 180.0)];
    let mean_deg = |prior: &Prior, low_hz: f64, high_hz: f64| {
        let band = (low_hz * TAU)..(high_hz * TAU);
        let waves = prior.lines().iter().filter(|line| band.contains(&line.omega_radps));
        let (north, east) = waves.fold((0.0, 0.0), |(north, east), line| {
            let per_k = line.variance_m2 / line.k_north_radpm.hypot(line.k_east_radpm);
            (north + per_k * line.k_north_radpm, east + per_k * line.k_east_radpm)
        });
        east.atan2(north).to_degrees()
    };
    for seed in 0..6 {
        let window = seen(&Water::new(&systems, seed), seed);
        let (spectral, directions) = measured(&window).unwrap();
        let prior =
            by_frequency(&grid(&window, &spectral, &Config::default()).unwrap(), &spectral, &directions.spectrum).unwrap();
        let (swell, wind_sea) = (mean_deg(&prior, 0.28, 0.40), mean_deg(&prior, 0.62, 0.85).rem_euclid(360.0));
        assert!((swell - 90.0).abs() < 20.0 && (wind_sea - 180.0).abs() < 20.0, "{seed}: {swell} {wind_sea}");
    }
}

/// A low swell under a wind sea, whose waves are over twice as long: they are part of the sea.
#[test]
fn a_swell_below_the_peak_is_in_the_prior() {
    let systems = [System::new(0.08, 3.2, 40.0, 90.0), System::new(0.12, 1.3, 10.0, 180.0)];
    let variance_m2: f64 = systems.iter().map(System::variance_m2).sum();
    let mut share = 0.0;
    for seed in 0..8 {
        let window = seen(&Water::new(&systems, seed), seed);
        let (spectral, directions) = measured(&window).unwrap();
        let prior = one_system(&grid(&window, &spectral, &Config::default()).unwrap(), &spectral, &directions.overall).unwrap();
        share += prior.sea().elevation_m2 / variance_m2 / 8.0;
    }
    // A minute's variance scatters by a fifth; the swell's share of it is 31 %.
    assert!((share - 1.0).abs() < 0.15, "{share}");
}

/// What is given out errs less a second ahead in a crossing sea than with one direction, and as much in a sea of one; and by as much as it says.
#[test]
fn forecasts_of_crossing_seas_are_better_and_of_others_no_worse() {
    let all = seas();
    let rms = |scores: &[[Score; 4]], prior: usize, time: usize| {
        (scores.iter().map(|s| s[prior].squares[time]).sum::<f64>() / scores.len() as f64).sqrt()
    };
    let crossing = all_scores(&all[4].1, 32);
    let own = crossing.iter().filter(|s| s[3].own).count();
    assert!(own >= 29, "{own} of {}", crossing.len());
    assert!(rms(&crossing, 3, 0) < 0.85 * rms(&crossing, 1, 0), "{} {}", rms(&crossing, 3, 0), rms(&crossing, 1, 0));
    let one = all_scores(&all[0].1, 24);
    let own = one.iter().filter(|s| s[3].own).count();
    assert!(own <= 3 && rms(&one, 3, 1) < 1.02 * rms(&one, 1, 1), "{own} {} {}", rms(&one, 3, 1), rms(&one, 1, 1));
    for scores in [&crossing, &one] {
        // A quarter of H_s is the sea's own deviation; 24 errors' mean square is good to 29 %.
        assert!(rms(scores, 3, 1) < 1.0, "{}", rms(scores, 3, 1));
        let ratio = scores.iter().map(|s| s[3].squares[1] / s[3].stated[1]).sum::<f64>() / scores.len() as f64;
        assert!((0.4..1.6).contains(&ratio), "mean square error is {ratio} of the one stated");
    }
}

/// `HALCYON_SEAS=300 cargo test --workspace --lib priors_compared -- --ignored --nocapture`
#[test]
#[ignore = "a measurement of some minutes"]
#[allow(clippy::print_stdout, reason = "shows its figures")]
fn priors_compared() {
    let seeds: u64 = std::env::var("HALCYON_SEAS").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    let only = std::env::var("HALCYON_SEA").unwrap_or_default();
    for (name, systems) in seas().into_iter().filter(|(name, _)| name.contains(&only)) {
        let all = all_scores(&systems, seeds);
        let n = all.len() as f64;
        let own = all.iter().filter(|s| s[3].own).count();
        println!("{name}: {n} of {seeds} seas had directions, own ones were given out in {own}; 1, 3 and 5 s ahead, over H_s");
        for (i, prior) in PRIORS.iter().enumerate() {
            let mean = |of: &dyn Fn(&[Score; 4]) -> f64| all.iter().map(of).sum::<f64>() / n;
            let show = |of: &dyn Fn(usize) -> String| [0, 1, 2].map(of).join(" ");
            let error = show(&|t| format!("{:.3}", 0.25 * mean(&|s| s[i].squares[t]).sqrt()));
            let stated = show(&|t| format!("{:.3}", 0.25 * mean(&|s| s[i].stated[t]).sqrt()));
            let ratio = show(&|t| format!("{:.2}", mean(&|s| s[i].squares[t] / s[i].stated[t]).sqrt()));
            // Over the same seas, so that their own differences drop out.
            let less = show(&|t| {
                let gain = |s: &[Score; 4]| s[i].squares[t] - s[1].squares[t];
                let by = mean(&gain);
                format!("{by:+.3}±{:.3}", (mean(&|s| (gain(s) - by).powi(2)) / n).sqrt())
            });
            println!(
                "  {prior:6} error {error}; stated {stated}; error over stated {ratio}; mean square less that of one, over the sea's {less}"
            );
        }
    }
}
