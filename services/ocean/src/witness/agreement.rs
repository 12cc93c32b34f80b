//! Whether a series and its witness agree within what chance and their sensors leave open.

use super::compare::{Comparison, Options, Waves, compare};
use super::ratio::Ratio;
use super::{CompareError, Which};
use crate::interval::Interval;
use crate::quality::series::RawSeries;

/// What a witness says. Unknown is not agreement.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Heights, periods and peaks are the same as far as can be told; of two seas that are, 95 of 100 pairs of records say so.
    Agree,
    /// At least one is not.
    Disagree {
        /// All that are not.
        why: Vec<Difference>,
    },
    /// Nothing can be said.
    Unknown {
        /// All that stands against it.
        why: Vec<Ignorance>,
    },
}

/// How two records differ beyond their intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Difference {
    /// H_m0 of a over b is not 1.
    Height(Ratio),
    /// The mean zero-crossing period of a over b is not 1.
    Period(Ratio),
    /// 95 % intervals of the peak periods, seconds, have nothing in common: the thesis's ultrasonic sensor at 0.20 Hz (figure
    /// 5-28).
    Peak {
        /// The series under test.
        a_s: Interval,
        /// The witness.
        b_s: Interval,
    },
    /// One has its sign wrong.
    UpsideDown {
        /// The lowest correlation within the lags looked through.
        correlation: f64,
    },
    /// One has waves that the other should see above its noise, and does not.
    WavesInOne {
        /// The one that has.
        which: Which,
        /// The lower end of its H_m0, metres.
        h_m0_m: f64,
        /// What the other's whole H_m0 is at most, noise included, metres.
        other_h_m0_m: f64,
    },
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut ratio = |what: &str, ratio: &Ratio| {
            let (low, high) = ratio.interval_both_95();
            write!(f, "{what} is {:.3} times the witness's ({low:.3} to {high:.3})", ratio.value)
        };
        match self {
            Self::Height(of) => ratio("H_m0", of),
            Self::Period(of) => ratio("the mean period", of),
            Self::UpsideDown { .. } => f.write_str("it moves the other way, as if one of the two were positive down"),
            Self::Peak { a_s, b_s } => {
                write!(f, "peak period of {:.2} to {:.2} s against the witness's {:.2} to {:.2} s", a_s.0, a_s.1, b_s.0, b_s.1)
            }
            Self::WavesInOne { which, h_m0_m, other_h_m0_m } => {
                write!(f, "{which} has waves of {h_m0_m:.3} m at least, the other at most {other_h_m0_m:.3} m")
            }
        }
    }
}

/// Why nothing can be said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ignorance {
    /// There is nothing to compare.
    Incomparable(CompareError),
    /// Too few waves for a spectrum.
    TooShort {
        /// Peak periods in the time that both have.
        periods: f64,
        /// Needed.
        periods_min: f64,
    },
    /// Most of the shorter series has no counterpart.
    LittleOverlap {
        /// Share that has.
        share: f64,
        /// Needed.
        share_min: f64,
    },
    /// What it shows may be its noise.
    NoWaves {
        /// Which series.
        which: Which,
        /// H_m0 of the noise given, metres.
        noise_h_m0_m: f64,
    },
    /// The peak is so near the end of the band that waves beyond it are likely: too slow a sensor.
    Undersampled {
        /// The highest of both peaks, hertz.
        f_p_hz: f64,
        /// The end of the band, hertz.
        high_hz: f64,
    },
}

/// Peak periods that a record must have: two for each segment.
const PERIODS_MIN: f64 = 16.0;
/// Share of the shorter series that must have a counterpart.
const SHARE_MIN: f64 = 0.5;
/// Waves of less than this share of the noise's variance may be an error in it: three of its deviations.
const ABOVE_NOISE: f64 = 1.0;
/// Peaks above this share of the band's end are not trusted.
const BAND_SHARE: f64 = 0.9;

/// Of a comparison.
#[must_use]
pub fn agreement(comparison: &Comparison) -> Verdict {
    let Comparison { a, b, .. } = comparison;
    let mut ignorance = Vec::new();
    let f_p_hz = a.f_p_hz.min(b.f_p_hz);
    let periods = comparison.common_s * f_p_hz;
    if periods < PERIODS_MIN {
        ignorance.push(Ignorance::TooShort { periods, periods_min: PERIODS_MIN });
    }
    if comparison.common_share < SHARE_MIN {
        ignorance.push(Ignorance::LittleOverlap { share: comparison.common_share, share_min: SHARE_MIN });
    }
    let unseen = [(Which::A, a), (Which::B, b)].into_iter().filter(|(_, one)| !has_waves(one));
    let unseen: Vec<Which> = unseen.map(|(which, _)| which).collect();
    let lone = match unseen[..] {
        [Which::A] => seen_by_one(Which::B, b, a),
        [Which::B] => seen_by_one(Which::A, a, b),
        _ => None,
    };
    let highest_hz = a.f_p_hz.max(b.f_p_hz);
    if unseen.is_empty() && highest_hz > BAND_SHARE * comparison.band_hz.1 {
        ignorance.push(Ignorance::Undersampled { f_p_hz: highest_hz, high_hz: comparison.band_hz.1 });
    }
    if lone.is_none() {
        let noise = |which| if which == Which::A { a.noise_m0_m2 } else { b.noise_m0_m2 };
        ignorance.extend(unseen.iter().map(|&which| Ignorance::NoWaves { which, noise_h_m0_m: 4.0 * noise(which).sqrt() }));
    }
    if !ignorance.is_empty() {
        return Verdict::Unknown { why: ignorance };
    }
    if let Some(lone) = lone {
        return Verdict::Disagree { why: vec![lone] };
    }
    let mut why = Vec::new();
    why.extend(comparison.upside_down.map(|correlation| Difference::UpsideDown { correlation }));
    why.extend(comparison.height_ratio.filter(|ratio| !ratio.is_one()).map(Difference::Height));
    why.extend(comparison.period_ratio.filter(|ratio| !ratio.is_one()).map(Difference::Period));
    let (a_s, b_s) = (a.t_p_95_s, b.t_p_95_s);
    if a_s.0 > b_s.1 || b_s.0 > a_s.1 {
        why.push(Difference::Peak { a_s, b_s });
    }
    if why.is_empty() { Verdict::Agree } else { Verdict::Disagree { why } }
}

/// [`compare`] and [`agreement`] in one: what cannot be compared is unknown.
#[must_use]
pub fn judge(a: &RawSeries<'_>, b: &RawSeries<'_>, options: &Options) -> Verdict {
    match compare(a, b, options) {
        Ok(comparison) => agreement(&comparison),
        Err(error) => Verdict::Unknown { why: vec![Ignorance::Incomparable(error)] },
    }
}

fn m0_m2(h_m0_m: f64) -> f64 {
    (0.25 * h_m0_m).powi(2)
}

fn has_waves(one: &Waves) -> bool {
    let waves_m2 = m0_m2(one.h_m0_m) - one.noise_m0_m2;
    waves_m2 > ABOVE_NOISE * one.noise_m0_m2
}

/// Waves of one that are higher than all that the other shows, noise and all: the other is blind to them, whatever its noise.
fn seen_by_one(which: Which, one: &Waves, other: &Waves) -> Option<Difference> {
    let h_m0_m = 4.0 * (m0_m2(one.h_m0_95_m.0) - one.noise_m0_m2).max(0.0).sqrt();
    let other_h_m0_m = other.h_m0_95_m.1;
    (h_m0_m > other_h_m0_m).then_some(Difference::WavesInOne { which, h_m0_m, other_h_m0_m })
}
