//! The whole gateway on a real, private bus.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

mod support;

use std::time::Duration;

use halcyon_chassis::{Context, topics};
use halcyon_gateway::Config;
use halcyon_model::*;
use serde_json::{Value, json};

const LONG: Duration = Duration::from_secs(30);

struct Running {
    context: Context,
    base: String,
    task: tokio::task::JoinHandle<anyhow::Result<()>>,
}

async fn start() -> Running {
    let context = halcyon_chassis::testing::context("gateway").await;
    let config = Config { listen: ([127, 0, 0, 1], 0).into(), command_timeout_s: 2.0, ..Config::default() };
    let listener = halcyon_gateway::bind(&config).unwrap();
    let base = format!("http://{}", listener.local_addr().unwrap());
    let task = tokio::spawn(halcyon_gateway::run_with(context.clone(), config, listener));
    Running { context, base, task }
}

/// Asks until the answer suits.
async fn eventually(url: String, suits: impl Fn(u16, &Value) -> bool) -> Value {
    tokio::time::timeout(LONG, async {
        loop {
            if let Ok(response) = reqwest::get(&url).await {
                let status = response.status().as_u16();
                let json: Value = response.json().await.unwrap_or_default();
                if suits(status, &json) {
                    return json;
                }
            }
            tokio::task::yield_now().await;
        }
    })
    .await
    .unwrap_or_else(|_| panic!("{url} never suited"))
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_on_the_bus_is_on_the_web() {
    let running = start().await;
    let (context, base) = (&running.context, &running.base);
    let vehicles = context.bus.publisher(&topics::vehicle_state(&VehicleId::new("leader-1").unwrap())).await.unwrap();
    let missions = context.bus.publisher(&topics::mission(&MissionId::new("m-1").unwrap())).await.unwrap();
    missions.put(&support::mission("m-1", MissionPhase::Waiting, 0.0)).await.unwrap();
    let publish = async {
        let mut ticker = context.clock.every(Duration::from_millis(50));
        loop {
            let now = ticker.tick().await;
            vehicles.put(&VehicleState { stamp: now, ..support::vehicle("leader-1", 0.0) }).await.unwrap();
        }
    };
    let look = async {
        let vehicle = eventually(format!("{base}/api/v1/vehicles/leader-1"), |status, _| status == 200).await;
        assert_eq!((&vehicle["mode"], &vehicle["stale"]), (&json!("GUIDED"), &json!(false)));
        eventually(format!("{base}/api/v1/missions"), |_, page| page["items"][0]["id"] == "m-1").await;
    };
    tokio::select! { () = publish => {}, () = look => {} }

    context.stop.cancel();
    tokio::time::timeout(LONG, running.task).await.expect("it stops").unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_command_reaches_the_planner_and_its_answer_comes_back() {
    let running = start().await;
    let client = reqwest::Client::new();
    let create = || {
        client
            .post(format!("{}/api/v1/missions", running.base))
            .json(&json!({"id": "m-1", "point": {"north_m": 1, "east_m": 2}}))
    };
    eventually(format!("{}/api/v1/missions", running.base), |status, _| status == 200).await;

    let nobody = create().send().await.unwrap();
    assert_eq!(nobody.status(), 503, "{}", nobody.text().await.unwrap());

    let mut planner = running.context.bus.serve(&topics::mission_command()).await.unwrap();
    let now = running.context.clock.now();
    let play = async {
        let asked = planner.recv().await.unwrap();
        let command = asked.command.clone();
        asked.reply(&CommandReply { mission: MissionId::new("m-1").ok(), ..CommandReply::accepted(now, "created") }).await;
        let again = planner.recv().await.unwrap();
        again.reply(&CommandReply::refused(now, "not now")).await;
        command
    };
    let ask = async { (create().send().await.unwrap(), create().send().await.unwrap()) };
    let (command, (accepted, refused)) = tokio::time::timeout(LONG, async { tokio::join!(play, ask) }).await.unwrap();
    assert!(
        matches!(&command.action, MissionAction::Create(id, spec) if id.as_str() == "m-1" && spec.point == LocalPoint::new(1.0, 2.0))
    );
    assert_eq!(accepted.status(), 202);
    assert_eq!(accepted.headers()["location"], "/api/v1/missions/m-1");
    assert_eq!(refused.status(), 409);

    // A planner that is there but says nothing.
    let silent = create().send().await.unwrap();
    assert_eq!(silent.status(), 504, "{}", silent.text().await.unwrap());
    running.context.stop.cancel();
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_flow_only_while_someone_looks() {
    let running = start().await;
    let (context, base) = (&running.context, &running.base);
    let rig = RigId::new("leader-1").unwrap();
    let previews = context.bus.publisher(&topics::preview(&rig)).await.unwrap();
    let seas = context.bus.publisher(&topics::sea_state(&rig)).await.unwrap();
    eventually(format!("{base}/api/v1/rigs/leader-1/preview"), |status, _| status == 404).await;
    let publish = async {
        let mut ticker = context.clock.every(Duration::from_millis(50));
        loop {
            let stamp = ticker.tick().await;
            seas.put(&SeaState { stamp, ..support::sea_state("leader-1", 0.0, 5.0) }).await.unwrap();
            let (left_jpeg, disparity_png) = (Bytes::from_static(b"left"), Bytes::from_static(b"disparity"));
            previews.put(&Preview { stamp, rig: rig.clone(), left_jpeg, disparity_png }).await.unwrap();
        }
    };
    let look = async {
        let preview = eventually(format!("{base}/api/v1/rigs/leader-1/preview"), |status, _| status == 200).await;
        let left = reqwest::get(format!("{base}{}", preview["left"].as_str().unwrap())).await.unwrap();
        assert_eq!(left.headers()["content-type"], "image/jpeg");
        assert_eq!(left.bytes().await.unwrap(), "left");
    };
    tokio::select! { () = publish => {}, () = look => {} }
    context.stop.cancel();
}

#[tokio::test]
async fn a_port_that_is_taken_is_named_with_its_key() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let config = Config { listen: taken.local_addr().unwrap(), ..Config::default() };
    let error = format!("{:#}", halcyon_gateway::bind(&config).unwrap_err());
    assert!(error.contains("[gateway] listen") && error.contains(&config.listen.to_string()), "{error}");
}
