//! Waves from noise, frequency by frequency.
//!
//! What is slower than waves is wander and goes; what is faster than waves that fill the footprint is noise and goes. In the band between,
//! level and bend are averaged, each by its noise; what stands out of the noise that remains is waves, less what the noise adds. All of
//! it goes into the upper bounds, since it could be waves.
//!
//! The bend tells the level by how long a wave is, and that follows from its frequency by dispersion, unless its slope says that it is
//! shorter: a wave too fast for the rate of the pairs looks slow, and would pass for a giant. Where level and bend disagree, the bend
//! yields.

use std::f64::consts::TAU;

use halcyon_ocean::Depth;
use halcyon_ocean::dispersion::wavenumber_radpm;
use halcyon_ocean::filter::{Complex, Mirrored, band};

use super::response::Response;

/// Components to either side that a component's power is averaged with …
const SMOOTHED: usize = 4;
/// … and where powers are compared with each other.
const WIDELY: usize = 8;
/// A component stands out when its smoothed power exceeds the noise by this many of that noise's own standard deviations.
const STANDS_OUT: f64 = 1.64;
/// Where the autopilot's drift is measured, as shares of the slowest waves' frequency.
const DRIFT_BAND: (f64, f64) = (0.35, 0.9);
/// A wave is taken for shorter than dispersion has it when bend over slope says so by more than this: the ratio is noisy.
const SHORTER: f64 = 0.75;
/// Waves that the bend leaves unexplained by more than this share are too short for it.
const UNEXPLAINED_MAX: f64 = 0.5;

type Component = Complex<f64>;

/// The patches' shape, by frequency.
pub(super) struct Shape {
    /// Half of ∇²η, per metre.
    pub(super) bend: Mirrored,
    /// Rise over run east and north.
    pub(super) slopes: [Mirrored; 2],
}

/// Bands and noises of a window.
pub(super) struct Splitter {
    /// Waves are faster than this, hertz; 0 where nothing drifts.
    pub(super) low_hz: f64,
    /// Waves that lift a patch as a whole are slower than this, hertz.
    pub(super) high_hz: f64,
    /// Variance of one level, m².
    pub(super) level_noise_m2: f64,
    /// Variance of one bend, m⁻².
    pub(super) bend_noise_per_m2: f64,
    /// Variance of both slopes together, by the attitude.
    pub(super) slope_noise: f64,
    /// Sides of the patch, metres.
    pub(super) sides_m: [f64; 2],
}

impl Splitter {
    /// The level's waves, and all that could be, metres, one for each sample.
    pub(super) fn split_level(&self, level: &Mirrored, shape: Option<&Shape>) -> (Vec<f64>, Vec<f64>) {
        let count = level.bins().len();
        let unit = level.unit_power();
        let mut merged = level.bins().to_vec();
        let mut noise_m2 = self.level_noise_of(level);
        let fits = |of: &Mirrored| of.bins().len() == count;
        if let Some(shape) = shape.filter(|shape| fits(&shape.bend) && shape.slopes.iter().all(fits)) {
            for (i, witness) in self.by_bend(shape, level, &noise_m2).into_iter().enumerate() {
                let Some((component, variance_m2)) = witness else { continue };
                // Each weighs by the other's noise; one without noise has all the weight.
                let share = if noise_m2[i].is_finite() {
                    noise_m2[i] / (noise_m2[i] + variance_m2).max(f64::MIN_POSITIVE)
                } else {
                    1.0
                };
                merged[i] = merged[i] * (1.0 - share) + component * share;
                noise_m2[i] = share * variance_m2;
            }
        }
        let weights: Vec<f64> = (0..count).map(|i| band(level.frequency_hz(i), self.low_hz, self.high_hz)).collect();
        let power: Vec<f64> = merged.iter().map(|bin| bin.norm_sqr() / unit).collect();
        let gains = gains(&power, &noise_m2, &weights);
        let back = |scale: &dyn Fn(usize) -> f64| level.rebuilt((0..count).map(|i| merged[i] * scale(i)).collect());
        (back(&|i| weights[i] * gains[i]), back(&|i| weights[i]))
    }

    /// The slopes' waves, and all that could be, rise over run, one for each sample and axis.
    pub(super) fn split_slopes(&self, shape: &Shape) -> [[Vec<f64>; 2]; 2] {
        let [east, north] = &shape.slopes;
        let count = east.bins().len().min(north.bins().len());
        let weights: Vec<f64> = (0..count).map(|i| band(east.frequency_hz(i), self.low_hz, f64::INFINITY)).collect();
        // One gain for both axes, or a direction would come out of noise.
        let power: Vec<f64> =
            (0..count).map(|i| (east.bins()[i].norm_sqr() + north.bins()[i].norm_sqr()) / east.unit_power()).collect();
        let gains = gains(&power, &vec![self.slope_noise; count], &weights);
        [true, false].map(|waves| {
            [east, north].map(|axis| {
                let scale = |i: usize| if waves { weights[i] * gains[i] } else { weights[i] };
                axis.rebuilt((0..count).map(|i| axis.bins()[i] * scale(i)).collect())
            })
        })
    }

