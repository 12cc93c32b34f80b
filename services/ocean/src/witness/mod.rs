//! A second witness of the same water beside the stereo's elevation series: a rangefinder, an ultrasonic sensor, a wave probe.
//!
//! As chapter 5 of the thesis compares them: in time (lag, bias, heights), in frequency (peaks, coherence, gain), by regression.
//!
//! | module | holds |
//! |---|---|
//! | [`mod@compare`] | two series of different rates, gaps and clocks, compared |
//! | [`mod@agreement`] | whether they agree within what chance and the sensors leave open |
//! | [`ratio`] | intervals of ratios of two records of the same, partly the same, or different waves |
//! | [`regression`] | slopes where one or both have errors |
//! | [`cross`] | auto and cross spectra, coherence, gain |
//!
//! Series `a` is the one under test (the stereo's), `b` the witness; lags are positive where `b` comes later.

pub mod agreement;
mod align;
pub mod compare;
pub mod cross;
mod lag;
pub mod ratio;
pub mod regression;
mod spectra;
#[cfg(test)]
mod tests;

pub use agreement::{Difference, Ignorance, Verdict, agreement, judge};
pub use compare::{Comparison, Options, Waves, compare};
pub use cross::AtPeak;
pub use ratio::Ratio;
pub use regression::Regression;

/// Which of the two series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Which {
    /// The one under test.
    A,
    /// The witness.
    B,
}

impl std::fmt::Display for Which {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::A => "the series under test",
            Self::B => "the witness",
        })
    }
}

/// Why two series cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// An option that is not finite, negative, or a band without width.
    #[error("option {0} of a comparison is out of range")]
    Option(&'static str),
    /// Nearly nothing is in it.
    #[error("{which} has {readings} usable readings, needs at least {readings_min}")]
    TooFew {
        /// Which series.
        which: Which,
        /// Readings with a finite stamp and elevation.
        readings: usize,
        /// Needed.
        readings_min: usize,
    },
    /// At no time do both have readings.
    #[error("the two series have no time in common: one ends {apart_s:.3} s before the other begins")]
    NoOverlap {
        /// Seconds between the end of one and the start of the other.
        apart_s: f64,
    },
    /// Too little is left where both have readings.
    #[error("{samples} samples in common without a gap, needs at least {samples_min}")]
    TooShort {
        /// The longest stretch, or all, at the common rate.
        samples: usize,
        /// Needed.
        samples_min: usize,
    },
    /// A wrong stamp, or a search that would not end.
    #[error("{samples} samples at the common rate are too many to compare")]
    TooLong {
        /// Asked for, or [`usize::MAX`].
        samples: usize,
    },
    /// It does not move: stuck, or still water under a coarse sensor.
    #[error("{which} does not change: no waves, or a sensor that is stuck")]
    Flat {
        /// Which series.
        which: Which,
    },
    /// The slower of the two cannot see any of the band.
    #[error("a common rate of {rate_hz} Hz leaves nothing of the band from {low_hz} Hz on")]
    Band {
        /// Of the slower series, hertz.
        rate_hz: f64,
        /// Where the band begins, hertz.
        low_hz: f64,
    },
}

/// Surface elevation, metres above the level that `height_m` is counted from, of a range measured along the vehicle's own
/// downward axis: η = h − R cos φ cos θ (thesis, equation 7-1, after Christensen et al. 2013).
///
/// `range_m` is the range, metres; `height_m` the sensor's height above the mean level, metres; roll and pitch are the vehicle's,
/// radians. cos φ cos θ is exactly the vertical share of the body's downward axis with the usual order of angles (yaw, pitch,
/// roll), whatever the yaw. The spot itself lies R √(1 − cos² φ cos² θ) from under the sensor: waves much shorter than that are
/// seen elsewhere and elsewhen.
///
/// NaN for what cannot be: a range that is not above zero, anything that is not finite, a beam that is level or looks up.
#[must_use]
pub fn elevation_of_range(range_m: f64, height_m: f64, roll_rad: f64, pitch_rad: f64) -> f64 {
    let tilted = |angle_rad: f64| angle_rad.abs() < std::f64::consts::FRAC_PI_2;
    let possible = range_m > 0.0 && range_m.is_finite() && height_m.is_finite();
    // Two angles beyond a right one would look down again by their cosines, but no vehicle's attitude is given so.
    if !(possible && tilted(roll_rad) && tilted(pitch_rad)) {
        return f64::NAN;
    }
    height_m - range_m * roll_rad.cos() * pitch_rad.cos()
}
