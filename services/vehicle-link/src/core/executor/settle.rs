//! When something counts as reached.

use halcyon_model::Stamp;

/// Within tolerance for long enough; once settled, it takes twice the tolerance to come unsettled.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Settle {
    since: Option<Stamp>,
    settled: bool,
}

impl Settle {
    /// Takes the present error; returns whether it is settled.
    pub(super) fn step(&mut self, error_m: f64, radius_m: f64, for_s: f64, now: Stamp) -> bool {
        let radius_m = if self.settled { 2.0 * radius_m } else { radius_m };
        // NaN is never within.
        if error_m <= radius_m {
            let since = *self.since.get_or_insert(now);
            self.settled |= now.seconds_since(since) >= for_s;
        } else {
            *self = Self::default();
        }
        self.settled
    }

    /// Starts afresh.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }
}
