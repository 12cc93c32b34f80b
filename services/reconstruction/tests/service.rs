//! The actor on a private bus: pairs go in, patches and previews come out.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use std::time::Duration;

use halcyon_chassis::{testing, topics};
use halcyon_model::{RigId, StereoPair};
use halcyon_reconstruction::Config;
use support::scene::{default_rig, pose, render};

const PATIENCE: Duration = Duration::from_secs(60);

#[tokio::test(flavor = "multi_thread")]
async fn a_pair_becomes_a_patch_and_a_bad_one_does_no_harm() {
    let context = testing::context("reconstruction.test").await;
    let rig = RigId::new("leader-1").unwrap();
    let pairs = context.bus.publisher(&topics::pair(&rig)).await.unwrap();
    let mut surfaces = context.bus.subscribe(&topics::surface(&rig)).await.unwrap();
    let mut previews = context.bus.subscribe(&topics::preview(&rig)).await.unwrap();
    let stop = context.stop.clone();
    let service = tokio::spawn(halcyon_reconstruction::run(context.clone(), Config::default()));

    let good = render(&default_rig(), &pose(0.0, 0.0, 5.0, [0.0; 3]), &|_, _| 0.0, 2.0, 1);
    let blank = halcyon_model::Image::new(320, 240, vec![100; 320 * 240].into()).unwrap();
    let bad = StereoPair { left: blank.clone(), right: blank, sequence: 2, ..good.clone() };
    // The service may not have subscribed yet: send until it answers.
    let patch = tokio::time::timeout(PATIENCE, async {
        loop {
            pairs.put(&bad).await.unwrap();
            pairs.put(&good).await.unwrap();
            tokio::select! {
                patch = surfaces.recv() => return patch.unwrap(),
                () = context.clock.sleep(Duration::from_millis(200)) => {}
            }
        }
    });
    let patch = patch.await.unwrap();
    assert_eq!((patch.sequence, patch.rig.as_str()), (1, "leader-1"));
    assert!((patch.plane.distance_m - 5.0).abs() < 0.01, "{:?}", patch.plane);
    assert!(patch.processing_s > 0.0 && patch.coverage > 0.8);
    let preview = tokio::time::timeout(PATIENCE, previews.recv()).await.unwrap().unwrap();
    assert!(preview.left_jpeg.starts_with(&[0xff, 0xd8]) && preview.disparity_png.starts_with(b"\x89PNG"));

    stop.cancel();
    assert!(tokio::time::timeout(PATIENCE, service).await.unwrap().unwrap().is_ok());
}

/// A right camera that has pitched by half a degree: rows are off by 3 px, patches or not, and the fleet is told.
#[tokio::test(flavor = "multi_thread")]
async fn a_calibration_that_has_drifted_is_told() {
    let context = testing::context("reconstruction.test").await;
    let rig = RigId::new("leader-1").unwrap();
    let pairs = context.bus.publisher(&topics::pair(&rig)).await.unwrap();
    let mut events = context.bus.subscribe(&topics::event()).await.unwrap();
    let config = Config { drift_period_s: 1.0, ..Config::default() };
    let service = tokio::spawn(halcyon_reconstruction::run(context.clone(), config));

    let bent = halcyon_model::RigCalibration {
        right_from_left: nalgebra::Rotation3::from_euler_angles(0.5_f64.to_radians(), 0.0, 0.0).into_inner(),
        ..default_rig()
    };
    let seen = render(&bent, &pose(0.0, 0.0, 5.0, [0.0; 3]), &|_, _| 0.0, 2.0, 1);
    let told = tokio::time::timeout(PATIENCE, async {
        for step in 0_u64.. {
            let stamp = seen.stamp + Duration::from_millis(400 * step);
            pairs.put(&StereoPair { stamp, sequence: step, calibration: default_rig(), ..seen.clone() }).await.unwrap();
            tokio::select! {
                event = events.recv() => return event.unwrap(),
                () = context.clock.sleep(Duration::from_millis(200)) => {}
            }
        }
        unreachable!()
    });
    let event = told.await.unwrap();
    assert_eq!(event.severity, halcyon_model::Severity::Warning);
    assert!(event.what.contains("leader-1 has drifted") && event.why.contains("off by 3.0 ±"), "{event:?}");

    context.stop.cancel();
    assert!(tokio::time::timeout(PATIENCE, service).await.unwrap().unwrap().is_ok());
}
