//! Who has the vehicle: Halcyon or the pilot. The pilot always wins: a mode that we didn't ask for is never fought, and Halcyon
//! takes the vehicle back only when it is handed back, by GUIDED.

use halcyon_model::{FlightMode, Stamp};

/// A mode that we asked for is ours if it comes within this time, seconds.
const EXPECT_S: f64 = 8.0;
/// GUIDED that we asked for before the pilot took over may come so late, seconds: he hands nothing back with it.
const LATE_S: f64 = 5.0;

/// What a new observation changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// Nothing about who has it.
    None,
    /// The pilot, or the autopilot's own fail-safe, took it.
    TakenOver,
    /// The pilot, who has it already, chose another mode: whatever was asked for before is overtaken.
    ChosenAnew,
    /// It was handed back.
    HandedBack,
    /// The pilot's own flight ended with the motors off: it is nobody's now.
    Over,
}

/// Follows the flight mode.
#[derive(Debug, Clone, Default)]
pub struct Control {
    last: Option<(FlightMode, bool)>,
    expected: Option<(FlightMode, Stamp)>,
    /// When we asked for a GUIDED that hasn't come.
    unanswered: Option<Stamp>,
    ours: Option<FlightMode>,
    hands_off: bool,
    since_start: bool,
    /// It was taken from us, or the autopilot started again: GUIDED must be *set*; that it is GUIDED, or that the motors are off, hands
    /// nothing back.
    must_be_set: bool,
}

impl Control {
    /// We are about to ask for a mode.
    pub fn expect(&mut self, mode: FlightMode, now: Stamp) {
        self.expected = Some((mode, now));
        self.unanswered = (mode == FlightMode::Guided).then_some(now);
    }

    /// Whether Halcyon must keep its hands off.
    #[must_use]
    pub fn hands_off(&self) -> bool {
        self.hands_off
    }

    /// Whether this mode was asked for by us, and has been in force since.
    #[must_use]
    pub fn is_ours(&self, mode: FlightMode) -> bool {
        self.ours == Some(mode) && self.last.is_some_and(|last| last.0 == mode)
    }

    /// Whether the hands have been off since the first thing that was heard: then the mode may be what our predecessor, before a
    /// restart, had asked for.
    #[must_use]
    pub fn may_adopt(&self) -> bool {
        self.hands_off && self.since_start
    }

    /// Hands off until GUIDED is set, whatever the mode is and whether or not the motors run: a person took it from us, and may stand
    /// beside it once it is down; or the autopilot started again in flight, and nobody asked for the mode that it comes up in.
    pub fn let_go(&mut self) {
        *self = Self { last: self.last, unanswered: self.unanswered, hands_off: true, must_be_set: true, ..Self::default() };
    }

    /// The autopilot started again with its motors off: the mode that it comes up in is nobody's wish.
    pub fn started_again(&mut self) {
        self.ours = None;
        self.expected = None;
    }

    /// Our clock went back.
    pub fn clock_went_back(&mut self, by_s: f64) {
        self.expected = self.expected.map(|(mode, at)| (mode, at.plus_secs_f64(-by_s)));
        self.unanswered = self.unanswered.map(|at| at.plus_secs_f64(-by_s));
    }

    /// Takes the present mode as our own.
    pub fn adopt(&mut self) {
        self.ours = self.last.map(|last| last.0);
        self.hands_off = false;
    }

    /// Whether this is the GUIDED that we asked for before the pilot took over.
    fn is_late(&self, mode: FlightMode, now: Stamp) -> bool {
        let late = self.unanswered.is_some_and(|at| (0.0..LATE_S).contains(&now.seconds_since(at)));
        self.hands_off && mode == FlightMode::Guided && late
    }

