//! Parameters that ArduPilot has renamed, mostly into metres and degrees: a file or a habit from one side of the change names what an
//! autopilot on the other side doesn't have. Nothing is translated by itself: a value in the wrong unit is off by a hundred. After
//! ArduPilot's own conversions (`AC_PosControl`, `AC_WPNav`, `AC_Loiter`, `ModeRTL`, `GCS`, `AP_GPS` …) for copters.

use std::fmt;

use halcyon_model::ParameterName;

/// A parameter's name on the other side of a change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Renamed {
    /// As it was asked for.
    asked: String,
    /// As it is called there.
    pub name: String,
    /// Whether that is the newer name.
    pub is_newer: bool,
    /// The release that brought the newer name.
    since: &'static str,
    relation: Relation,
}

/// What an old value is to a new one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relation {
    /// The new one is the old one divided by this.
    Divided(u32),
    /// No number relates them.
    Means(&'static str),
}

/// Old name, new name, divisor; since 4.7.
const SINCE_4_7: &[(&str, &str, u32)] = &[
    ("SYSID_THISMAV", "MAV_SYSID", 1),
    ("SYSID_MYGCS", "MAV_GCS_SYSID", 1),
    ("TELEM_DELAY", "MAV_TELEM_DELAY", 1),
    ("RTL_ALT", "RTL_ALT_M", 100),
    ("RTL_SPEED", "RTL_SPEED_MS", 100),
    ("RTL_ALT_FINAL", "RTL_ALT_FINAL_M", 100),
    ("RTL_CLIMB_MIN", "RTL_CLIMB_MIN_M", 100),
    ("LAND_SPEED", "LAND_SPD_MS", 100),
    ("LAND_SPEED_HIGH", "LAND_SPD_HIGH_MS", 100),
    ("LAND_ALT_LOW", "LAND_ALT_LOW_M", 100),
    ("WPNAV_SPEED", "WP_SPD", 100),
    ("WPNAV_SPEED_UP", "WP_SPD_UP", 100),
    ("WPNAV_SPEED_DN", "WP_SPD_DN", 100),
    ("WPNAV_RADIUS", "WP_RADIUS_M", 100),
    ("WPNAV_ACCEL", "WP_ACC", 100),
    ("WPNAV_ACCEL_Z", "WP_ACC_Z", 100),
    ("WPNAV_ACCEL_C", "WP_ACC_CNR", 100),
    ("WPNAV_JERK", "WP_JERK", 1),
    ("WPNAV_RFND_USE", "WP_RFND_USE", 1),
    ("WPNAV_TER_MARGIN", "WP_TER_MARGIN", 1),
    ("LOIT_SPEED", "LOIT_SPEED_MS", 100),
    ("LOIT_ACC_MAX", "LOIT_ACC_MAX_M", 100),
    ("LOIT_BRK_ACCEL", "LOIT_BRK_ACC_M", 100),
    ("LOIT_BRK_JERK", "LOIT_BRK_JRK_M", 100),
    ("PILOT_SPEED_UP", "PILOT_SPD_UP", 100),
    ("PILOT_SPEED_DN", "PILOT_SPD_DN", 100),
    ("PILOT_ACCEL_Z", "PILOT_ACC_Z", 100),
    ("PILOT_TKOFF_ALT", "PILOT_TKO_ALT_M", 100),
    ("PHLD_BRAKE_ANGLE", "PHLD_BRK_ANGLE", 100),
    ("PHLD_BRAKE_RATE", "PHLD_BRK_RATE", 1),
    ("CIRCLE_RADIUS", "CIRCLE_RADIUS_M", 100),
    ("AVOID_ANGLE_MAX", "AVOID_ANG_MAX", 100),
    ("ANGLE_MAX", "ATC_ANGLE_MAX", 100),
    ("ATC_SLEW_YAW", "ATC_RATE_WPY_MAX", 100),
    ("ATC_ACCEL_R_MAX", "ATC_ACC_R_MAX", 100),
    ("ATC_ACCEL_P_MAX", "ATC_ACC_P_MAX", 100),
    ("ATC_ACCEL_Y_MAX", "ATC_ACC_Y_MAX", 100),
    ("PSC_POSXY_P", "PSC_NE_POS_P", 1),
    ("PSC_POSZ_P", "PSC_D_POS_P", 1),
    ("PSC_JERK_XY", "PSC_JERK_NE", 1),
    ("PSC_JERK_Z", "PSC_JERK_D", 1),
    ("PSC_VELXY_IMAX", "PSC_NE_VEL_IMAX", 100),
    ("PSC_VELZ_IMAX", "PSC_D_VEL_IMAX", 100),
    ("PSC_ACCZ_P", "PSC_D_ACC_P", 10),
    ("PSC_ACCZ_I", "PSC_D_ACC_I", 10),
    ("PSC_ACCZ_D", "PSC_D_ACC_D", 10),
    ("PSC_ACCZ_IMAX", "PSC_D_ACC_IMAX", 1000),
    ("EK3_MAX_FLOW", "EK3_FLOW_MAX", 1),
];

