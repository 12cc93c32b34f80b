//! From patch to sea state.

use halcyon_model::{
    Directional, IdError, LocalPoint, QualityFlag, RigId, SeaState, Stamp, SurfacePatch, Verdict, VerdictReason, VerdictState,
};

use super::ahead::calm;
use super::direction::directional;
use super::film::film;
use super::hidden::{Hidden, hidden};
use super::patch::{self, PatchError};
use super::quality;
use super::series::Series;
use super::statistics::Statistics;
use super::verdict::{Evidence, Judgement, judge};
use super::window::Window;
use crate::config::Config;

/// Watches one rig's patches and says what the water is like. Keeps at most `window_s` of them, and never the pictures.
#[derive(Debug)]
pub struct Assessor {
    config: Config,
    rig: RigId,
    window: Window,
    /// Patch time of the last sea state.
    assessed: Option<Stamp>,
    /// When the last sea state was issued, whatever it rested on.
    issued: Option<Stamp>,
    verdict: VerdictState,
    around: Option<Around>,
}

/// What changes slowly and takes whole grids to find.
#[derive(Debug, Clone)]
struct Around {
    /// Patch time of it.
    at: Stamp,
    directional: Option<Directional>,
    downwash: Option<QualityFlag>,
}

/// It is looked for once in so many seconds of patch time.
const AROUND_PERIOD_S: f64 = 5.0;

impl Assessor {
    /// An assessor that has seen nothing.
    ///
    /// # Errors
    /// [`IdError`] if `config.rig` is no identifier; the other values are taken as valid.
    pub fn new(config: Config) -> Result<Self, IdError> {
        let rig = RigId::new(&config.rig)?;
        let verdict = VerdictState::Inconclusive;
        Ok(Self { config, rig, window: Window::default(), assessed: None, issued: None, verdict, around: None })
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
        self.window.add(patch, self.config.window_s, self.config.spot_radius_m, self.config.slope_baseline_m);
        // Half an interval early is on time: stamps are not exact multiples of the period.
        let early_s = 0.5 * self.window.interval_s().unwrap_or(0.0);
        if self.assessed.is_some_and(|last| patch.stamp.seconds_since(last) < self.config.period_s - early_s) {
            return Ok(None);
        }
        self.assessed = Some(patch.stamp);
        self.issued = Some(now);
        Ok(self.assess(now))
    }

    /// The sea state of the window as it stands, whenever the last one was; `None` before the first patch.
    pub fn conclude(&mut self, now: Stamp) -> Option<SeaState> {
        self.assessed = self.window.newest().map(|frame| frame.stamp);
        self.issued = Some(now);
        self.assess(now)
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
        self.around = None;
    }

    /// Looks for directions and rotor ripples if it is time. Without waves above the noise there are no directions.
    fn look_around(&mut self, newest: Stamp, interval_s: Option<f64>, statistics: Option<&Statistics>) {
        if self.around.as_ref().is_some_and(|around| (0.0..AROUND_PERIOD_S).contains(&newest.seconds_since(around.at))) {
            return;
        }
        let direction = || {
            let (statistics, interval_s) = (statistics?, interval_s?);
            directional(&film(&self.window, interval_s)?, statistics.t_z_s?.value, statistics.freedom)
        };
        self.around = Some(Around { at: newest, directional: direction(), downwash: quality::downwash(&self.window) });
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
        self.look_around(newest, interval_s, statistics.as_ref());
        let frames = self.window.frames();
        let mean = |f: &dyn Fn(&super::window::Frame) -> f64| frames.iter().map(f).sum::<f64>() / frames.len() as f64;
        let rings = self.around.as_ref().and_then(|around| around.downwash.clone());
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
        };
        let judgement = judge(&evidence, &self.config, self.verdict);
        self.verdict = judgement.state;
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
        let direction = self.around.as_ref().and_then(|around| around.directional.as_ref()).filter(|_| statistics.is_some());
        let calm = spectral
            .zip(direction)
            // What cannot be trusted is not forecast.
            .filter(|_| judgement.probability.is_some())
            .and_then(|(spectral, direction)| calm(&self.window, spectral, direction, position, &self.config));
        let Judgement { state, reasons, probability } = judgement;
        let frames = self.window.frames();
        let (start, end) = (frames.front().map_or(measured, |f| f.stamp), frames.back().map_or(measured, |f| f.stamp));
        SeaState {
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
            directional: direction.copied(),
            spectrum: spectral.map(|s| s.spectrum.clone()),
            quality: evidence.map_or_else(Vec::new, |e| e.quality.clone()),
            calm,
            trace: series.map_or_else(Vec::new, Series::trace),
            verdict: Verdict { state, probability, reasons, valid_until: measured.plus_secs_f64(self.config.validity_s) },
        }
    }
}
