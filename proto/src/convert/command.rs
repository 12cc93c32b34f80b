use halcyon_model::{CommandReply, FlightMode, MissionAction, MissionCommand, Stamp, VehicleAction, VehicleCommand};

use super::formation::{formation_from, formation_to};
use super::geo::{point_from, point_to};
use super::mission::{spec_from, spec_to};
use super::plan::{slot_from, slot_to};
use super::transfer::{content_from, content_to, items_from, items_to, kind_from, kind_to, name_from};
use crate::field::{FieldError, Within, finite, header, id, optional_id, positive, required, text};
use crate::{SCHEMA_VERSION, Wire, v1};

impl Wire for CommandReply {
    const NAME: &'static str = "CommandReply";
    type Proto = v1::CommandReply;

    fn to_proto(&self) -> Self::Proto {
        v1::CommandReply {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            accepted: self.accepted,
            reason: self.reason.clone(),
            mission_id: self.mission.as_ref().map(ToString::to_string).unwrap_or_default(),
            content: self.content.as_ref().map(content_to),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            accepted: proto.accepted,
            reason: text("reason", proto.reason)?,
            mission: optional_id("mission_id", &proto.mission_id)?,
            content: proto.content.map(content_from).transpose()?,
        })
    }
}

impl Wire for MissionCommand {
    const NAME: &'static str = "MissionCommand";
    type Proto = v1::MissionCommand;

    fn to_proto(&self) -> Self::Proto {
        use v1::mission_command::Action;
        let action = match &self.action {
            MissionAction::Create(id, spec) => {
                Action::Create(v1::CreateMission { mission_id: id.to_string(), spec: Some(spec_to(spec)) })
            }
            MissionAction::Approve(id) => Action::Approve(id.to_string()),
            MissionAction::Dispatch(id) => Action::Dispatch(id.to_string()),
            MissionAction::Pause(id) => Action::Pause(id.to_string()),
            MissionAction::Resume(id) => Action::Resume(id.to_string()),
            MissionAction::Abort(id) => Action::Abort(id.to_string()),
            MissionAction::Release(id) => Action::Release(id.to_string()),
            MissionAction::SkipRelease(id) => Action::SkipRelease(id.to_string()),
            MissionAction::Form(spec) => Action::Form(formation_to(spec)),
            MissionAction::Disband(leader) => Action::Disband(leader.to_string()),
        };
        v1::MissionCommand {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            deadline_ns: self.deadline.as_nanos(),
            who: self.who.clone(),
            action: Some(action),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        use v1::mission_command::Action;
        let action = match proto.action.ok_or_else(|| FieldError::new("action", "is missing"))? {
            Action::Create(create) => MissionAction::Create(
                id("create.mission_id", &create.mission_id)?,
                required("spec", create.spec, spec_from).within("create")?,
            ),
            Action::Approve(mission) => MissionAction::Approve(id("approve", &mission)?),
            Action::Dispatch(mission) => MissionAction::Dispatch(id("dispatch", &mission)?),
            Action::Pause(mission) => MissionAction::Pause(id("pause", &mission)?),
            Action::Resume(mission) => MissionAction::Resume(id("resume", &mission)?),
            Action::Abort(mission) => MissionAction::Abort(id("abort", &mission)?),
            Action::Release(mission) => MissionAction::Release(id("release", &mission)?),
            Action::SkipRelease(mission) => MissionAction::SkipRelease(id("skip_release", &mission)?),
            Action::Form(spec) => MissionAction::Form(formation_from(&spec)?),
            Action::Disband(leader) => MissionAction::Disband(id("disband", &leader)?),
        };
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            deadline: Stamp::from_nanos(proto.deadline_ns),
            who: text("who", proto.who)?,
            action,
        })
    }
}