    /// Takes the observed mode.
    pub fn observe(&mut self, mode: FlightMode, armed: bool, now: Stamp) -> Change {
        let before = self.hands_off;
        let first = self.last.is_none();
        let changed = self.last.is_some_and(|last| last.0 != mode);
        let disarmed = self.last.is_some_and(|last| last.1) && !armed;
        let mut is_over = false;
        self.last = Some((mode, armed));
        self.expected = self.expected.filter(|(_, at)| now.seconds_since(*at) <= EXPECT_S);
        if first {
            self.hands_off = armed && mode != FlightMode::Guided;
            self.since_start = true;
        } else if self.expected.is_some_and(|(expected, _)| expected == mode) {
            self.ours = Some(mode);
            self.expected = None;
            self.unanswered = None;
            self.hands_off = false;
            self.must_be_set = false;
        } else if self.is_late(mode, now) && changed {
            self.unanswered = None;
            self.must_be_set = true;
        } else if mode == FlightMode::Guided && (changed || !self.must_be_set) {
            // Whoever set it: this is how the vehicle is handed back.
            self.hands_off = false;
            self.must_be_set = false;
        } else if self.must_be_set {
            self.hands_off = true;
        } else if changed {
            // On the ground too, once we had set a mode: setting it again would be a fight.
            self.hands_off = armed || self.ours.is_some();
            self.ours = None;
            self.expected = None;
        } else if armed && self.ours != Some(mode) {
            // Armed by someone in a mode that isn't ours, even while we ask for another: we arm only in GUIDED.
            self.hands_off = true;
        } else if disarmed {
            // The flight is over; so is whoever's turn it was. After ours, another mode is somebody's wish, as before it.
            is_over = self.hands_off;
            self.hands_off = false;
        }
        if changed && !first {
            self.since_start = false;
        }
        match (before, self.hands_off) {
            (false, true) => Change::TakenOver,
            (true, false) if is_over => Change::Over,
            (true, false) => Change::HandedBack,
            (true, true) if changed => Change::ChosenAnew,
            _ => Change::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use FlightMode::{Guided, Land, Loiter, Rtl, Stabilize};

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    #[test]
    fn a_mode_we_asked_for_is_ours_and_another_is_the_pilots() {
        let mut control = Control::default();
        assert_eq!(control.observe(Stabilize, false, t(0.0)), Change::None);
        control.expect(Guided, t(0.0));
        control.observe(Guided, false, t(0.2));
        control.observe(Guided, true, t(1.0));
        assert!(!control.hands_off());
        control.expect(Land, t(2.0));
        assert_eq!(control.observe(Land, true, t(2.2)), Change::None);
        assert!(!control.hands_off());
        assert_eq!(control.observe(Loiter, true, t(3.0)), Change::TakenOver);
        // Our LAND, asked for earlier, doesn't make a LAND by the pilot ours.
        control.observe(Land, true, t(4.0));
        assert!(control.hands_off());
        assert_eq!(control.observe(Guided, true, t(5.0)), Change::HandedBack);
    }

    #[test]
    fn a_mode_that_the_pilot_chooses_after_a_request_overtakes_it() {
        let mut control = Control::default();
        control.observe(Loiter, true, t(0.0));
        control.expect(Guided, t(1.0));
        assert_eq!(control.observe(Loiter, true, t(1.2)), Change::None);
        assert_eq!(control.observe(Stabilize, true, t(1.4)), Change::ChosenAnew);
        assert!(control.hands_off());
    }

    /// Our request was on its way when the pilot took over: it sets GUIDED after all, and hands nothing back. What the pilot does then does.
    #[test]
    fn guided_that_comes_late_hands_nothing_back() {
        let mut control = Control::default();
        control.observe(Land, true, t(0.0));
        control.adopt();
        control.expect(Guided, t(1.0));
        assert_eq!(control.observe(Loiter, true, t(1.2)), Change::TakenOver);
        assert_eq!(control.observe(Guided, true, t(1.4)), Change::ChosenAnew);
        control.observe(Guided, true, t(9.0));
        assert!(control.hands_off());
        control.observe(Loiter, true, t(10.0));
        assert_eq!(control.observe(Guided, true, t(11.0)), Change::HandedBack);
    }

    #[test]
    fn a_late_or_crossed_request_does_not_excuse_another_mode() {
        let mut control = Control::default();
        control.observe(Guided, true, t(0.0));
        control.expect(Land, t(0.0));
        assert_eq!(control.observe(Loiter, true, t(0.1)), Change::TakenOver);
        control.observe(Land, true, t(0.3));
        assert!(control.hands_off(), "the pilot came first");
        let mut control = Control::default();
        control.observe(Guided, true, t(0.0));
        control.expect(Land, t(0.0));
        control.observe(Guided, true, t(9.0));
        assert_eq!(control.observe(Land, true, t(9.1)), Change::TakenOver, "too late to be ours");
    }

    #[test]
    fn on_the_ground_the_first_mode_is_nobodys_but_ours_is_not_set_twice() {
        let mut control = Control::default();
        control.observe(Stabilize, false, t(0.0));
        assert_eq!(control.observe(Loiter, false, t(1.0)), Change::None);
        control.expect(Guided, t(1.0));
        control.observe(Guided, false, t(1.2));
        assert_eq!(control.observe(Loiter, false, t(2.0)), Change::TakenOver);
        control.expect(Guided, t(3.0));
        assert_eq!(control.observe(Loiter, false, t(4.0)), Change::None, "asked, and refused");
        assert!(control.hands_off(), "until the autopilot says GUIDED it is the pilot's");
        control.observe(Guided, false, t(5.0));
        assert!(!control.hands_off());
    }

    #[test]
    fn after_our_flight_another_mode_is_the_pilots() {
        let mut control = Control::default();
        control.observe(Guided, true, t(0.0));
        control.expect(Land, t(1.0));
        control.observe(Land, true, t(1.2));
        assert_eq!(control.observe(Land, false, t(30.0)), Change::None);
        assert_eq!(control.observe(Loiter, false, t(40.0)), Change::TakenOver);
        assert_eq!(control.observe(Guided, false, t(50.0)), Change::HandedBack);
    }

    #[test]
    fn armed_in_another_mode_is_the_pilots_flight_and_ends_with_it() {
        let mut control = Control::default();
        control.observe(Loiter, false, t(0.0));
        assert_eq!(control.observe(Loiter, true, t(1.0)), Change::TakenOver);
        assert_eq!(control.observe(Loiter, false, t(60.0)), Change::Over);
        assert!(!control.hands_off());
    }

    #[test]
    fn armed_while_we_still_ask_for_guided_is_the_pilots_flight() {
        let mut control = Control::default();
        control.observe(Stabilize, false, t(0.0));
        control.expect(Guided, t(1.0));
        assert_eq!(control.observe(Stabilize, true, t(2.0)), Change::TakenOver);
        assert!(control.hands_off());
    }

    #[test]
    fn after_the_autopilots_restart_guided_must_be_set_not_just_be() {
        let flying = || {
            let mut control = Control::default();
            control.observe(Guided, true, t(0.0));
            control.let_go();
            assert_eq!(control.observe(Guided, true, t(0.2)), Change::None);
            assert!(control.hands_off() && !control.may_adopt());
            control
        };
        let mut control = flying();
        control.observe(Loiter, true, t(1.0));
        assert!(control.hands_off());
        assert_eq!(control.observe(Guided, true, t(2.0)), Change::HandedBack);
        // A person's own SetMode(GUIDED), already in GUIDED.
        let mut control = flying();
        control.expect(Guided, t(1.0));
        assert_eq!(control.observe(Guided, true, t(1.2)), Change::HandedBack);
        // Down and off, and set to something else there.
        let mut control = flying();
        control.observe(Guided, false, t(1.0));
        control.observe(Stabilize, false, t(2.0));
        control.observe(Stabilize, true, t(3.0));
        control.observe(Stabilize, false, t(4.0));
        assert!(control.hands_off());
        assert_eq!(control.observe(Guided, false, t(5.0)), Change::HandedBack);
    }

    #[test]
    fn after_a_restart_in_flight_a_landing_may_be_adopted_until_something_changes() {
        let mut control = Control::default();
        control.observe(Rtl, true, t(0.0));
        assert!(control.hands_off() && control.may_adopt());
        let mut other = control.clone();
        control.adopt();
        control.observe(Rtl, true, t(0.2));
        assert!(!control.hands_off());
        other.observe(Loiter, true, t(0.2));
        assert!(other.hands_off() && !other.may_adopt());
    }
}
