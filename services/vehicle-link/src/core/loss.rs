//! Which share of a sender's frames is lost, by the gaps in its sequence numbers.
//!
//! Sequence numbers have eight bits: a gap of more than half of them reads as a step back, which is a frame that came late, or a
//! sender that started again. So more than 127 frames lost in a row are counted modulo 256; by then the link is down anyway.

use halcyon_model::Stamp;

/// The share is that of the last one to two of these, seconds.
const WINDOW_S: f64 = 5.0;
/// A frame that is so many numbers late is taken for late; one further back for a sender that started again.
const LATE_MAX: u8 = 16;

/// Frames of one sender in one window.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Count {
    received: u64,
    lost: u64,
}

/// Watches one sender.
#[derive(Debug, Clone, Copy, Default)]
pub struct Loss {
    newest: Option<u8>,
    /// Bit `i`: the number `newest − i` came.
    seen: u32,
    since: Option<Stamp>,
    current: Count,
    previous: Count,
    received: u64,
    lost: u64,
}

impl Loss {
    /// A frame came; returns how many before it are missing now.
    pub fn observe(&mut self, sequence: u8, now: Stamp) -> u8 {
        self.roll(now);
        let ahead = self.newest.map_or(1, |newest| sequence.wrapping_sub(newest));
        let behind = ahead.wrapping_neg();
        let was_seen = self.seen.checked_shr(behind.into()).unwrap_or(0) & 1 == 1;
        if self.newest.is_some() && (behind <= LATE_MAX) {
            if was_seen {
                return 0; // A duplicate.
            }
            // Late: it was counted as lost.
            self.seen |= 1 << behind;
            self.add(1, 0);
            self.forgive();
            return 0;
        }
        if ahead > 127 {
            // Far back: the sender started again.
            self.newest = Some(sequence);
            self.seen = 1;
            self.add(1, 0);
            return 0;
        }
        let gap = ahead.saturating_sub(1);
        self.seen = self.seen.checked_shl(ahead.into()).unwrap_or(0) | 1;
        self.newest = Some(sequence);
        self.add(1, gap.into());
        gap
    }

    /// Share lost in the last seconds, 0 to 1; 0 if nothing came at all.
    #[must_use]
    pub fn share(&self) -> f64 {
        let received = (self.current.received + self.previous.received) as f64;
        let lost = (self.current.lost + self.previous.lost) as f64;
        if received + lost > 0.0 { lost / (received + lost) } else { 0.0 }
    }

    /// Frames that came.
    #[must_use]
    pub fn received(&self) -> u64 {
        self.received
    }

    /// Frames that never came.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    fn add(&mut self, received: u64, lost: u64) {
        self.current.received += received;
        self.current.lost += lost;
        self.received += received;
        self.lost += lost;
    }

    fn forgive(&mut self) {
        let count = if self.current.lost > 0 { &mut self.current } else { &mut self.previous };
        count.lost = count.lost.saturating_sub(1);
        self.lost = self.lost.saturating_sub(1);
    }

    fn roll(&mut self, now: Stamp) {
        let age_s = self.since.map_or(f64::INFINITY, |since| now.seconds_since(since));
        if !(0.0..=WINDOW_S).contains(&age_s) {
            // After a long silence the window before the last is as old as the silence.
            self.previous = if (0.0..=2.0 * WINDOW_S).contains(&age_s) { self.current } else { Count::default() };
            self.current = Count::default();
            self.since = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0 + s)
    }

    fn after(sequence: impl IntoIterator<Item = u8>) -> Loss {
        let mut loss = Loss::default();
        for number in sequence {
            loss.observe(number, t(0.0));
        }
        loss
    }

    #[track_caller]
    fn check(sequence: impl IntoIterator<Item = u8>, received: u64, lost: u64) {
        let loss = after(sequence);
        assert_eq!((loss.received(), loss.lost()), (received, lost));
    }

    #[test]
    fn gaps_are_counted_across_the_wrap_and_nothing_else_is() {
        check([], 0, 0);
        check([7], 1, 0);
        check((0..1000).map(|i| (i % 256) as u8), 1000, 0);
        check([250, 251, 255, 0, 3], 5, 3 + 2);
        // Every third never comes: 333 of 1000.
        let kept = (0..1000).filter(|i| i % 3 != 1).map(|i| (i % 256) as u8);
        check(kept, 667, 333);
    }

    #[test]
    fn late_ones_are_forgiven_duplicates_are_not_counted_and_a_restart_is_no_loss() {
        check([1, 2, 4, 3, 5], 5, 0);
        check([254, 0, 255, 1], 4, 0);
        check([1, 2, 2, 3, 3, 2], 3, 0);
        check([1, 5, 3, 3, 4, 2], 5, 0);
        check([200, 201, 0, 1, 2], 5, 54);
        check([100, 101, 0, 1, 2], 5, 0);
    }

    #[test]
    fn the_share_is_of_the_last_seconds() {
        let mut loss = Loss::default();
        let mut number = 0_u8;
        // 100 Hz: 20 s without loss, 20 s with every fourth lost, then 20 s without.
        for step in 0..6000 {
            number = number.wrapping_add(1);
            let now = t(f64::from(step) * 0.01);
            if !(2000..4000).contains(&step) || step % 4 != 0 {
                loss.observe(number, now);
            }
            match step {
                1999 | 5999 => assert!(loss.share() < 1e-9, "{step}: {}", loss.share()),
                3999 => assert!((loss.share() - 0.25).abs() < 0.01, "{}", loss.share()),
                _ => {}
            }
        }
        loss.observe(number.wrapping_add(1), t(1000.0));
        assert_eq!(loss.share(), 0.0);
    }
}
