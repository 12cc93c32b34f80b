//! What a vehicle says about itself.

use nalgebra::{UnitQuaternion, Vector3};

use crate::geo::{Geodetic, LocalPoint};
use crate::id::VehicleId;
use crate::time::Stamp;

/// What a vehicle is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// Carries the cameras.
    Leader,
    /// Carries the payload.
    Follower,
}

/// The autopilot's flight mode, in ArduCopter's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are the autopilot's own")]
pub enum FlightMode {
    Stabilize,
    AltHold,
    Auto,
    Guided,
    Loiter,
    Rtl,
    Land,
    Brake,
    SmartRtl,
    PosHold,
    /// A mode that Halcyon never commands, by its ArduCopter number.
    Other(u32),
}

impl FlightMode {
    /// From ArduCopter's `custom_mode` number.
    #[must_use]
    pub fn from_copter(number: u32) -> Self {
        match number {
            0 => Self::Stabilize,
            2 => Self::AltHold,
            3 => Self::Auto,
            4 => Self::Guided,
            5 => Self::Loiter,
            6 => Self::Rtl,
            9 => Self::Land,
            16 => Self::PosHold,
            17 => Self::Brake,
            21 => Self::SmartRtl,
            other => Self::Other(other),
        }
    }

    /// ArduCopter's `custom_mode` number.
    #[must_use]
    pub fn copter_number(self) -> u32 {
        match self {
            Self::Stabilize => 0,
            Self::AltHold => 2,
            Self::Auto => 3,
            Self::Guided => 4,
            Self::Loiter => 5,
            Self::Rtl => 6,
            Self::Land => 9,
            Self::PosHold => 16,
            Self::Brake => 17,
            Self::SmartRtl => 21,
            Self::Other(number) => number,
        }
    }

    /// Upper-case name as ground stations show it; `None` for a mode without one here.
    #[must_use]
    pub fn name(self) -> Option<&'static str> {
        Some(match self {
            Self::Stabilize => "STABILIZE",
            Self::AltHold => "ALT_HOLD",
            Self::Auto => "AUTO",
            Self::Guided => "GUIDED",
            Self::Loiter => "LOITER",
            Self::Rtl => "RTL",
            Self::Land => "LAND",
            Self::Brake => "BRAKE",
            Self::SmartRtl => "SMART_RTL",
            Self::PosHold => "POSHOLD",
            Self::Other(_) => return None,
        })
    }

    /// From a name as [`Self::name`] writes it, in any case.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [
            Self::Stabilize,
            Self::AltHold,
            Self::Auto,
            Self::Guided,
            Self::Loiter,
            Self::Rtl,
            Self::Land,
            Self::Brake,
            Self::SmartRtl,
            Self::PosHold,
        ]
        .into_iter()
        .find(|mode| mode.name().is_some_and(|known| known.eq_ignore_ascii_case(name)))
    }
}

/// Where the autopilot believes that the vehicle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are MAV_LANDED_STATE's own")]
pub enum LandedState {
    Unknown,
    OnGround,
    TakingOff,
    InAir,
    Landing,
}

/// GNSS quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// MAVLink's GPS_FIX_TYPE: 0 no GPS, 1 no fix, 2 two-dimensional, 3 three-dimensional, 4 DGPS, 5 RTK float, 6 RTK fixed.
    pub kind: u32,
    /// Satellites in use.
    pub satellites: u32,
    /// Horizontal accuracy, metres, one standard deviation as the receiver states it; NaN never, `None` if not stated.
    pub horizontal_sigma_m: Option<f64>,
}

/// What the on-board guidance is doing.
#[derive(Debug, Clone, PartialEq)]
pub enum Activity {
    /// No task.
    Idle,
    /// Waiting on the ground for the autopilot to be ready to arm, or for a plan.
    Preparing,
    /// Climbing to the safe height.
    TakingOff,
    /// Flying to a place.
    Transit,
    /// Holding a place; `true` once settled there.
    Holding {
        /// Within tolerance of the place for the settling time.
        settled: bool,
    },
    /// Keeping a slot beside a leader.
    Following {
        /// Within tolerance of the slot for the settling time.
        settled: bool,
        /// Distance from the slot, metres.
        slot_error_m: f64,
    },
    /// Over the landing place at the safe height.
    Approaching,
    /// Going down, with a valid clearance.
    Descending,
    /// On the water or the ground after a task.
    Landed,
    /// Flying home.
    Returning,
    /// A fail-safe is in charge.
    FailSafe {
        /// Which and why.
        reason: String,
    },
    /// The pilot has the vehicle; Halcyon keeps its hands off.
    PilotControl,
}

