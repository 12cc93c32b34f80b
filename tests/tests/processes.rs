//! The fleet as separate processes over Zenoh: each service its own program, attached to a host's router.

#![allow(clippy::expect_used, reason = "tests fail by panicking")]

use std::path::Path;
use std::time::Duration;

use halcyon_tests::{Gateway, Running, alone, free_port, wait_for};
use serde_json::json;

/// Simulated seconds per second.
const SPEED: f64 = 2.0;
/// Wall time in which a phase must come.
const PHASE: Duration = Duration::from_secs(150);

/// A world with one leader and one follower, in which every service is a process.
struct Host {
    config: String,
    processes: Vec<(&'static str, Vec<String>, Option<Running>)>,
    gateway: Gateway,
    /// Last, so that the processes and what they logged are dropped before it.
    folder: tempfile::TempDir,
}

impl Host {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (bus, http) = (free_port(), free_port());
        let (leader, follower) = (free_port(), free_port());
        let epoch_s = std::time::UNIX_EPOCH.elapsed().expect("after 1970").as_secs();
        let text = format!(
            r#"
[fleet]
id = "story"
[bus]
mode = "client"
connect = ["tcp/127.0.0.1:{bus}"]
[clock]
speed = {SPEED:.1}
epoch_s = {epoch_s}.0
[sim]
seed = 11
[[sim.vehicles]]
id = "leader-1"
role = "leader"
mavlink_port = {leader}
[[sim.vehicles]]
id = "follower-1"
role = "follower"
east_m = -8.0
mavlink_port = {follower}
[capture]
rig = "leader-1"
vehicle = "leader-1"
[reconstruction]
rig = "leader-1"
[wave_assessment]
rig = "leader-1"
[mission_planner]
store = "missions.sqlite"
[gateway]
listen = "127.0.0.1:{http}"
"#
        );
        let config = folder.path().join("fleet.toml").to_string_lossy().into_owned();
        std::fs::write(&config, text).expect("the configuration can be written");
        let mut host = Self { config, processes: Vec::new(), gateway: Gateway::new(http), folder };
        let router = ["run", "mesh", "--set", "bus.mode=router", "--set"].map(String::from).to_vec();
        host.add(
            "mesh",
            [router, vec![format!("bus.listen=[\"tcp/127.0.0.1:{bus}\"]"), "--set".into(), "bus.connect=[]".into()]].concat(),
        );
        host.add("sim", vec!["run".into(), "sim".into()]);
        for (name, role, port) in [("leader-1", "leader", leader), ("follower-1", "follower", follower)] {
            let set = |text: String| ["--set".to_owned(), text];
            let arguments = [
                set(format!("fleet.host={name}")),
                set(format!("vehicle_link.vehicle={name}")),
                set(format!("vehicle_link.role={role}")),
                set(format!("vehicle_link.endpoint=tcpout:127.0.0.1:{port}")),
            ];
            host.add(if role == "leader" { "vehicle-link-leader" } else { "vehicle-link-follower" }, arguments.concat());
        }
        for service in ["capture", "reconstruction", "wave-assessment", "mission-planner", "gateway"] {
            host.add(service, Vec::new());
        }
        host
    }

    fn add(&mut self, name: &'static str, arguments: Vec<String>) {
        self.processes.push((name, arguments, None));
        self.restart(name);
    }

    fn restart(&mut self, name: &str) {
        let (folder, config) = (self.folder.path().to_owned(), self.config.clone());
        let (name, arguments, running) = self.processes.iter_mut().find(|(known, ..)| *known == name).expect("a known process");
        if let Some(mut old) = running.take() {
            old.kill();
        }
        *running = Some(start(&folder, &config, name, arguments));
    }

    fn reaches(&self, mission: &str, phases: &[&str]) -> String {
        let mut phase = String::new();
        wait_for(PHASE, &format!("the mission is in {phases:?}"), || {
            phase = self.gateway.phase(mission);
            assert!(
                phases.contains(&phase.as_str()) || !["failed", "aborted"].contains(&phase.as_str()),
                "the mission {phase}: {:#}",
                self.gateway.get(&format!("missions/{mission}")).unwrap_or_default()
            );
            phases.contains(&phase.as_str())
        });
        phase
    }

    fn create(&self, mission: &str) {
        let body = json!({ "id": mission, "point": { "north_m": 25.0, "east_m": 10.0 }, "approval": "automatic" });
        wait_for(Duration::from_secs(60), "the planner takes the mission", || self.gateway.post("missions", &body).0 < 300);
    }
}

/// A service's own program where it has one, `halcyon run` for what only simulation and the mesh need.
fn start(folder: &Path, config: &str, name: &str, arguments: &[String]) -> Running {
    let program = match name {
        "mesh" | "sim" => "halcyon".to_owned(),
        _ if name.starts_with("vehicle-link") => "halcyon-vehicle-link".to_owned(),
        service => format!("halcyon-{service}"),
    };
    let mut all: Vec<&str> = arguments.iter().map(String::as_str).collect();
    all.extend(["--config", config]);
    Running::start(folder, name, &program, &all)
}

#[test]
fn a_mission_across_processes_ends_with_a_landing() {
    let _alone = alone();
    let host = Host::start();
    wait_for(Duration::from_secs(60), "the gateway answers", || host.gateway.is_up());
    host.create("m1");
    host.reaches("m1", &["completed"]);
    let mission = host.gateway.get("missions/m1").expect("the mission is known");
    assert_eq!(mission["verdict"], "safe", "{mission:#}");
    let error_m = mission["touchdown_error_m"].as_f64().expect("the follower touched down");
    assert!(error_m < 3.0, "{mission:#}");
}

/// Each service is killed without a goodbye while the mission runs, and started again.
#[test]
fn any_service_may_die_and_the_mission_still_ends() {
    let _alone = alone();
    let mut host = Host::start();
    wait_for(Duration::from_secs(60), "the gateway answers", || host.gateway.is_up());
    host.create("m2");
    host.reaches("m2", &["transit"]);
    host.restart("gateway");
    host.restart("vehicle-link-leader");
    wait_for(Duration::from_secs(60), "the gateway is back", || host.gateway.is_up());
    host.reaches("m2", &["assessing"]);
    host.restart("capture");
    host.restart("reconstruction");
    host.restart("wave-assessment");
    host.restart("mission-planner");
    let phase = host.reaches("m2", &["joining", "clearing", "failed"]);
    if phase != "failed" {
        host.restart("vehicle-link-follower");
        host.restart("mesh");
    }
    // It lands, or it is called off and everyone is home or on the way: both are safe.
    let phase = host.reaches("m2", &["completed", "failed"]);
    let mission = host.gateway.get("missions/m2").expect("the mission is known");
    assert!(!mission["history"].as_array().expect("a history").is_empty(), "{mission:#}");
    if phase == "failed" {
        wait_for(PHASE, "nobody is left hanging in the air", || {
            let vehicles = host.gateway.get("vehicles").unwrap_or_default();
            let items = vehicles["items"].as_array().cloned().unwrap_or_default();
            items.len() == 2 && items.iter().all(|vehicle| vehicle["armed"] == false)
        });
    }
}
