//! Auto and cross spectra of two records by Welch's method, their coherence, and the gain from one to the other.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use crate::interval::{Interval, student_95};
use crate::welch::{SampledError, SampledSpectrum, Taper};

/// One-sided densities of two records at the same frequencies, under Hann's window, segments overlapped by half.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossSpectrum {
    /// Distance between two frequencies, hertz.
    pub df_hz: f64,
    /// Of the first, m²/Hz.
    pub aa_m2_per_hz: Vec<f64>,
    /// Of the second, m²/Hz.
    pub bb_m2_per_hz: Vec<f64>,
    /// Of both: conj(A)·B, m²/Hz; its phase is negative where `b` comes later.
    pub ab_m2_per_hz: Vec<Complex<f64>>,
    /// Independent estimates that a line is the mean of: 0.95 a segment (Welch 1967).
    pub averages: f64,
    /// How much of the records the segments cover, seconds.
    pub covered_s: f64,
}

/// Coherence and gain over the lines about the peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtPeak {
    /// From and to, hertz: lines whose geometric mean density is at least half of the highest.
    pub band_hz: Interval,
    /// Magnitude-squared coherence γ² of the band; of finite records it is never quite zero.
    pub coherence: f64,
    /// Independent estimates in it.
    pub averages: f64,
    /// What γ² of two unrelated records stays under with 95 % probability: 1 − 0.05^(1/(n − 1)) (Bendat and Piersol 2010, chapter 9).
    pub coherence_by_chance: f64,
    /// Gain from b to a, |S_ab|/(S_bb − the noise of b): 1 for sensors of the same scale. Noise in b that nobody gave lowers it
    /// as it does a slope, but only by what lies under the peak.
    pub gain: f64,
    /// Its 95 % interval: ± t √((1 − γ²)/(2n − 2))·√(S_aa/S_bb) (Bendat and Piersol 2010, chapter 9, for small n with Student's t).
    pub gain_95: Interval,
    /// Phase of b behind a, radians; what the lag has left over.
    pub phase_rad: f64,
}

