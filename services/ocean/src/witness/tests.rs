use super::*;
use crate::quality::series::RawSeries;
use crate::spectrum::{Jonswap, Spectrum};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use realfft::num_complex::Complex;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A Gaussian sea of lines: amplitudes Rayleigh, so that the variance of a record scatters as a true sea's does.
struct Sea(Vec<(f64, f64, f64)>);

impl Sea {
    /// H_m0 of 0.4 m, T_p of 3 s; lines so close that no record here sees them repeat.
    fn new(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let spectrum = Jonswap::new(0.4, 3.0, 3.3).unwrap();
        let df_hz = 1.0 / 640.0;
        let lines = (128..832).map(|i| {
            let f_hz = (f64::from(i) + random.random_range(-0.5..0.5)) * df_hz;
            let amplitude_m = (-2.0 * spectrum.density_m2_per_hz(f_hz) * df_hz * (1.0 - random.random::<f64>()).ln()).sqrt();
            (f_hz * TAU, amplitude_m, random.random_range(-PI..PI))
        });
        Self(lines.collect())
    }

    fn at(&self, t_s: f64) -> f64 {
        self.0.iter().map(|(omega, amplitude_m, phase)| amplitude_m * (omega * t_s + phase).cos()).sum()
    }

    /// `duration_s` at `rate_hz`, seen `lag_s` late, with white noise.
    fn series(&self, rate_hz: f64, duration_s: f64, lag_s: f64, noise_m: f64, seed: u64) -> Series {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
        let noise = Normal::new(0.0, noise_m).unwrap();
        let stamp_s: Vec<f64> = (0..(rate_hz * duration_s) as usize).map(|i| 1.7e9 + i as f64 / rate_hz).collect();
        let mut elevation_m: Vec<f64> = stamp_s.iter().map(|_| noise.sample(&mut random)).collect();
        for (omega, amplitude_m, phase) in &self.0 {
            // Turned on from sample to sample: ten times as fast as a cosine for each.
            let (step, mut wave) = (Complex::cis(omega / rate_hz), Complex::from_polar(*amplitude_m, phase - omega * lag_s));
            for x in &mut elevation_m {
                *x += wave.re;
                wave *= step;
            }
        }
        Series { stamp_s, elevation_m }
    }
}

#[derive(Clone)]
struct Series {
    stamp_s: Vec<f64>,
    elevation_m: Vec<f64>,
}

impl Series {
    fn raw(&self) -> RawSeries<'_> {
        RawSeries { stamp_s: &self.stamp_s, elevation_m: &self.elevation_m }
    }

    fn map(mut self, of: impl Fn(f64) -> f64) -> Self {
        self.elevation_m.iter_mut().for_each(|x| *x = of(*x));
        self
    }
}

fn compared(a: &Series, b: &Series, options: &Options) -> Comparison {
    compare(&a.raw(), &b.raw(), options).unwrap()
}

#[test]
fn a_tilted_range_is_as_long_as_it_is_tilted() {
    assert!((elevation_of_range(4.8, 5.0, 0.0, 0.0) - 0.2).abs() < 1e-12);
    // A flat surface 5 m under: every attitude sees the same level.
    for (roll, pitch) in [(0.1, 0.0), (0.0, -0.2), (0.3, 0.2), (-0.5, 0.5)] {
        let (roll, pitch): (f64, f64) = (roll, pitch);
        assert!(elevation_of_range(5.0 / (roll.cos() * pitch.cos()), 5.0, roll, pitch).abs() < 1e-12);
    }
    for (range, height, roll, pitch) in [
        (0.0, 5.0, 0.0, 0.0),
        (-1.0, 5.0, 0.0, 0.0),
        (f64::NAN, 5.0, 0.0, 0.0),
        (f64::INFINITY, 5.0, 0.0, 0.0),
        (5.0, f64::NAN, 0.0, 0.0),
        (5.0, 5.0, FRAC_PI_2, 0.0),
        (5.0, 5.0, PI, PI),
        (5.0, 5.0, 0.0, f64::NAN),
    ] {
        assert!(elevation_of_range(range, height, roll, pitch).is_nan());
    }
}

