//! `halcyon up`

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;
use std::time::Duration;

use halcyon_chassis::clock::ClockConfig;
use halcyon_chassis::{CallError, Clock, ConfigError, LogConfig, Options, Process, Section, Settings, process, topics};
use halcyon_model::{Approval, LocalPoint, MissionAction, MissionCommand, MissionId, MissionSpec};
use halcyon_sim::config::SimVehicle;
use halcyon_sim::sea::{SeaConfig, SeaKind};
use halcyon_sim::water::Water;

use super::output;
use crate::witness::{Report, Witness, watch};
use crate::{fleet, simulator};

/// The one mission of a run.
const MISSION: &str = "first";

/// What world to simulate.
#[derive(Debug, clap::Args)]
pub(super) struct World {
    /// Leaders, which carry the cameras
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=100))]
    leaders: Option<u16>,
    /// Followers, which carry the payload
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=100))]
    followers: Option<u16>,
    /// Seed of the sea, the wind and every sensor
    #[arg(long)]
    seed: Option<u64>,
    /// still, regular:HEIGHT,PERIOD[,FROM_DEG] or jonswap:H_S,T_P[,FROM_DEG]; metres, seconds, degrees
    #[arg(long, value_name = "SEA")]
    sea: Option<Sea>,
    /// Mean wind at 10 m, metres per second
    #[arg(long, value_name = "MPS", allow_negative_numbers = true)]
    wind: Option<f64>,
    /// First MAVLink port, the others follow in tens as ArduPilot's simulator has them; 0 takes free ones
    #[arg(long, value_name = "PORT")]
    mavlink_port: Option<u16>,
    /// A scenario: a configuration file on top of the configuration
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
}

impl World {
    /// The settings with this world on top.
    pub(super) fn settings(&self, options: &Options) -> Result<Settings, ConfigError> {
        let mut settings = options.settings()?;
        if let Some(scenario) = &self.scenario {
            settings = settings.with_file(scenario)?;
        }
        let mut sim = settings.section::<simulator::Config>()?.0;
        let count = |role| sim.vehicles.iter().filter(|vehicle| vehicle.role == role).count();
        if self.leaders.is_some() || self.followers.is_some() {
            let leaders = self.leaders.map_or_else(|| count(halcyon_model::Role::Leader), usize::from);
            let followers = self.followers.map_or_else(|| count(halcyon_model::Role::Follower), usize::from);
            sim.vehicles = SimVehicle::fleet(leaders, followers);
        }
        if let Some(first) = self.mavlink_port {
            for (index, vehicle) in sim.vehicles.iter_mut().enumerate() {
                let port = if first == 0 { Some(0) } else { first.checked_add(10 * index as u16) };
                vehicle.mavlink_port =
                    port.ok_or_else(|| ConfigError::new("--mavlink-port leaves no room for every vehicle"))?;
            }
        }
        sim.seed = self.seed.unwrap_or(sim.seed);
        sim.wind.speed_mps = self.wind.unwrap_or(sim.wind.speed_mps);
        if let Some(sea) = &self.sea {
            sim.sea = sea.apply(&sim.sea);
        }
        let config = simulator::Config(sim);
        config.validate().map_err(ConfigError::new)?;
        Ok(settings.with(&config))
    }
}

/// `--sea`
#[derive(Debug, Clone, PartialEq)]
struct Sea {
    kind: SeaKind,
    numbers: Vec<f64>,
}

impl FromStr for Sea {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        let kind = match kind {
            "still" => SeaKind::Still,
            "regular" => SeaKind::Regular,
            "jonswap" => SeaKind::Jonswap,
            _ => return Err("must be still, regular:HEIGHT,PERIOD or jonswap:H_S,T_P".into()),
        };
        let parts = rest.split(',').filter(|part| !part.is_empty());
        let numbers: Vec<f64> =
            parts.map(|part| part.trim().parse().map_err(|_| format!("{part:?} is no number"))).collect::<Result<_, _>>()?;
        let expected = if kind == SeaKind::Still { 0..=0 } else { 2..=3 };
        if expected.contains(&numbers.len()) {
            Ok(Self { kind, numbers })
        } else {
            Err("needs HEIGHT,PERIOD, such as jonswap:0.05,1.3".into())
        }
    }
}

