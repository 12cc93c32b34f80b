//! Simulated water against linear wave theory and against the spectrum that was asked for.

use std::f64::consts::TAU;
use std::time::Duration;

use approx::assert_relative_eq;
use halcyon_model::Stamp;
use halcyon_sim::sea::{SeaConfig, SeaError};
use halcyon_sim::water::Water;

/// An afternoon in 2026, to the nanosecond.
const NOW: Stamp = Stamp::from_nanos(1_780_000_000_123_456_789);

#[allow(clippy::unwrap_used, reason = "a helper of tests")]
fn water(config: &SeaConfig) -> Water {
    Water::new(config, 7).unwrap()
}

#[test]
fn still_water_is_still() {
    let still = water(&SeaConfig::still());
    assert_eq!(still.true_h_s_m(), 0.0);
    let point = still.surface(3.0, -4.0, NOW);
    assert_eq!((point.elevation_m, point.slope.norm(), point.rise_mps), (0.0, 0.0, 0.0));
    // A JONSWAP sea of no height is still too, and not 0/0.
    assert_eq!(water(&SeaConfig::jonswap(0.0, 1.3, 0.0)).elevation_m(1.0, 2.0, NOW), 0.0);
}

#[test]
fn regular_waves_have_their_height_length_period_and_heading() {
    let (height_m, period_s) = (0.3, 2.0);
    let waves = water(&SeaConfig { depth_m: 4000.0, ..SeaConfig::regular(height_m, period_s, 240.0) });
    assert_eq!(waves.true_h_s_m(), height_m);
    // Deep water: λ = g T² / 2π.
    let length_m = 9.806_65 * period_s * period_s / TAU;
    assert_relative_eq!(waves.shortest_wavelength_m(), length_m, max_relative = 1e-6);
    // From 240° is towards 60°: half north, 0.866 east.
    let (north, east) = (0.5, 0.75_f64.sqrt());
    let along = |m: f64, s: f64| waves.elevation_m(north * m, east * m, NOW + Duration::from_secs_f64(s));
    let profile: Vec<f64> = (0..3600).map(|i| along(length_m * f64::from(i) / 3600.0, 0.0)).collect();
    let (crest, trough) = profile.iter().fold((f64::MIN, f64::MAX), |(hi, lo), &z| (hi.max(z), lo.min(z)));
    assert_relative_eq!(crest - trough, height_m, max_relative = 1e-5);
    for i in 0..10 {
        let m = f64::from(i) * 0.7;
        assert_relative_eq!(along(m, 0.0), along(m + length_m, 0.0), epsilon = 1e-6);
        assert_relative_eq!(along(m, 0.0), along(m, period_s), epsilon = 1e-6);
        // The crests run towards 60°, not 240°, and are level across.
        assert_relative_eq!(along(m, 0.0), along(m + 0.3 * length_m, 0.3 * period_s), epsilon = 1e-6);
        assert_relative_eq!(
            along(m, 0.0),
            waves.elevation_m(north * m - 5.0 * east, east * m + 5.0 * north, NOW),
            epsilon = 1e-9
        );
    }
}

#[test]
fn every_component_obeys_the_dispersion_relation() {
    for depth_m in [0.3, 2.0, 500.0] {
        for c in water(&SeaConfig { depth_m, ..SeaConfig::default() }).components() {
            let k = c.north_radpm.hypot(c.east_radpm);
            let omega = TAU * c.frequency_hz();
            assert_relative_eq!(omega * omega, 9.806_65 * k * (k * depth_m).tanh(), max_relative = 1e-9);
        }
    }
}

/// The surface as a whole, not the amplitudes that it was made of: variance over many independent places and times.
#[test]
fn a_jonswap_sea_has_the_height_asked_for() {
    for (height_m, period_s) in [(0.05, 1.3), (2.5, 9.0)] {
        let sea = water(&SeaConfig::jonswap(height_m, period_s, 240.0));
        assert_relative_eq!(sea.true_h_s_m(), height_m, max_relative = 1e-12);
        let n = 20_000;
        let sum: f64 = (0..n)
            .map(|i| {
                sea.elevation_m(
                    f64::from(i % 100) * 37.0,
                    f64::from(i) * 11.3,
                    NOW + Duration::from_secs_f64(f64::from(i) * 17.7),
                )
            })
            .map(|z| z * z)
            .sum();
        // 20,000 samples of a Gaussian: the standard deviation of this estimate is 0.5 %.
        assert_relative_eq!(4.0 * (sum / f64::from(n)).sqrt(), height_m, max_relative = 0.02);
    }
}

/// JONSWAP written out once more, from Hasselmann et al. (1973).
fn jonswap_shape(nu: f64) -> f64 {
    let sigma = if nu <= 1.0 { 0.07 } else { 0.09 };
    nu.powi(-5) * (-1.25 / nu.powi(4)).exp() * 3.3_f64.powf((-(nu - 1.0).powi(2) / (2.0 * sigma * sigma)).exp())
}

