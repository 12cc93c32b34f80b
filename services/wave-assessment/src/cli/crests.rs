//! Observed crests and heights against what theories have of this spectrum (thesis 8.2.2).

use halcyon_ocean::SampledSpectrum;
use halcyon_ocean::crests::{
    Boccotti, Exceedance, ExceedancePoint, NarrowBand, Rayleigh, SeaMoments, Spread, Tayfun, compare, forristall_1978,
    forristall_2000, highest,
};
use halcyon_ocean::crossing::Wave;
use halcyon_ocean::dispersion::Depth;
use serde::Serialize;

use super::Spectrum;

/// Heights below this many √m0 are no matter of Boccotti's theory, which is of high waves.
const BOCCOTTI_FROM: f64 = 4.0;

/// One theory against the record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CrestReport {
    /// `crests` (above the mean) or `heights` (crest to trough).
    pub of: &'static str,
    /// Whose theory.
    pub theory: &'static str,
    /// Kolmogorov's distance between observed and theoretical distribution.
    pub ks_distance: f64,
    /// The probability of a larger one by chance; small means that the theory does not hold.
    pub ks_probability: f64,
    /// The highest of so many by the theory, metres.
    pub highest_m: f64,
    /// Undershot with 2.5 %, metres.
    pub highest_m_low: f64,
    /// Exceeded with 2.5 %, metres.
    pub highest_m_high: f64,
    /// The highest observed, metres.
    pub observed_m: f64,
    /// For plots.
    #[serde(skip)]
    pub points: Vec<ExceedancePoint>,
}

/// All theories; empty with too few waves. Water is taken as deep, waves as coming from several directions.
pub(super) fn crests(waves: &[Wave], spectrum: &Spectrum, density: &SampledSpectrum) -> Vec<CrestReport> {
    let sea = SeaMoments { m0: spectrum.m0, m1: spectrum.m1, m2: spectrum.m2 };
    let crests_m: Vec<f64> = waves.iter().map(|wave| wave.crest_m).collect();
    let heights_m: Vec<f64> = waves.iter().map(Wave::height_m).collect();
    let df_hz = density.df_hz();
    let band = spectrum.band.low_hz..=spectrum.band.high_hz;
    let lines = density.density_m2_per_hz().iter().enumerate().map(|(i, density)| (i as f64 * df_hz, density * df_hz));
    let narrow = NarrowBand::of(lines.filter(|(f_hz, _)| band.contains(f_hz)));
    let mut all = Vec::new();
    let mut add = |of, theory, values_m: &[f64], model: &dyn Exceedance, from_m: f64| {
        all.extend(report(of, theory, values_m, model, from_m));
    };
    add("crests", "Rayleigh", &crests_m, &Rayleigh::crests(sea.m0), 0.0);
    add("crests", "Tayfun", &crests_m, &Tayfun::crests(sea.m0, sea.tayfun_steepness()), 0.0);
    add("crests", "Forristall 2000", &crests_m, &forristall_2000(&sea, Depth::DEEP, Spread::ShortCrested), 0.0);
    add("heights", "Rayleigh", &heights_m, &Rayleigh::heights(sea.m0), 0.0);
    add("heights", "Forristall 1978", &heights_m, &forristall_1978(sea.m0), 0.0);
    if let Some(narrow) = narrow {
        add("heights", "Boccotti", &heights_m, &Boccotti::heights(sea.m0, narrow), BOCCOTTI_FROM * sea.m0.sqrt());
    }
    all
}

fn report(
    of: &'static str,
    theory: &'static str,
    values_m: &[f64],
    model: &dyn Exceedance,
    from_m: f64,
) -> Option<CrestReport> {
    let found = compare(values_m, model, from_m)?;
    let expected = highest(model, values_m.len() as f64);
    Some(CrestReport {
        of,
        theory,
        ks_distance: found.ks_distance,
        ks_probability: found.ks_probability,
        highest_m: expected.expected_m,
        highest_m_low: expected.low_m,
        highest_m_high: expected.high_m,
        observed_m: values_m.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        points: found.points,
    })
}