    /// The level's noise in each component, m²: white as stated, and the autopilot's drift, which falls with the fourth power of
    /// frequency from what is seen below all waves.
    fn level_noise_of(&self, level: &Mirrored) -> Vec<f64> {
        let drift_hz = DRIFT_BAND.0 * self.low_hz..DRIFT_BAND.1 * self.low_hz;
        let (mut sum, mut seen) = (0.0, 0.0);
        for (i, bin) in level.bins().iter().enumerate() {
            let f_hz = level.frequency_hz(i);
            if f_hz > 0.0 && drift_hz.contains(&f_hz) {
                sum += bin.norm_sqr() / level.unit_power() * f_hz.powi(4);
                seen += 1.0;
            }
        }
        let drift_m2_hz4 = if seen > 0.0 { sum / seen } else { 0.0 };
        let drift_m2 = |f_hz: f64| if drift_m2_hz4 > 0.0 { drift_m2_hz4 / f_hz.powi(4) } else { 0.0 };
        (0..level.bins().len()).map(|i| self.level_noise_m2 + drift_m2(level.frequency_hz(i))).collect()
    }

    /// The level by the bend, component by component, and the variance of its error, m²; `None` where it says nothing.
    fn by_bend(&self, shape: &Shape, level: &Mirrored, level_noise_m2: &[f64]) -> Vec<Option<(Component, f64)>> {
        let bends = shape.bend.bins();
        let unit = level.unit_power();
        let mut second: Vec<Option<(Component, f64)>> = (0..bends.len())
            .map(|i| {
                let f_hz = level.frequency_hz(i);
                if f_hz < 0.5 * self.low_hz.max(0.02) || f_hz > 1.1 * self.high_hz {
                    return None;
                }
                let power = mean_about(i, bends.len(), WIDELY, |i| bends[i].norm_sqr()) / unit;
                let k_radpm = wavenumber_radpm(TAU * f_hz, Depth::DEEP).max(SHORTER * self.by_slope_radpm(shape, i, power));
                let response = Response::new(k_radpm, self.sides_m);
                let scale_m2 = response.level_per_bend_m2;
                if !scale_m2.is_finite() || response.unexplained > UNEXPLAINED_MAX {
                    return None;
                }
                let noise_m2 = scale_m2 * scale_m2 * (self.bend_noise_per_m2 + response.unexplained * power);
                Some((bends[i] * scale_m2, noise_m2))
            })
            .collect();
        // Where level and bend differ by more than their noises explain, the bend is wrong by the rest: a current, or water so
        // shallow that waves feel it, breaks the dispersion that it rests on.
        let apart_m2: Vec<f64> = second
            .iter()
            .enumerate()
            .map(|(i, witness)| witness.map_or(f64::NAN, |(component, _)| (level.bins()[i] - component).norm_sqr() / unit))
            .collect();
        for (i, witness) in second.iter_mut().enumerate() {
            let Some((_, variance_m2)) = witness else { continue };
            let seen_m2 = mean_about(i, apart_m2.len(), WIDELY, |i| apart_m2[i]);
            *variance_m2 = variance_m2.max(seen_m2 - level_noise_m2[i] * (1.0 + STANDS_OUT * doubt(WIDELY)));
        }
        second
    }

    /// The least wavenumber that slope and bend of component `index` allow, radians per metre: ∇² of a wave is its slope times its
    /// wavenumber. Slopes have the benefit of the attitude's doubt. `power` is the bend's.
    fn by_slope_radpm(&self, shape: &Shape, index: usize, power: f64) -> f64 {
        let [east, north] = shape.slopes.each_ref().map(Mirrored::bins);
        let squared = |i: usize| east[i].norm_sqr() + north[i].norm_sqr();
        let slope_power = mean_about(index, east.len().min(north.len()), WIDELY, squared) / shape.bend.unit_power();
        let steep = (slope_power - self.slope_noise).max(0.0) + STANDS_OUT * doubt(WIDELY) * self.slope_noise;
        let bent = 4.0 * (power - self.bend_noise_per_m2 * (1.0 + STANDS_OUT * doubt(WIDELY))).max(0.0);
        (bent / steep.max(f64::MIN_POSITIVE)).sqrt()
    }
}

/// Mean of the finite values about `index`, `reach` to either side.
fn mean_about(index: usize, count: usize, reach: usize, value: impl Fn(usize) -> f64) -> f64 {
    let (mut sum, mut seen) = (0.0, 0.0);
    for value in (index.saturating_sub(reach)..(index + reach + 1).min(count)).map(value).filter(|value| value.is_finite()) {
        (sum, seen) = (sum + value, seen + 1.0);
    }
    if seen > 0.0 { sum / seen } else { 0.0 }
}

/// Standard deviation of a power of noise averaged over `reach` components to either side, as a share of it: a component has one degree
/// of freedom, and twice the square of its mean is its variance.
fn doubt(reach: usize) -> f64 {
    (2.0 / (2 * reach + 1) as f64).sqrt()
}

/// Share of each component, as an amplitude, that is waves: none while its neighbourhood within the band does not stand out of the
/// noise, and then all but the noise.
fn gains(power: &[f64], noise: &[f64], weights: &[f64]) -> Vec<f64> {
    (0..power.len())
        .map(|i| {
            // What is outside the band is drift, and no neighbour.
            let within = |of: &[f64], at: usize| if weights[at] >= 0.5 { of[at] } else { f64::NAN };
            let power_about = mean_about(i, power.len(), SMOOTHED, |at| within(power, at));
            let noise_about = mean_about(i, power.len(), SMOOTHED, |at| within(noise, at));
            let stands_out = power_about > noise_about * (1.0 + STANDS_OUT * doubt(SMOOTHED));
            // A noise that nobody knows leaves nothing.
            if stands_out { (1.0 - noise_about / power_about).sqrt() } else { 0.0 }
        })
        .collect()
}
