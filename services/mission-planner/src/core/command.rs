//! Commands: checked at the edge, carried out at once, answered with a reason.

use halcyon_model::{
    CommandReply, LocalPoint, MissionAction, MissionCommand, MissionId, MissionPhase, MissionSpec, Role, Stamp,
};

use super::fleet::role_name;
use super::flow::Step;
use super::live::Live;
use super::planner::{Planner, enter};
use super::record::{Effects, Record};
use super::release::landed;

/// Characters of a name of a mission or of a person.
const NAME_MAX: usize = 128;
/// Steps after which a mission takes no more pauses, so that nobody can make its history grow without end.
const HISTORY_MAX: usize = 300;

/// What a command came to: done, or done before, or refused; each with words.
enum Outcome {
    Done(String),
    Refused(String),
}
use Outcome::{Done, Refused};

impl Planner {
    /// Carries out a command, or refuses it with a reason. The same creation again is answered as before; so is an approval, a
    /// dispatch, a pause or an abort of what already is so.
    pub fn command(&mut self, command: &MissionCommand, now: Stamp) -> (CommandReply, Effects) {
        let mut effects = Effects::default();
        let outcome = match self.check(command, now) {
            Err(reason) => Refused(reason),
            Ok(()) => self.carry_out(command, now, &mut effects),
        };
        let reply = match outcome {
            Refused(reason) => CommandReply::refused(now, reason),
            Done(reason) => {
                self.retire(now, &mut effects);
                self.advance(now, &mut effects);
                let mission = match &command.action {
                    MissionAction::Create(id, _)
                    | MissionAction::Approve(id)
                    | MissionAction::Dispatch(id)
                    | MissionAction::Pause(id)
                    | MissionAction::Resume(id)
                    | MissionAction::Abort(id)
                    | MissionAction::Release(id)
                    | MissionAction::SkipRelease(id) => Some(id.clone()),
                    MissionAction::Form(_) | MissionAction::Disband(_) => None,
                };
                CommandReply { mission, ..CommandReply::accepted(now, reason) }
            }
        };
        (reply, effects)
    }

    /// What every command must satisfy.
    fn check(&self, command: &MissionCommand, now: Stamp) -> Result<(), String> {
        let ahead_s = command.stamp.seconds_since(now);
        if ahead_s > self.config.clock_skew_max_s {
            return Err(format!("the command is stamped {ahead_s:.1} s in the future"));
        }
        if command.deadline < command.stamp {
            return Err("the command's deadline is before its stamp".into());
        }
        let late_s = now.seconds_since(command.deadline);
        if late_s > 0.0 {
            return Err(format!("the command's deadline passed {late_s:.1} s ago"));
        }
        if command.who.trim().is_empty() || command.who.len() > NAME_MAX {
            return Err(format!("a command must say who gives it, in at most {NAME_MAX} characters"));
        }
        Ok(())
    }

    fn carry_out(&mut self, command: &MissionCommand, now: Stamp, effects: &mut Effects) -> Outcome {
        let who = command.who.as_str();
        match &command.action {
            MissionAction::Create(id, spec) => self.create(id, spec, who, now, effects),
            MissionAction::Approve(id) => self.on_live(id, |planner, live| planner.approve(live, false, who, now, effects)),
            MissionAction::Dispatch(id) => self.on_live(id, |planner, live| planner.approve(live, true, who, now, effects)),
            MissionAction::Pause(id) => self.on_live(id, |_, live| pause(live, who, now, effects)),
            MissionAction::Resume(id) => self.on_live(id, |_, live| resume(live, who, now, effects)),
            MissionAction::Abort(id) => {
                if let Some((_, MissionPhase::Aborted)) = self.finished.get(id) {
                    return Done(format!("mission {id} is aborted"));
                }
                self.on_live(id, |_, live| {
                    let why = format!("aborted while {}", phase_name(live.mission.phase));
                    enter(live, (MissionPhase::Aborted, why), who, now, effects);
                    Done(format!("mission {id} is aborted"))
                })
            }
            MissionAction::Release(id) => self.on_live(id, |_, live| release(live, who, now, effects)),
            MissionAction::SkipRelease(id) => self.on_live(id, |_, live| skip_release(live, who, now, effects)),
            MissionAction::Form(spec) => self.form(spec, who, now, effects).map_or_else(Refused, Done),
            MissionAction::Disband(leader) => match self.disband(leader, who, now, effects) {
                Some(count) => Done(format!("{count} followers of {leader} return")),
                None => Refused(format!("{leader} has no formation")),
            },
        }
    }

