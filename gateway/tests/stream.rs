//! The live stream.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

mod support;

use std::time::Duration;

use futures::StreamExt as _;
use halcyon_gateway::{Config, feed};
use halcyon_model::{MissionPhase, Severity};
use serde_json::Value;
use support::*;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;

const LONG: Duration = Duration::from_secs(20);

struct Client(tokio_tungstenite::WebSocketStream<tokio_tungstenite::MaybeTlsStream<tokio::net::TcpStream>>);

impl Client {
    async fn connect(gateway: &Gateway) -> Self {
        let url = format!("ws://{}/api/v1/stream", gateway.address);
        Self(tokio_tungstenite::connect_async(url).await.unwrap().0)
    }

    /// The next message but heartbeats; `None` at the end.
    async fn next(&mut self) -> Option<Value> {
        tokio::time::timeout(LONG, async {
            loop {
                match self.0.next().await? {
                    Ok(Message::Text(text)) => {
                        let json: Value = serde_json::from_str(&text).unwrap();
                        if json["type"] != "heartbeat" {
                            return Some(json);
                        }
                    }
                    Ok(Message::Close(_)) | Err(_) => return None,
                    Ok(_) => {}
                }
            }
        })
        .await
        .expect("a message within the time allowed")
    }

    async fn until(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let message = self.next().await.expect("the stream goes on");
            if wanted(&message) {
                return message;
            }
        }
    }
}

#[tokio::test]
async fn a_snapshot_first_then_what_changes() {
    let gateway = gateway().await;
    {
        let mut fleet = gateway.app.store.write();
        fleet.vehicle(vehicle("leader-1", 0.5), at(0.0));
        fleet.sea_state(sea_state("leader-1", 0.5, 5.0), at(0.0));
        fleet.mission(mission("m-1", MissionPhase::Assessing, 0.0), at(0.0));
        fleet.event(event("one", Severity::Info, None));
    }
    let mut client = Client::connect(&gateway).await;
    let hello = client.next().await.unwrap();
    assert_eq!((&hello["type"], &hello["data"]["fleet"]), (&"hello".into(), &"test".into()));
    let mut kinds = Vec::new();
    for _ in 0..4 {
        kinds.push(client.next().await.unwrap()["type"].as_str().unwrap().to_owned());
    }
    kinds.sort();
    assert_eq!(kinds, ["event", "mission", "sea_state", "vehicle"]);

    gateway.app.store.write().mission(mission("m-1", MissionPhase::AwaitingApproval, 1.0), at(1.0));
    // What the snapshot held may come once more, never an older value.
    let changed = client.until(|message| message["type"] == "mission").await;
    assert_eq!(changed["data"]["phase"], "awaiting_approval");
}

#[tokio::test]
async fn a_fast_vehicle_is_thinned_to_its_newest_state() {
    let gateway = gateway().await;
    let mut client = Client::connect(&gateway).await;
    client.until(|message| message["type"] == "hello").await;
    {
        // One lock over all, so that no flush comes between.
        let mut fleet = gateway.app.store.write();
        for step in 0..500 {
            fleet.vehicle(vehicle("leader-1", 1.0 - f64::from(step) * 0.001), at(0.0));
        }
    }
    gateway.app.store.write().event(event("end", Severity::Info, None));
    let mut ages = Vec::new();
    loop {
        let message = client.next().await.unwrap();
        match message["type"].as_str().unwrap() {
            "vehicle" => ages.push(message["data"]["age_s"].as_f64().unwrap()),
            "event" => break,
            _ => {}
        }
    }
    assert_eq!(ages.len(), 1, "{ages:?}");
    assert!((ages[0] - 0.501).abs() < 1e-6, "the newest: {ages:?}");
}

#[tokio::test]
async fn a_client_that_falls_behind_starts_anew_and_delays_nobody() {
    let gateway = gateway().await;
    // Reads nothing for now.
    let mut slow = Client::connect(&gateway).await;
    slow.until(|message| message["type"] == "hello").await;
    // Far more than sockets and batches hold: the flushes must not wait for it.
    let long = "x".repeat(60_000);
    let flood = async {
        for number in 0..600 {
            gateway.app.store.write().event(event(&format!("{number} {long}"), Severity::Info, None));
            feed::flush(&gateway.app);
            tokio::task::yield_now().await;
        }
    };
    tokio::time::timeout(LONG, flood).await.expect("a slow client holds nobody up");
    gateway.app.store.write().vehicle(vehicle("leader-1", 0.5), at(0.0));
    // It is sent a new snapshot, which ends with the newest events; or it was dropped, and may come again.
    let mut last = None;
    let hello_again = loop {
        match slow.next().await {
            None => break false,
            Some(message) if message["type"] == "hello" => break true,
            Some(message) => last = message["data"]["sequence"].as_u64().or(last),
        }
    };
    assert!(last.is_none_or(|last| last < 600), "it missed something: {last:?}");
    if hello_again {
        let newest = slow.until(|message| message["data"]["sequence"] == 600).await;
        assert_eq!(newest["type"], "event");
    }
}

