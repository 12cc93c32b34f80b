//! Direct commands from people and from the planner. They work with the planner down.

use halcyon_model::{
    FlightMode, ItemKind, LandedState, LocalPoint, Severity, Stamp, VehicleAction, VehicleCommand, VehicleState,
};

use super::{Direct, Executor, Goal, how_to_hand_back};
use crate::core::commands::Command;
use crate::core::interlock;
use crate::core::mode::Family;
use crate::core::transfers::Request;

/// What becomes of a direct command.
#[derive(Debug, Clone, PartialEq)]
pub enum Decision {
    /// It is being done; this is what.
    Accepted(String),
    /// It is not, and why.
    Refused(String),
    /// The autopilot decides: ask it, and answer with the outcome.
    Ask(Command),
    /// It is a transfer with the autopilot: begin it, and answer with its end.
    Transfer(Request),
    /// End the transfers under way.
    CancelTransfers,
}

impl Executor {
    /// Decides about a command. The same command again is decided again, to the same effect.
    pub fn command(&mut self, command: &VehicleCommand, now: Stamp) -> Decision {
        self.watch_clock(now);
        match self.decide(command, now) {
            Ok(decision) => {
                self.note(Severity::Info, format!("command {}", name(&command.action)), format!("by {}", command.who));
                decision
            }
            Err(reason) => Decision::Refused(reason),
        }
    }

    fn decide(&mut self, command: &VehicleCommand, now: Stamp) -> Result<Decision, String> {
        if command.vehicle != self.config.vehicle {
            return Err(format!("this is {}, not {}", self.config.vehicle, command.vehicle));
        }
        if now > command.deadline {
            return Err(format!("its deadline passed {:.1} s ago", now.seconds_since(command.deadline)));
        }
        let Some(own) = self.own.clone() else { return Err("nothing heard from the autopilot yet".into()) };
        let silent_s = now.seconds_since(own.mode_heard).max(now.seconds_since(own.state.stamp));
        let action = &command.action;
        if *action == VehicleAction::Terminate {
            // Whatever else is the matter.
            self.take_over(Goal::Stay, command);
            self.flown = Some(Goal::Stay);
            self.terminated = Some(now);
            return Ok(Decision::Ask(Command::Disarm { force: true }));
        }
        if silent_s > self.config.fail_safe.autopilot_silent_s {
            return Err(format!("the autopilot has been silent for {silent_s:.0} s"));
        }
        if let VehicleAction::SetMode(mode) = *action {
            return Ok(self.set_mode(mode, now));
        }
        // Reading harms nobody, and what is written has its own conditions, whoever flies.
        if let Some(decision) = transfer(action, &own.state)? {
            return Ok(decision);
        }
        match action {
            VehicleAction::ReleasePayload => return self.payload(&own.state, true),
            VehicleAction::SecurePayload => return self.payload(&own.state, false),
            _ => {}
        }
        if self.control.hands_off() {
            return Err(format!("the pilot has the vehicle: {}", how_to_hand_back(&own.state)));
        }
        let own = own.state;
        match *action {
            VehicleAction::Arm => self.arm(&own, now),
            VehicleAction::Disarm => {
                self.on_ground(&own)?;
                self.take_over(Goal::Stay, command);
                Ok(Decision::Ask(Command::Disarm { force: false }))
            }
            VehicleAction::TakeOff { height_m } => {
                self.on_ground(&own)?;
                let ground_m = -own.position_ned_m.z;
                let height_m = (height_m + ground_m).max(self.config.limits.safe_height_m);
                let goal = Goal::Go { point: LocalPoint::from(own.position_ned_m), height_m, heading_rad: None };
                self.check(&goal)?;
                // As if no plan stood against it: a person asked.
                let before = self.direct.take();
                let flown = self.flown.take();
                self.take_over(goal.clone(), command);
                if let Some(reason) = self.obstacle_to_take_off(&own, &goal, now) {
                    self.direct = before;
                    self.flown = flown;
                    return Err(reason);
                }
                Ok(Decision::Accepted(format!("taking off to {height_m:.1} m above the water")))
            }
            VehicleAction::GoTo { point, height_m } => {
                self.in_air()?;
                let least_m = self.config.limits.safe_height_m;
                if height_m < least_m {
                    return Err(format!("{height_m:.1} m is below the safe height of {least_m:.1} m"));
                }
                let goal = Goal::Go { point, height_m, heading_rad: None };
                self.check(&goal)?;
                self.heeds(&goal).map_err(|refusal| refusal.to_string())?;
                self.take_over(goal, command);
                Ok(Decision::Accepted("on the way".into()))
            }
            VehicleAction::Follow { ref leader, slot } => {
                self.in_air()?;
                let goal = Goal::Follow { leader: leader.clone(), slot };
                self.check(&goal)?;
                self.heeds(&goal).map_err(|refusal| refusal.to_string())?;
                let track = self.neighbours.get(leader);
                interlock::may_follow(leader, track, &self.config.limits, &self.config.fail_safe, now)
                    .map_err(|refusal| refusal.to_string())?;
                self.take_over(goal, command);
                Ok(Decision::Accepted(format!("following {leader}")))
            }
            VehicleAction::Hold => {
                self.take_over(Goal::Stay, command);
                Ok(Decision::Accepted(if self.airborne { "holding" } else { "staying on the ground" }.into()))
            }
            VehicleAction::Land => {
                self.in_air()?;
                self.take_over(Goal::LandHere, command);
                Ok(Decision::Accepted("landing here".into()))
            }
            VehicleAction::Return => {
                self.in_air()?;
                self.take_over(Goal::Return, command);
                Ok(Decision::Accepted("returning".into()))
            }
            VehicleAction::SetHeading { heading_rad } => {
                self.in_air()?;
                let goal = self.turned(&own, heading_rad)?;
                self.check(&goal)?;
                self.take_over(goal, command);
                Ok(Decision::Accepted("turning".into()))
            }
            // All were dealt with above.
            VehicleAction::Terminate
            | VehicleAction::SetMode(_)
            | VehicleAction::ReadParameter { .. }
            | VehicleAction::ReadParameters
            | VehicleAction::SetParameter { .. }
            | VehicleAction::DownloadItems { .. }
            | VehicleAction::UploadItems { .. }
            | VehicleAction::ClearItems { .. }
            | VehicleAction::CancelTransfer
            | VehicleAction::ReleasePayload
            | VehicleAction::SecurePayload => Err("not here".into()),
        }
    }

