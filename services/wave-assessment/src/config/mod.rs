//! `[wave_assessment]`

mod airframe;

use halcyon_chassis::Section;
use halcyon_model::RigId;
use serde::{Deserialize, Serialize};

pub use airframe::{Airframe, AirframeConfig, PROFILES};

/// What is measured over how long, and what water is calm enough.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The rig whose patches are assessed.
    pub rig: String,
    /// Whether the rig stands still, on a tripod or a pier. Then the distance to the mean plane is a measurement of the level, and
    /// waves longer than the footprint can be seen without a pose.
    pub fixed_rig: bool,
    /// Observation window, seconds. Longer is steadier, shorter is fresher.
    pub window_s: f64,
    /// Least observed time for a verdict, seconds.
    pub window_s_min: f64,
    /// Least number of waves at one gauge for a verdict, unless no wave stands out of the noise.
    pub waves_min: u32,
    /// Least mean coverage of the patches, 0 to 1.
    pub coverage_min: f64,
    /// Largest share of samples that may be replaced as outliers, 0 to 1.
    pub outliers_max: f64,
    /// A sea state is published once in this many seconds of patch time.
    pub period_s: f64,
    /// How long a verdict holds after the newest patch it rests on, seconds.
    pub validity_s: f64,
    /// Without a patch for so long the water counts as unobserved, seconds.
    pub stale_s: f64,
    /// A patch older than this on arrival is refused, seconds.
    pub patch_age_s_max: f64,
    /// A patch further in the future than this is refused, seconds.
    pub clock_skew_s_max: f64,
    /// A longer gap between patches breaks a gauge's series, seconds (or twice the patches' interval, whichever is more).
    pub gap_s_max: f64,
    /// Patches whose centre is further than this from the newest one's belong to other water and leave the window, metres.
    pub spot_radius_m: f64,
    /// Waves slower than this are neither claimed nor bounded: the autopilot's height wanders there, hertz.
    pub wave_hz_min: f64,
    /// One standard deviation of a reading of the rig's downward rangefinder, metres: where there is one, it has to see the same waves.
    pub range_sigma_m: f64,
    /// Slope is taken between points this far apart, metres: about the airframe's size, for shorter ripples do not tilt it.
    pub slope_baseline_m: f64,
    /// Largest significant wave height to land on, metres.
    pub h_s_m_max: f64,
    /// Largest mean of the highest tenth of the waves, metres.
    pub h_tenth_m_max: f64,
    /// Largest expected highest wave during the landing, metres.
    pub h_highest_m_max: f64,
    /// Largest root mean square slope, radians.
    pub slope_rms_rad_max: f64,
    /// Time over the water during which a wave can hit, seconds.
    pub landing_s: f64,
    /// The bounds must be this share under the limits to become safe, and reach the limits to stop being so.
    pub hysteresis: f64,
    /// What has to land.
    pub airframe: AirframeConfig,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            rig: "leader-1".into(),
            fixed_rig: false,
            window_s: 60.0,
            window_s_min: 25.0,
            waves_min: 20,
            coverage_min: 0.5,
            outliers_max: 0.1,
            period_s: 1.0,
            validity_s: 5.0,
            stale_s: 3.0,
            patch_age_s_max: 5.0,
            clock_skew_s_max: 0.5,
            gap_s_max: 0.7,
            spot_radius_m: 3.0,
            wave_hz_min: 0.08,
            range_sigma_m: 0.02,
            slope_baseline_m: 0.4,
            h_s_m_max: 0.15,
            h_tenth_m_max: 0.22,
            h_highest_m_max: 0.30,
            slope_rms_rad_max: 0.12,
            landing_s: 20.0,
            hysteresis: 0.01,
            airframe: AirframeConfig::default(),
        }
    }
}

impl Section for Config {
    const NAME: &'static str = "wave_assessment";

    fn validate(&self) -> Result<(), String> {
        RigId::new(&self.rig).map_err(|error| format!("rig: {error}"))?;
        let within = |key: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(format!("{key} must be from {low} to {high}, not {value}")) }
        };
        within("window_s", self.window_s, 5.0, 3600.0)?;
        within("window_s_min", self.window_s_min, 5.0, self.window_s)?;
        within("waves_min", f64::from(self.waves_min), 1.0, 10_000.0)?;
        within("coverage_min", self.coverage_min, 0.0, 1.0)?;
        within("outliers_max", self.outliers_max, 0.0, 1.0)?;
        within("period_s", self.period_s, 0.1, 60.0)?;
        within("validity_s", self.validity_s, 0.1, 600.0)?;
        within("stale_s", self.stale_s, 0.1, 600.0)?;
        within("patch_age_s_max", self.patch_age_s_max, 0.1, 600.0)?;
        within("clock_skew_s_max", self.clock_skew_s_max, 0.0, 60.0)?;
        within("gap_s_max", self.gap_s_max, 0.01, 60.0)?;
        within("spot_radius_m", self.spot_radius_m, 0.1, 1000.0)?;
        within("wave_hz_min", self.wave_hz_min, 0.0, 10.0)?;
        within("range_sigma_m", self.range_sigma_m, 0.0, 10.0)?;
        within("slope_baseline_m", self.slope_baseline_m, 0.01, 10.0)?;
        within("h_s_m_max", self.h_s_m_max, 0.001, 20.0)?;
        within("h_tenth_m_max", self.h_tenth_m_max, 0.001, 40.0)?;
        within("h_highest_m_max", self.h_highest_m_max, 0.001, 40.0)?;
        within("slope_rms_rad_max", self.slope_rms_rad_max, 0.001, 1.5)?;
        within("landing_s", self.landing_s, 1.0, 3600.0)?;
        within("hysteresis", self.hysteresis, 0.0, 0.9)?;
        self.airframe.resolved().map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_nonsense_is_named() {
        assert_eq!(Config::default().validate(), Ok(()));
        let check = |change: fn(&mut Config), key: &str| {
            let mut config = Config::default();
            change(&mut config);
            let error = config.validate().unwrap_err();
            assert!(error.starts_with(key), "{error}");
        };
        check(|c| c.rig = "a/b".into(), "rig");
        check(|c| c.window_s = f64::NAN, "window_s");
        check(|c| c.window_s_min = 61.0, "window_s_min");
        check(|c| c.h_s_m_max = -0.1, "h_s_m_max");
        check(|c| c.coverage_min = 1.5, "coverage_min");
    }
}