#[tokio::test]
async fn what_goes_stale_or_lapses_is_told_without_a_message_from_its_source() {
    let gateway = gateway().await;
    gateway.app.store.write().vehicle(vehicle("leader-1", 0.5), at(0.0));
    gateway.app.store.write().sea_state(sea_state("leader-1", 0.5, 5.0), at(0.0));
    let mut client = Client::connect(&gateway).await;
    assert_eq!(client.until(|message| message["type"] == "vehicle").await["data"]["stale"], false);
    assert_eq!(client.until(|message| message["type"] == "sea_state").await["data"]["verdict"]["expired"], false);
    gateway.set_clock(1.4);
    gateway.app.store.write().event(event("mark", Severity::Info, None));
    let mark = client.until(|message| message["type"] != "sea_state" && message["data"]["stale"] != false).await;
    assert_eq!(mark["type"], "event", "1.9 s old is not stale yet");
    gateway.set_clock(10.0);
    client.until(|message| message["type"] == "vehicle" && message["data"]["stale"] == true).await;
    client.until(|message| message["type"] == "sea_state" && message["data"]["verdict"]["expired"] == true).await;
}

#[tokio::test]
async fn server_sent_events_tell_the_same() {
    let gateway = gateway().await;
    gateway.app.store.write().vehicle(vehicle("leader-1", 0.5), at(0.0));
    let response = gateway.client.get(gateway.url("/api/v1/events/stream")).send().await.unwrap();
    assert_eq!(response.headers()["content-type"], "text/event-stream");
    let mut text = String::new();
    let mut chunks = response.bytes_stream();
    let read = async {
        while !(text.contains("\"type\":\"hello\"") && text.contains("\"type\":\"vehicle\"") && text.contains("\"heartbeat\""))
        {
            text.push_str(std::str::from_utf8(&chunks.next().await.unwrap().unwrap()).unwrap());
        }
    };
    tokio::time::timeout(LONG, read).await.unwrap();
    assert!(text.starts_with("data: {"), "{text}");
}

#[tokio::test]
async fn streams_are_bounded_and_free_their_place() {
    let config = Config { streams_max: 1, ..Config::default() };
    let gateway = gateway_with(config, Played::default()).await;
    let first = Client::connect(&gateway).await;
    let answer = gateway.get("/api/v1/events/stream").await;
    answer.is_problem(503, "streams_max");
    drop(first);
    tokio::time::timeout(LONG, async {
        while gateway.client.get(gateway.url("/api/v1/events/stream")).send().await.unwrap().status() != 200 {
            tokio::task::yield_now().await;
        }
    })
    .await
    .expect("the place is free again");
}

#[tokio::test]
async fn another_page_cannot_listen() {
    let gateway = gateway().await;
    let mut request = format!("ws://{}/api/v1/stream", gateway.address).into_client_request().unwrap();
    request.headers_mut().insert("origin", "http://evil.example".parse().unwrap());
    let refused = tokio_tungstenite::connect_async(request).await;
    assert!(matches!(refused, Err(tokio_tungstenite::tungstenite::Error::Http(response)) if response.status() == 403));
}

#[tokio::test]
async fn stopping_ends_streams_and_the_server_at_once() {
    let mut gateway = gateway().await;
    let mut client = Client::connect(&gateway).await;
    let sent = gateway.client.get(gateway.url("/api/v1/events/stream")).send().await.unwrap();
    client.until(|message| message["type"] == "hello").await;
    gateway.stop.cancel();
    let server = std::mem::replace(&mut gateway.server, tokio::spawn(async { Ok(()) }));
    tokio::time::timeout(LONG, async {
        while client.next().await.is_some() {}
        sent.text().await.unwrap();
        server.await.unwrap().unwrap();
    })
    .await
    .expect("all of it ends");
}
