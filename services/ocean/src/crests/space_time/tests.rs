//! Numbers of waves by hand, and the highest crest against simulated seas.

use super::super::distribution::{Rayleigh, Tayfun};
use super::super::maximum::highest;
use super::super::sea::tests::{lines, moments};
use super::*;
use approx::assert_relative_eq;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIDES: Region = Region { x_m: 0.0, y_m: 0.0, duration_s: 0.0 };

/// The same energy every way, one frequency: ⟨kₓ²⟩ = ⟨k_y²⟩ = k²/2, nothing crossed.
fn isotropic(f_hz: f64) -> Vec<WaveComponent> {
    (0..360).map(|i| WaveComponent { f_hz, towards_rad: f64::from(i).to_radians(), variance_m2: 1.0 / 360.0 }).collect()
}

/// By hand, k = ω²/g: along an edge X k/(2π√2), on a face XY k²/2/(2π)^1.5, in the volume XYD k² ω/2/(2π)².
#[test]
fn waves_are_counted_in_closed_form() {
    let omega = TAU * 0.5;
    let k = omega * omega / crate::GRAVITY_MPS2;
    let of = |region: Region| SpaceTime::of(isotropic(0.5), Depth::DEEP, region, 0.0).unwrap();
    let edge = of(Region { x_m: 30.0, ..SIDES });
    assert_relative_eq!(edge.waves_on_edges, 30.0 * k / (TAU * 2f64.sqrt()), max_relative = 1e-9);
    assert_eq!((edge.waves_on_faces, edge.waves_in_volume), (0.0, 0.0));
    let all = of(Region { x_m: 30.0, y_m: 20.0, duration_s: 60.0 });
    let faces = 600.0 * k * k / 2.0 + (30.0 + 20.0) * 60.0 * k * omega / 2f64.sqrt();
    assert_relative_eq!(all.waves_on_faces, faces / TAU.powf(1.5), max_relative = 1e-9);
    assert_relative_eq!(all.waves_in_volume, 36_000.0 * k * k * omega / 2.0 / (TAU * TAU), max_relative = 1e-9);
    assert_relative_eq!(all.waves_on_edges, edge.waves_on_edges / 30.0 * 50.0 + 30.0, max_relative = 1e-9);
    // Waves all one way and of one frequency are a line in time and space: no area, no volume.
    let swell = SpaceTime::of(
        [WaveComponent { f_hz: 0.5, towards_rad: 0.3, variance_m2: 1.0 }],
        Depth::DEEP,
        Region { x_m: 30.0, y_m: 20.0, duration_s: 60.0 },
        0.0,
    )
    .unwrap();
    assert!(swell.waves_in_volume < 1e-4 && swell.waves_on_faces < 1e-4, "{swell:?}");
}

/// At a point for a time: N_B = D/T_m02 waves, whose highest Rayleigh crest it is to within what Poisson's and binomial counts differ.
#[test]
fn at_a_point_it_is_the_highest_of_as_many_waves() {
    let lines = lines(4.0, 8.0, 3.3);
    let sea = moments(&lines);
    let components = lines.iter().map(|&(f_hz, variance_m2)| WaveComponent { f_hz, towards_rad: 0.0, variance_m2 });
    let duration_s = 500.0 * sea.t_m02_s();
    for mu in [0.0, 0.06] {
        let point = SpaceTime::of(components.clone(), Depth::DEEP, Region { duration_s, ..SIDES }, mu).unwrap();
        assert_relative_eq!(point.waves_on_edges, 500.0, max_relative = 1e-9);
        let (found, expected) = (point.highest(), highest(&Tayfun::crests(sea.m0, mu), 500.0));
        assert_relative_eq!(found.expected_m, expected.expected_m, max_relative = 1e-3);
        assert_relative_eq!(found.low_m, expected.low_m, max_relative = 3e-3);
        assert_relative_eq!(found.high_m, expected.high_m, max_relative = 1e-3);
    }
    assert!(highest(&Rayleigh::crests(sea.m0), 500.0).expected_m > 3.0 * sea.m0.sqrt());
}

