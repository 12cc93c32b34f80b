//! The actor on a bus: commands in, plans and missions out, nothing announced that is not stored.

mod common;

use std::time::Duration;

use common::{FakeVehicle, mission_id, sea, spec};
use halcyon_chassis::{Context, testing, topics};
use halcyon_mission_planner::store::Store;
use halcyon_mission_planner::{Config, run};
use halcyon_model::{CommandReply, LocalPoint, MissionAction, MissionCommand, MissionPhase, Role, VehicleAction, VerdictState};

const PATIENCE: Duration = Duration::from_secs(60);

fn command(context: &Context, action: MissionAction) -> MissionCommand {
    let now = context.clock.now();
    MissionCommand { stamp: now, deadline: now.plus_secs_f64(600.0), who: "anna".into(), action }
}

/// A follower's payload: its first release is refused, all others are done. Counts them.
async fn carry(context: Context) -> anyhow::Result<usize> {
    let mut commands = context.bus.serve(&topics::vehicle_command(&common::id("follower-1"))).await?;
    let mut asked = 0;
    loop {
        let incoming = tokio::select! {
            () = context.stop.cancelled() => return Ok(asked),
            incoming = commands.recv() => incoming?,
        };
        assert_eq!(incoming.command.action, VehicleAction::ReleasePayload);
        assert_eq!(incoming.command.who, "mission m");
        asked += 1;
        let now = context.clock.now();
        let reply = if asked == 1 { CommandReply::refused(now, "stuck") } else { CommandReply::accepted(now, "done") };
        incoming.reply(&reply).await;
    }
}

/// A world of one leader and one follower on the bus, in fleet time, until told to stop.
async fn fly(context: Context, has_payload: bool) -> anyhow::Result<()> {
    let mut vehicles = vec![
        FakeVehicle::new("leader-1", Role::Leader, LocalPoint::new(0.0, 0.0)),
        FakeVehicle::new("follower-1", Role::Follower, LocalPoint::new(0.0, -8.0)),
    ];
    vehicles[1].has_payload = has_payload;
    let mut plans = context.bus.subscribe(&topics::plan()).await?;
    let mut states = Vec::new();
    for vehicle in &vehicles {
        states.push(context.bus.publisher(&topics::vehicle_state(&vehicle.id)).await?);
    }
    let rig = halcyon_model::RigId::new("leader-1")?;
    let seas = context.bus.publisher(&topics::sea_state(&rig)).await?;
    let mut plan = None;
    let mut last = context.clock.now();
    let mut last_sea = last;
    let mut ticker = context.clock.every(Duration::from_millis(200));
    loop {
        tokio::select! {
            () = context.stop.cancelled() => return Ok(()),
            newest = plans.recv() => plan = Some(newest?),
            _ = ticker.tick() => {
                let now = context.clock.now();
                let others = vehicles.clone();
                for (vehicle, state) in vehicles.iter_mut().zip(&states) {
                    vehicle.fly(now, now.seconds_since(last), plan.as_ref(), &others);
                    state.put(&vehicle.state(now)).await?;
                }
                last = now;
                if now.seconds_since(last_sea) >= 1.0 && vehicles[0].airborne() {
                    last_sea = now;
                    let since = vehicles[0].at_height_since.unwrap_or(now);
                    seas.put(&sea(&vehicles[0].id, vehicles[0].place(), now, since, VerdictState::Safe)).await?;
                }
            }
        }
    }
}

/// Limits on ages are loose, since a loaded machine makes fast fleet time jump.
fn loose(store: &std::path::Path) -> Config {
    Config {
        store: store.to_string_lossy().into_owned(),
        vehicle_age_max_s: 20.0,
        vehicle_lost_s: 60.0,
        sea_age_max_s: 20.0,
        clearance_s: 20.0,
        plan_validity_s: 30.0,
        fault_grace_s: 60.0,
        release_answer_s: 60.0,
        ..Config::default()
    }
}

