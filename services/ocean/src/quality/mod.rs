//! Whether a record can be believed: the QARTOD tests of wave data, each a flag with its reason.
//!
//! The tests are those of the *Manual for Real-Time Quality Control of In-Situ Surface Wave Data* (U.S. Integrated Ocean
//! Observing System, version 2.1, 2019), by its numbers 9 to 20, and a few of ours that a camera needs. The manual leaves most
//! thresholds to the operator: ours are defaults, documented where they stand, and all can be changed.
//!
//! | module | holds |
//! |---|---|
//! | [`series`] | readings as they come: out of order, doubled, missing; and the even record made of them |
//! | [`readings`] | tests 9 to 13, flat line, percent good |
//! | [`sampling`] | whether the sampling rate suffices for the waves |
//! | [`spectral`] | tests 17 and 18, too much energy at high frequencies, test 14 |
//! | [`bulk`] | tests 15, 19 and 20 of the wave parameters |
//! | [`mod@assess`] | all of these in one go |
//! | [`repair`], [`phase_space`] | what to do about bad readings, and what was done |
//! | [`downwash`] | ripples that the rotors made, told from waves by their radial pattern |

pub mod assess;
pub mod bulk;
pub mod downwash;
pub mod phase_space;
pub mod readings;
pub mod repair;
pub mod sampling;
pub mod series;
pub mod spectral;

pub use assess::{Assessment, Limits, assess};
pub use series::{Even, Ordered, RawSeries};

/// What a test says: QARTOD's primary flags, with the numbers that data centres store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Flag {
    /// Passed.
    Pass = 1,
    /// Could not be, or was not, tested.
    NotEvaluated = 2,
    /// Suspect, or of high interest: look at it.
    Suspect = 3,
    /// Failed: not to be used.
    Fail = 4,
    /// There is nothing to test.
    Missing = 9,
}

impl Flag {
    /// The number of the flag in files.
    #[must_use]
    pub fn number(self) -> u8 {
        self as u8
    }

    /// How bad it is: what was not evaluated says nothing, missing data are worse than bad ones.
    fn rank(self) -> u8 {
        match self {
            Self::NotEvaluated => 0,
            Self::Pass => 1,
            Self::Suspect => 2,
            Self::Fail => 3,
            Self::Missing => 4,
        }
    }

    /// The worst of `flags`; not evaluated where there is none.
    #[must_use]
    pub fn worst(flags: impl IntoIterator<Item = Self>) -> Self {
        flags.into_iter().max_by_key(|flag| flag.rank()).unwrap_or(Self::NotEvaluated)
    }

    /// `Fail` at or above `fail`, `Suspect` at or above `suspect`; a value that is not a number cannot be evaluated.
    pub(crate) fn rising(value: f64, suspect: f64, fail: f64) -> Self {
        match value {
            x if x.is_nan() => Self::NotEvaluated,
            x if x >= fail => Self::Fail,
            x if x >= suspect => Self::Suspect,
            _ => Self::Pass,
        }
    }
}

/// One of the tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Test {
    /// Stamps: in order, each once, even.
    Stamps,
    /// Readings missing one after another.
    Gap,
    /// Readings far from all others.
    Spike,
    /// Readings that the instrument, or the place, cannot give.
    Range,
    /// A mean level that jumps.
    SegmentShift,
    /// Water that would have to move faster than gravity lets it.
    Acceleration,
    /// The same reading again and again.
    FlatLine,
    /// Too few good readings.
    PercentGood,
    /// A sampling rate too low for the waves.
    SamplingRate,
    /// Slope against elevation, as the dispersion relation has it.
    CheckRatio,
    /// A parameter far from its history.
    MeanAndDeviation,
    /// Energy at frequencies that the instrument or the place does not have.
    OperationalFrequency,
    /// Too much energy at low frequencies.
    EnergyLow,
    /// Too much energy at high frequencies.
    EnergyHigh,
    /// Wave parameters out of bounds.
    BulkRange,
    /// Waves steeper than water can be.
    Steepness,
    /// Wave parameters that change too fast.
    RateOfChange,
    /// Ripples that the rotors made.
    Downwash,
}

impl Test {
    /// Its number in the QARTOD manual; `None` where it is ours.
    #[must_use]
    pub fn number(self) -> Option<u8> {
        match self {
            Self::Gap => Some(9),
            Self::Spike => Some(10),
            Self::Range => Some(11),
            Self::SegmentShift => Some(12),
            Self::Acceleration => Some(13),
            Self::CheckRatio => Some(14),
            Self::MeanAndDeviation => Some(15),
            Self::FlatLine => Some(16),
            Self::OperationalFrequency => Some(17),
            Self::EnergyLow => Some(18),
            Self::BulkRange => Some(19),
            Self::RateOfChange => Some(20),
            Self::Stamps | Self::PercentGood | Self::SamplingRate | Self::EnergyHigh | Self::Steepness | Self::Downwash => None,
        }
    }

    /// A short name, as in file headers.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stamps => "stamps",
            Self::Gap => "gap",
            Self::Spike => "spike",
            Self::Range => "range",
            Self::SegmentShift => "segment_shift",
            Self::Acceleration => "acceleration",
            Self::FlatLine => "flat_line",
            Self::PercentGood => "percent_good",
            Self::SamplingRate => "sampling_rate",
            Self::CheckRatio => "check_ratio",
            Self::MeanAndDeviation => "mean_and_deviation",
            Self::OperationalFrequency => "operational_frequency",
            Self::EnergyLow => "energy_low",
            Self::EnergyHigh => "energy_high",
            Self::BulkRange => "bulk_range",
            Self::Steepness => "steepness",
            Self::RateOfChange => "rate_of_change",
            Self::Downwash => "downwash",
        }
    }
}

/// What one test found.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Which test.
    pub test: Test,
    /// Its flag.
    pub flag: Flag,
    /// Why, in words with numbers.
    pub reason: String,
    /// Readings concerned, as indices into the series that was given, in the order of their stamps; empty where the finding
    /// is about the whole record.
    pub samples: Vec<usize>,
}

impl Finding {
    pub(crate) fn new(test: Test, flag: Flag, reason: impl Into<String>) -> Self {
        Self { test, flag, reason: reason.into(), samples: Vec::new() }
    }

    pub(crate) fn about(mut self, samples: Vec<usize>) -> Self {
        self.samples = samples;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_have_the_manuals_numbers_and_the_worst_wins() {
        let all = [Flag::Pass, Flag::NotEvaluated, Flag::Suspect, Flag::Fail, Flag::Missing];
        assert_eq!(all.map(Flag::number), [1, 2, 3, 4, 9]);
        assert_eq!(Flag::worst(all), Flag::Missing);
        assert_eq!(Flag::worst([Flag::NotEvaluated, Flag::Pass]), Flag::Pass);
        assert_eq!(Flag::worst([]), Flag::NotEvaluated);
        assert_eq!(Flag::rising(f64::NAN, 1.0, 2.0), Flag::NotEvaluated);
        assert_eq!([0.9, 1.0, 2.0].map(|x| Flag::rising(x, 1.0, 2.0)), [Flag::Pass, Flag::Suspect, Flag::Fail]);
    }
}
