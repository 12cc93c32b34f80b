use super::*;
use crate::shape::tests::{Sea, sampled};
use crate::{Record, Welch};
use approx::assert_relative_eq;

fn estimate<'a>(spectrum: &'a SampledSpectrum, scatter: &'a Scatter, band_hz: (f64, f64)) -> Estimate<'a> {
    Estimate { spectrum, scatter, band_hz, noise_m2_per_hz: 0.0 }
}

#[test]
fn an_exact_density_comes_back() {
    let scatter = Scatter::independent(20.0).unwrap();
    for (h_m0_m, t_p_s, gamma) in [(2.0, 10.0, 3.3), (0.05, 1.3, 1.0), (1.0, 7.0, 7.0), (0.3, 2.5, 15.0), (4.0, 12.0, 1.4)] {
        let truth = Jonswap::new(h_m0_m, t_p_s, gamma).unwrap();
        // Peaks between two lines, noise of a thousandth of them.
        let noise_m2_per_hz = 1e-4 * h_m0_m * h_m0_m * t_p_s;
        let spectrum = sampled(0.0413 / t_p_s, 250, |f_hz| truth.density_m2_per_hz(f_hz) + noise_m2_per_hz);
        let found = Estimate { noise_m2_per_hz, ..estimate(&spectrum, &scatter, (0.0, 10.0 / t_p_s)) }.jonswap().unwrap();
        assert_relative_eq!(found.sea.h_m0_m(), h_m0_m, max_relative = 1e-3);
        assert_relative_eq!(found.sea.t_p_s(), t_p_s, max_relative = 1e-3);
        assert_relative_eq!(found.sea.gamma(), gamma, max_relative = 1e-3);
        assert!(found.goodness.misfit < 1e-6 && found.h_m0_m.0 < h_m0_m && found.h_m0_m.1 > h_m0_m);
    }
    let truth = PiersonMoskowitz::new(1.7, 8.3).unwrap();
    let spectrum = sampled(0.005, 200, |f_hz| truth.density_m2_per_hz(f_hz));
    let found = estimate(&spectrum, &scatter, (0.0, 1.0)).pierson_moskowitz().unwrap();
    assert_relative_eq!(found.sea.h_m0_m(), 1.7, max_relative = 1e-3);
    assert_relative_eq!(found.sea.t_p_s(), 8.3, max_relative = 1e-3);
}

/// Of a known shape and period only the level is sought: ln H has the variance ¼ × 2/(ν n) with n lines of ν degrees of freedom.
/// Other parameters can only add to that.
#[test]
fn a_height_is_known_no_better_than_its_lines() {
    let (scatter, truth) = (Scatter::independent(12.0).unwrap(), PiersonMoskowitz::new(1.0, 10.0).unwrap());
    let spectrum = sampled(0.005, 101, |f_hz| truth.density_m2_per_hz(f_hz));
    let found = estimate(&spectrum, &scatter, (0.0, 0.5)).pierson_moskowitz().unwrap();
    let lines = found.goodness.lines as f64;
    let level_alone = (NORMAL_95 * (0.25 * 2.0 / (12.0 * lines)).sqrt()).exp();
    let factor = found.h_m0_m.1 / found.sea.h_m0_m();
    assert!(factor > level_alone && factor.ln() < 3.0 * level_alone.ln(), "{factor} {level_alone}");
}

/// Half-hour records at 2 Hz of Gaussian seas, in segments of 200 s: intervals hold the truth in 95 ± 3 % of 600, fits have no
/// bias to speak of and agree with their estimates as they say.
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let truth = Jonswap::new(2.0, 10.0, 3.3).unwrap();
    let grown = PiersonMoskowitz::new(2.0, 10.0).unwrap();
    let (rate_hz, samples, seeds) = (2.0, 3600, 600);
    let welch = Welch::new(400);
    let scatter = Scatter::of(&welch, samples).unwrap();
    let (mut seas, mut grown_seas) = (Sea::new(&truth, rate_hz, 8192, 21), Sea::new(&grown, rate_hz, 8192, 22));
    let mut held = [0_u32; 5];
    let (mut misfits, mut wrong, mut bias) = (0.0, 0_u32, [0.0; 3]);
    let within = |(low, high): Interval, value: f64| u32::from((low..=high).contains(&value));
    let half_hour = |sea: &mut Sea| welch.spectrum(&Record::new(&sea.draw()[..samples], rate_hz).unwrap()).unwrap();
    for _ in 0..seeds {
        let spectrum = half_hour(&mut seas);
        let found = estimate(&spectrum, &scatter, (0.0, 0.8)).jonswap().unwrap();
        held[0] += within(found.h_m0_m, 2.0);
        held[1] += within(found.t_p_s, 10.0);
        held[2] += within(found.gamma, 3.3);
        misfits += found.goodness.misfit;
        wrong += u32::from(found.goodness.misfit_sigmas > 3.0);
        let ratios = [found.sea.h_m0_m() / 2.0, found.sea.t_p_s() / 10.0, found.sea.gamma() / 3.3];
        bias.iter_mut().zip(ratios).for_each(|(bias, ratio)| *bias += ratio.ln() / f64::from(seeds));
        let spectrum = half_hour(&mut grown_seas);
        let found = estimate(&spectrum, &scatter, (0.0, 0.8)).pierson_moskowitz().unwrap();
        held[3] += within(found.h_m0_m, 2.0);
        held[4] += within(found.t_p_s, 10.0);
    }
    let shares = held.map(|count| f64::from(count) / f64::from(seeds));
    let (misfit, wrong) = (misfits / f64::from(seeds), f64::from(wrong) / f64::from(seeds));
    println!("JONSWAP H, T, γ; Pierson-Moskowitz H, T: {shares:?}; bias {bias:?}; misfit {misfit}, wrong {wrong}");
    assert!(shares.iter().all(|share| (0.92..=0.98).contains(share)), "{shares:?}");
    assert!(bias[0].abs() < 0.01 && bias[1].abs() < 0.005 && bias[2].abs() < 0.05, "{bias:?}");
    assert!((misfit - 1.0).abs() < 0.05 && wrong < 0.03, "{misfit} {wrong}");
}

