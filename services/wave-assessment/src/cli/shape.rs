//! What a spectrum says beyond its moments: peak, noise, wind sea and swell, and standard shapes fitted to it.

use halcyon_ocean::confidence::variance_factors_95;
use halcyon_ocean::interval::Interval;
use halcyon_ocean::shape::{Estimate, JonswapFit, Kind, NoiseFloor, PeakPeriods, PiersonMoskowitzFit, Scatter, systems};
use halcyon_ocean::{SampledSpectrum, Welch};
use serde::Serialize;

/// Noise is looked for from this many peak frequencies on: there, a sea has no more than its tail.
const NOISE_FROM_PEAKS: f64 = 2.5;

/// Systems of a smaller share of the variance are what is left of noise and drift.
const SYSTEM_SHARE_MIN: f64 = 0.01;

/// As `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shape {
    /// Degrees of freedom of one density: its 95 % interval is chi-square's.
    pub line_degrees_of_freedom: f64,
    /// Its lower bound as a multiple of the density.
    pub line_factor_low: f64,
    /// Its upper bound.
    pub line_factor_high: f64,
    /// Peak period by the parabola through the three highest densities, seconds.
    pub t_p_parabola_s: f64,
    /// ∫ S⁴ df/∫ f S⁴ df (Young 1995), seconds.
    pub t_p_young_s: f64,
    /// m₋₂ m₁/m₀² (T_pc), seconds.
    pub t_pc_s: f64,
    /// Centroid of what is over 80 % of the peak (Delft), seconds.
    pub t_pd_s: f64,
    /// White noise in the record, m²/Hz; absent where the spectrum does not tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_m2_per_hz: Option<f64>,
    /// Its standard error, m²/Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_error_m2_per_hz: Option<f64>,
    /// H_m0 without that noise, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h_m0_less_noise_m: Option<f64>,
    /// Wind sea and swell, the longest waves first.
    pub systems: Vec<System>,
    /// The likeliest JONSWAP spectrum; absent where the lines do not determine one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jonswap: Option<Fit>,
    /// The likeliest Pierson-Moskowitz spectrum.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pierson_moskowitz: Option<Fit>,
}

/// One wave system.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct System {
    /// `wind sea` or `swell`.
    pub kind: &'static str,
    /// Density of its peak over that of a fully grown sea of its period: over 1 is wind sea (Portilla et al. 2009). Near 1 it hangs on chance.
    pub grown_ratio: f64,
    /// 4 √m0 of its share, metres.
    pub h_m0_m: f64,
    /// Its peak period, seconds.
    pub t_p_s: f64,
    /// Its mean zero-crossing period, seconds.
    pub t_m02_s: f64,
}

/// A fitted spectrum; bounds are of 95 %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs, reason = "as the symbols say")]
pub struct Fit {
    pub h_m0_m: f64,
    pub h_m0_m_low: f64,
    pub h_m0_m_high: f64,
    pub t_p_s: f64,
    pub t_p_s_low: f64,
    pub t_p_s_high: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gamma: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gamma_low: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gamma_high: Option<f64>,
    /// How much worse than chance it fits, in standard deviations: above 3 the sea has another shape.
    pub misfit_sigmas: f64,
}

impl From<&JonswapFit> for Fit {
    fn from(fit: &JonswapFit) -> Self {
        Self {
            gamma: Some(fit.sea.gamma()),
            gamma_low: Some(fit.gamma.0),
            gamma_high: Some(fit.gamma.1),
            ..Self::new((fit.sea.h_m0_m(), fit.h_m0_m), (fit.sea.t_p_s(), fit.t_p_s), fit.goodness.misfit_sigmas)
        }
    }
}

impl From<&PiersonMoskowitzFit> for Fit {
    fn from(fit: &PiersonMoskowitzFit) -> Self {
        Self::new((fit.sea.h_m0_m(), fit.h_m0_m), (fit.sea.t_p_s(), fit.t_p_s), fit.goodness.misfit_sigmas)
    }
}

impl Fit {
    fn new(height_m: (f64, Interval), period_s: (f64, Interval), misfit_sigmas: f64) -> Self {
        Self {
            h_m0_m: height_m.0,
            h_m0_m_low: height_m.1.0,
            h_m0_m_high: height_m.1.1,
            t_p_s: period_s.0,
            t_p_s_low: period_s.1.0,
            t_p_s_high: period_s.1.1,
            gamma: None,
            gamma_low: None,
            gamma_high: None,
            misfit_sigmas,
        }
    }
}

impl Shape {
    /// Of the spectrum that `welch` made of a record of so many samples; `None` without energy in the band.
    pub(super) fn of(welch: &Welch, samples: usize, spectrum: &SampledSpectrum, band_hz: (f64, f64)) -> Option<Self> {
        let scatter = Scatter::of(welch, samples)?;
        let peak = PeakPeriods::of(spectrum, band_hz)?;
        let noise = NoiseFloor::estimated(spectrum, &scatter, (NOISE_FROM_PEAKS / peak.young_s, band_hz.1))
            // Less than twice its error is no noise that matters.
            .filter(|noise| noise.density_m2_per_hz > 2.0 * noise.error_m2_per_hz);
        let clean = noise.map_or_else(|| spectrum.clone(), |noise| noise.removed(spectrum));
        let noise_m2_per_hz = noise.map_or(0.0, |noise| noise.density_m2_per_hz);
        let estimate = Estimate { spectrum, scatter: &scatter, band_hz, noise_m2_per_hz };
        let kind = |kind| match kind {
            Kind::WindSea => "wind sea",
            Kind::Swell => "swell",
        };
        let (line_factor_low, line_factor_high) = variance_factors_95(scatter.line_dof());
        Some(Self {
            line_degrees_of_freedom: scatter.line_dof(),
            line_factor_low,
            line_factor_high,
            t_p_parabola_s: peak.parabola_s,
            t_p_young_s: peak.young_s,
            t_pc_s: peak.moments_s,
            t_pd_s: peak.delft_s,
            noise_m2_per_hz: noise.map(|noise| noise.density_m2_per_hz),
            noise_error_m2_per_hz: noise.map(|noise| noise.error_m2_per_hz),
            h_m0_less_noise_m: noise.map(|noise| 4.0 * noise.moment(spectrum, 0, band_hz).value.max(0.0).sqrt()),
            systems: systems(&clean, &scatter, band_hz)
                .iter()
                .filter(|system| system.statistics.m0_m2 >= SYSTEM_SHARE_MIN * clean.moment(0, band_hz.0, band_hz.1))
                .map(|system| System {
                    kind: kind(system.kind),
                    grown_ratio: system.grown_ratio,
                    h_m0_m: system.statistics.h_m0_m,
                    t_p_s: system.peak.delft_s,
                    t_m02_s: system.statistics.t_m02_s,
                })
                .collect(),
            jonswap: estimate.jonswap().ok().map(|fit| Fit::from(&fit)),
            pierson_moskowitz: estimate.pierson_moskowitz().ok().map(|fit| Fit::from(&fit)),
        })
    }
}
