//! What POSTs do.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

mod support;

use std::sync::Arc;
use std::time::Duration;

use halcyon_gateway::Config;
use halcyon_gateway::port::CommandFailure;
use halcyon_model::{
    Approval, CommandReply, Content, FlightMode, FormationSpec, Item, ItemFrame, ItemKind, MissionAction, MissionPhase,
    Parameter, ParameterKind, ParameterName, Shape, VehicleAction, VehicleId,
};
use serde_json::json;
use support::*;

fn created(gateway: &Gateway) -> Vec<(String, halcyon_model::MissionSpec)> {
    let commands = gateway.played.mission_commands.lock().unwrap();
    let created = commands.iter().filter_map(|command| match &command.action {
        MissionAction::Create(id, spec) => Some((id.to_string(), spec.clone())),
        _ => None,
    });
    created.collect()
}

#[tokio::test]
async fn a_mission_is_created_with_defaults_and_can_be_watched() {
    let gateway = gateway().await;
    let answer = gateway.post("/api/v1/missions", &json!({"point": {"north_m": 30.0, "east_m": -20.0}})).await;
    assert_eq!(answer.status, 202, "{answer:?}");
    let (id, spec) = created(&gateway).remove(0);
    assert_eq!(answer.headers["location"].to_str().unwrap(), format!("/api/v1/missions/{id}"));
    assert_eq!(answer.json["mission"], id.as_str());
    assert_eq!((spec.point.north_m, spec.point.east_m, spec.survey_height_m), (30.0, -20.0, 5.0));
    assert_eq!((spec.approval, spec.dispatch_on_approval, spec.leader), (Approval::Manual, true, None));
    let command = gateway.played.mission_commands.lock().unwrap()[0].clone();
    assert_eq!(command.deadline.seconds_since(command.stamp), 5.0);
    assert_eq!(command.who, "rest");
}

#[tokio::test]
async fn a_point_by_latitude_and_longitude_lands_in_the_local_frame() {
    let gateway = gateway().await;
    // Metres per degree at 45° (Snyder, Map Projections, USGS PP 1395): 111 131.779 north, 78 846.835 east.
    let point = json!({"latitude_deg": 45.001, "longitude_deg": 7.001});
    gateway.post("/api/v1/missions", &json!({"point": point})).await;
    let (_, spec) = created(&gateway).remove(0);
    assert!((spec.point.north_m - 111.13).abs() < 0.02, "{}", spec.point.north_m);
    assert!((spec.point.east_m - 78.85).abs() < 0.02, "{}", spec.point.east_m);
}

#[tokio::test]
async fn bad_missions_never_reach_the_planner() {
    let gateway = gateway().await;
    let good = || json!({"point": {"north_m": 0, "east_m": 0}});
    let check = async |key: &str, value: serde_json::Value, status, words: &str| {
        let mut body = good();
        body[key] = value;
        gateway.post("/api/v1/missions", &body).await.is_problem(status, words);
    };
    check("point", json!({"north_m": 1}), 422, "latitude_deg and longitude_deg").await;
    check("point", json!({"north_m": 1, "east_m": 1, "latitude_deg": 1}), 422, "north_m and east_m").await;
    check("point", json!({"latitude_deg": 91, "longitude_deg": 0}), 422, "globe").await;
    check("point", json!({"latitude_deg": 0, "longitude_deg": 0}), 422, "origin").await;
    check("point", json!({"north_m": 1e9, "east_m": 0}), 422, "origin").await;
    check("survey_height_m", json!(-1), 422, "survey_height_m").await;
    check("id", json!("a/b"), 422, "identifier").await;
    check("leader", json!(""), 422, "identifier").await;
    check("name", json!("x".repeat(201)), 422, "name").await;
    check("approval", json!("sometimes"), 422, "sometimes").await;
    check("surprise", json!(1), 422, "surprise").await;

    let url = gateway.url("/api/v1/missions");
    let raw = |kind: &'static str, body: Vec<u8>| gateway.client.post(&url).header("content-type", kind).body(body);
    gateway.send(raw("application/json", b"{".to_vec())).await.is_problem(400, "");
    gateway.send(raw("application/json", Vec::new())).await.is_problem(400, "");
    gateway.send(raw("application/json", b"{\"point\":{\"north_m\":1e999,\"east_m\":0}}".to_vec())).await.is_problem(400, "");
    gateway.send(raw("text/plain", b"{}".to_vec())).await.is_problem(415, "");
    gateway.send(raw("application/json", vec![b' '; 70_000])).await.is_problem(413, "");
    assert!(created(&gateway).is_empty());
}

