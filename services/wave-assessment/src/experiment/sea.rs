//! A sea as a sum of wave systems, and what is true of it, by integrals over its density.

use std::f64::consts::{PI, TAU};

use super::GRAVITY_MPS2;
use crate::config::Config;

/// Frequencies of a system, over its peak's.
const BAND: (f64, f64) = (0.55, 2.45);
/// Bands that integrals are cut into.
const BANDS: u32 = 200;
/// Directions that integrals are cut into.
const DIRECTIONS: u32 = 120;

/// One wind sea or swell: JONSWAP's shape, cos-2s about one direction at all frequencies, deep water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct System {
    /// 4 √m0, metres.
    pub h_m0_m: f64,
    /// Peak period, seconds.
    pub t_p_s: f64,
    /// JONSWAP's γ: 3.3 for a wind sea, more for a narrow swell.
    pub peakedness: f64,
    /// s of cos-2s: 10 is 25°, 75 is 9°.
    pub spread: f64,
    /// Where waves travel towards, radians clockwise from north.
    pub towards_rad: f64,
}

impl System {
    /// A wind sea towards 60°, spread as wind seas are at their peak.
    #[must_use]
    pub fn wind_sea(h_m0_m: f64, t_p_s: f64) -> Self {
        Self { h_m0_m, t_p_s, peakedness: 3.3, spread: 10.0, towards_rad: PI / 3.0 }
    }

    /// Lowest and highest frequency, hertz.
    pub(super) fn band_hz(&self) -> (f64, f64) {
        (BAND.0 / self.t_p_s, BAND.1 / self.t_p_s)
    }

    /// JONSWAP (Hasselmann et al. 1973) within the band, up to a factor.
    pub(super) fn shape(&self, f_hz: f64) -> f64 {
        let (low_hz, high_hz) = self.band_hz();
        if !(low_hz..=high_hz).contains(&f_hz) {
            return 0.0;
        }
        let ratio = f_hz * self.t_p_s;
        let width = if ratio <= 1.0 { 0.07 } else { 0.09 };
        let peak = (-((ratio - 1.0) / width).powi(2) / 2.0).exp();
        ratio.powi(-5) * (-1.25 * ratio.powi(-4)).exp() * self.peakedness.powf(peak)
    }

    /// Share of energy at an angle from the main direction, up to a factor.
    pub(super) fn spreading(&self, angle_rad: f64) -> f64 {
        (0.5 * angle_rad).cos().abs().powf(2.0 * self.spread)
    }
}

/// A sea of independent systems.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sea(pub Vec<System>);

impl Sea {
    /// The same sea, so many times as high.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(self.0.iter().map(|system| System { h_m0_m: factor * system.h_m0_m, ..*system }).collect())
    }
}

/// What is true of a sea.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// √m0, metres.
    pub sigma_m: f64,
    /// √(m0/m2), seconds.
    pub t_z_s: f64,
    /// Root mean square slope over a baseline, both directions together.
    pub slope_rms: f64,
}

