//! From the air (thesis chapter 7, tables 7-1 and 7-2): a hovering carrier with an ordinary autopilot's errors.

use halcyon_model::{PoseAtExposure, StereoPair, SurfacePatch};
use halcyon_ocean::Record;
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::scene::{Scene, SceneError, chain, measure, rig_id, start, thesis_rig};
use super::tank::trace_of;
use super::truth::h_mean_and_h_s_m;

/// What an autopilot gets wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Autopilot {
    /// Roll and pitch, one standard deviation, radians, anew with every pair.
    pub attitude_sigma_rad: f64,
    /// Height, one standard deviation, metres, anew with every pair.
    pub height_sigma_m: f64,
    /// How far its height drifts to either side in a minute, metres.
    pub drift_m: f64,
}

impl Autopilot {
    /// 0.2°, 1 cm, and 5 cm of drift.
    pub const ORDINARY: Self = Self { attitude_sigma_rad: 0.003_49, height_sigma_m: 0.01, drift_m: 0.05 };
}

/// One flight over one sea.
#[derive(Debug, Clone, PartialEq)]
pub struct Flight {
    /// For reports.
    pub name: &'static str,
    /// The cameras.
    pub rig: RigConfig,
    /// Height of the hover, metres.
    pub height_m: f64,
    /// Cells of the grid, metres.
    pub cell_m: f64,
    /// Grain of the water's texture, metres.
    pub grain_m: f64,
    /// The water.
    pub sea: SeaConfig,
    /// The autopilot.
    pub autopilot: Autopilot,
    /// How long, seconds.
    pub duration_s: f64,
    /// Pairs a second.
    pub rate_hz: f64,
    /// For water, wind and errors.
    pub seed: u64,
}

impl Flight {
    /// The flights that `halcyon bench --accuracy` runs: the thesis's rig low over a calm lake, and the default rig from 5 m.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let low = |name, sea| Self {
            name,
            rig: thesis_rig(0.092, 0.5),
            height_m: 0.9,
            cell_m: 0.04,
            grain_m: 0.006,
            sea,
            autopilot: Autopilot::ORDINARY,
            duration_s: 58.0,
            rate_hz: 2.0,
            seed: 31,
        };
        let high =
            |name, sea| Self { rig: RigConfig::default(), height_m: 5.0, cell_m: 0.15, grain_m: 0.028, ..low(name, sea) };
        vec![
            low("from 0.9 m, still", SeaConfig::still()),
            low("from 0.9 m, H_s 1 cm, T_p 1.2 s", SeaConfig::jonswap(0.01, 1.2, 200.0)),
            low("from 0.9 m, 2 cm regular, 2 s", SeaConfig::regular(0.02, 2.0, 250.0)),
            low("from 0.9 m, H_s 3 cm, T_p 2 s", SeaConfig::jonswap(0.03, 2.0, 30.0)),
            high("from 5 m, still", SeaConfig::still()),
            high("from 5 m, H_s 1 cm, T_p 1.6 s", SeaConfig::jonswap(0.01, 1.6, 240.0)),
            high("from 5 m, H_s 5 cm, T_p 2 s", SeaConfig::jonswap(0.05, 2.0, 240.0)),
            high("from 5 m, H_s 10 cm, T_p 3 s", SeaConfig::jonswap(0.10, 3.0, 100.0)),
        ]
    }
}

/// Measured minus true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirErrors {
    /// True H_m of the water under the cameras, metres.
    pub true_h_mean_m: f64,
    /// True H_s of it, metres.
    pub true_h_s_m: f64,
    /// Error of H_m, metres.
    pub h_mean_m: f64,
    /// Error of H_s, metres.
    pub h_s_m: f64,
    /// Whether the stated 95 % interval of H_s holds the truth.
    pub h_s_held: bool,
    /// H_s by the thesis's correction (7-1) alone, minus the truth, metres.
    pub thesis_h_s_m: f64,
    /// The same by the full rotation of every point, metres.
    pub rotated_h_s_m: f64,
}

/// What a flight brought home.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Measured minus true.
    pub errors: AirErrors,
    /// The thesis's series: each pair's mean level by (7-1), metres, with its time in seconds (figure 7-7).
    pub levels_thesis: Vec<(f64, f64)>,
    /// Halcyon's: elevation with the autopilot's wander told from the waves (figure 7-8).
    pub trace: Vec<(f64, f64)>,
    /// The last pair and its patch (figure 7-6).
    pub last: (StereoPair, SurfacePatch),
}

