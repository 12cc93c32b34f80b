//! The recorder and the replay on a bus.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may")]

use std::path::{Path, PathBuf};
use std::time::Duration;

use halcyon_chassis::{Context, EventDraft, testing, topics};
use halcyon_model::{Bytes, DispatchPlan, LocalPoint, Preview, RigId, Stamp};
use halcyon_proto::{FILE_DESCRIPTOR_SET, Wire};
use halcyon_recorder::core::{Reading, Recorded, Recording, Sample};
use halcyon_recorder::{Config, ReplayError, ReplayOptions, replay, run};

const PATIENCE: Duration = Duration::from_secs(30);

fn samples(path: &Path) -> Vec<Sample> {
    let mut reading = Reading::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut samples = Vec::new();
    while let Recorded::Sample(sample) = reading.next_sample().unwrap() {
        samples.push(sample);
    }
    samples
}

fn recordings(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).map(|entries| entries.map(|entry| entry.unwrap().path()).collect());
    entries.unwrap_or_default()
}

fn plan(generation: u64) -> DispatchPlan {
    let stamp = Stamp::from_secs_f64(1e9);
    DispatchPlan { stamp, generation, mission: None, valid_until: stamp.plus_secs_f64(5.0), assignments: Vec::new() }
}

/// Waits until `done`, looking at the disk again and again.
async fn until(context: &Context, what: &str, mut done: impl FnMut() -> bool) {
    let patience = tokio::time::timeout(PATIENCE, async {
        while !done() {
            context.clock.sleep(Duration::from_millis(20)).await;
        }
    });
    patience.await.unwrap_or_else(|_| panic!("{what}: not within {PATIENCE:?}"));
}

#[tokio::test(flavor = "multi_thread")]
async fn everything_but_pictures_is_on_the_disk_within_moments() {
    let folder = tempfile::tempdir().unwrap();
    let config =
        Config { folder: folder.path().join("deep/er").to_string_lossy().into_owned(), flush_s: 0.1, ..Config::default() };
    let recordings_folder = folder.path().join("deep/er");
    let context = testing::context("recorder.test").await;
    let recorder = tokio::spawn(run(context.clone(), config));
    until(&context, "a recording is begun", || !recordings(&recordings_folder).is_empty()).await;

    let plans = context.bus.publisher(&topics::plan()).await.unwrap();
    let previews = context.bus.publisher(&topics::preview(&RigId::new("bow").unwrap())).await.unwrap();
    let preview = Preview {
        stamp: Stamp::from_nanos(1),
        rig: RigId::new("bow").unwrap(),
        left_jpeg: Bytes::from_static(b"jpeg"),
        disparity_png: Bytes::from_static(b"png"),
    };
    for generation in 1..=20 {
        previews.put(&preview).await.unwrap();
        plans.put(&plan(generation)).await.unwrap();
    }
    context.event(EventDraft::info("the last", "of all")).await;

    // The file is read while it is still being written, as after a crash.
    let path = recordings(&recordings_folder).remove(0);
    until(&context, "all is flushed", || samples(&path).iter().any(|sample| sample.key == "halcyon/v1/test/event")).await;
    let before_end = samples(&path);

    context.stop.cancel();
    tokio::time::timeout(PATIENCE, recorder).await.unwrap().unwrap().unwrap();
    let recorded = samples(&path);
    assert!(recorded.starts_with(&before_end));
    assert!(recorded.iter().all(|sample| !sample.key.ends_with("/preview")));
    let generations: Vec<u64> = recorded
        .iter()
        .filter(|sample| sample.key == "halcyon/v1/test/plan")
        .map(|sample| {
            assert_eq!(sample.encoding, "application/protobuf;halcyon.v1.DispatchPlan");
            halcyon_proto::decode::<DispatchPlan>(sample.payload.clone()).unwrap().generation
        })
        .collect();
    assert_eq!(generations, (1..=20).collect::<Vec<u64>>());
    let summary = mcap::Summary::read(&std::fs::read(&path).unwrap()).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, recorded.len() as u64);
}