#[test]
fn the_same_sea_agrees_and_its_lag_is_found() {
    let (mut lag_worst_s, mut slope_worst) = (0.0_f64, 0.0_f64);
    for seed in 0..5 {
        let sea = Sea::new(seed);
        let (a, b) = (sea.series(10.0, 240.0, 0.0, 0.0, 1), sea.series(7.0, 240.0, 0.13, 0.0, 2).map(|x| x + 0.7));
        let found = compared(&a, &b, &Options::default());
        let peak = found.at_peak.unwrap();
        let ratio = found.height_ratio.unwrap();
        lag_worst_s = lag_worst_s.max((found.lag_s.unwrap() - 0.13).abs());
        slope_worst = slope_worst.max((found.regression.slope - 1.0).abs());
        assert!((found.bias_m + 0.7).abs() < 1e-3 && found.rmse_m < 3e-3, "{found:?}");
        assert!((peak.gain - 1.0).abs() < 0.01 && peak.coherence > 0.999 && peak.phase_rad.abs() < 0.01, "{peak:?}");
        assert!((ratio.value - 1.0).abs() < 0.005 && ratio.deviation < 0.012, "{ratio:?}");
        assert!((found.rate_hz - 7.0).abs() < 1e-3 && found.common_share > 0.99);
        assert!((found.a.h_m0_m / found.a.crossing.unwrap().h_s_m - 1.05).abs() < 0.1, "{found:?}");
        assert_eq!(agreement(&found), Verdict::Agree, "{found:?}");
        // The other way about.
        assert!((compared(&b, &a, &Options::default()).lag_s.unwrap() + 0.13).abs() < 0.01);
    }
    println!("lag to {lag_worst_s:.1e} s, slope to {slope_worst:.1e}");
    assert!(lag_worst_s < 0.01 && slope_worst < 0.01);
}

#[test]
fn a_gain_is_told() {
    let sea = Sea::new(3);
    let (a, b) = (sea.series(10.0, 240.0, 0.0, 0.0, 1).map(|x| 1.2 * x), sea.series(7.0, 240.0, 0.13, 0.0, 2));
    let found = compared(&a, &b, &Options::default());
    let Verdict::Disagree { why } = agreement(&found) else { panic!("{found:?}") };
    let [Difference::Height(ratio)] = why[..] else { panic!("{why:?}") };
    assert!((ratio.value - 1.2).abs() < 0.01 && ratio.interval_95().0 > 1.15, "{ratio:?}");
    assert!((found.at_peak.unwrap().gain - 1.2).abs() < 0.01);
    // Records of different waves could differ as much by chance: no verdict against them.
    let apart = Sea::new(4).series(7.0, 240.0, 0.0, 0.0, 2);
    assert!(compared(&a, &apart, &Options::default()).height_ratio.unwrap().deviation > 0.06);
}

/// Two ratios at √95 % each and the cautious peak: 95 of 100.
#[test]
fn different_waves_of_one_sea_agree_as_often_as_they_should() {
    let (mut agree, mut height, mut period, mut peak, mut lags) = (0, 0, 0, 0, 0);
    let (mut heights_95, mut deviation, n) = (0, 0.0, 240_u64);
    for seed in 0..n {
        let a = Sea::new(1000 + seed).series(5.0, 240.0, 0.0, 0.0, 1);
        let b = Sea::new(5000 + seed).series(4.0, 240.0, 0.0, 0.0, 2);
        let found = compared(&a, &b, &Options::default());
        let (low, high) = found.height_ratio.unwrap().interval_95();
        heights_95 += usize::from(low <= 1.0 && high >= 1.0);
        deviation += found.height_ratio.unwrap().deviation / n as f64;
        lags += usize::from(found.lag_s.is_some());
        match agreement(&found) {
            Verdict::Agree => agree += 1,
            Verdict::Disagree { why } => {
                for difference in why {
                    match difference {
                        Difference::Height(_) => height += 1,
                        Difference::Period(_) => period += 1,
                        _ => peak += 1,
                    }
                }
            }
            Verdict::Unknown { why } => panic!("{why:?}"),
        }
    }
    let share = f64::from(agree) / n as f64;
    println!("agree {share:.3}; height {height}, period {period}, peak {peak}, lags {lags}");
    println!("H at 95 %: {heights_95} of {n}; deviation {deviation:.3}");
    assert!((share - 0.95).abs() < 0.04, "{share}");
}

