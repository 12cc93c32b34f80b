use halcyon_model::{Assignment, Clearance, DispatchPlan, Slot, Stamp, Task};

use super::geo::{point_from, point_to};
use super::sea::{verdict_state_from, verdict_state_to, window_from, window_to};
use crate::field::{
    FieldError, Within, finite, header, id, optional, optional_id, optionally, positive, required, unspecified,
};
use crate::{SCHEMA_VERSION, Wire, v1};

pub(super) fn slot_to(slot: &Slot) -> v1::Slot {
    v1::Slot { forward_m: slot.forward_m, right_m: slot.right_m, up_m: slot.up_m }
}

pub(super) fn slot_from(proto: v1::Slot) -> Result<Slot, FieldError> {
    Ok(Slot {
        forward_m: finite("forward_m", proto.forward_m)?,
        right_m: finite("right_m", proto.right_m)?,
        up_m: finite("up_m", proto.up_m)?,
    })
}

/// More calm windows than this are not taken: the soonest count.
const WINDOWS_MAX: usize = 8;

fn clearance_from(proto: v1::Clearance) -> Result<Clearance, FieldError> {
    Ok(Clearance {
        verdict: verdict_state_from("verdict", proto.verdict)?.ok_or_else(|| unspecified("verdict"))?,
        sea_state_stamp: Stamp::from_nanos(proto.sea_state_stamp_ns),
        valid_until: Stamp::from_nanos(proto.valid_until_ns),
        windows: proto.windows.into_iter().take(WINDOWS_MAX).map(window_from).collect::<Result<_, _>>()?,
    })
}

fn task_to(task: &Task) -> v1::assignment::Task {
    use v1::assignment::Task as Wired;
    match task {
        Task::Hold => Wired::Hold(v1::HoldTask {}),
        Task::Survey { point, height_m, heading_rad } => {
            Wired::Survey(v1::SurveyTask { point: Some(point_to(point)), height_m: *height_m, heading_rad: *heading_rad })
        }
        Task::Follow { leader, slot } => {
            Wired::Follow(v1::FollowTask { leader_id: leader.to_string(), slot: Some(slot_to(slot)) })
        }
        Task::Land { point, approach_height_m, clearance } => Wired::Land(v1::LandTask {
            point: Some(point_to(point)),
            approach_height_m: *approach_height_m,
            clearance: clearance.as_ref().map(|clearance| v1::Clearance {
                verdict: verdict_state_to(clearance.verdict),
                sea_state_stamp_ns: clearance.sea_state_stamp.as_nanos(),
                valid_until_ns: clearance.valid_until.as_nanos(),
                windows: clearance.windows.iter().map(window_to).collect(),
            }),
        }),
        Task::Return => Wired::ReturnHome(v1::ReturnTask {}),
    }
}

fn task_from(task: v1::assignment::Task) -> Result<Task, FieldError> {
    use v1::assignment::Task as Wired;
    Ok(match task {
        Wired::Hold(_) => Task::Hold,
        Wired::Survey(survey) => Task::Survey {
            point: required("point", survey.point, point_from).within("survey")?,
            height_m: positive("survey.height_m", survey.height_m)?,
            heading_rad: optionally("survey.heading_rad", survey.heading_rad, finite)?,
        },
        Wired::Follow(follow) => Task::Follow {
            leader: id("follow.leader_id", &follow.leader_id)?,
            slot: required("slot", follow.slot, slot_from).within("follow")?,
        },
        Wired::Land(land) => Task::Land {
            point: required("point", land.point, point_from).within("land")?,
            approach_height_m: positive("land.approach_height_m", land.approach_height_m)?,
            clearance: optional("clearance", land.clearance, clearance_from).within("land")?,
        },
        Wired::ReturnHome(_) => Task::Return,
    })
}

impl Wire for DispatchPlan {
    const NAME: &'static str = "DispatchPlan";
    type Proto = v1::DispatchPlan;

    fn to_proto(&self) -> Self::Proto {
        let assignment = |assignment: &Assignment| v1::Assignment {
            vehicle_id: assignment.vehicle.to_string(),
            task: Some(task_to(&assignment.task)),
        };
        v1::DispatchPlan {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            generation: self.generation,
            mission_id: self.mission.as_ref().map(ToString::to_string).unwrap_or_default(),
            valid_until_ns: self.valid_until.as_nanos(),
            assignments: self.assignments.iter().map(assignment).collect(),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        let assignment = |proto: v1::Assignment| {
            Ok(Assignment { vehicle: id("vehicle_id", &proto.vehicle_id)?, task: required("task", proto.task, task_from)? })
        };
        let assignments: Vec<Assignment> =
            proto.assignments.into_iter().map(assignment).collect::<Result<_, _>>().within("assignments")?;
        let mut seen = std::collections::BTreeSet::new();
        for assignment in &assignments {
            if !seen.insert(&assignment.vehicle) {
                return Err(FieldError::new("assignments", format!("name the vehicle {} twice", assignment.vehicle)));
            }
        }
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            generation: proto.generation,
            mission: optional_id("mission_id", &proto.mission_id)?,
            valid_until: Stamp::from_nanos(proto.valid_until_ns),
            assignments,
        })
    }
}

#[cfg(test)]
mod tests {
    use halcyon_model::{CalmWindow, VerdictState};

    use super::*;

    #[test]
    fn a_clearances_windows_travel_and_no_more_than_count() {
        let t = |s: f64| Stamp::from_secs_f64(1000.0 + s);
        let window = |index: u32| CalmWindow { from: t(f64::from(index)), to: t(f64::from(index) + 0.5) };
        let given = |count: u32| Task::Land {
            point: halcyon_model::LocalPoint::new(1.0, 2.0),
            approach_height_m: 5.0,
            clearance: Some(Clearance {
                verdict: VerdictState::Safe,
                sea_state_stamp: t(0.0),
                valid_until: t(9.0),
                windows: (0..count).map(window).collect(),
            }),
        };
        for count in [0, 3, WINDOWS_MAX as u32] {
            assert_eq!(task_from(task_to(&given(count))), Ok(given(count)));
        }
        assert_eq!(task_from(task_to(&given(20))), Ok(given(WINDOWS_MAX as u32)));
        let mut backwards = given(1);
        if let Task::Land { clearance: Some(clearance), .. } = &mut backwards {
            clearance.windows = vec![CalmWindow { from: t(2.0), to: t(1.0) }];
        }
        assert!(task_from(task_to(&backwards)).is_err());
    }
}