impl CrossSpectrum {
    /// Of pairs of equally long stretches at `rate_hz`, in segments of `segment_samples`; stretches shorter than that add
    /// nothing. `None` where none is long enough or a segment has fewer than four samples.
    #[must_use]
    pub fn of(stretches: &[(&[f64], &[f64])], segment_samples: usize, rate_hz: f64) -> Option<Self> {
        let n = segment_samples;
        if n < 4 || !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return None;
        }
        let window: Vec<f64> = (0..n).map(|i| Taper::Hann.at(i as f64 / n as f64)).collect();
        let fft = RealFftPlanner::<f64>::new().plan_fft_forward(n);
        let (mut input, mut scratch) = (fft.make_input_vec(), fft.make_scratch_vec());
        let mut lines = [fft.make_output_vec(), fft.make_output_vec()];
        let (mut aa, mut bb) = (vec![0.0; lines[0].len()], vec![0.0; lines[0].len()]);
        let mut ab = vec![Complex::new(0.0, 0.0); lines[0].len()];
        let (mut segments, mut covered) = (0_usize, 0_usize);
        let step = n.div_ceil(2);
        for (a_m, b_m) in stretches.iter().filter(|(a_m, b_m)| a_m.len() == b_m.len() && a_m.len() >= n) {
            let here = (a_m.len() - n) / step + 1;
            for start in (0..here).map(|i| i * step) {
                for (samples, output) in [a_m, b_m].into_iter().zip(&mut lines) {
                    let segment = &samples[start..start + n];
                    let level = crate::record::mean(segment);
                    input.iter_mut().zip(segment).zip(&window).for_each(|((x, sample), w)| *x = (sample - level) * w);
                    fft.process_with_scratch(&mut input, output, &mut scratch).ok()?;
                }
                for (i, (a, b)) in lines[0].iter().zip(&lines[1]).enumerate() {
                    aa[i] += a.norm_sqr();
                    bb[i] += b.norm_sqr();
                    ab[i] += a.conj() * b;
                }
            }
            segments += here;
            covered += n + (here - 1) * step;
        }
        if segments == 0 {
            return None;
        }
        let scale = 2.0 / (rate_hz * window.iter().map(|w| w * w).sum::<f64>() * segments as f64);
        aa.iter_mut().chain(&mut bb).for_each(|density| *density *= scale);
        ab.iter_mut().for_each(|density| *density *= scale);
        // The mean and Nyquist's frequency are one-sided already; both lie outside of any band of waves.
        Some(Self {
            df_hz: rate_hz / n as f64,
            aa_m2_per_hz: aa,
            bb_m2_per_hz: bb,
            ab_m2_per_hz: ab,
            averages: (0.95 * segments as f64).max(1.0),
            covered_s: covered as f64 / rate_hz,
        })
    }

    /// The spectra of both alone.
    ///
    /// # Errors
    /// [`SampledError`] where densities overflow.
    pub fn alone(&self) -> Result<(SampledSpectrum, SampledSpectrum), SampledError> {
        let one = |density: &[f64]| SampledSpectrum::new(self.df_hz, density);
        Ok((one(&self.aa_m2_per_hz)?, one(&self.bb_m2_per_hz)?))
    }

    /// Indices of the lines above zero within `low_hz`…`high_hz`.
    pub(super) fn lines(&self, (low_hz, high_hz): Interval) -> impl Iterator<Item = usize> + Clone {
        let df_hz = self.df_hz;
        (1..self.aa_m2_per_hz.len()).filter(move |line| (low_hz..=high_hz).contains(&(*line as f64 * df_hz)))
    }

    /// About the highest line of the geometric mean of both spectra within `band_hz`, with the density of b's noise; `None` where
    /// they share no energy, b no more than its noise, or there are fewer than two independent estimates.
    #[must_use]
    pub fn at_peak(&self, band_hz: Interval, noise_b_m2_per_hz: f64) -> Option<AtPeak> {
        let shared = |line: usize| (self.aa_m2_per_hz[line] * self.bb_m2_per_hz[line]).sqrt();
        let top = self.lines(band_hz).max_by(|a, b| shared(*a).total_cmp(&shared(*b)))?;
        let high = |line: &usize| shared(*line) >= 0.5 * shared(top);
        let from = (1..=top).rev().take_while(high).last()?;
        let to = (top..self.aa_m2_per_hz.len()).take_while(high).last()?;
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, Complex::new(0.0, 0.0));
        for line in from..=to {
            aa += self.aa_m2_per_hz[line];
            bb += self.bb_m2_per_hz[line];
            ab += self.ab_m2_per_hz[line];
        }
        let averages = self.averages * independent_lines(to - from + 1);
        let waves_bb = bb - noise_b_m2_per_hz * (to - from + 1) as f64;
        if !(aa > 0.0 && waves_bb > 0.0 && averages > 2.0) {
            return None;
        }
        let coherence = (ab.norm_sqr() / (aa * bb)).min(1.0);
        let freedom = 2.0 * averages - 2.0;
        let gain = ab.norm() / waves_bb;
        let half = student_95(freedom) * ((1.0 - coherence) / freedom * aa * bb).sqrt() / waves_bb;
        Some(AtPeak {
            band_hz: (from as f64 * self.df_hz, to as f64 * self.df_hz),
            coherence,
            averages,
            coherence_by_chance: 1.0 - 0.05_f64.powf(1.0 / (averages - 1.0)),
            gain,
            gain_95: ((gain - half).max(0.0), gain + half),
            phase_rad: -ab.arg(),
        })
    }
}

/// How many independent lines so many neighbours are worth: Hann's window correlates neighbours by 2/3 and the next by 1/6.
fn independent_lines(lines: usize) -> f64 {
    let n = lines as f64;
    n * n / (n + 2.0 * (n - 1.0).max(0.0) * (4.0 / 9.0) + 2.0 * (n - 2.0).max(0.0) / 36.0)
}
