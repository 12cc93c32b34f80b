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
    /// Probability that the water is under every limit, by the measurement.
    #[schema(required = true)]
    pub probability: Option<f64>,
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

/// Direction and length of the waves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Directional {
    /// Mean direction that waves come from, degrees clockwise from true north.
    pub from_deg: f64,
    /// 95 % bounds of it: this much to either side, degrees.
    pub from_error_deg: f64,
    /// Circular spread, degrees.
    pub spread_deg: f64,
    /// Length of the waves at the peak, metres.
    pub wavelength_peak_m: f64,
}

impl From<model::Directional> for Directional {
    fn from(directional: model::Directional) -> Self {
        let from = directional.from_rad;
        Self {
            from_deg: from.value.to_degrees().rem_euclid(360.0),
            from_error_deg: (from.high - from.value).max(from.value - from.low).to_degrees(),
            spread_deg: directional.spread_rad.to_degrees(),
            wavelength_peak_m: directional.wavelength_peak_m,
        }
    }
}

/// One-sided variance density of the elevation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Spectrum {
    /// The rig that measured it.
    pub rig: String,
    /// When it was issued.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// Distance between two frequencies, hertz.
    pub df_hz: f64,
    /// Density, m²/Hz, at 0, `df_hz`, 2 `df_hz` …
    pub density_m2_per_hz: Vec<f64>,
    /// Degrees of freedom of each density.
    pub degrees_of_freedom: f64,
    /// A density times this is the lower end of its 95 % interval.
    pub low_factor: f64,
    /// A density times this is the upper end of its 95 % interval.
    pub high_factor: f64,
}

impl Spectrum {
    /// Of a sea state; `None` where it has none.
    #[must_use]
    pub fn new(sea: &model::SeaState, edge: &Edge) -> Option<Self> {
        let spectrum = sea.spectrum.as_ref()?;
        let [low_factor, high_factor] = spectrum.factors_95;
        Some(Self {
            rig: sea.rig.to_string(),
            stamp: rfc3339(sea.stamp),
            age_s: edge.age_s(sea.stamp),
            df_hz: spectrum.df_hz,
            density_m2_per_hz: spectrum.density_m2_per_hz.clone(),
            degrees_of_freedom: spectrum.degrees_of_freedom,
            low_factor,
            high_factor,
        })
    }
}

/// A quality test that did not pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct QualityFlag {
    /// Stable name of the test, such as `spike`.
    pub test: String,
    /// Failed, and not only suspect.
    pub failed: bool,
    /// For people.
    pub text: String,
}

/// A quiet moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalmWindow {
    /// Start.
    pub from: String,
    /// End.
    pub to: String,
}

/// A forecast of the surface at one place over the next seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Calm {
    /// Where.
    pub local: Point,
    /// Start of the forecast.
    pub from: String,
    /// Expected error of the elevation three seconds ahead over the sea's own standard deviation; 1 where nothing is known.
    pub error_share: f64,
    /// When every upper 95 % bound stays under its limit, soonest first.
    pub windows: Vec<CalmWindow>,
}

impl Calm {
    fn new(calm: &model::CalmForecast, edge: &Edge) -> Self {
        let window = |window: &model::CalmWindow| CalmWindow { from: rfc3339(window.from), to: rfc3339(window.to) };
        Self {
            local: edge.point(calm.place),
            from: rfc3339(calm.from),
            error_share: calm.error_share,
            windows: calm.windows.iter().map(window).collect(),
        }
    }
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
    /// Root mean square wave height, metres.
    #[schema(required = true)]
    pub h_rms_m: Option<Estimate>,
    /// Mean of the highest tenth of the waves, metres.
    #[schema(required = true)]
    pub h_tenth_m: Option<Estimate>,
    /// Peak period, seconds.
    #[schema(required = true)]
    pub t_p_s: Option<Estimate>,
    /// Mean period m0/m1, seconds.
    #[schema(required = true)]
    pub t_m01_s: Option<Estimate>,
    /// Mean zero-crossing period by the spectrum, seconds.
    #[schema(required = true)]
    pub t_m02_s: Option<Estimate>,
    /// Energy period m-1/m0, seconds.
    #[schema(required = true)]
    pub t_e_s: Option<Estimate>,
    /// Root mean square vertical speed of the surface, metres per second.
    #[schema(required = true)]
    pub vertical_speed_rms_mps: Option<Estimate>,
    /// Where the waves come from.
    #[schema(required = true)]
    pub directional: Option<Directional>,
    /// Quality tests that did not pass.
    pub quality: Vec<QualityFlag>,
    /// Quiet moments ahead.
    #[schema(required = true)]
    pub calm: Option<Calm>,
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
            h_rms_m: sea.h_rms_m.map(Into::into),
            h_tenth_m: sea.h_tenth_m.map(Into::into),
            t_p_s: sea.t_p_s.map(Into::into),
            t_m01_s: sea.t_m01_s.map(Into::into),
            t_m02_s: sea.t_m02_s.map(Into::into),
            t_e_s: sea.t_e_s.map(Into::into),
            vertical_speed_rms_mps: sea.vertical_speed_rms_mps.map(Into::into),
            directional: sea.directional.map(Into::into),
            quality: sea
                .quality
                .iter()
                .map(|flag| QualityFlag { test: flag.test.clone(), failed: flag.failed, text: flag.text.clone() })
                .collect(),
            calm: sea.calm.as_ref().map(|calm| Calm::new(calm, edge)),
            trace: trace.collect(),
            verdict: Verdict {
                state: sea.verdict.state.into(),
                probability: sea.verdict.probability,
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
