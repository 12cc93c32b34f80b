//! Wave systems of a spectrum: wind sea and swell, each with its own height and periods.
//!
//! 1. The estimate is smoothed over about a tenth of each frequency, so that chance makes few peaks.
//! 2. Peaks are told apart where the valley between them is too deep for chance: neighbours are merged, the least distinct first,
//!    until all are (after Guedes Soares 1984, *Ocean Eng.* 11, who asks for a valley under the confidence limits of the lower
//!    peak).
//! 3. The spectrum is cut at the valleys, but the longer waves' tail goes on under the shorter ones, as one of Ochi & Hubble's
//!    (1976) with the level and the steepness that it has before the valley: f⁻⁵ as Pierson-Moskowitz's (λ = 1), or steeper.
//! 4. A system whose peak is higher than that of a fully grown sea of its period (Pierson and Moskowitz 1964, α = 0.0081) is wind
//!    sea, any other is swell (Portilla, Ocampo-Torres & Monbaliu 2009, *J. Atmos. Oceanic Technol.* 26). This needs no wind, but
//!    takes a dying wind sea for swell.

use super::peak::PeakPeriods;
use super::scatter::Scatter;
use crate::dispersion::GRAVITY_MPS2;
use crate::welch::{SampledSpectrum, SpectralStatistics};

/// Half width of each of two running means, as a share of the frequency.
const SMOOTH: f64 = 0.05;
/// Standard deviations of ln(peak/valley) that are no chance. Of some twenty independent frequencies the extremes are 1.9
/// deviations off to either side.
const DISTINCT_SIGMAS: f64 = 4.0;
/// A valley that is not this much lower than its peak separates nothing, however well it is known.
const DISTINCT_RATIO: f64 = 1.1;
/// Peaks under this share of the highest are nothing.
const PEAK_MIN: f64 = 1e-9;
/// Phillips's constant of Pierson and Moskowitz's fully grown sea.
const ALPHA: f64 = 0.0081;
/// Where the tail's steepness and level are taken: from a share of the valley's frequency, and not nearer to the peak than a
/// factor. JONSWAP's enhancement, which falls off steeply, reaches to 1.3 times the peak's frequency.
const STEEPNESS_FROM: (f64, f64) = (0.6, 1.3);
const LEVEL_FROM: (f64, f64) = (0.8, 1.15);
/// To this share of the valley's frequency.
const TAIL_TO: f64 = 0.95;
/// Lines needed for a steepness.
const STEEPNESS_LINES_MIN: usize = 4;
/// Ochi & Hubble's λ: from Pierson-Moskowitz's f⁻⁵ to f⁻²¹.
const LAMBDA: (f64, f64) = (1.0, 5.0);

/// Who makes the waves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The wind, here and now.
    WindSea,
    /// A wind elsewhere or before.
    Swell,
}

/// One wave system.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Wind sea or swell.
    pub kind: Kind,
    /// Density of its peak over that of a fully grown sea of its period: above 1 is wind sea.
    pub grown_ratio: f64,
    /// Between which valleys its peak is, hertz.
    pub between_hz: (f64, f64),
    /// Its share of the spectrum, the tail beyond the valley included: all systems' shares add up to the band's spectrum.
    pub spectrum: SampledSpectrum,
    /// H_m0, T_p, T_m02 and others of its share.
    pub statistics: SpectralStatistics,
    /// Steadier peak periods of its share.
    pub peak: PeakPeriods,
}

