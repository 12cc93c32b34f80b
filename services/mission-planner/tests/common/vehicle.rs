//! A vehicle that does what the newest plan says, in straight lines, and stops when the plan lapses.

#![allow(clippy::collapsible_match, reason = "guards that fly would be worse")]

use halcyon_model::{
    Activity, DispatchPlan, FlightMode, Geodetic, LandedState, LocalFrame, LocalPoint, Role, Stamp, Task, VehicleId,
    VehicleState, VerdictState,
};
use nalgebra::{UnitQuaternion, Vector3};

const SPEED_MPS: f64 = 5.0;
const CLIMB_MPS: f64 = 1.0;
/// On the last metres to the water, and at home.
const DESCENT_MPS: f64 = 0.4;
const SETTLING_S: f64 = 3.0;

#[derive(Debug, Clone)]
pub struct FakeVehicle {
    pub id: VehicleId,
    pub role: Role,
    pub home: LocalPoint,
    /// North, east, up.
    pub position_m: Vector3<f64>,
    pub heading_rad: f64,
    pub armed: bool,
    pub activity: Activity,
    pub generation: u64,
    pub battery: Option<f64>,
    pub ready: bool,
    /// It knows where its home is.
    pub home_known: bool,
    pub touchdown: Option<LocalPoint>,
    pub has_payload: bool,
    /// Says nothing and hears nothing.
    pub silent: bool,
    /// Does not move.
    pub stuck: bool,
    /// Overrides what it does: it hovers, and says this.
    pub seized: Option<Activity>,
    /// Since when it is at its working height, for the fake camera.
    pub at_height_since: Option<Stamp>,
    there_since: Option<Stamp>,
    task: Option<Task>,
    /// What it flew last: it does not take off again for the same.
    flown: Option<Task>,
    plan_until: Stamp,
}

impl FakeVehicle {
    pub fn new(name: &str, role: Role, home: LocalPoint) -> Self {
        Self {
            id: VehicleId::new(name).unwrap(),
            role,
            home,
            position_m: Vector3::new(home.north_m, home.east_m, 0.0),
            heading_rad: 0.0,
            armed: false,
            activity: Activity::Idle,
            generation: 0,
            battery: Some(0.9),
            ready: true,
            home_known: true,
            touchdown: None,
            has_payload: false,
            silent: false,
            stuck: false,
            seized: None,
            at_height_since: None,
            there_since: None,
            task: None,
            flown: None,
            plan_until: Stamp::default(),
        }
    }

    pub fn airborne(&self) -> bool {
        self.position_m.z > 0.05
    }

    pub fn place(&self) -> LocalPoint {
        LocalPoint::new(self.position_m.x, self.position_m.y)
    }

    /// One step by the newest plan.
    pub fn fly(&mut self, now: Stamp, step_s: f64, plan: Option<&DispatchPlan>, others: &[Self]) {
        if let Some(plan) = plan.filter(|plan| !self.silent && plan.generation > self.generation && plan.valid_until > now) {
            self.generation = plan.generation;
            let task = plan.task_for(&self.id).cloned();
            if task.as_ref().map(std::mem::discriminant) != self.task.as_ref().map(std::mem::discriminant) {
                self.there_since = None;
            }
            self.task = task;
            self.plan_until = plan.valid_until;
        }
        if let Some(activity) = &self.seized {
            self.activity = activity.clone();
            return;
        }
        if self.stuck {
            return;
        }
        match self.task.clone() {
            None => {}
            Some(_) if now > self.plan_until => {
                if self.airborne() {
                    self.activity = Activity::FailSafe { reason: "the plan lapsed".into() };
                }
            }
            Some(Task::Hold) => {
                self.activity = if self.airborne() { Activity::Holding { settled: true } } else { self.activity.clone() };
                if !self.airborne() && self.activity != Activity::Landed {
                    self.activity = Activity::Idle;
                    self.armed = false;
                }
            }
            Some(Task::Survey { point, height_m, heading_rad }) => {
                if self.take_off(height_m, step_s) {
                    self.heading_rad = heading_rad.unwrap_or(self.heading_rad);
                    let there = self.go(point, height_m, step_s, now);
                    self.activity = match there {
                        None => Activity::Transit,
                        Some(settled) => Activity::Holding { settled },
                    };
                }
            }
            Some(Task::Follow { leader, slot }) => {
                if self.take_off(5.0, step_s) {
                    let Some(leader) = others.iter().find(|other| other.id == leader) else { return };
                    let (sin, cos) = leader.heading_rad.sin_cos();
                    let point = LocalPoint::new(
                        leader.position_m.x + slot.forward_m * cos - slot.right_m * sin,
                        leader.position_m.y + slot.forward_m * sin + slot.right_m * cos,
                    );
                    let there = self.go(point, leader.position_m.z + slot.up_m, step_s, now);
                    let slot_error_m = self.place().distance_m(&point);
                    self.activity = Activity::Following { settled: there == Some(true), slot_error_m };
                }
            }
            Some(Task::Land { point, approach_height_m, clearance }) => {
                if self.activity == Activity::Landed {
                    return;
                }
                let cleared = clearance.is_some_and(|c| c.verdict == VerdictState::Safe && now <= c.valid_until);
                let over = self.place().distance_m(&point) < 0.5;
                if over && cleared {
                    self.activity = Activity::Descending;
                    self.descend(step_s);
                    if !self.airborne() {
                        self.activity = Activity::Landed;
                        self.touchdown = Some(self.place());
                    }
                } else {
                    self.activity = Activity::Approaching;
                    self.go(point, approach_height_m, step_s, now);
                }
            }
            Some(Task::Return) => {
                if !self.airborne() {
                    self.armed = false;
                    self.activity = Activity::Idle;
                } else if self.place().distance_m(&self.home) > 0.3 {
                    self.activity = Activity::Returning;
                    self.go(self.home, self.position_m.z.max(3.0), step_s, now);
                } else {
                    self.descend(step_s);
                }
            }
        }
        if self.airborne() {
            self.flown.clone_from(&self.task);
        }
        if self.position_m.z < 2.0 {
            self.at_height_since = None;
        } else {
            self.at_height_since.get_or_insert(now);
        }
    }

