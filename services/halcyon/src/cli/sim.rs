//! `halcyon sim`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_capture::{RenderOptions, write_survey_folder};
use halcyon_chassis::{Options, Process, process};

use super::up::World;
use super::{bad_input, output};
use crate::simulator;

/// Simulate: render water to a survey folder, or serve vehicles over MAVLink
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Render simulated water to a survey folder, with the truth beside it
    #[command(after_help = "Example: halcyon sim render survey --seconds 60 --sea jonswap:0.05,1.3 --seed 7")]
    Render(RenderArgs),
    /// Serve simulated vehicles over MAVLink, for any ground station
    #[command(after_help = "Example: halcyon sim serve --leaders 1 --followers 0, then connect to tcp:127.0.0.1:5760")]
    Serve(World),
}

#[derive(Debug, clap::Args)]
struct RenderArgs {
    /// The folder to write; must be empty or absent
    folder: PathBuf,
    /// Length, seconds
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Pairs per second
    #[arg(long, default_value_t = 5.0)]
    rate_hz: f64,
    /// Height of the rig above the mean water, metres
    #[arg(long, default_value_t = 5.0)]
    height: f64,
    /// Slow roll and pitch of the carrier, degrees
    #[arg(long, default_value_t = 0.0)]
    sway_deg: f64,
    /// Slow heave of the carrier, metres
    #[arg(long, default_value_t = 0.0)]
    sway_m: f64,
    #[command(flatten)]
    world: World,
}

pub(super) fn run(options: &Options, args: Args) -> anyhow::Result<ExitCode> {
    match args.command {
        Command::Render(args) => render(options, &args),
        Command::Serve(world) => {
            let settings = world.settings(options)?;
            let config: simulator::Config = settings.section()?;
            process::runtime()?.block_on(async {
                let listeners = simulator::bind(&config.0).await?;
                for (vehicle, address) in listeners.addresses() {
                    output::line(&format!("{vehicle}  tcp:{address}"))?;
                }
                let mut process = Process::start(&settings).await?;
                let run = move |context, config: simulator::Config| simulator::run_with(context, listeners.clone(), config.0);
                process.spawn("world", config, run).await?;
                process.wait().await;
                Ok(ExitCode::SUCCESS)
            })
        }
    }
}

fn render(options: &Options, args: &RenderArgs) -> anyhow::Result<ExitCode> {
    let config: simulator::Config = args.world.settings(options)?.section()?;
    let frames = (args.seconds * args.rate_hz).ceil().max(0.0) as usize;
    let options = RenderOptions {
        frames,
        rate_hz: args.rate_hz,
        height_m: args.height,
        sway_deg: args.sway_deg,
        sway_m: args.sway_m,
        ..RenderOptions::default()
    };
    let bar = output::bar("pairs");
    let written = write_survey_folder(&args.folder, &config.0, &options, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    written.map_err(bad_input)?;
    output::line(&format!("{frames} pairs written to {}", args.folder.display()))?;
    Ok(ExitCode::SUCCESS)
}