impl Sea {
    fn apply(&self, base: &SeaConfig) -> SeaConfig {
        let number = |index: usize, base: f64| self.numbers.get(index).copied().unwrap_or(base);
        SeaConfig {
            kind: self.kind,
            height_m: number(0, base.height_m),
            period_s: number(1, base.period_s),
            direction_from_deg: number(2, base.direction_from_deg),
            ..base.clone()
        }
    }
}

/// Fly the whole fleet in this process, over simulated water, with the dashboard
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon up --leaders 1 --followers 2 --seed 7 --auto-approve --once --json")]
pub(super) struct Args {
    #[command(flatten)]
    world: World,
    /// Simulated seconds per second
    #[arg(long, value_name = "N")]
    speed: Option<f64>,
    /// Dashboard and REST address; port 0 takes a free one
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<SocketAddr>,
    /// Start a mission at once, and let a safe verdict alone send the follower
    #[arg(long)]
    auto_approve: bool,
    /// Start a mission at once, end with it, and print a report
    #[arg(long)]
    once: bool,
    /// Where that mission is, metres north and east of the fleet's origin
    #[arg(long, value_name = "NORTH,EAST", allow_hyphen_values = true, default_value = "30,12", value_parser = point)]
    at: LocalPoint,
    /// With --once: give up after so many simulated seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 1800, requires = "once")]
    limit: u64,
    /// Record everything on the bus to this folder
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
    /// With --once: print the report as JSON
    #[arg(long, requires = "once")]
    json: bool,
}

fn point(text: &str) -> Result<LocalPoint, String> {
    let parts: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match parts[..] {
        [north_m, east_m] if north_m.is_finite() && east_m.is_finite() => Ok(LocalPoint::new(north_m, east_m)),
        _ => Err("must be two numbers, metres north and east, such as 30,12".into()),
    }
}

