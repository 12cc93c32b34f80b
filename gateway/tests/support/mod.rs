//! A gateway on a free port, over a store that the test fills and a command plane that the test plays.
#![allow(dead_code, unreachable_pub, reason = "each test program uses its own part, none exports it")]

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use futures::FutureExt as _;
use futures::future::BoxFuture;
use halcyon_chassis::CancellationToken;
use halcyon_gateway::app::{App, Parts, Store};
use halcyon_gateway::core::fleet::Fleet;
use halcyon_gateway::port::{CommandFailure, Commands, Previews};
use halcyon_gateway::{Config, api, feed, server};
use halcyon_model::*;

/// A time this many seconds after the one at which the fleet's clock stands, until [`Gateway::set_clock`].
pub fn at(offset_s: f64) -> Stamp {
    Stamp::from_nanos(1_790_000_000_000_000_000).plus_secs_f64(offset_s)
}

/// Plays the planner and the vehicles.
#[derive(Default)]
pub struct Played {
    pub mission_commands: Mutex<Vec<MissionCommand>>,
    pub vehicle_commands: Mutex<Vec<VehicleCommand>>,
    /// Answers in order; when empty, every command is accepted.
    pub answers: Mutex<Vec<Result<CommandReply, CommandFailure>>>,
    /// When set, an answer waits for a permit.
    pub held: Option<Arc<tokio::sync::Semaphore>>,
}

impl Played {
    fn answer(&self, mission: Option<MissionId>) -> BoxFuture<'_, Result<CommandReply, CommandFailure>> {
        async move {
            if let Some(held) = &self.held {
                held.acquire().await.unwrap().forget();
            }
            let mut answers = self.answers.lock().unwrap();
            if answers.is_empty() {
                Ok(CommandReply { mission, ..CommandReply::accepted(at(0.0), "done") })
            } else {
                answers.remove(0)
            }
        }
        .boxed()
    }
}

struct Shared(Arc<Played>);

impl Commands for Shared {
    fn mission(&self, command: MissionCommand, _: Duration) -> BoxFuture<'_, Result<CommandReply, CommandFailure>> {
        let id = match &command.action {
            MissionAction::Create(id, _)
            | MissionAction::Approve(id)
            | MissionAction::Dispatch(id)
            | MissionAction::Pause(id)
            | MissionAction::Resume(id)
            | MissionAction::Abort(id)
            | MissionAction::Release(id)
            | MissionAction::SkipRelease(id) => Some(id.clone()),
            MissionAction::Form(_) | MissionAction::Disband(_) => None,
        };
        self.0.mission_commands.lock().unwrap().push(command);
        self.0.answer(id)
    }

    fn vehicle(&self, command: VehicleCommand, _: Duration) -> BoxFuture<'_, Result<CommandReply, CommandFailure>> {
        self.0.vehicle_commands.lock().unwrap().push(command);
        self.0.answer(None)
    }
}

struct NoPreviews;

impl Previews for NoPreviews {
    fn want(&self, _: &RigId) {}
}

pub struct Gateway {
    pub app: App,
    clock: Arc<Mutex<Stamp>>,
    pub played: Arc<Played>,
    pub address: SocketAddr,
    pub client: reqwest::Client,
    pub stop: CancellationToken,
    pub server: tokio::task::JoinHandle<std::io::Result<()>>,
}

impl Drop for Gateway {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}

pub async fn gateway() -> Gateway {
    gateway_with(Config::default(), Played::default()).await
}

pub async fn gateway_with(config: Config, played: Played) -> Gateway {
    let clock = Arc::new(Mutex::new(at(0.0)));
    let (played, stop) = (Arc::new(played), CancellationToken::new());
    let origin = FleetOrigin(Geodetic::from_deg(45.0, 7.0, 0.0));
    let store = Arc::new(Store::new(Fleet::new(origin, config.limits())));
    let parts = Parts {
        config: config.clone(),
        fleet: FleetId::new("test").unwrap(),
        origin,
        now: {
            let clock = Arc::clone(&clock);
            Box::new(move || *clock.lock().unwrap())
        },
        speed: 1.0,
        commands: Box::new(Shared(Arc::clone(&played))),
        previews: Box::new(NoPreviews),
        metrics: || "# no metrics\n".into(),
        stop: stop.clone(),
        loopback: true,
    };
    let app = App::new(parts, store);
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let (router, ends) = (api::router(app.clone()), stop.clone());
    let server = tokio::spawn(async move { server::serve(listener, router, &config, ends).await });
    tokio::spawn(feed::run(app.clone()));
    Gateway { app, clock, played, address, client: reqwest::Client::new(), stop, server }
}

/// A response, read whole.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub headers: reqwest::header::HeaderMap,
    pub json: serde_json::Value,
    pub text: String,
}

impl Answer {
    async fn read(response: reqwest::Response) -> Self {
        let (status, headers) = (response.status().as_u16(), response.headers().clone());
        let text = response.text().await.unwrap();
        Self { status, headers, json: serde_json::from_str(&text).unwrap_or_default(), text }
    }

