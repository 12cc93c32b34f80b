//! One sea and what was said of it; many of them, counted.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use halcyon_model::{Estimate, IdError, RigId, SeaState, VerdictState};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::film::Camera;
use super::sea::{Sea, System, Truth};
use crate::config::{AirframeConfig, Config};
use crate::core::Assessor;

/// A film's length, seconds.
const FILM_S: f64 = 60.0;

/// What runs under the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Water {
    /// One wind sea.
    WindSea,
    /// A wind sea of two thirds of the energy, and a swell of 2.5 to 4 s across it.
    SwellAndSea,
    /// A narrow swell from one direction.
    NarrowSwell,
}

/// What seas are drawn from, and how they are seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// In words.
    pub name: &'static str,
    /// The kind of sea.
    pub water: Water,
    /// Peak periods, seconds, each as likely.
    pub t_p_s: (f64, f64),
    /// Errors of cells and levels over the usual 1 to 5 mm and 2 to 5 mm.
    pub noise: f64,
    /// The largest shares of frames and of cells that are missing.
    pub lost: (f64, f64),
    /// North and east sides of the patch, metres.
    pub patch_m: (f64, f64),
    /// Profile of what has to land.
    pub airframe: &'static str,
}

/// Short wind waves under the default rig, 1 to 5 mm of noise, up to a tenth of the frames and a fifth of the cells missing.
const USUAL: Conditions = Conditions {
    name: "wind sea of 1 to 1.5 s",
    water: Water::WindSea,
    t_p_s: (1.0, 1.5),
    noise: 1.0,
    lost: (0.1, 0.2),
    patch_m: (3.25, 4.25),
    airframe: "small",
};

/// The seas that numbers are stated for, and others.
pub const CONDITIONS: [Conditions; 12] = [
    USUAL,
    Conditions { name: "wind sea of 0.8 to 1 s", t_p_s: (0.8, 1.0), ..USUAL },
    Conditions { name: "wind sea of 1.5 to 2.5 s", t_p_s: (1.5, 2.5), ..USUAL },
    Conditions { name: "wind sea of 2.5 to 4 s", t_p_s: (2.5, 4.0), ..USUAL },
    Conditions { name: "swell and sea", water: Water::SwellAndSea, ..USUAL },
    Conditions { name: "narrow swell of 1.5 to 2.5 s", water: Water::NarrowSwell, t_p_s: (1.5, 2.5), ..USUAL },
    Conditions { name: "twice the noise", noise: 2.0, ..USUAL },
    Conditions { name: "30 % of the frames missing", lost: (0.3, 0.3), ..USUAL },
    Conditions { name: "patch of 1 m", patch_m: (1.0, 1.0), ..USUAL },
    Conditions { name: "patch of 6 m", patch_m: (6.0, 6.0), ..USUAL },
    Conditions { name: "medium airframe", airframe: "medium", ..USUAL },
    Conditions { name: "large airframe", airframe: "large", ..USUAL },
];

/// One sea, and what was said of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// The quantity that comes nearest to its limit, over that limit: water over 1 is not fit to land on.
    pub severity: f64,
    /// The verdict at the end.
    pub state: VerdictState,
    /// When it was first called safe, seconds after the first patch.
    pub safe_s: Option<f64>,
    /// That every quantity is under its limit, as stated at the end.
    pub probability: f64,
    /// 4 √m0, the mean of the highest tenth and the slope as measured, and their lower and upper bounds, over the true ones.
    pub measured: [[f64; 3]; 3],
    /// Checks that did not pass at the end.
    pub failed: Vec<String>,
}

impl Conditions {
    fn sea(&self, t_p_s: f64, random: &mut ChaCha8Rng) -> Sea {
        let main = System::wind_sea(1.0, t_p_s);
        Sea(match self.water {
            Water::WindSea => vec![main],
            Water::NarrowSwell => vec![System { peakedness: 10.0, spread: 50.0, ..main }],
            Water::SwellAndSea => {
                let swell = System {
                    h_m0_m: 0.5_f64.sqrt(),
                    t_p_s: random.random_range(2.5..4.0),
                    peakedness: 7.0,
                    spread: 30.0,
                    towards_rad: main.towards_rad + PI * random.random_range(0.2..0.6),
                };
                vec![main, swell]
            }
        })
    }

    fn camera(&self, random: &mut ChaCha8Rng) -> Camera {
        let (north_m, east_m) = self.patch_m;
        // Small patches come from low flight, and have finer cells.
        let cell_m = if north_m < 2.0 { 0.08 } else { 0.25 };
        let cells = |side_m: f64| (side_m / cell_m).round() as u32 + 1;
        Camera {
            rows: cells(north_m),
            cols: cells(east_m),
            cell_m,
            sigma_m: self.noise * random.random_range(0.001..0.005),
            level_sigma_m: self.noise * random.random_range(0.002..0.005),
            frames_lost: random.random_range(0.0..=self.lost.0),
            cells_lost: random.random_range(0.0..=self.lost.1),
            ..Camera::default()
        }
    }
}

