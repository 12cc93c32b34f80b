//! The thesis's formation flights (§6.8), flown by the law under test against the simulator, without a socket or a clock.
//!
//! A pilot flies the leader by velocity and yaw-rate setpoints, as sticks would: a square with a fixed heading, or a sweep of the
//! heading while it stands. The follower is flown by the very code that flies a real one: MAVLink telemetry, the executor with its
//! separation filter, setpoints as MAVLink. Leader states cross a radio that delays and loses them. The simulator's truth judges,
//! and nothing that flies sees it.
//!
//! Wind and GNSS errors of the two vehicles are **independent**: two receivers of one kind on one lake share most of their error,
//! which would cancel, so this is the worst case. The reported range, the thesis's figure (6-9), then hides the GNSS error, which
//! the true slot vector shows.

mod chance;
mod flyer;
mod pilot;
mod scene;
mod score;
pub mod swarm;

pub use scene::{Flight, Gnss, Radio, Scenario, WIND_MPS};
pub use score::{Errors, Report};

use halcyon_model::Stamp;

use flyer::{Follower, Leader, Sighting};
use score::Score;

/// Messages are exchanged this often, nanoseconds.
const TICK_NS: i64 = 5_000_000;
/// States are published and guidance is stepped this often, nanoseconds: 10 Hz.
const PERIOD_NS: i64 = 100_000_000;
/// Both must be in the air and in formation within this time, seconds.
const JOIN_S_MAX: f64 = 120.0;
/// The follower settles in its slot for so long before the figures are taken, seconds.
const SETTLE_S: f64 = 8.0;

/// Why a flight gave no figures.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FlightError {
    /// The scenario names no two vehicles, or a number in it is out of range.
    #[error("the scenario can't be flown: {0}")]
    Scenario(String),
    /// It took off, but no formation came about.
    #[error("no formation within {JOIN_S_MAX} s: {0}")]
    NoFormation(String),
}

/// Flies a scenario. The same scenario gives the same report.
///
/// # Errors
/// [`FlightError`].
pub fn fly(scenario: &Scenario) -> Result<Report, FlightError> {
    let begin = Stamp::from_secs_f64(1_760_000_000.0);
    let mut leader = Leader::new(scenario, begin).map_err(FlightError::Scenario)?;
    let mut follower = Follower::new(scenario, begin).map_err(FlightError::Scenario)?;
    let mut radio = scene::Channel::new(scenario);
    let mut score = Score::new(scenario);
    let mut settled_at: Option<Stamp> = None;
    let mut now = begin;
    loop {
        now = Stamp::from_nanos(now.as_nanos() + TICK_NS);
        leader.advance(now);
        follower.advance(now);
        let since_begin_ns = now.as_nanos() - begin.as_nanos();
        // The two computers' periods aren't in step.
        if since_begin_ns % PERIOD_NS == 35_000_000 {
            leader.pilot(now, settled_at.map(|at| now.seconds_since(at) - SETTLE_S));
            if let Some(state) = leader.state(now) {
                radio.send(state, now);
            }
        }
        let mut heard = false;
        for state in radio.receive(now) {
            follower.hear(state, now);
            heard = true;
        }
        if since_begin_ns % PERIOD_NS == 0 || (heard && scenario.on_arrival) {
            follower.step(leader.airborne(), now);
        }
        let Some(at) = settled_at else {
            if follower.settled() {
                settled_at = Some(now);
            } else if now.seconds_since(begin) > JOIN_S_MAX {
                return Err(FlightError::NoFormation(follower.describe()));
            }
            continue;
        };
        let flown_s = now.seconds_since(at) - SETTLE_S;
        if flown_s >= 0.0 && since_begin_ns % (4 * TICK_NS) == 0 {
            let both = (Sighting::of(leader.craft(), now), Sighting::of(follower.craft(), now));
            score.observe(&both.0, &both.1, now);
        }
        if flown_s >= scenario.flight.duration_s() {
            return Ok(score.report(follower.setpoints()));
        }
    }
}

#[cfg(test)]
mod tests;
