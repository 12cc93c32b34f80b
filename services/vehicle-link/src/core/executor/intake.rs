//! Taking in plans.

use std::collections::BTreeMap;

use halcyon_model::{DispatchPlan, Severity, Slot, Stamp, Task, VehicleId};

use super::{Executor, Goal, PlanSeen};
use crate::core::interlock;

/// What became of a plan.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanAnswer {
    /// It is in force.
    Accepted,
    /// It is the one in force already.
    Known,
    /// A newer one has been seen, or another with the same number.
    RefusedOlder {
        /// The newest seen.
        seen: u64,
    },
    /// Its task for this vehicle can't be flown; the vehicle keeps its old task, which will lapse.
    RefusedInvalid(String),
}

impl Executor {
    /// A plan came. The number decides: an older one is refused whatever it says.
    pub fn observe_plan(&mut self, plan: &DispatchPlan, now: Stamp) -> PlanAnswer {
        self.watch_clock(now);
        let seen = self.plan_generation();
        // However wrong the clock that wrote it, or ours: nothing is believed for longer after it came than it was to hold after
        // it was written, nor for ever.
        let longest_s = self.config.fail_safe.validity_s_max;
        let latest = |until: Stamp| now.plus_secs_f64(until.seconds_since(plan.stamp).min(longest_s)).min(until);
        let task = plan.task_for(&self.config.vehicle);
        let mut goal = task.map(Goal::from_task);
        if let Some(Goal::Land { clearance: Some(clearance), .. }) = &mut goal {
            clearance.valid_until = latest(clearance.valid_until);
        }
        if plan.generation < seen {
            return PlanAnswer::RefusedOlder { seen };
        }
        if plan.generation == seen && self.plan.is_some() {
            // History and repeats deliver the same plan again; its validity, capped at receipt, is not extended by that.
            return PlanAnswer::Known;
        }
        if let Some(problem) = goal.as_ref().and_then(|goal| self.problem(goal)) {
            self.note(Severity::Warning, format!("plan {} refused", plan.generation), problem.clone());
            return PlanAnswer::RefusedInvalid(problem);
        }
        self.formation = formation(plan);
        let valid_until = latest(plan.valid_until);
        self.plan = Some(PlanSeen { generation: plan.generation, valid_until, assigned: goal.is_some() });
        if let Some(goal) = goal {
            let changed = |direct: &super::Direct| !direct.instead_of.as_ref().is_some_and(|old| old.is_same_as(&goal));
            if let Some(direct) = self.direct.take_if(|direct| changed(direct)) {
                let why = format!("plan {} has a new task, after a command by {}", plan.generation, direct.who);
                self.note(Severity::Info, "back to the plan", why);
            }
            self.plan_goal = Some(goal);
        }
        PlanAnswer::Accepted
    }

    /// Why a goal can't be flown, if it can't.
    pub(super) fn problem(&self, goal: &Goal) -> Option<String> {
        if !goal.is_finite() {
            return Some("a number in the task is not finite".into());
        }
        if let Some(point) = goal.place() {
            let distance_m = point.vector().norm();
            let radius_m = self.config.fail_safe.fence_radius_m;
            if distance_m > radius_m {
                return Some(format!("{distance_m:.0} m from the origin is outside the fence of {radius_m:.0} m"));
            }
        }
        if let Some(height_m) = goal.height_m() {
            let (least_m, most_m) = (self.config.limits.survey_height_m_min, self.config.fail_safe.fence_height_m);
            if !(least_m..=most_m).contains(&height_m) {
                return Some(format!("a height of {height_m:.1} m is outside {least_m:.1} to {most_m:.0} m"));
            }
        }
        if let Goal::Follow { leader, slot } = goal {
            if *leader == self.config.vehicle {
                return Some("a vehicle can't follow itself".into());
            }
            return interlock::slot_is_clear(slot, &self.config.limits).err().map(|refusal| refusal.to_string());
        }
        None
    }
}

/// Who follows whom where.
fn formation(plan: &DispatchPlan) -> BTreeMap<VehicleId, (VehicleId, Slot)> {
    let followers = plan.assignments.iter().filter_map(|assignment| match &assignment.task {
        Task::Follow { leader, slot } => Some((assignment.vehicle.clone(), (leader.clone(), *slot))),
        _ => None,
    });
    followers.collect()
}
