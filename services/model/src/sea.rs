//! What wave assessment says about the water.

use crate::geo::LocalPoint;
use crate::id::RigId;
use crate::time::Stamp;

/// A measured number with its 95 % confidence interval, in the unit that its field's name says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Best estimate.
    pub value: f64,
    /// Lower 95 % bound.
    pub low: f64,
    /// Upper 95 % bound.
    pub high: f64,
}

impl Estimate {
    /// Whether all three are finite and in order.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.low.is_finite() && self.high.is_finite() && self.low <= self.value && self.value <= self.high
    }
}

/// One sample of the elevation at the centre of the patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TracePoint {
    /// When.
    pub stamp: Stamp,
    /// Elevation, metres, positive up, after outliers were replaced.
    pub elevation_m: f64,
}

/// Statistics of the sea surface over one observation window, and the verdict drawn from them.
#[derive(Debug, Clone, PartialEq)]
pub struct SeaState {
    /// When it was issued.
    pub stamp: Stamp,
    /// The rig that measured it.
    pub rig: RigId,
    /// Start of the observation window.
    pub window_start: Stamp,
    /// Length of the window, seconds.
    pub window_s: f64,
    /// Mean place of the patches.
    pub position: LocalPoint,
    /// Patches used.
    pub patches: u32,
    /// Mean coverage of those patches, 0 to 1.
    pub coverage: f64,
    /// Individual waves counted by zero up-crossing, all gauges together.
    pub waves: u32,
    /// Mean wave height H_m, metres (zero up-crossing).
    pub h_mean_m: Option<Estimate>,
    /// Significant wave height H_s = H1/3, metres (zero up-crossing).
    pub h_s_m: Option<Estimate>,
    /// Highest wave, metres.
    pub h_max_m: Option<Estimate>,
    /// 4 √m0, metres.
    pub h_m0_m: Option<Estimate>,
    /// Mean zero up-crossing period T_z, seconds.
    pub t_z_s: Option<Estimate>,
    /// Root mean square slope of the surface, radians.
    pub slope_rms_rad: Option<Estimate>,
    /// Elevation at the patch centre over the window, oldest first.
    pub trace: Vec<TracePoint>,
    /// The verdict.
    pub verdict: Verdict,
}

/// Whether the water is fit to land on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VerdictState {
    /// Every upper bound is under its limit.
    Safe,
    /// Some lower bound is over its limit, or the best estimate is.
    Unsafe,
    /// Not known; never to be treated as safe.
    Inconclusive,
}

impl VerdictState {
    /// Lower-case word: `safe`, `unsafe` or `inconclusive`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Safe => "safe",
            Self::Unsafe => "unsafe",
            Self::Inconclusive => "inconclusive",
        }
    }
}

/// A verdict with every reason for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The verdict.
    pub state: VerdictState,
    /// Every check that was made, passed or not, the failed ones first.
    pub reasons: Vec<VerdictReason>,
    /// After this it means nothing.
    pub valid_until: Stamp,
}

/// One check that a verdict rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct VerdictReason {
    /// Stable name of the check, such as `significant_height`.
    pub check: String,
    /// Whether it passed.
    pub passed: bool,
    /// For people: what was measured against what, with units.
    pub text: String,
}
