//! `halcyon rig`: what a rig can measure, from which altitude.

use std::path::PathBuf;

use serde::Serialize;

use crate::core::reconstruct::Settings;
use crate::core::rectify::{Rectifier, RectifyError};
use crate::core::rig_budget::{Best, Budget, LENGTH_PER_HEIGHT, RigGeometry, RigGeometryError};
use crate::files::{RigFileError, read_rig};
use crate::limits::{OutOfRange, within};

/// The highest wave that was ever measured is about 30 m.
const WAVE_HEIGHT_M: [f64; 2] = [1e-4, 40.0];
/// Longer ones are tsunamis and tides.
const WAVELENGTH_M: [f64; 2] = [1e-3, 2000.0];
/// Steeper waves break: height over length in deep water (Michell 1893).
const STEEPNESS_MAX: f64 = 0.142;

/// Rows of the table.
const ROWS: i32 = 24;
/// Waves that a best altitude is named for where nobody asks, metres.
const WAVES_M: [f64; 7] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0];

/// Where the rig's numbers come from.
#[derive(Debug, Clone, PartialEq)]
pub enum RigSource {
    /// A calibration: rectified, as the chain sees it.
    File(PathBuf),
    /// A plan.
    Plan {
        /// Horizontal field of view, degrees.
        fov_deg: f64,
        /// Width, pixels.
        width_px: u32,
        /// Height, pixels.
        height_px: u32,
        /// Distance between the cameras, metres.
        baseline_m: f64,
    },
}

/// Flags.
#[derive(Debug, Clone, PartialEq)]
pub struct RigOptions {
    /// `--rig`, or `--fov-deg` and its companions.
    pub source: RigSource,
    /// `--altitudes`, as `LOW..HIGH`, metres.
    pub altitudes: String,
    /// `--disparity-sigma-px`
    pub disparity_sigma_px: f64,
    /// `--max-disparity`
    pub disparity_max_px: Option<f64>,
    /// `--cell`
    pub cell_m: Option<f64>,
    /// `--wave-height`
    pub wave_height_m: Option<f64>,
    /// `--wavelength`
    pub wavelength_m: Option<f64>,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum RigCliError {
    /// The calibration's file.
    #[error(transparent)]
    File(#[from] RigFileError),
    /// The calibration.
    #[error("the rig cannot be rectified")]
    Rectify(#[from] RectifyError),
    /// A number.
    #[error(transparent)]
    Geometry(#[from] RigGeometryError),
    /// All of them below the least.
    #[error("up to {high_m} m the two cameras share too little, or disparities are too large: fly at {least_m:.2} m or higher")]
    TooLow {
        /// The highest that was asked for, metres.
        high_m: f64,
        /// The least that is possible, metres.
        least_m: f64,
    },
    /// Another number.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A wave that would break.
    #[error(
        "a wave {height_m} m high and {length_m} m long breaks: height over length is {:.3}, at most {STEEPNESS_MAX} in deep water",
        height_m / length_m
    )]
    Breaks {
        /// `--wave-height`, metres.
        height_m: f64,
        /// `--wavelength`, metres.
        length_m: f64,
    },
    /// `--altitudes`
    #[error("altitudes must be LOW..HIGH in metres, from 0.01 to 10000, not {text:?}")]
    Altitudes {
        /// What was given.
        text: String,
    },
}

/// The answer, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RigReport {
    /// The rig.
    pub rig: RigNumbers,
    /// Below this altitude less than a quarter of the picture is in common, or disparities exceed the largest, metres.
    pub altitude_m_min: f64,
    /// Against altitude.
    pub rows: Vec<BudgetRow>,
    /// The best altitude for each wave height.
    pub best: Vec<BestRow>,
}

/// The rig's own numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RigNumbers {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Horizontal field of view, degrees.
    pub fov_deg: f64,
    /// Baseline, metres.
    pub baseline_m: f64,
    /// One standard deviation of a disparity, pixels.
    pub disparity_sigma_px: f64,
    /// Side of the matching window, pixels.
    pub window_px: f64,
}

/// One altitude: see [`Budget`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "as in Budget")]
pub struct BudgetRow {
    pub altitude_m: f64,
    pub disparity_px: f64,
    pub pixel_m: f64,
    pub footprint_m: [f64; 2],
    pub shared_m: [f64; 2],
    pub overlap: f64,
    pub cell_m: f64,
    pub point_sigma_m: f64,
    pub cell_sigma_m: f64,
    pub still_height_m: f64,
    pub wavelength_m_min: f64,
    pub wavelength_m_max: f64,
    pub wave_height_m_min: Option<f64>,
    pub wave_height_m_max: Option<f64>,
    /// Whether the altitude is high enough.
    pub usable: bool,
}

