//! What PX4 wants otherwise than ArduCopter.
//!
//! - Modes have a main and a sub number ([`super::mode`]).
//! - NAV_TAKEOFF's altitude is above mean sea level, and zeros for the place are a place: off the coast of Ghana.
//! - OFFBOARD, its GUIDED, is refused unless setpoints stream already: so a request for it waits for a second, while the vehicle's own
//!   place is streamed as the setpoint. It doesn't hold by itself in OFFBOARD, either: a second without a setpoint is a fail-safe.
//! - It is armed in HOLD and takes off in a mode of its own, AUTO.TAKEOFF.
//! - Setpoints go in its local frame whenever that is known: what SET_POSITION_TARGET_GLOBAL_INT means changed between its versions
//!   (1.12 took a height above home with the wrong sign of home's own).
//!
//! # Modes that it changes by itself
//! After a take-off it is in HOLD, and when the motors stop after LAND it is back in the mode before. Neither is a pilot's choice, if the
//! take-off or the landing was ours: [`TakeOff`] and [`is_back_after_landing`] tell.

use halcyon_model::{FlightMode, Stamp, VehicleState};
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};

use super::commands::{Command, CommandError, Effect, Ticket};
use super::mode::{Family, PX4_TAKE_OFF};

/// Setpoints stream for so long before OFFBOARD is asked for, seconds; PX4 looks back by half of that.
const LEAD_S: f64 = 1.0;
/// And at most for so long in all: by then it was refused.
const STREAM_S_MAX: f64 = 8.0;
/// Requests that wait at once.
const WAITING_MAX: usize = 8;
/// A take-off ends no further below its height than this, metres: PX4 is content within 0.8 (NAV_MC_ALT_RAD), and its height may be heard
/// a little later than its mode. Lower than that, HOLD is the pilot's.
const END_M: f64 = 1.5;

/// A command as PX4 takes it. `home_amsl_m`: altitude of home above mean sea level; a take-off without it can't be sent.
#[must_use]
pub fn fitted(message: MavMessage, home_amsl_m: Option<f64>) -> Option<MavMessage> {
    let MavMessage::COMMAND_LONG(mut data) = message else { return Some(message) };
    match data.command {
        MavCmd::MAV_CMD_DO_SET_MODE => {
            let mode = FlightMode::from_copter(data.param2 as u32);
            let [main, sub] = Family::Px4.set_mode_parameters(mode)?;
            (data.param2, data.param3) = (main as f32, sub as f32);
        }
        MavCmd::MAV_CMD_NAV_TAKEOFF => {
            data.param7 += home_amsl_m? as f32;
            (data.param4, data.param5, data.param6) = (f32::NAN, f32::NAN, f32::NAN);
        }
        _ => {}
    }
    Some(MavMessage::COMMAND_LONG(data))
}

/// A take-off of ours, from the request to the HOLD at its end.
#[derive(Debug, Clone, Copy, Default)]
pub struct TakeOff {
    /// Above mean water, metres.
    height_m: Option<f64>,
    is_accepted: bool,
}

impl TakeOff {
    /// It is asked for, to a height above mean water, metres.
    pub fn asked(&mut self, height_m: f64) {
        self.height_m = Some(height_m);
    }

    /// PX4 answered. A request again that goes unanswered takes back nothing.
    pub fn answered(&mut self, is_accepted: bool) {
        self.is_accepted |= is_accepted;
    }

    /// Whether this change of mode is its end, rather than a pilot's choice.
    #[must_use]
    pub fn ends(&self, before: &VehicleState, now: &VehicleState) -> bool {
        let is_up = self.height_m.is_some_and(|height_m| -now.position_ned_m.z >= height_m - END_M);
        self.is_accepted && is_up && now.armed && before.mode == PX4_TAKE_OFF && now.mode == FlightMode::Loiter
    }
}

/// Whether PX4 is back in HOLD because it stopped the motors itself, after a landing or a take-off that came to nothing.
#[must_use]
pub fn is_back_after_landing(before: &VehicleState, now: &VehicleState) -> bool {
    let was_auto = matches!(before.mode, FlightMode::Land | FlightMode::Rtl) || before.mode == PX4_TAKE_OFF;
    before.armed && !now.armed && was_auto && now.mode == FlightMode::Loiter
}

