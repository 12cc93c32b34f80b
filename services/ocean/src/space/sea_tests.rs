//! What is found of synthesised seas (JONSWAP, γ 3.3, cos-2s, deep water), against the closed forms they were made by. A minute's film holds a
//! score of independent waves: means over some films are judged where one would scatter more than the tolerance.

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::synthetic::{PlaneWave, Sea, elevations, film, off_deg};
use super::*;
use crate::dispersion::Depth;

const SMALL: Shape = Shape { rows: 20, cols: 20, frames: 480 };

fn spread_of(s: f64) -> f64 {
    (2.0 / (s + 1.0)).sqrt()
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let all: Vec<f64> = values.into_iter().collect();
    all.iter().sum::<f64>() / all.len() as f64
}

#[track_caller]
fn near(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "{found} for {expected}: {:+.1} %", 100.0 * (found / expected - 1.0));
}

/// 20 x 20 m at 4 Hz for two minutes, four films: T_p 2 s, s 10.
#[test]
fn a_film_of_some_waves_tells_all_of_a_sea() {
    let sea = Sea::new(0.1, 2.0, 10.0, 200.0);
    let shape = Shape { rows: 100, cols: 100, frames: 480 };
    let all: Vec<_> = (0..4)
        .map(|seed| {
            let spectrum = Welch3 { segment_frames: 120 }.spectrum(&sea.film(shape, 0.2, 4.0, seed)).unwrap();
            let (spectrum, share) = spectrum.on_shell(&Shell::new(Water::DEEP));
            assert!(share.energy_share > 0.995, "{share:?}");
            spectrum.statistics(&Water::DEEP).unwrap()
        })
        .collect();
    let of = |f: fn(&FilmStatistics) -> f64| mean(all.iter().map(f));
    let direction = mean(all.iter().map(|s| off_deg(s.direction_from_rad, sea.from_rad)));
    assert!(direction.abs() < 2.0, "{direction}");
    let peak = mean(all.iter().map(|s| off_deg(s.direction_peak_from_rad, sea.from_rad)));
    assert!(peak.abs() < 4.0, "{peak}");
    near(of(|s| s.spread_rad), spread_of(10.0), 0.05);
    near(of(|s| s.h_m0_m), 4.0 * sea.moment_k(0).sqrt(), 0.05);
    near(of(|s| s.f_p_hz), 0.5, 0.03);
    near(of(|s| s.wavelength_mean_m), TAU * sea.moment_k(0) / sea.moment_k(1), 0.03);
    near(of(|s| s.wavelength_peak_m), crate::dispersion::wavelength_m(2.0, Depth::DEEP), 0.05);
    near(of(|s| s.mss), sea.moment_k(2), 0.05);
    // Half of 1 ± m2, with m2 = s(s − 1)/((s + 1)(s + 2)).
    near(of(|s| s.mss_along / s.mss), 0.5 * (1.0 + 90.0 / 132.0), 0.02);
    near(of(|s| s.mss_across / s.mss), 0.5 * (1.0 - 90.0 / 132.0), 0.06);
}

/// 4 x 4 m, shorter than the peak's 6.2 m, two minutes and one, eight films: moments, and S(f, θ) by entropy.
#[test]
fn a_film_shorter_than_its_waves_tells_directions_by_moments() {
    for (s, frames) in [(10.0, 480), (25.0, 480), (10.0, 240), (25.0, 240)] {
        let sea = Sea::new(0.1, 2.0, s, 200.0);
        let shape = Shape { frames, ..SMALL };
        let all: Vec<_> = (0..8)
            .map(|seed| {
                let spectrum = Welch3 { segment_frames: frames / 2 }.spectrum(&sea.film(shape, 0.2, 4.0, seed)).unwrap();
                let moments = spectrum.on_shell(&Shell::new(Water::DEEP)).0.moments(&Water::DEEP);
                let overall = FourierMoments::overall(&moments).unwrap();
                let moments = FourierMoments::smoothed(&moments, frames / 120);
                let entropy = DirectionalSpectrum::by_entropy(&moments, (0.3, 1.5), 120).unwrap();
                (overall, entropy.overall().unwrap(), entropy.wavelengths_m(&Water::DEEP).unwrap())
            })
            .collect();
        for of in
            [|x: &(FourierMoments, FourierMoments, (f64, f64))| x.0, |x: &(FourierMoments, FourierMoments, (f64, f64))| x.1]
        {
            let direction = mean(all.iter().map(|x| off_deg(of(x).direction_from_rad(), sea.from_rad)));
            assert!(direction.abs() < 2.0, "s {s}: {direction}");
            let spread = mean(all.iter().map(|x| of(x).spread_rad()));
            println!("short s {s} frames {frames}: {direction:.2} {:+.1} %", 100.0 * (spread / spread_of(s) - 1.0));
            near(spread, spread_of(s), 0.1);
        }
        near(mean(all.iter().map(|x| x.2.1)), TAU * sea.moment_k(0) / sea.moment_k(1), 0.04);
        near(mean(all.iter().map(|x| x.2.0)), crate::dispersion::wavelength_m(2.0, Depth::DEEP), 0.06);
    }
}

