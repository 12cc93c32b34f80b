//! `halcyon vehicle`: a client of the REST API.

mod command;
mod items;
mod param_file;
mod parameters;
mod plan;
mod waypoints;

use std::process::ExitCode;
use std::time::Duration;

use halcyon_chassis::{ConfigError, process};
use reqwest::Method;
use serde_json::{Value, json};

use super::client::{Client, Gateway, text};
use super::output;

/// Look at, command and set up the vehicles of a running fleet
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon vehicle parameters set follower-1 WPNAV_SPEED 450 && halcyon vehicle mission upload \
    follower-1 survey.plan")]
pub(super) struct Args {
    #[command(flatten)]
    gateway: Gateway,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// List the vehicles
    #[command(after_help = "Example: halcyon vehicle list --json")]
    List,
    /// Show one vehicle
    #[command(after_help = "Example: halcyon vehicle show follower-1")]
    Show {
        /// Its id
        id: String,
    },
    /// Command a vehicle: arm, take off, go to, follow, hold, land, return …
    #[command(after_help = "Example: halcyon vehicle command follower-1 go-to --north 30 --east 12 --height 6")]
    #[command(name = "command")]
    Tell {
        /// Its id
        id: String,
        #[command(subcommand)]
        action: command::Action,
    },
    /// Read, set, save and load the autopilot's parameters
    #[command(after_help = "Example: halcyon vehicle parameters load follower-1 tuned.param --dry-run")]
    Parameters {
        #[command(subcommand)]
        action: parameters::Action,
    },
    /// The mission that the autopilot keeps
    #[command(after_help = "Example: halcyon vehicle mission upload follower-1 survey.plan")]
    Mission {
        #[command(subcommand)]
        action: items::Action,
    },
    /// The fence that the autopilot keeps
    #[command(after_help = "Example: halcyon vehicle fence upload follower-1 site.plan")]
    Fence {
        #[command(subcommand)]
        action: items::Action,
    },
    /// The rally points that the autopilot keeps
    #[command(after_help = "Example: halcyon vehicle rally show follower-1")]
    Rally {
        #[command(subcommand)]
        action: items::Action,
    },
    /// Let the payload go; on the ground or the water only
    #[command(after_help = "Example: halcyon vehicle release follower-1")]
    Release {
        /// Its id
        id: String,
    },
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    // All parameters over a slow radio take half a minute, and the gateway gives up before this.
    let (client, json) = args.gateway.open(Duration::from_secs(120))?;
    process::runtime()?.block_on(carry_out(&client, args.command, json))
}

async fn carry_out(client: &Client, command: Command, json: bool) -> anyhow::Result<ExitCode> {
    use halcyon_model::ItemKind;
    match command {
        Command::List => list(client, json).await,
        Command::Show { id } => {
            let vehicle = client.send(Method::GET, &path(&id, "")?, None).await?;
            if json {
                output::json(&vehicle)?;
            } else {
                show(&vehicle)?;
            }
            Ok(ExitCode::SUCCESS)
        }
        Command::Tell { id, action } => told(client, &id, action.body(), json).await,
        Command::Release { id } => told(client, &id, json!({ "action": "release_payload" }), json).await,
        Command::Parameters { action } => parameters::run(client, action, json).await,
        Command::Mission { action } => items::run(client, ItemKind::Mission, action, json).await,
        Command::Fence { action } => items::run(client, ItemKind::Fence, action, json).await,
        Command::Rally { action } => items::run(client, ItemKind::Rally, action, json).await,
    }
}

/// `vehicles/{id}[/what]`, for an id that is one.
fn path(id: &str, what: &str) -> anyhow::Result<String> {
    let id = halcyon_model::VehicleId::new(id).map_err(|error| ConfigError::new(error.to_string()))?;
    Ok(if what.is_empty() { format!("vehicles/{id}") } else { format!("vehicles/{id}/{what}") })
}

async fn told(client: &Client, id: &str, body: Value, json: bool) -> anyhow::Result<ExitCode> {
    let answer = client.send(Method::POST, &path(id, "commands")?, Some(body)).await?;
    if json {
        output::json(&answer)?;
    } else {
        output::line(&format!("{id}: {}", text(&answer, "reason")))?;
    }
    Ok(ExitCode::SUCCESS)
}

async fn list(client: &Client, json: bool) -> anyhow::Result<ExitCode> {
    let page = client.send(Method::GET, "vehicles?limit=100", None).await?;
    if json {
        output::json(&page)?;
    } else {
        for vehicle in page["items"].as_array().into_iter().flatten() {
            output::line(&summary(vehicle))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A number in `unit`, or a dash.
fn number(value: &Value, decimals: usize, unit: &str) -> String {
    value.as_f64().map_or_else(|| "-".into(), |value| format!("{value:.decimals$}{unit}"))
}

fn summary(vehicle: &Value) -> String {
    format!(
        "{}  {:<8} {:<10} {:<8} {:<13} {} above the water  battery {}{}",
        text(vehicle, "id"),
        text(vehicle, "role"),
        text(vehicle, "mode"),
        if vehicle["armed"] == true { "armed" } else { "disarmed" },
        text(&vehicle["activity"], "kind"),
        number(&vehicle["local"]["height_m"], 1, " m"),
        number(&vehicle["battery_percent"], 0, " %"),
        if vehicle["stale"] == true { "  silent" } else { "" },
    )
}

fn show(vehicle: &Value) -> anyhow::Result<()> {
    output::line(&summary(vehicle))?;
    let (local, link, firmware) = (&vehicle["local"], &vehicle["link"], &vehicle["firmware"]);
    let rows = [
        ("position", format!("{} north, {} east", number(&local["north_m"], 1, " m"), number(&local["east_m"], 1, " m"))),
        ("heading", number(&vehicle["heading_deg"], 0, "°")),
        ("rangefinder", number(&vehicle["range_m"], 2, " m")),
        ("GNSS", format!("{} with {} satellites", text(&vehicle["fix"], "kind"), number(&vehicle["fix"]["satellites"], 0, ""))),
        ("firmware", format!("{} {} ({})", text(firmware, "autopilot"), text(firmware, "version"), text(firmware, "vehicle"))),
        (
            "link",
            format!(
                "{} lost, {} there and back{}",
                number(&link["loss_percent"], 1, " %"),
                number(&link["round_trip_ms"], 0, " ms"),
                if link["signed"] == true { ", signed" } else { "" }
            ),
        ),
        ("ready to arm", if vehicle["ready_to_arm"] == true { "yes" } else { "no" }.into()),
    ];
    let why = vehicle["activity"]["reason"].as_str().map(|reason| ("why", reason.to_owned()));
    for (name, value) in why.into_iter().chain(rows) {
        output::line(&format!("  {name:<13} {value}"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_of_which_little_is_known_can_be_shown() {
        let line = summary(&json!({ "id": "f-1", "mode": "GUIDED", "armed": true, "local": { "height_m": 5.04 } }));
        assert!(line.contains("f-1") && line.contains("5.0 m") && line.contains("battery -"), "{line}");
        assert!(show(&json!({})).is_ok());
        assert!(path("a/b", "").is_err());
    }
}
