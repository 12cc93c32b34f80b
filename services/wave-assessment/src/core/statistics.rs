//! Statistics of the waves in a window, each with its 95 % interval.
//!
//! An interval holds what the finite window leaves open (chi-square on the variance, see [`super::sampling`]) and what the
//! measurement does: estimates and lower bounds are less the readings' own noise, upper bounds are not, and hold all that may be waves
//! hidden by the footprint. So they err to the side of too high.

use std::f64::consts::TAU;

use halcyon_model::Estimate;
use halcyon_ocean::Depth;
use halcyon_ocean::confidence::variance_factors_95;
use halcyon_ocean::crossing::{Wave, WaveStatistics};
use halcyon_ocean::dispersion::wavelength_m;
use halcyon_ocean::height::{
    H_MEAN_OVER_ROOT_M0, H_RMS_OVER_ROOT_M0, H_S_OVER_ROOT_M0, H_TENTH_OVER_ROOT_M0, expected_highest_over_h_s,
};

use super::hidden::{Hidden, whole_m2};
use super::records::{dense, even, waves_at_gauges};
use super::sampling::degrees_of_freedom;
use super::series::{Series, Stretch};
use super::spectrum::Spectral;
use super::window::Window;

/// Heights of single waves scatter a little more than the variance does: their intervals have this share of its freedom.
const HEIGHT_FREEDOM: f64 = 0.9;
/// And slopes scatter less: theirs have this many times its freedom.
const SLOPE_FREEDOM: f64 = 2.4;
/// Near the ends of the window a filter cannot know how waves go on: single ones of the hidden part are wrong by about this share.
const SPLIT_ERROR: f64 = 0.05;
/// Of what could be waves and is not believed to be, so much may have been believed by mistake.
const PASSED: f64 = 0.1;
/// Gauges and all cells see the same waves: they differ by no more than this factor in variance, or one of the two is not believed.
const WHOLE_MAX: f64 = 1.3;
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
    pub h_rms_m: Estimate,
    pub h_tenth_m: Estimate,
    pub t_z_s: Option<Estimate>,
    pub slope_rms_rad: Option<Estimate>,
    /// Degrees of freedom of the variance.
    pub freedom: f64,
    /// `None` where there are too few samples, or no waves above the noise.
    pub spectral: Option<Spectral>,
}

impl Statistics {
    /// Of a window; `None` where no gauge has a series.
    pub(crate) fn of(window: &Window, series: &Series, hidden: &Hidden, interval_s: f64, wave_hz_min: f64) -> Option<Self> {
        if series.samples == 0 {
            return None;
        }
        let mean_square = |pick: fn(&Stretch) -> &[f64]| {
            series.stretches.iter().flat_map(pick).map(|x| x * x).sum::<f64>() / series.samples as f64
        };
        let variance_m2 = mean_square(|s| &s.elevation_m);
        // Adding what may be hidden waves can lower the variance by chance; that is no reason to hope.
        let upper_m2 = mean_square(|s| &s.elevation_upper_m).max(variance_m2) + series.lost_m2;
        let noise_m2 = series.noise_m2;

        // Noise about zero makes waves that are none; a dead band against it swallows small waves that are some. Estimates are the
        // mean of both counts, bounds reach to the further one.
        let records = dense(series, interval_s);
        let [(every, _), (all, at_each)] = waves_at_gauges(&records, [0.0, noise_m2.sqrt()]);
        // A dead band that swallows none leaves them all as they are.
        let of_all = WaveStatistics::of(&all);
        let counts = [if every.len() == all.len() { of_all } else { WaveStatistics::of(&every) }, of_all];
        let counts: Vec<WaveStatistics> = counts.into_iter().flatten().collect();
        let period_s = counts.last().map(|c| c.t_z_s);
        // Where nothing varies there are no degrees of freedom, and nothing that they would scale.
        let freedom = degrees_of_freedom(series, interval_s, period_s).unwrap_or(1.0).max(1.0);
        let factors = variance_factors_95(freedom);
        let above_noise = variance_m2 * factors.0 > 2.0 * noise_m2;

        let hidden_m = if let Hidden::Measured { h_m0_m, .. } = hidden { *h_m0_m } else { 0.0 };
        // All cells tell the variance a little better than nine of them, and much better where cells or frames are missing.
        let waves_m2 = variance_m2 - noise_m2;
        let share = whole_m2(window, hidden).filter(|_| above_noise).map_or(1.0, |whole_m2| whole_m2 / waves_m2);
        let whole = if (1.0 / WHOLE_MAX..=WHOLE_MAX).contains(&share) { share } else { share.clamp(1.0, WHOLE_MAX) };
        let scale = Scale { variance_m2, upper_m2, noise_m2, hidden_m, whole };
        let height_factors = variance_factors_95(freedom * HEIGHT_FREEDOM);
        let height = |pick: fn(&WaveStatistics) -> f64, ratio: f64| {
            let heights_m: Vec<f64> = counts.iter().map(pick).collect();
            let heights_m = if heights_m.is_empty() { vec![ratio * variance_m2.sqrt()] } else { heights_m };
            let of = |height_m: f64| scale.height(height_m, height_factors);
            Estimate { value: of(mean(&heights_m)).value, low: of(min(&heights_m)).low, high: of(max(&heights_m)).high }
        };
        let periods_s: Vec<f64> = counts.iter().map(|c| c.t_z_s).collect();
        let t_z_s = (above_noise && !all.is_empty()).then(|| {
            let error_s = period_error_s(&all, mean(&periods_s), freedom);
            // A single wave tells no period better than by half of it.
            Estimate {
                value: mean(&periods_s),
                low: (min(&periods_s) - error_s).max(0.5 * min(&periods_s)),
                high: max(&periods_s) + error_s,
            }
        });
        Some(Self {
            waves: all.len(),
            waves_at_one: at_each.into_iter().max().unwrap_or(0),
            above_noise,
            h_mean_m: height(|f| f.h_mean_m, H_MEAN_OVER_ROOT_M0),
            h_s_m: height(|f| f.h_s_m, H_S_OVER_ROOT_M0),
            h_max_m: scale.observed(counts.iter().map(|c| c.h_max_m).fold(0.0, f64::max), all.len()),
            h_m0_m: scale.height(4.0 * variance_m2.sqrt(), factors),
            h_rms_m: height(|f| f.h_rms_m, H_RMS_OVER_ROOT_M0),
            h_tenth_m: height(|f| f.h_tenth_m, H_TENTH_OVER_ROOT_M0),
            t_z_s,
            spectral: if above_noise { Spectral::of(&even(&records), noise_m2, interval_s, wave_hz_min) } else { None },
            slope_rms_rad: slope(window, freedom),
            freedom,
        })
    }

