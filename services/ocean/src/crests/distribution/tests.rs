//! Distributions against their limits, closed forms, published values, and simulated seas.

use super::super::sea::tests::{lines, moments};
use super::*;
use crate::{Crossing, Record, crossing};
use approx::assert_relative_eq;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Over one variance, what one wave in `one_in` exceeds, in √m0.
fn level(model: &impl Exceedance, one_in: f64) -> f64 {
    model.exceeded_m(1.0 / one_in)
}

/// exp(−x²/8) = 1/1000 at x = √(8 ln 1000).
#[test]
fn rayleigh_is_its_closed_form() {
    assert_relative_eq!(level(&Rayleigh::heights(1.0), 1000.0), (8.0 * 1000f64.ln()).sqrt(), max_relative = 1e-12);
    assert_relative_eq!(level(&Rayleigh::crests(1.0), 1000.0), (2.0 * 1000f64.ln()).sqrt(), max_relative = 1e-12);
    assert_relative_eq!(Rayleigh::heights(4.0).exceedance(4.0), (-0.5_f64).exp());
    // Longuet-Higgins (1980): storm waves of ν = 0.42 or so have H_rms of 0.93 of 2 √(2 m0), as in Forristall's data.
    let wide = Rayleigh::heights_of_width(1.0, 0.42);
    assert_relative_eq!(wide.rms_m() / 8f64.sqrt(), 0.933, max_relative = 2e-3);
    assert_eq!(Rayleigh::heights_of_width(1.0, 0.0), Rayleigh::heights(1.0));
}

/// Forristall (1978): the highest of a thousand waves is some 10 % lower than Rayleigh's.
#[test]
fn forristall_1978_is_lower_by_a_tenth() {
    let fitted = forristall_1978(1.0);
    assert_relative_eq!(fitted.exceedance(6.0), (-(6f64.powf(2.126)) / 8.42).exp(), max_relative = 1e-12);
    assert_relative_eq!(level(&fitted, 1000.0) / level(&Rayleigh::heights(1.0), 1000.0), 0.9065, max_relative = 5e-3);
}

/// Linear limit; and S₁ = 0.05, Ur = 0: α = 0.36644, β = 1.91044, by hand.
#[test]
fn forristall_2000_is_the_published_fit() {
    let flat = SeaMoments { m0: 1.0, m1: 1e-4, m2: 1e-8 };
    for spread in [Spread::LongCrested, Spread::ShortCrested] {
        let limit = forristall_2000(&flat, Depth::DEEP, spread);
        assert_relative_eq!(level(&limit, 1000.0), level(&Rayleigh::crests(1.0), 1000.0), max_relative = 2e-4);
    }
    // T₁² = 2π H_s/(g S₁).
    let t1_s = (TAU * 4.0 / (9.806_65 * 0.05)).sqrt();
    let steep = SeaMoments { m0: 1.0, m1: 1.0 / t1_s, m2: 1.1 / (t1_s * t1_s) };
    let short = forristall_2000(&steep, Depth::DEEP, Spread::ShortCrested);
    assert_relative_eq!(short.scale_m / 4.0, 0.366_44, max_relative = 1e-6);
    assert_relative_eq!(short.shape, 1.910_44, max_relative = 1e-6);
    let long = forristall_2000(&steep, Depth::DEEP, Spread::LongCrested);
    assert_relative_eq!(long.scale_m / 4.0, 0.368_06, max_relative = 1e-6);
    assert_relative_eq!(long.shape, 1.892_015, max_relative = 1e-6);
    assert!(level(&long, 1000.0) > level(&short, 1000.0), "deep water: long crests are the higher");
    // Both are fits to second-order seas: Tayfun's narrow band agrees within 3 % at one in a thousand.
    let tayfun = Tayfun::crests(1.0, steep.tayfun_steepness());
    assert_relative_eq!(level(&long, 1000.0), level(&tayfun, 1000.0), max_relative = 0.03);
}

#[test]
fn tayfun_maps_amplitudes() {
    assert_relative_eq!(level(&Tayfun::crests(1.0, 0.0), 500.0), level(&Rayleigh::crests(1.0), 500.0), max_relative = 1e-12);
    for (mu, one_in) in [(0.05, 100.0), (0.1, 1e4)] {
        let a = level(&Rayleigh::crests(1.0), one_in);
        assert_relative_eq!(level(&Tayfun::crests(1.0, mu), one_in), a + 0.5 * mu * a * a, max_relative = 1e-9);
        assert_relative_eq!(level(&Tayfun::troughs(1.0, mu), one_in), a - 0.5 * mu * a * a, max_relative = 1e-9);
    }
    assert_eq!(Tayfun::troughs(1.0, 0.1).exceedance(5.1), 0.0);
    // A surface of (narrow-band) second order has skewness 3 μ: ½ μ of the amplitude's square beside cos, by sampling the phase.
    let (mu, mut sums) = (0.06, [0.0; 3]);
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..400_000 {
        let (x, y): (f64, f64) = (random.sample(rand_distr::StandardNormal), random.sample(rand_distr::StandardNormal));
        let eta = x + 0.5 * mu * (x * x - y * y);
        (0..3).for_each(|n| sums[n] += eta.powi(n as i32 + 1) / 400_000.0);
    }
    let variance = sums[1] - sums[0] * sums[0];
    let skewness = (sums[2] - 3.0 * sums[0] * sums[1] + 2.0 * sums[0].powi(3)) / variance.powf(1.5);
    assert_relative_eq!(skewness, 3.0 * mu, max_relative = 0.1);
}

