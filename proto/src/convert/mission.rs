use halcyon_model::{Approval, Mission, MissionPhase, MissionSpec, Stamp, Transition};

use super::geo::{point_from, point_to};
use super::sea::{estimate_from, estimate_to, verdict_state_from, verdict_state_to};
use crate::field::{FieldError, Within, header, id, known, optional, optional_id, positive, required, text, unspecified};
use crate::{SCHEMA_VERSION, Wire, v1};

pub(super) fn spec_to(spec: &MissionSpec) -> v1::MissionSpec {
    let approval = match spec.approval {
        Approval::Manual => v1::Approval::Manual,
        Approval::Automatic => v1::Approval::Automatic,
    };
    v1::MissionSpec {
        name: spec.name.clone(),
        point: Some(point_to(&spec.point)),
        survey_height_m: spec.survey_height_m,
        approval: approval.into(),
        dispatch_on_approval: spec.dispatch_on_approval,
        leader_id: spec.leader.as_ref().map(ToString::to_string).unwrap_or_default(),
        follower_id: spec.follower.as_ref().map(ToString::to_string).unwrap_or_default(),
    }
}

pub(super) fn spec_from(proto: v1::MissionSpec) -> Result<MissionSpec, FieldError> {
    Ok(MissionSpec {
        name: text("name", proto.name)?,
        point: required("point", proto.point, point_from)?,
        survey_height_m: positive("survey_height_m", proto.survey_height_m)?,
        approval: match known::<v1::Approval>("approval", proto.approval)? {
            v1::Approval::Unspecified => return Err(unspecified("approval")),
            v1::Approval::Manual => Approval::Manual,
            v1::Approval::Automatic => Approval::Automatic,
        },
        dispatch_on_approval: proto.dispatch_on_approval,
        leader: optional_id("leader_id", &proto.leader_id)?,
        follower: optional_id("follower_id", &proto.follower_id)?,
    })
}

/// Phases are numbered in order from 1; 0 is unspecified.
fn phase_to(phase: MissionPhase) -> i32 {
    let place = MissionPhase::ALL.iter().position(|&known| known == phase);
    place.and_then(|place| i32::try_from(place + 1).ok()).unwrap_or_default()
}

fn phase_from(path: &str, number: i32) -> Result<MissionPhase, FieldError> {
    if number == 0 {
        return Err(unspecified(path));
    }
    let phase = usize::try_from(number - 1).ok().and_then(|place| MissionPhase::ALL.get(place)).copied();
    phase.ok_or_else(|| FieldError::new(path, format!("has the unknown value {number}")))
}

impl Wire for Mission {
    const NAME: &'static str = "Mission";
    type Proto = v1::Mission;

    fn to_proto(&self) -> Self::Proto {
        let transition = |transition: &Transition| v1::Transition {
            stamp_ns: transition.stamp.as_nanos(),
            phase: phase_to(transition.phase),
            who: transition.who.clone(),
            why: transition.why.clone(),
        };
        v1::Mission {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            mission_id: self.id.to_string(),
            spec: Some(spec_to(&self.spec)),
            phase: phase_to(self.phase),
            leader_id: self.leader.as_ref().map(ToString::to_string).unwrap_or_default(),
            follower_id: self.follower.as_ref().map(ToString::to_string).unwrap_or_default(),
            verdict: self.verdict.map(verdict_state_to).unwrap_or_default(),
            h_s_m: self.h_s_m.as_ref().map(estimate_to),
            touchdown: self.touchdown.as_ref().map(point_to),
            history: self.history.iter().map(transition).collect(),
            release_problem: self.release_problem.clone().unwrap_or_default(),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        let transition = |proto: v1::Transition| {
            Ok(Transition {
                stamp: Stamp::from_nanos(proto.stamp_ns),
                phase: phase_from("phase", proto.phase)?,
                who: text("who", proto.who)?,
                why: text("why", proto.why)?,
            })
        };
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            id: id("mission_id", &proto.mission_id)?,
            spec: required("spec", proto.spec, spec_from)?,
            phase: phase_from("phase", proto.phase)?,
            leader: optional_id("leader_id", &proto.leader_id)?,
            follower: optional_id("follower_id", &proto.follower_id)?,
            verdict: verdict_state_from("verdict", proto.verdict)?,
            h_s_m: optional("h_s_m", proto.h_s_m, estimate_from)?,
            touchdown: optional("touchdown", proto.touchdown, point_from)?,
            release_problem: Some(text("release_problem", proto.release_problem)?).filter(|problem| !problem.is_empty()),
            history: proto.history.into_iter().map(transition).collect::<Result<_, _>>().within("history")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The model's order and the wire's numbers are written in two places; this holds them together.
    #[test]
    fn phases_carry_the_wire_names() {
        for phase in MissionPhase::ALL {
            let wire = v1::MissionPhase::try_from(phase_to(phase)).unwrap();
            assert_eq!(wire.as_str_name(), format!("MISSION_PHASE_{}", phase.as_str().to_uppercase()));
            assert_eq!(phase_from("phase", phase_to(phase)), Ok(phase));
        }
        assert!(phase_from("phase", 0).is_err() && phase_from("phase", 14).is_err() && phase_from("phase", -1).is_err());
    }
}
