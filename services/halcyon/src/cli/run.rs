//! `halcyon run`

use std::process::ExitCode;

use halcyon_chassis::config::FleetConfig;
use halcyon_chassis::{ConfigError, Options, Process, process};

use super::output;
use crate::fleet::{SERVICES, spawn_service};

/// Run one service, or several in one process, from the configuration
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon run vehicle-link,capture,reconstruction,wave-assessment --config leader.toml")]
pub(super) struct Args {
    /// Services, separated by commas; --list shows them
    #[arg(required_unless_present = "list", value_delimiter = ',', value_name = "SERVICE")]
    services: Vec<String>,
    /// List the services
    #[arg(long)]
    list: bool,
}

pub(super) fn run(options: &Options, args: &Args) -> anyhow::Result<ExitCode> {
    if args.list {
        for (name, what) in SERVICES {
            output::line(&format!("{name:<16} {what}"))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    for (index, service) in args.services.iter().enumerate() {
        if !SERVICES.iter().any(|(name, _)| name == service) {
            let names: Vec<_> = SERVICES.iter().map(|(name, _)| *name).collect();
            return Err(ConfigError::new(format!("there is no service {service:?}; known are {}", names.join(", "))).into());
        }
        if args.services[..index].contains(service) {
            return Err(ConfigError::new(format!("service {service} is named twice")).into());
        }
    }
    let settings = options.settings()?;
    let fleet: FleetConfig = settings.section()?;
    process::runtime()?.block_on(async {
        let mut process = Process::start(&settings).await?;
        for service in &args.services {
            spawn_service(&mut process, &settings, service, &fleet.host).await?;
        }
        process.wait().await;
        Ok(ExitCode::SUCCESS)
    })
}
