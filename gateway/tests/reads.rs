//! What GETs answer.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

mod support;

use halcyon_model::{MissionPhase, Severity};
use serde_json::json;
use support::*;

#[tokio::test]
async fn a_vehicle_in_degrees_with_its_age() {
    let gateway = gateway().await;
    gateway.app.store.write().vehicle(vehicle("leader-1", 0.5), at(0.0));
    let answer = gateway.get("/api/v1/vehicles/leader-1").await;
    assert_eq!(answer.status, 200);
    let near = |key: &str, expected: f64| {
        let value = answer.json.pointer(key).and_then(serde_json::Value::as_f64).unwrap();
        assert!((value - expected).abs() < 1e-9, "{key} is {value}, not {expected}");
    };
    near("/heading_deg", 270.0);
    near("/roll_deg", 3.0);
    near("/pitch_deg", -4.0);
    near("/local/height_m", 5.0);
    near("/velocity/down_mps", 0.5);
    near("/position/latitude_deg", 45.0);
    near("/battery_percent", 75.0);
    near("/age_s", 0.5);
    assert_eq!(answer.json["stamp"], "2026-09-21T14:13:19.500Z", "1 790 000 000 s is 2026-09-21 14:13:20 UTC by date(1)");
    assert_eq!(answer.json["stale"], false);
    assert_eq!(answer.json["mode"], "GUIDED");
    assert_eq!(answer.json["fix"]["kind"], "3d");
    assert_eq!(answer.json["activity"], json!({"kind": "following", "settled": true, "slot_error_m": 0.25, "reason": null}));
    assert!(answer.json.as_object().unwrap().contains_key("touchdown"), "unknown keys are null, not missing");
}

#[tokio::test]
async fn the_silent_are_stale_and_the_lapsed_expired() {
    let gateway = gateway().await;
    {
        let mut fleet = gateway.app.store.write();
        fleet.vehicle(vehicle("a", 1.9), at(0.0));
        fleet.vehicle(vehicle("b", 2.1), at(0.0));
        fleet.vehicle(vehicle("from-the-future", -60.0), at(0.0));
        fleet.sea_state(sea_state("fresh", 1.0, 5.0), at(0.0));
        fleet.sea_state(sea_state("lapsed", 6.0, 5.0), at(0.0));
    }
    let vehicles = gateway.get("/api/v1/vehicles").await.json;
    let stale: Vec<_> = vehicles["items"].as_array().unwrap().iter().map(|v| (&v["id"], &v["stale"])).collect();
    assert_eq!(stale, [(&json!("a"), &json!(false)), (&json!("b"), &json!(true)), (&json!("from-the-future"), &json!(true))]);
    let seas = gateway.get("/api/v1/sea-states").await.json;
    let expired: Vec<_> = seas["items"].as_array().unwrap().iter().map(|sea| &sea["verdict"]["expired"]).collect();
    assert_eq!(expired, [false, true]);
}

#[tokio::test]
async fn a_mission_says_what_can_be_done_and_why_not() {
    let gateway = gateway().await;
    gateway.app.store.write().mission(mission("m-1", MissionPhase::AwaitingApproval, 0.0), at(0.0));
    gateway.app.store.write().mission(mission("m-2", MissionPhase::Completed, 1.0), at(0.0));
    let open = gateway.get("/api/v1/missions/m-1").await.json;
    assert_eq!(open["phase"], "awaiting_approval");
    assert_eq!(open["can"]["approve"], json!({"allowed": true, "why": ""}));
    assert_eq!(open["can"]["resume"], json!({"allowed": false, "why": "The mission is not paused"}));
    let error_m = open["touchdown_error_m"].as_f64().unwrap();
    assert!((error_m - 0.5).abs() < 1e-9, "0.3 north and 0.4 east of the point is 0.5 m, not {error_m}");
    let done = gateway.get("/api/v1/missions/m-2").await.json;
    for action in ["approve", "dispatch", "pause", "resume", "abort", "release", "skip_release"] {
        assert_eq!(done["can"][action], json!({"allowed": false, "why": "The mission is completed"}), "{action}");
    }
    // The newest first.
    let ids: Vec<_> =
        gateway.get("/api/v1/missions").await.json["items"].as_array().unwrap().iter().map(|m| m["id"].clone()).collect();
    assert_eq!(ids, ["m-2", "m-1"]);
}

