use halcyon_model::{
    Activity, Ages, Firmware, Fix, FlightMode, Intent, LandedState, LinkQuality, Range, Role, SimTruth, Stamp, VehicleState,
};

use super::geo::{geodetic_from, geodetic_to, point_from, point_to, rotation_from, rotation_to, vector_from, vector_to};
use crate::field::{
    FieldError, finite, fraction, header, id, known, non_negative, optional, optionally, required, text, unspecified,
};
use crate::{SCHEMA_VERSION, Wire, v1};

fn role_from(number: i32) -> Result<Role, FieldError> {
    match known::<v1::Role>("role", number)? {
        v1::Role::Unspecified => Err(unspecified("role")),
        v1::Role::Leader => Ok(Role::Leader),
        v1::Role::Follower => Ok(Role::Follower),
    }
}

fn landed_to(landed: LandedState) -> v1::LandedState {
    match landed {
        LandedState::Unknown => v1::LandedState::Unknown,
        LandedState::OnGround => v1::LandedState::OnGround,
        LandedState::TakingOff => v1::LandedState::TakingOff,
        LandedState::InAir => v1::LandedState::InAir,
        LandedState::Landing => v1::LandedState::Landing,
    }
}

fn landed_from(number: i32) -> Result<LandedState, FieldError> {
    Ok(match known::<v1::LandedState>("landed", number)? {
        v1::LandedState::Unknown => LandedState::Unknown,
        v1::LandedState::OnGround => LandedState::OnGround,
        v1::LandedState::TakingOff => LandedState::TakingOff,
        v1::LandedState::InAir => LandedState::InAir,
        v1::LandedState::Landing => LandedState::Landing,
    })
}

fn activity_to(activity: &Activity) -> v1::Activity {
    use v1::ActivityKind as Kind;
    let (kind, settled, slot_error_m, reason) = match activity {
        Activity::Idle => (Kind::Idle, false, 0.0, ""),
        Activity::Preparing => (Kind::Preparing, false, 0.0, ""),
        Activity::TakingOff => (Kind::TakingOff, false, 0.0, ""),
        Activity::Transit => (Kind::Transit, false, 0.0, ""),
        Activity::Holding { settled } => (Kind::Holding, *settled, 0.0, ""),
        Activity::Following { settled, slot_error_m } => (Kind::Following, *settled, *slot_error_m, ""),
        Activity::Approaching => (Kind::Approaching, false, 0.0, ""),
        Activity::Descending => (Kind::Descending, false, 0.0, ""),
        Activity::Landed => (Kind::Landed, false, 0.0, ""),
        Activity::Returning => (Kind::Returning, false, 0.0, ""),
        Activity::FailSafe { reason } => (Kind::FailSafe, false, 0.0, reason.as_str()),
        Activity::PilotControl => (Kind::PilotControl, false, 0.0, ""),
    };
    v1::Activity { kind: kind.into(), settled, slot_error_m, reason: reason.to_owned() }
}

fn activity_from(proto: v1::Activity) -> Result<Activity, FieldError> {
    use v1::ActivityKind as Kind;
    Ok(match known::<Kind>("kind", proto.kind)? {
        Kind::Unspecified => return Err(unspecified("kind")),
        Kind::Idle => Activity::Idle,
        Kind::Preparing => Activity::Preparing,
        Kind::TakingOff => Activity::TakingOff,
        Kind::Transit => Activity::Transit,
        Kind::Holding => Activity::Holding { settled: proto.settled },
        Kind::Following => {
            Activity::Following { settled: proto.settled, slot_error_m: non_negative("slot_error_m", proto.slot_error_m)? }
        }
        Kind::Approaching => Activity::Approaching,
        Kind::Descending => Activity::Descending,
        Kind::Landed => Activity::Landed,
        Kind::Returning => Activity::Returning,
        Kind::FailSafe => Activity::FailSafe { reason: text("reason", proto.reason)? },
        Kind::PilotControl => Activity::PilotControl,
    })
}

