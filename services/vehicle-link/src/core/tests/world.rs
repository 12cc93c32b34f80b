//! A world of point-mass copters with ArduCopter's modes, each flown by an executor. Independent of the simulator crate.

use halcyon_model::{
    Activity, Assignment, Clearance, DispatchPlan, Fix, FleetOrigin, FlightMode, Geodetic, LandedState, LocalPoint, Range,
    Role, Slot, Stamp, Task, VehicleAction, VehicleCommand, VehicleId, VehicleState, VerdictState,
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::core::commands::Command;
use crate::core::executor::{Decision, Executor, ExecutorConfig, Note, Output, PlanAnswer};
use crate::core::guidance::{Guidance, Setpoint};
use crate::core::limits::{FailSafeLimits, Limits};
use crate::core::payload::Payload;

pub(super) const DT_S: f64 = 0.1;

pub(super) fn id(name: &str) -> VehicleId {
    VehicleId::new(name).unwrap()
}

pub(super) fn origin() -> FleetOrigin {
    FleetOrigin(Geodetic::from_deg(53.1, -2.9, 0.0))
}

pub(super) fn t0() -> Stamp {
    Stamp::from_secs_f64(1_700_000_000.0)
}

/// A point mass with the autopilot's modes.
pub(super) struct Copter {
    pub(super) id: VehicleId,
    pub(super) mode: FlightMode,
    pub(super) armed: bool,
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) heading: f64,
    pub(super) battery: Option<f64>,
    pub(super) estimator_ok: bool,
    pub(super) ready: bool,
    /// Nothing is heard from it.
    pub(super) silent: bool,
    pub(super) holds_payload: bool,
    /// What its estimator believes is where it is and this: jumps, a barometer's drift. It flies by what it believes.
    pub(super) off: Vector3<f64>,
    /// Seconds since it booted.
    pub(super) boot_s: f64,
    /// It has a rangefinder, which reads too much by this.
    pub(super) rangefinder: Option<f64>,
    /// Waves under it: amplitude, metres, and period, seconds.
    pub(super) waves: (f64, f64),
    /// It drops targets further from the origin than this, as ArduCopter does outside its own fence, metres.
    pub(super) fence_m: f64,
    /// It notices when it has landed.
    pub(super) finds_ground: bool,
    pub(super) home: Vector3<f64>,
    /// Takes off to a height above what is below it, as ArduCopter does with a rangefinder, and not above home.
    pub(super) climbs_from_below: bool,
    surface_z: f64,
    climb_to: Option<f64>,
    setpoint: Option<Setpoint>,
    grounded_s: f64,
    frozen: Option<VehicleState>,
}

impl Copter {
    fn on_ground(&self) -> bool {
        self.position.z >= self.surface_z - 0.02
    }

    fn take(&mut self, command: Command) -> Result<(), crate::core::commands::CommandError> {
        let no = |result| {
            let result = crate::core::commands::Refusal::Listed(result);
            Err(crate::core::commands::CommandError::Refused { result, words: None })
        };
        match command {
            Command::Arm if self.ready && self.mode == FlightMode::Guided => self.armed = true,
            Command::Disarm { force } if force || self.on_ground() && self.finds_ground => self.armed = false,
            Command::SetMode(mode) => {
                self.mode = mode;
                self.setpoint = None;
                self.climb_to = None;
            }
            Command::TakeOff { height_above_home_m } if self.armed && self.mode == FlightMode::Guided => {
                let below_m = if self.climbs_from_below { -self.position.z } else { -self.home.z };
                self.climb_to = Some(height_above_home_m + below_m);
            }
            Command::SetInterval(_) | Command::SetHome => {}
            Command::Payload(payload) => self.holds_payload = !payload.releases,
            Command::Arm | Command::Disarm { .. } | Command::TakeOff { .. } => return no("failed"),
        }
        Ok(())
    }

    /// It forgets a take-off that it was asked for.
    pub(super) fn hold_down(&mut self) {
        self.climb_to = None;
        self.setpoint = None;
    }