fn action_to(action: &VehicleAction) -> v1::vehicle_command::Action {
    use v1::vehicle_command::Action;
    let nothing = v1::Nothing {};
    match action {
        VehicleAction::Arm => Action::Arm(nothing),
        VehicleAction::Disarm => Action::Disarm(nothing),
        VehicleAction::TakeOff { height_m } => Action::TakeOff(v1::TakeOff { height_m: *height_m }),
        VehicleAction::GoTo { point, height_m } => Action::GoTo(v1::GoTo { point: Some(point_to(point)), height_m: *height_m }),
        VehicleAction::Follow { leader, slot } => {
            Action::Follow(v1::FollowLeader { leader_id: leader.to_string(), slot: Some(slot_to(slot)) })
        }
        VehicleAction::Hold => Action::Hold(nothing),
        VehicleAction::Land => Action::Land(nothing),
        VehicleAction::Return => Action::ReturnHome(nothing),
        VehicleAction::SetMode(mode) => Action::SetMode(mode.copter_number()),
        VehicleAction::SetHeading { heading_rad } => Action::SetHeadingRad(*heading_rad),
        VehicleAction::Terminate => Action::Terminate(nothing),
        VehicleAction::ReadParameter { name } => Action::ReadParameter(name.to_string()),
        VehicleAction::ReadParameters => Action::ReadParameters(nothing),
        VehicleAction::SetParameter { name, value, even_in_flight } => {
            Action::SetParameter(v1::SetParameter { name: name.to_string(), value: *value, even_in_flight: *even_in_flight })
        }
        VehicleAction::DownloadItems { kind } => Action::DownloadItems(kind_to(*kind)),
        VehicleAction::UploadItems { kind, items } => {
            Action::UploadItems(v1::UploadItems { kind: kind_to(*kind), items: items_to(items) })
        }
        VehicleAction::ClearItems { kind } => Action::ClearItems(kind_to(*kind)),
        VehicleAction::CancelTransfer => Action::CancelTransfer(nothing),
        VehicleAction::ReleasePayload => Action::ReleasePayload(nothing),
        VehicleAction::SecurePayload => Action::SecurePayload(nothing),
    }
}

fn action_from(action: v1::vehicle_command::Action) -> Result<VehicleAction, FieldError> {
    use v1::vehicle_command::Action;
    Ok(match action {
        Action::Arm(_) => VehicleAction::Arm,
        Action::Disarm(_) => VehicleAction::Disarm,
        Action::TakeOff(take_off) => VehicleAction::TakeOff { height_m: positive("take_off.height_m", take_off.height_m)? },
        Action::GoTo(go_to) => VehicleAction::GoTo {
            point: required("point", go_to.point, point_from).within("go_to")?,
            height_m: positive("go_to.height_m", go_to.height_m)?,
        },
        Action::Follow(follow) => VehicleAction::Follow {
            leader: id("follow.leader_id", &follow.leader_id)?,
            slot: required("slot", follow.slot, slot_from).within("follow")?,
        },
        Action::Hold(_) => VehicleAction::Hold,
        Action::Land(_) => VehicleAction::Land,
        Action::ReturnHome(_) => VehicleAction::Return,
        Action::SetMode(number) => VehicleAction::SetMode(FlightMode::from_copter(number)),
        Action::SetHeadingRad(heading_rad) => {
            VehicleAction::SetHeading { heading_rad: finite("set_heading_rad", heading_rad)? }
        }
        Action::Terminate(_) => VehicleAction::Terminate,
        Action::ReadParameter(name) => VehicleAction::ReadParameter { name: name_from("read_parameter", name)? },
        Action::ReadParameters(_) => VehicleAction::ReadParameters,
        Action::SetParameter(set) => VehicleAction::SetParameter {
            name: name_from("set_parameter.name", set.name)?,
            value: finite("set_parameter.value", set.value)?,
            even_in_flight: set.even_in_flight,
        },
        Action::DownloadItems(kind) => VehicleAction::DownloadItems { kind: kind_from("download_items", kind)? },
        Action::UploadItems(upload) => VehicleAction::UploadItems {
            kind: kind_from("upload_items.kind", upload.kind)?,
            items: items_from("upload_items.items", upload.items)?,
        },
        Action::ClearItems(kind) => VehicleAction::ClearItems { kind: kind_from("clear_items", kind)? },
        Action::CancelTransfer(_) => VehicleAction::CancelTransfer,
        Action::ReleasePayload(_) => VehicleAction::ReleasePayload,
        Action::SecurePayload(_) => VehicleAction::SecurePayload,
    })
}

impl Wire for VehicleCommand {
    const NAME: &'static str = "VehicleCommand";
    type Proto = v1::VehicleCommand;

    fn to_proto(&self) -> Self::Proto {
        v1::VehicleCommand {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            deadline_ns: self.deadline.as_nanos(),
            who: self.who.clone(),
            vehicle_id: self.vehicle.to_string(),
            action: Some(action_to(&self.action)),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            deadline: Stamp::from_nanos(proto.deadline_ns),
            who: text("who", proto.who)?,
            vehicle: id("vehicle_id", &proto.vehicle_id)?,
            action: required("action", proto.action, action_from)?,
        })
    }
}
