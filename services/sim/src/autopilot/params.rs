//! Parameters: those of ArduCopter that name a behaviour of this autopilot, with ArduCopter's defaults.

use mavlink::dialects::ardupilotmega::MavParamType;

macro_rules! params {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $kind:ident, $default:literal, $least:literal ..= $most:literal;)*) => {
        /// A parameter.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(usize)]
        pub enum Param { $($(#[$doc])* $variant,)* }

        /// Name, type, default and range of each, in the order of [`Param`].
        const TABLE: &[(&str, MavParamType, f32, f32, f32)] =
            &[$(($name, MavParamType::$kind, $default, $least, $most),)*];
    };
}

params! {
    /// MAVLink system id; takes effect at once.
    SystemId = "SYSID_THISMAV", MAV_PARAM_TYPE_INT16, 1.0, 1.0..=254.0;
    /// Whose heartbeats feed the ground-station fail-safe.
    GroundStationId = "SYSID_MYGCS", MAV_PARAM_TYPE_INT16, 255.0, 1.0..=255.0;
    /// Ground-station fail-safe: 0 off, 1 RTL, 5 LAND.
    GcsFailsafe = "FS_GCS_ENABLE", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=7.0;
    /// Seconds without its heartbeat.
    GcsTimeout = "FS_GCS_TIMEOUT", MAV_PARAM_TYPE_REAL32, 5.0, 2.0..=120.0;
    /// Position fail-safe: 1 LAND, 2 ALT_HOLD.
    EkfAction = "FS_EKF_ACTION", MAV_PARAM_TYPE_INT8, 1.0, 1.0..=3.0;
    /// 0 switches the arming checks off.
    ArmingCheck = "ARMING_CHECK", MAV_PARAM_TYPE_INT32, 1.0, 0.0..=1.0e6;
    /// Seconds armed on the ground before it disarms itself; 0 never.
    DisarmDelay = "DISARM_DELAY", MAV_PARAM_TYPE_INT8, 10.0, 0.0..=127.0;
    /// RTL height above home, centimetres.
    RtlAltitude = "RTL_ALT", MAV_PARAM_TYPE_INT32, 1500.0, 30.0..=300_000.0;
    /// RTL speed, centimetres per second; 0 takes WPNAV_SPEED.
    RtlSpeed = "RTL_SPEED", MAV_PARAM_TYPE_INT16, 0.0, 0.0..=2000.0;
    /// Milliseconds over home before RTL descends.
    RtlLoiterTime = "RTL_LOIT_TIME", MAV_PARAM_TYPE_INT32, 5000.0, 0.0..=60_000.0;
    /// RTL ends at this height above home, centimetres; 0 lands.
    RtlAltitudeFinal = "RTL_ALT_FINAL", MAV_PARAM_TYPE_INT16, 0.0, 0.0..=10_000.0;
    /// Near home RTL climbs only to this times the distance; 0 always climbs fully.
    RtlConeSlope = "RTL_CONE_SLOPE", MAV_PARAM_TYPE_REAL32, 3.0, 0.0..=10.0;
    /// Final descent, centimetres per second.
    LandSpeed = "LAND_SPEED", MAV_PARAM_TYPE_INT16, 50.0, 10.0..=200.0;
    /// Descent above LAND_ALT_LOW, centimetres per second; 0 takes WPNAV_SPEED_DN.
    LandSpeedHigh = "LAND_SPEED_HIGH", MAV_PARAM_TYPE_INT16, 0.0, 0.0..=500.0;
    /// Height where the final descent begins, centimetres.
    LandAltitudeLow = "LAND_ALT_LOW", MAV_PARAM_TYPE_INT16, 1000.0, 100.0..=10_000.0;
    /// Horizontal speed, centimetres per second.
    Speed = "WPNAV_SPEED", MAV_PARAM_TYPE_REAL32, 1000.0, 10.0..=2000.0;
    /// Climb, centimetres per second.
    SpeedUp = "WPNAV_SPEED_UP", MAV_PARAM_TYPE_REAL32, 250.0, 10.0..=1000.0;
    /// Descent, centimetres per second.
    SpeedDown = "WPNAV_SPEED_DN", MAV_PARAM_TYPE_REAL32, 150.0, 10.0..=500.0;
    /// Horizontal acceleration, centimetres per second squared.
    Acceleration = "WPNAV_ACCEL", MAV_PARAM_TYPE_REAL32, 250.0, 50.0..=500.0;
    /// Vertical acceleration, centimetres per second squared.
    AccelerationZ = "WPNAV_ACCEL_Z", MAV_PARAM_TYPE_REAL32, 100.0, 50.0..=500.0;
    /// A waypoint is reached within this distance, centimetres.
    WaypointRadius = "WPNAV_RADIUS", MAV_PARAM_TYPE_REAL32, 200.0, 5.0..=1000.0;
    /// 0 never turns by itself, 1 and 2 face the way it flies.
    YawBehaviour = "WP_YAW_BEHAVIOR", MAV_PARAM_TYPE_INT8, 2.0, 0.0..=3.0;
    /// Seconds after which a velocity target is dropped.
    GuidedTimeout = "GUID_TIMEOUT", MAV_PARAM_TYPE_REAL32, 3.0, 0.1..=5.0;
    /// Greatest lean, centidegrees.
    AngleMax = "ANGLE_MAX", MAV_PARAM_TYPE_INT16, 3000.0, 1000.0..=8000.0;
    /// Pilot's climb, centimetres per second.
    PilotSpeedUp = "PILOT_SPEED_UP", MAV_PARAM_TYPE_INT16, 250.0, 50.0..=500.0;
    /// Pilot's descent, centimetres per second; 0 takes PILOT_SPEED_UP.
    PilotSpeedDown = "PILOT_SPEED_DN", MAV_PARAM_TYPE_INT16, 0.0, 0.0..=500.0;
    /// Speed in LOITER, centimetres per second.
    LoiterSpeed = "LOIT_SPEED", MAV_PARAM_TYPE_REAL32, 1250.0, 20.0..=3500.0;
    /// Horizontal position to velocity, 1/s.
    PositionGain = "PSC_POSXY_P", MAV_PARAM_TYPE_REAL32, 1.0, 0.5..=2.0;
    /// Horizontal velocity to acceleration, 1/s.
    VelocityGain = "PSC_VELXY_P", MAV_PARAM_TYPE_REAL32, 2.0, 0.1..=6.0;
    /// Horizontal velocity integral to acceleration, 1/s².
    VelocityIntegral = "PSC_VELXY_I", MAV_PARAM_TYPE_REAL32, 1.0, 0.02..=1.0;
    /// Height to climb rate, 1/s.
    HeightGain = "PSC_POSZ_P", MAV_PARAM_TYPE_REAL32, 1.0, 0.5..=3.0;
    /// Climb rate to acceleration, 1/s.
    ClimbGain = "PSC_VELZ_P", MAV_PARAM_TYPE_REAL32, 5.0, 1.0..=8.0;
    /// Roll error to rate, 1/s.
    RollGain = "ATC_ANG_RLL_P", MAV_PARAM_TYPE_REAL32, 4.5, 3.0..=12.0;
    /// Pitch error to rate, 1/s.
    PitchGain = "ATC_ANG_PIT_P", MAV_PARAM_TYPE_REAL32, 4.5, 3.0..=12.0;
    /// Heading error to rate, 1/s.
    YawGain = "ATC_ANG_YAW_P", MAV_PARAM_TYPE_REAL32, 4.5, 3.0..=12.0;
    /// Fastest turn, centidegrees per second.
    YawSlew = "ATC_SLEW_YAW", MAV_PARAM_TYPE_REAL32, 6000.0, 500.0..=18_000.0;
    /// Battery capacity, milliampere hours.
    BatteryCapacity = "BATT_CAPACITY", MAV_PARAM_TYPE_INT32, 10_000.0, 0.0..=1.0e6;
    /// Least voltage to arm; 0 off.
    BatteryArmVolt = "BATT_ARM_VOLT", MAV_PARAM_TYPE_REAL32, 0.0, 0.0..=100.0;
    /// Low voltage; 0 off.
    BatteryLowVolt = "BATT_LOW_VOLT", MAV_PARAM_TYPE_REAL32, 0.0, 0.0..=100.0;
    /// Low charge, milliampere hours; 0 off.
    BatteryLowCharge = "BATT_LOW_MAH", MAV_PARAM_TYPE_REAL32, 0.0, 0.0..=1.0e6;
    /// What to do then: 0 nothing, 1 LAND, 2 RTL.
    BatteryLowAction = "BATT_FS_LOW_ACT", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=7.0;
    /// Critical voltage; 0 off.
    BatteryCriticalVolt = "BATT_CRT_VOLT", MAV_PARAM_TYPE_REAL32, 0.0, 0.0..=100.0;
    /// Critical charge, milliampere hours; 0 off.
    BatteryCriticalCharge = "BATT_CRT_MAH", MAV_PARAM_TYPE_REAL32, 0.0, 0.0..=1.0e6;
    /// What to do then: 0 nothing, 1 LAND, 2 RTL.
    BatteryCriticalAction = "BATT_FS_CRT_ACT", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=7.0;
    /// The fence: 0 off, 1 on.
    FenceEnable = "FENCE_ENABLE", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=1.0;
    /// Which fences: 1 height, 2 circle about home, 4 polygons and circles that were uploaded.
    FenceType = "FENCE_TYPE", MAV_PARAM_TYPE_INT8, 7.0, 0.0..=15.0;
    /// Outside: 0 only says so, 1 RTL, 2 LAND, 3 RTL, 4 BRAKE, 5 LAND (3 and 5 would try SmartRTL first).
    FenceAction = "FENCE_ACTION", MAV_PARAM_TYPE_INT8, 1.0, 0.0..=5.0;
    /// Greatest height above home, metres.
    FenceHeight = "FENCE_ALT_MAX", MAV_PARAM_TYPE_REAL32, 100.0, 10.0..=1000.0;
    /// Greatest distance from home, metres.
    FenceRadius = "FENCE_RADIUS", MAV_PARAM_TYPE_REAL32, 300.0, 30.0..=10_000.0;
    /// 1: while outside, the mode that the fence chose may not be left.
    FenceOptions = "FENCE_OPTIONS", MAV_PARAM_TYPE_INT16, 1.0, 0.0..=15.0;
    /// Items stored.
    FenceTotal = "FENCE_TOTAL", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=255.0;
    /// Rally points stored.
    RallyTotal = "RALLY_TOTAL", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=255.0;
    /// RTL goes to a rally point no further than this, kilometres.
    RallyLimit = "RALLY_LIMIT_KM", MAV_PARAM_TYPE_REAL32, 0.3, 0.0..=1.0e4;
    /// 1: home counts as a rally point.
    RallyHome = "RALLY_INCL_HOME", MAV_PARAM_TYPE_INT8, 1.0, 0.0..=1.0;
    /// Rangefinder: 0 none, 100 the simulator's.
    RangefinderType = "RNGFND1_TYPE", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=127.0;
    /// Where it looks: 25 down.
    RangefinderOrientation = "RNGFND1_ORIENT", MAV_PARAM_TYPE_INT8, 25.0, 0.0..=40.0;
    /// Its least distance, centimetres.
    RangefinderMin = "RNGFND1_MIN_CM", MAV_PARAM_TYPE_INT16, 20.0, 0.0..=30_000.0;
    /// Its greatest distance, centimetres.
    RangefinderMax = "RNGFND1_MAX_CM", MAV_PARAM_TYPE_INT16, 700.0, 0.0..=30_000.0;
    /// Gripper: 0 none.
    GripperEnable = "GRIP_ENABLE", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=1.0;
    /// 1: moved by a servo.
    GripperType = "GRIP_TYPE", MAV_PARAM_TYPE_INT8, 1.0, 0.0..=2.0;
    /// Pulse that closes it, microseconds.
    GripperGrab = "GRIP_GRAB", MAV_PARAM_TYPE_INT16, 1900.0, 1000.0..=2000.0;
    /// Pulse that opens it, microseconds.
    GripperRelease = "GRIP_RELEASE", MAV_PARAM_TYPE_INT16, 1100.0, 1000.0..=2000.0;
    /// Pulse before any command, microseconds.
    GripperNeutral = "GRIP_NEUTRAL", MAV_PARAM_TYPE_INT16, 1500.0, 1000.0..=2000.0;
    /// 1: relay 1 (0 in commands) is there.
    Relay1 = "RELAY1_FUNCTION", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=10.0;
    /// 1: relay 2 is there.
    Relay2 = "RELAY2_FUNCTION", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=10.0;
    /// What drives output 5: 0 nothing, 28 the gripper.
    Servo5 = "SERVO5_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 6: 0 nothing, 28 the gripper.
    Servo6 = "SERVO6_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 7: 0 nothing, 28 the gripper.
    Servo7 = "SERVO7_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 8: 0 nothing, 28 the gripper.
    Servo8 = "SERVO8_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 9: 0 nothing, 28 the gripper.
    Servo9 = "SERVO9_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 10: 0 nothing, 28 the gripper.
    Servo10 = "SERVO10_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 11: 0 nothing, 28 the gripper.
    Servo11 = "SERVO11_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 12: 0 nothing, 28 the gripper.
    Servo12 = "SERVO12_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 13: 0 nothing, 28 the gripper.
    Servo13 = "SERVO13_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 14: 0 nothing, 28 the gripper.
    Servo14 = "SERVO14_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 15: 0 nothing, 28 the gripper.
    Servo15 = "SERVO15_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// What drives output 16: 0 nothing, 28 the gripper.
    Servo16 = "SERVO16_FUNCTION", MAV_PARAM_TYPE_INT16, 0.0, -1.0..=200.0;
    /// Channel of the mode switch; 0 none.
    ModeChannel = "FLTMODE_CH", MAV_PARAM_TYPE_INT8, 5.0, 0.0..=16.0;
    /// Mode at the first position of the switch.
    Mode1 = "FLTMODE1", MAV_PARAM_TYPE_INT8, 0.0, 0.0..=30.0;
    /// Second position.
    Mode2 = "FLTMODE2", MAV_PARAM_TYPE_INT8, 2.0, 0.0..=30.0;
    /// Third position.
    Mode3 = "FLTMODE3", MAV_PARAM_TYPE_INT8, 5.0, 0.0..=30.0;
    /// Fourth position.
    Mode4 = "FLTMODE4", MAV_PARAM_TYPE_INT8, 6.0, 0.0..=30.0;
    /// Fifth position.
    Mode5 = "FLTMODE5", MAV_PARAM_TYPE_INT8, 9.0, 0.0..=30.0;
    /// Sixth position.
    Mode6 = "FLTMODE6", MAV_PARAM_TYPE_INT8, 5.0, 0.0..=30.0;
}

/// The values.
#[derive(Debug, Clone)]
pub struct Params {
    values: Vec<f32>,
}

impl Params {
    /// ArduCopter's defaults.
    #[must_use]
    pub fn new() -> Self {
        Self { values: TABLE.iter().map(|row| row.2).collect() }
    }

    /// How many there are.
    #[must_use]
    pub fn count() -> u16 {
        TABLE.len() as u16
    }

    /// The value of `param`, in ArduCopter's unit.
    #[must_use]
    pub fn get(&self, param: Param) -> f64 {
        f64::from(self.values[param as usize])
    }

    /// A value in hundredths (centimetres, centidegrees) as whole ones.
    #[must_use]
    pub fn hundredths(&self, param: Param) -> f64 {
        self.get(param) * 0.01
    }

    /// The place of the parameter called `name`.
    #[must_use]
    pub fn find(name: &str) -> Option<usize> {
        TABLE.iter().position(|row| row.0 == name)
    }

    /// Name, value and type at a place.
    #[must_use]
    pub fn at(&self, index: usize) -> Option<(&'static str, f32, MavParamType)> {
        let (name, kind, ..) = *TABLE.get(index)?;
        Some((name, *self.values.get(index)?, kind))
    }

    /// Sets the value at a place; what is out of its range, NaN included, changes nothing.
    pub fn set(&mut self, index: usize, value: f32) {
        if let (Some((_, kind, _, least, most)), Some(stored)) = (TABLE.get(index), self.values.get_mut(index))
            && (*least..=*most).contains(&value)
        {
            *stored = if *kind == MavParamType::MAV_PARAM_TYPE_REAL32 { value } else { value.round() };
        }
    }

    /// Sets `param`, for the simulation itself.
    pub fn assign(&mut self, param: Param, value: f64) {
        self.set(param as usize, value as f32);
    }
}

impl Default for Params {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_in_its_range_and_every_name_fits_and_is_found() {
        for (index, (name, _, default, least, most)) in TABLE.iter().enumerate() {
            assert!((least..=most).contains(&default), "{name}");
            assert!(name.len() <= 16 && Params::find(name) == Some(index), "{name}");
        }
        assert_eq!(Params::new().get(Param::Mode6), 5.0);
        assert_eq!(Param::Mode6 as usize + 1, TABLE.len());
    }

    #[test]
    fn values_out_of_range_change_nothing() {
        let mut params = Params::new();
        for bad in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e9] {
            params.set(Param::Speed as usize, bad);
        }
        assert_eq!(params.get(Param::Speed), 1000.0);
        params.set(Param::Speed as usize, 450.5);
        assert_eq!(params.get(Param::Speed), 450.5);
    }
}