    fn target(&mut self, setpoint: Setpoint) {
        if setpoint.position_ned_m.xy().norm() <= self.fence_m {
            self.setpoint = Some(setpoint);
        } else if let Some(before) = &mut self.setpoint {
            // Its own goes on without an update, and is then stood at.
            before.velocity_ned_mps = Vector3::zeros();
        }
    }

    fn step(&mut self, dt: f64) {
        self.boot_s += dt;
        let (amplitude, period) = self.waves;
        self.surface_z = -amplitude * (std::f64::consts::TAU * self.boot_s / period).sin();
        let believed = self.position + self.off;
        let wanted = match (self.armed, self.mode) {
            (false, _) => {
                // Without motors it falls, or stands.
                self.velocity =
                    if self.on_ground() { Vector3::zeros() } else { self.velocity + Vector3::new(0.0, 0.0, 9.8 * dt) };
                self.velocity
            }
            (true, FlightMode::Guided) => match (self.climb_to, self.setpoint) {
                (_, Some(setpoint)) => {
                    self.climb_to = None;
                    if let Some(heading) = setpoint.heading_rad {
                        self.heading = heading;
                    }
                    setpoint.velocity_ned_mps + 1.0 * (setpoint.position_ned_m - believed)
                }
                (Some(height), None) => Vector3::new(0.0, 0.0, (-height - believed.z).clamp(-1.5, 1.5)),
                (None, None) => Vector3::zeros(),
            },
            (true, FlightMode::Land) => Vector3::new(0.0, 0.0, 0.5),
            (true, FlightMode::Rtl) => {
                let back = self.home - self.position;
                if back.xy().norm() > 0.5 {
                    Vector3::new(back.x, back.y, 0.0).cap_magnitude(3.0)
                } else {
                    Vector3::new(0.0, 0.0, 0.5)
                }
            }
            (true, _) => Vector3::zeros(),
        };
        if self.armed {
            self.velocity += ((wanted - self.velocity) / 0.4).cap_magnitude(4.0) * dt;
        }
        self.position += self.velocity * dt;
        if self.position.z > self.surface_z {
            self.position.z = self.surface_z;
            self.velocity = Vector3::zeros();
        }
        let landing = matches!(self.mode, FlightMode::Land | FlightMode::Rtl);
        self.grounded_s = if self.on_ground() && landing && self.finds_ground { self.grounded_s + dt } else { 0.0 };
        if self.grounded_s > 1.0 {
            self.armed = false;
        }
    }

    pub(super) fn state(&self, now: Stamp) -> VehicleState {
        let knows = self.on_ground() && (self.finds_ground || !self.armed);
        let landed = if knows { LandedState::OnGround } else { LandedState::InAir };
        let believed = self.position + self.off;
        let range_m = self.rangefinder.map(|error| (self.surface_z - self.position.z).max(0.05) + error);
        VehicleState {
            stamp: now,
            vehicle: self.id.clone(),
            role: Role::Follower,
            position: origin().frame().geodetic_from_ned(believed),
            position_ned_m: believed,
            velocity_ned_mps: self.velocity,
            ned_from_body: UnitQuaternion::from_euler_angles(0.0, 0.0, self.heading),
            heading_rad: self.heading,
            home: Some(origin().frame().geodetic_from_ned(self.home)),
            mode: self.mode,
            armed: self.armed,
            landed,
            battery_fraction: self.battery,
            battery_v: None,
            fix: Some(Fix { kind: 3, satellites: 12, horizontal_sigma_m: None }),
            estimator_ok: self.estimator_ok,
            ready_to_arm: self.ready,
            boot_s: self.boot_s,
            activity: Activity::Idle,
            plan_generation: 0,
            touchdown: None,
            acceleration_ned_mps2: None,
            intent: None,
            range: range_m.map(|distance_m| Range { stamp: now, distance_m }),
            ages: halcyon_model::Ages::default(),
            link: None,
            firmware: None,
            has_payload: false,
        }
    }
}

