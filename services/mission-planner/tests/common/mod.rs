//! A world for the planner: vehicles that fly straight lines by its plans, water whose verdict the test sets, and a store. What
//! must hold at all times is checked at every step, independently of how the planner comes to it.
#![allow(dead_code, unreachable_pub, reason = "each test uses its part")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may")]

mod vehicle;

use std::collections::BTreeSet;
use std::path::PathBuf;

use halcyon_mission_planner::Config;
use halcyon_mission_planner::core::{Effects, Notice, Planner, Record, ReleaseOrder};
use halcyon_mission_planner::store::Store;
use halcyon_model::{
    Approval, CalmForecast, CommandReply, Estimate, LocalPoint, Mission, MissionAction, MissionCommand, MissionId,
    MissionPhase, MissionSpec, RigId, Role, SeaState, Stamp, Task, VehicleId, Verdict, VerdictReason, VerdictState,
};

pub use vehicle::FakeVehicle;

/// Length of a step of the world, seconds.
pub const STEP_S: f64 = 0.2;
/// Observation window of the fake wave assessment, seconds.
const WINDOW_S: f64 = 20.0;

pub struct World {
    pub planner: Planner,
    pub config: Config,
    store: Option<Store>,
    store_path: PathBuf,
    _folder: tempfile::TempDir,
    pub now: Stamp,
    pub vehicles: Vec<FakeVehicle>,
    /// The verdict on all water; `None`: wave assessment is silent.
    pub verdict: Option<VerdictState>,
    /// What each sea state says of the next seconds.
    pub calm: Option<CalmForecast>,
    pub seas: Vec<SeaState>,
    next_sea: Stamp,
    pub missions: Vec<Mission>,
    pub notices: Vec<Notice>,
    /// Newest plan.
    pub plan: Option<halcyon_model::DispatchPlan>,
    pub plans: u64,
    /// Least distance between any two vehicles in the air, metres.
    pub least_separation_m: f64,
    /// What vehicles answer when they are to let their payload go, a second later; `None`: nothing.
    pub release: Option<Result<(), String>>,
    /// Every order to let a payload go.
    pub orders: Vec<ReleaseOrder>,
    /// Of these, still to be answered.
    unanswered: Vec<ReleaseOrder>,
}

pub fn id(text: &str) -> VehicleId {
    VehicleId::new(text).unwrap()
}

pub fn mission_id(text: &str) -> MissionId {
    MissionId::new(text).unwrap()
}

pub fn spec(north_m: f64, east_m: f64) -> MissionSpec {
    MissionSpec {
        name: "calm spot".into(),
        point: LocalPoint::new(north_m, east_m),
        survey_height_m: 5.0,
        approval: Approval::Automatic,
        dispatch_on_approval: true,
        leader: None,
        follower: None,
    }
}

pub fn manual(north_m: f64, east_m: f64) -> MissionSpec {
    MissionSpec { approval: Approval::Manual, ..spec(north_m, east_m) }
}

impl World {
    pub fn new(leaders: usize, followers: usize) -> Self {
        Self::with(Config::default(), leaders, followers)
    }

    /// Leaders on the jetty at 0, 16, … m east, followers at −8, −16, … m.
    pub fn with(config: Config, leaders: usize, followers: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store_path = folder.path().join("missions.sqlite");
        let now = Stamp::from_secs_f64(1_760_000_000.0);
        let store = Store::open(&store_path).unwrap();
        let (planner, effects) = Planner::restore(config.clone(), store.load().unwrap(), now);
        let mut vehicles = Vec::new();
        for i in 0..leaders {
            vehicles.push(FakeVehicle::new(&format!("leader-{}", i + 1), Role::Leader, LocalPoint::new(0.0, 16.0 * i as f64)));
        }
        for i in 0..followers {
            let home = LocalPoint::new(0.0, -8.0 * (i + 1) as f64);
            vehicles.push(FakeVehicle::new(&format!("follower-{}", i + 1), Role::Follower, home));
        }
        let mut world = Self {
            planner,
            config,
            store: Some(store),
            store_path,
            _folder: folder,
            now,
            vehicles,
            verdict: Some(VerdictState::Safe),
            calm: None,
            seas: Vec::new(),
            next_sea: now,
            missions: Vec::new(),
            notices: Vec::new(),
            plan: None,
            plans: 0,
            least_separation_m: f64::INFINITY,
            release: Some(Ok(())),
            orders: Vec::new(),
            unanswered: Vec::new(),
        };
        world.take(effects);
        world.run(0.4);
        world
    }