#[tokio::test]
async fn a_refusal_and_silence_have_their_own_answers() {
    let gateway = gateway().await;
    gateway.app.store.write().mission(mission("m-1", MissionPhase::Waiting, 0.0), at(0.0));
    *gateway.played.answers.lock().unwrap() = vec![
        Ok(CommandReply::refused(at(0.0), "there is no safe verdict yet")),
        Err(CommandFailure::Nobody),
        Err(CommandFailure::Timeout(Duration::from_secs(5))),
        Err(CommandFailure::Bus("broken".into())),
    ];
    let approve = || gateway.client.post(gateway.url("/api/v1/missions/m-1/approve"));
    gateway.send(approve()).await.is_problem(409, "no safe verdict");
    let nobody = gateway.send(approve()).await;
    nobody.is_problem(503, "planner");
    assert_eq!(nobody.headers["retry-after"], "1");
    gateway.send(approve()).await.is_problem(504, "not known");
    gateway.send(approve()).await.is_problem(503, "broken");
    gateway.send(gateway.client.post(gateway.url("/api/v1/missions/none/abort"))).await.is_problem(404, "none");
}

#[tokio::test]
async fn every_action_goes_to_its_mission_under_its_operator() {
    let gateway = gateway().await;
    gateway.app.store.write().mission(mission("m-1", MissionPhase::Waiting, 0.0), at(0.0));
    for action in ["approve", "dispatch", "pause", "resume", "abort", "release", "skip-release"] {
        let request =
            gateway.client.post(gateway.url(&format!("/api/v1/missions/m-1/{action}"))).header("halcyon-operator", "Ada");
        assert_eq!(gateway.send(request).await.status, 202, "{action}");
    }
    let commands = gateway.played.mission_commands.lock().unwrap();
    let names: Vec<_> =
        commands.iter().map(|command| format!("{:?}", command.action).split('(').next().unwrap().to_owned()).collect();
    assert_eq!(names, ["Approve", "Dispatch", "Pause", "Resume", "Abort", "Release", "SkipRelease"]);
    assert!(commands.iter().all(|command| command.who == "Ada"));
}

#[tokio::test]
async fn vehicle_commands_arrive_in_radians() {
    let gateway = gateway().await;
    gateway.app.store.write().vehicle(vehicle("f-1", 0.1), at(0.0));
    let path = "/api/v1/vehicles/f-1/commands";
    for body in [
        json!({"action": "arm"}),
        json!({"action": "take_off", "parameters": {"height_m": 5}}),
        json!({"action": "go_to", "parameters": {"point": {"north_m": 1, "east_m": 2}, "height_m": 3}}),
        json!({"action": "set_mode", "parameters": {"mode": "loiter"}}),
        json!({"action": "set_heading", "parameters": {"heading_deg": -90}}),
        json!({"action": "follow", "parameters": {"leader": "l-1", "slot": {"forward_m": 0, "right_m": 7, "up_m": 0}}}),
    ] {
        let answer = gateway.post(path, &body).await;
        assert_eq!(answer.status, 202, "{body}: {answer:?}");
        assert_eq!(answer.headers["location"], "/api/v1/vehicles/f-1");
    }
    let actions: Vec<_> =
        gateway.played.vehicle_commands.lock().unwrap().iter().map(|command| command.action.clone()).collect();
    assert_eq!(actions[0], VehicleAction::Arm);
    assert_eq!(actions[1], VehicleAction::TakeOff { height_m: 5.0 });
    assert_eq!(actions[3], VehicleAction::SetMode(FlightMode::Loiter));
    let VehicleAction::SetHeading { heading_rad } = actions[4] else { panic!("{actions:?}") };
    assert!((heading_rad - 1.5 * std::f64::consts::PI).abs() < 1e-12);

    gateway.post(path, &json!({"action": "dance"})).await.is_problem(422, "dance");
    gateway.post(path, &json!({"action": "take_off"})).await.is_problem(422, "parameters");
    gateway.post(path, &json!({"action": "take_off", "parameters": {"height_m": 0}})).await.is_problem(422, "height_m");
    gateway.post(path, &json!({"action": "set_mode", "parameters": {"mode": "WARP"}})).await.is_problem(422, "WARP");
    gateway
        .post(path, &json!({"action": "set_heading", "parameters": {"heading_deg": 361}}))
        .await
        .is_problem(422, "heading_deg");
    gateway.post("/api/v1/vehicles/none/commands", &json!({"action": "arm"})).await.is_problem(404, "none");
    assert_eq!(gateway.played.vehicle_commands.lock().unwrap().len(), 6, "what is refused here was not sent");
}