/// What an array finds of films: directions off, spreads, H_m0 and mean wavelengths.
fn array(sea: &Sea, shape: Shape, removed: Removed, focused_bins: usize, seeds: std::ops::Range<u64>) -> Vec<[f64; 4]> {
    seeds
        .map(|seed| {
            let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
            let mut all = elevations(&sea.waves(400, seed), shape, 0.2, 4.0);
            all.iter_mut().for_each(|z| *z += 0.002 * random.sample::<f32, _>(rand_distr::StandardNormal));
            if removed == Removed::Plane {
                // As patches that are levelled frame by frame: any plane may be missing.
                for (i, z) in all.iter_mut().enumerate() {
                    let (t, row, col) = (i / shape.frame_cells(), i / shape.cols % shape.rows, i % shape.cols);
                    *z += (0.7 * t as f32).sin() * (0.1 + 0.02 * row as f32 - 0.01 * col as f32);
                }
            }
            let film = Film::new(all, shape, 0.2, 4.0).unwrap();
            let array = Array { focused_bins, ..Array::new(removed, 120, (0.35, 1.5)) };
            let found = array.spectrum(&film, &Water::DEEP).unwrap();
            let overall = found.overall().unwrap();
            let (_, wavelength_m) = found.wavelengths_m(&Water::DEEP).unwrap();
            let direction = off_deg(overall.direction_from_rad(), sea.from_rad);
            [direction, overall.spread_rad(), 4.0 * found.variance_m2().sqrt(), wavelength_m]
        })
        .collect()
}

/// 4 x 4 m for four minutes: whole, and with a random plane added to each frame, which an array that is told so does not see.
#[test]
fn a_film_without_planes_tells_directions_by_likelihood() {
    let shape = Shape { frames: 960, ..SMALL };
    for (s, tolerance) in [(3.0, 0.1), (10.0, 0.1), (25.0, 0.15)] {
        let sea = Sea::new(0.1, 2.0, s, 200.0);
        for removed in [Removed::Nothing, Removed::Plane] {
            let all = array(&sea, shape, removed, 0, 0..3);
            let [direction, spread, h_m0_m, wavelength_m] = [0, 1, 2, 3].map(|i| mean(all.iter().map(|x| x[i])));
            println!(
                "s {s} {removed:?}: {direction:.2} {:+.1} % {h_m0_m:.4} {wavelength_m:.3}",
                100.0 * (spread / spread_of(s) - 1.0)
            );
            assert!(direction.abs() < 2.0, "s {s} {removed:?}: {direction}");
            near(spread, spread_of(s), tolerance);
            near(h_m0_m, 4.0 * sea.moment_k(0).sqrt(), 0.06);
            near(wavelength_m, TAU * sea.moment_k(0) / sea.moment_k(1), 0.06);
        }
    }
}

/// The same for one minute: directions hold, spreads come out a tenth too wide (sixteen gauges, three segments).
#[test]
fn a_minute_tells_directions_but_widens_them() {
    let shape = Shape { frames: 240, ..SMALL };
    let sea = Sea::new(0.1, 2.0, 10.0, 320.0);
    for removed in [Removed::Nothing, Removed::Plane] {
        let all = array(&sea, shape, removed, 2, 0..6);
        let [direction, spread, ..] = [0, 1, 2, 3].map(|i| mean(all.iter().map(|x| x[i])));
        println!("minute {removed:?}: {direction:.2} {:+.1} %", 100.0 * (spread / spread_of(10.0) - 1.0));
        assert!(direction.abs() < 2.0, "{removed:?}: {direction}");
        near(spread, spread_of(10.0), 0.15);
    }
}

