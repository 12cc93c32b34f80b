//! `halcyon config`

use std::process::ExitCode;

use halcyon_chassis::clock::ClockConfig;
use halcyon_chassis::config::{FleetConfig, Setting};
use halcyon_chassis::{BusConfig, LogConfig, Options};

use super::output;

/// Print the effective configuration, and where each value came from
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon config --config leader.toml --set capture.rate_hz=10")]
pub(super) struct Args {
    /// Only this section, such as capture
    section: Option<String>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(options: &Options, args: &Args) -> anyhow::Result<ExitCode> {
    let settings = options.settings()?;
    let sections: [(&str, Vec<Setting>); 12] = [
        ("fleet", settings.describe::<FleetConfig>()?),
        ("bus", settings.describe::<BusConfig>()?),
        ("clock", settings.describe::<ClockConfig>()?),
        ("log", settings.describe::<LogConfig>()?),
        ("sim", settings.describe::<crate::simulator::Config>()?),
        ("capture", settings.describe::<halcyon_capture::Config>()?),
        ("reconstruction", settings.describe::<halcyon_reconstruction::Config>()?),
        ("wave_assessment", settings.describe::<halcyon_wave_assessment::Config>()?),
        ("mission_planner", settings.describe::<halcyon_mission_planner::Config>()?),
        ("vehicle_link", settings.describe::<halcyon_vehicle_link::Config>()?),
        ("recorder", settings.describe::<halcyon_recorder::Config>()?),
        ("gateway", settings.describe::<halcyon_gateway::Config>()?),
    ];
    if let Some(wanted) = &args.section
        && !sections.iter().any(|(name, _)| name == wanted)
    {
        let known = sections.map(|(name, _)| name).join(", ");
        return Err(halcyon_chassis::ConfigError::new(format!("there is no section {wanted:?}; known are {known}")).into());
    }
    let chosen: Vec<Setting> = sections
        .into_iter()
        .filter(|(name, _)| args.section.as_deref().is_none_or(|wanted| wanted == *name))
        .flat_map(|(_, settings)| settings)
        .collect();
    if args.json {
        output::json(&serde_json::json!({ "settings": chosen }))?;
        return Ok(ExitCode::SUCCESS);
    }
    for setting in chosen {
        output::line(&format!("{} = {}  # {}", setting.key, setting.value, setting.source))?;
    }
    Ok(ExitCode::SUCCESS)
}
