//! Windows: of what is not known, and of what is.

use super::*;

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
    // For ever is as long as is looked at.
    assert_eq!(forecast.calm_windows(SPOT, &limits, 0.0, f64::INFINITY, 1.0).len(), 4);
    let broken = Limits { crest_m: f64::NAN, ..limits };
    assert_eq!(forecast.calm_windows(SPOT, &broken, 0.0, 10.0, 1.0), []);
}