/// Flies and measures.
///
/// # Errors
/// [`SceneError`] where nothing comes out.
pub fn fly(flight: &Flight) -> Result<Flown, SceneError> {
    let mut scene = Scene::new(&flight.rig, &flight.sea, flight.grain_m, flight.seed)?;
    let mut random = ChaCha8Rng::seed_from_u64(flight.seed ^ 0xa1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let config = Config { rig: rig_id().to_string(), ..Config::default() };
    let mut assessor = Assessor::new(config).map_err(|_| SceneError::NoResult("the rig's name is not valid"))?;
    let mut chain = chain(flight.cell_m, false);
    let mut patches: Vec<SurfacePatch> = Vec::new();
    let (mut last, mut last_pair) = (None, None);
    let Autopilot { attitude_sigma_rad, height_sigma_m, drift_m } = flight.autopilot;
    for i in 0..(flight.duration_s * flight.rate_hz) as usize {
        let t_s = i as f64 / flight.rate_hz;
        let slow = |period_s: f64, phase: f64| (std::f64::consts::TAU * t_s / period_s + phase).sin();
        // A hover in light wind: decimetres and a degree or two.
        let at_m = Vector3::new(
            0.15 * slow(11.0, 0.3),
            0.12 * slow(7.3, 1.1),
            -flight.height_m - 0.04 * flight.height_m * slow(5.1, 2.0),
        );
        let (roll, pitch) = (0.02 * slow(3.7, 0.0) + 0.01, 0.025 * slow(4.9, 1.0) - 0.015);
        let attitude = UnitQuaternion::from_euler_angles(roll, pitch, 0.6);
        let believed =
            UnitQuaternion::from_euler_angles(roll + attitude_sigma_rad * normal(), pitch + attitude_sigma_rad * normal(), 0.6);
        let height_error_m = height_sigma_m * normal() + drift_m * slow(67.0, 0.5) + 0.3 * drift_m * slow(23.0, 1.0);
        let pose = PoseAtExposure {
            position_ned_m: at_m - Vector3::z() * height_error_m,
            ned_from_body: believed,
            height_sigma_m,
            attitude_sigma_rad,
        };
        let pair = scene.pair(t_s, at_m, &attitude, Some(pose))?;
        let patch = measure(&mut chain, &pair)?;
        last = assessor.observe(&patch, pair.stamp).ok().flatten().or(last);
        patches.push(patch);
        last_pair = Some(pair);
    }
    let state = last.ok_or(SceneError::NoResult("no sea state came out"))?;
    let trace = trace_of(&state);
    let levels_thesis =
        patches.iter().filter_map(|patch| Some((patch.stamp.seconds_since(start()), patch.level_thesis_m?))).collect();
    let (Some(h_mean_m), Some(h_s_m)) = (state.h_mean_m, state.h_s_m) else {
        return Err(SceneError::NoResult("the sea state has no wave heights"));
    };
    let (true_h_mean_m, true_h_s_m) = true_heights(&scene, flight);
    // As the thesis did it: one number for each pair, the patch's mean level, and no more. A straight line is taken out, which the
    // thesis did not: about a mean alone a drift of centimetres crosses but once, and has no waves at all.
    let by_level = |level: fn(&SurfacePatch) -> Option<f64>| {
        let levels: Vec<f64> = patches.iter().filter_map(level).collect();
        let record = Record::new(levels, flight.rate_hz).map(Record::without_trend);
        record.map_or(f64::NAN, |record| h_mean_and_h_s_m(&[record.samples_m().to_vec()]).1)
    };
    let errors = AirErrors {
        true_h_mean_m,
        true_h_s_m,
        h_mean_m: h_mean_m.value - true_h_mean_m,
        h_s_m: h_s_m.value - true_h_s_m,
        h_s_held: (h_s_m.low..=h_s_m.high).contains(&true_h_s_m),
        thesis_h_s_m: by_level(|patch| patch.level_thesis_m) - true_h_s_m,
        rotated_h_s_m: by_level(|patch| patch.level_m) - true_h_s_m,
    };
    let last = last_pair.zip(patches.pop()).ok_or(SceneError::NoResult("the flight has no pair"))?;
    Ok(Flown { errors, levels_thesis, trace, last })
}

/// H_m and H_s of the water at nine places under the cameras, sampled so densely that no crest is missed.
fn true_heights(scene: &Scene, flight: &Flight) -> (f64, f64) {
    const DENSE_HZ: f64 = 40.0;
    if scene.water.components().is_empty() {
        return (0.0, 0.0);
    }
    let quarter_m = 0.25 * flight.height_m * (0.5 * flight.rig.horizontal_fov_deg.to_radians()).tan() * 2.0;
    let places: Vec<Vec<f64>> = (0..9)
        .map(|i| {
            let (north_m, east_m) = (quarter_m * 0.75 * f64::from(i / 3 - 1), quarter_m * f64::from(i % 3 - 1));
            (0..(flight.duration_s * DENSE_HZ) as usize)
                .map(|k| scene.water.elevation_m(north_m, east_m, start().plus_secs_f64(k as f64 / DENSE_HZ)))
                .collect()
        })
        .collect();
    h_mean_and_h_s_m(&places)
}
