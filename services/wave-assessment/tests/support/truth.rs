//! What is true of the seas that [`super::Sea::jonswap`] draws, by integrals over their spectrum, without the estimator's code.

use std::f64::consts::TAU;

use halcyon_wave_assessment::Config;

use super::{GRAVITY_MPS2, bands};

/// True quantities of a sea.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    /// √m0, metres.
    pub sigma_m: f64,
    /// √(m0/m2), seconds.
    pub t_z_s: f64,
    /// Root mean square slope over the baseline, both directions together.
    pub slope_rms: f64,
}

impl Truth {
    pub fn of(h_m0_m: f64, t_p_s: f64, baseline_m: f64) -> Self {
        let (mut m0, mut m2, mut slope) = (0.0, 0.0, 0.0);
        // Directions of cos-2s spreading with s = 10, by their density.
        let directions: Vec<(f64, f64)> =
            (-90..=90).map(|d| f64::from(d) * TAU / 180.0).map(|a| (a, (0.5 * a).cos().powi(20))).collect();
        let weights: f64 = directions.iter().map(|(_, w)| w).sum();
        for (low_hz, width_hz, variance_m2) in bands(h_m0_m, t_p_s) {
            let f_hz = low_hz + 0.5 * width_hz;
            let k_radpm = (TAU * f_hz).powi(2) / GRAVITY_MPS2;
            let along = |share: f64| (2.0 * (0.5 * k_radpm * baseline_m * share).sin() / baseline_m).powi(2);
            let mean: f64 = directions
                .iter()
                .map(|(a, w)| {
                    let (sin, cos) = (a + 60f64.to_radians()).sin_cos();
                    w * (along(cos) + along(sin))
                })
                .sum();
            m0 += variance_m2;
            m2 += f_hz * f_hz * variance_m2;
            slope += variance_m2 * mean / weights;
        }
        Self { sigma_m: m0.sqrt(), t_z_s: (m0 / m2).sqrt(), slope_rms: slope.sqrt() }
    }

    /// Mean of the highest tenth of the waves, metres, by Forristall's distribution (1978) of a sea that is not narrow:
    /// P(H > h) = exp(−(h/√m0)^2.126 / 8.42).
    pub fn h_tenth_m(&self) -> f64 {
        let of_share = |share: f64| (-8.42 * share.ln()).powf(1.0 / 2.126);
        self.sigma_m * (0..10_000).map(|i| of_share((f64::from(i) + 0.5) * 1e-5)).sum::<f64>() / 10_000.0
    }

    /// The largest of all quantities over their limits. The highest wave is a Rayleigh sea's.
    pub fn severity(&self, config: &Config) -> f64 {
        let airframe = config.airframe.resolved().unwrap();
        let kept = 1.0 - config.airframe.margin;
        let waves = config.landing_s / self.t_z_s;
        // Mean of the largest of n Rayleigh amplitudes, over their parent's deviation.
        let largest = rayleigh_largest(waves);
        let h_s_m = 4.0 * self.sigma_m;
        let h_tenth_m = self.h_tenth_m();
        let length_m = GRAVITY_MPS2 * self.t_z_s * self.t_z_s / TAU;
        let hull =
            if length_m >= 4.0 * airframe.hull_length_m { 0.0 } else { 0.5 * h_tenth_m / (airframe.float_depth_m * kept) };
        [
            h_s_m / config.h_s_m_max,
            h_tenth_m / config.h_tenth_m_max,
            2.0 * largest * self.sigma_m / config.h_highest_m_max,
            self.slope_rms / config.slope_rms_rad_max,
            (largest * self.slope_rms).atan() / (airframe.tip_angle_rad * kept),
            hull,
            (config.airframe.descent_mps + largest * TAU * self.sigma_m / self.t_z_s) / (airframe.touchdown_speed_mps * kept),
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }

    /// H_m0 at which the severity is so much, metres; it rises with the height.
    pub fn height_of_severity(severity: f64, t_p_s: f64, config: &Config) -> f64 {
        let unit = Self::of(1.0, t_p_s, config.slope_baseline_m);
        let at = |h: f64| Self { sigma_m: h * unit.sigma_m, slope_rms: h * unit.slope_rms, ..unit }.severity(config);
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if at(middle) < severity { low = middle } else { high = middle }
        }
        low
    }
}

/// ∫ 1 − (1 − exp(−x²/2))ⁿ dx.
fn rayleigh_largest(n: f64) -> f64 {
    (0..4000)
        .map(|i| (f64::from(i) + 0.5) * 0.0025)
        .map(|x| (1.0 - (1.0 - (-0.5 * x * x).exp()).powf(n.max(1.0))) * 0.0025)
        .sum()
}
