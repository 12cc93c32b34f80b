//! Message signing on a real link: the mavlink crate's own signing at the other end.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test ends at its first surprise")]

#[allow(dead_code, reason = "shared with other tests")]
mod peer;

use std::time::Duration;

use halcyon_chassis::{testing, topics};
use halcyon_vehicle_link::config::Signing;
use halcyon_vehicle_link::{Config, run};
use mavlink::dialects::ardupilotmega::MavMessage;

use peer::Peer;

const KEY: [u8; 32] = [0x5A; 32];

/// What a service with our key makes of an autopilot with another one, or none: whether a state came, and what left.
async fn meets(key: Option<[u8; 32]>) -> (bool, bool, Vec<MavMessage>) {
    let context = testing::context("vehicle-link.test").await;
    let mut states = context.bus.subscribe(&topics::vehicle_states()).await.unwrap();
    let peer = Peer::tcp();
    *peer.shared.key.lock().unwrap() = key;
    let folder = tempfile::tempdir().unwrap();
    let key_file = folder.path().join("key");
    std::fs::write(&key_file, KEY).unwrap();
    let config = Config {
        vehicle: "v".into(),
        endpoint: format!("tcpout:{}", peer.address),
        signing: Signing { key_file, link_id: 1 },
        ..Config::default()
    };
    let service = tokio::spawn(run(context.clone(), config));
    let patience = Duration::from_secs(if key == Some(KEY) { 30 } else { 4 });
    let state = context.clock.timeout(patience, states.recv()).await.ok().map(Result::unwrap);
    if state.is_some() {
        let poll = async {
            while peer.sent(|message| matches!(message, MavMessage::COMMAND_LONG(_))) < 5 {
                context.clock.sleep(Duration::from_millis(20)).await;
            }
        };
        context.clock.timeout(patience, poll).await.expect("what we sign is not accepted");
    }
    context.stop.cancel();
    service.await.unwrap().unwrap();
    let sent = peer.shared.frames.lock().unwrap().iter().map(|(_, message)| message.clone()).collect();
    (state.is_some(), state.is_some_and(|state| state.link.is_some_and(|link| link.is_signed)), sent)
}

#[tokio::test(flavor = "multi_thread")]
async fn with_the_same_key_both_understand_each_other() {
    let (came, is_signed, _) = meets(Some(KEY)).await;
    assert!(came && is_signed);
}

#[tokio::test(flavor = "multi_thread")]
async fn another_key_or_none_is_not_believed_and_nothing_is_asked_of_it() {
    for key in [Some([0xA5; 32]), None] {
        let (came, _, sent) = meets(key).await;
        assert!(!came, "{key:?}");
        assert!(sent.iter().all(|message| matches!(message, MavMessage::HEARTBEAT(_))), "{sent:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn without_its_key_the_service_does_not_start_unsigned() {
    let context = testing::context("vehicle-link.test").await;
    let signing = Signing { key_file: "/nowhere/key".into(), link_id: 0 };
    let error = run(context, Config { signing, ..Config::default() }).await.unwrap_err();
    assert!(format!("{error:#}").contains("/nowhere/key"), "{error:#}");
}
