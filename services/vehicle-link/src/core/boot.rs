//! The autopilot's time since boot as a witness: that it started again, and that our clock went back or stood still.

use halcyon_model::Stamp;

/// Back by more than this, the autopilot started again, seconds; less is messages out of order.
const RESTART_S: f64 = 1.0;
/// Our clock is behind when it lost more than this against the autopilot's, seconds. Messages come late, never early.
const BEHIND_S: f64 = 1.0;
/// Our clock is ahead when it gained more than this for [`AHEAD_FOR_S`], seconds: a stall of the link makes up for itself.
const AHEAD_S: f64 = 5.0;
const AHEAD_FOR_S: f64 = 5.0;
/// The two clocks may drift apart by this share.
const DRIFT: f64 = 3e-4;

/// What a comparison shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finding {
    /// The autopilot started again.
    Restarted,
    /// Our clock lost so many seconds: it was set back, or stood still.
    WentBack(f64),
    /// Our clock gained so many seconds.
    WentForward(f64),
}

/// Compares the two.
#[derive(Debug, Clone, Copy, Default)]
pub struct BootWatch {
    last: Option<(f64, Stamp)>,
    /// Boot time less our time, at the least delay seen, seconds from `base`.
    best_s: f64,
    base: Option<Stamp>,
    ahead_since_s: Option<f64>,
}

impl BootWatch {
    /// Takes the autopilot's time since boot, heard at `now`.
    pub fn observe(&mut self, boot_s: f64, now: Stamp) -> Option<Finding> {
        if !boot_s.is_finite() {
            return None;
        }
        let base = *self.base.get_or_insert(now);
        let lead_s = boot_s - now.seconds_since(base);
        let Some((last_s, _)) = self.last else {
            self.last = Some((boot_s, now));
            self.best_s = lead_s;
            return None;
        };
        if boot_s < last_s - RESTART_S {
            *self = Self { last: Some((boot_s, now)), best_s: boot_s, base: Some(now), ahead_since_s: None };
            return Some(Finding::Restarted);
        }
        if boot_s <= last_s {
            return None;
        }
        self.last = Some((boot_s, now));
        self.best_s -= DRIFT * (boot_s - last_s).min(60.0);
        let gained_s = self.best_s - lead_s;
        if gained_s < -BEHIND_S {
            self.best_s = lead_s;
            self.ahead_since_s = None;
            return Some(Finding::WentBack(-gained_s));
        }
        self.best_s = self.best_s.max(lead_s);
        if gained_s < AHEAD_S {
            self.ahead_since_s = None;
            return None;
        }
        let since_s = *self.ahead_since_s.get_or_insert(boot_s);
        if boot_s - since_s < AHEAD_FOR_S {
            return None;
        }
        self.best_s = lead_s;
        self.ahead_since_s = None;
        Some(Finding::WentForward(gained_s))
    }

    /// That our clock went back is known already.
    pub fn clock_went_back(&mut self, by_s: f64) {
        self.base = self.base.map(|base| base.plus_secs_f64(-by_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    /// Ten times a second for ten minutes, delayed by up to 0.3 s, our clock off by `error_s`.
    fn findings(error_s: impl Fn(f64) -> f64, restart_at_s: f64) -> Vec<(f64, Finding)> {
        let mut watch = BootWatch::default();
        let each = |step: u32| {
            let time_s = f64::from(step) * 0.1;
            let delay_s = 0.3 * f64::from(step * 7 % 10) / 10.0;
            let boot_s = if time_s >= restart_at_s { time_s - restart_at_s } else { 50.0 + time_s };
            watch.observe(boot_s, t(time_s + delay_s + error_s(time_s))).map(|finding| (time_s, finding))
        };
        (0..6000).filter_map(each).collect()
    }

    #[test]
    fn a_clock_that_is_right_or_drifts_is_nothing_to_tell() {
        assert_eq!(findings(|_| 0.0, 1e9), []);
        for drift in [-1e-4, 1e-4] {
            assert_eq!(findings(|time_s| drift * time_s, 1e9), []);
        }
    }

    #[test]
    fn each_error_is_told_once_and_by_how_much() {
        let one = |found: Vec<(f64, Finding)>| {
            assert_eq!(found.len(), 1, "{found:?}");
            found[0]
        };
        let (at_s, finding) = one(findings(|time_s| if time_s > 100.0 { -30.0 } else { 0.0 }, 1e9));
        let Finding::WentBack(by_s) = finding else { panic!("{finding:?}") };
        assert!((at_s - 100.1).abs() < 0.2 && (by_s - 30.0).abs() < 0.4, "{at_s} {by_s}");
        let (at_s, finding) = one(findings(|time_s| if time_s > 100.0 { 60.0 } else { 0.0 }, 1e9));
        let Finding::WentForward(by_s) = finding else { panic!("{finding:?}") };
        assert!((at_s - 105.1).abs() < 0.3 && (by_s - 60.0).abs() < 0.4, "{at_s} {by_s}");
        assert_eq!(one(findings(|_| 0.0, 200.0)).1, Finding::Restarted);
    }

    /// A link that stalls for four seconds and then delivers everything at once.
    #[test]
    fn a_stall_is_no_error_of_the_clock() {
        let mut watch = BootWatch::default();
        for step in 0..600 {
            let time_s = f64::from(step) * 0.1;
            let heard_s = if (20.0..24.0).contains(&time_s) { 24.0 } else { time_s };
            assert_eq!(watch.observe(50.0 + time_s, t(heard_s)), None, "{time_s}");
        }
    }
}
