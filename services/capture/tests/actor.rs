//! The service as it runs in a fleet: on a bus, under supervision.

use std::time::Duration;

use halcyon_capture::{Config, RenderOptions, SurveyFolder, write_survey_folder};
use halcyon_chassis::{Process, Section as _, Settings, Subscriber, topics};
use halcyon_model::{
    Activity, FlightMode, Geodetic, Health, HealthState, InstanceId, LandedState, RigId, Role, SimTruth, Stamp, StereoPair,
    VehicleId, VehicleState,
};
use halcyon_sim::SimConfig;
use nalgebra::{UnitQuaternion, Vector3};

/// Nothing here takes longer, however busy the machine.
const PATIENCE: Duration = Duration::from_secs(60);
/// How wrong the autopilot of these tests is.
const ESTIMATE_OFF_M: Vector3<f64> = Vector3::new(0.7, -0.4, 0.3);

struct Rig {
    process: Process,
    pairs: Subscriber<StereoPair>,
    healths: Subscriber<Health>,
}

#[allow(clippy::unwrap_used, reason = "a helper of tests")]
async fn start(overrides: &[String]) -> Rig {
    let settings = Settings::load(None, overrides).unwrap();
    let config = Config::resolve(&settings).unwrap();
    let mut process = Process::start(&settings).await.unwrap();
    let pairs = process.bus().subscribe(&topics::pair(&RigId::new(config.rig.as_str()).unwrap())).await.unwrap();
    let healths = process.bus().subscribe(&topics::health(&InstanceId::new("capture.test").unwrap())).await.unwrap();
    process.spawn("test", config, halcyon_capture::run).await.unwrap();
    Rig { process, pairs, healths }
}

impl Rig {
    /// Waits for a health report whose detail holds `part`.
    #[allow(clippy::unwrap_used, clippy::panic, reason = "a helper of tests")]
    async fn health(&mut self, part: &str) -> Health {
        let wanted = async {
            loop {
                let health = self.healths.recv().await.unwrap();
                if health.detail.contains(part) {
                    return health;
                }
            }
        };
        tokio::time::timeout(PATIENCE, wanted).await.unwrap_or_else(|_| panic!("no health that says {part:?}"))
    }

    #[allow(clippy::unwrap_used, reason = "a helper of tests")]
    async fn pair(&mut self) -> StereoPair {
        tokio::time::timeout(PATIENCE, self.pairs.recv()).await.unwrap().unwrap()
    }
}

/// A vehicle that drifts north at 0.5 m/s, 5 m up, turning slowly.
fn truth(stamp: Stamp, since: Stamp, landed: bool) -> SimTruth {
    let t_s = stamp.seconds_since(since);
    SimTruth {
        stamp,
        vehicle: VehicleId::new("leader-1").unwrap_or_else(|_| unreachable!("a valid name")),
        position_ned_m: Vector3::new(0.5 * t_s, 2.0, if landed { 0.0 } else { -5.0 }),
        velocity_ned_mps: Vector3::new(0.5, 0.0, 0.0),
        ned_from_body: UnitQuaternion::from_euler_angles(0.02, -0.01, 0.1 * t_s),
        rate_body_radps: Vector3::new(0.0, 0.0, 0.1),
        landed,
    }
}