impl Truth {
    /// Of a sea whose slope is taken between points `baseline_m` apart, north and east.
    #[must_use]
    pub fn of(sea: &Sea, baseline_m: f64) -> Self {
        let (mut m0, mut m2, mut slope) = (0.0, 0.0, 0.0);
        for system in &sea.0 {
            let angles = (0..DIRECTIONS).map(|i| TAU * (f64::from(i) + 0.5) / f64::from(DIRECTIONS) - PI);
            let directions: Vec<(f64, f64, f64)> = angles
                .map(|angle| (system.spreading(angle), (angle + system.towards_rad).sin_cos()))
                .map(|(weight, (sin, cos))| (weight, sin, cos))
                .collect();
            let weights: f64 = directions.iter().map(|(weight, ..)| weight).sum();
            let (low_hz, high_hz) = system.band_hz();
            let middles = || (0..BANDS).map(|i| low_hz + (high_hz - low_hz) * (f64::from(i) + 0.5) / f64::from(BANDS));
            let whole: f64 = middles().map(|f_hz| system.shape(f_hz)).sum();
            for f_hz in middles() {
                let variance_m2 = (0.25 * system.h_m0_m).powi(2) * system.shape(f_hz) / whole;
                let k_radpm = (TAU * f_hz).powi(2) / GRAVITY_MPS2;
                // Rise over run between two points of a wave: a sine's over its phase.
                let along = |share: f64| (2.0 * (0.5 * k_radpm * baseline_m * share).sin() / baseline_m).powi(2);
                let mean: f64 = directions.iter().map(|(weight, sin, cos)| weight * (along(*cos) + along(*sin))).sum();
                m0 += variance_m2;
                m2 += f_hz * f_hz * variance_m2;
                slope += variance_m2 * mean / weights;
            }
        }
        Self { sigma_m: m0.sqrt(), t_z_s: (m0 / m2).sqrt(), slope_rms: slope.sqrt() }
    }

    /// Of the same sea, so many times as high.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { sigma_m: factor * self.sigma_m, slope_rms: factor * self.slope_rms, ..self }
    }

    /// Mean of the highest tenth of the waves, metres, by Forristall's distribution (1978) of a sea that is not narrow:
    /// P(H > h) = exp(−(h/√m0)^2.126 / 8.42).
    #[must_use]
    pub fn h_tenth_m(&self) -> f64 {
        const STEPS: u32 = 1000;
        let of_share = |share: f64| (-8.42 * share.ln()).powf(1.0 / 2.126);
        let mean = (0..STEPS).map(|i| of_share(0.1 * (f64::from(i) + 0.5) / f64::from(STEPS))).sum::<f64>() / f64::from(STEPS);
        self.sigma_m * mean
    }

    /// The largest of all quantities that a verdict limits, over their limits: water over 1 is not fit to land on. The highest wave is a Rayleigh
    /// sea's. NaN for an airframe that is none.
    #[must_use]
    pub fn severity(&self, config: &Config) -> f64 {
        let Ok(airframe) = config.airframe.resolved() else { return f64::NAN };
        let kept = 1.0 - config.airframe.margin;
        let largest = rayleigh_largest(config.landing_s / self.t_z_s);
        let h_tenth_m = self.h_tenth_m();
        let length_m = GRAVITY_MPS2 * self.t_z_s * self.t_z_s / TAU;
        let is_ridden = length_m >= 4.0 * airframe.hull_length_m;
        [
            4.0 * self.sigma_m / config.h_s_m_max,
            h_tenth_m / config.h_tenth_m_max,
            2.0 * largest * self.sigma_m / config.h_highest_m_max,
            self.slope_rms / config.slope_rms_rad_max,
            (largest * self.slope_rms).atan() / (airframe.tip_angle_rad * kept),
            if is_ridden { 0.0 } else { 0.5 * h_tenth_m / (airframe.float_depth_m * kept) },
            (config.airframe.descent_mps + largest * TAU * self.sigma_m / self.t_z_s) / (airframe.touchdown_speed_mps * kept),
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }

    /// How many times as high a sea must be to be so severe; severity rises with the height.
    #[must_use]
    pub fn scale_of_severity(&self, severity: f64, config: &Config) -> f64 {
        let (mut low, mut high) = (0.0, 2.0 / self.sigma_m);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.scaled(middle).severity(config) < severity { low = middle } else { high = middle }
        }
        low
    }
}

/// Mean of the largest of n Rayleigh amplitudes over their parent's deviation: ∫ 1 − (1 − exp(−x²/2))ⁿ dx.
pub(super) fn rayleigh_largest(n: f64) -> f64 {
    const STEP: f64 = 0.02;
    (0..500).map(|i| (f64::from(i) + 0.5) * STEP).map(|x| (1.0 - (1.0 - (-0.5 * x * x).exp()).powf(n.max(1.0))) * STEP).sum()
}