#[test]
fn its_energy_lies_at_the_frequencies_of_the_spectrum() {
    let sea = water(&SeaConfig::default());
    let step = 1e-4;
    let share = |from: f64, to: f64| {
        let area = |a: f64, b: f64| {
            ((a / step) as u32..(b / step) as u32).map(|i| jonswap_shape((f64::from(i) + 0.5) * step) * step).sum::<f64>()
        };
        area(from, to) / area(0.4, 40.0)
    };
    let energy = |from: f64, to: f64| {
        let all: f64 = sea.components().iter().map(|c| c.amplitude_m.powi(2)).sum();
        let nu = |hz: f64| hz * 1.3;
        sea.components()
            .iter()
            .filter(|c| (from..to).contains(&nu(c.frequency_hz())))
            .map(|c| c.amplitude_m.powi(2))
            .sum::<f64>()
            / all
    };
    for (from, to) in [(0.4, 0.9), (0.9, 1.1), (1.1, 1.5), (1.5, 2.0), (2.0, 3.1)] {
        // One component more or less at either edge.
        assert!((share(from, to) - energy(from, to)).abs() < 0.025, "{from} {to}: {} {}", share(from, to), energy(from, to));
    }
}

#[test]
fn it_comes_from_where_it_should_with_its_spread() {
    for (s, tolerance_deg) in [(2.0, 8.0), (10.0, 4.0), (75.0, 1.5)] {
        let sea = water(&SeaConfig { spreading_s: s, ..SeaConfig::jonswap(0.05, 1.3, 300.0) });
        let (mut north, mut east, mut all) = (0.0, 0.0, 0.0);
        for c in sea.components() {
            let energy = c.amplitude_m.powi(2);
            let k = c.north_radpm.hypot(c.east_radpm);
            north += energy * c.north_radpm / k;
            east += energy * c.east_radpm / k;
            all += energy;
        }
        let from_deg = (-east).atan2(-north).to_degrees().rem_euclid(360.0);
        assert!((from_deg - 300.0).abs() < tolerance_deg, "s = {s}: from {from_deg}");
        // m1 = s / (s + 1) (Kuik et al., 1988).
        assert_relative_eq!((north / all).hypot(east / all), s / (s + 1.0), max_relative = 0.05);
    }
}

#[test]
fn slope_and_rise_are_the_derivatives() {
    let sea = water(&SeaConfig { depth_m: 0.4, ..SeaConfig::default() });
    for i in 0..20 {
        let (n, e) = (f64::from(i) * 1.7, f64::from(i) * -0.9);
        let d = 1e-4;
        let point = sea.surface(n, e, NOW);
        assert_relative_eq!(point.elevation_m, sea.elevation_m(n, e, NOW), epsilon = 1e-12);
        let along_north = (sea.elevation_m(n + d, e, NOW) - sea.elevation_m(n - d, e, NOW)) / (2.0 * d);
        let along_east = (sea.elevation_m(n, e + d, NOW) - sea.elevation_m(n, e - d, NOW)) / (2.0 * d);
        assert_relative_eq!(point.slope.x, along_north, epsilon = 1e-6);
        assert_relative_eq!(point.slope.y, along_east, epsilon = 1e-6);
        // A microsecond: at Unix times a double's seconds would have lost a quarter of it.
        let rise = (sea.elevation_m(n, e, NOW + Duration::from_micros(1)) - point.elevation_m) / 1e-6;
        assert_relative_eq!(point.rise_mps, rise, epsilon = 1e-5);
    }
}

#[test]
fn the_seed_is_the_sea() {
    let config = SeaConfig::default();
    assert_eq!(Water::new(&config, 7), Water::new(&config, 7));
    let other = Water::new(&config, 8).unwrap();
    assert!((other.elevation_m(0.0, 0.0, NOW) - water(&config).elevation_m(0.0, 0.0, NOW)).abs() > 1e-6);
    assert_relative_eq!(other.true_h_s_m(), 0.05, max_relative = 1e-12);
}

#[test]
fn seas_that_cannot_be_are_refused() {
    #[track_caller]
    fn check(config: &SeaConfig, expected: &str) {
        assert_eq!(Water::new(config, 1).unwrap_err().to_string(), expected);
    }
    check(&SeaConfig { height_m: -1.0, ..SeaConfig::default() }, "sea height_m must be from 0 to 30, not -1");
    check(&SeaConfig { period_s: f64::NAN, ..SeaConfig::default() }, "sea period_s must be from 0.3 to 30, not NaN");
    check(&SeaConfig { gamma: 0.5, ..SeaConfig::default() }, "sea gamma must be from 1 to 20, not 0.5");
    check(&SeaConfig { components: 100_000, ..SeaConfig::default() }, "sea components must be from 16 to 256, not 100000");
    assert!(matches!(Water::new(&SeaConfig::regular(1.0, 1.0, 0.0), 1), Err(SeaError::Steep { .. })));
}
