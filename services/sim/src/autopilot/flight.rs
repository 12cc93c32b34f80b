//! Modes: what each does with the vehicle, entering them, and knowing when it has landed.

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega as mav;
use nalgebra::{Rotation2, Vector2, Vector3};

use super::control::{Horizontal, Limits, Setpoint, THRUST_IDLE, Vertical, Yaw, heading_rad};
use super::guided::Guided;
use super::{Autopilot, Mode, Param};
use crate::copter::{Actuation, GRAVITY_MPS2};

/// ArduCopter's land detector: thrust at its lower limit, and accelerations (below 1 Hz) and speeds under these, for this long.
const LANDED_THRUST: f64 = 1.05 * THRUST_IDLE;
const LANDED_ACCEL_MPS2: f64 = 1.0;
const LANDED_ACCEL_HZ: f64 = 1.0;
const LANDED_SPEED_MPS: f64 = 1.0;
const LANDED_S: f64 = 1.0;
/// By a rangefinder that sees anything it must be this low, metres.
const LANDED_HEIGHT_M: f64 = 2.0;
/// RTL always climbs at least this, metres, and is over home within this distance, metres.
const RTL_CLIMB_MIN_M: f64 = 2.0;
const RTL_HOME_M: f64 = 1.0;

/// Where RTL is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rtl {
    Climb { place_m: Vector2<f64>, down_m: f64 },
    Return { down_m: f64 },
    Loiter { down_m: f64, since: Stamp },
    Land,
}

/// What the modes remember, GUIDED and AUTO's mission apart.
#[derive(Debug, Clone)]
pub(super) struct Flight {
    pub(super) yaw: Yaw,
    rtl: Rtl,
    /// Where RTL leads.
    return_to_m: Vector3<f64>,
    /// Overrides of the speed limits, by MAV_CMD_DO_CHANGE_SPEED, until the mode changes.
    pub(super) speed_mps: Option<f64>,
    pub(super) up_mps: Option<f64>,
    pub(super) down_mps: Option<f64>,
    /// AUTO has been started.
    pub(super) auto_started: bool,
    /// AUTO reached its waypoint then.
    pub(super) reached_at: Option<Stamp>,
    landed_for_s: f64,
    /// Acceleration less gravity, filtered.
    jolt_mps2: Vector3<f64>,
}

impl Flight {
    pub(super) fn new(now: Stamp) -> Self {
        Self {
            yaw: Yaw::Hold,
            rtl: Rtl::Loiter { down_m: 0.0, since: now },
            return_to_m: Vector3::zeros(),
            speed_mps: None,
            up_mps: None,
            down_mps: None,
            auto_started: false,
            reached_at: None,
            landed_for_s: 0.0,
            jolt_mps2: Vector3::zeros(),
        }
    }

    pub(super) fn stop_turning(&mut self) {
        if matches!(self.yaw, Yaw::Rate(_)) {
            self.yaw = Yaw::Hold;
        }
    }
}