/// A hundred random seas over eight by eight mean wavelengths (and none in time), drawn wave by wave: the mean of their highest points, and the
/// 95 % interval's share.
#[test]
fn over_an_area_it_is_what_random_seas_have() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let (cells, side_m) = (192, 8.0 * 2f64.sqrt());
    // Wavenumbers near 1/m × 2π in every direction, a ring a fifth wide, by the deep dispersion relation.
    let waves: Vec<WaveComponent> = (0..256)
        .map(|i| {
            let k = TAU * (0.8 + 0.4 * f64::from(i % 8) / 7.0);
            WaveComponent {
                f_hz: (crate::GRAVITY_MPS2 * k).sqrt() / TAU,
                towards_rad: TAU * f64::from(i) / 256.0,
                variance_m2: 1.0 / 256.0,
            }
        })
        .collect();
    let theory = SpaceTime::of(waves.iter().copied(), Depth::DEEP, Region { x_m: side_m, y_m: side_m, duration_s: 0.0 }, 0.0)
        .unwrap()
        .highest();
    let step_m = side_m / f64::from(cells);
    let maxima: Vec<f64> = (0..100)
        .map(|_| {
            let mut surface = vec![0.0; (cells * cells) as usize];
            for wave in &waves {
                let k = wavenumber_radpm(TAU * wave.f_hz, Depth::DEEP);
                // A Gaussian sea: random amplitudes too.
                let (a, b): (f64, f64) = (random.sample(rand_distr::StandardNormal), random.sample(rand_distr::StandardNormal));
                let scale = wave.variance_m2.sqrt();
                let (kx, ky) = (k * wave.towards_rad.cos() * step_m, k * wave.towards_rad.sin() * step_m);
                let row: Vec<(f64, f64)> = (0..cells).map(|i| (f64::from(i) * kx).sin_cos()).collect();
                for j in 0..cells {
                    let (sin_y, cos_y) = (f64::from(j) * ky).sin_cos();
                    let (c, s) = (scale * (a * cos_y + b * sin_y), scale * (b * cos_y - a * sin_y));
                    let line = &mut surface[(j * cells) as usize..((j + 1) * cells) as usize];
                    line.iter_mut().zip(&row).for_each(|(z, (sin_x, cos_x))| *z += c * cos_x + s * sin_x);
                }
            }
            surface.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        })
        .collect();
    let mean = maxima.iter().sum::<f64>() / 100.0;
    // The mean of a hundred scatters by 0.035 and a grid of seventeen points a wave misses the tops by half a percent; excursions that come in
    // clusters make Poisson's count a little high.
    assert_relative_eq!(mean, theory.expected_m, max_relative = 0.04);
    let inside = maxima.iter().filter(|m| (theory.low_m..=theory.high_m).contains(*m)).count();
    assert!(inside >= 88, "{inside} of 100 in {theory:?}");
}

#[test]
fn an_area_is_higher_than_a_point_and_nonsense_is_none() {
    let of = |region: Region| SpaceTime::of(isotropic(0.5), Depth::DEEP, region, 0.0);
    let duration_s = 300.0;
    let point = of(Region { duration_s, ..SIDES }).unwrap().highest();
    let area = of(Region { x_m: 20.0, y_m: 20.0, duration_s }).unwrap().highest();
    assert!(area.expected_m > 1.1 * point.expected_m && area.low_m > point.low_m);
    assert_eq!(of(Region { x_m: f64::NAN, ..SIDES }), None);
    assert_eq!(of(Region { x_m: -1.0, ..SIDES }), None);
    assert_eq!(SpaceTime::of([], Depth::DEEP, SIDES, 0.0), None);
    assert!(of(SIDES).unwrap().highest().expected_m.is_finite());
}
