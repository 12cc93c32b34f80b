use halcyon_model::{Event, Health, HealthState, Severity};

use crate::field::{FieldError, header, id, known, non_negative, optional_id, text, unspecified};
use crate::{SCHEMA_VERSION, Wire, v1};

impl Wire for Health {
    const NAME: &'static str = "Health";
    type Proto = v1::Health;

    fn to_proto(&self) -> Self::Proto {
        let state = match self.state {
            HealthState::Starting => v1::HealthState::Starting,
            HealthState::Ready => v1::HealthState::Ready,
            HealthState::Degraded => v1::HealthState::Degraded,
            HealthState::Restarting => v1::HealthState::Restarting,
        };
        v1::Health {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            instance_id: self.instance.to_string(),
            service: self.service.clone(),
            state: state.into(),
            detail: self.detail.clone(),
            restarts: self.restarts,
            uptime_s: self.uptime_s,
            version: self.version.clone(),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            instance: id("instance_id", &proto.instance_id)?,
            service: text("service", proto.service)?,
            state: match known::<v1::HealthState>("state", proto.state)? {
                v1::HealthState::Unspecified => return Err(unspecified("state")),
                v1::HealthState::Starting => HealthState::Starting,
                v1::HealthState::Ready => HealthState::Ready,
                v1::HealthState::Degraded => HealthState::Degraded,
                v1::HealthState::Restarting => HealthState::Restarting,
            },
            detail: text("detail", proto.detail)?,
            restarts: proto.restarts,
            uptime_s: non_negative("uptime_s", proto.uptime_s)?,
            version: text("version", proto.version)?,
        })
    }
}

impl Wire for Event {
    const NAME: &'static str = "Event";
    type Proto = v1::Event;

    fn to_proto(&self) -> Self::Proto {
        let severity = match self.severity {
            Severity::Info => v1::Severity::Info,
            Severity::Warning => v1::Severity::Warning,
            Severity::Critical => v1::Severity::Critical,
        };
        v1::Event {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            source_id: self.source.to_string(),
            severity: severity.into(),
            what: self.what.clone(),
            why: self.why.clone(),
            vehicle_id: self.vehicle.as_ref().map(ToString::to_string).unwrap_or_default(),
            mission_id: self.mission.as_ref().map(ToString::to_string).unwrap_or_default(),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            source: id("source_id", &proto.source_id)?,
            severity: match known::<v1::Severity>("severity", proto.severity)? {
                v1::Severity::Unspecified => return Err(unspecified("severity")),
                v1::Severity::Info => Severity::Info,
                v1::Severity::Warning => Severity::Warning,
                v1::Severity::Critical => Severity::Critical,
            },
            what: text("what", proto.what)?,
            why: text("why", proto.why)?,
            vehicle: optional_id("vehicle_id", &proto.vehicle_id)?,
            mission: optional_id("mission_id", &proto.mission_id)?,
        })
    }
}
