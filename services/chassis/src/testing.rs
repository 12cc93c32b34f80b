//! For tests of actors: a context on a private session that nobody else can reach.

use halcyon_model::{FleetId, FleetOrigin, Geodetic, InstanceId};
use tokio_util::sync::CancellationToken;

use crate::bus::Bus;
use crate::clock::{Clock, ClockConfig};
use crate::context::Context;
use crate::health::HealthHandle;
use crate::session::BusConfig;
use crate::topics;

/// A context at real speed. Use `#[tokio::test(flavor = "multi_thread")]`: Zenoh needs more than one thread.
///
/// # Panics
/// If no session can be opened.
#[allow(clippy::expect_used, reason = "a test cannot go on without its bus")]
pub async fn context(instance: &str) -> Context {
    context_at_speed(instance, 1.0).await
}

/// The same, with fleet time `speed` times as fast as the wall's.
///
/// # Panics
/// If no session can be opened.
#[allow(clippy::expect_used, reason = "a test cannot go on without its bus")]
pub async fn context_at_speed(instance: &str, speed: f64) -> Context {
    let clock = Clock::new(&ClockConfig { speed, epoch_s: 0.0 });
    let config = BusConfig::default().zenoh().expect("the default bus configuration is valid");
    let session = zenoh::open(config).await.expect("a private session opens");
    let fleet = FleetId::new("test").expect("a valid identifier");
    let bus = Bus::new(session, fleet.clone(), clock.clone());
    let events = bus.publisher(&topics::event()).await.expect("events can be published");
    Context {
        fleet,
        instance: InstanceId::new(instance).expect("a valid identifier"),
        origin: FleetOrigin(Geodetic::from_deg(53.117_274, -2.905_347, 0.0)),
        bus,
        clock,
        stop: CancellationToken::new(),
        health: HealthHandle::new(),
        events: std::sync::Arc::new(events),
    }
}
