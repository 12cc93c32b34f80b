//! Peak periods that do not hang on a single line of an estimate.
//!
//! The highest line is one of the spectrum's own frequencies and jumps from record to record. The others trade that scatter for a
//! bias that a broad peak's slow fall gives; all agree on a single line.

use crate::welch::SampledSpectrum;

/// Peak periods of one band, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakPeriods {
    /// 1/f of the highest line.
    pub line_s: f64,
    /// 1/f of the top of the parabola through the highest line and its neighbours, as SWAN's T_ps (SWAN team, *User manual*); of
    /// the highest line where it has no lower neighbour on either side within the band.
    pub parabola_s: f64,
    /// ∫ S⁴ df / ∫ f S⁴ df (Young 1995, *Ocean Eng.* 22): the least scattered of powers of S; 0.954 T_p of Pierson-Moskowitz.
    pub young_s: f64,
    /// m₋₂ m₁/m₀², the T_pc of the IAHR's list of sea-state parameters (1989) and of Tucker & Pitt (2001): free of S's shape
    /// about the peak, but moved by noise at low frequencies; 1.027 T_p of Pierson-Moskowitz.
    pub moments_s: f64,
    /// ∫ S df / ∫ f S df over the lines about the highest one down to 80 % of it, the Delft method's T_pD of the same list.
    pub delft_s: f64,
}

impl PeakPeriods {
    /// What the Delft method takes about the peak.
    const DELFT_SHARE: f64 = 0.8;

    /// Of the lines of `spectrum` within `low_hz`…`high_hz` and above zero; `None` where these hold no energy.
    #[must_use]
    pub fn of(spectrum: &SampledSpectrum, (low_hz, high_hz): (f64, f64)) -> Option<Self> {
        let lines: Vec<(f64, f64)> = spectrum.band(low_hz, high_hz).collect();
        let (top, &(line_hz, highest)) = lines.iter().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        if !(highest > 0.0 && highest.is_finite()) {
            return None;
        }
        // Ratios to the highest: their powers neither overflow nor vanish together.
        let sum = |of: &dyn Fn(f64, f64) -> f64| lines.iter().map(|(f_hz, density)| of(*f_hz, density / highest)).sum::<f64>();
        let m0 = sum(&|_, s| s);
        let from = lines[..top].iter().rposition(|line| line.1 < Self::DELFT_SHARE * highest).map_or(0, |i| i + 1);
        let to = lines[top..].iter().position(|line| line.1 < Self::DELFT_SHARE * highest).map_or(lines.len(), |i| top + i);
        let about = &lines[from..to];
        Some(Self {
            line_s: 1.0 / line_hz,
            parabola_s: 1.0 / (line_hz + spectrum.df_hz() * vertex(&lines, top)),
            young_s: sum(&|_, s| s.powi(4)) / sum(&|f, s| f * s.powi(4)),
            moments_s: sum(&|f, s| s / (f * f)) * sum(&|f, s| f * s) / (m0 * m0),
            delft_s: about.iter().map(|line| line.1).sum::<f64>() / about.iter().map(|line| line.0 * line.1).sum::<f64>(),
        })
    }
}