/// Noise of 60 % of the waves' deviation in the witness: the ordinary slope falls by 1/(1 + 0.36), the others say 1.
#[test]
fn noise_lowers_the_ordinary_slope_alone() {
    let sea = Sea::new(8);
    let (a, b) = (sea.series(8.0, 400.0, 0.0, 0.06, 1), sea.series(8.0, 400.0, 0.2, 0.06, 2));
    let options = Options { noise_a_m: 0.06, noise_b_m: 0.06, ..Options::default() };
    let found = compared(&a, &b, &options);
    let Regression { slope, slope_reduced, slope_deming, .. } = found.regression;
    let peak = found.at_peak.unwrap();
    println!(
        "ordinary {slope:.3}, reduced {slope_reduced:.3}, Deming {slope_deming:.3}, gain {:.3} {:?}",
        peak.gain, peak.gain_95
    );
    assert!(slope < 0.85 && (slope_reduced - 1.0).abs() < 0.03 && (slope_deming - 1.0).abs() < 0.03);
    assert!((peak.gain - 1.0).abs() < 0.05 && peak.gain_95.0 < 1.0 && peak.gain_95.1 > 0.97);
    assert!((found.lag_s.unwrap() - 0.2).abs() < 0.02);
    assert_eq!(agreement(&found), Verdict::Agree, "{found:?}");
}

#[test]
fn what_says_nothing_is_unknown() {
    let sea = Sea::new(9);
    let (a, b) = (sea.series(8.0, 120.0, 0.0, 0.0, 1), sea.series(5.0, 120.0, 0.0, 0.0, 2));
    let options = Options::default();
    let error = |a: &Series, b: &Series| {
        let error = compare(&a.raw(), &b.raw(), &options).unwrap_err();
        assert_eq!(judge(&a.raw(), &b.raw(), &options), Verdict::Unknown { why: vec![Ignorance::Incomparable(error)] });
        error
    };
    let later = Series { stamp_s: b.stamp_s.iter().map(|t| t + 500.0).collect(), ..b.clone() };
    assert!(matches!(error(&a, &later), CompareError::NoOverlap { apart_s } if (apart_s - 380.0).abs() < 1.0));
    let constant = |x: f64| b.clone().map(|_| x);
    assert_eq!(error(&a, &constant(0.3)), CompareError::Flat { which: Which::B });
    assert_eq!(error(&constant(1e5), &a), CompareError::Flat { which: Which::A });
    assert!(matches!(error(&a, &constant(f64::NAN)), CompareError::TooFew { which: Which::B, readings: 0, .. }));
    let ten = Series { stamp_s: b.stamp_s[..10].to_vec(), elevation_m: b.elevation_m[..10].to_vec() };
    assert!(matches!(error(&a, &ten), CompareError::TooFew { readings: 10, .. }));
    let forty = Series { stamp_s: b.stamp_s[..40].to_vec(), elevation_m: b.elevation_m[..40].to_vec() };
    assert!(matches!(error(&a, &forty), CompareError::TooShort { samples: 40, .. }));
    let empty = Series { stamp_s: Vec::new(), elevation_m: Vec::new() };
    assert!(matches!(error(&empty, &empty), CompareError::TooFew { which: Which::A, readings: 0, .. }));
    let stray = Series { stamp_s: b.stamp_s.iter().map(|t| (t - 1.7e9) * 1e-300).collect(), ..b.clone() };
    error(&a, &stray);
    for wrong in [
        Options { max_lag_s: f64::NAN, ..options },
        Options { gap_intervals: 0.5, ..options },
        Options { band_hz: (1.0, 1.0), ..options },
        Options { noise_b_m: -1.0, ..options },
    ] {
        assert!(matches!(compare(&a.raw(), &b.raw(), &wrong), Err(CompareError::Option(_))));
    }
    // Ten waves; only a third of either in common; nothing but noise in both.
    let unknown = |a: &Series, b: &Series, options: &Options| match judge(&a.raw(), &b.raw(), options) {
        Verdict::Unknown { why } => why,
        other => panic!("{other:?}"),
    };
    let short = |rate_hz| sea.series(rate_hz, 30.0, 0.0, 0.0, 1);
    assert!(matches!(unknown(&short(8.0), &short(5.0), &options)[..], [Ignorance::TooShort { .. }]));
    let moved = Series { stamp_s: b.stamp_s.iter().map(|t| t + 70.0).collect(), ..b.clone() };
    assert!(matches!(unknown(&a, &moved, &options)[..], [Ignorance::LittleOverlap { .. }]));
    let noisy = Options { noise_a_m: 0.5, noise_b_m: 0.5, ..options };
    assert!(matches!(unknown(&a, &b, &noisy)[..], [Ignorance::NoWaves { .. }, Ignorance::NoWaves { .. }]));
}

