//! Sea states and verdicts as JSON.

use halcyon_model as model;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Edge, Point, rfc3339};

/// A measured number with its 95 % confidence interval, in the unit of its key.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Estimate {
    /// Best estimate.
    pub value: f64,
    /// Lower 95 % bound.
    pub low: f64,
    /// Upper 95 % bound.
    pub high: f64,
}

impl From<model::Estimate> for Estimate {
    fn from(estimate: model::Estimate) -> Self {
        Self { value: estimate.value, low: estimate.low, high: estimate.high }
    }
}

/// Whether the water is fit to land on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerdictState {
    /// Every upper bound is under its limit.
    Safe,
    /// Over a limit.
    Unsafe,
    /// Not known; never to be treated as safe.
    Inconclusive,
}

impl From<model::VerdictState> for VerdictState {
    fn from(state: model::VerdictState) -> Self {
        match state {
            model::VerdictState::Safe => Self::Safe,
            model::VerdictState::Unsafe => Self::Unsafe,
            model::VerdictState::Inconclusive => Self::Inconclusive,
        }
    }
}

/// One check that a verdict rests on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct VerdictCheck {
    /// Stable name of the check, such as `significant_height`.
    pub check: String,
    /// Whether it passed.
    pub passed: bool,
    /// What was measured against what, for people.
    pub text: String,
}

/// A verdict with every reason for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Verdict {
    /// The verdict when it was issued.
    pub state: VerdictState,
    /// Every check, the failed ones first.
    pub reasons: Vec<VerdictCheck>,
    /// After this it means nothing.
    pub valid_until: String,
    /// Whether that time has passed: then treat it as inconclusive.
    pub expired: bool,
}

/// One sample of the elevation at the centre of the patch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TraceSample {
    /// Seconds relative to the sea state's `stamp`; negative lies before it.
    pub t_s: f64,
    /// Elevation, metres, positive up.
    pub elevation_m: f64,
}

/// Statistics of the sea surface over one observation window, and the verdict drawn from them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeaState {
    /// The rig that measured it.
    pub rig: String,
    /// When it was issued.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// The rig has been silent for longer than allowed.
    pub stale: bool,
    /// Start of the observation window.
    pub window_start: String,
    /// Length of the window, seconds.
    pub window_s: f64,
    /// Mean place of the patches.
    pub local: Point,
    /// Patches used.
    pub patches: u32,
    /// Mean coverage of those patches, 0 to 1.
    pub coverage: f64,
    /// Individual waves counted.
    pub waves: u32,
    /// Mean wave height H_m, metres.
    #[schema(required = true)]
    pub h_mean_m: Option<Estimate>,
    /// Significant wave height H_s = H1/3, metres.
    #[schema(required = true)]
    pub h_s_m: Option<Estimate>,
    /// Highest wave, metres.
    #[schema(required = true)]
    pub h_max_m: Option<Estimate>,
    /// 4 √m0, metres.
    #[schema(required = true)]
    pub h_m0_m: Option<Estimate>,
    /// Mean zero up-crossing period T_z, seconds.
    #[schema(required = true)]
    pub t_z_s: Option<Estimate>,
    /// Root mean square slope of the surface, radians.
    #[schema(required = true)]
    pub slope_rms_rad: Option<Estimate>,
    /// Elevation at the patch centre over the window, oldest first.
    pub trace: Vec<TraceSample>,
    /// The verdict.
    pub verdict: Verdict,
}

impl SeaState {
    /// From the model; `stale` is the store's judgement.
    #[must_use]
    pub fn new(sea: &model::SeaState, stale: bool, edge: &Edge) -> Self {
        let trace = sea
            .trace
            .iter()
            .map(|point| TraceSample { t_s: point.stamp.seconds_since(sea.stamp), elevation_m: point.elevation_m });
        Self {
            rig: sea.rig.to_string(),
            stamp: rfc3339(sea.stamp),
            age_s: edge.age_s(sea.stamp),
            stale,
            window_start: rfc3339(sea.window_start),
            window_s: sea.window_s,
            local: edge.point(sea.position),
            patches: sea.patches,
            coverage: sea.coverage,
            waves: sea.waves,
            h_mean_m: sea.h_mean_m.map(Into::into),
            h_s_m: sea.h_s_m.map(Into::into),
            h_max_m: sea.h_max_m.map(Into::into),
            h_m0_m: sea.h_m0_m.map(Into::into),
            t_z_s: sea.t_z_s.map(Into::into),
            slope_rms_rad: sea.slope_rms_rad.map(Into::into),
            trace: trace.collect(),
            verdict: Verdict {
                state: sea.verdict.state.into(),
                reasons: sea
                    .verdict
                    .reasons
                    .iter()
                    .map(|reason| VerdictCheck {
                        check: reason.check.clone(),
                        passed: reason.passed,
                        text: reason.text.clone(),
                    })
                    .collect(),
                valid_until: rfc3339(sea.verdict.valid_until),
                expired: edge.now > sea.verdict.valid_until,
            },
        }
    }
}