/// The vehicle itself says no, and then, asked again by a person, yes.
#[tokio::test(flavor = "multi_thread")]
async fn a_payload_is_let_go_over_the_bus() {
    let context = testing::context_at_speed("mission-planner.test", 10.0).await;
    let mut missions = context.bus.subscribe(&topics::missions()).await.unwrap();
    let payload = tokio::spawn(carry(context.clone()));
    let planner = tokio::spawn(run(context.clone(), loose(std::path::Path::new(":memory:"))));
    let world = tokio::spawn(fly(context.clone(), true));
    let topic = topics::mission_command();
    let create = command(&context, MissionAction::Create(mission_id("m"), spec(30.0, 0.0)));
    let done = tokio::time::timeout(PATIENCE, async {
        while context.bus.call(&topic, &create, Duration::from_secs(5)).await.is_err() {
            tokio::task::yield_now().await;
        }
        let mut problem = None;
        loop {
            let mission = missions.recv().await.unwrap();
            if mission.phase.is_final() {
                return (mission, problem);
            }
            if problem.is_none() && mission.release_problem.is_some() {
                problem = mission.release_problem;
                let again = command(&context, MissionAction::Release(mission_id("m")));
                let reply = context.bus.call(&topic, &again, PATIENCE).await.unwrap();
                assert!(reply.accepted, "{}", reply.reason);
            }
        }
    });
    let (mission, problem) = done.await.unwrap();
    assert_eq!((mission.phase, problem.as_deref()), (MissionPhase::Completed, Some("stuck")), "{:#?}", mission.history);
    context.stop.cancel();
    planner.await.unwrap().unwrap();
    world.await.unwrap().unwrap();
    assert_eq!(payload.await.unwrap().unwrap(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_whole_mission_over_the_bus() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let config = loose(&path);
    let context = testing::context_at_speed("mission-planner.test", 10.0).await;
    let mut missions = context.bus.subscribe(&topics::missions()).await.unwrap();
    let planner = tokio::spawn(run(context.clone(), config));
    let world = tokio::spawn(fly(context.clone(), false));
    let topic = topics::mission_command();
    let create = command(&context, MissionAction::Create(mission_id("m"), spec(30.0, 0.0)));
    let reply = tokio::time::timeout(PATIENCE, async {
        loop {
            match context.bus.call(&topic, &create, Duration::from_secs(5)).await {
                Ok(reply) => return reply,
                // The planner has not declared itself yet.
                Err(_) => tokio::task::yield_now().await,
            }
        }
    });
    let reply = reply.await.unwrap();
    assert!(reply.accepted, "{}", reply.reason);
    assert_eq!(reply.mission, Some(mission_id("m")));

    let refused = command(&context, MissionAction::Resume(mission_id("m")));
    let reply = context.bus.call(&topic, &refused, PATIENCE).await.unwrap();
    assert!(!reply.accepted && reply.reason.contains("not paused"));

    let done = tokio::time::timeout(PATIENCE, async {
        loop {
            let mission = missions.recv().await.unwrap();
            if mission.phase.is_final() {
                return mission;
            }
        }
    });
    let done = done.await.unwrap();
    assert_eq!(done.phase, MissionPhase::Completed, "{:#?}", done.history);

    context.stop.cancel();
    planner.await.unwrap().unwrap();
    world.await.unwrap().unwrap();
    let saved = Store::open(&path).unwrap().load().unwrap();
    assert_eq!(saved.missions[0].mission.history, done.history);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_store_that_cannot_be_opened_is_a_clear_error_at_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missions.sqlite");
    let _other = Store::open(&path).unwrap();
    let context = testing::context("mission-planner.test").await;
    let config = Config { store: path.to_string_lossy().into_owned(), ..Config::default() };
    let error = tokio::time::timeout(PATIENCE, run(context, config)).await.unwrap().unwrap_err();
    assert!(error.to_string().contains("in use by another mission planner"), "{error}");
}
