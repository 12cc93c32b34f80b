//! Lines of a spectrum, and spectra against readings.

use super::*;

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