    /// Runs `act` on a mission under way. It is taken out meanwhile, so that `act` may look at the rest.
    fn on_live(&mut self, id: &MissionId, act: impl FnOnce(&Self, &mut Live) -> Outcome) -> Outcome {
        let Some(index) = self.live.iter().position(|live| live.mission.id == *id) else {
            return Refused(match self.finished.get(id) {
                Some((_, phase)) => format!("mission {id} has already {}", phase_name(*phase)),
                None => format!("there is no mission {id}"),
            });
        };
        let mut live = self.live.remove(index);
        let outcome = act(self, &mut live);
        self.live.insert(index, live);
        outcome
    }

    fn create(&mut self, id: &MissionId, spec: &MissionSpec, who: &str, now: Stamp, effects: &mut Effects) -> Outcome {
        let known = self.live.iter().find(|live| live.mission.id == *id).map(|live| &live.mission.spec);
        if let Some(known) = known.or_else(|| self.finished.get(id).map(|(spec, _)| spec)) {
            return if known == spec {
                Done(format!("mission {id} is created"))
            } else {
                Refused(format!("there is already a mission {id}, with other content"))
            };
        }
        if let Err(reason) = self.check_spec(spec) {
            return Refused(reason);
        }
        let mut live = Live::new(id.clone(), spec.clone(), now);
        effects.records.push(Record::Created { id: id.clone(), spec: spec.clone() });
        enter(&mut live, (MissionPhase::Waiting, "created".into()), who, now, effects);
        self.live.push(live);
        Done(format!("mission {id} is created"))
    }

    fn check_spec(&self, spec: &MissionSpec) -> Result<(), String> {
        let config = &self.config;
        if spec.name.len() > NAME_MAX {
            return Err(format!("a mission's name must have at most {NAME_MAX} characters"));
        }
        let range_m = spec.point.distance_m(&LocalPoint::new(0.0, 0.0));
        if !range_m.is_finite() {
            return Err("the point must be finite".into());
        }
        if range_m > config.range_max_m {
            return Err(format!(
                "the point is {range_m:.0} m from the fleet's origin, at most {:.0} m are allowed",
                config.range_max_m
            ));
        }
        let (low_m, high_m) = (config.survey_height_min_m, config.survey_height_max_m);
        if !(low_m..=high_m).contains(&spec.survey_height_m) {
            return Err(format!("the survey height must be {low_m} to {high_m} m, not {} m", spec.survey_height_m));
        }
        for (named, role) in [(&spec.leader, Role::Leader), (&spec.follower, Role::Follower)] {
            let Some(vehicle) = named else { continue };
            match self.fleet.last(vehicle) {
                None => return Err(format!("vehicle {vehicle} is not known")),
                Some(state) if state.role != role => {
                    return Err(format!("{vehicle} is a {}, not a {}", role_name(state.role), role_name(role)));
                }
                Some(_) => {}
            }
        }
        if self.live.len() >= config.missions_max {
            return Err(format!("{} missions are under way already", self.live.len()));
        }
        for live in &self.live {
            let apart_m = live.spot().distance_m(&spec.point);
            if apart_m < config.spot_separation_m {
                return Err(format!(
                    "the spot of mission {} is {apart_m:.1} m away, at least {} m are needed",
                    live.mission.id, config.spot_separation_m
                ));
            }
        }
        Ok(())
    }

