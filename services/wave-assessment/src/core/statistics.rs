//! Statistics of the waves in a window, each with its 95 % interval.
//!
//! An interval holds what the finite window leaves open (chi-square on the variance, see [`super::sampling`]) and what the
//! measurement does: estimates and lower bounds are less the readings' own noise, upper bounds are not, and hold all that may be waves
//! hidden by the footprint. So they err to the side of too high.

use halcyon_model::Estimate;
use halcyon_ocean::confidence::variance_factors_95;
use halcyon_ocean::crossing::{Crossing, Wave, WaveStatistics, waves};
use halcyon_ocean::height::{H_MEAN_OVER_ROOT_M0, H_S_OVER_ROOT_M0, expected_highest_over_h_s};
use halcyon_ocean::{Record, Spline};

use super::gauge::GAUGES;
use super::sampling::degrees_of_freedom;
use super::series::Series;
use super::window::Window;

/// Series are drawn this many times as dense as the patches before crests are looked for.
const DENSER: f64 = 4.0;
/// Heights of single waves scatter a little more than the variance does: their intervals have this share of its freedom.
const HEIGHT_FREEDOM: f64 = 0.8;
/// Two-sided 95 % of the normal distribution.
const NORMAL_95: f64 = 1.96;

/// What the window says about the waves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Statistics {
    /// Waves at all gauges together.
    pub waves: usize,
    /// Waves at the gauge that saw the most.
    pub waves_at_one: usize,
    /// Whether the elevation varies by more than its own noise explains; without it there is no period to speak of.
    pub above_noise: bool,
    pub h_mean_m: Estimate,
    pub h_s_m: Estimate,
    pub h_max_m: Estimate,
    pub h_m0_m: Estimate,
    pub t_z_s: Option<Estimate>,
    pub slope_rms_rad: Option<Estimate>,
}

impl Statistics {
    /// Of a window; `None` where no gauge has a series.
    pub(crate) fn of(window: &Window, series: &Series, interval_s: f64) -> Option<Self> {
        if series.samples == 0 {
            return None;
        }
        let mean_square = |pick: fn(&super::series::Stretch) -> &[f64]| {
            series.stretches.iter().flat_map(|s| pick(s)).map(|x| x * x).sum::<f64>() / series.samples as f64
        };
        let variance_m2 = mean_square(|s| &s.elevation_m);
        // Adding what may be hidden waves can lower the variance by chance; that is no reason to hope.
        let upper_m2 = mean_square(|s| &s.elevation_upper_m).max(variance_m2);
        let noise_m2 = series.noise_m2;

        let (all, at_each) = waves_at_gauges(series, interval_s, noise_m2.sqrt());
        let found = WaveStatistics::of(&all);
        let freedom = degrees_of_freedom(series, interval_s, found.map(|f| f.t_z_s));
        // Without a sign of any variance there is nothing to scale.
        let freedom = freedom.unwrap_or(f64::from(u32::try_from(GAUGES).unwrap_or(1))).max(1.0);
        let above_noise = variance_m2 * variance_factors_95(freedom).0 > 2.0 * noise_m2;

        let scale = Scale { variance_m2, upper_m2, noise_m2 };
        let from_m0 = |ratio: f64| ratio * variance_m2.sqrt();
        let (h_mean_m, h_s_m) =
            found.map_or((from_m0(H_MEAN_OVER_ROOT_M0), from_m0(H_S_OVER_ROOT_M0)), |f| (f.h_mean_m, f.h_s_m));
        let t_z_s = found.filter(|_| above_noise).map(|f| mean_period(&all, f.t_z_s, freedom));
        Some(Self {
            waves: all.len(),
            waves_at_one: at_each.into_iter().max().unwrap_or(0),
            above_noise,
            h_mean_m: scale.height(h_mean_m, freedom * HEIGHT_FREEDOM),
            h_s_m: scale.height(h_s_m, freedom * HEIGHT_FREEDOM),
            h_max_m: scale.observed(found.map_or(0.0, |f| f.h_max_m)),
            h_m0_m: scale.height(4.0 * variance_m2.sqrt(), freedom),
            t_z_s,
            slope_rms_rad: slope(window, freedom),
        })
    }

    /// Expected highest wave during `landing_s`, over a Rayleigh sea of H_s and T_z.
    ///
    /// Without a period the waves are taken to be as short as they come (half a second), which makes the most of them.
    pub(crate) fn highest_m(&self, landing_s: f64) -> Estimate {
        const PERIOD_S_MIN: f64 = 0.5;
        let period = self.t_z_s.unwrap_or(Estimate { value: PERIOD_S_MIN, low: PERIOD_S_MIN, high: PERIOD_S_MIN });
        let of = |h_s_m: f64, t_z_s: f64| h_s_m * expected_highest_over_h_s(landing_s / t_z_s);
        let h_s_m = self.significant_m();
        Estimate { value: of(h_s_m.value, period.value), low: of(h_s_m.low, period.high), high: of(h_s_m.high, period.low) }
    }

