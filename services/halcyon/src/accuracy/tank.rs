//! The thesis's wave tank (5.2.2): regular waves under cameras on a tripod, against a probe; here the probe is the formula.

use std::f64::consts::TAU;

use halcyon_model::SeaState;
use halcyon_sim::sea::SeaConfig;
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use nalgebra::{UnitQuaternion, Vector3};

use super::scene::{Scene, SceneError, chain, measure, start, thesis_rig};
use super::truth::h_mean_and_h_s_m;

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
    /// Mean absolute error of the peak amplitude, metres.
    pub amplitude_m: f64,
    /// Coefficient of determination of measured against true peak amplitudes (figure 5-29), about the line of equality, which is stricter
    /// than a fitted one; `None` where all waves are of one height, and there is nothing to explain.
    pub r_squared: Option<f64>,
}

/// A record of the water's height that came out of pairs, and its wave heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessed {
    /// H_m, metres.
    pub h_mean_m: f64,
    /// H_s, metres.
    pub h_s_m: f64,
    /// H_m of the mean level of each pair, as the thesis took it: plain zero up-crossings, no noise taken out, metres.
    pub h_mean_of_levels_m: f64,
    /// Elevation, metres, with its time in seconds.
    pub trace: Vec<(f64, f64)>,
}

/// One run of the tank: what was made, and what was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct TankRecord {
    /// Frequency of the wave maker, hertz.
    pub frequency_hz: f64,
    /// Its height, crest to trough, metres.
    pub height_m: f64,
    /// By stereo.
    pub stereo: Assessed,
    /// Frequency and amplitude of the sine that explains most of it, hertz and metres.
    pub peak: (f64, f64),
    /// What a perfect probe under the cameras reads, metres, [`PROBE_HZ`] times a second.
    pub probe_m: Vec<f64>,
}

/// Readings of the perfect probe a second.
pub const PROBE_HZ: f64 = 50.0;

/// Runs the tank.
///
/// # Errors
/// [`SceneError`] where nothing comes out.
pub fn tank(run: &TankRun) -> Result<Vec<TankRecord>, SceneError> {
    let mut records = Vec::new();
    for &frequency_hz in &run.frequencies_hz {
        for &height_m in &run.heights_m {
            // The simulator rounds the frequency to a 2⁻²⁴th of a hertz, the height not at all.
            let sea = SeaConfig { depth_m: DEPTH_M, ..SeaConfig::regular(height_m, 1.0 / frequency_hz, 270.0) };
            let mut scene = Scene::new(&thesis_rig(0.092, run.scale), &sea, 0.0035 / run.scale, 21)?;
            let stereo = assess(&mut scene, HEIGHT_M, run.pairs)?;
            let readings = (run.pairs as f64 / RATE_HZ * PROBE_HZ) as usize;
            let probe = |i: usize| scene.water.elevation_m(0.0, 0.0, start().plus_secs_f64(i as f64 / PROBE_HZ));
            let probe_m = (0..readings).map(probe).collect();
            records.push(TankRecord { frequency_hz, height_m, peak: peak(&stereo.trace), stereo, probe_m });
        }
    }
    Ok(records)
}

impl TankErrors {
    /// Of several runs together.
    #[must_use]
    pub fn of(records: &[TankRecord]) -> Self {
        let count = records.len().max(1) as f64;
        let mean = |error: &dyn Fn(&TankRecord) -> f64| records.iter().map(error).sum::<f64>() / count;
        let peak_hz = records.iter().map(|record| (record.peak.0 - record.frequency_hz).abs()).fold(0.0, f64::max);
        let truth = |record: &TankRecord| 0.5 * record.height_m;
        let middle = mean(&truth);
        let spread = mean(&|record| (truth(record) - middle).powi(2));
        let residual = mean(&|record| (truth(record) - record.peak.1).powi(2));
        Self {
            h_mean_m: mean(&|record| (record.stereo.h_mean_m - record.height_m).abs()),
            h_s_m: mean(&|record| (record.stereo.h_s_m - record.height_m).abs()),
            peak_hz,
            amplitude_m: mean(&|record| (truth(record) - record.peak.1).abs()),
            r_squared: (spread > 0.0).then(|| 1.0 - residual / spread),
        }
    }
}

/// `pairs` pairs of a rig on a tripod, `height_m` above the water and not quite level, through chain and assessment.
pub(super) fn assess(scene: &mut Scene, height_m: f64, pairs: usize) -> Result<Assessed, SceneError> {
    let config = Config { fixed_rig: true, window_s: 3600.0, ..Config::default() };
    let mut assessor = Assessor::new(config).map_err(|_| SceneError::NoResult("the rig's name is not valid"))?;
    let mut chain = chain(0.04, true);
    let leaning = UnitQuaternion::from_euler_angles(0.02, -0.03, 0.2);
    let (mut last, mut levels_m) = (None, Vec::with_capacity(pairs));
    for i in 0..pairs {
        let t_s = i as f64 / RATE_HZ;
        let pair = scene.pair(t_s, Vector3::new(0.0, 0.0, -height_m), &leaning, None)?;
        let patch = measure(&mut chain, &pair)?;
        levels_m.extend(patch.level_m);
        last = assessor.observe(&patch, start().plus_secs_f64(t_s)).ok().flatten().or(last);
    }
    let state = last.ok_or(SceneError::NoResult("no sea state came out"))?;
    let heights_m = |levels_m: &[f64]| Some(h_mean_and_h_s_m(&[levels_m.to_vec()])).filter(|heights| heights.0.is_finite());
    match (state.h_mean_m, state.h_s_m) {
        (Some(h_mean_m), Some(h_s_m)) => {
            let h_mean_of_levels_m = heights_m(&levels_m).map_or(f64::NAN, |(h_mean_m, _)| h_mean_m);
            Ok(Assessed { h_mean_m: h_mean_m.value, h_s_m: h_s_m.value, h_mean_of_levels_m, trace: trace_of(&state) })
        }
        _ => Err(SceneError::NoResult("the sea state has no wave heights")),
    }
}

/// A sea state's record: seconds after the first pair, and metres.
pub(super) fn trace_of(state: &SeaState) -> Vec<(f64, f64)> {
    state.trace.iter().map(|point| (point.stamp.seconds_since(start()), point.elevation_m)).collect()
}

/// Frequency and amplitude of the sine that explains most of a record (seconds, metres): least squares at each of a fine row of
/// frequencies, so that neither the record's length nor its rate rounds the answer.
fn peak(samples: &[(f64, f64)]) -> (f64, f64) {
    let amplitude_m = |frequency_hz: f64| {
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (t_s, elevation_m) in samples {
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