/// A recording of three seconds of another fleet: truths, a plan, and something unknown.
fn recorded(folder: &Path, cut: bool) -> PathBuf {
    let file = std::fs::File::create(folder.join("r.mcap")).unwrap();
    let mut recording = Recording::new(file, FILE_DESCRIPTOR_SET, Default::default()).unwrap();
    let start = Stamp::from_secs_f64(1e9);
    let mut add = |after_s: f64, suffix: &str, name: &str, payload: Vec<u8>| {
        let key = format!("halcyon/v1/elsewhere/{suffix}");
        let encoding = format!("application/protobuf;halcyon.v1.{name}");
        recording.add(&Sample { key, encoding, payload: payload.into(), received: start.plus_secs_f64(after_s) }).unwrap();
    };
    for step in 0..4 {
        let point = LocalPoint::new(f64::from(step), 0.0);
        let truth = halcyon_model::SimTruth {
            stamp: start.plus_secs_f64(f64::from(step)),
            vehicle: halcyon_model::VehicleId::new("leader-1").unwrap(),
            position_ned_m: nalgebra::Vector3::new(point.north_m, point.east_m, 0.0),
            velocity_ned_mps: Default::default(),
            ned_from_body: Default::default(),
            rate_body_radps: Default::default(),
            landed: false,
        };
        add(f64::from(step), "sim/leader-1/truth", halcyon_model::SimTruth::NAME, halcyon_proto::encode(&truth));
        add(f64::from(step), "plan", DispatchPlan::NAME, halcyon_proto::encode(&plan(9)));
        add(f64::from(step), "vehicle/leader-1/command", "VehicleCommand", vec![1]);
        add(f64::from(step), "something/new", "New", vec![1]);
    }
    if cut {
        recording.flush().unwrap();
        std::mem::forget(recording);
    } else {
        recording.finish().unwrap();
    }
    folder.join("r.mcap")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_replay_keeps_its_pace_and_holds_orders_back() {
    for cut in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let path = recorded(folder.path(), cut);
        let context = testing::context_at_speed("replay.test", 20.0).await;
        let mut truths = context.bus.subscribe(&topics::sim_truths()).await.unwrap();
        let mut everything = context.bus.subscribe_raw().await.unwrap();
        let began = context.clock.now();
        let options = ReplayOptions { speed: 2.0, ..ReplayOptions::default() };
        let report = tokio::time::timeout(PATIENCE, replay(&context, &path, &options)).await.unwrap().unwrap();
        assert!(context.clock.now().seconds_since(began) >= 1.5, "3 s at twice the speed");
        assert_eq!((report.published, report.complete, report.finished), (4, !cut, true));
        assert!((report.recorded_s - 3.0).abs() < 1e-6);
        let held: Vec<(&str, u64)> = report.held_back.iter().map(|(key, count)| (key.as_str(), *count)).collect();
        assert_eq!(
            held,
            [
                ("halcyon/v1/elsewhere/plan", 4),
                ("halcyon/v1/elsewhere/something/new", 4),
                ("halcyon/v1/elsewhere/vehicle/leader-1/command", 4)
            ]
        );
        for step in 0..4 {
            let truth = tokio::time::timeout(PATIENCE, truths.recv()).await.unwrap().unwrap();
            assert_eq!(truth.position_ned_m.x, f64::from(step));
            let raw = tokio::time::timeout(PATIENCE, everything.recv()).await.unwrap().unwrap();
            assert_eq!(raw.key, "halcyon/v1/test/sim/leader-1/truth");
            assert_eq!(raw.encoding, "application/protobuf;halcyon.v1.SimTruth");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn orders_are_replayed_only_if_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = recorded(folder.path(), false);
    let context = testing::context_at_speed("replay.test", 20.0).await;
    let mut plans = context.bus.subscribe(&topics::plan()).await.unwrap();
    let options = ReplayOptions { speed: 10.0, orders: true };
    let report = tokio::time::timeout(PATIENCE, replay(&context, &path, &options)).await.unwrap().unwrap();
    assert_eq!((report.published, report.held_back.len()), (16, 0));
    let plan = tokio::time::timeout(PATIENCE, plans.recv()).await.unwrap().unwrap();
    assert_eq!(plan.generation, 9);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_replay_can_be_stopped_and_refuses_what_it_cannot_play() {
    let folder = tempfile::tempdir().unwrap();
    let path = recorded(folder.path(), false);
    let context = testing::context("replay.test").await;
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = ReplayOptions { speed, ..ReplayOptions::default() };
        assert!(matches!(replay(&context, &path, &options).await, Err(ReplayError::Speed(_))));
    }
    let nowhere = replay(&context, &folder.path().join("nowhere.mcap"), &ReplayOptions::default()).await.unwrap_err();
    assert!(nowhere.to_string().contains("nowhere.mcap could not be opened"), "{nowhere}");
    std::fs::write(folder.path().join("text"), "no recording at all").unwrap();
    let text = replay(&context, &folder.path().join("text"), &ReplayOptions::default()).await.unwrap_err();
    assert!(text.to_string().contains("could not be replayed"), "{text}");

    let options = ReplayOptions { speed: 0.01, ..ReplayOptions::default() };
    let stop = context.stop.clone();
    let (report, ()) = tokio::join!(replay(&context, &path, &options), async { stop.cancel() });
    assert!(!report.unwrap().finished);
}
