//! The shell around simulated vehicles: a MAVLink server each, stepped by the fleet's clock.
//!
//! **Reads:** MAVLink from any number of clients. **Writes:** MAVLink to them, `sim/{vehicle}/truth` on the bus, 50 a second of fleet
//! time. A client is anything that speaks MAVLink 1 or 2 over TCP; with `udp_out` a vehicle also speaks to one address over UDP.
//!
//! **Invariant:** no client can hurt a vehicle or another client. What it sends waits in its own short queue, and TCP makes it wait
//! there; what it does not read fills its own queue, and then it is dropped; what is not MAVLink is skipped, and after 64 KiB of
//! nothing else it is dropped.
//!
//! A restart puts the vehicles back on the jetty: the simulation has no memory.

mod client;
mod server;
#[cfg(test)]
mod tests;

use std::net::SocketAddr;
use std::sync::Arc;

use anyhow::Context as _;
use halcyon_chassis::Context;
use halcyon_model::VehicleId;
use halcyon_sim::SimConfig;
use halcyon_sim::water::Water;
use tokio::net::TcpListener;
use tokio::task::JoinSet;

/// `[sim]`, as the settings know it.
pub use halcyon_capture::SimSection as Config;

/// The vehicles' open ports. Cheap to clone: clones are the same ports, so that a restarted simulator keeps them.
#[derive(Debug, Clone)]
pub struct Listeners {
    vehicles: Vec<(VehicleId, Arc<TcpListener>, SocketAddr)>,
}

impl Listeners {
    /// Who listens where, in the configuration's order.
    pub fn addresses(&self) -> impl Iterator<Item = (&VehicleId, SocketAddr)> {
        self.vehicles.iter().map(|(id, _, address)| (id, *address))
    }

    /// Where one vehicle listens.
    #[must_use]
    pub fn address(&self, vehicle: &VehicleId) -> Option<SocketAddr> {
        self.addresses().find(|(id, _)| *id == vehicle).map(|(_, address)| address)
    }
}

/// Opens every vehicle's port, so that the addresses are known before anything connects.
///
/// # Errors
/// When a port is taken or the address is not this host's: one line that names the vehicle and the address.
pub async fn bind(config: &SimConfig) -> anyhow::Result<Listeners> {
    let mut vehicles = Vec::with_capacity(config.vehicles.len());
    for vehicle in &config.vehicles {
        let wanted = SocketAddr::new(config.bind, vehicle.mavlink_port);
        let listener = TcpListener::bind(wanted)
            .await
            .with_context(|| format!("simulated vehicle {} cannot listen on {wanted}; set its mavlink_port", vehicle.id))?;
        let address = listener.local_addr().with_context(|| format!("simulated vehicle {} has no address", vehicle.id))?;
        vehicles.push((vehicle.id.clone(), Arc::new(listener), address));
    }
    Ok(Listeners { vehicles })
}

/// Simulates every configured vehicle until stopped.
///
/// # Errors
/// When a port cannot be opened, the sea cannot be, or a vehicle's task fails.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let listeners = bind(&config.0).await?;
    run_with(context, listeners, config.0).await
}

/// The same on ports that are already open.
///
/// # Errors
/// When the sea cannot be, or a vehicle's task fails.
pub async fn run_with(context: Context, listeners: Listeners, config: SimConfig) -> anyhow::Result<()> {
    let water = Arc::new(Water::new(&config.sea, config.seed).context("the simulated sea cannot be")?);
    let config = Arc::new(config);
    let mut tasks = JoinSet::new();
    for (index, (id, listener, address)) in listeners.vehicles.iter().enumerate() {
        tracing::info!(vehicle = %id, %address, "simulated vehicle speaks MAVLink");
        let server = server::Server::new(context.clone(), &config, index, Arc::clone(listener), Arc::clone(&water)).await?;
        tasks.spawn(server.run());
    }
    context.health.ready(format!("{} simulated vehicles", listeners.vehicles.len()));
    if tasks.is_empty() {
        context.stop.cancelled().await;
    }
    // A vehicle ends only when all stop; one that fails takes the simulator with it, which is then restarted whole.
    while let Some(ended) = tasks.join_next().await {
        ended.context("a simulated vehicle's task died")??;
    }
    Ok(())
}
