//! What takes whole grids or long records to find: where waves come from, the next quiet moments, the rotors' ripples, and what a second witness says.
//!
//! It takes tens of milliseconds, far more than a patch may take, and no verdict is safe for it. So it is looked for apart: a [`Glance`] is a copy
//! of all it needs and can be taken anywhere, on any thread; what it finds goes into the sea states that follow.

use halcyon_model::{CalmForecast, Directional, LocalPoint, Stamp};

use super::ahead::calm;
use super::direction::{Directions, directional};
use super::film::film;
use super::hidden::hidden;
use super::ripples::Ripples;
use super::series::Series;
use super::statistics::Statistics;
use super::window::Window;
use super::witness::{Testimony, Witness};
use crate::config::Config;

/// Directions are looked for once in so many seconds of patch time.
const DIRECTIONS_PERIOD_S: f64 = 5.0;
/// And quiet moments.
const CALM_PERIOD_S: f64 = 1.0;
/// Quiet moments found so long ago are no longer told, seconds.
const CALM_AGE_S_MAX: f64 = 3.0;
/// And directions.
const DIRECTIONS_AGE_S_MAX: f64 = 30.0;
/// And what the witness said.
const TESTIMONY_AGE_S_MAX: f64 = 15.0;

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Around {
    /// Patch time of it.
    at: Stamp,
    /// Patch time of the directions.
    directions_at: Stamp,
    directions: Option<Directions>,
    calm: Option<CalmForecast>,
    testimony: Option<Testimony>,
    /// Rotors' ripples, with those of before.
    ripples: Ripples,
    /// Which filling of the window it is of.
    filling: u64,
}

impl Around {
    /// Directions, unless they are of long ago.
    pub(super) fn directional(&self, newest: Stamp) -> Option<Directional> {
        let is_fresh = newest.seconds_since(self.directions_at) <= DIRECTIONS_AGE_S_MAX;
        self.directions.as_ref().filter(|_| is_fresh).map(|directions| directions.overall)
    }

    /// Quiet moments, unless they were found long ago.
    pub(super) fn calm(&self, newest: Stamp) -> Option<CalmForecast> {
        let is_fresh = newest.seconds_since(self.at) <= CALM_AGE_S_MAX;
        self.calm.clone().filter(|_| is_fresh)
    }

    /// Rotors' ripples.
    pub(super) fn ripples(&self) -> &Ripples {
        &self.ripples
    }

    /// What the witness says, unless it is of long ago.
    pub(super) fn testimony(&self, newest: Stamp) -> Option<&Testimony> {
        self.testimony.as_ref().filter(|said| newest.seconds_since(said.at) <= TESTIMONY_AGE_S_MAX)
    }

    /// Whether it is of this filling of the window.
    pub(super) fn is_of(&self, filling: u64) -> bool {
        self.filling == filling
    }
}

/// A look to be taken.
#[derive(Debug, Clone)]
pub struct Glance {
    window: Window,
    config: Config,
    statistics: Option<Statistics>,
    witness: Witness,
    place: LocalPoint,
    /// Whether there is anything to forecast: what cannot be trusted is not.
    is_trusted: bool,
    ripples: Ripples,
    last: Option<Around>,
    at: Stamp,
    filling: u64,
}

/// What an assessor knows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known<'a> {
    pub(super) window: &'a Window,
    pub(super) config: &'a Config,
    pub(super) statistics: Option<&'a Statistics>,
    pub(super) is_trusted: bool,
    pub(super) witness: &'a Witness,
    pub(super) ripples: &'a Ripples,
}

impl Glance {
    /// One at what the window shows, where `last` is so old that it is time.
    pub(super) fn due(known: Known<'_>, last: Option<&Around>, filling: u64) -> Option<Self> {
        let Known { window, config, statistics, is_trusted, witness, ripples } = known;
        let newest = window.newest()?;
        // Stamps that went back are those of another time.
        if last.is_some_and(|last| (0.0..CALM_PERIOD_S).contains(&newest.stamp.seconds_since(last.at))) {
            return None;
        }
        let frames = window.frames();
        let mean = |of: &dyn Fn(&LocalPoint) -> f64| frames.iter().map(|f| of(&f.centre)).sum::<f64>() / frames.len() as f64;
        Some(Self {
            window: window.clone(),
            config: config.clone(),
            statistics: statistics.cloned(),
            witness: witness.clone(),
            place: LocalPoint::new(mean(&|p| p.north_m), mean(&|p| p.east_m)),
            is_trusted,
            ripples: ripples.clone(),
            last: last.cloned(),
            at: newest.stamp,
            filling,
        })
    }

    /// Takes it: tens of milliseconds of work, bounded by what a window, a film and a forecast hold at most.
    #[must_use]
    pub fn look(self) -> Around {
        let is_fresh = |last: &&Around| (0.0..DIRECTIONS_PERIOD_S).contains(&self.at.seconds_since(last.directions_at));
        let (directions, testimony, directions_at) = match self.last.as_ref().filter(is_fresh) {
            Some(last) => (last.directions.clone(), last.testimony.clone(), last.directions_at),
            None => (self.directions(), self.testimony(), self.at),
        };
        let spectral = self.statistics.as_ref().and_then(|statistics| statistics.spectral.as_ref());
        let calm = spectral
            .zip(directions.as_ref())
            .filter(|_| self.is_trusted)
            .and_then(|(spectral, directions)| calm(&self.window, spectral, directions, self.place, &self.config));
        let mut ripples = self.ripples;
        ripples.look(self.window.grids(), self.at, self.config.window_s);
        Around { at: self.at, directions_at, directions, calm, testimony, ripples, filling: self.filling }
    }

    /// Without waves above the noise there are none.
    fn directions(&self) -> Option<Directions> {
        let (statistics, interval_s) = (self.statistics.as_ref()?, self.window.interval_s()?);
        directional(&film(&self.window, interval_s)?, statistics.t_z_s?.value, statistics.freedom)
    }

    /// The witness is heard about the same series that the verdict rests on.
    fn testimony(&self) -> Option<Testimony> {
        let interval_s = self.window.interval_s()?;
        let hidden = hidden(&self.window, &self.config, interval_s);
        let series = Series::new(&self.window, &hidden, self.config.gap_s_max.max(2.0 * interval_s));
        self.witness.testify(&self.window, &series, &self.config)
    }
}