fn fix_from(proto: v1::Fix) -> Result<Fix, FieldError> {
    Ok(Fix {
        kind: proto.kind,
        satellites: proto.satellites,
        horizontal_sigma_m: optionally("horizontal_sigma_m", proto.horizontal_sigma_m, non_negative)?,
    })
}

fn intent_to(intent: &Intent) -> v1::Intent {
    v1::Intent {
        stamp_ns: intent.stamp.as_nanos(),
        position_ned_m: Some(vector_to(&intent.position_ned_m)),
        velocity_ned_mps: Some(vector_to(&intent.velocity_ned_mps)),
        acceleration_ned_mps2: Some(vector_to(&intent.acceleration_ned_mps2)),
    }
}

fn intent_from(proto: v1::Intent) -> Result<Intent, FieldError> {
    Ok(Intent {
        stamp: Stamp::from_nanos(proto.stamp_ns),
        position_ned_m: required("position_ned_m", proto.position_ned_m, vector_from)?,
        velocity_ned_mps: required("velocity_ned_mps", proto.velocity_ned_mps, vector_from)?,
        acceleration_ned_mps2: required("acceleration_ned_mps2", proto.acceleration_ned_mps2, vector_from)?,
    })
}

fn range_from(proto: v1::Range) -> Result<Range, FieldError> {
    Ok(Range { stamp: Stamp::from_nanos(proto.stamp_ns), distance_m: non_negative("distance_m", proto.distance_m)? })
}

fn ages_to(ages: &Ages) -> v1::Ages {
    let Ages { mode_s, attitude_s, landed_s, battery_s, fix_s, estimator_s, home_s } = *ages;
    v1::Ages { mode_s, attitude_s, landed_s, battery_s, fix_s, estimator_s, home_s }
}

fn ages_from(proto: v1::Ages) -> Result<Ages, FieldError> {
    Ok(Ages {
        mode_s: optionally("mode_s", proto.mode_s, non_negative)?,
        attitude_s: optionally("attitude_s", proto.attitude_s, non_negative)?,
        landed_s: optionally("landed_s", proto.landed_s, non_negative)?,
        battery_s: optionally("battery_s", proto.battery_s, non_negative)?,
        fix_s: optionally("fix_s", proto.fix_s, non_negative)?,
        estimator_s: optionally("estimator_s", proto.estimator_s, non_negative)?,
        home_s: optionally("home_s", proto.home_s, non_negative)?,
    })
}

fn link_to(link: &LinkQuality) -> v1::LinkQuality {
    let LinkQuality { loss, round_trip_s, received, is_signed } = *link;
    v1::LinkQuality { loss, round_trip_s, received, is_signed }
}

fn link_from(proto: v1::LinkQuality) -> Result<LinkQuality, FieldError> {
    Ok(LinkQuality {
        loss: fraction("loss", proto.loss)?,
        round_trip_s: optionally("round_trip_s", proto.round_trip_s, non_negative)?,
        received: proto.received,
        is_signed: proto.is_signed,
    })
}

fn firmware_to(firmware: &Firmware) -> v1::Firmware {
    let Firmware { autopilot, vehicle, version } = firmware.clone();
    v1::Firmware { autopilot, vehicle, version }
}

fn firmware_from(proto: v1::Firmware) -> Result<Firmware, FieldError> {
    Ok(Firmware {
        autopilot: text("autopilot", proto.autopilot)?,
        vehicle: text("vehicle", proto.vehicle)?,
        version: text("version", proto.version)?,
    })
}

impl Wire for VehicleState {
    const NAME: &'static str = "VehicleState";
    type Proto = v1::VehicleState;

