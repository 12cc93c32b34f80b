//! Independent ground stations watch a vehicle through vehicle-link's relay while it flies it, and take it over.

#![allow(clippy::expect_used, reason = "tests fail by panicking")]

use std::time::Duration;

use halcyon_tests::{Gateway, Running, alone, free_port, judge, wait_for};
use serde_json::{Value, json};

/// Wall time in which the vehicle must do what it was told.
const SOON: Duration = Duration::from_secs(60);

/// One vehicle, its vehicle-link and a gateway, each a process.
struct Host {
    gateway: Gateway,
    /// Where stations connect.
    udp: u16,
    tcp: u16,
    _processes: Vec<Running>,
    /// Last, so that the processes and what they logged are dropped before it.
    _folder: tempfile::TempDir,
}

impl Host {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let [bus, http, vehicle, udp, tcp] = std::array::from_fn(|_| free_port());
        let text = format!(
            r#"
[fleet]
id = "relay"
[bus]
mode = "client"
connect = ["tcp/127.0.0.1:{bus}"]
[[sim.vehicles]]
id = "leader-1"
role = "leader"
mavlink_port = {vehicle}
[vehicle_link]
vehicle = "leader-1"
endpoint = "tcpout:127.0.0.1:{vehicle}"
relay = ["udpin:127.0.0.1:{udp}", "tcpin:127.0.0.1:{tcp}"]
[gateway]
listen = "127.0.0.1:{http}"
"#
        );
        let config = folder.path().join("relay.toml");
        std::fs::write(&config, text).expect("the configuration can be written");
        let config = config.to_string_lossy().into_owned();
        let listen = format!("bus.listen=[\"tcp/127.0.0.1:{bus}\"]");
        let router = ["--set", "bus.mode=router", "--set", &listen, "--set", "bus.connect=[]"];
        let run = |service: &str, more: &[&str]| {
            let arguments = [&["run", service, "--config", &config], more].concat();
            Running::start(folder.path(), service, "halcyon", &arguments)
        };
        let processes = vec![run("mesh", &router), run("sim", &[]), run("vehicle-link", &[]), run("gateway", &[])];
        Self { gateway: Gateway::new(http), udp, tcp, _processes: processes, _folder: folder }
    }

    fn vehicle(&self) -> Value {
        self.gateway.get("vehicles/leader-1").unwrap_or_default()
    }

    /// Commands until it is accepted.
    fn command(&self, what: &str, body: &Value) {
        wait_for(SOON, what, || self.gateway.post("vehicles/leader-1/commands", body).0 == 202);
    }

    fn comes_to(&self, what: &str, done: impl Fn(&Value) -> bool) {
        wait_for(SOON, what, || done(&self.vehicle()));
    }
}

#[test]
fn ground_stations_watch_through_the_relay_and_take_over() {
    let _alone = alone();
    let host = Host::start();
    wait_for(SOON, "the gateway answers", || host.gateway.is_up());
    wait_for(SOON, "the vehicle is heard", || host.gateway.get("vehicles/leader-1").is_some());
    host.command("the take-off is accepted", &json!({ "action": "take_off", "parameters": { "height_m": 6 } }));
    host.comes_to("it holds its height", |vehicle| vehicle["activity"]["kind"] == "holding");

    // pymavlink over UDP: it watches, and sets LOITER. That is the pilot's word, and stays it.
    judge("watch_pymavlink.py", &format!("udpout:127.0.0.1:{}", host.udp));
    host.comes_to("it lets go", |vehicle| vehicle["activity"]["kind"] == "pilot_control");
    assert_eq!(host.vehicle()["mode"], "LOITER");

    // Asked for, it flies again.
    host.command("GUIDED is accepted", &json!({ "action": "set_mode", "parameters": { "mode": "GUIDED" } }));
    host.command("it takes commands again", &json!({ "action": "hold" }));
    host.comes_to("it flies again", |vehicle| vehicle["activity"]["kind"] == "holding");

    // MAVSDK over TCP: it watches, stops the vehicle, and lands it.
    judge("watch_mavsdk.py", &format!("tcpout://127.0.0.1:{}", host.tcp));
    host.comes_to("it is on the ground", |vehicle| vehicle["armed"] == false && vehicle["landed"] == "on_ground");
}
