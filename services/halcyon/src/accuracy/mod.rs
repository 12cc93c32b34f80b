//! How accurate the measurement chain is, against water that is known exactly: `halcyon bench --accuracy`.
//!
//! Each experiment renders pictures of simulated water with the simulator's cameras, measures them with the chain that flies, and
//! compares with the formula that the water was made of. Nothing of the chain takes part in making the truth. All are seeded:
//! the same figures come out everywhere. Thesis: tables and figures of chapters 5 and 7, its own values beside ours.

mod air;
mod honesty;
mod plane;
mod scene;
mod tank;
mod truth;

pub use air::{AirErrors, Autopilot, Flight, Flown, fly};
pub use honesty::{Honesty, honesty};
pub use plane::{PlaneRecord, plane, still_water};
pub use scene::{Scene, SceneError, thesis_rig};
use serde::Serialize;
pub use tank::{Assessed, PROBE_HZ, TankErrors, TankRecord, TankRun, tank};

/// One figure against what is asked of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AccuracyRow {
    /// Which experiment.
    pub what: String,
    /// Which figure of it.
    pub figure: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What came out.
    pub value: f64,
    /// Least and largest that are good enough.
    pub wanted: (f64, f64),
    /// What the thesis reached, where it says.
    pub thesis: Option<f64>,
    /// Whether it is good enough.
    pub passed: bool,
}

impl AccuracyRow {
    fn new(what: impl Into<String>, figure: &'static str, unit: &'static str, value: f64, wanted: (f64, f64)) -> Self {
        // NaN is in no range.
        let passed = (wanted.0..=wanted.1).contains(&value);
        Self { what: what.into(), figure, unit, value, wanted, thesis: None, passed }
    }

    fn thesis(mut self, value: f64) -> Self {
        self.thesis = Some(value);
        self
    }
}

/// How much of each experiment to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// As the issue of the thesis's experiments asks: 640 × 480 where it says so, all pairs.
    Full,
    /// Smaller pictures and fewer pairs: seconds instead of minutes.
    Quick,
}

/// Runs every experiment. `progress` hears how many of how many are done, and which is next.
///
/// # Errors
/// [`SceneError`] where a scene cannot be rendered or measured at all.
pub fn run(extent: Extent, progress: &mut dyn FnMut(usize, usize, &str)) -> Result<Vec<AccuracyRow>, SceneError> {
    const MM: f64 = 1e3;
    let full = extent == Extent::Full;
    let total = 4;
    let mut rows = Vec::new();

    progress(0, total, "plane");
    let pairs = if full { 20 } else { 4 };
    let first_mm = plane(0.092, pairs)?.rmse_m * MM;
    let name = |baseline_cm: f64| format!("plane at 0.5 m, baseline {baseline_cm} cm, 640x480");
    rows.push(AccuracyRow::new(name(9.2), "RMSE", "mm", first_mm, (0.0, 1.0)).thesis(8.8));
    for (baseline_m, thesis_mm) in [(0.12, 10.8), (0.15, 25.2)] {
        let value_mm = plane(baseline_m, pairs)?.rmse_m * MM;
        // No worse than the shortest, give or take what a few pairs scatter.
        let row = AccuracyRow::new(name(baseline_m * 100.0), "RMSE", "mm", value_mm, (0.0, 1.05 * first_mm));
        rows.push(row.thesis(thesis_mm));
    }
    let still = still_water(0.99, if full { 200 } else { 40 }, 12)?;
    let raw_mm = still.h_mean_of_levels_m * MM;
    rows.push(AccuracyRow::new("still water at 0.99 m", "false H_m, pair levels", "mm", raw_mm, (0.0, 0.3)).thesis(2.3));
    // What the thesis could not do: the noise that the chain knows of is no wave.
    rows.push(AccuracyRow::new("still water at 0.99 m", "false H_m, noise told apart", "mm", still.h_mean_m * MM, (0.0, 0.3)));

    progress(1, total, "wave tank");
    let run = if full { TankRun::thesis() } else { TankRun::quick() };
    let errors = TankErrors::of(&tank(&run)?);
    let tank_name = "wave tank, 0.16/0.20/0.30 Hz at 0.99 m";
    rows.push(AccuracyRow::new(tank_name, "mean |error| of H_m", "mm", errors.h_mean_m * MM, (0.0, 0.5)).thesis(4.0));
    rows.push(AccuracyRow::new(tank_name, "mean |error| of H_s", "mm", errors.h_s_m * MM, (0.0, 1.0)).thesis(7.8));
    rows.push(AccuracyRow::new(tank_name, "largest |error| of peak frequency", "Hz", errors.peak_hz, (0.0, 0.01)).thesis(0.02));
    if let Some(r_squared) = errors.r_squared {
        rows.push(AccuracyRow::new(tank_name, "R² of peak amplitude", "1", r_squared, (0.995, 1.0)).thesis(0.93));
    }
    let amplitude_mm = errors.amplitude_m * MM;
    rows.push(AccuracyRow::new(tank_name, "mean |error| of peak amplitude", "mm", amplitude_mm, (0.0, 0.25)));

    progress(2, total, "from the air");
    let (mut h_mean_mm, mut h_s_mm, mut flights) = (0.0, 0.0, 0.0);
    for repetition in 0..if full { 4 } else { 1 } {
        for flight in Flight::all() {
            let errors = fly(&Flight { seed: flight.seed + repetition, ..flight.clone() })?.errors;
            h_mean_mm += errors.h_mean_m.abs() * MM;
            h_s_mm += errors.h_s_m.abs() * MM;
            flights += 1.0;
        }
    }
    let air = "from the air, 58 s at 2 Hz, eight flights";
    rows.push(AccuracyRow::new(air, "mean |error| of H_m", "mm", h_mean_mm / flights, (0.0, 2.0)).thesis(7.5));
    rows.push(AccuracyRow::new(air, "mean |error| of H_s", "mm", h_s_mm / flights, (0.0, 3.0)).thesis(11.6));

    progress(3, total, "stated uncertainty");
    let stated = honesty(if full { 60 } else { 12 })?;
    rows.push(AccuracyRow::new("cell errors within one sigma", "share", "%", 100.0 * stated.within_one, (65.0, 71.0)));
    rows.push(AccuracyRow::new("cell errors within two sigma", "share", "%", 100.0 * stated.within_two, (93.0, 97.0)));
    progress(total, total, "done");
    Ok(rows)
}
