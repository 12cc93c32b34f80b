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
    /// Root mean square wave height H_rms, metres (zero up-crossing).
    pub h_rms_m: Option<Estimate>,
    /// Mean of the highest tenth of the waves H1/10, metres (zero up-crossing).
    pub h_tenth_m: Option<Estimate>,
    /// Peak period, seconds.
    pub t_p_s: Option<Estimate>,
    /// Mean period m0/m1, seconds.
    pub t_m01_s: Option<Estimate>,
    /// Mean zero-crossing period √(m0/m2) by the spectrum, seconds.
    pub t_m02_s: Option<Estimate>,
    /// Energy period m₋₁/m0, seconds.
    pub t_e_s: Option<Estimate>,
    /// Root mean square vertical speed of the surface, metres per second.
    pub vertical_speed_rms_mps: Option<Estimate>,
    /// Where the waves come from and how long they are; `None` where the grids do not tell.
    pub directional: Option<Directional>,
    /// Spectrum of the elevation; `None` where the window is too short.
    pub spectrum: Option<WaveSpectrum>,
    /// Quality tests that did not pass.
    pub quality: Vec<QualityFlag>,
    /// Quiet moments ahead; `None` where the sea cannot be forecast.
    pub calm: Option<CalmForecast>,
    /// Elevation at the patch centre over the window, oldest first.
    pub trace: Vec<TracePoint>,
    /// The verdict.
    pub verdict: Verdict,
}

/// Direction and length of the waves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Directional {
    /// Mean direction that waves come **from**, radians clockwise from true north; the bounds may pass 0 or 2π.
    pub from_rad: Estimate,
    /// Circular spread about it, radians.
    pub spread_rad: f64,
    /// Length of the waves at the peak, metres.
    pub wavelength_peak_m: f64,
}

/// One-sided variance density of the elevation at `i × df_hz`.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveSpectrum {
    /// Distance between two frequencies, hertz.
    pub df_hz: f64,
    /// Density, m²/Hz, from 0 Hz on.
    pub density_m2_per_hz: Vec<f64>,
    /// Degrees of freedom of each density.
    pub degrees_of_freedom: f64,
    /// A density times these is its 95 % interval (chi-square): low and high.
    pub factors_95: [f64; 2],
}

/// What a quality test says when it does not pass.
#[derive(Debug, Clone, PartialEq)]
pub struct QualityFlag {
    /// Stable name of the test, such as `spike`.
    pub test: String,
    /// The finding makes the verdict inconclusive.
    pub failed: bool,
    /// For people.
    pub text: String,
}

/// A forecast of the surface at one place over the next seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct CalmForecast {
    /// Where.
    pub place: LocalPoint,
    /// Start of the forecast.
    pub from: Stamp,
    /// Expected error of the elevation three seconds ahead over the sea's own standard deviation: 1 where nothing is known.
    pub error_share: f64,
    /// When every upper 95 % bound stays under its limit, soonest first.
    pub windows: Vec<CalmWindow>,
}

/// A quiet moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalmWindow {
    /// Start.
    pub from: Stamp,
    /// End.
    pub to: Stamp,
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
    /// Probability that the water is under every limit, by the measurement; `None` where there is none.
    pub probability: Option<f64>,
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