/// How many lines after the highest one the parabola through it and its neighbours has its top: within half a line.
fn vertex(lines: &[(f64, f64)], top: usize) -> f64 {
    let beside = |i: Option<usize>| i.and_then(|i| lines.get(i)).map(|line| line.1);
    let (Some(before), Some(after)) = (beside(top.checked_sub(1)), beside(top.checked_add(1))) else { return 0.0 };
    let bend = before - 2.0 * lines[top].1 + after;
    if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PiersonMoskowitz, Spectrum};
    use approx::assert_relative_eq;

    const BAND_HZ: (f64, f64) = (0.0, f64::INFINITY);

    fn sampled(df_hz: f64, lines: u32, density: impl Fn(f64) -> f64) -> SampledSpectrum {
        SampledSpectrum::new(df_hz, (0..lines).map(|i| density(f64::from(i) * df_hz)).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_single_line_has_one_period() {
        let found = PeakPeriods::of(&sampled(0.01, 50, |f| if (f - 0.2).abs() < 1e-9 { 3.0 } else { 0.0 }), BAND_HZ).unwrap();
        for period_s in [found.line_s, found.parabola_s, found.young_s, found.moments_s, found.delft_s] {
            assert_relative_eq!(period_s, 5.0, max_relative = 1e-12);
        }
    }

    #[test]
    fn a_parabola_has_its_own_top_between_lines() {
        let found = PeakPeriods::of(&sampled(0.01, 50, |f| (1.0 - ((f - 0.2037) / 0.05).powi(2)).max(0.0)), BAND_HZ).unwrap();
        assert_relative_eq!(found.line_s, 5.0, max_relative = 1e-12);
        assert_relative_eq!(found.parabola_s, 1.0 / 0.2037, max_relative = 1e-9);
        // Above 80 % it is symmetric up to a line on one side, 0.18 to 0.22.
        assert_relative_eq!(found.delft_s, 1.0 / 0.2037, max_relative = 0.02);
    }

    /// Of ν⁻ⁿ exp(−b ν⁻⁴) the integral is ¼ b^(−(n−1)/4) Γ((n−1)/4). With S⁴ (n = 20, b = 5) Young's f is 5^¼ Γ(9/2)/Γ(19/4) f_p,
    /// and m₋₂ m₁/m₀² is (5/4)^−¼ Γ(3/2) Γ(3/4) T_p. Gammas from Abramowitz & Stegun, table 6.1.
    #[test]
    fn pierson_moskowitz_has_closed_forms() {
        let (gamma_4_5, gamma_4_75) = (11.631_728_396_567_45, 2.75 * 3.75 * 1.75 * 0.919_062_526_848_883_2);
        let (gamma_1_5, gamma_0_75) = (0.886_226_925_452_758, 1.225_416_702_465_178);
        let sea = PiersonMoskowitz::new(2.0, 10.0).unwrap();
        let found = PeakPeriods::of(&sampled(2e-4, 100_000, |f| sea.density_m2_per_hz(f)), BAND_HZ).unwrap();
        assert_relative_eq!(found.line_s, 10.0, max_relative = 1e-9);
        assert_relative_eq!(found.parabola_s, 10.0, max_relative = 1e-4);
        assert_relative_eq!(found.young_s, 10.0 * gamma_4_75 / (5f64.powf(0.25) * gamma_4_5), max_relative = 1e-5);
        assert_relative_eq!(found.moments_s, 10.0 * 0.8f64.powf(0.25) * gamma_1_5 * gamma_0_75, max_relative = 1e-5);
        // By a midpoint sum over where ν⁻⁵ exp(−5/4 (ν⁻⁴ − 1)) is above 0.8.
        let shape = |nu: f64| nu.powi(-5) * (-1.25 * (nu.powi(-4) - 1.0)).exp();
        let inside: Vec<f64> = (0..100_000).map(|i| 0.5 + 1e-5 * (f64::from(i) + 0.5)).filter(|nu| shape(*nu) >= 0.8).collect();
        let centre = inside.iter().map(|nu| nu * shape(*nu)).sum::<f64>() / inside.iter().map(|nu| shape(*nu)).sum::<f64>();
        assert_relative_eq!(found.delft_s, 10.0 / centre, max_relative = 1e-3);
    }

    #[test]
    fn edges_of_the_band_and_nothing_at_all() {
        let falling = PeakPeriods::of(&sampled(0.1, 20, |f| 1.0 / (0.1 + f)), (0.25, 1.0)).unwrap();
        assert_relative_eq!(falling.parabola_s, 1.0 / 0.3, max_relative = 1e-12);
        for (low_hz, high_hz) in [(9.0, 10.0), (1.0, 0.5), (f64::NAN, 1.0)] {
            assert_eq!(PeakPeriods::of(&sampled(0.1, 20, |_| 1.0), (low_hz, high_hz)), None);
        }
        assert_eq!(PeakPeriods::of(&sampled(0.1, 20, |_| 0.0), BAND_HZ), None);
        let flat = PeakPeriods::of(&sampled(0.1, 20, |_| 1.0), BAND_HZ).unwrap();
        assert!(flat.parabola_s.is_finite() && flat.young_s.is_finite());
    }
}