    pub fn vehicle(&mut self, name: &str) -> &mut FakeVehicle {
        self.vehicles.iter_mut().find(|vehicle| vehicle.id.as_str() == name).unwrap()
    }

    pub fn mission(&self, name: &str) -> &Mission {
        self.missions.iter().find(|mission| mission.id.as_str() == name).unwrap()
    }

    pub fn phase(&self, name: &str) -> MissionPhase {
        self.mission(name).phase
    }

    /// The phases that a mission has been through.
    pub fn phases(&self, name: &str) -> Vec<MissionPhase> {
        self.mission(name).history.iter().map(|transition| transition.phase).collect()
    }

    pub fn last_why(&self, name: &str) -> String {
        self.mission(name).history.last().unwrap().why.clone()
    }

    pub fn task(&self, vehicle: &str) -> Option<&Task> {
        self.plan.as_ref().unwrap().task_for(&id(vehicle))
    }

    pub fn command_as(&mut self, who: &str, action: MissionAction) -> CommandReply {
        let command = MissionCommand { stamp: self.now, deadline: self.now.plus_secs_f64(5.0), who: who.into(), action };
        self.send(&command)
    }

    pub fn send(&mut self, command: &MissionCommand) -> CommandReply {
        let (reply, effects) = self.planner.command(command, self.now);
        self.take(effects);
        reply
    }

    #[track_caller]
    pub fn command(&mut self, action: MissionAction) {
        let reply = self.command_as("anna", action);
        assert!(reply.accepted, "{}", reply.reason);
    }

    pub fn create(&mut self, name: &str, spec: MissionSpec) {
        self.command(MissionAction::Create(mission_id(name), spec));
    }

    /// Steps the planner once, now.
    pub fn step_planner(&mut self) {
        let effects = self.planner.step(self.now);
        self.take(effects);
    }

    /// Lets the world run for `duration_s`.
    pub fn run(&mut self, duration_s: f64) {
        let end = self.now.plus_secs_f64(duration_s - 1e-6);
        while self.now < end {
            self.advance();
        }
    }

    /// Lets the world run until `mission` is in `phase`.
    #[track_caller]
    pub fn run_to(&mut self, mission: &str, phase: MissionPhase, within_s: f64) {
        let end = self.now.plus_secs_f64(within_s);
        while self.phase(mission) != phase {
            assert!(
                self.now < end && !self.phase(mission).is_final(),
                "{phase:?} not reached within {within_s} s: {:#?}",
                self.mission(mission).history
            );
            self.advance();
        }
    }

    #[track_caller]
    pub fn run_to_end(&mut self, mission: &str, within_s: f64) -> MissionPhase {
        let end = self.now.plus_secs_f64(within_s);
        while !self.phase(mission).is_final() {
            assert!(self.now < end, "no end within {within_s} s: {:#?}", self.mission(mission).history);
            self.advance();
        }
        self.phase(mission)
    }

    fn advance(&mut self) {
        self.now = self.now.plus_secs_f64(STEP_S);
        let others = self.vehicles.clone();
        for vehicle in &mut self.vehicles {
            vehicle.fly(self.now, STEP_S, self.plan.as_ref(), &others);
        }
        self.measure_separation();
        for vehicle in &self.vehicles {
            if !vehicle.silent {
                let _ = self.planner.observe_vehicle(vehicle.state(self.now), self.now);
            }
        }
        self.assess();
        self.step_planner();
        self.answer_releases();
    }

