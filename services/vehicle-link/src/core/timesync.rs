//! The autopilot's clock by TIMESYNC: what its time since boot is on ours, and how long a message takes there and back.
//!
//! We ask with `tc1 = 0` and our time in `ts1`; the answer brings our `ts1` back with the autopilot's time in `tc1`: nanoseconds since
//! its boot in ArduPilot and PX4 alike. Without knowing how the round trip divides, the midpoint is right to half of it, so the
//! answer of the shortest round trip in a window is believed, as NTP's clock filter does. A clock that drifts is followed, since
//! the window moves; one that jumped is noticed by an answer that no delay explains, and everything older is forgotten.

use std::collections::VecDeque;

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega::{MavMessage, TIMESYNC_DATA};

use super::encode::Address;

/// Asked so often, seconds: at first, and once there are enough answers.
const FIRST_S: f64 = 0.2;
const THEN_S: f64 = 1.0;
const FIRST_COUNT: usize = 5;
/// Answers that are compared. Ten seconds let a crystal of 100 ppm drift by a millisecond.
const SAMPLES: usize = 10;
/// Questions whose answers are still taken.
const OPEN_MAX: usize = 8;
/// A longer round trip says nothing about the offset, seconds.
const ROUND_TRIP_S_MAX: f64 = 1.0;
/// Disagreement that is left to drift and to rounding, seconds.
const SLACK_S: f64 = 0.005;
/// Without an answer for so long the offset is not fresh, seconds.
const FRESH_S: f64 = 5.0;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sample {
    at: Stamp,
    /// Ours less the autopilot's, nanoseconds.
    offset_ns: i64,
    round_trip_ns: i64,
}

impl Sample {
    /// Whether both can be true of one clock: the true offset is within half a round trip of each midpoint.
    fn agrees_with(self, other: Self) -> bool {
        let apart_ns = self.offset_ns.abs_diff(other.offset_ns) as f64;
        apart_ns <= 0.5 * (self.round_trip_ns + other.round_trip_ns) as f64 + SLACK_S * 1e9
    }
}

/// The two clocks.
#[derive(Debug, Clone, Default)]
pub struct TimeSync {
    asked: Option<Stamp>,
    /// What was asked and not answered: our `ts1`.
    open: VecDeque<i64>,
    samples: VecDeque<Sample>,
}

impl TimeSync {
    /// A question, if one is due.
    pub fn ask(&mut self, to: Address, now: Stamp) -> Option<MavMessage> {
        let every_s = if self.samples.len() < FIRST_COUNT { FIRST_S } else { THEN_S };
        // An autopilot that never answers is asked at the slower rate.
        let every_s = if self.open.len() >= FIRST_COUNT { THEN_S } else { every_s };
        // Our own clock may have been set back.
        if self.asked.is_some_and(|asked| (0.0..every_s).contains(&now.seconds_since(asked))) {
            return None;
        }
        self.asked = Some(now);
        if self.open.len() >= OPEN_MAX {
            self.open.pop_front();
        }
        self.open.push_back(now.as_nanos());
        Some(message(0, now.as_nanos(), to))
    }