    /// Checks that this is a well-formed problem of `status` whose detail contains `words`.
    #[track_caller]
    pub fn is_problem(&self, status: u16, words: &str) {
        assert_eq!(self.status, status, "{self:?}");
        assert_eq!(self.headers["content-type"], "application/problem+json", "{self:?}");
        assert_eq!(self.json["status"], status, "{self:?}");
        for key in ["type", "title", "detail", "instance"] {
            assert!(self.json[key].as_str().is_some_and(|text| !text.is_empty()), "{key} of {self:?}");
        }
        assert!(self.json["detail"].as_str().unwrap().contains(words), "{words:?} in {self:?}");
    }
}

impl Gateway {
    pub fn set_clock(&self, offset_s: f64) {
        *self.clock.lock().unwrap() = at(offset_s);
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    pub async fn get(&self, path: &str) -> Answer {
        Answer::read(self.client.get(self.url(path)).send().await.unwrap()).await
    }

    pub async fn post(&self, path: &str, body: &serde_json::Value) -> Answer {
        self.send(self.client.post(self.url(path)).json(body)).await
    }

    pub async fn send(&self, request: reqwest::RequestBuilder) -> Answer {
        Answer::read(request.send().await.unwrap()).await
    }
}

pub fn vehicle(id: &str, age_s: f64) -> VehicleState {
    let position_ned_m = LocalPoint::new(30.0, 40.0).vector().push(-5.0);
    VehicleState {
        stamp: at(-age_s),
        vehicle: VehicleId::new(id).unwrap(),
        role: Role::Leader,
        position: Geodetic::from_deg(45.0, 7.0, 5.0),
        position_ned_m,
        velocity_ned_mps: LocalPoint::new(1.0, 2.0).vector().push(0.5),
        ned_from_body: UnitAttitude::from_deg(3.0, -4.0, 270.0),
        heading_rad: 1.5 * std::f64::consts::PI,
        home: None,
        mode: FlightMode::Guided,
        armed: true,
        landed: LandedState::InAir,
        battery_fraction: Some(0.75),
        battery_v: None,
        fix: Some(Fix { kind: 3, satellites: 12, horizontal_sigma_m: None }),
        estimator_ok: true,
        ready_to_arm: true,
        boot_s: 60.0,
        activity: Activity::Following { settled: true, slot_error_m: 0.25 },
        plan_generation: 7,
        touchdown: None,
        acceleration_ned_mps2: None,
        intent: None,
        range: None,
        ages: halcyon_model::Ages::default(),
        link: None,
        firmware: None,
        has_payload: false,
    }
}

/// Attitude from angles, in degrees.
struct UnitAttitude;

impl UnitAttitude {
    fn from_deg(roll: f64, pitch: f64, yaw: f64) -> nalgebra::UnitQuaternion<f64> {
        nalgebra::UnitQuaternion::from_euler_angles(roll.to_radians(), pitch.to_radians(), yaw.to_radians())
    }
}

pub fn mission(id: &str, phase: MissionPhase, created_offset_s: f64) -> Mission {
    Mission {
        stamp: at(created_offset_s),
        id: MissionId::new(id).unwrap(),
        spec: MissionSpec {
            name: id.into(),
            point: LocalPoint::new(30.0, 40.0),
            survey_height_m: 5.0,
            approval: Approval::Manual,
            dispatch_on_approval: true,
            leader: None,
            follower: None,
        },
        phase,
        leader: None,
        follower: None,
        verdict: None,
        h_s_m: None,
        touchdown: Some(LocalPoint::new(30.3, 40.4)),
        release_problem: None,
        history: vec![Transition { stamp: at(created_offset_s), phase, who: "planner".into(), why: "created".into() }],
    }
}

pub fn sea_state(rig: &str, age_s: f64, valid_for_s: f64) -> SeaState {
    SeaState {
        stamp: at(-age_s),
        rig: RigId::new(rig).unwrap(),
        window_start: at(-age_s - 10.0),
        window_s: 10.0,
        position: LocalPoint::new(30.0, 40.0),
        patches: 50,
        coverage: 0.9,
        waves: 12,
        h_mean_m: None,
        h_s_m: Some(Estimate { value: 0.05, low: 0.04, high: 0.06 }),
        h_max_m: None,
        h_m0_m: None,
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
        trace: (0..5)
            .map(|step| TracePoint { stamp: at(-age_s - 4.0 + f64::from(step)), elevation_m: f64::from(step) })
            .collect(),
        verdict: Verdict {
            state: VerdictState::Safe,
            probability: None,
            reasons: vec![VerdictReason { check: "significant_height".into(), passed: true, text: "low".into() }],
            valid_until: at(-age_s + valid_for_s),
        },
    }
}

pub fn event(what: &str, severity: Severity, mission: Option<&str>) -> Event {
    Event {
        stamp: at(0.0),
        source: InstanceId::new("tester").unwrap(),
        severity,
        what: what.into(),
        why: "because".into(),
        vehicle: None,
        mission: mission.map(|id| MissionId::new(id).unwrap()),
    }
}
