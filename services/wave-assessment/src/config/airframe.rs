//! What has to land: the vehicle's floats, and how much they bear.

use serde::{Deserialize, Serialize};

/// `[wave_assessment.airframe]`: a built-in profile, and what differs from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AirframeConfig {
    /// `small` (a quadcopter of half a metre on floats), `medium` (a hexacopter of a metre) or `large` (an octocopter of one and a half).
    pub profile: String,
    /// Length of the floats, metres; 0 takes the profile's. Waves much longer carry the hull, shorter ones wash over it.
    pub hull_length_m: f64,
    /// Height of the deck over the water, metres; 0 takes the profile's.
    pub float_depth_m: f64,
    /// Tilt of the water at which it capsizes or a rotor touches, radians; 0 takes the profile's.
    pub tip_angle_rad: f64,
    /// Speed against the water that the floats bear, metres per second; 0 takes the profile's.
    pub touchdown_speed_mps: f64,
    /// Speed at which it comes down, metres per second.
    pub descent_mps: f64,
    /// Share of each of these that is kept in reserve, 0 to 0.9.
    pub margin: f64,
}

impl Default for AirframeConfig {
    fn default() -> Self {
        Self {
            profile: "small".into(),
            hull_length_m: 0.0,
            float_depth_m: 0.0,
            tip_angle_rad: 0.0,
            touchdown_speed_mps: 0.0,
            descent_mps: 0.3,
            margin: 0.2,
        }
    }
}

/// A profile with all that differs put in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Airframe {
    /// Length of the floats, metres.
    pub hull_length_m: f64,
    /// Height of the deck over the water, metres.
    pub float_depth_m: f64,
    /// Radians.
    pub tip_angle_rad: f64,
    /// Metres per second.
    pub touchdown_speed_mps: f64,
}

/// The built-in profiles by their names.
pub const PROFILES: [(&str, Airframe); 3] = [
    ("small", Airframe { hull_length_m: 0.5, float_depth_m: 0.15, tip_angle_rad: 0.6, touchdown_speed_mps: 1.5 }),
    ("medium", Airframe { hull_length_m: 1.0, float_depth_m: 0.20, tip_angle_rad: 0.55, touchdown_speed_mps: 1.5 }),
    ("large", Airframe { hull_length_m: 1.5, float_depth_m: 0.25, tip_angle_rad: 0.5, touchdown_speed_mps: 1.2 }),
];

impl AirframeConfig {
    /// The numbers to judge by.
    ///
    /// # Errors
    /// In words, if there is no such profile or a number cannot be.
    pub fn resolved(&self) -> Result<Airframe, String> {
        let Some((_, base)) = PROFILES.iter().find(|(name, _)| *name == self.profile) else {
            let names: Vec<&str> = PROFILES.iter().map(|(name, _)| *name).collect();
            return Err(format!("airframe.profile must be one of {}, not {:?}", names.join(", "), self.profile));
        };
        let within = |key: &str, value: f64, low: f64, high: f64, base: f64| match value {
            0.0 => Ok(base),
            x if (low..=high).contains(&x) => Ok(x),
            x => Err(format!("airframe.{key} must be from {low} to {high}, or 0 for the profile's, not {x}")),
        };
        for (key, value, low, high) in [("descent_mps", self.descent_mps, 0.05, 5.0), ("margin", self.margin, 0.0, 0.9)] {
            if !(low..=high).contains(&value) {
                return Err(format!("airframe.{key} must be from {low} to {high}, not {value}"));
            }
        }
        Ok(Airframe {
            hull_length_m: within("hull_length_m", self.hull_length_m, 0.05, 20.0, base.hull_length_m)?,
            float_depth_m: within("float_depth_m", self.float_depth_m, 0.01, 5.0, base.float_depth_m)?,
            tip_angle_rad: within("tip_angle_rad", self.tip_angle_rad, 0.05, 1.5, base.tip_angle_rad)?,
            touchdown_speed_mps: within("touchdown_speed_mps", self.touchdown_speed_mps, 0.1, 10.0, base.touchdown_speed_mps)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_is_the_base_and_what_is_said_goes() {
        let medium = AirframeConfig { profile: "medium".into(), tip_angle_rad: 0.3, ..AirframeConfig::default() };
        let found = medium.resolved().unwrap();
        assert_eq!((found.hull_length_m, found.tip_angle_rad), (1.0, 0.3));
        let bad = |change: fn(&mut AirframeConfig)| {
            let mut config = AirframeConfig::default();
            change(&mut config);
            config.resolved().unwrap_err()
        };
        assert!(bad(|c| c.profile = "boat".into()).contains("small, medium, large"));
        assert!(bad(|c| c.hull_length_m = f64::NAN).starts_with("airframe.hull_length_m"));
        assert!(bad(|c| c.float_depth_m = -0.1).starts_with("airframe.float_depth_m"));
        assert!(bad(|c| c.margin = 1.0).starts_with("airframe.margin"));
        assert!(bad(|c| c.descent_mps = 0.0).starts_with("airframe.descent_mps"));
    }
}