/// Requests for OFFBOARD.
#[derive(Debug, Clone, Default)]
pub struct Offboard {
    waiting: Vec<Ticket>,
    since: Option<Stamp>,
    wanted: bool,
}

impl Offboard {
    /// A request that must wait for the stream.
    ///
    /// # Errors
    /// [`CommandError::Busy`] when too many wait.
    pub fn want(&mut self, ticket: Ticket) -> Result<(), CommandError> {
        if self.waiting.len() >= WAITING_MAX {
            return Err(CommandError::Busy);
        }
        self.waiting.push(ticket);
        self.wanted = true;
        Ok(())
    }

    /// Whether to send a setpoint at the vehicle's own place now, and the requests whose time has come.
    pub fn step(&mut self, mode: Option<FlightMode>, now: Stamp) -> (bool, Vec<Ticket>) {
        if !self.wanted {
            return (false, Vec::new());
        }
        let since = *self.since.get_or_insert(now);
        let streamed_s = now.seconds_since(since);
        let due = if streamed_s >= LEAD_S { std::mem::take(&mut self.waiting) } else { Vec::new() };
        // In OFFBOARD guidance streams its own.
        let is_done = self.waiting.is_empty() && due.is_empty() && mode == Some(FlightMode::Guided);
        if is_done || !(0.0..STREAM_S_MAX).contains(&streamed_s) {
            (self.wanted, self.since) = (!self.waiting.is_empty(), None);
        }
        (self.wanted, due)
    }

    /// Ends all, because of `error`.
    pub fn end(&mut self, error: &CommandError) -> Vec<Effect> {
        let waiting = std::mem::take(self).waiting;
        let end = |ticket| Effect::Done(ticket, Command::SetMode(FlightMode::Guided), Err(error.clone()));
        waiting.into_iter().map(end).collect()
    }
}

#[cfg(test)]
mod tests {
    use mavlink::dialects::ardupilotmega::COMMAND_LONG_DATA;

    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    #[test]
    fn offboard_is_asked_for_after_a_second_of_setpoints_which_then_go_on_until_it_is_reached() {
        let mut offboard = Offboard::default();
        assert_eq!(offboard.step(Some(FlightMode::Loiter), t(0.0)), (false, vec![]));
        offboard.want(7).unwrap();
        for step in 0..10 {
            assert_eq!(offboard.step(Some(FlightMode::Loiter), t(f64::from(step) * 0.1)), (true, vec![]));
        }
        assert_eq!(offboard.step(Some(FlightMode::Loiter), t(1.0)), (true, vec![7]));
        assert_eq!(offboard.step(Some(FlightMode::Loiter), t(1.5)), (true, vec![]));
        assert_eq!(offboard.step(Some(FlightMode::Guided), t(1.6)), (false, vec![]));
        // Never reached: not for ever.
        offboard.want(8).unwrap();
        let streamed = (0..1000).filter(|step| offboard.step(None, t(2.0 + f64::from(*step) * 0.1)).0).count();
        assert_eq!(streamed, 80);
        (0..WAITING_MAX as u64).for_each(|ticket| offboard.want(ticket).unwrap());
        assert_eq!(offboard.want(99), Err(CommandError::Busy));
        assert_eq!(offboard.end(&CommandError::Withdrawn).len(), WAITING_MAX);
        assert_eq!(offboard.step(None, t(200.0)), (false, vec![]));
    }

    #[test]
    fn take_off_is_above_the_sea_and_where_it_stands() {
        let take_off = MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            command: MavCmd::MAV_CMD_NAV_TAKEOFF,
            param7: 5.0,
            ..Default::default()
        });
        assert_eq!(fitted(take_off.clone(), None), None);
        let Some(MavMessage::COMMAND_LONG(data)) = fitted(take_off, Some(372.5)) else { panic!() };
        assert!(data.param4.is_nan() && data.param5.is_nan() && data.param6.is_nan());
        assert!((data.param7 - 377.5).abs() < 1e-3);
        let offboard = MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            command: MavCmd::MAV_CMD_DO_SET_MODE,
            param1: 1.0,
            param2: 4.0,
            ..Default::default()
        });
        let Some(MavMessage::COMMAND_LONG(data)) = fitted(offboard, None) else { panic!() };
        assert_eq!([data.param1, data.param2, data.param3], [1.0, 6.0, 0.0]);
    }
}
