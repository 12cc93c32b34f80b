//! The service on a private bus.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod support;

use std::time::Duration;

use halcyon_chassis::testing::context;
use halcyon_chassis::topics;
use halcyon_model::{RigId, VerdictState};
use halcyon_wave_assessment::Config;
use support::{Camera, Sea};

/// Patches make sea states, silence makes an inconclusive one, and a stop ends it.
#[tokio::test(flavor = "multi_thread")]
async fn patches_in_sea_states_out() {
    let context = context("wave-assessment").await;
    let rig = RigId::new("leader-1").unwrap();
    let mut sea_states = context.bus.subscribe(&topics::sea_state(&rig)).await.unwrap();
    let patches = context.bus.publisher(&topics::surface(&rig)).await.unwrap();
    let config = Config { stale_s: 0.5, period_s: 0.1, ..Config::default() };
    let service = tokio::spawn(halcyon_wave_assessment::run(context.clone(), config));

    let mut film = Camera::default().film(&Sea::jonswap(0.05, 1.3, 5), 50).into_iter().cycle();
    let first = tokio::time::timeout(Duration::from_secs(30), async {
        let mut beat = context.clock.every(Duration::from_millis(50));
        loop {
            tokio::select! {
                sea_state = sea_states.recv() => return sea_state.unwrap(),
                now = beat.tick() => {
                    let mut patch = film.next().unwrap();
                    patch.stamp = now;
                    patches.put(&patch).await.unwrap();
                }
            }
        }
    });
    let first = first.await.unwrap();
    assert_eq!(first.rig, rig);
    assert_eq!(first.verdict.state, VerdictState::Inconclusive);
    assert!(first.verdict.reasons.iter().any(|r| r.check == "window" && !r.passed));

    let silence = tokio::time::timeout(Duration::from_secs(30), async {
        loop {
            let sea_state = sea_states.recv().await.unwrap();
            if sea_state.verdict.reasons.iter().any(|r| r.check == "fresh" && !r.passed) {
                return sea_state;
            }
        }
    });
    assert_eq!(silence.await.unwrap().verdict.state, VerdictState::Inconclusive);

    context.stop.cancel();
    tokio::time::timeout(Duration::from_secs(10), service).await.unwrap().unwrap().unwrap();
}
