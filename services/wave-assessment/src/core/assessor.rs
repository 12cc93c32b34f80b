//! From patch to sea state.

use halcyon_model::{
    IdError, LocalPoint, RigId, SeaState, Stamp, SurfacePatch, VehicleState, Verdict, VerdictReason, VerdictState,
};

use super::around::{Around, Glance, Known};
use super::hidden::{Hidden, hidden};
use super::patch::{self, PatchError};
use super::quality;
use super::ripples::Ripples;
use super::series::Series;
use super::statistics::Statistics;
use super::verdict::{Evidence, Judgement, judge};
use super::window::Window;
use super::witness::Witness;
use crate::config::Config;

/// Watches one rig's patches and says what the water is like. Keeps at most `window_s` of them, and never the pictures.
#[derive(Debug)]
pub struct Assessor {
    config: Config,
    rig: RigId,
    window: Window,
    witness: Witness,
    /// Patch time of the last sea state.
    assessed: Option<Stamp>,
    /// When the last sea state was issued, whatever it rested on.
    issued: Option<Stamp>,
    verdict: VerdictState,
    /// What the last sea state rests on, and whether it could be trusted.
    statistics: Option<Statistics>,
    is_trusted: bool,
    ripples: Ripples,
    around: Option<Around>,
    /// Counts how often the window was filled anew.
    filling: u64,
}

impl Assessor {
    /// An assessor that has seen nothing.
    ///
    /// # Errors
    /// [`IdError`] if `config.rig` is no identifier; the other values are taken as valid.
    pub fn new(config: Config) -> Result<Self, IdError> {
        let rig = RigId::new(&config.rig)?;
        let verdict = VerdictState::Inconclusive;
        Ok(Self {
            config,
            rig,
            window: Window::default(),
            witness: Witness::default(),
            assessed: None,
            issued: None,
            verdict,
            statistics: None,
            is_trusted: false,
            ripples: Ripples::default(),
            around: None,
            filling: 0,
        })
    }

    /// Takes in one patch, at its place in time if it comes late or out of order. A sea state comes out once in `period_s` of patch time.
    ///
    /// # Errors
    /// [`PatchError`] for a patch that is damaged, of another rig, older than allowed, early, there already, or nearly. Nothing that
    /// was known is lost by it.
    pub fn observe(&mut self, patch: &SurfacePatch, now: Stamp) -> Result<Option<SeaState>, PatchError> {
        let config = &self.config;
        patch::check(patch, &self.rig, now, config.clock_skew_s_max, config.patch_age_s_max)?;
        if let Some(newest) = self.window.newest().map(|frame| frame.stamp) {
            if newest.seconds_since(now) > config.clock_skew_s_max {
                // The clock was set back (a simulation began anew): what was seen before has no place in its time.
                self.forget();
            } else if newest.seconds_since(patch.stamp) > config.window_s {
                return Err(PatchError::OutOfOrder { sequence: patch.sequence, behind_s: newest.seconds_since(patch.stamp) });
            } else {
                for neighbour in self.window.neighbours(patch.stamp).into_iter().flatten() {
                    let apart_s = neighbour.seconds_since(patch.stamp).abs();
                    if apart_s == 0.0 {
                        return Err(PatchError::Duplicate { sequence: patch.sequence });
                    } else if apart_s < patch::APART_S_MIN {
                        return Err(PatchError::Crowded { sequence: patch.sequence, apart_s });
                    }
                }
            }
        }
        self.window.add(patch, self.ripples.radius_m(), &self.config);
        // Half an interval early is on time: stamps are not exact multiples of the period.
        let early_s = 0.5 * self.window.interval_s().unwrap_or(0.0);
        if self.assessed.is_some_and(|last| patch.stamp.seconds_since(last) < self.config.period_s - early_s) {
            return Ok(None);
        }
        self.assessed = Some(patch.stamp);
        self.issued = Some(now);
        Ok(self.assess(now))
    }

    /// Takes in what the rig's own vehicle says of itself: its rangefinder, where it has one, is a second witness of the waves.
    pub fn hear(&mut self, state: &VehicleState, now: Stamp) {
        if state.vehicle.as_str() == self.rig.as_str() {
            self.witness.add(state, now, self.config.window_s, self.config.clock_skew_s_max);
        }
    }