    fn arm(&mut self, own: &VehicleState, now: Stamp) -> Result<Decision, String> {
        if own.armed {
            return Ok(Decision::Accepted("armed already".into()));
        }
        let mode = Family::named(own.firmware.as_ref()).take_off_from();
        if mode != FlightMode::Guided && own.mode == mode {
            // PX4 in HOLD, which is then ours, so that a take-off may follow.
            self.control.expect(mode, now);
        }
        // The autopilot's own checks decide, and say why not.
        Ok(Decision::Ask(Command::Arm))
    }

    fn set_mode(&mut self, mode: FlightMode, now: Stamp) -> Decision {
        if mode == FlightMode::Guided {
            // The one way back to the plan. The vehicle is ours again once the autopilot says GUIDED, not before: it may refuse,
            // and asking on would fight the pilot.
            self.direct = None;
            self.terminated = None;
            if !self.airborne {
                self.flown = None;
            }
            self.control.expect(mode, now);
        }
        // Any other mode is not ours: whoever sets it flies, and we keep our hands off.
        Decision::Ask(Command::SetMode(mode))
    }

    fn take_over(&mut self, goal: Goal, command: &VehicleCommand) {
        self.direct = Some(Direct { goal, who: command.who.clone(), instead_of: self.plan_goal.clone() });
        // Asked for anew: it takes off again even for what it has flown before.
        self.held = None;
    }