#[tokio::test]
async fn a_repeat_under_the_same_key_is_answered_but_not_carried_out() {
    let gateway = gateway().await;
    let create = |key: &str, north_m: f64| {
        let body = json!({"point": {"north_m": north_m, "east_m": 0}});
        gateway.client.post(gateway.url("/api/v1/missions")).header("idempotency-key", key).json(&body)
    };
    let first = gateway.send(create("k1", 1.0)).await;
    let second = gateway.send(create("k1", 1.0)).await;
    assert_eq!((first.status, &first.json), (second.status, &second.json));
    assert_eq!(second.headers["idempotent-replayed"], "true");
    assert_eq!(second.headers["location"], first.headers["location"]);
    assert_eq!(created(&gateway).len(), 1);

    gateway.send(create("k1", 2.0)).await.is_problem(422, "Idempotency-Key");
    gateway.send(create("k 2", 2.0)).await.is_problem(400, "Idempotency-Key");
    gateway.send(create("k1", 1.0).header("halcyon-operator", "Ada")).await.is_problem(422, "Idempotency-Key");
    gateway.send(create("k9", 1.0).header("halcyon-operator", "A\tda")).await.is_problem(400, "Operator");
    let other = gateway.send(create("k2", 1.0)).await;
    assert_ne!(other.json["mission"], first.json["mission"]);

    // A refusal is an answer, too.
    *gateway.played.answers.lock().unwrap() = vec![Ok(CommandReply::refused(at(0.0), "not now"))];
    gateway.send(create("k3", 1.0)).await.is_problem(409, "not now");
    gateway.send(create("k3", 1.0)).await.is_problem(409, "not now");
    assert_eq!(created(&gateway).len(), 3);
}

#[tokio::test]
async fn a_repeat_after_a_lost_answer_names_the_same_mission() {
    let gateway = gateway().await;
    *gateway.played.answers.lock().unwrap() = vec![Err(CommandFailure::Timeout(Duration::from_secs(5)))];
    let create = || {
        let body = json!({"point": {"north_m": 1, "east_m": 0}});
        gateway.client.post(gateway.url("/api/v1/missions")).header("idempotency-key", "k").json(&body)
    };
    gateway.send(create()).await.is_problem(504, "planner");
    assert_eq!(gateway.send(create()).await.status, 202);
    let created = created(&gateway);
    assert_eq!(created.len(), 2);
    assert_eq!(created[0], created[1], "the planner sees the same mission twice, and so makes one");
}

#[tokio::test]
async fn a_repeat_while_the_first_still_runs_is_told_so() {
    let held = Arc::new(tokio::sync::Semaphore::new(0));
    let gateway = gateway_with(Config::default(), Played { held: Some(Arc::clone(&held)), ..Played::default() }).await;
    let create = || {
        let body = json!({"point": {"north_m": 1, "east_m": 0}});
        gateway.client.post(gateway.url("/api/v1/missions")).header("idempotency-key", "k").json(&body)
    };
    // The first client hangs up while the planner thinks.
    let first = tokio::spawn(create().send());
    tokio::time::timeout(Duration::from_secs(10), async {
        while created(&gateway).is_empty() {
            tokio::task::yield_now().await;
        }
    })
    .await
    .unwrap();
    first.abort();
    gateway.send(create()).await.is_problem(409, "still being carried out");
    held.add_permits(1);
    let answer = tokio::time::timeout(Duration::from_secs(10), async {
        loop {
            let answer = gateway.send(create()).await;
            if answer.status != 409 {
                return answer;
            }
        }
    })
    .await
    .unwrap();
    assert_eq!(answer.status, 202, "the answer that the first client missed");
    assert_eq!(created(&gateway).len(), 1);
}