    /// A TIMESYNC came from the autopilot at `now`. Returns our answer, if it is a question.
    pub fn observe(&mut self, data: &TIMESYNC_DATA, from: Address, now: Stamp) -> Option<MavMessage> {
        if data.tc1 == 0 {
            return Some(message(now.as_nanos(), data.ts1, from));
        }
        // Answers to other clients' questions come here too: ours are known by our own time in them.
        let index = self.open.iter().position(|asked| *asked == data.ts1)?;
        self.open.drain(..=index);
        let round_trip_ns = now.as_nanos().saturating_sub(data.ts1);
        if !(0.0..=ROUND_TRIP_S_MAX * 1e9).contains(&(round_trip_ns as f64)) || data.tc1 < 0 {
            return None;
        }
        let midpoint_ns = data.ts1.saturating_add(round_trip_ns / 2);
        let sample = Sample { at: now, offset_ns: midpoint_ns.saturating_sub(data.tc1), round_trip_ns };
        if self.best().is_some_and(|best| !best.agrees_with(sample)) {
            // It started again, or one of the clocks was set.
            self.samples.clear();
        }
        if self.samples.len() >= SAMPLES {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        None
    }

    /// Our time when the autopilot's clock was at zero, nanoseconds; `None` without a recent answer.
    #[must_use]
    pub fn offset_ns(&self, now: Stamp) -> Option<i64> {
        self.is_fresh(now).then(|| self.best().map(|best| best.offset_ns)).flatten()
    }

    /// There and back, seconds: the least of late; `None` without a recent answer.
    #[must_use]
    pub fn round_trip_s(&self, now: Stamp) -> Option<f64> {
        self.is_fresh(now).then(|| self.best().map(|best| best.round_trip_ns as f64 * 1e-9)).flatten()
    }

    fn best(&self) -> Option<Sample> {
        // Of equals the newest.
        self.samples.iter().rev().min_by_key(|sample| sample.round_trip_ns).copied()
    }

    fn is_fresh(&self, now: Stamp) -> bool {
        self.samples.back().is_some_and(|sample| (0.0..=FRESH_S).contains(&now.seconds_since(sample.at)))
    }
}

fn message(tc1: i64, ts1: i64, to: Address) -> MavMessage {
    MavMessage::TIMESYNC(TIMESYNC_DATA { tc1, ts1, target_system: to.system(), target_component: to.component() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_nanos(1_000_000_000_000).plus_secs_f64(s)
    }

    fn address() -> Address {
        Address::new(7, 1).unwrap()
    }

    /// An autopilot whose clock is ours less `offset_s`, run fast by `drift`, over a link with these delays.
    struct Scene {
        sync: TimeSync,
        offset_s: f64,
        drift: f64,
    }

    impl Scene {
        fn new(offset_s: f64) -> Self {
            Self { sync: TimeSync::default(), offset_s, drift: 0.0 }
        }

        fn boot_s(&self, at_s: f64) -> f64 {
            1000.0 + at_s * (1.0 + self.drift) - self.offset_s
        }

        /// Asks at `at_s` if it is due; the error of the offset once the answer is in, seconds.
        fn exchange(&mut self, at_s: f64, there_s: f64, back_s: f64) -> Option<f64> {
            let MavMessage::TIMESYNC(question) = self.sync.ask(address(), t(at_s))? else { panic!("not a TIMESYNC") };
            assert_eq!((question.tc1, question.target_system), (0, 7));
            let boot_s = self.boot_s(at_s + there_s);
            let answer = TIMESYNC_DATA { tc1: (boot_s * 1e9) as i64, ..question };
            let heard = at_s + there_s + back_s;
            assert!(self.sync.observe(&answer, address(), t(heard)).is_none());
            let offset_s = self.sync.offset_ns(t(heard))? as f64 * 1e-9;
            Some(offset_s + self.boot_s(heard) - t(heard).as_secs_f64())
        }
    }

    #[test]
    fn the_offset_is_right_to_half_the_least_round_trip() {
        let mut scene = Scene::new(600.0);
        let mut error_s = f64::NAN;
        // Delay that varies and leans to one side.
        for step in 0..400_i32 {
            let (there_s, back_s) = (0.001 + f64::from((step * 7) % 40) * 1e-3, 0.003 + f64::from((step * 11) % 90) * 1e-3);
            if let Some(new) = scene.exchange(f64::from(step) * 0.1, there_s, back_s) {
                error_s = new;
            }
        }
        let round_trip_s = scene.sync.round_trip_s(t(40.0)).unwrap();
        assert!(error_s.abs() <= round_trip_s / 2.0 + 1e-6, "{error_s} of {round_trip_s}");
        assert!(round_trip_s < 0.060, "{round_trip_s}: the least of ten");
        // Wholly one-sided: the bound is reached, and not passed.
        let mut scene = Scene::new(600.0);
        let error_s = scene.exchange(0.0, 0.0, 0.08).unwrap();
        assert!((error_s.abs() - 0.04).abs() < 1e-6, "{error_s}");
    }

    #[test]
    fn drift_is_followed() {
        let mut scene = Scene { drift: 200e-6, ..Scene::new(10.0) };
        for second in 0..600 {
            if let Some(error_s) = scene.exchange(f64::from(second), 0.002, 0.002) {
                // Ten seconds of drift at most.
                assert!(error_s.abs() < 0.0025 + 1e-6, "{second}: {error_s}");
            }
        }
    }

    #[test]
    fn a_jump_is_followed_with_the_next_answer() {
        for jump_s in [-3600.0, -0.2, 0.2, 590.0] {
            let mut scene = Scene::new(100.0);
            (0..20).for_each(|second| _ = scene.exchange(f64::from(second), 0.002, 0.002));
            scene.offset_s += jump_s;
            // A restarted autopilot has no negative time; nothing else is believed either.
            let error_s = scene.exchange(20.0, 0.01, 0.01).unwrap();
            assert!(error_s.abs() < 1e-5, "{jump_s}: {error_s}");
        }
        // One late answer is no jump.
        let mut scene = Scene::new(100.0);
        (0..20).for_each(|second| _ = scene.exchange(f64::from(second), 0.002, 0.002));
        let error_s = scene.exchange(20.0, 0.0, 0.9).unwrap();
        assert!(error_s.abs() < 1e-5, "{error_s}");
    }

    #[test]
    fn only_answers_to_our_own_questions_count_and_questions_are_answered() {
        let mut sync = TimeSync::default();
        assert!(sync.ask(address(), t(0.0)).is_some());
        assert!(sync.ask(address(), t(0.1)).is_none());
        for data in [
            TIMESYNC_DATA { tc1: 5, ts1: 77, ..Default::default() },
            TIMESYNC_DATA { tc1: i64::MAX, ts1: i64::MIN, ..Default::default() },
            TIMESYNC_DATA { tc1: i64::MIN, ts1: t(0.0).as_nanos(), ..Default::default() },
        ] {
            assert!(sync.observe(&data, address(), t(0.2)).is_none());
            assert_eq!(sync.offset_ns(t(0.2)), None);
        }
        let question = TIMESYNC_DATA { tc1: 0, ts1: 123, ..Default::default() };
        let answer = sync.observe(&question, address(), t(0.3));
        assert_eq!(answer, Some(message(t(0.3).as_nanos(), 123, address())));
    }

    #[test]
    fn an_old_offset_is_no_offset() {
        let mut scene = Scene::new(100.0);
        assert!(scene.exchange(0.0, 0.002, 0.002).is_some());
        assert!(scene.sync.offset_ns(t(5.0)).is_some());
        assert!(scene.sync.offset_ns(t(5.1)).is_none() && scene.sync.round_trip_s(t(5.1)).is_none());
        // Our own clock was set back by an hour: still asked, and nothing is believed meanwhile.
        assert!(scene.sync.offset_ns(t(-3600.0)).is_none());
        assert!(scene.sync.ask(address(), t(-3600.0)).is_some());
        for step in 0..1000 {
            scene.sync.ask(address(), t(f64::from(step)));
            assert!(scene.sync.open.len() <= OPEN_MAX);
        }
    }
}
