use super::*;
use crate::shape::tests::{Sea, sampled};
use crate::{Jonswap, PiersonMoskowitz, Record, Spectrum, Welch};
use approx::assert_relative_eq;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const ALL_HZ: (f64, f64) = (0.0, f64::INFINITY);

fn scatter() -> Scatter {
    Scatter::independent(40.0).unwrap()
}

#[test]
fn a_tail_is_not_taken_for_noise() {
    let [grown, young] = [1.0, 3.3].map(|gamma| Jonswap::new(0.3, 2.5, gamma).unwrap());
    for sea in [grown, young] {
        let spectrum = sampled(0.01, 501, |f_hz| sea.density_m2_per_hz(f_hz));
        for low_hz in [0.8, 1.2, 2.0] {
            let floor = NoiseFloor::estimated(&spectrum, &scatter(), (low_hz, 5.0)).unwrap();
            let left = floor.moment(&spectrum, 0, ALL_HZ);
            assert_relative_eq!(left.value, 0.3 * 0.3 / 16.0, max_relative = 0.01);
            // Of the second moment, where the tail counts, no more than 2 % is lost.
            let m2 = spectrum.moment(2, 0.0, 5.0);
            assert_relative_eq!(floor.moment(&spectrum, 2, ALL_HZ).value, m2, max_relative = 0.02);
        }
    }
    // Donelan, Hamilton & Hui (1985): Toba's tail.
    let spectrum = sampled(0.01, 501, |f_hz| if f_hz > 0.0 { f_hz.powi(-4) * (-(0.3 / f_hz).powi(4)).exp() } else { 0.0 });
    assert!(NoiseFloor::estimated(&spectrum, &scatter(), (0.8, 5.0)).unwrap().density_m2_per_hz < 1e-6);
}

/// A tenth of the sea's variance as noise, with and without a motor's line: theory gives both parts.
#[test]
fn noise_is_found_and_the_sea_comes_back() {
    let sea = PiersonMoskowitz::new(0.3, 2.5).unwrap();
    let m0_m2 = 0.3 * 0.3 / 16.0;
    let noise_m2_per_hz = 0.1 * m0_m2 / 5.0;
    for motor in [0.0, 50.0] {
        let line = |f_hz: f64| if (f_hz - 3.1).abs() < 0.015 { motor * noise_m2_per_hz } else { 0.0 };
        let bare = sampled(0.01, 501, |f_hz| sea.density_m2_per_hz(f_hz) + noise_m2_per_hz);
        let spectrum = sampled(0.01, 501, |f_hz| sea.density_m2_per_hz(f_hz) + noise_m2_per_hz + line(f_hz));
        let floor = NoiseFloor::estimated(&spectrum, &scatter(), (0.9, 5.0)).unwrap();
        assert_relative_eq!(floor.density_m2_per_hz, noise_m2_per_hz, max_relative = 0.01);
        assert_relative_eq!(floor.sigma_m(10.0), (0.1 * m0_m2).sqrt(), max_relative = 0.01);
        assert_relative_eq!(floor.moment(&bare, 0, ALL_HZ).value, m0_m2, max_relative = 0.02);
        assert_relative_eq!(floor.removed(&bare).moment(0, 0.0, 5.0), m0_m2, max_relative = 0.02);
    }
}