/// What that vehicle's autopilot believes.
fn state(truth: &SimTruth) -> VehicleState {
    VehicleState {
        stamp: truth.stamp,
        vehicle: truth.vehicle.clone(),
        role: Role::Leader,
        position: Geodetic::from_deg(53.0, -2.9, 5.0),
        position_ned_m: truth.position_ned_m + ESTIMATE_OFF_M,
        velocity_ned_mps: truth.velocity_ned_mps,
        ned_from_body: truth.ned_from_body,
        heading_rad: 0.0,
        home: None,
        mode: FlightMode::Guided,
        armed: true,
        landed: LandedState::InAir,
        battery_fraction: None,
        battery_v: None,
        fix: None,
        estimator_ok: true,
        ready_to_arm: true,
        boot_s: 50.0,
        activity: Activity::Idle,
        plan_generation: 0,
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

/// Publishes truth and, if asked, state at 50 Hz until the returned task is aborted.
#[allow(clippy::unwrap_used, reason = "a helper of tests")]
fn fly(process: &Process, since: Stamp, landed: bool, with_state: bool) -> tokio::task::JoinHandle<()> {
    let (bus, clock) = (process.bus().clone(), process.clock().clone());
    tokio::spawn(async move {
        let vehicle = VehicleId::new("leader-1").unwrap();
        let truths = bus.publisher(&topics::sim_truth(&vehicle)).await.unwrap();
        let states = bus.publisher(&topics::vehicle_state(&vehicle)).await.unwrap();
        let mut ticker = clock.every(Duration::from_millis(20));
        loop {
            let truth = truth(ticker.tick().await, since, landed);
            truths.put(&truth).await.unwrap();
            if with_state {
                states.put(&state(&truth)).await.unwrap();
            }
        }
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn simulated_pairs_carry_the_autopilots_pose_and_never_the_truth() {
    let mut rig = start(&["sim.seed=7".into()]).await;
    let health = rig.health("nothing heard of leader-1 from the simulator").await;
    assert_eq!(health.state, HealthState::Degraded);

    let since = rig.process.clock().now();
    let on_the_jetty = fly(&rig.process, since, true, true);
    assert_eq!(rig.health("leader-1 is not flying above 1.5 m").await.state, HealthState::Ready);
    on_the_jetty.abort();
    let _ = on_the_jetty.await;

    let flight = fly(&rig.process, since, false, true);
    assert_eq!(rig.health("publishing pairs of 320 x 240 px").await.state, HealthState::Ready);
    // The pose history begins with the flight: the first pair may lie between ground and air.
    let skipped = rig.pair().await;
    let mut last = rig.pair().await;
    assert!(last.sequence > skipped.sequence);
    for _ in 0..3 {
        let pair = rig.pair().await;
        let period_s = pair.stamp.seconds_since(last.stamp);
        assert!(pair.sequence > last.sequence && period_s > 0.0, "{period_s}");
        let expected = truth(pair.stamp, since, false);
        let pose = pair.pose.expect("a pose");
        let off_m = pose.position_ned_m - expected.position_ned_m;
        assert!((off_m - ESTIMATE_OFF_M).norm() < 0.02, "the estimate's error must be in the pose: {off_m}");
        assert!(pose.ned_from_body.angle_to(&expected.ned_from_body) < 0.01);
        assert_eq!(pair.calibration, SimConfig::default().rig.calibration());
        assert_ne!(pair.left, pair.right);
        last = pair;
    }
    flight.abort();
    let _ = flight.await;
    assert_eq!(rig.health("nothing heard of leader-1 from the simulator for").await.state, HealthState::Degraded);
    rig.process.stop().cancel();
    rig.process.wait().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_state_pairs_go_without_a_pose_and_health_says_so() {
    let mut rig = start(&["capture.rate_hz=10".into()]).await;
    let flight = fly(&rig.process, rig.process.clock().now(), false, false);
    assert_eq!(rig.pair().await.pose, None);
    assert_eq!(rig.health("pairs have no pose").await.state, HealthState::Degraded);
    flight.abort();
    rig.process.stop().cancel();
    rig.process.wait().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_is_played_at_its_own_pace_and_then_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("survey");
    let mut sim = SimConfig::default();
    (sim.rig.width_px, sim.rig.height_px) = (64, 48);
    let options = RenderOptions { frames: 8, rate_hz: 2.0, ..RenderOptions::default() };
    write_survey_folder(&path, &sim, &options, |_, _| {}).expect("a survey folder");
    let survey = SurveyFolder::open(&path).expect("it opens");

    let mut rig = start(&["capture.source=folder".into(), format!("capture.folder={:?}", path.display().to_string())]).await;
    let mut first: Option<(StereoPair, usize)> = None;
    let mut seen = 0;
    loop {
        let pair = rig.pair().await;
        // Frames may be skipped on a busy machine; which one this is shows in the picture.
        let index = survey
            .frames()
            .iter()
            .position(|frame| survey.read(frame).is_ok_and(|read| read == (pair.left.clone(), pair.right.clone())));
        let index = index.expect("a picture of the folder");
        let pose = pair.pose.expect("the table has attitudes");
        assert_eq!(pose.position_ned_m, Vector3::new(0.0, 0.0, -5.0));
        if let Some((first, first_index)) = &first {
            let apart_s = pair.stamp.seconds_since(first.stamp);
            assert!((apart_s - 0.5 * (index - first_index) as f64).abs() < 1e-6, "{apart_s}");
        } else {
            first = Some((pair, index));
        }
        seen += 1;
        if index == 7 {
            break;
        }
    }
    assert!(seen >= 2, "{seen}");
    assert_eq!(rig.health("all 8 frames of the folder have been played").await.state, HealthState::Ready);
    rig.process.stop().cancel();
    rig.process.wait().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_that_is_not_there_is_said_and_tried_again() {
    let mut rig = start(&["capture.source=folder".into(), "capture.folder=/nowhere/at/all".into()]).await;
    let health = rig.health("/nowhere/at/all/rig.yaml: No such file or directory").await;
    assert_eq!(health.state, HealthState::Restarting);
    rig.process.stop().cancel();
    rig.process.wait().await;
}