/// Old name, new name, what the new one means.
const MEANING_SINCE_4_7: &[(&str, &str, &str)] = &[
    ("ARMING_CHECK", "ARMING_SKIPCHK", "a mask of the checks that are left out, not of those that are made"),
    ("SYSID_ENFORCE", "MAV_OPTIONS", "a mask, of which bit 0 is this"),
];

/// Whatever follows the prefix of a controller stays as it is, and keeps its unit, but for what is listed above.
const PREFIXES_SINCE_4_7: &[(&str, &str)] =
    &[("PSC_VELXY_", "PSC_NE_VEL_"), ("PSC_VELZ_", "PSC_D_VEL_"), ("PSC_ACCZ_", "PSC_D_ACC_")];

/// What follows `SRn_`, and `MAVm_` with m = n + 1.
const STREAM_RATES: [&str; 10] =
    ["RAW_SENS", "EXT_STAT", "RC_CHAN", "RAW_CTRL", "POSITION", "EXTRA1", "EXTRA2", "EXTRA3", "PARAMS", "ADSB"];

/// What follows `RNGFNDn_`: old, new; centimetres, metres.
const RANGEFINDER: [(&str, &str); 3] = [("MIN_CM", "MIN"), ("MAX_CM", "MAX"), ("GNDCLEAR", "GNDCLR")];

/// Old name, new name; since 4.6.
const SINCE_4_6: &[(&str, &str)] = &[
    ("GPS_TYPE", "GPS1_TYPE"),
    ("GPS_TYPE2", "GPS2_TYPE"),
    ("GPS_GNSS_MODE", "GPS1_GNSS_MODE"),
    ("GPS_GNSS_MODE2", "GPS2_GNSS_MODE"),
    ("GPS_RATE_MS", "GPS1_RATE_MS"),
    ("GPS_RATE_MS2", "GPS2_RATE_MS"),
    ("GPS_DELAY_MS", "GPS1_DELAY_MS"),
    ("GPS_DELAY_MS2", "GPS2_DELAY_MS"),
];

/// What a parameter is called on the other side of a change that is known.
#[must_use]
pub fn other_name(asked: &str) -> Option<Renamed> {
    let renamed = |(name, is_newer), since, relation| Renamed { asked: asked.to_owned(), name, is_newer, since, relation };
    let (pair, relation) = single(asked).or_else(|| prefixed(asked)).or_else(|| numbered(asked))?;
    let since = if pair.0.starts_with("GPS") { "4.6" } else { "4.7" };
    Some(renamed(pair, since, relation))
}

/// "; since ArduPilot 4.7 it is …", or nothing.
pub(super) fn hint(asked: &ParameterName) -> String {
    other_name(asked.as_str()).map(|renamed| format!("; {renamed}")).unwrap_or_default()
}

/// The other one of two names, and whether that is the newer.
fn other(asked: &str, old: &str, new: &str) -> Option<(String, bool)> {
    match asked {
        _ if asked == old => Some((new.to_owned(), true)),
        _ if asked == new => Some((old.to_owned(), false)),
        _ => None,
    }
}

fn single(asked: &str) -> Option<((String, bool), Relation)> {
    let scaled = SINCE_4_7.iter().find_map(|(old, new, by)| Some((other(asked, old, new)?, Relation::Divided(*by))));
    let meaning = || MEANING_SINCE_4_7.iter().find_map(|(old, new, is)| Some((other(asked, old, new)?, Relation::Means(is))));
    let before = || SINCE_4_6.iter().find_map(|(old, new)| Some((other(asked, old, new)?, Relation::Divided(1))));
    scaled.or_else(meaning).or_else(before)
}

fn prefixed(asked: &str) -> Option<((String, bool), Relation)> {
    PREFIXES_SINCE_4_7.iter().find_map(|(old, new)| {
        let to = |prefix: &str, other: &str| asked.strip_prefix(prefix).map(|rest| format!("{other}{rest}"));
        let pair = to(old, new).map(|name| (name, true)).or_else(|| to(new, old).map(|name| (name, false)))?;
        Some((pair, Relation::Divided(1)))
    })
}

