//! The whole fleet in one process, as a new user starts it.

#![allow(clippy::expect_used, clippy::panic, reason = "tests fail by panicking")]

use std::process::Command;
use std::time::Duration;

use halcyon_tests::{Gateway, Running, alone, free_port, program, wait_for};
use serde_json::Value;

/// Simulated seconds per second: far from what a loaded two-core machine can do, and quick enough.
const SPEED: &str = "4";

fn once(arguments: &[&str]) -> (Option<i32>, Value) {
    let output = Command::new(program("halcyon"))
        .args(["up", "--once", "--json", "--listen", "127.0.0.1:0", "--mavlink-port", "0", "--speed", SPEED])
        .args(arguments)
        .current_dir(tempfile::tempdir().expect("a folder").path())
        .output()
        .expect("halcyon runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    let report = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("no report: {error}\n{stderr}"));
    (output.status.code(), report)
}

#[test]
fn a_mission_over_calm_water_ends_with_a_landing() {
    let _alone = alone();
    let (code, report) = once(&["--leaders", "1", "--followers", "2", "--seed", "7", "--auto-approve"]);
    assert_eq!(code, Some(0), "{report:#}");
    assert_eq!(report["outcome"], "completed", "{report:#}");
    assert_eq!(report["seed"], 7);
    assert_eq!(report["verdict"], "safe");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("a number is missing: {report:#}"));
    // The default sea is JONSWAP with H_s 0.05 m: the interval must hold it, and must say something.
    let sea = &report["sea"];
    assert!((number(&sea["true_h_s_m"]) - 0.05).abs() < 1e-9);
    assert!(number(&sea["h_s_m_low"]) <= 0.05 && 0.05 <= number(&sea["h_s_m_high"]), "{sea:#}");
    assert!(number(&sea["h_s_m_high"]) < 0.15, "the upper bound is under the limit");
    // GNSS errors of two receivers, drift and gusts; the thesis's receiver has 2.5 m.
    assert!(number(&report["touchdown_error_m"]) < 3.0, "{report:#}");
    let formation = &report["formation"];
    assert!(number(&formation["slot_rms_m"]) < 3.0, "{formation:#}");
    assert!(number(&formation["least_separation_m"]) >= 5.0, "{formation:#}");
    assert!(number(&formation["seconds"]) > 5.0, "{formation:#}");
    assert!(report["events"].as_array().is_some_and(|events| !events.is_empty()));
}

#[test]
fn rough_water_sends_nobody() {
    let _alone = alone();
    let (code, report) =
        once(&["--leaders", "1", "--followers", "1", "--seed", "3", "--sea", "jonswap:0.45,2.2", "--auto-approve"]);
    assert_eq!(code, Some(1), "{report:#}");
    assert_eq!(report["outcome"], "failed", "{report:#}");
    assert_ne!(report["verdict"], "safe");
    assert_eq!(report["touchdown_error_m"], Value::Null);
    let sent = report["history"].as_array().is_some_and(|steps| steps.iter().any(|step| step["kind"] == "joining"));
    assert!(!sent, "a follower was sent over rough water: {report:#}");
}

#[test]
fn the_dashboard_is_there_and_a_signal_ends_everything() {
    let _alone = alone();
    let folder = tempfile::tempdir().expect("a folder");
    let port = free_port();
    let listen = format!("127.0.0.1:{port}");
    let mut fleet = Running::start(folder.path(), "up", "halcyon", &["up", "--listen", &listen, "--mavlink-port", "0"]);
    let gateway = Gateway::new(port);
    wait_for(Duration::from_secs(30), "the dashboard answers", || gateway.is_up());
    wait_for(Duration::from_secs(60), "three vehicles are known", || {
        gateway.get("vehicles").is_some_and(|page| page["items"].as_array().is_some_and(|items| items.len() == 3))
    });
    let status = fleet.terminate(Duration::from_secs(15));
    assert!(status.success(), "{status}\n{}", fleet.log());
    assert!(!gateway.is_up());
}