#[test]
fn a_blind_witness_disagrees_and_a_noisy_one_does_not_know() {
    let sea = Sea::new(12);
    let a = sea.series(8.0, 200.0, 0.0, 0.01, 1);
    let blind = sea.series(8.0, 200.0, 0.0, 0.01, 2);
    let hum = |noise_m: f64| Series {
        elevation_m: blind
            .elevation_m
            .iter()
            .zip(&blind.stamp_s)
            .map(|(x, t)| (x - sea.at(t - 1.7e9)) * noise_m / 0.01)
            .collect(),
        ..blind.clone()
    };
    let options = Options { noise_a_m: 0.01, noise_b_m: 0.01, ..Options::default() };
    let verdict = judge(&a.raw(), &hum(0.01).raw(), &options);
    assert!(
        matches!(&verdict, Verdict::Disagree { why } if matches!(why[..], [Difference::WavesInOne { which: Which::A, .. }])),
        "{verdict:?}"
    );
    let verdict = judge(&a.raw(), &hum(0.4).raw(), &Options { noise_b_m: 0.4, ..options });
    assert!(
        matches!(&verdict, Verdict::Unknown { why } if matches!(why[..], [Ignorance::NoWaves { which: Which::B, .. }])),
        "{verdict:?}"
    );
}

#[test]
fn gaps_are_left_out_and_not_made_up() {
    let sea = Sea::new(5);
    let (a, mut b) = (sea.series(10.0, 300.0, 0.0, 0.0, 1), sea.series(7.0, 300.0, -0.31, 0.0, 2));
    // Ten seconds lost, and a reading now and then.
    b.elevation_m[700..770].fill(f64::NAN);
    b.elevation_m.iter_mut().step_by(50).for_each(|x| *x = f64::NAN);
    let found = compared(&a, &b, &Options::default());
    assert!((found.common_s - 290.0).abs() < 1.0, "{}", found.common_s);
    assert!((found.lag_s.unwrap() + 0.31).abs() < 0.01 && (found.regression.slope - 1.0).abs() < 0.01, "{found:?}");
    assert_eq!(agreement(&found), Verdict::Agree, "{found:?}");
}

/// The thesis's ultrasonic sensor at 0.20 Hz: half of the wave lost, and its second harmonic in its place.
#[test]
fn a_peak_elsewhere_is_told() {
    let stamp_s: Vec<f64> = (0..1200).map(|i| f64::from(i) / 5.0).collect();
    let of = |wave: &dyn Fn(f64) -> f64| Series {
        stamp_s: stamp_s.clone(),
        elevation_m: stamp_s.iter().map(|t| wave(*t)).collect(),
    };
    let a = of(&|t| 0.05 * (TAU * 0.2 * t).sin());
    let b = of(&|t| 0.02 * (TAU * 0.2 * t).sin() + 0.045 * (TAU * 0.4 * t).sin());
    let Verdict::Disagree { why } = judge(&a.raw(), &b.raw(), &Options::default()) else { panic!() };
    assert!(why.iter().any(|difference| matches!(difference, Difference::Peak { .. })), "{why:?}");
}