/// White noise is spread over all cells alike; a wave over a current is on the shell of that current only, and has its direction.
#[test]
fn the_shell_keeps_waves_and_drops_the_rest() {
    let shape = Shape { rows: 64, cols: 64, frames: 256 };
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let noise = (0..64 * 64 * 256).map(|_| 0.1 * random.sample::<f32, _>(rand_distr::StandardNormal)).collect();
    let noise = Welch3 { segment_frames: 64 }.spectrum(&Film::new(noise, shape, 0.25, 4.0).unwrap()).unwrap();
    let (_, share) = noise.clone().on_shell(&Shell::new(Water::DEEP));
    assert!(share.cells_share > 0.02 && share.cells_share < 0.3, "{share:?}");
    near(share.energy_share, share.cells_share, 0.02);
    let (_, share) = noise.on_shell(&Shell { less_noise: true, ..Shell::new(Water::DEEP) });
    assert!(share.on_m2.abs() < 0.02 * share.off_m2, "{share:?}");

    let over = Water { depth: Depth::DEEP, current_mps: [1.5, 0.0] };
    let from_rad = 160_f64.to_radians();
    let k_radpm = 2.5;
    let (sin, cos) = from_rad.sin_cos();
    let omega_radps = over.omega_radps(k_radpm, from_rad);
    let wave = PlaneWave {
        amplitude_m: 0.1,
        k_north_radpm: -k_radpm * cos,
        k_east_radpm: -k_radpm * sin,
        omega_radps,
        phase_rad: 1.0,
    };
    let spectrum = Welch3 { segment_frames: 64 }.spectrum(&film(&[wave], shape, 0.25, 4.0)).unwrap();
    let (kept, share) = spectrum.clone().on_shell(&Shell::new(over));
    assert!(share.energy_share > 0.995, "{share:?}");
    let found = kept.statistics(&over).unwrap();
    assert!(off_deg(found.direction_from_rad, from_rad).abs() < 1.0, "{found:?}");
    near(found.wavelength_mean_m, TAU / k_radpm, 0.01);
    near(found.mss, 0.5 * (0.1 * k_radpm).powi(2), 0.02);
    let (_, share) = spectrum.on_shell(&Shell::new(Water::DEEP));
    assert!(share.energy_share < 0.05, "{share:?}");
}

#[test]
fn still_seas_and_bad_arrays() {
    let still = Film::new(vec![0.0; 20 * 20 * 64], Shape { frames: 64, ..SMALL }, 0.2, 4.0).unwrap();
    let spectrum = Welch3 { segment_frames: 32 }.spectrum(&still).unwrap();
    assert_eq!(spectrum.clone().on_shell(&Shell::new(Water::DEEP)).1.energy_share, 0.0);
    assert_eq!(spectrum.statistics(&Water::DEEP), None);
    assert_eq!(DirectionalSpectrum::by_entropy(&spectrum.moments(&Water::DEEP), (0.1, 1.0), 90), Err(SpaceError::NoEnergy));
    let array = Array::new(Removed::Nothing, 32, (0.3, 1.5));
    assert_eq!(array.spectrum(&still, &Water::DEEP), Err(SpaceError::NoEnergy));
    let sea = Sea::new(0.1, 2.0, 10.0, 0.0).film(Shape { frames: 64, ..SMALL }, 0.2, 4.0, 0);
    for band_hz in [(f64::NAN, 1.0), (0.5, f64::NAN), (1.0, 0.5), (-1.0, 1e-9), (3.0, f64::INFINITY)] {
        assert_eq!(Array { band_hz, ..array }.spectrum(&sea, &Water::DEEP), Err(SpaceError::NoEnergy), "{band_hz:?}");
    }
    assert!(matches!(Array { segment_frames: 65, ..array }.spectrum(&sea, &Water::DEEP), Err(SpaceError::TooShort { .. })));
    let unfit = Array { segment_frames: 7, ..array };
    assert!(matches!(unfit.spectrum(&sea, &Water::DEEP), Err(SpaceError::TooShort { .. })));
    let none = Gauges::Points { side: 0, cells: 0 };
    assert!(matches!(Array { gauges: none, ..array }.spectrum(&sea, &Water::DEEP), Err(SpaceError::Gauges { .. })));
    let wild = Array { loading: f64::NAN, focused_bins: usize::MAX, directions: 0, ..array };
    assert!(wild.spectrum(&sea, &Water { depth: Depth::DEEP, current_mps: [f64::NAN, 0.0] }).is_ok());
}