pub(super) fn run(options: &Options, args: &Args) -> anyhow::Result<ExitCode> {
    // Missions of a simulated world end with it: the store is for this run alone, and survives the planner's restarts.
    let folder = tempfile::Builder::new().prefix("halcyon-").tempdir()?;
    let settings = settings(options, args, folder.path())?;
    let sim = settings.section::<simulator::Config>()?.0;
    let water = Water::new(&sim.sea, sim.seed).map_err(super::bad_input)?;

    process::runtime()?.block_on(async {
        let mut process = Process::start(&settings).await?;
        let address = fleet::spawn_fleet(&mut process, &settings, &sim).await?;
        if args.record.is_some() {
            process.spawn("ground", settings.section::<halcyon_recorder::Config>()?, halcyon_recorder::run).await?;
        }
        tracing::info!("dashboard: http://{address}");
        let (bus, clock, stop) = (process.bus().clone(), process.clock().clone(), process.stop());
        let mission = MissionId::new(MISSION)?;
        if args.auto_approve || args.once {
            let approval = if args.auto_approve { Approval::Automatic } else { Approval::Manual };
            tokio::spawn(create(bus.clone(), clock.clone(), mission.clone(), spec(args.at, approval)));
        }
        if !args.once {
            process.wait().await;
            return Ok(ExitCode::SUCCESS);
        }
        let spinner = output::spinner();
        spinner.set_message(format!("dashboard: http://{address}"));
        let began = Witness::new(mission, clock.now());
        let limit = Duration::from_secs(args.limit);
        let running = tokio::spawn({
            let spinner = spinner.clone();
            async move {
                let tell =
                    |phase: halcyon_model::MissionPhase| spinner.set_message(format!("http://{address}  {}", phase.as_str()));
                watch(&bus, &clock, began, limit, tell).await
            }
        });
        let waiting = tokio::spawn(process.wait());
        let report = tokio::select! {
            watched = running => {
                let (witness, ended_by) = watched??;
                Some(witness.report(sim.seed, water.true_h_s_m(), ended_by))
            }
            () = stop.cancelled() => None,
        };
        stop.cancel();
        waiting.await?;
        spinner.finish_and_clear();
        let Some(report) = report else { return Ok(ExitCode::FAILURE) };
        if args.json {
            output::json(&report)?;
        } else {
            print(&report)?;
        }
        Ok(if report.outcome == "completed" { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    })
}

fn settings(options: &Options, args: &Args, folder: &std::path::Path) -> Result<Settings, ConfigError> {
    let mut settings = args.world.settings(options)?;
    if let Some(speed) = args.speed {
        let clock = ClockConfig { speed, ..settings.section::<ClockConfig>()? };
        clock.validate().map_err(|problem| ConfigError::new(format!("--{problem}")))?;
        settings = settings.with(&clock);
    }
    if let Some(listen) = args.listen {
        let gateway = halcyon_gateway::Config { listen, ..settings.section()? };
        settings = settings.with(&gateway);
    }
    let store = folder.join("missions.sqlite").to_string_lossy().into_owned();
    let planner = halcyon_mission_planner::Config { store, ..settings.section()? };
    settings = settings.with(&planner);
    if let Some(record) = &args.record {
        let recorder = halcyon_recorder::Config { folder: record.to_string_lossy().into_owned(), ..settings.section()? };
        settings = settings.with(&recorder);
    }
    let log: LogConfig = settings.section()?;
    if args.once && log == LogConfig::default() {
        // The report tells what happened; the log only what went wrong.
        settings = settings.with(&LogConfig { level: "error".into(), ..log });
    }
    Ok(settings)
}

fn spec(point: LocalPoint, approval: Approval) -> MissionSpec {
    MissionSpec {
        name: "First landing".into(),
        point,
        survey_height_m: 5.0,
        approval,
        dispatch_on_approval: true,
        leader: None,
        follower: None,
    }
}

/// Asks until the planner is there and has answered.
async fn create(bus: halcyon_chassis::Bus, clock: Clock, id: MissionId, spec: MissionSpec) {
    loop {
        let stamp = clock.now();
        let command = MissionCommand {
            stamp,
            deadline: stamp + Duration::from_secs(60),
            who: "halcyon up".into(),
            action: MissionAction::Create(id.clone(), spec.clone()),
        };
        match bus.call(&topics::mission_command(), &command, Duration::from_secs(3)).await {
            Ok(reply) if reply.accepted => return,
            Ok(reply) => return tracing::error!(reason = reply.reason, "the planner refused the mission"),
            Err(CallError::Bus(error)) => return tracing::error!(%error, "the mission could not be sent"),
            Err(error) => tracing::debug!(%error, "the planner is not there yet"),
        }
        clock.sleep(Duration::from_millis(200)).await;
    }
}

fn print(report: &Report) -> anyhow::Result<()> {
    let metres = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3} m"));
    let line = |name: &str, text: String| output::line(&format!("{name:<18} {text}"));
    line("outcome", format!("{}: {}", report.outcome, report.reason))?;
    line("seed", report.seed.to_string())?;
    let sea = &report.sea;
    line(
        "H_s",
        format!(
            "true {:.3} m, measured {} ({} to {})",
            sea.true_h_s_m,
            metres(sea.h_s_m),
            metres(sea.h_s_m_low),
            metres(sea.h_s_m_high)
        ),
    )?;
    line("verdict", report.verdict.unwrap_or("-").to_owned())?;
    line("touchdown error", metres(report.touchdown_error_m))?;
    let formation = &report.formation;
    line(
        "formation RMS",
        format!(
            "range {}, slot {}, altitude {}, over {:.0} s",
            metres(formation.range_rms_m),
            metres(formation.slot_rms_m),
            metres(formation.altitude_rms_m),
            formation.seconds
        ),
    )?;
    line("least separation", metres(formation.least_separation_m))?;
    line("mission", format!("{:.0} s", report.mission_s))?;
    for step in &report.history {
        output::line(&format!("  {:>6.1} s  {:<17} {}: {}", step.t_s, step.kind, step.who, step.text))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seas_and_points_are_read_or_refused() {
        assert_eq!("regular:0.1,2".parse::<Sea>().unwrap().numbers, [0.1, 2.0]);
        assert_eq!("still".parse::<Sea>().unwrap().kind, SeaKind::Still);
        for bad in ["", "flat", "jonswap", "jonswap:1", "jonswap:a,b", "still:1", "regular:1,2,3,4"] {
            assert!(bad.parse::<Sea>().is_err(), "{bad}");
        }
        assert_eq!(point("-30, 12.5"), Ok(LocalPoint::new(-30.0, 12.5)));
        for bad in ["", "1", "1,2,3", "a,b", "nan,1", "inf,1"] {
            assert!(point(bad).is_err(), "{bad}");
        }
    }
}