/// The systems of `spectrum` within `low_hz`…`high_hz`, the longest waves first; none where there is no energy. Leave noise and
/// drift outside the band, or take the noise off before.
#[must_use]
pub fn systems(spectrum: &SampledSpectrum, scatter: &Scatter, (low_hz, high_hz): (f64, f64)) -> Vec<System> {
    let df_hz = spectrum.df_hz();
    let mut lines = spectrum.band(low_hz, high_hz);
    let Some((first_hz, _)) = lines.next() else { return Vec::new() };
    let (from, count) = ((first_hz / df_hz).round() as usize, 1 + lines.count());
    let Some(density) = spectrum.density_m2_per_hz().get(from..from + count) else { return Vec::new() };
    let smooth = Smooth::of(density, from, scatter);
    let peaks = smooth.distinct_peaks();
    let valleys: Vec<usize> = peaks.windows(2).map(|pair| smooth.lowest(pair[0], pair[1])).collect();

    // What is left of each line after the tails of longer waves, as a share.
    let mut left = vec![1.0; count];
    let mut found = Vec::new();
    for (place, peak) in peaks.iter().enumerate() {
        let mut own = vec![0.0; from + count];
        let valley = valleys.get(place).copied();
        let tail = valley.map(|valley| Tail::of(density, &left, from, (*peak, valley)));
        let begin = if place == 0 { 0 } else { valleys[place - 1] };
        for i in begin..count {
            let share = match (&tail, valley) {
                (Some(tail), Some(valley)) if i >= valley => {
                    (tail.at((from + i) as f64) / smooth.density[i]).clamp(0.0, left[i])
                }
                _ => left[i],
            };
            // Nothing over nothing is nobody's.
            let share = if share.is_nan() { 0.0 } else { share };
            own[from + i] = share * density[i];
            left[i] -= share;
        }
        let at_hz = |i: usize| (from + i) as f64 * df_hz;
        let between_hz = (at_hz(begin), at_hz(valley.unwrap_or(count - 1)));
        found.extend(system(spectrum, &own, smooth.density[*peak], at_hz(*peak), between_hz));
    }
    found
}

/// Statistics of all `systems` of one kind together, in the band of the systems; `None` where there is none.
#[must_use]
pub fn together(systems: &[System], kind: Kind) -> Option<SpectralStatistics> {
    let mut of_kind = systems.iter().filter(|system| system.kind == kind);
    let first = of_kind.next()?.spectrum.clone();
    let all = of_kind.fold(first, |sum, system| {
        sum.map(|line, density| density + system.spectrum.density_m2_per_hz().get(line).copied().unwrap_or(0.0))
    });
    all.statistics(0.0, f64::INFINITY)
}

fn system(whole: &SampledSpectrum, own: &[f64], peak: f64, peak_hz: f64, between_hz: (f64, f64)) -> Option<System> {
    let spectrum = whole.map(|line, _| own.get(line).copied().unwrap_or(0.0));
    let statistics = spectrum.statistics(0.0, f64::INFINITY)?;
    let periods = PeakPeriods::of(&spectrum, between_hz)?;
    let grown = ALPHA * GRAVITY_MPS2.powi(2) * std::f64::consts::TAU.powi(-4) * peak_hz.powi(-5) * (-1.25_f64).exp();
    let grown_ratio = peak / grown;
    let kind = if grown_ratio > 1.0 { Kind::WindSea } else { Kind::Swell };
    Some(System { kind, grown_ratio, between_hz, spectrum, statistics, peak: periods })
}

/// A level times Ochi & Hubble's tail behind a peak, ν⁻⁽⁴ᵏ⁾ exp(−k ν⁻⁴) with k = λ + ¼; frequencies in lines.
struct Tail {
    level: f64,
    steepness: f64,
    peak: f64,
}

impl Tail {
    /// Continues what is `left` of a system with its peak at line `peak` after its valley.
    fn of(density: &[f64], left: &[f64], from: usize, (peak, valley): (usize, usize)) -> Self {
        let (at_peak, at_valley) = ((from + peak) as f64, (from + valley) as f64);
        let before = |(share, factor): (f64, f64)| {
            let begin = (share * at_valley).max(factor * at_peak);
            let near = move |i: &usize| (begin..=TAIL_TO * at_valley).contains(&((from + i) as f64));
            (peak..valley).filter(near).collect::<Vec<usize>>()
        };
        let sum = |lines: &[usize]| lines.iter().map(|i| density[*i] * left[*i]).sum::<f64>();
        let lines = before(STEEPNESS_FROM);
        let mut tail = Self { level: 1.0, steepness: LAMBDA.0 + 0.25, peak: at_peak };
        if lines.len() >= STEEPNESS_LINES_MIN {
            // From how much the nearer half is higher: ln S = −k (4 ln ν + ν⁻⁴) + …
            let (near, far) = lines.split_at(lines.len() / 2);
            let fall = |half: &[usize]| half.iter().map(|i| tail.fall((from + i) as f64)).sum::<f64>() / half.len() as f64;
            let ratio = sum(near) / near.len() as f64 / (sum(far) / far.len() as f64);
            let steepness = ratio.ln() / (fall(far) - fall(near));
            // NaN of nothing over nothing stays at the broadest: `clamp` would keep it.
            if steepness > tail.steepness {
                tail.steepness = steepness.min(LAMBDA.1 + 0.25);
            }
        }
        let mut lines = before(LEVEL_FROM);
        if lines.is_empty() {
            lines.push(valley);
        }
        let of_shape: f64 = lines.iter().map(|i| tail.at((from + i) as f64)).sum();
        tail.level = if of_shape > 0.0 { sum(&lines) / of_shape } else { 0.0 };
        tail
    }