    /// Mean period, or where there is none that of the shortest waves (half a second): it makes the most of them, and the fastest.
    pub(crate) fn period_s(&self) -> Estimate {
        const PERIOD_S_MIN: f64 = 0.5;
        self.t_z_s.unwrap_or(Estimate { value: PERIOD_S_MIN, low: PERIOD_S_MIN, high: PERIOD_S_MIN })
    }

    /// Expected highest of the waves of `landing_s`, over H_s.
    pub(crate) fn largest(&self, landing_s: f64) -> Largest {
        let Estimate { value, low, high } = self.period_s();
        Largest([value, high, low].map(|t_z_s| expected_highest_over_h_s(landing_s / t_z_s)))
    }

    /// Expected highest wave during a landing, over a Rayleigh sea of H_s and T_z.
    pub(crate) fn highest_m(&self, largest: &Largest) -> Estimate {
        largest.of(self.significant_m(), |h_s_m, over_h_s| h_s_m * over_h_s)
    }

    /// Root mean square vertical speed of the surface, metres per second: 2π √m0/T_z.
    pub(crate) fn vertical_speed_rms_mps(&self) -> Estimate {
        self.per_period(self.h_m0_m, |h_m0_m, t_z_s| 0.25 * h_m0_m * TAU / t_z_s)
    }

    /// Expected fastest rise of the surface during a landing, metres per second.
    pub(crate) fn rise_mps(&self, largest: &Largest) -> Estimate {
        largest.of(self.vertical_speed_rms_mps(), |rms_mps, over_h_s| rms_mps * amplitude_over_rms(over_h_s))
    }

    /// Expected steepest tilt of the water during a landing, radians; `None` where the slope is not known. As if all slopes lay in one
    /// direction, which makes the most of them.
    pub(crate) fn tilt_rad(&self, largest: &Largest) -> Option<Estimate> {
        self.slope_rms_rad.map(|rms| largest.of(rms, |rms, over_h_s| (rms * amplitude_over_rms(over_h_s)).atan()))
    }

    /// Length of waves of the mean period, metres, in deep water: in shallow water they are shorter.
    pub(crate) fn wavelength_m(&self) -> Estimate {
        let Estimate { value, low, high } = self.period_s();
        let length_m = |period_s: f64| wavelength_m(period_s, Depth::DEEP);
        Estimate { value: length_m(value), low: length_m(low), high: length_m(high) }
    }

    /// Of something that falls with the period: its bounds with the further end of the period's interval.
    fn per_period(&self, of: Estimate, f: impl Fn(f64, f64) -> f64) -> Estimate {
        let period = self.period_s();
        Estimate { value: f(of.value, period.value), low: f(of.low, period.high), high: f(of.high, period.low) }
    }