/// Where a vehicle means to be: the setpoint that its guidance last sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intent {
    /// For when.
    pub stamp: Stamp,
    /// Position in the fleet's local frame, metres.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Acceleration, metres per second squared.
    pub acceleration_ned_mps2: Vector3<f64>,
}

/// A downward rangefinder's reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// When.
    pub stamp: Stamp,
    /// Along the body's down axis, metres.
    pub distance_m: f64,
}

/// How long ago each part of the state was heard, seconds; `None` if never.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs, reason = "each is named after what was heard")]
pub struct Ages {
    pub mode_s: Option<f64>,
    pub attitude_s: Option<f64>,
    pub landed_s: Option<f64>,
    pub battery_s: Option<f64>,
    pub fix_s: Option<f64>,
    pub estimator_s: Option<f64>,
    pub home_s: Option<f64>,
}

/// The MAVLink link to the autopilot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkQuality {
    /// Share of the autopilot's frames lost lately, 0 to 1.
    pub loss: f64,
    /// There and back, seconds, by TIMESYNC.
    pub round_trip_s: Option<f64>,
    /// Frames since the link was opened.
    pub received: u64,
    /// What it says is signed with our key.
    pub is_signed: bool,
}

/// What flies the vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Firmware {
    /// Such as `ArduPilot` or `PX4`.
    pub autopilot: String,
    /// Such as `quadrotor`.
    pub vehicle: String,
    /// Such as `4.6.0`; empty if it does not say.
    pub version: String,
}

/// A vehicle's state: latest value wins.
#[derive(Debug, Clone, PartialEq)]
pub struct VehicleState {
    /// When the position was measured.
    pub stamp: Stamp,
    /// Which vehicle.
    pub vehicle: VehicleId,
    /// What it is for.
    pub role: Role,
    /// Global position by the autopilot; altitude above mean sea level.
    pub position: Geodetic,
    /// The same in the fleet's local frame, metres; −z is the height above mean water.
    pub position_ned_m: Vector3<f64>,
    /// Velocity over ground, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Attitude: rotates body axes into north, east, down.
    pub ned_from_body: UnitQuaternion<f64>,
    /// Heading, radians clockwise from true north, in [0, 2π).
    pub heading_rad: f64,
    /// Home, if the autopilot has one.
    pub home: Option<Geodetic>,
    /// Flight mode.
    pub mode: FlightMode,
    /// Motors armed.
    pub armed: bool,
    /// On the ground or in the air.
    pub landed: LandedState,
    /// Remaining battery, 0 to 1; `None` if not measured.
    pub battery_fraction: Option<f64>,
    /// Battery voltage, volts; `None` if not measured.
    pub battery_v: Option<f64>,
    /// GNSS quality; `None` if never heard.
    pub fix: Option<Fix>,
    /// Whether the estimator's position is good enough to fly by; unknown is `false`.
    pub estimator_ok: bool,
    /// Whether the autopilot would let the vehicle arm; unknown is `false`.
    pub ready_to_arm: bool,
    /// Time since the autopilot booted, seconds.
    pub boot_s: f64,
    /// What the guidance is doing.
    pub activity: Activity,
    /// Generation of the newest plan it has accepted; 0 before any.
    pub plan_generation: u64,
    /// Where it touched down for its last landing task, by its own position.
    pub touchdown: Option<LocalPoint>,
    /// Acceleration without gravity, metres per second squared, if it is measured.
    pub acceleration_ned_mps2: Option<Vector3<f64>>,
    /// Where it means to be, while Halcyon's guidance flies it.
    pub intent: Option<Intent>,
    /// Downward rangefinder; `None` without one, or out of its range.
    pub range: Option<Range>,
    /// How old each part is.
    pub ages: Ages,
    /// The link to the autopilot.
    pub link: Option<LinkQuality>,
    /// What flies it.
    pub firmware: Option<Firmware>,
    /// It carries something that it can let go: a payload is configured.
    pub has_payload: bool,
}

/// The simulator's truth about one vehicle. Exists only in simulation; nothing that flies may read it.
#[derive(Debug, Clone, PartialEq)]
pub struct SimTruth {
    /// When.
    pub stamp: Stamp,
    /// Which vehicle.
    pub vehicle: VehicleId,
    /// True position in the fleet's local frame, metres.
    pub position_ned_m: Vector3<f64>,
    /// True velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// True attitude.
    pub ned_from_body: UnitQuaternion<f64>,
    /// True body rates (forward, right, down), radians per second.
    pub rate_body_radps: Vector3<f64>,
    /// Touching the ground or the water.
    pub landed: bool,
}
