//! The async shell: keeps the store up to date from the bus, and serves HTTP.

use std::net::TcpListener;
use std::sync::Arc;

use anyhow::Context as _;
use halcyon_chassis::{Context, topics};

use crate::app::{App, Parts, Store};
use crate::bus::{BusCommands, BusPreviews};
use crate::config::Config;
use crate::core::fleet::Fleet;
use crate::{api, feed, server};

/// Takes the configured address. Whoever needs to know the port before [`run_with`] (port 0), or wants to keep it over restarts
/// (`try_clone`), calls this first.
///
/// # Errors
/// When the address cannot be had; the message names the key to change.
pub fn bind(config: &Config) -> anyhow::Result<TcpListener> {
    let listen =
        || format!("[gateway] listen = \"{}\" cannot be had; is another gateway running? Choose another port", config.listen);
    let listener = TcpListener::bind(config.listen).with_context(listen)?;
    listener.set_nonblocking(true).with_context(listen)?;
    Ok(listener)
}

/// Runs the gateway until `context.stop`.
///
/// # Errors
/// When the address cannot be had, or the bus or the listener fails.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let listener = bind(&config)?;
    run_with(context, config, listener).await
}

/// The same on a listener that is open already and does not block.
///
/// # Errors
/// When the bus or the listener fails.
pub async fn run_with(context: Context, config: Config, listener: TcpListener) -> anyhow::Result<()> {
    let listener = tokio::net::TcpListener::from_std(listener).context("the listener cannot be used")?;
    let address = listener.local_addr().context("the listener has no address")?;
    // Ends every stream of this run however it ends, so that none outlives its feed.
    let stop = context.stop.child_token();
    let _stop_on_return = stop.clone().drop_guard();

    let store = Arc::new(Store::new(Fleet::new(context.origin, config.limits())));
    let clock = context.clock.clone();
    let app = App::new(
        Parts {
            fleet: context.fleet.clone(),
            origin: context.origin,
            now: Box::new(move || clock.now()),
            speed: context.clock.speed(),
            commands: Box::new(BusCommands::new(context.bus.clone())),
            previews: Box::new(BusPreviews::new(context.bus.clone(), context.clock.clone(), Arc::clone(&store), stop.clone())),
            metrics: halcyon_chassis::telemetry::prometheus_text,
            stop: stop.clone(),
            loopback: address.ip().is_loopback(),
            config: config.clone(),
        },
        Arc::clone(&store),
    );

    // Subscribed before the first request is answered.
    let bus = &context.bus;
    let mut vehicles = bus.subscribe(&topics::vehicle_states()).await?;
    let mut sea_states = bus.subscribe(&topics::sea_states()).await?;
    let mut surfaces = bus.subscribe(&topics::surfaces()).await?;
    let mut missions = bus.subscribe(&topics::missions()).await?;
    let mut plans = bus.subscribe(&topics::plan()).await?;
    let mut healths = bus.subscribe(&topics::healths()).await?;
    let mut events = bus.subscribe(&topics::event()).await?;
    let mut presence = bus.presence().await?;
    context.health.ready(format!("http://{address}"));
    tracing::info!("dashboard and REST API at http://{address}");

    let read = async {
        loop {
            // Each inbox is bounded; what overflows there is counted by the bus. Nothing below takes longer than a moment.
            tokio::select! {
                state = vehicles.recv() => store.write().vehicle(state?, context.clock.now()),
                sea = sea_states.recv() => store.write().sea_state(sea?, context.clock.now()),
                patch = surfaces.recv() => store.write().surface(patch?, context.clock.now()),
                mission = missions.recv() => store.write().mission(mission?, context.clock.now()),
                plan = plans.recv() => store.write().dispatch_plan(plan?, context.clock.now()),
                health = healths.recv() => store.write().health(health?, context.clock.now()),
                event = events.recv() => store.write().event(event?),
                change = presence.recv() => {
                    let change = change?;
                    store.write().presence(change.instance, change.alive);
                }
            }
        }
    };
    tokio::select! {
        failed = read => failed,
        () = feed::run(app.clone()) => Ok(()),
        served = server::serve(listener, api::router(app.clone()), &config, stop) => served.context("the HTTP server failed"),
    }
}
