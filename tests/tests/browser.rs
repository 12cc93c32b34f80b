//! A person at the dashboard, in headless Chromium.

use std::process::Command;
use std::time::Duration;

use halcyon_tests::{Gateway, Running, free_port, root, wait_for};

#[test]
fn a_mission_clicked_through_on_the_real_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let port = free_port();
    let listen = format!("127.0.0.1:{port}");
    let arguments = ["up", "--leaders", "1", "--followers", "1", "--listen", &listen, "--mavlink-port", "0", "--speed", "3"];
    let _fleet = Running::start(folder.path(), "up", "halcyon", &arguments);
    let gateway = Gateway::new(port);
    wait_for(Duration::from_secs(60), "the dashboard answers", || gateway.is_up());

    let stories = ["tests/browser/link.test.mjs", "tests/browser/mission.test.mjs"];
    let output = Command::new("node")
        .args(["--test", "--test-concurrency=1"])
        .args(stories)
        .current_dir(root())
        .env("HALCYON_URL", gateway.url())
        .env("HALCYON_SCREENSHOT", root().join("target/dashboard.png"))
        .output()
        .expect("node runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("# fail 0") || text.contains("ℹ fail 0"), "the stories did run: {text}");
}