    /// The present goal, with a heading.
    fn turned(&self, own: &VehicleState, heading_rad: f64) -> Result<Goal, String> {
        let heading_rad = Some(heading_rad.rem_euclid(std::f64::consts::TAU));
        match self.goal() {
            Some(Goal::Go { point, height_m, .. }) => Ok(Goal::Go { point, height_m, heading_rad }),
            Some(Goal::Stay) | None => {
                let place = self.held.unwrap_or(own.position_ned_m);
                let height_m = (-place.z).max(self.config.limits.safe_height_m);
                Ok(Goal::Go { point: LocalPoint::from(place), height_m, heading_rad })
            }
            Some(_) => Err("the heading belongs to the task; hold first".into()),
        }
    }

    fn check(&self, goal: &Goal) -> Result<(), String> {
        self.problem(goal).map_or(Ok(()), Err)
    }

    fn in_air(&self) -> Result<(), String> {
        if self.airborne { Ok(()) } else { Err("on the ground: take off first".into()) }
    }

    fn on_ground(&self, own: &VehicleState) -> Result<(), String> {
        if self.airborne {
            return Err("in the air".into());
        }
        // Unknown is not on the ground, unless the motors are off.
        if own.armed && own.landed != LandedState::OnGround {
            return Err("not known to be on the ground".into());
        }
        Ok(())
    }
}

/// What is to be transferred, if that is what is asked for.
///
/// A parameter is written while the motors are off, unless who asks says that it is meant in flight, too. A new fence in flight
/// may be one that is broken already, and the autopilot would act on it, so a fence changes with the motors off only; a mission
/// and rally points are looked at when the pilot flies by them.
fn transfer(action: &VehicleAction, own: &VehicleState) -> Result<Option<Decision>, String> {
    let fence = |kind: ItemKind| {
        if kind == ItemKind::Fence && own.armed {
            return Err("armed: a fence is changed with the motors off".to_owned());
        }
        Ok(())
    };
    let request = match action {
        VehicleAction::ReadParameter { name } => Request::Read(name.clone()),
        VehicleAction::ReadParameters => Request::ReadAll,
        VehicleAction::SetParameter { name, value, even_in_flight } => {
            if own.armed && !even_in_flight {
                return Err(format!("armed: {name} is set with the motors off, or with even_in_flight"));
            }
            Request::Set(name.clone(), *value)
        }
        VehicleAction::DownloadItems { kind } => Request::Download(*kind),
        VehicleAction::UploadItems { kind, items } => {
            fence(*kind)?;
            if let Some((at, problem)) = items.iter().enumerate().find_map(|(at, item)| Some((at, item.problem(*kind)?))) {
                return Err(format!("item {}: {problem}", at + 1));
            }
            Request::Upload(*kind, items.clone())
        }
        VehicleAction::ClearItems { kind } => {
            fence(*kind)?;
            Request::Clear(*kind)
        }
        VehicleAction::CancelTransfer => return Ok(Some(Decision::CancelTransfers)),
        _ => return Ok(None),
    };
    Ok(Some(Decision::Transfer(request)))
}

fn name(action: &VehicleAction) -> &'static str {
    match action {
        VehicleAction::Arm => "arm",
        VehicleAction::Disarm => "disarm",
        VehicleAction::TakeOff { .. } => "take off",
        VehicleAction::GoTo { .. } => "go to",
        VehicleAction::Follow { .. } => "follow",
        VehicleAction::Hold => "hold",
        VehicleAction::Land => "land",
        VehicleAction::Return => "return",
        VehicleAction::SetMode(_) => "set mode",
        VehicleAction::SetHeading { .. } => "set heading",
        VehicleAction::Terminate => "terminate",
        VehicleAction::ReadParameter { .. } | VehicleAction::ReadParameters => "read parameters",
        VehicleAction::SetParameter { .. } => "set parameter",
        VehicleAction::DownloadItems { .. } => "download items",
        VehicleAction::UploadItems { .. } => "upload items",
        VehicleAction::ClearItems { .. } => "clear items",
        VehicleAction::CancelTransfer => "cancel transfer",
        VehicleAction::ReleasePayload => "release payload",
        VehicleAction::SecurePayload => "secure payload",
    }
}