    /// H_s for the verdict: from single waves, but bounded by 4 √m0 too, which short or noisy waves do not drag down.
    pub(crate) fn significant_m(&self) -> Estimate {
        Estimate { high: self.h_s_m.high.max(self.h_m0_m.high), ..self.h_s_m }
    }
}

/// Variances behind the heights, m²: as estimated, with all that may be waves, and the readings' own noise.
struct Scale {
    variance_m2: f64,
    upper_m2: f64,
    noise_m2: f64,
}

impl Scale {
    /// Interval of a height that scales with the root of a variance of `freedom` degrees.
    fn height(&self, height_m: f64, freedom: f64) -> Estimate {
        if self.variance_m2 <= 0.0 {
            let high = 4.0 * self.upper_m2.sqrt();
            return Estimate { value: 0.0, low: 0.0, high };
        }
        let (low, high) = variance_factors_95(freedom);
        let share = |variance_m2: f64| height_m * (variance_m2.max(0.0) / self.variance_m2).sqrt();
        Estimate {
            value: share(self.variance_m2 - self.noise_m2),
            low: share(self.variance_m2 * low - self.noise_m2),
            high: share(self.upper_m2 * high),
        }
    }

    /// Interval of one observed height: only its measurement is uncertain, at its crest and at its trough.
    fn observed(&self, height_m: f64) -> Estimate {
        let error_m = NORMAL_95 * (2.0 * self.noise_m2).sqrt();
        let ratio =
            |variance_m2: f64| if self.variance_m2 > 0.0 { (variance_m2.max(0.0) / self.variance_m2).sqrt() } else { 0.0 };
        let value = height_m * ratio(self.variance_m2 - self.noise_m2);
        Estimate { value, low: (value - error_m).max(0.0), high: height_m * ratio(self.upper_m2).max(1.0) + error_m }
    }
}

/// Waves of every stretch, and how many each gauge had.
fn waves_at_gauges(series: &Series, interval_s: f64, deadband_m: f64) -> (Vec<Wave>, [usize; GAUGES]) {
    let step_s = interval_s / DENSER;
    let mut all = Vec::new();
    let mut at_each = [0; GAUGES];
    for stretch in &series.stretches {
        let (Some(start_s), Some(end_s)) = (stretch.times_s.first(), stretch.times_s.last()) else { continue };
        // Stamps rise and readings are finite, so neither can fail; a stretch that did would only be one stretch less.
        let Ok(curve) = Spline::new(stretch.times_s.clone(), stretch.elevation_m.clone()) else { continue };
        let dense_m = curve.sampled(*start_s, step_s, ((end_s - start_s) / step_s).floor() as usize + 1);
        let Ok(record) = Record::new(dense_m, 1.0 / step_s) else { continue };
        let found = waves(&record, Crossing::Up, deadband_m);
        at_each[stretch.slot] += found.len();
        all.extend(found);
    }
    (all, at_each)
}

/// Interval of the mean period: the scatter of single periods over the root of the number of independent waves.
fn mean_period(all: &[Wave], t_z_s: f64, freedom: f64) -> Estimate {
    let variance_s2 = all.iter().map(|w| (w.period_s - t_z_s).powi(2)).sum::<f64>() / all.len() as f64;
    // A period cannot be told better than by half of itself from a single wave.
    let error_s = (NORMAL_95 * (variance_s2 / (0.5 * freedom)).sqrt()).min(0.5 * t_z_s);
    Estimate { value: t_z_s, low: t_z_s - error_s, high: t_z_s + error_s }
}

/// Root mean square slope over all frames. It has at least the variance's degrees of freedom: a whole patch is seen, and steep
/// waves are short.
fn slope(window: &Window, freedom: f64) -> Option<Estimate> {
    let slopes: Vec<_> = window.frames().iter().filter_map(|f| f.slope).collect();
    if slopes.is_empty() {
        return None;
    }
    let n = slopes.len() as f64;
    let mean_square = slopes.iter().map(|s| s.mean_square).sum::<f64>() / n;
    let noise = slopes.iter().map(|s| s.noise).sum::<f64>() / n;
    let (low, high) = variance_factors_95(freedom);
    let root = |x: f64| x.max(0.0).sqrt();
    Some(Estimate { value: root(mean_square - noise), low: root(mean_square * low - noise), high: root(mean_square * high) })
}
