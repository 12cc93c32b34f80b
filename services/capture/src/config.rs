//! `[capture]`

use std::path::PathBuf;

use halcyon_chassis::{ConfigError, Section, Settings};
use halcyon_model::{RigId, VehicleId};
use halcyon_sim::SimConfig;
use serde::{Deserialize, Serialize};

/// Where pairs come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SourceKind {
    /// Simulated water, seen from where the simulated vehicle is.
    Sim,
    /// A survey folder.
    Folder,
}

/// `[capture]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Name of the rig: the key that pairs are published under.
    pub rig: String,
    /// The vehicle that carries the rig: its state gives the pose.
    pub vehicle: String,
    /// `sim` or `folder`.
    pub source: SourceKind,
    /// The survey folder, for `source = "folder"`.
    pub folder: PathBuf,
    /// Start the folder again when it has ended.
    pub folder_loop: bool,
    /// Pairs per second of fleet time, for `source = "sim"`; a folder is played at its own stamps.
    pub rate_hz: f64,
    /// Below this height above mean water nothing is captured: too near to see, and over the jetty there is no water. Metres.
    pub height_m_min: f64,
    /// Pairs go without a pose when the vehicle's last state is older than this, seconds.
    pub pose_age_s_max: f64,
    /// One standard deviation of the autopilot's height, stated on each pose, metres.
    pub height_sigma_m: f64,
    /// One standard deviation of the autopilot's roll and pitch, stated on each pose, degrees.
    pub attitude_sigma_deg: f64,
    /// `[sim]`, for `source = "sim"`: the water and the cameras.
    #[serde(skip)]
    pub sim: SimConfig,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            rig: "leader-1".into(),
            vehicle: "leader-1".into(),
            source: SourceKind::Sim,
            folder: PathBuf::new(),
            folder_loop: false,
            rate_hz: 5.0,
            height_m_min: 1.5,
            pose_age_s_max: 1.0,
            height_sigma_m: 0.3,
            attitude_sigma_deg: 0.5,
            sim: SimConfig::default(),
        }
    }
}

impl Section for Config {
    const NAME: &'static str = "capture";

    fn validate(&self) -> Result<(), String> {
        RigId::new(&self.rig).map_err(|error| format!("rig: {error}"))?;
        VehicleId::new(&self.vehicle).map_err(|error| format!("vehicle: {error}"))?;
        for (key, value, low, high) in [
            ("rate_hz", self.rate_hz, 0.1, 100.0),
            ("height_m_min", self.height_m_min, 0.5, 100.0),
            ("pose_age_s_max", self.pose_age_s_max, 0.1, 10.0),
            ("height_sigma_m", self.height_sigma_m, 0.001, 100.0),
            ("attitude_sigma_deg", self.attitude_sigma_deg, 0.001, 90.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(format!("{key} must be from {low} to {high}, not {value}"));
            }
        }
        if self.source == SourceKind::Folder && self.folder.as_os_str().is_empty() {
            return Err("folder must name a survey folder when source is \"folder\"".into());
        }
        Ok(())
    }

    fn resolve(settings: &Settings) -> Result<Self, ConfigError> {
        Ok(Self { sim: settings.section::<SimSection>()?.0, ..settings.section()? })
    }
}

/// `[sim]`, as this service reads it: the simulator's crate knows no chassis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SimSection(pub SimConfig);

impl Section for SimSection {
    const NAME: &'static str = "sim";

    fn validate(&self) -> Result<(), String> {
        self.0.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sections_are_read_and_checked() {
        let resolve = |overrides: &[&str]| {
            let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
            Settings::load(None, &overrides).and_then(|settings| Config::resolve(&settings)).map_err(|error| error.to_string())
        };
        let config = resolve(&["capture.rate_hz=10", "sim.seed=7", "sim.sea.height_m=0.2"]).unwrap();
        assert_eq!((config.rate_hz, config.sim.seed, config.sim.sea.height_m), (10.0, 7, 0.2));
        assert_eq!(resolve(&[]).unwrap(), Config::default());
        for (setting, expected) in [
            ("capture.rate_hz=-1", "[capture] rate_hz must be from 0.1 to 100, not -1"),
            ("capture.rate_hz=nan", "[capture] rate_hz must be from 0.1 to 100, not NaN"),
            ("capture.source=folder", "[capture] folder must name a survey folder when source is \"folder\""),
            ("sim.sea.height_m=-1.0", "[sim] sea height_m must be from 0 to 30, not -1"),
            ("sim.rig.width_px=5", "[sim] rig width_px must be from 16 to 4096, not 5"),
        ] {
            assert_eq!(resolve(&[setting]).unwrap_err(), expected);
        }
        assert!(resolve(&["capture.rig=\"a/b\""]).unwrap_err().starts_with("[capture] rig: rig identifier"));
    }
}
