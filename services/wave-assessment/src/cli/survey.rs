//! What `halcyon survey` makes of the patches of a folder: the sea state of all of them.

use halcyon_model::{Estimate, IdError, RigId, SeaState, Stamp, SurfacePatch};
use halcyon_ocean::Taper;
use halcyon_ocean::quality::RawSeries;
use serde::Serialize;

use super::verdict::{ReasonReport, VerdictReport};
use super::witness::{Witness, WitnessReport};
use super::{Burst, WavesError, analyse};
use crate::config::Config;
use crate::core::Assessor;

/// Why a survey has no sea state.
#[derive(Debug, thiserror::Error)]
pub enum SurveyError {
    /// The configured rig.
    #[error(transparent)]
    Rig(#[from] IdError),
    /// The witness's file.
    #[error(transparent)]
    Witness(#[from] WavesError),
    /// No patch was good.
    #[error("no patch can be used{}", why.as_ref().map_or_else(String::new, |why| format!("; the first: {why}")))]
    NoPatch {
        /// What was wrong with the first.
        why: Option<String>,
    },
}

/// Patches in, in the order of their stamps; a sea state out.
#[derive(Debug)]
pub struct Survey {
    assessor: Assessor,
    newest: Option<Stamp>,
    refused: usize,
    first_refusal: Option<String>,
}

/// The sea state of a survey, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeaReport {
    /// Patches that it rests on.
    pub patches: u32,
    /// Patches that were refused: out of order, twice, damaged.
    pub refused: usize,
    /// Start of the window, seconds of the survey's stamps.
    pub window_start_s: f64,
    /// Length of the window, seconds.
    pub window_s: f64,
    /// Mean coverage of the patches, 0 to 1.
    pub coverage: f64,
    /// Waves at all gauges together.
    pub waves: u32,
    /// H_m, H_s, H_max, H_m0, T_z and slope, each with its 95 % interval.
    #[serde(flatten)]
    pub heights: Heights,
    /// Where the waves come from; absent where the patches do not tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<DirectionReport>,
    /// Quality tests that did not pass.
    pub quality: Vec<ComplaintReport>,
    /// The elevation at the middle of the patches, as `halcyon waves` has it; absent where it is too short.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre: Option<Burst>,
    /// What a second witness says of the elevation at the middle, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub witness: Option<WitnessReport>,
    /// What follows.
    pub verdict: VerdictReport,
}

macro_rules! estimates {
    ($($(#[$doc:meta])* $value:ident, $low:ident, $high:ident;)*) => {
        /// Numbers with their 95 % intervals; absent where unknown.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
        pub struct Heights {
            $(
                $(#[$doc])*
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $value: Option<f64>,
                /// Its lower bound.
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $low: Option<f64>,
                /// Its upper bound.
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $high: Option<f64>,
            )*
        }

        impl Heights {
            fn of(sea: &SeaState) -> Self {
                let part = |estimate: Option<Estimate>, pick: fn(&Estimate) -> f64| estimate.as_ref().map(pick);
                Self {
                    $(
                        $value: part(sea.$value, |e| e.value),
                        $low: part(sea.$value, |e| e.low),
                        $high: part(sea.$value, |e| e.high),
                    )*
                }
            }
        }
    };
}

estimates! {
    /// Mean wave height, metres.
    h_mean_m, h_mean_m_low, h_mean_m_high;
    /// Significant wave height, metres.
    h_s_m, h_s_m_low, h_s_m_high;
    /// Highest wave, metres.
    h_max_m, h_max_m_low, h_max_m_high;
    /// 4 √m0, metres.
    h_m0_m, h_m0_m_low, h_m0_m_high;
    /// Mean period, seconds.
    t_z_s, t_z_s_low, t_z_s_high;
    /// Root mean square slope, radians.
    slope_rms_rad, slope_rms_rad_low, slope_rms_rad_high;
    /// Root mean square wave height, metres.
    h_rms_m, h_rms_m_low, h_rms_m_high;
    /// Mean of the highest tenth, metres.
    h_tenth_m, h_tenth_m_low, h_tenth_m_high;
    /// Peak period, seconds.
    t_p_s, t_p_s_low, t_p_s_high;
    /// m0/m1, seconds.
    t_m01_s, t_m01_s_low, t_m01_s_high;
    /// √(m0/m2), seconds.
    t_m02_s, t_m02_s_low, t_m02_s_high;
    /// m₋₁/m0, seconds.
    t_e_s, t_e_s_low, t_e_s_high;
    /// Root mean square vertical speed of the surface, metres per second.
    vertical_speed_rms_mps, vertical_speed_rms_mps_low, vertical_speed_rms_mps_high;
}

/// Direction and length of the waves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DirectionReport {
    /// Where they come from, degrees clockwise from true north (from the survey's own north, where the rig has no heading).
    pub from_deg: f64,
    /// 95 % of it: so much to either side, degrees.
    pub from_error_deg: f64,
    /// Circular spread, degrees.
    pub spread_deg: f64,
    /// Length at the peak, metres.
    pub wavelength_peak_m: f64,
}

/// A quality test that did not pass.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComplaintReport {
    /// Its name.
    pub test: String,
    /// Failed, and not only suspect.
    pub failed: bool,
    /// In words.
    pub reason: String,
}

impl Survey {
    /// Judges by `config`, over `window_s` seconds (all of it: the survey's length) of the rig that patches name; `fixed_rig` where no
    /// pair has a pose.
    ///
    /// # Errors
    /// [`SurveyError::Rig`], which a rig that has patches cannot cause.
    pub fn new(config: &Config, rig: &RigId, window_s: f64, fixed_rig: bool) -> Result<Self, SurveyError> {
        // Sea states on the way are of no use: one at the end is.
        let config = Config { rig: rig.to_string(), fixed_rig, window_s, period_s: f64::INFINITY, ..config.clone() };
        Ok(Self { assessor: Assessor::new(config)?, newest: None, refused: 0, first_refusal: None })
    }

    /// Takes in a patch; one that cannot be used is counted.
    pub fn observe(&mut self, patch: &SurfacePatch) {
        match self.assessor.observe(patch, patch.stamp) {
            Ok(_) => self.newest = self.newest.max(Some(patch.stamp)),
            Err(error) => {
                self.refused += 1;
                self.first_refusal.get_or_insert_with(|| error.to_string());
            }
        }
    }

    /// What all of them say.
    ///
    /// # Errors
    /// [`SurveyError::NoPatch`], or the witness's file
    pub fn report(mut self, segment_s: f64, witness: Option<&Witness>) -> Result<SeaReport, SurveyError> {
        let sea = self.newest.and_then(|newest| self.assessor.conclude(newest));
        let Some(sea) = sea else { return Err(SurveyError::NoPatch { why: self.first_refusal }) };
        let seconds = |stamp: Stamp| stamp.as_nanos() as f64 * 1e-9;
        let (stamp_s, elevation_m): (Vec<f64>, Vec<f64>) =
            sea.trace.iter().map(|point| (seconds(point.stamp), point.elevation_m)).unzip();
        let centre =
            analyse(RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m }, segment_s, Taper::Hann, (0.05, f64::INFINITY))
                .ok();
        let reasons = sea.verdict.reasons.iter().map(|reason| ReasonReport {
            check: reason.check.clone(),
            passed: reason.passed,
            text: reason.text.clone(),
        });
        let trace = RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m };
        let witness = witness.map(|witness| WitnessReport::of(trace, witness, (0.05, f64::MAX))).transpose()?;
        let mut verdict = VerdictReport {
            state: sea.verdict.state.as_str(),
            probability: sea.verdict.probability,
            reasons: reasons.collect(),
            judged_from_s: seconds(sea.window_start),
            judged_s: sea.window_s,
            valid_until: seconds(sea.verdict.valid_until),
        };
        if let Some(witness) = &witness {
            witness.weigh(&mut verdict);
        }
        Ok(SeaReport {
            patches: sea.patches,
            refused: self.refused,
            window_start_s: seconds(sea.window_start),
            window_s: sea.window_s,
            coverage: sea.coverage,
            waves: sea.waves,
            heights: Heights::of(&sea),
            direction: sea.directional.map(|found| DirectionReport {
                from_deg: found.from_rad.value.to_degrees().rem_euclid(360.0),
                from_error_deg: (found.from_rad.high - found.from_rad.value).to_degrees(),
                spread_deg: found.spread_rad.to_degrees(),
                wavelength_peak_m: found.wavelength_peak_m,
            }),
            quality: sea
                .quality
                .iter()
                .map(|flag| ComplaintReport { test: flag.test.clone(), failed: flag.failed, reason: flag.text.clone() })
                .collect(),
            centre,
            witness,
            verdict,
        })
    }
}
