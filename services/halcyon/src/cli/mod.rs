//! The command line: flags in, one subcommand called, an exit code out.

mod bench;
mod calibrate;
mod client;
mod config;
mod features;
mod formation;
mod lab;
mod matching;
mod mission;
mod output;
mod reconstruct;
mod rig;
mod run;
mod self_calibrate;
mod sim;
mod survey;
mod up;
mod usage;
mod vehicle;
mod waves;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use halcyon_chassis::{Options, process};

/// Finds calm water and puts a payload on it: a fleet of drones that measures waves and lands on them.
#[derive(Debug, Parser)]
#[command(name = "halcyon", version, propagate_version = true, arg_required_else_help = true)]
#[command(after_help = "Example: halcyon up --auto-approve, then open http://127.0.0.1:8080")]
struct Cli {
    #[command(flatten)]
    options: Options,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fly the whole fleet in this process, over simulated water, with the dashboard
    Up(up::Args),
    /// Run one service, or several in one process, from the configuration
    Run(run::Args),
    /// Calibrate a stereo rig from pictures of a checkerboard
    Calibrate(calibrate::Args),
    /// Find the pose of a rig's cameras from pairs without a board, and whether its calibration has drifted
    SelfCalibrate(self_calibrate::Args),
    /// Find and match features of a pair: counts before and after RANSAC, fundamental matrix, pose
    Features(features::Args),
    /// Match a rectified pair of pictures to a disparity map
    Match(matching::Args),
    /// Measure the water surface in a raw pair of pictures, or in every pair of a survey folder
    Reconstruct(reconstruct::Args),
    /// Say what a rig can measure, from which altitude: footprint, noise, smallest waves, best altitude
    Rig(rig::Args),
    /// Judge the sea state of a survey folder: heights with intervals, verdict, maps, report
    Survey(survey::Args),
    /// Say everything about the waves in a file of elevations
    Waves(waves::Args),
    /// Judge accuracy against water that is known exactly, beside the thesis's figures
    Bench(bench::Args),
    /// Make the thesis's tables and figures again, its values beside ours
    Lab(lab::Args),
    /// Have followers keep a shape about a leader of a running fleet
    Formation(formation::Args),
    /// Create, watch and command missions of a running fleet
    Mission(mission::Args),
    /// Look at, command and set up the vehicles of a running fleet: parameters, missions, fences, payload
    Vehicle(vehicle::Args),
    /// Simulate: render water to a survey folder, or serve vehicles over MAVLink
    Sim(sim::Args),
    /// Print the effective configuration, and where each value came from
    Config(config::Args),
}

/// Runs the program.
#[must_use]
pub fn main() -> ExitCode {
    let Cli { options, command } = match Cli::try_parse() {
        Ok(cli) => cli,
        // Help and version are no errors, and are printed as they are; so is the help for whoever says nothing.
        Err(error) if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            error.exit()
        }
        Err(error) => return process::fail(&halcyon_chassis::ConfigError::new(usage::one_line(&error)).into()),
    };
    let outcome = match command {
        Command::Up(args) => up::run(&options, &args),
        Command::Run(args) => run::run(&options, &args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::SelfCalibrate(args) => self_calibrate::run(&args),
        Command::Features(args) => features::run(&args),
        Command::Match(args) => matching::run(&args),
        Command::Reconstruct(args) => reconstruct::run(&args),
        Command::Rig(args) => rig::run(&args),
        Command::Waves(args) => waves::run(&options, &args),
        Command::Survey(args) => survey::run(&options, &args),
        Command::Bench(args) => bench::run(&args),
        Command::Lab(args) => lab::run(&args),
        Command::Formation(args) => formation::run(args),
        Command::Mission(args) => mission::run(args),
        Command::Vehicle(args) => vehicle::run(args),
        Command::Sim(args) => sim::run(&options, args),
        Command::Config(args) => config::run(&options, &args),
    };
    match outcome {
        Ok(code) => code,
        Err(error) => process::fail(&error),
    }
}

/// Bad input: one line on stderr and exit code 2.
fn bad_input(error: impl std::error::Error) -> anyhow::Error {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    halcyon_chassis::ConfigError::new(text).into()
}
