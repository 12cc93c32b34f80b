//! The fleet's time. Everything that waits or stamps takes it from here, so that simulated time rules.
//!
//! Fleet time is an affine function of the wall's: `epoch + (wall − epoch) × speed`. Processes with the same epoch and speed
//! therefore agree as well as their wall clocks do, without talking to each other. At speed 1 it is the wall's time.

use std::future::Future;
use std::time::{Duration, Instant, SystemTime};

use halcyon_model::Stamp;
use serde::{Deserialize, Serialize};

use crate::config::Section;

/// `[clock]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClockConfig {
    /// Fleet seconds per wall second. Other than 1 makes sense only in simulation.
    pub speed: f64,
    /// The instant at which fleet time and wall time agree, seconds since the Unix epoch. Needed when several processes run at
    /// a speed other than 1, and must then be the same for all; 0 means the start of this process.
    pub epoch_s: f64,
}

impl Default for ClockConfig {
    fn default() -> Self {
        Self { speed: 1.0, epoch_s: 0.0 }
    }
}

impl Section for ClockConfig {
    const NAME: &'static str = "clock";

    fn validate(&self) -> Result<(), String> {
        if !(0.01..=100.0).contains(&self.speed) {
            return Err(format!("speed must be in 0.01 to 100, not {}", self.speed));
        }
        if !(0.0..=4e9).contains(&self.epoch_s) {
            return Err(format!("epoch_s must be in 0 to 4e9, not {}", self.epoch_s));
        }
        Ok(())
    }
}

/// The fleet's clock. Cheap to clone; every clone agrees.
#[derive(Debug, Clone)]
pub struct Clock {
    /// Fleet time at `started`.
    base: Stamp,
    started: Instant,
    speed: f64,
}

/// The time allowed has passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the time allowed has passed")]
pub struct Elapsed;

impl Clock {
    /// A clock as configured.
    #[must_use]
    #[allow(clippy::disallowed_methods, reason = "the one place that reads the wall clock")]
    pub fn new(config: &ClockConfig) -> Self {
        let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let wall_ns = i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX);
        let epoch_ns = if config.epoch_s > 0.0 { Stamp::from_secs_f64(config.epoch_s).as_nanos() } else { wall_ns };
        let ahead_ns = (wall_ns - epoch_ns) as f64 * (config.speed - 1.0);
        Self { base: Stamp::from_nanos(wall_ns + ahead_ns as i64), started: Instant::now(), speed: config.speed }
    }

    /// Now.
    #[must_use]
    pub fn now(&self) -> Stamp {
        self.base.plus_secs_f64(self.started.elapsed().as_secs_f64() * self.speed)
    }

    /// Fleet seconds per wall second.
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// The wall time that `duration` of fleet time takes.
    #[must_use]
    pub fn wall(&self, duration: Duration) -> Duration {
        duration.div_f64(self.speed)
    }

    /// Waits for `duration` of fleet time.
    #[allow(clippy::disallowed_methods, reason = "the place that turns fleet time into wall time")]
    pub async fn sleep(&self, duration: Duration) {
        tokio::time::sleep(self.wall(duration)).await;
    }

    /// Waits until `stamp`; returns at once if it has passed.
    pub async fn sleep_until(&self, stamp: Stamp) {
        let remaining_s = stamp.seconds_since(self.now());
        if remaining_s > 0.0 {
            self.sleep(Duration::from_secs_f64(remaining_s)).await;
        }
    }

    /// Ticks every `period` of fleet time, the first time at once. Late ticks are skipped, not made up for.
    #[must_use]
    pub fn every(&self, period: Duration) -> Ticker {
        Ticker { clock: self.clone(), period: period.max(Duration::from_micros(100)), next: self.now() }
    }

    /// `future`'s output, unless `duration` of fleet time passes first.
    ///
    /// # Errors
    /// [`Elapsed`].
    pub async fn timeout<F: Future>(&self, duration: Duration, future: F) -> Result<F::Output, Elapsed> {
        tokio::time::timeout(self.wall(duration), future).await.map_err(|_| Elapsed)
    }
}

/// A periodic wake-up on the fleet's clock.
#[derive(Debug)]
pub struct Ticker {
    clock: Clock,
    period: Duration,
    next: Stamp,
}

impl Ticker {
    /// Waits for the next tick and returns the time at which it was due. Cancel-safe.
    pub async fn tick(&mut self) -> Stamp {
        self.clock.sleep_until(self.next).await;
        let due = self.next;
        let late_s = self.clock.now().seconds_since(due).max(0.0);
        let periods = 1.0 + (late_s / self.period.as_secs_f64()).floor();
        self.next = due.plus_secs_f64(periods * self.period.as_secs_f64());
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_processes_with_one_epoch_agree() {
        let config = ClockConfig { speed: 10.0, epoch_s: 1.7e9 };
        let (one, other) = (Clock::new(&config), Clock::new(&config));
        let apart_s = one.now().seconds_since(other.now()).abs();
        assert!(apart_s < 1.0, "{apart_s} s of fleet time apart");
    }

    #[tokio::test]
    async fn late_ticks_are_skipped() {
        let clock = Clock::new(&ClockConfig { speed: 100.0, epoch_s: 0.0 });
        let mut ticker = clock.every(Duration::from_millis(500));
        let first = ticker.tick().await;
        clock.sleep(Duration::from_secs(2)).await;
        ticker.tick().await;
        let third = ticker.tick().await;
        assert!(third.seconds_since(first) >= 2.0, "a missed tick was made up for");
        let periods = third.seconds_since(first) / 0.5;
        assert!((periods - periods.round()).abs() < 1e-6, "ticks stay on their raster");
    }
}