/// A sea of two peaks is not a JONSWAP one, and the fit says so.
#[test]
fn another_shape_is_told_by_its_misfit() {
    let scatter = Scatter::independent(20.0).unwrap();
    let (swell, sea) = (Jonswap::new(1.0, 14.0, 5.0).unwrap(), Jonswap::new(1.0, 5.0, 3.3).unwrap());
    let spectrum = sampled(0.005, 160, |f_hz| swell.density_m2_per_hz(f_hz) + sea.density_m2_per_hz(f_hz));
    let found = estimate(&spectrum, &scatter, (0.03, 0.8)).jonswap().unwrap();
    assert!(found.goodness.misfit_sigmas > 5.0, "{:?}", found.goodness);
    let part = estimate(&spectrum, &scatter, (0.17, 0.8)).jonswap().unwrap();
    assert!(part.goodness.misfit_sigmas < 0.0 && (part.sea.t_p_s() - 5.0).abs() < 0.1, "{part:?}");
}

#[test]
fn what_cannot_be_fitted_is_refused_by_name() {
    let scatter = Scatter::independent(20.0).unwrap();
    let sea = Jonswap::new(1.0, 5.0, 3.3).unwrap();
    let spectrum = sampled(0.01, 101, |f_hz| sea.density_m2_per_hz(f_hz));
    let fit = |spectrum: &SampledSpectrum, band_hz| estimate(spectrum, &scatter, band_hz).jonswap();
    assert!(matches!(fit(&spectrum, (0.2, 0.25)), Err(FitError::Lines { lines: 6, .. })));
    for band_hz in [(f64::NAN, 1.0), (2.0, 3.0), (0.3, 0.1)] {
        assert_eq!(fit(&spectrum, band_hz), Err(FitError::Still));
    }
    assert_eq!(fit(&sampled(0.01, 101, |_| 0.0), (0.0, 1.0)), Err(FitError::Still));
    for noise_m2_per_hz in [-1.0, f64::NAN, f64::INFINITY] {
        let noisy = Estimate { noise_m2_per_hz, ..estimate(&spectrum, &scatter, (0.0, 1.0)) };
        assert!(matches!(noisy.pierson_moskowitz(), Err(FitError::Noise(_))));
    }
    // One line, white noise, a spike in noise, a huge one: an answer or an error, never a panic.
    for density in
        [&(|f: f64| if f > 0.295 && f < 0.305 { 1.0 } else { 0.0 }) as &dyn Fn(f64) -> f64, &|_| 1.0, &|f| f, &|f| 1e50 * f]
    {
        let spectrum = sampled(0.01, 101, density);
        let _ = fit(&spectrum, (0.0, 1.0));
        let _ = fit(&spectrum, (0.0, f64::INFINITY));
        let _ = estimate(&spectrum, &scatter, (0.0, 1.0)).pierson_moskowitz();
    }
}

/// Segments in which a peak is no wider than the taper's main lobe, a narrow peak and a broad one, quarter-hours: as above.
#[test]
fn intervals_hold_in_short_segments_too() {
    for (gamma, segment_samples, samples) in [(6.0, 200, 3600), (1.7, 400, 3600), (3.3, 200, 1800)] {
        let truth = Jonswap::new(2.0, 10.0, gamma).unwrap();
        let welch = Welch::new(segment_samples);
        let scatter = Scatter::of(&welch, samples).unwrap();
        let (mut seas, seeds) = (Sea::new(&truth, 2.0, 8192, 23), 300);
        let mut held = [0_u32; 3];
        for _ in 0..seeds {
            let spectrum = welch.spectrum(&Record::new(&seas.draw()[..samples], 2.0).unwrap()).unwrap();
            let found = estimate(&spectrum, &scatter, (0.0, 0.8)).jonswap().unwrap();
            let stated = [(found.h_m0_m, 2.0), (found.t_p_s, 10.0), (found.gamma, gamma)];
            held.iter_mut().zip(stated).for_each(|(held, (interval, truth))| {
                *held += u32::from((interval.0..=interval.1).contains(&truth));
            });
        }
        let shares = held.map(|count| f64::from(count) / f64::from(seeds));
        println!("gamma {gamma}, {segment_samples} of {samples} samples: {shares:.3?}");
        assert!(shares.iter().all(|share| (0.92..=0.98).contains(share)), "{gamma} {segment_samples}: {shares:?}");
    }
}