    /// 4 ln ν + ν⁻⁴.
    fn fall(&self, line: f64) -> f64 {
        let nu = line / self.peak;
        4.0 * nu.ln() + nu.powi(-4)
    }

    fn at(&self, line: f64) -> f64 {
        self.level * (-self.steepness * self.fall(line)).exp()
    }
}

/// A smoothed part of a spectrum.
struct Smooth {
    density: Vec<f64>,
    /// Variance of each line's logarithm.
    variance: Vec<f64>,
}

impl Smooth {
    fn of(density: &[f64], from: usize, scatter: &Scatter) -> Self {
        let half = |i: usize| (SMOOTH * (from + i) as f64).round() as usize;
        let once = running_mean(density, half);
        let twice = running_mean(&once, half);
        let variance = (0..density.len())
            .map(|i| {
                let lines = half(i).min(i).min(density.len() - 1 - i) * 2 + 1;
                // Two running means of L lines are a triangle, which is worth 1.5 L equal lines.
                let joint = if lines > 1 { 1.5 * lines as f64 * scatter.joint_dof() } else { 0.0 };
                2.0 / joint.max(scatter.line_dof())
            })
            .collect();
        Self { density: twice, variance }
    }

    /// The lowest line between two others.
    fn lowest(&self, from: usize, to: usize) -> usize {
        (from..=to).min_by(|a, b| self.density[*a].total_cmp(&self.density[*b])).unwrap_or(from)
    }

    /// Peaks with valleys between them that are no chance.
    fn distinct_peaks(&self) -> Vec<usize> {
        let d = &self.density;
        // Running sums leave rounding errors of the highest where nothing is.
        let least = PEAK_MIN * d.iter().copied().fold(0.0, f64::max);
        let rises = |i: usize| i == 0 || d[i] > d[i - 1];
        let falls = |i: usize| d.get(i + 1).is_none_or(|next| d[i] >= *next);
        let mut peaks: Vec<usize> = (0..d.len()).filter(|i| d[*i] > least && rises(*i) && falls(*i)).collect();
        loop {
            let depths = peaks.windows(2).map(|pair| self.depth(pair[0], pair[1]));
            let Some((place, depth)) = depths.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) else { return peaks };
            if depth >= 1.0 {
                return peaks;
            }
            let lower = if d[peaks[place]] < d[peaks[place + 1]] { place } else { place + 1 };
            peaks.remove(lower);
        }
    }

    /// How distinct two peaks are: from 1 on they are two.
    fn depth(&self, a: usize, b: usize) -> f64 {
        let lower = if self.density[a] < self.density[b] { a } else { b };
        let valley = self.lowest(a, b);
        let sigma = (self.variance[lower] + self.variance[valley]).sqrt();
        (self.density[lower] / self.density[valley]).ln() / (DISTINCT_SIGMAS * sigma).max(DISTINCT_RATIO.ln())
    }
}

/// Means over `half(i)` lines to either side, fewer where there are no more: the same number on both sides, so that slopes stay.
fn running_mean(values: &[f64], half: impl Fn(usize) -> usize) -> Vec<f64> {
    let mut sums = Vec::with_capacity(values.len() + 1);
    sums.push(0.0);
    let mut sum = 0.0;
    for value in values {
        sum += value;
        sums.push(sum);
    }
    let mean = |i: usize| {
        let half = half(i).min(i).min(values.len() - 1 - i);
        // One line is itself, free of rounding.
        if half == 0 { values[i] } else { (sums[i + half + 1] - sums[i - half]).max(0.0) / (2 * half + 1) as f64 }
    };
    (0..values.len()).map(mean).collect()
}

#[cfg(test)]
mod tests;