/// Copters, executors and what came out of them.
pub(super) struct World {
    pub(super) now: Stamp,
    pub(super) copters: Vec<Copter>,
    pub(super) executors: Vec<Executor>,
    /// Of the last step, by vehicle.
    pub(super) outputs: Vec<Vec<Output>>,
    pub(super) notes: Vec<(usize, Note)>,
    /// Least true distance between two that fly.
    pub(super) least_m: f64,
    /// Vehicles hear each other.
    pub(super) mesh: bool,
    pub(super) generation: u64,
}

pub(super) fn config(name: &str) -> ExecutorConfig {
    ExecutorConfig {
        vehicle: id(name),
        limits: Limits::default(),
        fail_safe: FailSafeLimits::default(),
        guidance: Guidance::default(),
        payload: Payload::default(),
        home_height_m: 0.0,
        frame: origin().frame(),
    }
}

impl World {
    /// Vehicles `v0`, `v1` … on the ground at these places (north, east).
    pub(super) fn new(homes: &[(f64, f64)]) -> Self {
        let copter = |(index, home): (usize, &(f64, f64))| Copter {
            id: id(&format!("v{index}")),
            mode: FlightMode::Stabilize,
            armed: false,
            position: Vector3::new(home.0, home.1, 0.0),
            velocity: Vector3::zeros(),
            heading: 0.0,
            battery: Some(0.9),
            estimator_ok: true,
            ready: true,
            silent: false,
            holds_payload: true,
            off: Vector3::zeros(),
            boot_s: 100.0,
            rangefinder: None,
            waves: (0.0, 4.0),
            fence_m: f64::INFINITY,
            finds_ground: true,
            home: Vector3::new(home.0, home.1, 0.0),
            climbs_from_below: false,
            surface_z: 0.0,
            climb_to: None,
            setpoint: None,
            grounded_s: 0.0,
            frozen: None,
        };
        let copters: Vec<_> = homes.iter().enumerate().map(copter).collect();
        let executors = (0..homes.len()).map(|index| Executor::new(config(&format!("v{index}")))).collect();
        let outputs = vec![Vec::new(); homes.len()];
        Self { now: t0(), copters, executors, outputs, notes: Vec::new(), least_m: f64::INFINITY, mesh: true, generation: 0 }
    }

    /// One that flies already, in GUIDED, at a place and height.
    pub(super) fn airborne(&mut self, index: usize, position: Vector3<f64>) {
        let copter = &mut self.copters[index];
        copter.position = position;
        copter.armed = true;
        copter.mode = FlightMode::Guided;
    }

    /// Publishes a plan, valid for `valid_s`.
    pub(super) fn plan(&mut self, tasks: &[(usize, Task)], valid_s: f64) -> Vec<PlanAnswer> {
        self.generation += 1;
        let assign =
            |(index, task): &(usize, Task)| Assignment { vehicle: self.copters[*index].id.clone(), task: task.clone() };
        let plan = DispatchPlan {
            stamp: self.now,
            generation: self.generation,
            mission: None,
            valid_until: self.now.plus_secs_f64(valid_s),
            assignments: tasks.iter().map(assign).collect(),
        };
        self.executors.iter_mut().map(|executor| executor.observe_plan(&plan, self.now)).collect()
    }

    pub(super) fn command(&mut self, index: usize, action: VehicleAction) -> Decision {
        let command = VehicleCommand {
            stamp: self.now,
            deadline: self.now.plus_secs_f64(2.0),
            who: "test".into(),
            vehicle: self.copters[index].id.clone(),
            action,
        };
        let decision = self.executors[index].command(&command, self.now);
        if let Decision::Ask(command) = decision {
            // The actor answers its sender with this; the executor isn't told.
            let _ = self.copters[index].take(command);
        }
        decision
    }

    pub(super) fn activity(&self, index: usize) -> &Activity {
        self.executors[index].activity()
    }