/// The scale is taken as exact, so that chance and what is known of the noise are left. Here the noise is known exactly: what the
/// ratio scatters by is chance alone, the rest of its deviation is for noise that is not known so well.
#[test]
fn the_same_waves_under_noise_differ_as_much_as_they_should() {
    let options = Options { noise_a_m: 0.03, noise_b_m: 0.05, scale_95: 0.0, ..Options::default() };
    let (mut heights_95, mut gains_95, mut agree, mut by_chance) = (0, 0, 0, 0);
    let (mut logarithms, mut chances) = (Vec::new(), 0.0);
    let n = 200_u64;
    for seed in 0..n {
        let sea = Sea::new(20_000 + seed);
        let (a, b) = (sea.series(10.0, 240.0, 0.0, 0.03, seed), sea.series(7.0, 240.0, 0.13, 0.05, seed + 70_000));
        let found = compared(&a, &b, &options);
        let (ratio, gain) = (found.height_ratio.unwrap(), found.at_peak.unwrap().gain_95);
        let noise = [found.a, found.b].map(|one| 0.15 * one.noise_m0_m2 / ((one.h_m0_m / 4.0).powi(2) - one.noise_m0_m2));
        let chance = (ratio.deviation.powi(2) - noise[0].powi(2) - noise[1].powi(2)).sqrt();
        heights_95 += usize::from(ratio.interval_95().0 <= 1.0 && ratio.interval_95().1 >= 1.0);
        gains_95 += usize::from(gain.0 <= 1.0 && gain.1 >= 1.0);
        by_chance += usize::from(ratio.value.ln().abs() < 1.96 * chance);
        agree += usize::from(agreement(&found) == Verdict::Agree);
        logarithms.push(ratio.value.ln());
        chances += chance / n as f64;
    }
    let bias = logarithms.iter().sum::<f64>() / n as f64;
    let scatter = (logarithms.iter().map(|x| (x - bias).powi(2)).sum::<f64>() / n as f64).sqrt();
    println!("of {n}: H {heights_95}, by chance {by_chance}, gain {gains_95}, agree {agree}");
    println!("ln H: bias {bias:.4}, scatter {scatter:.4}, expected {chances:.4}");
    // Unrelated records of this length differ by 0.10.
    assert!(bias.abs() < 0.25 * scatter && (scatter / chances - 1.0).abs() < 0.2);
    assert!(heights_95 >= 190 && agree >= 190 && by_chance >= 182 && gains_95 >= 182);
}

/// A range taken for an elevation.
#[test]
fn a_witness_upside_down_is_told() {
    for seed in 0..10 {
        let sea = Sea::new(300 + seed);
        let (a, b) = (sea.series(8.0, 240.0, 0.0, 0.02, 1), sea.series(8.0, 240.0, 0.1, 0.02, 2).map(|x| 5.0 - x));
        let options = Options { noise_a_m: 0.02, noise_b_m: 0.02, ..Options::default() };
        let Verdict::Disagree { why } = judge(&a.raw(), &b.raw(), &options) else { panic!("{seed}") };
        assert!(matches!(why[..], [Difference::UpsideDown { correlation }] if correlation < -0.8), "{why:?}");
    }
}

/// Readings to the centimetre of waves of ten, as the thesis's ultrasonic sensor has them.
#[test]
fn a_coarse_sensor_agrees() {
    let sea = Sea::new(77);
    let (a, b) = (sea.series(5.0, 240.0, 0.0, 0.0, 1).map(|x| 0.25 * x), sea.series(10.0, 240.0, 0.05, 0.0, 2));
    let b = b.map(|x| (25.0 * x).round() / 100.0);
    let options = Options { noise_b_m: 0.01 / 12.0_f64.sqrt(), ..Options::default() };
    assert_eq!(judge(&a.raw(), &b.raw(), &options), Verdict::Agree);
}

fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![8 => -2.0..2.0_f64, 1 => Just(f64::NAN), 1 => prop::num::f64::ANY]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn nothing_panics(
        steps in prop::collection::vec(prop_oneof![20 => Just(0.1), 2 => 0.0..3.0_f64, 1 => anything()], 0..400),
        elevation_m in prop::collection::vec(anything(), 400),
        (max_lag_s, noise_m) in (0.0..100.0_f64, 0.0..2.0_f64),
        keep in 1_usize..4,
    ) {
        let stamp_s: Vec<f64> = steps.iter().scan(0.0, |t, step| {
            if step.is_finite() && step.abs() < 1e3 { *t += step; }
            Some(if step.is_finite() { *t } else { *step })
        }).collect();
        let a = RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m[..stamp_s.len()] };
        let (stamp_s, elevation_m): (Vec<f64>, Vec<f64>) =
            stamp_s.iter().copied().zip(elevation_m.iter().rev().copied()).step_by(keep).unzip();
        let b = RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m };
        let options = Options { max_lag_s, noise_a_m: noise_m, ..Options::default() };
        let _ = judge(&a, &b, &options);
        let _ = judge(&b, &a, &options);
    }
}
