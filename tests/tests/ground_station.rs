//! Independent ground station libraries, pymavlink and MAVSDK, fly a simulated vehicle.

#![allow(clippy::expect_used, reason = "tests fail by panicking")]

use std::path::Path;
use std::time::Duration;

use halcyon_tests::{Running, alone, free_port, judge, wait_for};

/// A vehicle that listens on a port of this host, with a rangefinder as followers have.
fn serve(folder: &Path) -> (Running, u16) {
    let port = free_port();
    let arguments = ["sim", "serve", "--leaders", "0", "--followers", "1", "--mavlink-port", &port.to_string()];
    let vehicle = Running::start(folder, "sim", "halcyon", &arguments);
    let address = std::net::SocketAddr::from(([127, 0, 0, 1], port));
    wait_for(Duration::from_secs(30), "the vehicle listens", || std::net::TcpStream::connect(address).is_ok());
    (vehicle, port)
}

#[test]
fn pymavlink_flies_the_simulated_vehicle() {
    let _alone = alone();
    let folder = tempfile::tempdir().expect("a folder");
    let (_vehicle, port) = serve(folder.path());
    judge("fly_pymavlink.py", &format!("tcp:127.0.0.1:{port}"));
}

#[test]
fn mavsdk_flies_the_simulated_vehicle() {
    let _alone = alone();
    let folder = tempfile::tempdir().expect("a folder");
    let (_vehicle, port) = serve(folder.path());
    judge("fly_mavsdk.py", &format!("tcpout://127.0.0.1:{port}"));
}
