//! Puts services together into a process: one host's, or the whole simulated fleet.

use std::sync::Arc;

use anyhow::Context as _;
use halcyon_chassis::{Process, Section, Settings};
use halcyon_model::Role;
use halcyon_sim::SimConfig;

use crate::simulator;

/// The services that `halcyon run` knows, and what each is.
pub const SERVICES: [(&str, &str); 9] = [
    ("mesh", "nothing but the host's bus router, for the other processes to attach to"),
    ("sim", "simulated vehicles that speak MAVLink"),
    ("capture", "stereo pairs from cameras, folders or simulated water"),
    ("reconstruction", "pairs to surface patches"),
    ("wave-assessment", "patches to sea states and verdicts"),
    ("mission-planner", "missions and dispatch plans"),
    ("vehicle-link", "one autopilot: state, guidance, fail-safes"),
    ("recorder", "everything on the bus to a file"),
    ("gateway", "REST, live stream and dashboard"),
];

/// Starts `service` as configured on `host`.
///
/// # Errors
/// If the service is unknown, its configuration is invalid, or the bus refuses.
pub async fn spawn_service(process: &mut Process, settings: &Settings, service: &str, host: &str) -> anyhow::Result<()> {
    match service {
        "mesh" => Ok(()),
        "sim" => spawn(process, settings, host, simulator::run).await,
        "capture" => spawn(process, settings, host, halcyon_capture::run).await,
        "reconstruction" => spawn(process, settings, host, halcyon_reconstruction::run).await,
        "wave-assessment" => spawn(process, settings, host, halcyon_wave_assessment::run).await,
        "mission-planner" => spawn(process, settings, host, halcyon_mission_planner::run).await,
        "vehicle-link" => spawn(process, settings, host, halcyon_vehicle_link::run).await,
        "recorder" => spawn(process, settings, host, halcyon_recorder::run).await,
        "gateway" => spawn_gateway(process, halcyon_gateway::Config::resolve(settings)?, host).await.map(drop),
        other => anyhow::bail!("there is no service {other:?}"),
    }
}

async fn spawn<C, F, Fut>(process: &mut Process, settings: &Settings, host: &str, run: F) -> anyhow::Result<()>
where
    C: Section + Sync,
    F: Fn(halcyon_chassis::Context, C) -> Fut + Send + 'static,
    Fut: Future<Output = anyhow::Result<()>> + Send + 'static,
{
    process.spawn(host, C::resolve(settings)?, run).await
}

/// Takes the port before anything starts, so that a taken one is an error at once, and keeps it over restarts.
async fn spawn_gateway(
    process: &mut Process,
    config: halcyon_gateway::Config,
    host: &str,
) -> anyhow::Result<std::net::SocketAddr> {
    let listener = halcyon_gateway::bind(&config)?;
    let address = listener.local_addr().context("the gateway's port")?;
    let listener = Arc::new(listener);
    let run = move |context, config| {
        let listener = listener.try_clone();
        async move { halcyon_gateway::run_with(context, config, listener.context("the gateway's port is lost")?).await }
    };
    process.spawn(host, config, run).await?;
    Ok(address)
}

/// Starts the whole simulated fleet: the simulator, every vehicle's on-board services, and the ground's.
///
/// Returns the dashboard's address.
///
/// # Errors
/// If a port is taken, a configuration is invalid, or the bus refuses.
pub async fn spawn_fleet(process: &mut Process, settings: &Settings, sim: &SimConfig) -> anyhow::Result<std::net::SocketAddr> {
    let listeners = simulator::bind(sim).await?;
    // People look at the dashboard first: it is the first to be there.
    let address = spawn_gateway(process, halcyon_gateway::Config::resolve(settings)?, "ground").await?;
    let planner = halcyon_mission_planner::Config::resolve(settings)?;
    process.spawn("ground", planner, halcyon_mission_planner::run).await?;

    let ports = listeners.clone();
    let run = move |context, config: simulator::Config| simulator::run_with(context, ports.clone(), config.0);
    process.spawn("world", simulator::Config(sim.clone()), run).await?;
    for vehicle in &sim.vehicles {
        let host = vehicle.id.as_str();
        let endpoint = listeners.address(&vehicle.id).context("every simulated vehicle has a port")?;
        let link = halcyon_vehicle_link::Config {
            vehicle: host.into(),
            role: if vehicle.role == Role::Leader { "leader" } else { "follower" }.into(),
            endpoint: format!("tcpout:{endpoint}"),
            ..halcyon_vehicle_link::Config::resolve(settings)?
        };
        process.spawn(host, link, halcyon_vehicle_link::run).await?;
        if vehicle.role == Role::Leader {
            spawn_cameras(process, settings, sim, host).await?;
        }
    }
    Ok(address)
}

/// A leader's measuring services; its rig has the vehicle's name.
async fn spawn_cameras(process: &mut Process, settings: &Settings, sim: &SimConfig, host: &str) -> anyhow::Result<()> {
    let capture = halcyon_capture::Config {
        rig: host.into(),
        vehicle: host.into(),
        sim: sim.clone(),
        ..halcyon_capture::Config::resolve(settings)?
    };
    process.spawn(host, capture, halcyon_capture::run).await?;
    let reconstruction =
        halcyon_reconstruction::Config { rig: host.into(), ..halcyon_reconstruction::Config::resolve(settings)? };
    process.spawn(host, reconstruction, halcyon_reconstruction::run).await?;
    let assessment =
        halcyon_wave_assessment::Config { rig: host.into(), ..halcyon_wave_assessment::Config::resolve(settings)? };
    process.spawn(host, assessment, halcyon_wave_assessment::run).await
}
