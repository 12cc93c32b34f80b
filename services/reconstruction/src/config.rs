//! `[reconstruction]`

use halcyon_chassis::Section;
use halcyon_model::RigId;
use serde::{Deserialize, Serialize};

use crate::core::matcher::{DisparityRange, Engine};
use crate::core::reconstruct::Settings;

/// How pairs become patches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The rig whose pairs are reconstructed.
    pub rig: String,
    /// Dense matching: `guided` (a few disparities about the mean plane of the water: fastest by far), `sgm` or `sgm8` (everything,
    /// our own), or OpenCV's `sgbm`, `sgbm-3way` (threaded, less memory), `sgbm-hh` (slow), `bm` (sparse).
    pub engine: String,
    /// Window of the matcher, pixels, odd; 0 takes what suits the engine.
    pub block_px: u32,
    /// Least disparity of a full-range search, pixels. With a pose only the few disparities that water can have are searched.
    pub disparity_px_min: u32,
    /// Largest disparity of a full-range search, pixels.
    pub disparity_px_max: u32,
    /// Water may lie this much above or below where the pose puts it, metres: waves and the autopilot's height error.
    pub height_margin_m: f64,
    /// Window of the least-squares sub-pixel refinement, pixels, odd; 0 turns it off.
    pub refine_window_px: u32,
    /// Every so many pixels, in x and in y, become a point.
    pub point_stride_px: u32,
    /// Cell side of the elevation grid, metres.
    pub cell_m: f64,
    /// Fewer points make no patch.
    pub points_min: u32,
    /// Whether the rig stands still, on a tripod or over a wave tank: pairs without a pose are then levelled against all water
    /// seen so far, and distance is level. Never for a rig that is carried.
    pub fixed_rig: bool,
    /// For the random choices of the robust plane fit; the same seed and pictures give the same patch.
    pub seed: u64,
    /// Pictures for people are published at most this often, hertz, at most 2; 0 turns them off.
    pub preview_rate_hz: f64,
    /// The calibration is checked against what the cameras see this often, seconds; 0 turns that off. Rows off by more than half a
    /// pixel make the service call itself degraded.
    pub drift_period_s: f64,
    /// Threads that the engines, ours and OpenCV's, may use in this process. All of them would slow the other services of a small
    /// on-board computer.
    pub threads: u32,
}

impl Default for Config {
    fn default() -> Self {
        let settings = Settings::default();
        Self {
            rig: "leader-1".into(),
            engine: settings.engine.name().into(),
            block_px: 0,
            disparity_px_min: settings.range.min_px,
            disparity_px_max: settings.range.max_px,
            height_margin_m: settings.height_margin_m,
            refine_window_px: settings.refine_window_px,
            point_stride_px: settings.point_stride_px,
            cell_m: settings.cell_m,
            points_min: 500,
            fixed_rig: settings.fixed_rig,
            seed: settings.seed,
            preview_rate_hz: 1.0,
            drift_period_s: 10.0,
            threads: 1,
        }
    }
}

impl Config {
    /// What the core takes.
    ///
    /// # Errors
    /// One line for people: the same as [`Section::validate`].
    pub fn settings(&self) -> Result<Settings, String> {
        self.check()?;
        let engine: Engine = self.engine.parse().map_err(|error| format!("engine: {error}"))?;
        Ok(Settings {
            engine,
            block_px: if self.block_px == 0 { engine.block_px_default() } else { self.block_px },
            range: DisparityRange { min_px: self.disparity_px_min, max_px: self.disparity_px_max },
            height_margin_m: self.height_margin_m,
            refine_window_px: self.refine_window_px,
            point_stride_px: self.point_stride_px,
            cell_m: self.cell_m,
            points_min: self.points_min as usize,
            seed: self.seed,
            fixed_rig: self.fixed_rig,
        })
    }

    /// The rig.
    ///
    /// # Errors
    /// One line for people, where it is no identifier.
    pub fn rig(&self) -> Result<RigId, String> {
        RigId::new(self.rig.clone()).map_err(|error| format!("rig: {error}"))
    }

    fn check(&self) -> Result<(), String> {
        let within = |name: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(format!("{name} must be {low} to {high}, not {value}")) }
        };
        let window = |name: &str, value: u32| {
            if value == 0 || (value % 2 == 1 && (3..=51).contains(&value)) {
                Ok(())
            } else {
                Err(format!("{name} must be odd, 3 to 51, or 0, not {value}"))
            }
        };
        window("block_px", self.block_px)?;
        window("refine_window_px", self.refine_window_px)?;
        within("disparity_px_max", self.disparity_px_max.into(), 1.0, 2000.0)?;
        if self.disparity_px_min >= self.disparity_px_max {
            return Err(format!(
                "disparity_px_min must be below disparity_px_max, {}, not {}",
                self.disparity_px_max, self.disparity_px_min
            ));
        }
        within("height_margin_m", self.height_margin_m, 0.01, 100.0)?;
        within("point_stride_px", self.point_stride_px.into(), 1.0, 16.0)?;
        within("cell_m", self.cell_m, 0.001, 100.0)?;
        within("points_min", self.points_min.into(), 16.0, 1e6)?;
        within("preview_rate_hz", self.preview_rate_hz, 0.0, 2.0)?;
        within("drift_period_s", self.drift_period_s, 0.0, 3600.0)?;
        within("threads", self.threads.into(), 1.0, 256.0)
    }
}

impl Section for Config {
    const NAME: &'static str = "reconstruction";

    fn validate(&self) -> Result<(), String> {
        self.rig()?;
        self.settings().map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_are_the_cores() {
        assert_eq!(Config::default().validate(), Ok(()));
        assert_eq!(Config::default().settings(), Ok(Settings::default()));
    }

    #[test]
    fn what_is_out_of_range_is_named() {
        let check = |change: &dyn Fn(&mut Config), name: &str| {
            let mut config = Config::default();
            change(&mut config);
            let error = config.validate().unwrap_err();
            assert!(error.contains(name), "{error}");
        };
        check(&|c| c.rig = "a/b".into(), "rig");
        check(&|c| c.engine = "elas".into(), "engine");
        check(&|c| c.block_px = 4, "block_px");
        check(&|c| c.refine_window_px = 53, "refine_window_px");
        check(&|c| c.disparity_px_min = 500, "disparity_px_min");
        check(&|c| c.disparity_px_max = 0, "disparity_px_max");
        check(&|c| c.height_margin_m = f64::NAN, "height_margin_m");
        check(&|c| c.point_stride_px = 0, "point_stride_px");
        check(&|c| c.cell_m = 0.0, "cell_m");
        check(&|c| c.points_min = 0, "points_min");
        check(&|c| c.preview_rate_hz = 2.5, "preview_rate_hz");
        check(&|c| c.drift_period_s = -1.0, "drift_period_s");
        check(&|c| c.drift_period_s = f64::NAN, "drift_period_s");
        check(&|c| c.threads = 0, "threads");
    }
}
