//! The thesis's wave tank (5.2.2): regular waves under cameras on a tripod, against a probe; here the probe is the formula.

use std::f64::consts::TAU;

use halcyon_model::SeaState;
use halcyon_sim::sea::SeaConfig;
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use nalgebra::{UnitQuaternion, Vector3};

use super::scene::{Scene, SceneError, chain, measure, start, thesis_rig};

/// Cameras above the water, metres.
const HEIGHT_M: f64 = 0.99;
/// Pairs a second: the thesis took 0.28 s for one.
const RATE_HZ: f64 = 3.5;
/// Depth of its flume, metres.
const DEPTH_M: f64 = 0.6;

/// What to run.
#[derive(Debug, Clone, PartialEq)]
pub struct TankRun {
    /// Frequencies of the wave maker, hertz.
    pub frequencies_hz: Vec<f64>,
    /// Crest to trough, metres.
    pub heights_m: Vec<f64>,
    /// Pairs of each.
    pub pairs: usize,
    /// 1 is 640 × 480.
    pub scale: f64,
}

impl TankRun {
    /// 0.16, 0.20 and 0.30 Hz, three heights each, 200 pairs of 640 × 480.
    #[must_use]
    pub fn thesis() -> Self {
        Self { frequencies_hz: vec![0.16, 0.20, 0.30], heights_m: vec![0.02, 0.04, 0.06], pairs: 200, scale: 1.0 }
    }

    /// One height each, 320 × 240, as the thesis ran it in the end.
    #[must_use]
    pub fn quick() -> Self {
        Self { heights_m: vec![0.04], scale: 0.5, ..Self::thesis() }
    }
}

/// How far off the measurements are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TankErrors {
    /// Mean absolute error of H_m, metres.
    pub h_mean_m: f64,
    /// Mean absolute error of H_s, metres.
    pub h_s_m: f64,
    /// Largest absolute error of the peak frequency, hertz.
    pub peak_hz: f64,
    /// Coefficient of determination of measured against true peak amplitudes (figure 5-29), about the line of equality.
    pub r_squared: f64,
}

/// What came out of one run.
pub(super) struct Assessed {
    pub h_mean_m: f64,
    pub h_s_m: f64,
    pub state: SeaState,
}

/// Runs the tank.
///
/// # Errors
/// [`SceneError`] where nothing comes out.
pub fn tank(run: &TankRun) -> Result<TankErrors, SceneError> {
    let (mut h_mean_m, mut h_s_m, mut peak_hz, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
    let mut amplitudes = Vec::new();
    for &frequency_hz in &run.frequencies_hz {
        for &height_m in &run.heights_m {
            let sea = SeaConfig { depth_m: DEPTH_M, ..SeaConfig::regular(height_m, 1.0 / frequency_hz, 270.0) };
            let mut scene = Scene::new(&thesis_rig(0.092, run.scale), &sea, 0.0035 / run.scale, 21)?;
            let measured = assess(&mut scene, run.pairs)?;
            let (found_hz, amplitude_m) = peak(&measured.state);
            // The wave maker's frequency is rounded by the simulator to a 2⁻²⁴th of a hertz, its height not at all.
            h_mean_m += (measured.h_mean_m - height_m).abs();
            h_s_m += (measured.h_s_m - height_m).abs();
            peak_hz = peak_hz.max((found_hz - frequency_hz).abs());
            amplitudes.push((0.5 * height_m, amplitude_m));
            count += 1.0;
        }
    }
    let mean = amplitudes.iter().map(|(truth, _)| truth).sum::<f64>() / count;
    let spread: f64 = amplitudes.iter().map(|(truth, _)| (truth - mean).powi(2)).sum();
    let residual: f64 = amplitudes.iter().map(|(truth, found)| (truth - found).powi(2)).sum();
    // With one height there is no spread to explain; then against the amplitudes themselves.
    let total = if spread > 0.0 { spread } else { amplitudes.iter().map(|(truth, _)| truth * truth).sum() };
    Ok(TankErrors { h_mean_m: h_mean_m / count, h_s_m: h_s_m / count, peak_hz, r_squared: 1.0 - residual / total })
}

/// `pairs` pairs of a rig on a tripod, not quite level, through chain and assessment.
pub(super) fn assess(scene: &mut Scene, pairs: usize) -> Result<Assessed, SceneError> {
    let config = Config { fixed_rig: true, window_s: 3600.0, ..Config::default() };
    let mut assessor = Assessor::new(config).map_err(|_| SceneError::NoResult("the rig's name is not valid"))?;
    let mut chain = chain(0.04, true);
    let leaning = UnitQuaternion::from_euler_angles(0.02, -0.03, 0.2);
    let mut last = None;
    for i in 0..pairs {
        let t_s = i as f64 / RATE_HZ;
        let pair = scene.pair(t_s, Vector3::new(0.0, 0.0, -HEIGHT_M), &leaning, None)?;
        let patch = measure(&mut chain, &pair)?;
        last = assessor.observe(&patch, start().plus_secs_f64(t_s)).ok().flatten().or(last);
    }
    let state = last.ok_or(SceneError::NoResult("no sea state came out"))?;
    match (state.h_mean_m, state.h_s_m) {
        (Some(h_mean_m), Some(h_s_m)) => Ok(Assessed { h_mean_m: h_mean_m.value, h_s_m: h_s_m.value, state }),
        _ => Err(SceneError::NoResult("the sea state has no wave heights")),
    }
}

/// Frequency and amplitude of the sine that explains most of the trace: least squares at each of a fine row of frequencies, so
/// that neither the record's length nor its rate rounds the answer.
pub(super) fn peak(state: &SeaState) -> (f64, f64) {
    let samples: Vec<(f64, f64)> =
        state.trace.iter().map(|point| (point.stamp.seconds_since(start()), point.elevation_m)).collect();
    let amplitude_m = |frequency_hz: f64| {
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (t_s, elevation_m) in &samples {
            let (sin, cos) = (TAU * frequency_hz * t_s).sin_cos();
            let row = Vector3::new(sin, cos, 1.0);
            normal += row * row.transpose();
            right += row * *elevation_m;
        }
        normal.cholesky().map_or(0.0, |factor| factor.solve(&right).xy().norm())
    };
    let steps = (1..=3000).map(|step| f64::from(step) * 5e-4).filter(|hz| (0.05..0.5 * RATE_HZ).contains(hz));
    steps.map(|hz| (hz, amplitude_m(hz))).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((f64::NAN, f64::NAN))
}