    pub(super) fn setpoint(&self, index: usize) -> Option<Setpoint> {
        self.outputs[index].iter().find_map(|output| match output {
            Output::Setpoint(setpoint) => Some(*setpoint),
            _ => None,
        })
    }

    pub(super) fn height(&self, index: usize) -> f64 {
        -self.copters[index].position.z
    }

    /// A tenth of a second, in which only the vehicles move.
    pub(super) fn step_vehicles(&mut self) {
        self.now = self.now.plus_secs_f64(DT_S);
        for copter in &mut self.copters {
            copter.step(DT_S);
        }
    }

    /// A tenth of a second.
    pub(super) fn step(&mut self) {
        self.step_vehicles();
        for copter in &mut self.copters {
            if !copter.silent || copter.frozen.is_none() {
                copter.frozen = Some(copter.state(self.now));
            }
        }
        let mut states: Vec<VehicleState> = self.copters.iter().map(|copter| copter.frozen.clone().unwrap()).collect();
        for (state, executor) in states.iter_mut().zip(&self.executors) {
            executor.complete(state);
        }
        for (index, executor) in self.executors.iter_mut().enumerate() {
            if !self.copters[index].silent {
                executor.observe_self(states[index].clone(), self.now, self.now);
            }
            for (other, state) in states.iter().enumerate() {
                if other != index && self.mesh && !self.copters[other].silent {
                    executor.observe_neighbour(state.clone(), self.now);
                }
            }
            self.outputs[index] = executor.step(self.now);
            for output in &self.outputs[index] {
                match output {
                    Output::Setpoint(setpoint) => self.copters[index].target(*setpoint),
                    Output::Request(command) => {
                        let outcome = self.copters[index].take(*command);
                        executor.observe_outcome(command, &outcome, self.now);
                    }
                    Output::Note(note) => self.notes.push((index, note.clone())),
                    Output::Withdraw | Output::AskStreams => {}
                }
            }
        }
        for a in 0..self.copters.len() {
            for b in a + 1..self.copters.len() {
                let (a, b) = (&self.copters[a], &self.copters[b]);
                if a.armed && b.armed && !a.on_ground() && !b.on_ground() {
                    self.least_m = self.least_m.min((a.position - b.position).norm());
                }
            }
        }
    }

    /// Steps for so many seconds; `each` sees every step, before it, and may change the world.
    pub(super) fn run(&mut self, seconds: f64, mut each: impl FnMut(&mut Self)) {
        for _ in 0..(seconds / DT_S).round() as usize {
            each(self);
            self.step();
        }
    }

    /// Steps until `done`, at most so many seconds. Returns how long it took.
    #[track_caller]
    pub(super) fn until(&mut self, seconds: f64, mut each: impl FnMut(&mut Self), done: impl Fn(&Self) -> bool) -> f64 {
        let start = self.now;
        while !done(self) {
            let took_s = self.now.seconds_since(start);
            assert!(
                took_s < seconds,
                "not within {seconds} s: {:?}",
                self.executors.iter().map(Executor::activity).collect::<Vec<_>>()
            );
            each(self);
            self.step();
        }
        self.now.seconds_since(start)
    }
}

pub(super) fn survey(north_m: f64, east_m: f64) -> Task {
    Task::Survey { point: LocalPoint::new(north_m, east_m), height_m: 5.0, heading_rad: Some(1.0) }
}

pub(super) fn follow(leader: &str, right_m: f64) -> Task {
    Task::Follow { leader: id(leader), slot: Slot { forward_m: 0.0, right_m, up_m: 0.0 } }
}

pub(super) fn land(north_m: f64, east_m: f64, cleared_until: Option<Stamp>) -> Task {
    Task::Land {
        point: LocalPoint::new(north_m, east_m),
        approach_height_m: 5.0,
        clearance: cleared_until.map(|valid_until| Clearance {
            verdict: VerdictState::Safe,
            sea_state_stamp: t0(),
            valid_until,
            windows: Vec::new(),
        }),
    }
}