impl BudgetRow {
    fn new(budget: &Budget, altitude_m_min: f64) -> Self {
        Self {
            altitude_m: budget.altitude_m,
            disparity_px: budget.disparity_px,
            pixel_m: budget.pixel_m,
            footprint_m: budget.footprint_m,
            shared_m: budget.shared_m,
            overlap: budget.overlap,
            cell_m: budget.cell_m,
            point_sigma_m: budget.point_sigma_m,
            cell_sigma_m: budget.cell_sigma_m,
            still_height_m: budget.still_height_m,
            wavelength_m_min: budget.wavelength_min_m,
            wavelength_m_max: budget.wavelength_max_m,
            wave_height_m_min: budget.wave_height_min_m,
            wave_height_m_max: budget.wave_height_max_m,
            usable: budget.altitude_m >= altitude_m_min,
        }
    }
}

/// The best altitude for a wave height: see [`Best`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "as in Best")]
pub struct BestRow {
    pub wave_height_m: f64,
    pub wavelength_m: f64,
    pub altitude_m: f64,
    pub error: f64,
    pub altitude_m_min: Option<f64>,
    pub altitude_m_max: Option<f64>,
}

impl From<Best> for BestRow {
    fn from(best: Best) -> Self {
        Self {
            wave_height_m: best.wave_height_m,
            wavelength_m: best.wavelength_m,
            altitude_m: best.altitude_m,
            error: best.error,
            altitude_m_min: best.altitude_m_min,
            altitude_m_max: best.altitude_m_max,
        }
    }
}

/// What the rig can measure.
///
/// # Errors
/// [`RigCliError`]: one line that says which file or number is at fault.
pub fn rig(options: &RigOptions) -> Result<RigReport, RigCliError> {
    check_wave(options)?;
    let (low_m, high_m) = altitudes(&options.altitudes)?;
    let geometry = geometry(options)?;
    let altitude_m_min = geometry.altitude_m_min();
    // Two rows at least.
    if high_m / (high_m / low_m).powf(1.0 / f64::from(ROWS - 1)) < altitude_m_min {
        return Err(RigCliError::TooLow { high_m, least_m: altitude_m_min });
    }
    let row = |i: i32| {
        let altitude_m = low_m * (high_m / low_m).powf(f64::from(i) / f64::from(ROWS - 1));
        BudgetRow::new(&geometry.at(altitude_m), altitude_m_min)
    };
    let breaks = |height_m: f64| options.wavelength_m.is_some_and(|length_m| height_m > STEEPNESS_MAX * length_m);
    let usual = || WAVES_M.into_iter().filter(|height_m| !breaks(*height_m)).collect();
    let heights = options.wave_height_m.map_or_else(usual, |height_m| vec![height_m]);
    let length_m = |height_m: f64| options.wavelength_m.unwrap_or(height_m * LENGTH_PER_HEIGHT);
    Ok(RigReport {
        rig: RigNumbers {
            width_px: geometry.width_px,
            height_px: geometry.height_px,
            focal_px: geometry.focal_px,
            fov_deg: geometry.fov_rad().to_degrees(),
            baseline_m: geometry.baseline_m,
            disparity_sigma_px: geometry.disparity_sigma_px,
            window_px: geometry.window_px,
        },
        altitude_m_min,
        rows: (0..ROWS).map(row).collect(),
        best: heights.into_iter().map(|height_m| geometry.best(height_m, length_m(height_m)).into()).collect(),
    })
}

fn check_wave(options: &RigOptions) -> Result<(), RigCliError> {
    let [low, high] = WAVE_HEIGHT_M;
    options.wave_height_m.map_or(Ok(()), |height_m| within("--wave-height", height_m, low, high, " m"))?;
    let [low, high] = WAVELENGTH_M;
    options.wavelength_m.map_or(Ok(()), |length_m| within("--wavelength", length_m, low, high, " m"))?;
    match (options.wave_height_m, options.wavelength_m) {
        (Some(height_m), Some(length_m)) if height_m > STEEPNESS_MAX * length_m => {
            Err(RigCliError::Breaks { height_m, length_m })
        }
        _ => Ok(()),
    }
}

