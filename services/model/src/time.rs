//! Points in time. Durations are [`std::time::Duration`] in interfaces and `_s` numbers in formulas.

use std::ops::{Add, Sub};
use std::time::Duration;

/// A point in time: nanoseconds since the Unix epoch on the fleet's clock, which in simulation may run faster than the wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Stamp(i64);

impl Stamp {
    /// From nanoseconds since the Unix epoch.
    #[must_use]
    pub const fn from_nanos(stamp_ns: i64) -> Self {
        Self(stamp_ns)
    }

    /// From seconds since the Unix epoch; NaN becomes the epoch, what does not fit saturates.
    #[must_use]
    pub fn from_secs_f64(stamp_s: f64) -> Self {
        Self((stamp_s * 1e9) as i64)
    }

    /// Nanoseconds since the Unix epoch.
    #[must_use]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// Seconds since the Unix epoch; about 0.2 µs of resolution today, so keep differences in [`Stamp`] or [`Self::seconds_since`].
    #[must_use]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// `self − earlier` in seconds, exact to a nanosecond over days; negative when `earlier` is later.
    #[must_use]
    pub fn seconds_since(self, earlier: Self) -> f64 {
        self.0.saturating_sub(earlier.0) as f64 * 1e-9
    }

    /// `self + seconds`, saturating; `seconds` may be negative. NaN adds nothing.
    #[must_use]
    pub fn plus_secs_f64(self, seconds: f64) -> Self {
        Self(self.0.saturating_add((seconds * 1e9) as i64))
    }
}

impl Add<Duration> for Stamp {
    type Output = Self;
    fn add(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)))
    }
}

impl Sub<Duration> for Stamp {
    type Output = Self;
    fn sub(self, duration: Duration) -> Self {
        Self(self.0.saturating_sub(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_keep_nanoseconds_where_seconds_do_not() {
        let a = Stamp::from_nanos(1_760_000_000_000_000_001);
        let b = Stamp::from_nanos(1_760_000_000_000_000_000);
        assert_eq!(a.seconds_since(b), 1e-9);
        assert_eq!(b.seconds_since(a), -1e-9);
        assert_eq!(Stamp::from_nanos(i64::MAX) + Duration::from_secs(1), Stamp::from_nanos(i64::MAX));
        assert_eq!(Stamp::from_secs_f64(f64::NAN), Stamp::default());
    }
}