    fn answer_releases(&mut self) {
        let Some(answer) = self.release.clone() else { return };
        let due = |order: &ReleaseOrder| self.now.seconds_since(order.stamp) >= 1.0;
        let (due, later) = std::mem::take(&mut self.unanswered).into_iter().partition(due);
        self.unanswered = later;
        let due: Vec<ReleaseOrder> = due;
        for order in due {
            let effects = self.planner.observe_release(&order.mission, order.attempt, answer.clone(), self.now);
            self.take(effects);
        }
    }

    fn measure_separation(&mut self) {
        for (i, one) in self.vehicles.iter().enumerate() {
            for other in &self.vehicles[i + 1..] {
                if one.airborne() && other.airborne() {
                    self.least_separation_m = self.least_separation_m.min((one.position_m - other.position_m).norm());
                }
            }
        }
    }

    /// Once a second, each leader in the air says what it sees below.
    fn assess(&mut self) {
        if self.now < self.next_sea {
            return;
        }
        self.next_sea = self.now.plus_secs_f64(1.0);
        let Some(verdict) = self.verdict else { return };
        let seen: Vec<SeaState> = self
            .vehicles
            .iter_mut()
            .filter(|vehicle| vehicle.role == Role::Leader && vehicle.airborne())
            .map(|vehicle| sea(&vehicle.id, vehicle.place(), self.now, vehicle.at_height_since.unwrap_or(self.now), verdict))
            .collect();
        for mut sea in seen {
            sea.calm.clone_from(&self.calm);
            let _ = self.planner.observe_sea(sea.clone(), self.now);
            self.seas.push(sea);
        }
    }

    /// Takes what the planner says; stores first, and checks what must always hold.
    fn take(&mut self, effects: Effects) {
        for mission in &effects.missions {
            let known = self.missions.iter().find(|known| known.id == mission.id).map_or(0, |known| known.history.len());
            let stored = effects
                .records
                .iter()
                .filter(|record| matches!(record, Record::Entered { mission: stored, .. } if stored.id == mission.id))
                .count();
            assert_eq!(known + stored, mission.history.len(), "announced but not stored: {mission:#?}");
        }
        self.store.as_mut().unwrap().append(&effects.records).unwrap();
        for mission in effects.missions {
            self.missions.retain(|known| known.id != mission.id);
            self.missions.push(mission);
        }
        self.notices.extend(effects.notices);
        for order in effects.releases {
            let vehicle = self.vehicles.iter().find(|vehicle| vehicle.id == order.vehicle).unwrap();
            assert!(vehicle.has_payload && !vehicle.airborne(), "{order:?}");
            assert!(order.stamp == self.now && order.deadline > self.now);
            self.orders.push(order.clone());
            self.unanswered.push(order);
        }
        if let Some(plan) = effects.plan {
            self.check_plan(&plan);
            self.plan = Some(plan);
            self.plans += 1;
        }
    }

    fn check_plan(&self, plan: &halcyon_model::DispatchPlan) {
        if let Some(before) = &self.plan {
            assert!(plan.generation > before.generation, "{} after {}", plan.generation, before.generation);
        }
        assert!(plan.valid_until > self.now && plan.stamp == self.now);
        let vehicles: BTreeSet<_> = plan.assignments.iter().map(|assignment| &assignment.vehicle).collect();
        assert_eq!(vehicles.len(), plan.assignments.len(), "a vehicle has two tasks: {plan:#?}");
        let follows = |assignment: &halcyon_model::Assignment| match &assignment.task {
            Task::Follow { leader, slot } => {
                Some((leader.clone(), nalgebra::Vector3::new(slot.forward_m, slot.right_m, slot.up_m)))
            }
            _ => None,
        };
        let slots: Vec<_> = plan.assignments.iter().filter_map(follows).collect();
        for (index, (leader, slot)) in slots.iter().enumerate() {
            assert!(slot.norm() >= 5.0, "a slot on the leader: {plan:#?}");
            let others = slots[index + 1..].iter().filter(|(other, _)| other == leader);
            for (_, other) in others {
                assert!((slot - other).norm() >= 5.0, "two followers in one slot: {plan:#?}");
            }
        }
        let mut places: Vec<LocalPoint> = Vec::new();
        for assignment in &plan.assignments {
            let point = match &assignment.task {
                Task::Survey { point, .. } => point,
                Task::Land { point, clearance, .. } => {
                    if let Some(clearance) = clearance {
                        self.check_clearance(*point, clearance);
                    }
                    point
                }
                _ => continue,
            };
            assert!(places.iter().all(|other| other.distance_m(point) >= 5.0), "two vehicles to one place: {plan:#?}");
            places.push(*point);
        }
    }