    fn take_off(&mut self, height_m: f64, step_s: f64) -> bool {
        if self.airborne() && self.activity != Activity::TakingOff {
            return true;
        }
        if !self.airborne() && self.flown.is_some() && self.flown == self.task {
            self.activity = Activity::Landed;
            return false;
        }
        if !self.armed && !self.ready {
            self.activity = Activity::Preparing;
            return false;
        }
        self.armed = true;
        self.activity = Activity::TakingOff;
        self.position_m.z = (self.position_m.z + CLIMB_MPS * step_s).min(height_m);
        if self.position_m.z >= height_m {
            self.activity = Activity::Transit;
        }
        false
    }

    /// Towards a place; once there, whether it has been for the settling time.
    fn go(&mut self, point: LocalPoint, height_m: f64, step_s: f64, now: Stamp) -> Option<bool> {
        let way = Vector3::new(point.north_m, point.east_m, height_m) - self.position_m;
        let horizontal = way.xy();
        let step = horizontal * (SPEED_MPS * step_s / horizontal.norm().max(1e-9)).min(1.0);
        self.position_m.x += step.x;
        self.position_m.y += step.y;
        self.position_m.z += way.z.clamp(-CLIMB_MPS * step_s, CLIMB_MPS * step_s);
        if (Vector3::new(point.north_m, point.east_m, height_m) - self.position_m).norm() > 0.5 {
            self.there_since = None;
            return None;
        }
        let since = *self.there_since.get_or_insert(now);
        Some(now.seconds_since(since) >= SETTLING_S)
    }

    fn descend(&mut self, step_s: f64) {
        self.position_m.z = (self.position_m.z - DESCENT_MPS * step_s).max(0.0);
        if !self.airborne() {
            self.position_m.z = 0.0;
            self.armed = false;
            self.activity = Activity::Idle;
        }
    }

    pub fn state(&self, now: Stamp) -> VehicleState {
        let frame = LocalFrame::new(Geodetic::from_deg(53.1, -2.9, 0.0));
        let position_ned_m = Vector3::new(self.position_m.x, self.position_m.y, -self.position_m.z);
        VehicleState {
            stamp: now,
            vehicle: self.id.clone(),
            role: self.role,
            position: frame.geodetic_from_ned(position_ned_m),
            position_ned_m,
            velocity_ned_mps: Vector3::zeros(),
            ned_from_body: UnitQuaternion::from_euler_angles(0.0, 0.0, self.heading_rad),
            heading_rad: self.heading_rad,
            home: self.home_known.then(|| frame.geodetic_from_ned(Vector3::new(self.home.north_m, self.home.east_m, 0.0))),
            mode: FlightMode::Guided,
            armed: self.armed,
            landed: if self.airborne() { LandedState::InAir } else { LandedState::OnGround },
            battery_fraction: self.battery,
            battery_v: None,
            fix: None,
            estimator_ok: true,
            ready_to_arm: self.ready,
            boot_s: 100.0,
            activity: self.activity.clone(),
            plan_generation: self.generation,
            touchdown: self.touchdown,
            acceleration_ned_mps2: None,
            intent: None,
            range: None,
            ages: halcyon_model::Ages::default(),
            link: None,
            firmware: None,
            has_payload: self.has_payload,
        }
    }
}