    /// Approves, and with `dispatch` also sends the follower.
    fn approve(&self, live: &mut Live, dispatch: bool, who: &str, now: Stamp, effects: &mut Effects) -> Outcome {
        let id = live.mission.id.clone();
        match live.mission.phase {
            MissionPhase::AwaitingApproval => {
                // The verdict may have expired since the last step.
                let world = self.world(now);
                if live.safe_sea(&world).is_none() {
                    return Refused("the verdict is not safe now".into());
                }
                live.course.dispatch = dispatch;
                let why = if dispatch { "approved and dispatched" } else { "approved" };
                enter(live, (MissionPhase::Approved, why.into()), who, now, effects);
                Done(format!("mission {id} is {why}"))
            }
            MissionPhase::Approved if dispatch && !live.course.dispatch => {
                live.course.dispatch = true;
                enter(live, (MissionPhase::Approved, "dispatched".into()), who, now, effects);
                Done(format!("mission {id} is dispatched"))
            }
            MissionPhase::Approved => Done(format!("mission {id} is {}", if dispatch { "dispatched" } else { "approved" })),
            MissionPhase::Joining | MissionPhase::Clearing | MissionPhase::Landing | MissionPhase::Releasing => {
                Done(format!("mission {id} is {}", if dispatch { "dispatched" } else { "approved" }))
            }
            phase => {
                let what = if dispatch { "dispatched" } else { "approved" };
                Refused(format!("mission {id} is {}; it can be {what} once its verdict is safe", phase_name(phase)))
            }
        }
    }
}

fn pause(live: &mut Live, who: &str, now: Stamp, effects: &mut Effects) -> Outcome {
    let phase = live.mission.phase;
    let id = live.mission.id.clone();
    if phase != MissionPhase::Paused {
        if live.mission.history.len() >= HISTORY_MAX {
            return Refused(format!("mission {id} has been through {HISTORY_MAX} steps; it can only go on or be aborted"));
        }
        live.course.paused_from = Some(phase);
        let step: Step = (MissionPhase::Paused, format!("paused while {}", phase_name(phase)));
        enter(live, step, who, now, effects);
    }
    Done(format!("mission {id} is paused"))
}

fn resume(live: &mut Live, who: &str, now: Stamp, effects: &mut Effects) -> Outcome {
    let id = live.mission.id.clone();
    let Some(phase) = live.course.paused_from.take().filter(|_| live.mission.phase == MissionPhase::Paused) else {
        return Refused(format!("mission {id} is not paused"));
    };
    enter(live, (phase, "resumed".into()), who, now, effects);
    Done(format!("mission {id} goes on"))
}

/// Once more, after a refusal or no answer.
fn release(live: &mut Live, who: &str, now: Stamp, effects: &mut Effects) -> Outcome {
    let id = live.mission.id.clone();
    if let Some(reason) = no_release(live) {
        return Refused(reason);
    }
    if live.mission.release_problem.is_some() {
        if live.mission.history.len() >= HISTORY_MAX {
            return Refused(format!("mission {id} has been through {HISTORY_MAX} steps; the release can only be skipped"));
        }
        live.mission.release_problem = None;
        enter(live, (MissionPhase::Releasing, "release again".into()), who, now, effects);
    }
    Done(format!("mission {id} lets its payload go"))
}

/// Completed all the same; that the payload is still held stays on record.
fn skip_release(live: &mut Live, who: &str, now: Stamp, effects: &mut Effects) -> Outcome {
    let id = live.mission.id.clone();
    if let Some(reason) = no_release(live) {
        return Refused(reason);
    }
    let Some(problem) = live.mission.release_problem.clone() else {
        return Refused(format!("mission {id} still waits for the payload's answer"));
    };
    let why = format!("{}; the payload was not released ({problem}), and that was skipped", landed(live));
    enter(live, (MissionPhase::Completed, why), who, now, effects);
    Done(format!("mission {id} is completed with its payload held"))
}

fn no_release(live: &Live) -> Option<String> {
    let phase = live.mission.phase;
    (phase != MissionPhase::Releasing).then(|| format!("mission {} is {}, not releasing", live.mission.id, phase_name(phase)))
}

/// A phase in words.
fn phase_name(phase: MissionPhase) -> &'static str {
    match phase {
        MissionPhase::AwaitingApproval => "awaiting approval",
        other => other.as_str(),
    }
}