    /// Permission to descend rests on a sea state that is safe, of that spot, and fresh; nothing unsafe is known.
    fn check_clearance(&self, spot: LocalPoint, clearance: &halcyon_model::Clearance) {
        assert_eq!(clearance.verdict, VerdictState::Safe);
        assert!(clearance.valid_until > self.now);
        let relevant = |sea: &&SeaState| {
            sea.position.distance_m(&spot) <= 20.0
                && self.now.seconds_since(sea.stamp) <= 5.0
                && self.now <= sea.verdict.valid_until
        };
        let basis = self.seas.iter().rev().filter(relevant).find(|sea| sea.stamp == clearance.sea_state_stamp);
        let basis = basis.expect("a clearance rests on a fresh sea state of the spot");
        assert_eq!(basis.verdict.state, VerdictState::Safe);
        assert!(clearance.valid_until <= basis.verdict.valid_until);
        let newest_of_rig = self.seas.iter().rev().find(|sea| sea.rig == basis.rig).unwrap();
        assert_eq!(newest_of_rig.stamp, basis.stamp, "a newer sea state of the rig was passed over");
    }

    /// Ends the planner as a crash would, and starts a new one from the store after `away_s`.
    pub fn restart(&mut self, away_s: f64) {
        drop(self.store.take());
        // Whoever waited for an answer is gone.
        self.unanswered.clear();
        let until = self.now.plus_secs_f64(away_s);
        while self.now < until {
            self.now = self.now.plus_secs_f64(STEP_S);
            let others = self.vehicles.clone();
            for vehicle in &mut self.vehicles {
                vehicle.fly(self.now, STEP_S, self.plan.as_ref(), &others);
            }
        }
        let store = Store::open(&self.store_path).unwrap();
        let saved = store.load().unwrap();
        for saved in &saved.missions {
            let announced = self.missions.iter().find(|mission| mission.id == saved.mission.id).unwrap();
            assert_eq!(announced.history, saved.mission.history);
            assert_eq!(announced.spec, saved.mission.spec);
        }
        let (planner, effects) = Planner::restore(self.config.clone(), saved, self.now);
        self.planner = planner;
        self.store = Some(store);
        self.take(effects);
    }
}

/// A sea state as wave assessment issues it.
pub fn sea(vehicle: &VehicleId, position: LocalPoint, now: Stamp, since: Stamp, state: VerdictState) -> SeaState {
    let h_s_m = Some(Estimate { value: 0.05, low: 0.04, high: 0.06 });
    SeaState {
        stamp: now,
        rig: RigId::new(vehicle.as_str()).unwrap(),
        window_start: since.max(now.plus_secs_f64(-WINDOW_S)),
        window_s: WINDOW_S,
        position,
        patches: 100,
        coverage: 0.9,
        waves: 20,
        h_mean_m: h_s_m,
        h_s_m,
        h_max_m: h_s_m,
        h_m0_m: h_s_m,
        t_z_s: None,
        slope_rms_rad: None,
        h_rms_m: None,
        h_tenth_m: None,
        t_p_s: None,
        t_m01_s: None,
        t_m02_s: None,
        t_e_s: None,
        vertical_speed_rms_mps: None,
        directional: None,
        spectrum: None,
        quality: Vec::new(),
        calm: None,
        trace: Vec::new(),
        verdict: Verdict {
            state,
            probability: None,
            reasons: vec![VerdictReason {
                check: "significant_height".into(),
                passed: state == VerdictState::Safe,
                text: "H_s against 0.1 m".into(),
            }],
            valid_until: now.plus_secs_f64(10.0),
        },
    }
}