#[tokio::test]
async fn lists_page_and_filter() {
    let gateway = gateway().await;
    {
        let mut fleet = gateway.app.store.write();
        fleet.mission(mission("m-1", MissionPhase::Waiting, 0.0), at(0.0));
        for number in 0..5 {
            fleet.event(event(&format!("info {number}"), Severity::Info, None));
        }
        fleet.event(event("bad", Severity::Critical, Some("m-1")));
    }
    let mut seen = Vec::new();
    let mut path = "/api/v1/events?limit=4".to_owned();
    loop {
        let page = gateway.get(&path).await.json;
        seen.extend(page["items"].as_array().unwrap().iter().map(|event| event["sequence"].as_u64().unwrap()));
        let Some(next) = page["next"].as_str() else { break };
        path = format!("/api/v1/events?limit=4&after={next}");
    }
    assert_eq!(seen, [6, 5, 4, 3, 2, 1]);
    let bad = gateway.get("/api/v1/events?severity=warning").await.json;
    assert_eq!(bad["items"].as_array().unwrap().len(), 1);
    let of_mission = gateway.get("/api/v1/missions/m-1/events").await.json;
    assert_eq!(of_mission["items"][0]["what"], "bad");
    gateway.get("/api/v1/events?limit=0").await.is_problem(400, "limit");
    gateway.get("/api/v1/events?limit=x").await.is_problem(400, "");
    gateway.get("/api/v1/events?after=x").await.is_problem(400, "after");
    gateway.get("/api/v1/events?unknown=1").await.is_problem(400, "unknown");
}

#[tokio::test]
async fn overlapping_windows_join_into_one_series() {
    let gateway = gateway().await;
    {
        let mut fleet = gateway.app.store.write();
        // Traces at -6 … -2 and -4 … 0: the later one replaces what both cover.
        fleet.sea_state(sea_state("bow", 2.0, 5.0), at(0.0));
        fleet.sea_state(sea_state("bow", 0.0, 5.0), at(0.0));
    }
    let series = gateway.get("/api/v1/rigs/bow/series").await.json;
    let samples: Vec<_> = series["elevation"]
        .as_array()
        .unwrap()
        .iter()
        .map(|sample| (sample["t_s"].as_f64().unwrap(), sample["elevation_m"].as_f64().unwrap()))
        .collect();
    assert_eq!(samples, [(-6.0, 0.0), (-5.0, 1.0), (-4.0, 0.0), (-3.0, 1.0), (-2.0, 2.0), (-1.0, 3.0), (0.0, 4.0)]);
    assert_eq!(series["h_s"].as_array().unwrap().len(), 2);
    let short = gateway.get("/api/v1/rigs/bow/series?seconds=1.5").await.json;
    assert_eq!(short["elevation"].as_array().unwrap().len(), 2);
    gateway.get("/api/v1/rigs/bow/series?seconds=-1").await.is_problem(400, "seconds");
    gateway.get("/api/v1/rigs/stern/series").await.is_problem(404, "stern");
}

#[tokio::test]
async fn what_is_not_there_is_a_problem() {
    let gateway = gateway().await;
    for path in [
        "/api/v1/nonsense",
        "/api",
        "/api/v1/vehicles/none",
        "/api/v1/missions/none",
        "/api/v1/plan",
        "/api/v1/rigs/none/preview",
    ] {
        gateway.get(path).await.is_problem(404, "");
    }
    gateway.get("/api/v1/vehicles/a%2Fb").await.is_problem(400, "identifier");
    gateway.get("/api/v1/vehicles/%ff").await.is_problem(400, "");
    gateway.get("/missing.js").await.is_problem(404, "file");
    let delete = gateway.send(gateway.client.delete(gateway.url("/api/v1/missions"))).await;
    delete.is_problem(405, "DELETE");
    assert!(delete.headers.contains_key("allow"), "{delete:?}");
    gateway.get("/api/v1/stream").await.is_problem(426, "");
}

#[tokio::test]
async fn the_page_the_probes_and_the_documents() {
    let gateway = gateway().await;
    for path in ["/", "/missions/m-1"] {
        let page = gateway.get(path).await;
        assert_eq!(page.status, 200, "{path}");
        assert!(page.text.to_lowercase().contains("<!doctype html>"), "{path}");
        let policy = page.headers["content-security-policy"].to_str().unwrap();
        assert!(policy.contains("default-src 'self'") && policy.contains("frame-ancestors 'none'"), "{policy}");
        assert_eq!(page.headers["x-content-type-options"], "nosniff");
    }
    assert_eq!(gateway.get("/healthz").await.status, 200);
    let readyz = gateway.get("/readyz").await;
    assert_eq!((readyz.status, &readyz.json["ready"]), (503, &json!(false)), "no planner was heard");
    assert!(gateway.get("/metrics").await.text.starts_with('#'));
    let openapi = gateway.get("/openapi.json").await.json;
    assert!(openapi["openapi"].as_str().unwrap().starts_with("3.1"));
    let docs = gateway.get("/docs/").await;
    assert!(docs.text.contains("swagger-ui") && !docs.text.contains("https://"), "the reader works off line: {}", docs.text);
    let script = gateway.get("/docs/swagger-initializer.js").await;
    assert!(script.text.contains("/openapi.json"), "{}", script.text);
}

#[tokio::test]
async fn an_unchanged_page_is_not_sent_again() {
    let gateway = gateway().await;
    let page = gateway.get("/").await;
    // Only a program built with its dashboard has one.
    if let Some(etag) = page.headers.get("etag") {
        let again = gateway.send(gateway.client.get(gateway.url("/")).header("if-none-match", etag)).await;
        assert_eq!((again.status, again.text.len()), (304, 0));
    } else {
        assert!(page.text.contains("make web"));
    }
}