#[tokio::test]
async fn other_names_and_other_pages_are_turned_away() {
    let gateway = gateway().await;
    let get = |host: &str| gateway.client.get(gateway.url("/api/v1/vehicles")).header("host", host);
    gateway.send(get("evil.example")).await.is_problem(403, "evil.example");
    assert_eq!(gateway.send(get("localhost:1")).await.status, 200);

    let body = json!({"point": {"north_m": 1, "east_m": 0}});
    let post = |origin: &str| gateway.client.post(gateway.url("/api/v1/missions")).header("origin", origin).json(&body);
    gateway.send(post("http://evil.example")).await.is_problem(403, "origin");
    gateway.send(post("null")).await.is_problem(403, "origin");
    assert_eq!(gateway.send(post(&format!("http://{}", gateway.address))).await.status, 202);
    assert_eq!(created(&gateway).len(), 1);
}

#[tokio::test]
async fn formations_are_ordered_and_disbanded_in_the_planners_words() {
    let gateway = gateway().await;
    let body = json!({"leader": "leader-1", "shape": "vee", "spacing_m": 8.5, "followers": ["b", "a"]});
    let answer = gateway.post("/api/v1/formations", &body).await;
    assert_eq!((answer.status, answer.headers["location"].to_str().unwrap()), (202, "/api/v1/formations"), "{answer:?}");
    let id = |text: &str| VehicleId::new(text).unwrap();
    let asked = FormationSpec { leader: id("leader-1"), shape: Shape::Vee, spacing_m: 8.5, followers: vec![id("b"), id("a")] };
    assert_eq!(gateway.played.mission_commands.lock().unwrap()[0].action, MissionAction::Form(asked));
    let bad = async |key: &str, value: serde_json::Value, words: &str| {
        let mut body = body.clone();
        body[key] = value;
        gateway.post("/api/v1/formations", &body).await.is_problem(422, words);
    };
    bad("leader", json!("a/b"), "a/b").await;
    bad("shape", json!("ring"), "ring").await;
    bad("spacing_m", json!(0), "spacing_m must be above 0").await;
    bad("spacing_m", json!(1e9), "spacing_m must be above 0").await;
    bad("followers", json!(["a", ""]), "1 to 64 characters").await;
    gateway.post("/api/v1/formations/nobody/disband", &json!(null)).await.is_problem(404, "no vehicle nobody");
    assert_eq!(gateway.played.mission_commands.lock().unwrap().len(), 1);
}

fn with_content(content: Content) -> Result<CommandReply, CommandFailure> {
    Ok(CommandReply { content: Some(content), ..CommandReply::accepted(at(0.0), "read") })
}

#[tokio::test]
async fn parameters_are_read_and_set() {
    let gateway = gateway().await;
    gateway.app.store.write().vehicle(vehicle("f-1", 0.1), at(0.0));
    let path = "/api/v1/vehicles/f-1/parameters";
    let rtl = || Parameter { name: ParameterName::new("RTL_ALT").unwrap(), value: 1500.0, kind: ParameterKind::Int32 };
    let refused = || Ok(CommandReply::refused(at(0.0), "the autopilot knows no parameter X"));
    *gateway.played.answers.lock().unwrap() = vec![
        with_content(Content::Parameters(vec![rtl(), rtl()])),
        with_content(Content::Parameters(vec![rtl()])),
        with_content(Content::Parameters(vec![rtl()])),
        refused(),
        Err(CommandFailure::Timeout(Duration::from_secs(50))),
    ];
    let all = gateway.get(path).await;
    assert_eq!(all.status, 200, "{all:?}");
    assert_eq!(all.json["parameters"][1], json!({"name": "RTL_ALT", "value": 1500.0, "type": "int32"}));
    gateway.get(&format!("{path}?name=RTL_ALT")).await;
    let put = |name: &str, body: serde_json::Value| gateway.client.put(gateway.url(&format!("{path}/{name}"))).json(&body);
    let set = gateway.send(put("RTL_ALT", json!({"value": 1500})).header("halcyon-operator", "Ada")).await;
    assert_eq!((set.status, &set.json["value"]), (200, &json!(1500.0)));
    gateway.send(put("X", json!({"value": 1, "even_in_flight": true}))).await.is_problem(409, "knows no parameter");
    gateway.get(path).await.is_problem(504, "not known");
    gateway.send(put("A%20B", json!({"value": 1}))).await.is_problem(422, "parameter name");
    gateway.send(put("X", json!({"value": "much"}))).await.is_problem(422, "value");
    gateway.get(&format!("{path}?name=é")).await.is_problem(422, "parameter name");
    gateway.get("/api/v1/vehicles/none/parameters").await.is_problem(404, "none");
    let commands = gateway.played.vehicle_commands.lock().unwrap();
    let name = |text: &str| ParameterName::new(text).unwrap();
    let actions: Vec<_> = commands.iter().map(|command| command.action.clone()).collect();
    let expected = [
        VehicleAction::ReadParameters,
        VehicleAction::ReadParameter { name: name("RTL_ALT") },
        VehicleAction::SetParameter { name: name("RTL_ALT"), value: 1500.0, even_in_flight: false },
        VehicleAction::SetParameter { name: name("X"), value: 1.0, even_in_flight: true },
        VehicleAction::ReadParameters,
    ];
    assert_eq!(actions, expected);
    assert_eq!(commands[2].who, "Ada");
    assert!(commands[0].deadline.seconds_since(commands[0].stamp) > 30.0);
}