    /// H_s for the verdict: from single waves, but bounded by 4 √m0 too, which short or noisy waves do not drag down.
    pub(crate) fn significant_m(&self) -> Estimate {
        Estimate { high: self.h_s_m.high.max(self.h_m0_m.high), ..self.h_s_m }
    }
}

/// Expected highest of the waves of a landing over H_s: with the mean period, and with the upper and the lower end of its interval.
pub(crate) struct Largest([f64; 3]);

impl Largest {
    /// Of something that rises with it, `f`: its bounds with the further end of the period's interval.
    fn of(&self, of: Estimate, f: impl Fn(f64, f64) -> f64) -> Estimate {
        let Self([value, fewest, most]) = *self;
        Estimate { value: f(of.value, value), low: f(of.low, fewest), high: f(of.high, most) }
    }
}

/// Expected highest amplitude of a narrow Gaussian process over its root mean square: half of a highest wave's.
fn amplitude_over_rms(highest_over_h_s: f64) -> f64 {
    0.5 * H_S_OVER_ROOT_M0 * highest_over_h_s
}

/// Variances behind the heights, m²: as estimated, with all that may be waves, and the readings' own noise; and the height, metres,
/// of the hidden part in them.
struct Scale {
    variance_m2: f64,
    upper_m2: f64,
    noise_m2: f64,
    hidden_m: f64,
    /// Variance of all cells over that of the gauges.
    whole: f64,
}

impl Scale {
    /// Interval of a height that scales with the root of a variance, whose own interval reaches from `low` to `high` times its estimate.
    fn height(&self, height_m: f64, (low, high): (f64, f64)) -> Estimate {
        if self.variance_m2 <= 0.0 {
            let high = 4.0 * self.upper_m2.sqrt();
            return Estimate { value: 0.0, low: 0.0, high };
        }
        let share = |variance_m2: f64| height_m * (self.whole * variance_m2.max(0.0) / self.variance_m2).sqrt();
        Estimate {
            value: share(self.variance_m2 - self.noise_m2),
            low: share(self.variance_m2 * low - self.noise_m2 - PASSED * (self.upper_m2 - self.variance_m2)),
            high: share(self.upper_m2 * high),
        }
    }

    /// Interval of the highest of `waves` observed heights: only its measurement is uncertain, at its crest and at its trough. The
    /// highest is likely the one with the luckiest errors, √(2 ln n) deviations up in n draws, so it may be that much lower.
    fn observed(&self, height_m: f64, waves: usize) -> Estimate {
        let sigma_m = (2.0 * self.noise_m2).sqrt();
        let split_m = SPLIT_ERROR * self.hidden_m;
        let luck = (2.0 * (waves.max(1) as f64).ln()).sqrt();
        let ratio =
            |variance_m2: f64| if self.variance_m2 > 0.0 { (variance_m2.max(0.0) / self.variance_m2).sqrt() } else { 0.0 };
        let value = height_m * ratio(self.variance_m2 - self.noise_m2);
        Estimate {
            value,
            low: (value - luck.max(NORMAL_95) * sigma_m - split_m).max(0.0),
            high: height_m * ratio(self.upper_m2).max(1.0) + NORMAL_95 * sigma_m + split_m,
        }
    }
}

/// 95 % error of the mean period: the scatter of single periods over the root of the number of independent waves.
fn period_error_s(all: &[Wave], t_z_s: f64, freedom: f64) -> f64 {
    let variance_s2 = all.iter().map(|w| (w.period_s - t_z_s).powi(2)).sum::<f64>() / all.len() as f64;
    NORMAL_95 * (variance_s2 / (0.5 * freedom)).sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn min(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn max(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Root mean square slope over all frames. It has more degrees of freedom than the variance: a whole patch is seen, and steep waves are short
/// (2.8 times as many over wind seas of 1 to 1.5 s).
fn slope(window: &Window, freedom: f64) -> Option<Estimate> {
    let slopes: Vec<_> = window.frames().iter().filter_map(|f| f.slope).collect();
    if slopes.is_empty() {
        return None;
    }
    let n = slopes.len() as f64;
    let mean_square = slopes.iter().map(|s| s.mean_square).sum::<f64>() / n;
    let noise = slopes.iter().map(|s| s.noise).sum::<f64>() / n;
    let (low, high) = variance_factors_95(SLOPE_FREEDOM * freedom);
    let root = |x: f64| x.max(0.0).sqrt();
    Some(Estimate { value: root(mean_square - noise), low: root(mean_square * low - noise), high: root(mean_square * high) })
}