fn geometry(options: &RigOptions) -> Result<RigGeometry, RigCliError> {
    let (width_px, height_px, focal_px, baseline_m) = match &options.source {
        RigSource::File(path) => {
            let rig = *Rectifier::new(&read_rig(path)?)?.rig();
            (rig.width_px, rig.height_px, rig.focal_px, rig.baseline_m)
        }
        RigSource::Plan { fov_deg, width_px, height_px, baseline_m } => {
            within("--fov-deg, the horizontal field of view,", *fov_deg, 1.0, 170.0, "°")?;
            (*width_px, *height_px, RigGeometry::focal_px(fov_deg.to_radians(), *width_px), *baseline_m)
        }
    };
    let geometry = RigGeometry {
        width_px,
        height_px,
        focal_px,
        baseline_m,
        window_px: f64::from(Settings::default().refine_window_px.max(1)),
        disparity_sigma_px: options.disparity_sigma_px,
        cell_m: options.cell_m,
        disparity_max_px: options.disparity_max_px,
    };
    geometry.check()?;
    Ok(geometry)
}

fn altitudes(text: &str) -> Result<(f64, f64), RigCliError> {
    let parse = |text: &str| text.trim().parse::<f64>().ok().filter(|m| (0.01..=1e4).contains(m));
    let range = text.split_once("..").and_then(|(low, high)| Some((parse(low)?, parse(high)?)));
    range.filter(|(low, high)| low < high).ok_or_else(|| RigCliError::Altitudes { text: text.chars().take(80).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> RigOptions {
        RigOptions {
            source: RigSource::Plan { fov_deg: 50.0, width_px: 320, height_px: 240, baseline_m: 0.4 },
            altitudes: "0.5..20".into(),
            disparity_sigma_px: 0.05,
            disparity_max_px: None,
            cell_m: None,
            wave_height_m: None,
            wavelength_m: None,
        }
    }

    #[test]
    fn the_default_rig_in_numbers() {
        let report = rig(&options()).unwrap();
        // 160 / tan 25° = 343.1 px; 0.75 × 320 px of disparity at 343.1 × 0.4 / 240 m.
        assert!((report.rig.focal_px - 343.1).abs() < 0.05 && (report.altitude_m_min - 0.572).abs() < 1e-3);
        assert!((report.rows[0].altitude_m - 0.5).abs() < 1e-9 && (report.rows[23].altitude_m - 20.0).abs() < 1e-9);
        assert!(!report.rows[0].usable && report.rows[23].usable);
        assert_eq!(report.best.len(), WAVES_M.len());
        let one = rig(&RigOptions { wave_height_m: Some(0.3), wavelength_m: Some(8.0), ..options() }).unwrap();
        assert_eq!((one.best.len(), one.best[0].wave_height_m, one.best[0].wavelength_m), (1, 0.3, 8.0));
    }

    #[test]
    fn nonsense_is_refused() {
        let check = |change: &dyn Fn(&mut RigOptions), expected: &str| {
            let mut options = options();
            change(&mut options);
            let error = rig(&options).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        for text in ["", "5", "5..1", "0..5", "nan..5", "1..inf", "1...2"] {
            check(&|o| o.altitudes = text.into(), "altitudes must be LOW..HIGH");
        }
        check(&|o| o.altitudes = "0.1..0.5".into(), "fly at 0.57 m or higher");
        check(&|o| o.source = RigSource::File("/nowhere/rig.yaml".into()), "/nowhere/rig.yaml");
        let plan = |fov_deg, width_px, baseline_m| RigSource::Plan { fov_deg, width_px, height_px: 240, baseline_m };
        check(&|o| o.source = plan(f64::NAN, 320, 0.4), "field of view");
        check(&|o| o.source = plan(50.0, 0, 0.4), "width");
        check(&|o| o.source = plan(50.0, 320, 0.0), "baseline");
        check(&|o| o.disparity_sigma_px = f64::NAN, "disparity sigma");
        check(&|o| o.wave_height_m = Some(-1.0), "--wave-height must be 0.0001 to 40 m, not -1");
        check(&|o| o.wave_height_m = Some(1000.0), "--wave-height must be 0.0001 to 40 m");
        check(&|o| o.wavelength_m = Some(0.0), "--wavelength must be 0.001 to 2000 m");
        let steep = |height_m| move |o: &mut RigOptions| (o.wave_height_m, o.wavelength_m) = (Some(height_m), Some(10.0));
        check(&steep(1.43), "breaks: height over length is 0.143, at most 0.142");
        let mut just = options();
        steep(1.41)(&mut just);
        assert!(rig(&just).is_ok());
    }
}
