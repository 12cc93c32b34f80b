//! What the stories share: programs as separate processes, a client of the gateway, waits with a bound.
//!
//! The stories run the programs that a user runs, so `cargo build --workspace --bins` comes first, as `make test` does it.

#![allow(
    clippy::panic,
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test's support says what is wrong and ends the test"
)]

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::Value;

/// The root of the repository.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ has a parent").to_owned()
}

/// A program of the workspace, beside the test's own.
///
/// # Panics
/// If it has not been built.
#[must_use]
pub fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a test knows where it is");
    let folder =
        test.ancestors().find(|folder| folder.ends_with("deps")).and_then(Path::parent).expect("tests run from target/…/deps");
    let program = folder.join(name);
    assert!(
        program.is_file(),
        "{} is not built: run `cargo build --workspace --bins` first, as `make test` does",
        program.display()
    );
    program
}

/// A port that is free now.
///
/// # Panics
/// If the system has none.
#[must_use]
pub fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("a port is free").port()
}

/// Holds off the other stories of a file: a fleet has the machine to itself, or its time runs ahead of it.
pub fn alone() -> MutexGuard<'static, ()> {
    static MACHINE: Mutex<()> = Mutex::new(());
    MACHINE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A process that does not outlive the test; its stderr is kept and shown if the test fails.
pub struct Running {
    name: String,
    child: Child,
    log: PathBuf,
}

impl Running {
    /// Starts `program` with `arguments`; its stderr goes to a file in `folder`.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start(folder: &Path, name: &str, program: &str, arguments: &[&str]) -> Self {
        let log = folder.join(format!("{name}.log"));
        let file = std::fs::OpenOptions::new().create(true).append(true).open(&log).expect("the log can be written");
        let child = Command::new(self::program(program))
            .args(arguments)
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(file)
            .spawn()
            .unwrap_or_else(|error| panic!("{program} does not start: {error}"));
        Self { name: name.into(), child, log }
    }

    /// SIGKILL: no goodbye.
    pub fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// SIGTERM, and how it ended, within `bound`.
    ///
    /// # Panics
    /// If it does not end in time.
    pub fn terminate(&mut self, bound: Duration) -> std::process::ExitStatus {
        let pid = self.child.id().to_string();
        Command::new("kill").args(["-TERM", &pid]).status().expect("kill runs");
        let mut status = None;
        wait_for(bound, &format!("{} ends after SIGTERM", self.name), || {
            status = self.child.try_wait().expect("a child can be asked");
            status.is_some()
        });
        status.expect("it has ended")
    }

    /// What it wrote to stderr so far.
    #[must_use]
    pub fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill();
        if std::thread::panicking() {
            let log = self.log();
            let tail: Vec<&str> = log.lines().rev().take(40).collect();
            let tail: Vec<&str> = tail.into_iter().rev().collect();
            println!("---- {} ----\n{}", self.name, tail.join("\n"));
        }
    }
}

/// Runs one of `tests/ground_station`'s programs against an address, in the Python that `make setup-test` made.
///
/// # Panics
/// If it finds a fault; with what it said.
pub fn judge(program: &str, connect: &str) {
    let python = root().join("target/venv/bin/python");
    assert!(python.is_file(), "{} is missing: `make test` makes it", python.display());
    let program = root().join("tests/ground_station").join(program);
    let output = Command::new(python).arg(&program).args(["--connect", connect]).output().expect("python runs");
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{}: {text}", program.display());
    println!("{text}");
}

/// Waits until `condition`, at most `bound`.
///
/// # Panics
/// If it does not come true in time.
pub fn wait_for(bound: Duration, what: &str, mut condition: impl FnMut() -> bool) {
    let end = Instant::now() + bound;
    while !condition() {
        assert!(Instant::now() < end, "waited {} s in vain until {what}", bound.as_secs());
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A client of one gateway.
pub struct Gateway {
    url: String,
    http: reqwest::blocking::Client,
}

impl Gateway {
    /// A client of the gateway on this port of this host.
    ///
    /// # Panics
    /// If no client can be made.
    #[must_use]
    pub fn new(port: u16) -> Self {
        let http = reqwest::blocking::Client::builder().no_proxy().timeout(Duration::from_secs(10)).build().expect("a client");
        Self { url: format!("http://127.0.0.1:{port}"), http }
    }

    /// Its address.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }

    /// A resource below `/api/v1/`, or `None` while it cannot be had.
    #[must_use]
    pub fn get(&self, path: &str) -> Option<Value> {
        let response = self.http.get(format!("{}/api/v1/{path}", self.url)).send().ok()?;
        if response.status().is_success() { response.json().ok() } else { None }
    }

    /// Whether the dashboard is there.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.http.get(format!("{}/healthz", self.url)).send().is_ok_and(|response| response.status().is_success())
    }

    /// Posts and returns status and answer.
    ///
    /// # Panics
    /// If the gateway does not answer.
    pub fn post(&self, path: &str, body: &Value) -> (u16, Value) {
        let response = self.http.post(format!("{}/api/v1/{path}", self.url)).json(body).send().expect("the gateway answers");
        (response.status().as_u16(), response.json().unwrap_or(Value::Null))
    }

    /// A mission's phase; empty while it is not known.
    #[must_use]
    pub fn phase(&self, mission: &str) -> String {
        let mission = self.get(&format!("missions/{mission}"));
        mission.and_then(|mission| mission["phase"].as_str().map(str::to_owned)).unwrap_or_default()
    }
}