impl Autopilot {
    /// Changes the mode as a pilot or a client asks, or says why not.
    pub(super) fn set_mode(&mut self, mode: Mode) -> Result<(), &'static str> {
        if mode == self.mode {
            return Ok(());
        }
        let take_off_first = self.mission.item(1).is_some_and(|item| item.command == mav::MavCmd::MAV_CMD_NAV_TAKEOFF);
        let problem = if mode == Mode::Auto && self.mission.items.is_empty() {
            Some("no mission")
        } else if mode == Mode::Auto && self.armed && self.landed && !take_off_first {
            Some("Missing Takeoff Cmd")
        } else if self.armed && mode.needs_position() && !self.sensed.estimate.position_ok {
            Some("requires position")
        } else if self.fence_holds_mode() {
            Some("in fence recovery")
        } else {
            None
        };
        if let Some(problem) = problem {
            let text = format!("Mode change to {} failed: {problem}", mode.name());
            self.text(mav::MavSeverity::MAV_SEVERITY_WARNING, &text);
            return Err(problem);
        }
        self.enter_mode(mode);
        Ok(())
    }

    /// Enters a mode without asking.
    pub(super) fn enter_mode(&mut self, mode: Mode) {
        self.mode = mode;
        self.fence.mode_left();
        self.controller.start_from(&self.sensed.estimate);
        self.guided = Guided::Hold;
        let facing = match (mode, self.params.get(Param::YawBehaviour) as u32) {
            (Mode::Guided | Mode::Auto, 1..) | (Mode::Rtl, 1 | 3) => Yaw::Travel,
            _ => Yaw::Hold,
        };
        self.flight = Flight { yaw: facing, landed_for_s: 0.0, jolt_mps2: self.flight.jolt_mps2, ..Flight::new(self.now) };
        match mode {
            Mode::Rtl => self.start_rtl(),
            // In the air AUTO begins at once; on the ground it waits for MAV_CMD_MISSION_START.
            Mode::Auto if !self.landed => self.start_mission(),
            _ => {}
        }
        self.hurry_heartbeat();
    }

    pub(super) fn limits(&self) -> Limits {
        let or = |value: Option<f64>, param| value.unwrap_or_else(|| self.params.hundredths(param));
        Limits {
            speed_mps: or(self.flight.speed_mps, Param::Speed),
            up_mps: or(self.flight.up_mps, Param::SpeedUp),
            down_mps: or(self.flight.down_mps, Param::SpeedDown),
        }
    }

    /// What the motors are to do in this step.
    pub(super) fn fly(&mut self, dt_s: f64) -> Actuation {
        if !self.armed {
            return Actuation::OFF;
        }
        let setpoint = match self.mode {
            Mode::Guided => {
                self.finish_take_off();
                self.guided_setpoint(dt_s)
            }
            Mode::Auto => self.auto_setpoint(),
            Mode::Rtl => self.rtl_setpoint(),
            Mode::Land => self.land_setpoint(None),
            Mode::Brake => self.hold_setpoint(),
            Mode::Loiter | Mode::AltHold | Mode::Stabilize => self.pilot_setpoint(),
        };
        if self.landed {
            let lifts = match setpoint.vertical {
                Vertical::Rate(rate_mps) => rate_mps < -0.1 && self.sticks.is_some(),
                Vertical::Thrust(ratio) => ratio > 1.02,
                Vertical::Position { .. } => self.is_taking_off(),
            };
            if !lifts {
                return self.controller.idle(&self.sensed.estimate, &self.airframe);
            }
            self.landed = false;
            self.flight.landed_for_s = 0.0;
            self.controller.start_from(&self.sensed.estimate);
        }
        self.controller.step(dt_s, &setpoint, &self.sensed.estimate, &self.params, &self.airframe)
    }

    /// Whether a take-off is under way.
    pub(super) fn is_taking_off(&self) -> bool {
        match self.mode {
            Mode::Guided => matches!(self.guided, Guided::TakeOff { .. }),
            Mode::Auto => {
                let item = self.mission.item(self.mission.current);
                self.flight.auto_started && item.is_some_and(|item| item.command == mav::MavCmd::MAV_CMD_NAV_TAKEOFF)
            }
            _ => false,
        }
    }

    /// Whether a landing is under way.
    pub(super) fn is_landing(&self) -> bool {
        match self.mode {
            Mode::Land => true,
            Mode::Rtl => self.flight.rtl == Rtl::Land,
            Mode::Auto => {
                let item = self.mission.item(self.mission.current);
                item.is_some_and(|item| item.command == mav::MavCmd::MAV_CMD_NAV_LAND)
            }
            _ => false,
        }
    }

    pub(super) fn hold_setpoint(&self) -> Setpoint {
        Setpoint { horizontal: Horizontal::HOLD, vertical: Vertical::Rate(0.0), yaw: self.flight.yaw, limits: self.limits() }
    }

    /// Down here, or onto `place_m`.
    pub(super) fn land_setpoint(&self, place_m: Option<Vector2<f64>>) -> Setpoint {
        let final_mps = self.params.hundredths(Param::LandSpeed);
        let high_mps = match self.params.hundredths(Param::LandSpeedHigh) {
            0.0 => self.params.hundredths(Param::SpeedDown),
            set_mps => set_mps,
        };
        let height_m = self.height_by_range_m().unwrap_or_else(|| self.height_m());
        let above_m = height_m - self.params.hundredths(Param::LandAltitudeLow);
        // Slows at WPNAV_ACCEL_Z to the final speed where the final descent begins.
        let accel_mps2 = self.params.hundredths(Param::AccelerationZ);
        let rate_mps = (final_mps * final_mps + 2.0 * accel_mps2 * above_m.max(0.0)).sqrt().min(high_mps.max(final_mps));
        let horizontal = match place_m {
            _ if !self.sensed.estimate.position_ok => Horizontal::Lean { roll_rad: 0.0, pitch_rad: 0.0 },
            Some(place_m) => Horizontal::to(place_m),
            None => Horizontal::HOLD,
        };
        let limits = Limits { down_mps: rate_mps, ..self.limits() };
        Setpoint { horizontal, vertical: Vertical::Rate(rate_mps), yaw: self.flight.yaw, limits }
    }

    pub(super) fn start_rtl(&mut self) {
        let here_m = self.sensed.estimate.position_ned_m;
        let home_m = self.return_place();
        self.flight.return_to_m = home_m;
        let distance_m = (home_m - here_m).xy().norm();
        let slope = self.params.get(Param::RtlConeSlope);
        let mut height_m = self.params.hundredths(Param::RtlAltitude);
        if slope > 0.0 {
            height_m = height_m.min((distance_m * slope).max(RTL_CLIMB_MIN_M));
        }
        let down_m = here_m.z.min(home_m.z - height_m);
        self.flight.rtl = Rtl::Climb { place_m: here_m.xy(), down_m };
    }

    pub(super) fn rtl_setpoint(&mut self) -> Setpoint {
        let estimate = self.sensed.estimate;
        let home_m = self.flight.return_to_m;
        self.flight.rtl = match self.flight.rtl {
            Rtl::Climb { down_m, .. } if estimate.position_ned_m.z - down_m < 0.3 => Rtl::Return { down_m },
            Rtl::Return { down_m } if (estimate.position_ned_m - home_m).xy().norm() < RTL_HOME_M => {
                Rtl::Loiter { down_m, since: self.now }
            }
            Rtl::Loiter { since, .. }
                if self.now.seconds_since(since) * 1e3 >= self.params.get(Param::RtlLoiterTime)
                    && self.params.get(Param::RtlAltitudeFinal) == 0.0 =>
            {
                Rtl::Land
            }
            unchanged => unchanged,
        };
        let mut limits = self.limits();
        let own_mps = self.params.hundredths(Param::RtlSpeed);
        if own_mps > 0.0 {
            limits.speed_mps = own_mps;
        }
        let (place_m, down_m) = match self.flight.rtl {
            Rtl::Climb { place_m, down_m } => (place_m, down_m),
            Rtl::Return { down_m } => (home_m.xy(), down_m),
            Rtl::Loiter { down_m, since } => {
                let done = self.now.seconds_since(since) * 1e3 >= self.params.get(Param::RtlLoiterTime);
                let final_m = home_m.z - self.params.hundredths(Param::RtlAltitudeFinal);
                (home_m.xy(), if done { final_m } else { down_m })
            }
            Rtl::Land => return self.land_setpoint(Some(home_m.xy())),
        };
        let vertical = Vertical::Position { down_m, velocity_mps: 0.0 };
        Setpoint { horizontal: Horizontal::to(place_m), vertical, yaw: self.flight.yaw, limits }
    }

    /// Sticks: roll, pitch, throttle, yaw, each −1 to 1 with a dead zone; centred without an override.
    fn sticks(&self) -> [f64; 4] {
        let Some(sticks) = self.sticks else { return [0.0; 4] };
        [0, 1, 2, 3].map(|channel| match sticks.channels_us[channel] {
            0 => 0.0,
            width_us => {
                let throw = ((f64::from(width_us) - 1500.0) / 400.0).clamp(-1.0, 1.0);
                if throw.abs() < 0.08 { 0.0 } else { throw }
            }
        })
    }

    fn pilot_setpoint(&mut self) -> Setpoint {
        let [roll, pitch, throttle, yaw] = self.sticks();
        let up_mps = self.params.hundredths(Param::PilotSpeedUp);
        let down_mps = match self.params.hundredths(Param::PilotSpeedDown) {
            0.0 => up_mps,
            set_mps => set_mps,
        };
        let horizontal = if self.mode == Mode::Loiter {
            let speed_mps = self.params.hundredths(Param::LoiterSpeed);
            let heading = Rotation2::new(heading_rad(&self.sensed.estimate.ned_from_body));
            Horizontal::Velocity {
                velocity_mps: heading * Vector2::new(-pitch, roll) * speed_mps,
                acceleration_mps2: Vector2::zeros(),
            }
        } else {
            let lean_rad = self.params.hundredths(Param::AngleMax).to_radians();
            Horizontal::Lean { roll_rad: roll * lean_rad, pitch_rad: pitch * lean_rad }
        };
        let vertical = if self.mode == Mode::Stabilize {
            Vertical::Thrust(if throttle > 0.0 {
                1.0 + throttle * (self.airframe.thrust_to_weight - 1.0)
            } else {
                1.0 + throttle
            })
        } else {
            Vertical::Rate(if throttle > 0.0 { -throttle * up_mps } else { -throttle * down_mps })
        };
        self.flight.yaw = if yaw == 0.0 { Yaw::Hold } else { Yaw::Rate(yaw * 202.5_f64.to_radians()) };
        let limits = Limits { speed_mps: self.params.hundredths(Param::LoiterSpeed), up_mps, down_mps };
        Setpoint { horizontal, vertical, yaw: self.flight.yaw, limits }
    }

    /// ArduCopter's land detector; LAND, RTL and AUTO's landing end with stopped motors.
    pub(super) fn detect_landing(&mut self, dt_s: f64) {
        let estimate = &self.sensed.estimate;
        let push_mps2 = estimate.ned_from_body * self.sensed.specific_force_body_mps2 + Vector3::new(0.0, 0.0, GRAVITY_MPS2);
        let share = 1.0 - (-std::f64::consts::TAU * LANDED_ACCEL_HZ * dt_s).exp();
        self.flight.jolt_mps2 += (push_mps2 - self.flight.jolt_mps2) * share;
        if !self.armed || self.landed {
            return;
        }
        let still = self.controller.thrust_ratio() < LANDED_THRUST
            && self.flight.jolt_mps2.norm() < LANDED_ACCEL_MPS2
            && estimate.velocity_ned_mps.z.abs() < LANDED_SPEED_MPS
            && self.height_by_range_m().is_none_or(|height_m| height_m < LANDED_HEIGHT_M);
        self.flight.landed_for_s = if still { self.flight.landed_for_s + dt_s } else { 0.0 };
        if self.flight.landed_for_s < LANDED_S {
            return;
        }
        self.landed = true;
        self.idle_since = Some(self.now);
        if self.is_landing() {
            if self.mode == Mode::Auto {
                self.next_item();
            }
            self.disarm();
        }
    }
}