/// Draws the sea of `seed`, of so much severity, films it for a minute and asks once a second.
///
/// # Errors
/// [`IdError`] if the default configuration's rig were none.
pub fn draw(conditions: &Conditions, seed: u64, severity: f64) -> Result<Drawn, IdError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let airframe = AirframeConfig { profile: conditions.airframe.into(), ..AirframeConfig::default() };
    let config = Config { airframe, ..Config::default() };
    let t_p_s = random.random_range(conditions.t_p_s.0..=conditions.t_p_s.1);
    let sea = conditions.sea(t_p_s, &mut random);
    let camera = conditions.camera(&mut random);
    let unit = Truth::of(&sea, config.slope_baseline_m);
    let scale = unit.scale_of_severity(severity, &config);
    let truth = unit.scaled(scale);
    let count = (FILM_S * camera.rate_hz) as usize + 1;
    let film = camera.film(&sea.scaled(scale), count, &RigId::new(&config.rig)?, random.random());
    let mut assessor = Assessor::new(config)?;
    let mut drawn = Drawn {
        severity,
        state: VerdictState::Inconclusive,
        safe_s: None,
        probability: 0.0,
        measured: [[f64::NAN; 3]; 3],
        failed: Vec::new(),
    };
    let mut last: Option<SeaState> = None;
    for patch in &film {
        // A patch that is refused tells nothing.
        let Ok(Some(state)) = assessor.observe(patch, patch.stamp) else { continue };
        if state.verdict.state == VerdictState::Safe {
            drawn.safe_s.get_or_insert(patch.stamp.seconds_since(film[0].stamp));
        }
        last = Some(state);
    }
    if let Some(last) = last {
        let over = |estimate: Option<Estimate>, truth: f64| {
            estimate.map_or([f64::NAN; 3], |e| [e.value, e.low, e.high]).map(|x| x / truth)
        };
        drawn.measured = [
            over(last.h_m0_m, 4.0 * truth.sigma_m),
            over(last.h_tenth_m, truth.h_tenth_m()),
            over(last.slope_rms_rad, truth.slope_rms),
        ];
        drawn.state = last.verdict.state;
        drawn.probability = last.verdict.probability.unwrap_or(0.0);
        drawn.failed = last.verdict.reasons.into_iter().filter(|reason| !reason.passed).map(|reason| reason.check).collect();
    }
    Ok(drawn)
}

/// Many seas, counted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// All.
    pub seas: usize,
    /// Called safe at the end though they are not.
    pub wrong: usize,
    /// Called so at any time.
    pub wrong_ever: usize,
    /// Called unsafe at the end though they are safe.
    pub unfounded: usize,
    /// Called safe at the end.
    pub safe: usize,
    /// Called safe at any time.
    pub safe_ever: usize,
    /// Checks that did not pass at the end, and how often.
    pub failed: BTreeMap<String, usize>,
    squares: f64,
    /// Seas, probabilities and seas under the limits, by tenths of the stated probability.
    reliability: [[f64; 3]; 10],
}

impl Tally {
    /// Counts one sea.
    pub fn add(&mut self, drawn: &Drawn) {
        let is_fit = drawn.severity < 1.0;
        let is = |state| drawn.state == state;
        self.seas += 1;
        self.wrong += usize::from(!is_fit && is(VerdictState::Safe));
        self.wrong_ever += usize::from(!is_fit && drawn.safe_s.is_some());
        self.unfounded += usize::from(is_fit && is(VerdictState::Unsafe));
        self.safe += usize::from(is(VerdictState::Safe));
        self.safe_ever += usize::from(drawn.safe_s.is_some());
        for check in &drawn.failed {
            *self.failed.entry(check.clone()).or_default() += 1;
        }
        let truth = f64::from(u8::from(is_fit));
        self.squares += (drawn.probability - truth).powi(2);
        if let Some(bin) = self.reliability.get_mut(((10.0 * drawn.probability) as usize).min(9)) {
            *bin = [bin[0] + 1.0, bin[1] + drawn.probability, bin[2] + truth];
        }
    }

    /// Mean square difference between the stated probability and what is so: 0.25 for one who always says a half. NaN without seas.
    #[must_use]
    pub fn brier(&self) -> f64 {
        self.squares / self.seas as f64
    }

    /// Seas, their mean stated probability and the share of them under the limits, by tenths of the stated probability; tenths without seas
    /// are left out.
    #[must_use]
    pub fn reliability(&self) -> Vec<[f64; 3]> {
        let with_seas = self.reliability.iter().filter(|[seas, ..]| *seas > 0.0);
        with_seas.map(|[seas, probability, fit]| [*seas, probability / seas, fit / seas]).collect()
    }
}

/// Severities of as many seas as there are numbers, spread evenly from 0.6 to 1.4.
#[must_use]
pub fn severity_of(number: u64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    0.6 + 0.8 * (number as f64 * GOLDEN).fract()
}