#[tokio::test]
async fn missions_fences_and_rally_points_go_both_ways() {
    let gateway = gateway().await;
    gateway.app.store.write().vehicle(vehicle("f-1", 0.1), at(0.0));
    let path = |list: &str| format!("/api/v1/vehicles/f-1/{list}");
    let items = vec![Item {
        command: 16,
        frame: ItemFrame::Home,
        parameters: [None, Some(2.0), None, None],
        latitude_deg: Some(45.1),
        longitude_deg: Some(7.0),
        altitude_m: Some(5.0),
        autocontinue: true,
    }];
    *gateway.played.answers.lock().unwrap() = vec![with_content(Content::Items(items.clone()))];
    let read = gateway.get(&path("mission")).await;
    assert_eq!(read.status, 200, "{read:?}");
    assert_eq!((&read.json["kind"], &read.json["items"][0]["command"]), (&json!("mission"), &json!("NAV_WAYPOINT")));
    assert_eq!(read.json["items"][0]["parameters"], json!([null, 2.0, null, null]));
    let put = |list: &str, body: &serde_json::Value| gateway.client.put(gateway.url(&path(list))).json(body);
    let body = json!({"items": read.json["items"]});
    assert_eq!(gateway.send(put("mission", &body)).await.status, 200);
    assert_eq!(gateway.send(gateway.client.delete(gateway.url(&path("rally")))).await.status, 200);
    let actions: Vec<_> =
        gateway.played.vehicle_commands.lock().unwrap().iter().map(|command| command.action.clone()).collect();
    let expected = [
        VehicleAction::DownloadItems { kind: ItemKind::Mission },
        VehicleAction::UploadItems { kind: ItemKind::Mission, items },
        VehicleAction::ClearItems { kind: ItemKind::Rally },
    ];
    assert_eq!(actions, expected);

    gateway.send(put("fence", &body)).await.is_problem(422, "item 1: command 16");
    let one = |item: serde_json::Value| json!({"items": [item]});
    let far = one(json!({"command": "mav_cmd_nav_waypoint", "frame": "home", "latitude_deg": 91}));
    gateway.send(put("mission", &far)).await.is_problem(422, "latitude_deg");
    gateway.send(put("mission", &one(json!({"command": "DANCE", "frame": "home"})))).await.is_problem(422, "DANCE");
    gateway.send(put("mission", &one(json!({"command": 16, "frame": "moon"})))).await.is_problem(422, "moon");
    let waypoint = json!({"command": 16, "frame": "home", "latitude_deg": 45.123_456_7, "longitude_deg": 7.123_456_7});
    gateway.send(put("mission", &json!({"items": vec![waypoint.clone(); 701]}))).await.is_problem(422, "at most 700");
    assert_eq!(gateway.send(put("mission", &json!({"items": vec![waypoint; 700]}))).await.status, 200);
    gateway.get(&path("nothing")).await.is_problem(404, "no such resource");
    assert_eq!(gateway.played.vehicle_commands.lock().unwrap().len(), 4, "what is refused here was not sent");
}

#[tokio::test]
async fn the_payload_is_a_command() {
    let gateway = gateway().await;
    gateway.app.store.write().vehicle(vehicle("f-1", 0.1), at(0.0));
    for action in ["release_payload", "secure_payload", "cancel_transfer"] {
        let answer = gateway.post("/api/v1/vehicles/f-1/commands", &json!({"action": action})).await;
        assert_eq!(answer.status, 202, "{answer:?}");
    }
    let actions: Vec<_> =
        gateway.played.vehicle_commands.lock().unwrap().iter().map(|command| command.action.clone()).collect();
    assert_eq!(actions, [VehicleAction::ReleasePayload, VehicleAction::SecurePayload, VehicleAction::CancelTransfer]);
}
