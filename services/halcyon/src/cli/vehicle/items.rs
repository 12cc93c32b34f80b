//! `halcyon vehicle mission`, `fence` and `rally`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use halcyon_chassis::ConfigError;
use halcyon_gateway::api::dto;
use halcyon_model::{Item, ItemKind, mav_cmd};
use reqwest::Method;
use serde_json::{Value, json};

use super::super::client::{Client, text};
use super::waypoints::{self, Home};
use super::{output, path, plan};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Action {
    /// Show what the autopilot keeps
    Show {
        /// The vehicle's id
        id: String,
    },
    /// Save what the autopilot keeps to a file
    Download {
        /// The vehicle's id
        id: String,
        /// QGroundControl's .plan, or .waypoints (QGC WPL 110)
        file: PathBuf,
    },
    /// Replace what the autopilot keeps by what is in a file
    Upload {
        /// The vehicle's id
        id: String,
        /// QGroundControl's .plan, or .waypoints (QGC WPL 110)
        file: PathBuf,
    },
    /// Empty it
    Clear {
        /// The vehicle's id
        id: String,
    },
}

pub(super) async fn run(client: &Client, kind: ItemKind, action: Action, json: bool) -> anyhow::Result<ExitCode> {
    match action {
        Action::Show { id } => {
            let answer = client.send(Method::GET, &path(&id, kind.name())?, None).await?;
            if json {
                output::json(&answer)?;
            } else {
                for (item, number) in items(answer, kind)?.iter().zip(1..) {
                    output::line(&line(number, item))?;
                }
            }
        }
        Action::Download { id, file } => {
            let is_plan = is_plan(&file)?;
            let items = items(client.send(Method::GET, &path(&id, kind.name())?, None).await?, kind)?;
            let home = home(&client.send(Method::GET, &path(&id, "")?, None).await?);
            let text = if is_plan {
                plan::write(&items, kind, home).map_err(anyhow::Error::msg)?
            } else {
                waypoints::write(&items, home)
            };
            std::fs::write(&file, text).with_context(|| format!("{} cannot be written", file.display()))?;
            if json {
                output::json(&json!({ "file": file.display().to_string(), "items": items.len() }))?;
            } else {
                output::line(&format!("{} items saved to {}", items.len(), file.display()))?;
            }
        }
        Action::Upload { id, file } => {
            let items = read(&file, kind)?;
            let items: Vec<dto::Item> = items.into_iter().map(Into::into).collect();
            let answer = client.send(Method::PUT, &path(&id, kind.name())?, Some(json!({ "items": items }))).await?;
            told(&id, &answer, json)?;
        }
        Action::Clear { id } => {
            let answer = client.send(Method::DELETE, &path(&id, kind.name())?, None).await?;
            told(&id, &answer, json)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn told(id: &str, answer: &Value, json: bool) -> anyhow::Result<()> {
    if json { output::json(answer) } else { output::line(&format!("{id}: {}", text(answer, "reason"))) }
}

/// By the file's ending.
fn is_plan(file: &Path) -> anyhow::Result<bool> {
    match file.extension().and_then(|ending| ending.to_str()) {
        Some("plan") => Ok(true),
        Some("waypoints" | "txt" | "wpl") => Ok(false),
        _ => Err(ConfigError::new(format!("{} must end in .plan or .waypoints", file.display())).into()),
    }
}

/// The items of a file that make sense in this list.
fn read(file: &Path, kind: ItemKind) -> anyhow::Result<Vec<Item>> {
    let bad = |problem: String| ConfigError::new(format!("{}: {problem}", file.display()));
    let is_plan = is_plan(file)?;
    let text = std::fs::read_to_string(file).map_err(|error| bad(error.to_string()))?;
    let items = if is_plan { plan::read(&text, kind) } else { waypoints::read(&text) }.map_err(bad)?;
    if let Some((at, problem)) = items.iter().enumerate().find_map(|(at, item)| Some((at, item.problem(kind)?))) {
        return Err(bad(format!("item {}: {problem}", at + 1)).into());
    }
    // To empty it is another command: nobody means it by a file.
    if items.is_empty() {
        return Err(bad(format!("there is no {} in it", kind.name())).into());
    }
    Ok(items)
}

fn items(answer: Value, kind: ItemKind) -> anyhow::Result<Vec<Item>> {
    let list: dto::ItemList = serde_json::from_value(answer).context("the gateway's answer is not a list of items")?;
    list.items.into_iter().map(|item| item.read(kind).map_err(Into::into)).collect()
}

fn home(vehicle: &Value) -> Home {
    let number = |key: &str| vehicle["home"][key].as_f64().unwrap_or(0.0);
    (number("latitude_deg"), number("longitude_deg"), number("altitude_m"))
}

fn line(number: usize, item: &Item) -> String {
    let command = mav_cmd::name(item.command).map_or_else(|| item.command.to_string(), Into::into);
    let place = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.7}"));
    let plain = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| value.to_string());
    let parameters = item.parameters.map(plain).join(" ");
    format!(
        "{number:>3} {command:<36} {:>12} {:>12} {:>8} m above {:<9} ({parameters})",
        place(item.latitude_deg),
        place(item.longitude_deg),
        plain(item.altitude_m),
        item.frame.name(),
    )
}
