//! Simulated water, seen from where the simulated vehicle really is.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use halcyon_chassis::{Clock, Context, Subscriber, Ticker, topics};
use halcyon_model::{Image, PoseAtExposure, SimTruth, Stamp, VehicleId, VehicleState};
use halcyon_sim::render::{RenderError, Renderer};
use halcyon_sim::texture::Texture;
use halcyon_sim::water::Water;

use super::{Exposure, Next, StereoSource};
use crate::config::Config;
use crate::core::pose::{PoseHistory, PoseSample};

/// An attitude this much older than what it came with is no pose: the autopilot has stopped telling it, seconds.
const ATTITUDE_S_MAX: f64 = 0.5;

/// How long a camera takes from mid-exposure until the picture is here, seconds: by then both poses about it are known.
const READOUT_S: f64 = 0.1;
/// The simulator's truth may be this much older than the exposure and is then carried forward, seconds.
const TRUTH_AGE_S_MAX: f64 = 0.5;

pub(crate) struct SimSource {
    vehicle: VehicleId,
    truths: Subscriber<SimTruth>,
    states: Subscriber<VehicleState>,
    ticker: Ticker,
    clock: Clock,
    truth: PoseHistory,
    landed: bool,
    state: PoseHistory,
    /// Out of the house while it renders.
    studio: Option<Studio>,
    config: Config,
}

/// What it takes to render, moved to a blocking thread and back.
struct Studio {
    water: Water,
    renderer: Renderer,
    seed: u64,
}

impl SimSource {
    pub(crate) async fn open(context: &Context, config: &Config) -> anyhow::Result<Self> {
        let vehicle = VehicleId::new(&config.vehicle)?;
        let (sim, rig) = (config.sim.clone(), config.rig.clone());
        let studio = tokio::task::spawn_blocking(move || {
            anyhow::Ok(Studio {
                water: Water::new(&sim.sea, sim.seed)?,
                renderer: Renderer::new(&sim.rig, Arc::new(Texture::water(sim.seed)))?,
                // Two rigs of one fleet have two pairs of sensors.
                seed: rig.bytes().fold(sim.seed, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)),
            })
        });
        Ok(Self {
            truths: context.bus.subscribe(&topics::sim_truth(&vehicle)).await?,
            states: context.bus.subscribe(&topics::vehicle_state(&vehicle)).await?,
            vehicle,
            ticker: context.clock.every(Duration::from_secs_f64(1.0 / config.rate_hz)),
            clock: context.clock.clone(),
            truth: PoseHistory::default(),
            landed: true,
            state: PoseHistory::default(),
            studio: Some(studio.await.context("setting up the renderer")??),
            config: config.clone(),
        })
    }

    /// Takes the pair whose readout ends now.
    async fn expose(&mut self) -> anyhow::Result<Next> {
        let stamp = self.clock.now().plus_secs_f64(-READOUT_S);
        let vehicle = &self.vehicle;
        let Some(newest) = self.truth.newest() else {
            return Ok(Next::Blind(format!("nothing heard of {vehicle} from the simulator")));
        };
        let age_s = stamp.seconds_since(newest.stamp);
        if age_s > TRUTH_AGE_S_MAX {
            return Ok(Next::Blind(format!("nothing heard of {vehicle} from the simulator for {age_s:.0} s")));
        }
        let Some(truth) = self.truth.at(stamp, TRUTH_AGE_S_MAX) else {
            return Ok(Next::Idle(format!("waiting for the motion of {vehicle}")));
        };
        let height_m = -truth.position_ned_m.z;
        let height_m_min = self.config.height_m_min;
        if self.landed || height_m < height_m_min {
            return Ok(Next::Idle(format!("{vehicle} is not flying above {height_m_min} m")));
        }
        let (left, right) = match self.render(truth, stamp).await? {
            Ok(pictures) => pictures,
            Err(error @ RenderError::TooLow { .. }) => return Ok(Next::Idle(error.to_string())),
            Err(error) => return Ok(Next::Blind(error.to_string())),
        };
        let pose = self.pose(stamp);
        let pose_missing = pose.is_none().then(|| {
            let age_s_max = self.config.pose_age_s_max;
            format!("pairs have no pose: no state of {} within {age_s_max} s", self.vehicle)
        });
        let calibration = self.config.sim.rig.calibration();
        let exposure_s = self.config.sim.rig.exposure_s;
        Ok(Next::Pair(Box::new(Exposure { stamp, left, right, exposure_s, calibration, pose, pose_missing })))
    }

    /// The autopilot's own estimate at `stamp`; never the truth.
    fn pose(&self, stamp: Stamp) -> Option<PoseAtExposure> {
        let sample = self.state.at(stamp, self.config.pose_age_s_max)?;
        Some(PoseAtExposure {
            position_ned_m: sample.position_ned_m,
            ned_from_body: sample.ned_from_body,
            height_sigma_m: self.config.height_sigma_m,
            attitude_sigma_rad: self.config.attitude_sigma_deg.to_radians(),
        })
    }

    /// Renders on a blocking thread: a dozen milliseconds that the async threads have better uses for.
    async fn render(&mut self, truth: PoseSample, stamp: Stamp) -> anyhow::Result<Result<(Image, Image), RenderError>> {
        let mut studio = self.studio.take().context("the renderer was lost in a cancelled exposure")?;
        let rendered = tokio::task::spawn_blocking(move || {
            let Studio { water, renderer, seed } = &mut studio;
            let pictures = renderer.render_pair(water, &truth.ned_from_body, truth.position_ned_m, stamp, *seed);
            (studio, pictures)
        });
        let (studio, pictures) = rendered.await.context("rendering a pair")?;
        self.studio = Some(studio);
        Ok(pictures)
    }
}

impl StereoSource for SimSource {
    async fn next(&mut self) -> anyhow::Result<Next> {
        loop {
            // What has been told comes before the shutter, so that the poses about the exposure are known.
            tokio::select! {
                biased;
                truth = self.truths.recv() => {
                    let truth = truth?;
                    self.landed = truth.landed;
                    self.truth.push(PoseSample {
                        stamp: truth.stamp,
                        position_ned_m: truth.position_ned_m,
                        velocity_ned_mps: truth.velocity_ned_mps,
                        ned_from_body: truth.ned_from_body,
                    });
                }
                state = self.states.recv() => {
                    let state = state?;
                    if state.ages.attitude_s.is_some_and(|age_s| age_s > ATTITUDE_S_MAX) {
                        continue;
                    }
                    self.state.push(PoseSample {
                        stamp: state.stamp,
                        position_ned_m: state.position_ned_m,
                        velocity_ned_mps: state.velocity_ned_mps,
                        ned_from_body: state.ned_from_body,
                    });
                }
                _ = self.ticker.tick() => return self.expose().await,
            }
        }
    }
}
