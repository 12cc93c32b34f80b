//! `halcyon vehicle parameters`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use halcyon_chassis::ConfigError;
use halcyon_vehicle_link::core::renames::other_name;
use reqwest::Method;
use serde_json::{Value, json};

use super::super::client::{Client, text};
use super::{output, param_file, path};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Action {
    /// Read one parameter, or all
    Get {
        /// The vehicle's id
        id: String,
        /// The parameter's name; all without
        name: Option<String>,
    },
    /// Set one parameter
    Set {
        /// The vehicle's id
        id: String,
        /// The parameter's name
        name: String,
        /// Its new value
        #[arg(allow_negative_numbers = true)]
        value: f64,
        /// Also while the motors turn
        #[arg(long)]
        even_in_flight: bool,
    },
    /// Save all parameters to a file
    Save {
        /// The vehicle's id
        id: String,
        /// The file: NAME,VALUE a line
        file: PathBuf,
    },
    /// Show what a file would change, and set that
    Load {
        /// The vehicle's id
        id: String,
        /// NAME,VALUE (Mission Planner), NAME VALUE (MAVProxy) or QGroundControl's
        file: PathBuf,
        /// Only show it
        #[arg(long)]
        dry_run: bool,
        /// Also while the motors turn
        #[arg(long)]
        even_in_flight: bool,
    },
}

pub(super) async fn run(client: &Client, action: Action, json: bool) -> anyhow::Result<ExitCode> {
    match action {
        Action::Get { id, name } => {
            let what = match name {
                Some(name) => format!("parameters?name={}", checked(&name)?),
                None => "parameters".into(),
            };
            let answer = client.send(Method::GET, &path(&id, &what)?, None).await?;
            if json {
                output::json(&answer)?;
            } else {
                for (name, value) in values(&answer) {
                    output::line(&format!("{name:<16} {value}"))?;
                }
            }
            Ok(ExitCode::SUCCESS)
        }
        Action::Set { id, name, value, even_in_flight } => {
            let answer = set(client, &id, &name, value, even_in_flight).await?;
            if json {
                output::json(&answer)?;
            } else {
                output::line(&format!("{} is {}", text(&answer, "name"), answer["value"]))?;
            }
            Ok(ExitCode::SUCCESS)
        }
        Action::Save { id, file } => {
            let all = values(&client.send(Method::GET, &path(&id, "parameters")?, None).await?);
            std::fs::write(&file, param_file::write(&all)).with_context(|| format!("{} cannot be written", file.display()))?;
            if json {
                output::json(&json!({ "file": file.display().to_string(), "parameters": all.len() }))?;
            } else {
                output::line(&format!("{} parameters saved to {}", all.len(), file.display()))?;
            }
            Ok(ExitCode::SUCCESS)
        }
        Action::Load { id, file, dry_run, even_in_flight } => load(client, &id, &file, dry_run, even_in_flight, json).await,
    }
}

/// A name that can stand in a path.
fn checked(name: &str) -> anyhow::Result<String> {
    let name = halcyon_model::ParameterName::new(name).map_err(|error| ConfigError::new(error.to_string()))?;
    Ok(name.to_string())
}

async fn set(client: &Client, id: &str, name: &str, value: f64, even_in_flight: bool) -> anyhow::Result<Value> {
    if !value.is_finite() {
        return Err(ConfigError::new(format!("{name} cannot be {value}")).into());
    }
    let body = json!({ "value": value, "even_in_flight": even_in_flight });
    client.send(Method::PUT, &path(id, &format!("parameters/{}", checked(name)?))?, Some(body)).await
}

fn values(answer: &Value) -> Vec<(String, f64)> {
    let all = answer["parameters"].as_array().into_iter().flatten();
    all.filter_map(|one| Some((one["name"].as_str()?.to_owned(), one["value"].as_f64()?))).collect()
}

/// What differs, as (name, value now, value to be), and what the vehicle doesn't have. The wire holds single precision, and so
/// does the comparison.
fn differences(now: &[(String, f64)], wanted: &BTreeMap<String, f64>) -> (Vec<(String, f64, f64)>, Vec<String>) {
    let have: BTreeMap<&str, f64> = now.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let mut differ = Vec::new();
    let mut unknown = Vec::new();
    for (name, to) in wanted {
        match have.get(name.as_str()) {
            None => unknown.push(name.clone()),
            Some(from) if *from as f32 != *to as f32 => differ.push((name.clone(), *from, *to)),
            Some(_) => {}
        }
    }
    (differ, unknown)
}

async fn load(
    client: &Client,
    id: &str,
    file: &Path,
    dry_run: bool,
    even_in_flight: bool,
    json: bool,
) -> anyhow::Result<ExitCode> {
    let bad = |problem: String| ConfigError::new(format!("{}: {problem}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| bad(error.to_string()))?;
    let wanted = param_file::read(&text).map_err(bad)?;
    let now = values(&client.send(Method::GET, &path(id, "parameters")?, None).await?);
    let (differ, unknown) = differences(&now, &wanted);
    let mut failed = Vec::new();
    for (name, from, to) in &differ {
        if !json {
            output::line(&format!("{name:<16} {from} -> {to}"))?;
        }
        if !dry_run && let Err(error) = set(client, id, name, *to, even_in_flight).await {
            output::note(&format!("{name}: {error}"));
            failed.push(name.clone());
        }
    }
    for name in &unknown {
        let other = other_name(name).filter(|other| now.iter().any(|(have, _)| *have == other.name));
        let hint = other.map(|other| format!("; {other}")).unwrap_or_default();
        output::note(&format!("{name}: the vehicle has no such parameter{hint}"));
    }
    if json {
        let rows: Vec<_> = differ.iter().map(|(name, from, to)| json!({ "name": name, "from": from, "to": to })).collect();
        output::json(&json!({ "differences": rows, "unknown": unknown, "failed": failed, "dry_run": dry_run }))?;
    } else {
        let same = wanted.len() - differ.len() - unknown.len();
        let done = if dry_run { "would change" } else { "changed" };
        output::line(&format!("{} {done}, {same} the same, {} failed", differ.len() - failed.len(), failed.len()))?;
    }
    Ok(if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_differs_is_set() {
        let now = [("A".to_owned(), f64::from(0.1_f32)), ("B".to_owned(), 2.0)];
        let wanted = BTreeMap::from([("A".to_owned(), 0.1), ("B".to_owned(), 3.0), ("C".to_owned(), 1.0)]);
        assert_eq!(differences(&now, &wanted), (vec![("B".to_owned(), 2.0, 3.0)], vec!["C".to_owned()]));
    }
}
