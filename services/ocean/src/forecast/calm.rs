//! Quiet moments: stretches in which the sea stays within limits, as sure as the forecast is.

use std::f64::consts::TAU;

use super::fit::Forecast;
use super::outlook::{Outlook, Spot};

mod chance;

/// What a touchdown bears. Infinity is no limit; NaN is one that nothing keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Highest elevation over the mean water level, metres.
    pub crest_m: f64,
    /// Steepest slope in any direction.
    pub slope: f64,
    /// Fastest rise or fall of the surface, metres per second.
    pub vertical_speed_mps: f64,
}

/// Upper 95 % bounds of what the sea does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Elevation, metres.
    pub crest_m: f64,
    /// Magnitude of the slope.
    pub slope: f64,
    /// Magnitude of vertical speed, metres per second.
    pub vertical_speed_mps: f64,
}

/// A stretch in which the sea stays within its limits but for a chance of 5 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// From, seconds of the readings' clock.
    pub from_s: f64,
    /// To.
    pub to_s: f64,
    /// The highest of each bound in it.
    pub worst: Bounds,
}

impl Forecast {
    /// Times looked at lie this far apart, seconds.
    pub const STEP_S: f64 = 0.125;
    /// Times looked at, at most: a longer search ends there.
    pub const TIMES_MAX: usize = 161;
    /// Chance that the sea breaks a limit in an offered stretch, at most.
    pub const RISK: f64 = 0.05;
    /// A quantity of which more than this share of variance remains is unknown, and never calm, however flat the sea.
    pub const IGNORANCE_MAX: f64 = 0.9;

    /// The calm stretches at `spot` from `from_s` to `to_s`, each of at least `least_s`, earliest first.
    ///
    /// Calm is where the chance that the sea breaks any of the limits anywhere in the stretch is at most 5 %, and all that is limited is known (see
    /// [`Self::IGNORANCE_MAX`]); so the 95 % bounds of each quantity lie within its limit at every moment. The chance is that at the stretch's
    /// beginning plus that of each excursion beginning later: a normal variable that is over a level for a share p of its time goes there
    /// p/τ times a second, where τ, the time it stays, is 1/6 of its mean period for levels about two standard errors off (Rice 1944); and what is left
    /// to err are waves half as long as the sea's mean and less, so τ is 1/14 of the sea's.
    /// A stretch ends where its chance is spent; the next begins there.
    ///
    /// None for times that are not finite or a `least_s` of 0 or less. Bounds far ahead of the readings are the sea's own and never offered.
    #[must_use]
    pub fn calm_windows(&self, spot: Spot, limits: &Limits, from_s: f64, to_s: f64, least_s: f64) -> Vec<Window> {
        let steps = ((to_s - from_s) / Self::STEP_S + 1e-9).floor();
        // Written so that NaN finds nothing.
        if !(steps >= 1.0 && least_s > 0.0 && from_s.is_finite()) {
            return Vec::new();
        }
        let count = (steps.min(Self::TIMES_MAX as f64) as usize + 1).min(Self::TIMES_MAX);
        let times_s: Vec<f64> = (0..count).map(|i| from_s + i as f64 * Self::STEP_S).collect();
        let outlooks = self.at_times(spot, &times_s);
        // NaN where it is in doubt, which no sum of chances gets over.
        let chances: Vec<f64> =
            outlooks.iter().map(|o| if limits.known(o) { chance::broken(limits, o) } else { f64::NAN }).collect();
        let begun_per_step = 14.0 * Self::STEP_S / self.mean_period_s();
        let mut windows = Vec::new();
        let mut first = 0;
        while first < count {
            let mut risk = chances[first];
            let mut end = first;
            while end < count && risk <= Self::RISK {
                end += 1;
                risk += chances.get(end).map_or(0.0, |chance| chance * begun_per_step);
            }
            let last = end.saturating_sub(1);
            if end > first && times_s[last] - times_s[first] >= least_s - 1e-9 {
                let worst = outlooks[first..end].iter().map(Bounds::of).reduce(|a, b| a.max(&b));
                windows.extend(worst.map(|worst| Window { from_s: times_s[first], to_s: times_s[last], worst }));
                first = end;
            } else {
                first += 1;
            }
        }
        windows
    }

    /// 2π √(m0/m2) of the prior.
    fn mean_period_s(&self) -> f64 {
        let sea = self.prior.sea();
        TAU * (sea.elevation_m2 / sea.vertical_speed_m2ps2).sqrt()
    }
}

impl Limits {
    fn finite(&self) -> [bool; 3] {
        [self.crest_m, self.slope, self.vertical_speed_mps].map(|limit| limit != f64::INFINITY)
    }

    /// Whether all that is limited is known.
    fn known(&self, outlook: &Outlook) -> bool {
        let left = outlook.ignorance;
        let [crest, slope, speed] = self.finite();
        let known = |limited: bool, share: f64| !limited || share <= Forecast::IGNORANCE_MAX;
        // Without any limit what is left to know is the elevation.
        let any = crest || slope || speed;
        known(crest || !any, left.elevation) && known(slope, left.slope) && known(speed, left.vertical_speed)
    }
}

impl Bounds {
    /// Of one outlook: 5 % are above the crest's, and at most that above each of the others'.
    #[must_use]
    pub fn of(outlook: &Outlook) -> Self {
        // Standard errors to the bound of a normal variable upwards, of one either way, and of a vector's length.
        const UP: f64 = 1.644_854;
        const EITHER: f64 = 1.959_964;
        const LENGTH: f64 = 2.447_747;
        let (steepest_sigma, _) = chance::axes(outlook);
        Self {
            crest_m: outlook.elevation_m + UP * outlook.elevation_sigma_m,
            slope: outlook.slope_north.hypot(outlook.slope_east) + LENGTH * steepest_sigma.0,
            vertical_speed_mps: outlook.vertical_speed_mps.abs() + EITHER * outlook.vertical_speed_sigma_mps,
        }
    }

    fn max(&self, other: &Self) -> Self {
        Self {
            crest_m: self.crest_m.max(other.crest_m),
            slope: self.slope.max(other.slope),
            vertical_speed_mps: self.vertical_speed_mps.max(other.vertical_speed_mps),
        }
    }
}