    fn to_proto(&self) -> Self::Proto {
        let role = match self.role {
            Role::Leader => v1::Role::Leader,
            Role::Follower => v1::Role::Follower,
        };
        let fix =
            |fix: &Fix| v1::Fix { kind: fix.kind, satellites: fix.satellites, horizontal_sigma_m: fix.horizontal_sigma_m };
        v1::VehicleState {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            vehicle_id: self.vehicle.to_string(),
            role: role.into(),
            position: Some(geodetic_to(&self.position)),
            position_ned_m: Some(vector_to(&self.position_ned_m)),
            velocity_ned_mps: Some(vector_to(&self.velocity_ned_mps)),
            ned_from_body: Some(rotation_to(&self.ned_from_body)),
            heading_rad: self.heading_rad,
            home: self.home.as_ref().map(geodetic_to),
            mode: self.mode.copter_number(),
            armed: self.armed,
            landed: landed_to(self.landed).into(),
            battery_fraction: self.battery_fraction,
            battery_v: self.battery_v,
            fix: self.fix.as_ref().map(fix),
            estimator_ok: self.estimator_ok,
            ready_to_arm: self.ready_to_arm,
            boot_s: self.boot_s,
            activity: Some(activity_to(&self.activity)),
            plan_generation: self.plan_generation,
            touchdown: self.touchdown.as_ref().map(point_to),
            acceleration_ned_mps2: self.acceleration_ned_mps2.as_ref().map(vector_to),
            intent: self.intent.as_ref().map(intent_to),
            range: self
                .range
                .as_ref()
                .map(|range| v1::Range { stamp_ns: range.stamp.as_nanos(), distance_m: range.distance_m }),
            ages: Some(ages_to(&self.ages)),
            link: self.link.as_ref().map(link_to),
            firmware: self.firmware.as_ref().map(firmware_to),
            has_payload: self.has_payload,
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            vehicle: id("vehicle_id", &proto.vehicle_id)?,
            role: role_from(proto.role)?,
            position: required("position", proto.position, geodetic_from)?,
            position_ned_m: required("position_ned_m", proto.position_ned_m, vector_from)?,
            velocity_ned_mps: required("velocity_ned_mps", proto.velocity_ned_mps, vector_from)?,
            ned_from_body: required("ned_from_body", proto.ned_from_body, rotation_from)?,
            heading_rad: finite("heading_rad", proto.heading_rad)?,
            home: optional("home", proto.home, geodetic_from)?,
            mode: FlightMode::from_copter(proto.mode),
            armed: proto.armed,
            landed: landed_from(proto.landed)?,
            battery_fraction: optionally("battery_fraction", proto.battery_fraction, fraction)?,
            battery_v: optionally("battery_v", proto.battery_v, non_negative)?,
            fix: optional("fix", proto.fix, fix_from)?,
            estimator_ok: proto.estimator_ok,
            ready_to_arm: proto.ready_to_arm,
            boot_s: non_negative("boot_s", proto.boot_s)?,
            activity: required("activity", proto.activity, activity_from)?,
            plan_generation: proto.plan_generation,
            touchdown: optional("touchdown", proto.touchdown, point_from)?,
            acceleration_ned_mps2: optional("acceleration_ned_mps2", proto.acceleration_ned_mps2, vector_from)?,
            intent: optional("intent", proto.intent, intent_from)?,
            range: optional("range", proto.range, range_from)?,
            ages: optional("ages", proto.ages, ages_from)?.unwrap_or_default(),
            link: optional("link", proto.link, link_from)?,
            firmware: optional("firmware", proto.firmware, firmware_from)?,
            has_payload: proto.has_payload,
        })
    }
}

impl Wire for SimTruth {
    const NAME: &'static str = "SimTruth";
    type Proto = v1::SimTruth;

    fn to_proto(&self) -> Self::Proto {
        v1::SimTruth {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            vehicle_id: self.vehicle.to_string(),
            position_ned_m: Some(vector_to(&self.position_ned_m)),
            velocity_ned_mps: Some(vector_to(&self.velocity_ned_mps)),
            ned_from_body: Some(rotation_to(&self.ned_from_body)),
            rate_body_radps: Some(vector_to(&self.rate_body_radps)),
            landed: self.landed,
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            vehicle: id("vehicle_id", &proto.vehicle_id)?,
            position_ned_m: required("position_ned_m", proto.position_ned_m, vector_from)?,
            velocity_ned_mps: required("velocity_ned_mps", proto.velocity_ned_mps, vector_from)?,
            ned_from_body: required("ned_from_body", proto.ned_from_body, rotation_from)?,
            rate_body_radps: required("rate_body_radps", proto.rate_body_radps, vector_from)?,
            landed: proto.landed,
        })
    }
}
