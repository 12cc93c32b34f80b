use super::*;
use crate::shape::tests::{Sea, sampled};
use crate::special::ln_gamma;
use crate::{Jonswap, PiersonMoskowitz, Record, Spectrum, Welch};
use approx::assert_relative_eq;

const BAND_HZ: (f64, f64) = (0.03, 0.6);

fn exact() -> Scatter {
    Scatter::independent(1e6).unwrap()
}

/// Several seas at once.
struct Sum(Vec<Jonswap>);

impl Spectrum for Sum {
    fn density_m2_per_hz(&self, f_hz: f64) -> f64 {
        self.0.iter().map(|sea| sea.density_m2_per_hz(f_hz)).sum()
    }

    fn peak_hz(&self) -> f64 {
        self.0[0].peak_hz()
    }
}

fn jonswap(h_m0_m: f64, t_p_s: f64, gamma: f64) -> Jonswap {
    Jonswap::new(h_m0_m, t_p_s, gamma).unwrap()
}

/// Parts within 5 % of the seas they were made of, whose moments are their own integrals over the band.
#[test]
fn two_jonswap_seas_are_told_apart() {
    for (swell, sea) in [
        (jonswap(1.0, 13.0, 5.0), jonswap(1.2, 5.0, 3.3)),
        (jonswap(1.5, 11.0, 3.3), jonswap(1.5, 5.5, 3.3)),
        (jonswap(0.5, 14.0, 7.0), jonswap(2.0, 6.0, 3.3)),
        (jonswap(2.0, 12.0, 5.0), jonswap(0.8, 4.0, 2.0)),
    ] {
        let both = Sum(vec![swell, sea]);
        let spectrum = sampled(0.002, 301, |f_hz| both.density_m2_per_hz(f_hz));
        let found = systems(&spectrum, &exact(), BAND_HZ);
        assert_eq!(found.len(), 2, "{swell:?} {sea:?}");
        assert_eq!((found[0].kind, found[1].kind), (Kind::Swell, Kind::WindSea));
        for (part, truth) in found.iter().zip([swell, sea]) {
            let [m0, m2] = [0, 2].map(|order| truth.moment(order, BAND_HZ.0, BAND_HZ.1));
            let ratios = [
                part.statistics.h_m0_m / (4.0 * m0.sqrt()),
                part.statistics.t_p_s / truth.t_p_s(),
                part.statistics.t_m02_s / (m0 / m2).sqrt(),
            ];
            println!("{:?} H_m0, T_p, T_m02 over the truth: {ratios:.3?}", part.kind);
            assert_relative_eq!(part.statistics.h_m0_m, 4.0 * m0.sqrt(), max_relative = 0.05);
            assert_relative_eq!(part.statistics.t_p_s, truth.t_p_s(), max_relative = 0.05);
            assert_relative_eq!(part.peak.parabola_s, truth.t_p_s(), max_relative = 0.05);
            assert_relative_eq!(part.statistics.t_m02_s, (m0 / m2).sqrt(), max_relative = 0.05);
        }
        // Nothing is lost or made.
        let sum: f64 = found.iter().map(|part| part.statistics.m0_m2).sum();
        assert_relative_eq!(sum, spectrum.moment(0, BAND_HZ.0, BAND_HZ.1), max_relative = 1e-9);
        assert_eq!(together(&found, Kind::Swell), Some(found[0].statistics));
    }
}

/// Ochi & Hubble (1976): each part has the moments mₙ = H²/16 (λ + ¼)^(n/4) Γ(λ − n/4)/Γ(λ) f_pⁿ.
#[test]
fn ochi_hubbles_six_parameters_come_back() {
    // The swell and the sea: H, T_p, λ.
    let parts = [(1.5_f64, 12.5_f64, 3.0_f64), (1.0, 5.0, 1.5)];
    let density = |f_hz: f64| {
        let one = |(h_m0_m, t_p_s, lambda): (f64, f64, f64)| {
            let nu4 = (f_hz * t_p_s).powi(-4);
            let level = h_m0_m * h_m0_m / 16.0 * 4.0 * (lambda * (lambda + 0.25).ln() - ln_gamma(lambda)).exp();
            if f_hz > 0.0 { level * nu4.powf(lambda) / f_hz * (-(lambda + 0.25) * nu4).exp() } else { 0.0 }
        };
        parts.map(one).iter().sum()
    };
    let found = systems(&sampled(0.002, 1001, density), &exact(), (0.03, 2.0));
    assert_eq!(found.len(), 2);
    for (found, (h_m0_m, t_p_s, lambda)) in found.iter().zip(parts) {
        assert_relative_eq!(found.statistics.h_m0_m, h_m0_m, max_relative = 0.05);
        assert_relative_eq!(found.statistics.t_p_s, t_p_s, max_relative = 0.05);
        let m2_over_m0 = (lambda + 0.25).sqrt() * (ln_gamma(lambda - 0.5) - ln_gamma(lambda)).exp() / (t_p_s * t_p_s);
        assert_relative_eq!(found.statistics.t_m02_s, m2_over_m0.powf(-0.5), max_relative = 0.05);
    }
}