#[test]
fn boccotti_of_one_frequency_is_rayleigh() {
    let one = Boccotti::heights(1.0, NarrowBand::of([(0.1, 1.0)]).unwrap());
    assert_relative_eq!(one.factor(), 1.0, max_relative = 1e-9);
    assert_relative_eq!(level(&one, 1000.0), level(&Rayleigh::heights(1.0), 1000.0), max_relative = 1e-9);
    assert!(one.exceedance(f64::NAN).is_nan());
}

/// ½ − erf/2 from tables, and the far tail: Q(6) = 9.8659e-10.
#[test]
fn the_normal_tail() {
    assert_relative_eq!(normal_exceedance(0.0), 0.5);
    assert_relative_eq!(normal_exceedance(1.959_963_984_540_054), 0.025, max_relative = 1e-9);
    assert_relative_eq!(normal_exceedance(-1.0), 0.841_344_746_068_543, max_relative = 1e-12);
    assert_relative_eq!(normal_exceedance(6.0), 9.865_876_450_376_98e-10, max_relative = 1e-10);
    assert_relative_eq!(normal_exceedance(5.0 - 1e-9), normal_exceedance(5.0 + 1e-9), max_relative = 1e-7);
}

/// Rice's limits; and the share of maxima below the mean is ½ (1 − √(1 − ε²)) (Cartwright & Longuet-Higgins's r).
#[test]
fn rice_is_rayleigh_at_one_end_and_normal_at_the_other() {
    for x in [0.5, 1.0, 3.0] {
        assert_relative_eq!(Rice::maxima(1.0, 0.0).exceedance(x), (-0.5 * x * x).exp(), max_relative = 1e-12);
        assert_relative_eq!(Rice::maxima(1.0, 1e-3).exceedance(x), (-0.5 * x * x).exp(), max_relative = 1e-5);
        assert_relative_eq!(Rice::maxima(1.0, 1.0).exceedance(x), normal_exceedance(x), max_relative = 1e-12);
    }
    for epsilon in [0.3f64, 0.6, 0.9] {
        let below = 1.0 - Rice::maxima(1.0, epsilon).exceedance(0.0);
        assert_relative_eq!(below, 0.5 * (1.0 - (1.0 - epsilon * epsilon).sqrt()), max_relative = 1e-12);
    }
}

/// A linear random sea, sixty hours of it at thirty samples a wave: the high waves are Boccotti's, and Rayleigh's are too high.
#[test]
fn high_waves_of_a_random_sea_are_boccottis() {
    let lines = lines(4.0, 10.0, 3.3);
    let sea = moments(&lines);
    let mut random = ChaCha8Rng::seed_from_u64(8);
    // Lines 0.0002 Hz apart repeat after 5000 s: sixty seas of that length are sixty phases of an inverse transform each.
    let (rate_hz, samples) = (3.0, 15_000);
    let inverse = realfft::RealFftPlanner::<f64>::new().plan_fft_inverse(samples);
    let mut heights = Vec::new();
    for _ in 0..60 {
        let mut bins = inverse.make_input_vec();
        for (f_hz, m2) in &lines {
            let phase: f64 = TAU * random.random::<f64>();
            bins[(f_hz * 5000.0).round() as usize] += crate::filter::Complex::from_polar((0.5 * m2).sqrt(), phase);
        }
        let mut elevation_m = inverse.make_output_vec();
        inverse.process(&mut bins, &mut elevation_m).unwrap();
        let record = Record::new(elevation_m, rate_hz).unwrap();
        heights.extend(crossing::waves(&record, Crossing::Up, 0.0).iter().map(crate::crossing::Wave::height_m));
    }
    heights.sort_by(f64::total_cmp);
    let boccotti = Boccotti::heights(sea.m0, NarrowBand::of(lines).unwrap());
    for one_in in [30.0, 100.0, 300.0, 1000.0] {
        let observed = heights[heights.len() - (heights.len() as f64 / one_in) as usize];
        assert_relative_eq!(level(&boccotti, one_in), observed, max_relative = 0.025);
        assert!(level(&Rayleigh::heights(sea.m0), one_in) > 1.03 * observed);
    }
}

#[test]
fn nonsense_is_nan_or_bounded() {
    let sea = SeaMoments { m0: 0.0, m1: 0.0, m2: 0.0 };
    let models: [Box<dyn Exceedance>; 5] = [
        Box::new(Rayleigh::heights(0.0)),
        Box::new(Tayfun::crests(0.0, f64::NAN)),
        Box::new(Tayfun::troughs(f64::NAN, 0.1)),
        Box::new(forristall_2000(&sea, Depth::DEEP, Spread::ShortCrested)),
        Box::new(Rice::maxima(f64::NAN, f64::NAN)),
    ];
    for model in models {
        for value in [f64::NAN, f64::NEG_INFINITY, -1.0, 0.0, 1.0, f64::INFINITY] {
            let p = model.exceedance(value);
            assert!(p.is_nan() || (0.0..=1.0).contains(&p), "{value} {p}");
        }
        assert!(model.exceeded_m(2.0).is_nan());
        let _ = model.exceeded_m(0.1);
    }
}
