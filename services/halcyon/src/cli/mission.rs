//! `halcyon mission`: a client of the REST API.

use std::process::ExitCode;
use std::time::Duration;

use halcyon_chassis::{ConfigError, process};
use reqwest::Method;
use serde_json::{Value, json};

use super::client::{Client, Gateway, PATIENCE, text};
use super::output;

/// Create, watch and command missions of a running fleet
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon mission create --north 30 --east 12 && halcyon mission list")]
pub(super) struct Args {
    #[command(flatten)]
    gateway: Gateway,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Create a mission: survey a point, assess, land a follower there
    Create {
        /// Metres north of the fleet's origin
        #[arg(long, allow_negative_numbers = true, requires = "east", required_unless_present = "latitude")]
        north: Option<f64>,
        /// Metres east of the fleet's origin
        #[arg(long, allow_negative_numbers = true, requires = "north")]
        east: Option<f64>,
        /// Latitude, degrees
        #[arg(long, allow_negative_numbers = true, requires = "longitude", conflicts_with = "north")]
        latitude: Option<f64>,
        /// Longitude, degrees
        #[arg(long, allow_negative_numbers = true, requires = "latitude", conflicts_with = "east")]
        longitude: Option<f64>,
        /// Name, for people
        #[arg(long)]
        name: Option<String>,
        /// Height of the survey above the water, metres
        #[arg(long)]
        height: Option<f64>,
        /// Let a safe verdict alone send the follower
        #[arg(long)]
        auto_approve: bool,
    },
    /// List missions
    List,
    /// Show one mission
    Show {
        /// Its id
        id: String,
    },
    /// Say that the follower may go
    Approve {
        /// Its id
        id: String,
    },
    /// Send the follower now
    Dispatch {
        /// Its id
        id: String,
    },
    /// Have everyone hold
    Pause {
        /// Its id
        id: String,
    },
    /// Go on after a pause
    Resume {
        /// Its id
        id: String,
    },
    /// Call everyone home
    Abort {
        /// Its id
        id: String,
    },
    /// Try once more to let the payload go
    Release {
        /// Its id
        id: String,
    },
    /// Complete the mission with the payload still held
    SkipRelease {
        /// Its id
        id: String,
    },
    /// Follow a mission until it ends; exit code 0 if it completed
    Watch {
        /// Its id
        id: String,
    },
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (client, json) = args.gateway.open(PATIENCE)?;
    process::runtime()?.block_on(command(&client, args.command, json))
}

async fn command(client: &Client, command: Command, json: bool) -> anyhow::Result<ExitCode> {
    let (verb, id) = match command {
        Command::Create { north, east, latitude, longitude, name, height, auto_approve } => {
            let point = match (latitude, longitude) {
                (Some(latitude), Some(longitude)) => json!({ "latitude_deg": latitude, "longitude_deg": longitude }),
                _ => json!({ "north_m": north, "east_m": east }),
            };
            let mut body = json!({ "point": point, "approval": if auto_approve { "automatic" } else { "manual" } });
            if let Some(name) = name {
                body["name"] = name.into();
            }
            if let Some(height) = height {
                body["survey_height_m"] = height.into();
            }
            let answer = client.send(Method::POST, "missions", Some(body)).await?;
            if json {
                output::json(&answer)?;
            } else {
                output::line(&format!("{}: {}", text(&answer, "mission"), text(&answer, "reason")))?;
            }
            return Ok(ExitCode::SUCCESS);
        }
        Command::List => {
            let page = client.send(Method::GET, "missions?limit=100", None).await?;
            if json {
                output::json(&page)?;
                return Ok(ExitCode::SUCCESS);
            }
            for mission in page["items"].as_array().into_iter().flatten() {
                output::line(&summary(mission))?;
            }
            return Ok(ExitCode::SUCCESS);
        }
        Command::Show { id } => return show(&client.send(Method::GET, &path(&id, "")?, None).await?, json),
        Command::Watch { id } => return watch(client, &id, json).await,
        Command::Approve { id } => ("approve", id),
        Command::Dispatch { id } => ("dispatch", id),
        Command::Pause { id } => ("pause", id),
        Command::Resume { id } => ("resume", id),
        Command::Abort { id } => ("abort", id),
        Command::Release { id } => ("release", id),
        Command::SkipRelease { id } => ("skip-release", id),
    };
    let answer = client.send(Method::POST, &path(&id, verb)?, None).await?;
    if json {
        output::json(&answer)?;
    } else {
        output::line(&format!("{id}: {verb} accepted"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// `missions/{id}[/verb]`, for an id that is one.
fn path(id: &str, verb: &str) -> anyhow::Result<String> {
    let id = halcyon_model::MissionId::new(id).map_err(|error| ConfigError::new(error.to_string()))?;
    Ok(if verb.is_empty() { format!("missions/{id}") } else { format!("missions/{id}/{verb}") })
}

fn summary(mission: &Value) -> String {
    let why =
        mission["history"].as_array().and_then(|history| history.last()).map_or("", |last| last["why"].as_str().unwrap_or(""));
    format!(
        "{}  {:<17} leader {}  follower {}  verdict {}  {}",
        text(mission, "id"),
        text(mission, "phase"),
        text(mission, "leader"),
        text(mission, "follower"),
        text(mission, "verdict"),
        why
    )
}

fn show(mission: &Value, json: bool) -> anyhow::Result<ExitCode> {
    if json {
        output::json(mission)?;
        return Ok(ExitCode::SUCCESS);
    }
    output::line(&summary(mission))?;
    for step in mission["history"].as_array().into_iter().flatten() {
        output::line(&format!(
            "  {}  {:<17} {}: {}",
            text(step, "stamp"),
            text(step, "phase"),
            text(step, "who"),
            text(step, "why")
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

async fn watch(client: &Client, id: &str, json: bool) -> anyhow::Result<ExitCode> {
    let path = path(id, "")?;
    let mut known = 0;
    loop {
        let mission = client.send(Method::GET, &path, None).await?;
        let history = mission["history"].as_array().map_or(&[][..], Vec::as_slice);
        for step in history.iter().skip(known) {
            if !json {
                output::line(&format!("{:<17} {}: {}", text(step, "phase"), text(step, "who"), text(step, "why")))?;
            }
        }
        known = history.len();
        let phase = halcyon_model::MissionPhase::from_name(text(&mission, "phase"));
        if phase.is_some_and(halcyon_model::MissionPhase::is_final) {
            if json {
                output::json(&mission)?;
            }
            let completed = phase == Some(halcyon_model::MissionPhase::Completed);
            return Ok(if completed { ExitCode::SUCCESS } else { ExitCode::FAILURE });
        }
        tokio::select! {
            _ = tokio::signal::ctrl_c() => return Ok(ExitCode::FAILURE),
            () = pause() => {}
        }
    }
}

#[allow(clippy::disallowed_methods, reason = "a client asks in wall time; it has no fleet clock")]
async fn pause() {
    tokio::time::sleep(Duration::from_millis(500)).await;
}