    /// The sea state of the window as it stands, with a look around, whenever the last ones were; `None` before the first patch.
    pub fn conclude(&mut self, now: Stamp) -> Option<SeaState> {
        self.assessed = self.window.newest().map(|frame| frame.stamp);
        self.issued = Some(now);
        // What is looked for rests on the statistics, and the verdict on what is found.
        let previous = self.verdict;
        self.assess(now)?;
        self.around = None;
        self.look_around();
        self.verdict = previous;
        self.assess(now)
    }

    /// The look around that it is time for, if it is; to be taken anywhere, and what it finds to be [noticed](Self::notice).
    #[must_use]
    pub fn glance(&self) -> Option<Glance> {
        let known = Known {
            window: &self.window,
            config: &self.config,
            statistics: self.statistics.as_ref(),
            is_trusted: self.is_trusted,
            witness: &self.witness,
            ripples: &self.ripples,
        };
        Glance::due(known, self.around.as_ref(), self.filling)
    }

    /// Takes in what a glance found. One from before the window was filled anew is of no use.
    pub fn notice(&mut self, around: Around) {
        if around.is_of(self.filling) {
            self.ripples.clone_from(around.ripples());
            self.around = Some(around);
        }
    }

    /// A glance taken at once, if it is time for one: for those who have the time.
    pub fn look_around(&mut self) {
        if let Some(around) = self.glance().map(Glance::look) {
            self.notice(around);
        }
    }

    /// To be called now and then: an inconclusive sea state, once in `period_s`, while patches have stopped coming; `None` while they
    /// come, and before the first.
    pub fn tick(&mut self, now: Stamp) -> Option<SeaState> {
        let newest = self.window.newest()?;
        let silent_s = now.seconds_since(newest.stamp);
        if silent_s <= self.config.stale_s
            || self.issued.is_some_and(|last| (0.0..self.config.period_s).contains(&now.seconds_since(last)))
        {
            return None;
        }
        let position = newest.centre;
        self.issued = Some(now);
        self.verdict = VerdictState::Inconclusive;
        let reason = VerdictReason {
            check: "fresh".into(),
            passed: false,
            text: format!("no surface patch for {silent_s:.1} s, at most {:.1} s allowed", self.config.stale_s),
        };
        let judgement = Judgement { state: VerdictState::Inconclusive, reasons: vec![reason], probability: None };
        Some(self.report(now, now, position, None, None, judgement))
    }

    /// Time since the newest patch, seconds; `None` before the first.
    #[must_use]
    pub fn silent_s(&self, now: Stamp) -> Option<f64> {
        self.window.newest().map(|frame| now.seconds_since(frame.stamp))
    }

    fn forget(&mut self) {
        self.window.clear();
        self.assessed = None;
        self.issued = None;
        self.verdict = VerdictState::Inconclusive;
        self.statistics = None;
        self.ripples = Ripples::default();
        self.around = None;
        self.filling += 1;
    }

