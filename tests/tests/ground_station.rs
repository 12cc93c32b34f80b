//! An independent ground station library, pymavlink, flies a simulated vehicle.

use std::process::Command;
use std::time::Duration;

use halcyon_tests::{Running, free_port, root, wait_for};

#[test]
fn pymavlink_flies_the_simulated_vehicle() {
    let python = root().join("target/venv/bin/python");
    assert!(python.is_file(), "{} is missing: `make test` makes it", python.display());
    let folder = tempfile::tempdir().expect("a folder");
    let port = free_port();
    let arguments = ["sim", "serve", "--leaders", "1", "--followers", "0", "--mavlink-port", &port.to_string()];
    let _vehicle = Running::start(folder.path(), "sim", "halcyon", &arguments);
    let address = std::net::SocketAddr::from(([127, 0, 0, 1], port));
    wait_for(Duration::from_secs(30), "the vehicle listens", || std::net::TcpStream::connect(address).is_ok());
    let output = Command::new(python)
        .arg(root().join("tests/ground_station/fly_pymavlink.py"))
        .args(["--connect", &format!("tcp:127.0.0.1:{port}")])
        .output()
        .expect("python runs");
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{text}");
}