#[test]
fn one_sea_is_one() {
    for gamma in [1.0, 3.3, 10.0, 20.0] {
        for (df_hz, scatter) in [(0.002, exact()), (0.005, Scatter::independent(10.0).unwrap()), (0.02, exact())] {
            let sea = jonswap(2.0, 8.0, gamma);
            let spectrum = sampled(df_hz, (0.6 / df_hz) as u32, |f_hz| sea.density_m2_per_hz(f_hz));
            let found = systems(&spectrum, &scatter, (0.0, 0.6));
            assert_eq!(found.len(), 1, "{gamma} {df_hz}");
            assert_relative_eq!(found[0].statistics.h_m0_m, spectrum.statistics(0.0, 0.6).unwrap().h_m0_m, max_relative = 1e-9);
        }
    }
}

/// Half-hours at 2 Hz: of 300 single seas no more than three are split, and of 100 mixed ones all are, into parts whose mean is
/// the truth.
#[test]
fn records_are_split_where_there_are_two_seas_and_only_there() {
    let (rate_hz, samples) = (2.0, 3600);
    let welch = Welch::new(400);
    let scatter = Scatter::of(&welch, samples).unwrap();
    let of = |seas: &mut Sea| {
        let record = Record::new(&seas.draw()[..samples], rate_hz).unwrap();
        systems(&welch.spectrum(&record).unwrap(), &scatter, BAND_HZ)
    };
    let mut single = Sea::new(&jonswap(2.0, 8.0, 3.3), rate_hz, 8192, 5);
    let mut grown = Sea::new(&PiersonMoskowitz::new(2.0, 8.0).unwrap(), rate_hz, 8192, 6);
    let split = (0..150).flat_map(|_| [of(&mut single), of(&mut grown)]).filter(|found| found.len() != 1).count();
    println!("{split} of 300 single seas are split");
    assert!(split <= 3, "{split}");

    let (swell, sea) = (jonswap(1.5, 13.0, 5.0), jonswap(1.5, 5.0, 3.3));
    let mut mixed = Sea::new(&Sum(vec![swell, sea]), rate_hz, 8192, 7);
    let mut sums = [[0.0; 3]; 2];
    for _ in 0..100 {
        let found = of(&mut mixed);
        assert_eq!(found.len(), 2);
        for (sum, part) in sums.iter_mut().zip(&found) {
            sum[0] += part.statistics.m0_m2 / 100.0;
            sum[1] += part.peak.young_s / 100.0;
            sum[2] += part.statistics.t_m02_s / 100.0;
        }
    }
    println!("means of mixed seas: m0, T_Young, T_m02 {sums:.3?}");
    for ([m0_m2, young_s, t_m02_s], truth) in sums.into_iter().zip([swell, sea]) {
        let [m0, m2] = [0, 2].map(|order| truth.moment(order, BAND_HZ.0, BAND_HZ.1));
        assert_relative_eq!(m0_m2.sqrt(), m0.sqrt(), max_relative = 0.05);
        assert_relative_eq!(young_s, truth.t_p_s(), max_relative = 0.05);
        assert_relative_eq!(t_m02_s, (m0 / m2).sqrt(), max_relative = 0.05);
    }
}

/// Pierson & Moskowitz (1964) at its peak is α g² (2π)⁻⁴ f⁻⁵ exp(−5/4), of H = 4 √(α g² (2π f)⁻⁴/5).
#[test]
fn a_fully_grown_sea_is_between_sea_and_swell() {
    for t_p_s in [1.3, 8.0_f64] {
        let h_m0_m = 4.0 * (0.0081 * 9.806_65_f64.powi(2) * (t_p_s / std::f64::consts::TAU).powi(4) / 5.0).sqrt();
        for (factor, kind) in [(0.97, Kind::Swell), (1.05, Kind::WindSea)] {
            let sea = PiersonMoskowitz::new(factor * h_m0_m, t_p_s).unwrap();
            let found = systems(&sampled(0.01 / t_p_s, 600, |f_hz| sea.density_m2_per_hz(f_hz)), &exact(), (0.0, 9.0));
            assert_eq!((found.len(), found[0].kind), (1, kind));
            // The smoothed peak is a little to the right, and f⁻⁵ makes much of that.
            assert_relative_eq!(found[0].grown_ratio, factor * factor, max_relative = 0.05);
        }
    }
}

#[test]
fn nothing_has_no_systems() {
    let flat = sampled(0.1, 20, |_| 1.0);
    for band_hz in [(5.0, 6.0), (f64::NAN, 1.0), (1.0, 0.5)] {
        assert!(systems(&flat, &exact(), band_hz).is_empty());
    }
    assert!(systems(&sampled(0.1, 20, |_| 0.0), &exact(), (0.0, 2.0)).is_empty());
    assert_eq!(systems(&flat, &exact(), (0.0, 2.0)).len(), 1);
    assert_eq!(systems(&flat, &exact(), (0.45, 0.55)).len(), 1);
    assert_eq!(together(&[], Kind::Swell), None);
    // Two lines with nothing between them.
    let lines = sampled(0.1, 40, |f| if (f - 1.0).abs() < 0.01 || (f - 3.0).abs() < 0.01 { 1.0 } else { 0.0 });
    assert_eq!(systems(&lines, &Scatter::independent(200.0).unwrap(), (0.0, 4.0)).len(), 2);
}