    fn assess(&mut self, now: Stamp) -> Option<SeaState> {
        let frames = self.window.frames();
        let newest = self.window.newest()?.stamp;
        let mean = |f: &dyn Fn(&super::window::Frame) -> f64| frames.iter().map(f).sum::<f64>() / frames.len() as f64;
        let position = LocalPoint::new(mean(&|f| f.centre.north_m), mean(&|f| f.centre.east_m));
        let interval_s = self.window.interval_s();
        let measured = interval_s.map(|interval_s| {
            let hidden = hidden(&self.window, &self.config, interval_s);
            let series = Series::new(&self.window, &hidden, self.config.gap_s_max.max(2.0 * interval_s));
            let statistics = Statistics::of(&self.window, &series, &hidden, interval_s, self.config.wave_hz_min);
            (hidden, series, statistics)
        });
        let (hidden, series, statistics) = measured.map_or((None, None, None), |(h, s, t)| (Some(h), Some(s), t));
        let rings = self.ripples.flag();
        let evidence = Evidence {
            observed_s: series.as_ref().map_or(0.0, |s| s.observed_s),
            coverage: mean(&|f| f.coverage),
            repeated: mean(&|f| f64::from(u8::from(f.frozen))),
            outliers: series.as_ref().filter(|s| s.samples > 0).map_or(0.0, |s| s.replaced as f64 / s.samples as f64),
            interval_s,
            footprint_m: mean(&|f| f.footprint_m),
            hidden_m: match hidden {
                Some(Hidden::Measured { h_m0_m, .. }) => Some(h_m0_m),
                Some(Hidden::Unknown) | None => None,
            },
            quality: match (&series, &statistics) {
                (Some(series), Some(statistics)) => {
                    quality::flags(series, statistics.above_noise).into_iter().chain(rings).collect()
                }
                _ => rings.into_iter().collect(),
            },
            statistics,
            witness: self
                .around
                .as_ref()
                .and_then(|around| around.testimony(newest))
                .map(|said| (said.agrees, said.text.clone())),
        };
        let judgement = judge(&evidence, &self.config, self.verdict);
        self.verdict = judgement.state;
        self.statistics.clone_from(&evidence.statistics);
        self.is_trusted = judgement.probability.is_some();
        Some(self.report(now, newest, position, series.as_ref(), Some(&evidence), judgement))
    }

    /// Puts a sea state together. Its verdict holds for `validity_s` after `measured`.
    fn report(
        &self,
        now: Stamp,
        measured: Stamp,
        position: LocalPoint,
        series: Option<&Series>,
        evidence: Option<&Evidence>,
        judgement: Judgement,
    ) -> SeaState {
        let statistics = evidence.and_then(|evidence| evidence.statistics.as_ref());
        let spectral = statistics.and_then(|s| s.spectral.as_ref());
        let Judgement { state, reasons, probability } = judgement;
        let frames = self.window.frames();
        let (start, end) = (frames.front().map_or(measured, |f| f.stamp), frames.back().map_or(measured, |f| f.stamp));
        let mut report = SeaState {
            stamp: now,
            rig: self.rig.clone(),
            window_start: start,
            window_s: end.seconds_since(start),
            position,
            patches: u32::try_from(frames.len()).unwrap_or(u32::MAX),
            coverage: frames.iter().map(|f| f.coverage).sum::<f64>() / frames.len().max(1) as f64,
            waves: statistics.map_or(0, |s| u32::try_from(s.waves).unwrap_or(u32::MAX)),
            h_mean_m: statistics.map(|s| s.h_mean_m),
            h_s_m: statistics.map(|s| s.h_s_m),
            h_max_m: statistics.map(|s| s.h_max_m),
            h_m0_m: statistics.map(|s| s.h_m0_m),
            t_z_s: statistics.and_then(|s| s.t_z_s),
            slope_rms_rad: statistics.and_then(|s| s.slope_rms_rad),
            h_rms_m: statistics.map(|s| s.h_rms_m),
            h_tenth_m: statistics.map(|s| s.h_tenth_m),
            t_p_s: spectral.map(|s| s.t_p_s),
            t_m01_s: spectral.map(|s| s.t_m01_s),
            t_m02_s: spectral.map(|s| s.t_m02_s),
            t_e_s: spectral.map(|s| s.t_e_s),
            vertical_speed_rms_mps: statistics.map(Statistics::vertical_speed_rms_mps),
            directional: None,
            spectrum: spectral.map(|s| s.spectrum.clone()),
            quality: evidence.map_or_else(Vec::new, |e| e.quality.clone()),
            calm: None,
            trace: series.map_or_else(Vec::new, Series::trace),
            verdict: Verdict { state, probability, reasons, valid_until: measured.plus_secs_f64(self.config.validity_s) },
        };
        self.show_around(&mut report);
        report
    }

    /// Puts what was found around into a sea state that rests on a measurement.
    fn show_around(&self, state: &mut SeaState) {
        let (Some(around), Some(newest)) = (&self.around, self.window.newest()) else { return };
        if state.h_m0_m.is_some() {
            state.directional = around.directional(newest.stamp);
            // What cannot be trusted is not forecast.
            state.calm = around.calm(newest.stamp).filter(|_| state.verdict.probability.is_some());
        }
    }
}