/// Hours at 10 Hz of a Gaussian sea under noise of 8 mm: the sea's own height within 1 % (2 % of m0) in each, without noise
/// m0 loses less than 1 %, and errors are as large as stated.
#[test]
fn noise_of_records_is_found_as_well_as_stated() {
    let (rate_hz, samples, sigma_m) = (10.0, 36_000, 0.008);
    let mut seas = Sea::new(&PiersonMoskowitz::new(0.3, 2.5).unwrap(), rate_hz, 72_000, 3);
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let welch = Welch::new(1200);
    let scatter = Scatter::of(&welch, samples).unwrap();
    let spectrum = |samples_m: &[f64]| welch.spectrum(&Record::new(samples_m, rate_hz).unwrap()).unwrap();
    let known = NoiseFloor::of_sigma(sigma_m, 0.0, rate_hz).unwrap();
    let (mut squares, mut worst, seeds) = (0.0, 0.0_f64, 60);
    for _ in 0..seeds {
        let clean_m = &seas.draw()[..samples];
        let noisy_m: Vec<f64> =
            clean_m.iter().map(|x| x + sigma_m * random.sample::<f64, _>(rand_distr::StandardNormal)).collect();
        let (clean, noisy) = (spectrum(clean_m), spectrum(&noisy_m));
        let m0_m2 = clean.moment(0, 0.0, 5.0);
        let floor = NoiseFloor::estimated(&noisy, &scatter, (1.0, 5.0)).unwrap();
        squares += ((floor.density_m2_per_hz - known.density_m2_per_hz) / floor.error_m2_per_hz).powi(2);
        worst = worst.max((floor.moment(&noisy, 0, ALL_HZ).value / m0_m2 - 1.0).abs());
        for floor in [floor, known] {
            assert_relative_eq!(floor.moment(&noisy, 0, ALL_HZ).value, m0_m2, max_relative = 0.02);
        }
        let none = NoiseFloor::estimated(&clean, &scatter, (1.0, 5.0)).unwrap();
        assert_relative_eq!(none.moment(&clean, 0, ALL_HZ).value, m0_m2, max_relative = 0.01);
    }
    // Four standard errors of a mean square of 60 are ± 0.73; the exponent's share makes the stated error a little too wide.
    let mean_square = squares / f64::from(seeds);
    println!("mean square of the noise's errors over the stated: {mean_square:.2}; m0 is off by {worst:.2e} at most");
    assert!((0.3..1.75).contains(&mean_square), "{mean_square}");
}

/// 2 σ²/r over all frequencies up to r/2 is σ²; its error is that of a square.
#[test]
fn a_known_sigma_is_a_known_floor() {
    let floor = NoiseFloor::of_sigma(0.02, 0.001, 8.0).unwrap();
    assert_relative_eq!(floor.density_m2_per_hz * 4.0, 0.02 * 0.02, max_relative = 1e-12);
    assert_relative_eq!(floor.error_m2_per_hz / floor.density_m2_per_hz, 2.0 * 0.05, max_relative = 1e-12);
    assert_relative_eq!(floor.sigma_m(8.0), 0.02, max_relative = 1e-12);
    let moment = floor.moment(&sampled(0.5, 9, |_| 1.0), 1, (0.9, 2.1));
    assert_relative_eq!(moment.value, (1.0 - floor.density_m2_per_hz) * 0.5 * (1.0 + 1.5 + 2.0), max_relative = 1e-12);
    assert_relative_eq!(moment.error, floor.error_m2_per_hz * 2.25, max_relative = 1e-12);
    for (sigma_m, error_m, rate_hz) in
        [(-1.0, 0.0, 1.0), (1.0, -1.0, 1.0), (1.0, 0.0, 0.0), (f64::NAN, 0.0, 1.0), (1e200, 0.0, 1.0)]
    {
        assert_eq!(NoiseFloor::of_sigma(sigma_m, error_m, rate_hz), None);
    }
}

#[test]
fn too_little_to_tell_is_none() {
    let flat = sampled(0.1, 51, |_| 1.0);
    for band_hz in [(4.5, 5.0), (6.0, 9.0), (f64::NAN, 5.0), (3.0, 2.0)] {
        assert_eq!(NoiseFloor::estimated(&flat, &scatter(), band_hz), None);
    }
    assert_eq!(NoiseFloor::estimated(&sampled(0.1, 51, |_| 0.0), &scatter(), (1.0, 5.0)), None);
    assert_relative_eq!(
        NoiseFloor::estimated(&flat, &scatter(), (1.0, 5.0)).unwrap().density_m2_per_hz,
        1.0,
        max_relative = 1e-6
    );
}
