//! `halcyon formation`: a client of the REST API.

use std::process::ExitCode;

use clap::ValueEnum;
use halcyon_chassis::{ConfigError, process};
use reqwest::Method;
use serde_json::{Value, json};

use super::client::{Client, Gateway, PATIENCE};
use super::output;

/// Have followers keep a shape about a leader of a running fleet
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon formation order leader-1 --shape vee --spacing 8 && halcyon formation list")]
pub(super) struct Args {
    #[command(flatten)]
    gateway: Gateway,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Shape {
    /// Abreast of the leader, by turns to its right and its left
    Line,
    /// Behind the leader on both sides
    Vee,
    /// One behind the other
    Column,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Order a formation, or change the one that the leader has
    Order {
        /// About whom
        leader: String,
        /// In which shape
        #[arg(long, value_enum, default_value_t = Shape::Line)]
        shape: Shape,
        /// Between neighbours, metres
        #[arg(long, default_value_t = 7.0)]
        spacing: f64,
        /// Who, separated by commas; by default every follower that can be sent
        #[arg(long, value_delimiter = ',')]
        followers: Vec<String>,
    },
    /// Call the followers of a leader home
    Disband {
        /// Whose
        leader: String,
    },
    /// Who follows whom, and where
    List,
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (client, json) = args.gateway.open(PATIENCE)?;
    process::runtime()?.block_on(command(&client, args.command, json))
}

async fn command(client: &Client, command: Command, json: bool) -> anyhow::Result<ExitCode> {
    let answer = match command {
        Command::Order { leader, shape, spacing, followers } => {
            let shape = shape.to_possible_value().map(|value| value.get_name().to_owned());
            let body = json!({ "leader": leader, "shape": shape, "spacing_m": spacing, "followers": followers });
            client.send(Method::POST, "formations", Some(body)).await?
        }
        Command::Disband { leader } => {
            let leader = halcyon_model::VehicleId::new(leader).map_err(|error| ConfigError::new(error.to_string()))?;
            client.send(Method::POST, &format!("formations/{leader}/disband"), None).await?
        }
        Command::List => {
            let formations = client.send(Method::GET, "formations", None).await?;
            if !json {
                list(&formations)?;
                return Ok(ExitCode::SUCCESS);
            }
            formations
        }
    };
    if json {
        output::json(&answer)?;
    } else {
        output::line(answer["reason"].as_str().unwrap_or("accepted"))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn list(formations: &Value) -> anyhow::Result<()> {
    let formations = formations.as_array().map_or(&[][..], Vec::as_slice);
    if formations.is_empty() {
        output::line("nobody follows anybody")?;
    }
    for formation in formations {
        output::line(formation["leader"].as_str().unwrap_or("-"))?;
        for (follower, slot) in formation["followers"].as_object().into_iter().flatten() {
            let metres = |key: &str| slot[key].as_f64().unwrap_or(f64::NAN);
            let (forward_m, right_m, up_m) = (metres("forward_m"), metres("right_m"), metres("up_m"));
            output::line(&format!("  {follower:<16} forward {forward_m:6.1} m  right {right_m:6.1} m  up {up_m:5.1} m"))?;
        }
    }
    Ok(())
}
