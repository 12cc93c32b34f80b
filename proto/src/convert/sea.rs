use halcyon_model::{Estimate, SeaState, Stamp, TracePoint, Verdict, VerdictReason, VerdictState};

use super::geo::{point_from, point_to};
use crate::field::{FieldError, finite, fraction, header, id, known, non_negative, optional, required, text, unspecified};
use crate::{SCHEMA_VERSION, Wire, v1};

pub(super) fn estimate_to(estimate: &Estimate) -> v1::Estimate {
    v1::Estimate { value: estimate.value, low: estimate.low, high: estimate.high }
}

pub(super) fn estimate_from(proto: v1::Estimate) -> Result<Estimate, FieldError> {
    let estimate =
        Estimate { value: finite("value", proto.value)?, low: finite("low", proto.low)?, high: finite("high", proto.high)? };
    if estimate.is_valid() { Ok(estimate) } else { Err(FieldError::new("value", "is not between low and high")) }
}

pub(super) fn verdict_state_to(state: VerdictState) -> i32 {
    let state = match state {
        VerdictState::Safe => v1::VerdictState::Safe,
        VerdictState::Unsafe => v1::VerdictState::Unsafe,
        VerdictState::Inconclusive => v1::VerdictState::Inconclusive,
    };
    state.into()
}

/// `None` for the unspecified value.
pub(super) fn verdict_state_from(path: &str, number: i32) -> Result<Option<VerdictState>, FieldError> {
    Ok(match known::<v1::VerdictState>(path, number)? {
        v1::VerdictState::Unspecified => None,
        v1::VerdictState::Safe => Some(VerdictState::Safe),
        v1::VerdictState::Unsafe => Some(VerdictState::Unsafe),
        v1::VerdictState::Inconclusive => Some(VerdictState::Inconclusive),
    })
}

fn verdict_to(verdict: &Verdict) -> v1::Verdict {
    let reason = |reason: &VerdictReason| v1::VerdictReason {
        check: reason.check.clone(),
        passed: reason.passed,
        text: reason.text.clone(),
    };
    v1::Verdict {
        state: verdict_state_to(verdict.state),
        reasons: verdict.reasons.iter().map(reason).collect(),
        valid_until_ns: verdict.valid_until.as_nanos(),
    }
}

fn verdict_from(proto: v1::Verdict) -> Result<Verdict, FieldError> {
    let reason = |proto: v1::VerdictReason| {
        Ok(VerdictReason {
            check: text("reasons.check", proto.check)?,
            passed: proto.passed,
            text: text("reasons.text", proto.text)?,
        })
    };
    Ok(Verdict {
        state: verdict_state_from("state", proto.state)?.ok_or_else(|| unspecified("state"))?,
        reasons: proto.reasons.into_iter().map(reason).collect::<Result<_, _>>()?,
        valid_until: Stamp::from_nanos(proto.valid_until_ns),
    })
}

impl Wire for SeaState {
    const NAME: &'static str = "SeaState";
    type Proto = v1::SeaState;

    fn to_proto(&self) -> Self::Proto {
        let trace = |point: &TracePoint| v1::TracePoint { stamp_ns: point.stamp.as_nanos(), elevation_m: point.elevation_m };
        let estimate = |estimate: &Option<Estimate>| estimate.as_ref().map(estimate_to);
        v1::SeaState {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            rig_id: self.rig.to_string(),
            window_start_ns: self.window_start.as_nanos(),
            window_s: self.window_s,
            position: Some(point_to(&self.position)),
            patches: self.patches,
            coverage: self.coverage,
            waves: self.waves,
            h_mean_m: estimate(&self.h_mean_m),
            h_s_m: estimate(&self.h_s_m),
            h_max_m: estimate(&self.h_max_m),
            h_m0_m: estimate(&self.h_m0_m),
            t_z_s: estimate(&self.t_z_s),
            slope_rms_rad: estimate(&self.slope_rms_rad),
            trace: self.trace.iter().map(trace).collect(),
            verdict: Some(verdict_to(&self.verdict)),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        let trace = |point: v1::TracePoint| {
            Ok(TracePoint {
                stamp: Stamp::from_nanos(point.stamp_ns),
                elevation_m: finite("trace.elevation_m", point.elevation_m)?,
            })
        };
        let sea_state = Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            rig: id("rig_id", &proto.rig_id)?,
            window_start: Stamp::from_nanos(proto.window_start_ns),
            window_s: non_negative("window_s", proto.window_s)?,
            position: required("position", proto.position, point_from)?,
            patches: proto.patches,
            coverage: fraction("coverage", proto.coverage)?,
            waves: proto.waves,
            h_mean_m: optional("h_mean_m", proto.h_mean_m, estimate_from)?,
            h_s_m: optional("h_s_m", proto.h_s_m, estimate_from)?,
            h_max_m: optional("h_max_m", proto.h_max_m, estimate_from)?,
            h_m0_m: optional("h_m0_m", proto.h_m0_m, estimate_from)?,
            t_z_s: optional("t_z_s", proto.t_z_s, estimate_from)?,
            slope_rms_rad: optional("slope_rms_rad", proto.slope_rms_rad, estimate_from)?,
            trace: proto.trace.into_iter().map(trace).collect::<Result<_, _>>()?,
            verdict: required("verdict", proto.verdict, verdict_from)?,
        };
        // Somebody may land on this word: it needs its evidence.
        let unfounded = sea_state.h_s_m.is_none()
            || sea_state.patches == 0
            || sea_state.verdict.reasons.iter().any(|reason| !reason.passed);
        if sea_state.verdict.state == VerdictState::Safe && unfounded {
            return Err(FieldError::new("verdict.state", "is safe without a measurement, or against a failed check"));
        }
        Ok(sea_state)
    }
}
