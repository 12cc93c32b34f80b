use halcyon_model::{
    CalmForecast, CalmWindow, Directional, Estimate, QualityFlag, SeaState, Stamp, TracePoint, Verdict, VerdictReason,
    VerdictState, WaveSpectrum,
};

use super::geo::{point_from, point_to};
use crate::field::{
    FieldError, finite, fraction, header, id, known, non_negative, optional, optionally, positive, required, text, unspecified,
};
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
        probability: verdict.probability,
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
        probability: optionally("probability", proto.probability, fraction)?,
    })
}

fn directional_to(directional: &Directional) -> v1::Directional {
    v1::Directional {
        from_rad: Some(estimate_to(&directional.from_rad)),
        spread_rad: directional.spread_rad,
        wavelength_peak_m: directional.wavelength_peak_m,
    }
}

fn directional_from(proto: v1::Directional) -> Result<Directional, FieldError> {
    Ok(Directional {
        from_rad: required("from_rad", proto.from_rad, estimate_from)?,
        spread_rad: non_negative("spread_rad", proto.spread_rad)?,
        wavelength_peak_m: positive("wavelength_peak_m", proto.wavelength_peak_m)?,
    })
}

/// More densities than this are no spectrum of a window.
const DENSITIES_MAX: usize = 4096;

fn spectrum_to(spectrum: &WaveSpectrum) -> v1::WaveSpectrum {
    v1::WaveSpectrum {
        df_hz: spectrum.df_hz,
        density_m2_per_hz: spectrum.density_m2_per_hz.clone(),
        degrees_of_freedom: spectrum.degrees_of_freedom,
        low_factor: spectrum.factors_95[0],
        high_factor: spectrum.factors_95[1],
    }
}

fn spectrum_from(proto: v1::WaveSpectrum) -> Result<WaveSpectrum, FieldError> {
    if proto.density_m2_per_hz.len() > DENSITIES_MAX {
        return Err(FieldError::new("density_m2_per_hz", format!("must hold at most {DENSITIES_MAX} numbers")));
    }
    proto.density_m2_per_hz.iter().try_for_each(|&density| non_negative("density_m2_per_hz", density).map(drop))?;
    Ok(WaveSpectrum {
        df_hz: positive("df_hz", proto.df_hz)?,
        density_m2_per_hz: proto.density_m2_per_hz,
        degrees_of_freedom: positive("degrees_of_freedom", proto.degrees_of_freedom)?,
        factors_95: [non_negative("low_factor", proto.low_factor)?, non_negative("high_factor", proto.high_factor)?],
    })
}

pub(super) fn window_to(window: &CalmWindow) -> v1::CalmWindow {
    v1::CalmWindow { from_ns: window.from.as_nanos(), to_ns: window.to.as_nanos() }
}

pub(super) fn window_from(proto: v1::CalmWindow) -> Result<CalmWindow, FieldError> {
    let window = CalmWindow { from: Stamp::from_nanos(proto.from_ns), to: Stamp::from_nanos(proto.to_ns) };
    if window.from <= window.to { Ok(window) } else { Err(FieldError::new("windows", "ends before it begins")) }
}

fn calm_to(calm: &CalmForecast) -> v1::CalmForecast {
    v1::CalmForecast {
        place: Some(point_to(&calm.place)),
        from_ns: calm.from.as_nanos(),
        error_share: calm.error_share,
        windows: calm.windows.iter().map(window_to).collect(),
    }
}

fn calm_from(proto: v1::CalmForecast) -> Result<CalmForecast, FieldError> {
    Ok(CalmForecast {
        place: required("place", proto.place, point_from)?,
        from: Stamp::from_nanos(proto.from_ns),
        error_share: non_negative("error_share", proto.error_share)?,
        windows: proto.windows.into_iter().map(window_from).collect::<Result<_, _>>()?,
    })
}

fn flag_from(proto: v1::QualityFlag) -> Result<QualityFlag, FieldError> {
    Ok(QualityFlag { test: text("quality.test", proto.test)?, failed: proto.failed, text: text("quality.text", proto.text)? })
}

impl Wire for SeaState {
    const NAME: &'static str = "SeaState";
    type Proto = v1::SeaState;

    fn to_proto(&self) -> Self::Proto {
        let trace = |point: &TracePoint| v1::TracePoint { stamp_ns: point.stamp.as_nanos(), elevation_m: point.elevation_m };
        let estimate = |estimate: &Option<Estimate>| estimate.as_ref().map(estimate_to);
        let flag =
            |flag: &QualityFlag| v1::QualityFlag { test: flag.test.clone(), failed: flag.failed, text: flag.text.clone() };
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
            h_rms_m: estimate(&self.h_rms_m),
            h_tenth_m: estimate(&self.h_tenth_m),
            t_p_s: estimate(&self.t_p_s),
            t_m01_s: estimate(&self.t_m01_s),
            t_m02_s: estimate(&self.t_m02_s),
            t_e_s: estimate(&self.t_e_s),
            vertical_speed_rms_mps: estimate(&self.vertical_speed_rms_mps),
            directional: self.directional.as_ref().map(directional_to),
            spectrum: self.spectrum.as_ref().map(spectrum_to),
            quality: self.quality.iter().map(flag).collect(),
            calm: self.calm.as_ref().map(calm_to),
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
            h_rms_m: optional("h_rms_m", proto.h_rms_m, estimate_from)?,
            h_tenth_m: optional("h_tenth_m", proto.h_tenth_m, estimate_from)?,
            t_p_s: optional("t_p_s", proto.t_p_s, estimate_from)?,
            t_m01_s: optional("t_m01_s", proto.t_m01_s, estimate_from)?,
            t_m02_s: optional("t_m02_s", proto.t_m02_s, estimate_from)?,
            t_e_s: optional("t_e_s", proto.t_e_s, estimate_from)?,
            vertical_speed_rms_mps: optional("vertical_speed_rms_mps", proto.vertical_speed_rms_mps, estimate_from)?,
            directional: optional("directional", proto.directional, directional_from)?,
            spectrum: optional("spectrum", proto.spectrum, spectrum_from)?,
            quality: proto.quality.into_iter().map(flag_from).collect::<Result<_, _>>()?,
            calm: optional("calm", proto.calm, calm_from)?,
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