/// Those with a number in their prefix.
fn numbered(asked: &str) -> Option<((String, bool), Relation)> {
    let (prefix, rest) = asked.split_once('_')?;
    if let Some(number) = prefix.strip_prefix("RNGFND") {
        let pair = RANGEFINDER.iter().find_map(|(old, new)| other(rest, old, new))?;
        return Some(((format!("RNGFND{number}_{}", pair.0), pair.1), Relation::Divided(100)));
    }
    if !STREAM_RATES.contains(&rest) {
        return None;
    }
    let old = prefix.strip_prefix("SR").and_then(|number| number.parse::<u8>().ok()).filter(|number| *number < 10);
    let new =
        prefix.strip_prefix("MAV").and_then(|number| number.parse::<u8>().ok()).filter(|number| (1..=10).contains(number));
    let pair = match (old, new) {
        (Some(number), _) => (format!("MAV{}_{rest}", number + 1), true),
        (None, Some(number)) => (format!("SR{}_{rest}", number - 1), false),
        (None, None) => return None,
    };
    Some((pair, Relation::Divided(1)))
}

impl fmt::Display for Renamed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { asked, name, is_newer, since, relation } = self;
        let when = if *is_newer { "since" } else { "before" };
        write!(f, "{when} ArduPilot {since} it is {name}")?;
        match (relation, is_newer) {
            (Relation::Divided(1), _) => Ok(()),
            (Relation::Divided(by), true) => write!(f, " = {asked} / {by}"),
            (Relation::Divided(by), false) => write!(f, " = {asked} × {by}"),
            (Relation::Means(what), true) => write!(f, ", {what}"),
            (Relation::Means(_), false) => write!(f, ", which means something else"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(asked: &str, said: &str) {
        assert_eq!(other_name(asked).map(|renamed| renamed.to_string()).as_deref(), Some(said));
    }

    /// As ArduPilot's release notes of 4.7 and its list of parameter name changes have them.
    #[test]
    fn either_name_leads_to_the_other_and_says_what_becomes_of_the_value() {
        check("RTL_ALT", "since ArduPilot 4.7 it is RTL_ALT_M = RTL_ALT / 100");
        check("RTL_ALT_M", "before ArduPilot 4.7 it is RTL_ALT = RTL_ALT_M × 100");
        check("SYSID_THISMAV", "since ArduPilot 4.7 it is MAV_SYSID");
        check("MAV_GCS_SYSID", "before ArduPilot 4.7 it is SYSID_MYGCS");
        check("WPNAV_SPEED", "since ArduPilot 4.7 it is WP_SPD = WPNAV_SPEED / 100");
        check("PSC_ACCZ_P", "since ArduPilot 4.7 it is PSC_D_ACC_P = PSC_ACCZ_P / 10");
        check("PSC_D_ACC_IMAX", "before ArduPilot 4.7 it is PSC_ACCZ_IMAX = PSC_D_ACC_IMAX × 1000");
        check("PSC_VELXY_P", "since ArduPilot 4.7 it is PSC_NE_VEL_P");
        check("PSC_D_VEL_FLTE", "before ArduPilot 4.7 it is PSC_VELZ_FLTE");
        check("SR0_POSITION", "since ArduPilot 4.7 it is MAV1_POSITION");
        check("MAV10_EXTRA3", "before ArduPilot 4.7 it is SR9_EXTRA3");
        check("RNGFND1_MAX_CM", "since ArduPilot 4.7 it is RNGFND1_MAX = RNGFND1_MAX_CM / 100");
        check("RNGFNDA_GNDCLR", "before ArduPilot 4.7 it is RNGFNDA_GNDCLEAR = RNGFNDA_GNDCLR × 100");
        check("GPS_TYPE2", "since ArduPilot 4.6 it is GPS2_TYPE");
        let mask =
            "since ArduPilot 4.7 it is ARMING_SKIPCHK, a mask of the checks that are left out, not of those that are made";
        check("ARMING_CHECK", mask);
        check("ARMING_SKIPCHK", "before ArduPilot 4.7 it is ARMING_CHECK, which means something else");
    }

    #[test]
    fn what_was_not_renamed_has_no_other_name() {
        for name in
            ["FENCE_ENABLE", "WP_YAW_BEHAVIOR", "RTL_LOIT_TIME", "MAV_SYS_ID", "MAV0_EXTRA1", "SR10_EXTRA1", "RNGFND1_TYPE", ""]
        {
            assert_eq!(other_name(name), None, "{name}");
        }
    }

    /// There and back again, and every name is one that MAVLink can carry.
    #[test]
    fn every_pair_is_its_own_inverse() {
        let olds = SINCE_4_7.iter().map(|row| row.0).chain(MEANING_SINCE_4_7.iter().map(|row| row.0));
        for old in olds.chain(SINCE_4_6.iter().map(|row| row.0)) {
            let new = other_name(old).unwrap();
            let back = other_name(&new.name).unwrap();
            assert!(new.is_newer && !back.is_newer && back.name == old, "{old}: {new:?}, {back:?}");
            assert!(ParameterName::new(new.name.clone()).is_ok(), "{new:?}");
        }
    }
}
