//! Variance density spectra of records by Welch's method, and wave statistics from spectra.

use std::fmt;
use std::sync::Arc;

use realfft::RealToComplex;

use crate::dispersion::GRAVITY_MPS2;
use crate::plans;

use crate::record::{Record, RecordError, mean};

/// How a spectrum is estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Welch {
    /// Samples in a segment; segments overlap by half, each less its mean.
    pub segment_samples: usize,
    /// What each is multiplied by.
    pub taper: Taper,
}

/// A window that brings a segment's ends to nothing, or nearly. All are periodic: half-overlapped copies of the first two add up evenly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Taper {
    /// Hann's: leaks least far from a peak.
    #[default]
    Hann,
    /// Hamming's, which many packages have by default.
    Hamming,
    /// None: of a whole record it is the periodogram of the thesis (figure 5-30).
    Rectangle,
}

impl Taper {
    pub(crate) fn at(self, share: f64) -> f64 {
        let cos = (std::f64::consts::TAU * share).cos();
        match self {
            Self::Hann => 0.5 - 0.5 * cos,
            Self::Hamming => 0.54 - 0.46 * cos,
            Self::Rectangle => 1.0,
        }
    }
}

impl Welch {
    /// Segments of so many samples under Hann's window.
    #[must_use]
    pub fn new(segment_samples: usize) -> Self {
        Self { segment_samples, taper: Taper::default() }
    }

    /// Segments of about `segment_s` seconds at the record's rate: the resolution is about 1.5/`segment_s`, and the more segments, the
    /// steadier the estimate.
    #[must_use]
    pub fn with_segments_of_s(segment_s: f64, record: &Record) -> Self {
        let samples = (segment_s * record.rate_hz()).round();
        Self::new((samples.max(0.0) as usize).clamp(Record::SAMPLES_MIN, record.samples_m().len()))
    }

    /// The spectrum of `record`. Samples that no longer fill a segment at the end are left out.
    ///
    /// # Errors
    /// [`RecordError::TooShort`] where the record is shorter than one segment or a segment shorter than four samples.
    pub fn spectrum(&self, record: &Record) -> Result<SampledSpectrum, RecordError> {
        self.spectrum_padded(record, self.segment_samples)
    }

    /// The same with each segment followed by zeros up to `transform_samples` (no fewer than its own): lines lie closer, which places a peak more
    /// finely and resolves nothing more.
    ///
    /// # Errors
    /// As [`Self::spectrum`].
    pub fn spectrum_padded(&self, record: &Record, transform_samples: usize) -> Result<SampledSpectrum, RecordError> {
        // What is no spectrum needs no plan.
        fill(self.segment_samples, record.samples_m())?;
        self.planned(transform_samples).spectrum(record)
    }

    /// What the spectra of all records share, with segments followed by zeros up to `transform_samples`: planned once for many records.
    #[must_use]
    pub fn planned(&self, transform_samples: usize) -> Segments {
        let n = self.segment_samples;
        let taper: Vec<f64> = (0..n).map(|i| self.taper.at(i as f64 / n as f64)).collect();
        let fft = plans::forward(transform_samples.max(n).max(1));
        Segments { power: taper.iter().map(|w| w * w).sum(), taper, fft }
    }
}

/// Whether `samples` fill a segment of so many, and that is one.
fn fill(segment_samples: usize, samples: &[f64]) -> Result<(), RecordError> {
    let samples_min = segment_samples.max(Record::SAMPLES_MIN);
    if segment_samples < Record::SAMPLES_MIN || samples.len() < segment_samples {
        return Err(RecordError::TooShort { samples: samples.len(), samples_min });
    }
    Ok(())
}

/// A taper and a transform for segments of one length.
#[derive(Clone)]
pub struct Segments {
    taper: Vec<f64>,
    /// Sum of the taper's squares.
    power: f64,
    fft: Arc<dyn RealToComplex<f64>>,
}

impl fmt::Debug for Segments {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Segments").field("samples", &self.taper.len()).finish_non_exhaustive()
    }
}

impl Segments {
    /// The spectrum of `record`, as [`Welch::spectrum_padded`] has it.
    ///
    /// # Errors
    /// [`RecordError::TooShort`] where the record is shorter than one segment or a segment shorter than four samples.
    pub fn spectrum(&self, record: &Record) -> Result<SampledSpectrum, RecordError> {
        let n = self.taper.len();
        let samples = record.samples_m();
        fill(n, samples)?;
        let fft = &self.fft;
        let lines = fft.len();
        let (mut input, mut output, mut scratch) = (fft.make_input_vec(), fft.make_output_vec(), fft.make_scratch_vec());
        let mut density = vec![0.0; output.len()];
        let mut segments = 0_usize;
        for segment in samples.windows(n).step_by(n.div_ceil(2)) {
            let level = mean(segment);
            // The transform leaves its input changed.
            input.fill(0.0);
            for ((x, sample), w) in input.iter_mut().zip(segment).zip(&self.taper) {
                *x = (sample - level) * w;
            }
            // The lengths come from the plan itself, the only thing this could complain about.
            if fft.process_with_scratch(&mut input, &mut output, &mut scratch).is_err() {
                return Err(RecordError::TooShort { samples: samples.len(), samples_min: n });
            }
            density.iter_mut().zip(&output).for_each(|(d, x)| *d += x.norm_sqr());
            segments += 1;
        }
        // One-sided: all but the mean and, for an even length, the Nyquist frequency count twice.
        let scale = 1.0 / (record.rate_hz() * self.power * segments as f64);
        let last = density.len() - 1;
        for (i, d) in density.iter_mut().enumerate() {
            let sides = if i == 0 || (i == last && lines.is_multiple_of(2)) { 1.0 } else { 2.0 };
            *d *= scale * sides;
        }
        Ok(SampledSpectrum { df_hz: record.rate_hz() / lines as f64, density_m2_per_hz: density })
    }
}

/// A spectrum known at 0, df, 2 df, …: one-sided variance density.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledSpectrum {
    df_hz: f64,
    density_m2_per_hz: Vec<f64>,
}

/// Why densities are no spectrum.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SampledError {
    /// The distance between frequencies.
    #[error("frequencies must be a finite distance above 0 Hz apart, not {0} Hz")]
    Step(f64),
    /// No frequency above zero.
    #[error("a spectrum needs at least 2 densities, not {0}")]
    TooShort(usize),
    /// Negative, NaN, or so large that its fourth power would overflow.
    #[error("density {index} of the spectrum is {value} m²/Hz")]
    Density {
        /// The first such density.
        index: usize,
        /// It, m²/Hz.
        value: f64,
    },
}

impl SampledSpectrum {
    /// One-sided densities (m²/Hz) at 0, `df_hz`, 2 `df_hz`, …, as from a buoy's file or a theory.
    ///
    /// # Errors
    /// [`SampledError`] for a distance that is not positive, fewer than two densities, or a density that is negative or not finite.
    pub fn new(df_hz: f64, density_m2_per_hz: impl Into<Vec<f64>>) -> Result<Self, SampledError> {
        const DENSITY_MAX: f64 = 1e60;
        let density_m2_per_hz = density_m2_per_hz.into();
        if !(df_hz > 0.0 && df_hz.is_finite()) {
            return Err(SampledError::Step(df_hz));
        }
        if density_m2_per_hz.len() < 2 {
            return Err(SampledError::TooShort(density_m2_per_hz.len()));
        }
        let good = |density: f64| (0.0..=DENSITY_MAX).contains(&density);
        if let Some((index, &value)) = density_m2_per_hz.iter().enumerate().find(|(_, density)| !good(**density)) {
            return Err(SampledError::Density { index, value });
        }
        Ok(Self { df_hz, density_m2_per_hz })
    }

    /// Distance between two frequencies, hertz.
    #[must_use]
    pub fn df_hz(&self) -> f64 {
        self.df_hz
    }

    /// Density at `i × df_hz`, m²/Hz.
    #[must_use]
    pub fn density_m2_per_hz(&self) -> &[f64] {
        &self.density_m2_per_hz
    }

    /// The same frequencies with other densities, by line and density.
    pub(crate) fn map(&self, of: impl Fn(usize, f64) -> f64) -> Self {
        let density_m2_per_hz = self.density_m2_per_hz.iter().enumerate().map(|(line, density)| of(line, *density)).collect();
        Self { df_hz: self.df_hz, density_m2_per_hz }
    }

    /// Frequencies within `low_hz`…`high_hz` and above zero, with their densities.
    pub(crate) fn band(&self, low_hz: f64, high_hz: f64) -> impl Iterator<Item = (f64, f64)> + Clone {
        let df_hz = self.df_hz;
        self.density_m2_per_hz
            .iter()
            .enumerate()
            .skip(1)
            .map(move |(i, &density)| (i as f64 * df_hz, density))
            .filter(move |(f, _)| (low_hz..=high_hz).contains(f))
    }

    /// The moment mₙ = Σ fⁿ S df over `low_hz`…`high_hz`, m² Hzⁿ; the mean (f = 0) is never part of it.
    #[must_use]
    pub fn moment(&self, order: i32, low_hz: f64, high_hz: f64) -> f64 {
        self.band(low_hz, high_hz).map(|(f, density)| f.powi(order) * density * self.df_hz).sum()
    }

    /// Mean square slope along the waves over a baseline, as a finite difference measures it: ∫ S(f) (2 sin(k b/2)/b)² df with k = (2πf)²/g of deep water.
    /// Of a short baseline it is (2π)⁴ m4/g²; waves that are shorter than twice the baseline, and their noise, count with no more than 2/b.
    #[must_use]
    pub fn slope_variance(&self, baseline_m: f64, low_hz: f64, high_hz: f64) -> f64 {
        let along = |f: f64| {
            let k_radpm = (std::f64::consts::TAU * f).powi(2) / GRAVITY_MPS2;
            let phase = (0.5 * k_radpm * baseline_m).min(std::f64::consts::FRAC_PI_2);
            2.0 * phase.sin() / baseline_m
        };
        self.band(low_hz, high_hz).map(|(f, density)| along(f).powi(2) * density * self.df_hz).sum()
    }

    /// Width ε = √(1 − m2²/(m0 m4)) (Cartwright and Longuet-Higgins 1956), 0 for one frequency; it hangs on the tail. NaN without energy.
    #[must_use]
    pub fn width_epsilon(&self, low_hz: f64, high_hz: f64) -> f64 {
        let [m0, m2, m4] = [0, 2, 4].map(|order| self.moment(order, low_hz, high_hz));
        root(1.0 - m2 * m2 / (m0 * m4))
    }

    /// Width ν = √(m0 m2/m1² − 1) (Longuet-Higgins 1975), 0 for one frequency. NaN without energy.
    #[must_use]
    pub fn width_nu(&self, low_hz: f64, high_hz: f64) -> f64 {
        let [m0, m1, m2] = [0, 1, 2].map(|order| self.moment(order, low_hz, high_hz));
        root(m0 * m2 / (m1 * m1) - 1.0)
    }

    /// Peakedness Q_p = 2/m0² ∫ f S² df (Goda 1970): 1 for white noise from 0, 2 for Pierson-Moskowitz, higher where a peak is narrow. A smoothed
    /// spectrum has less of it. NaN without energy.
    #[must_use]
    pub fn peakedness(&self, low_hz: f64, high_hz: f64) -> f64 {
        let m0 = self.moment(0, low_hz, high_hz);
        2.0 / (m0 * m0) * self.band(low_hz, high_hz).map(|(f, density)| f * density * density * self.df_hz).sum::<f64>()
    }

    /// Wave statistics of the band `low_hz`…`high_hz`; `None` where it holds no energy.
    #[must_use]
    pub fn statistics(&self, low_hz: f64, high_hz: f64) -> Option<SpectralStatistics> {
        let [m_minus1, m0, m1, m2] = [-1, 0, 1, 2].map(|order| self.moment(order, low_hz, high_hz));
        if m0 <= 0.0 {
            return None;
        }
        let (f_p_hz, _) = self.band(low_hz, high_hz).max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(SpectralStatistics {
            m0_m2: m0,
            h_m0_m: 4.0 * m0.sqrt(),
            f_p_hz,
            t_p_s: 1.0 / f_p_hz,
            t_m01_s: m0 / m1,
            t_m02_s: (m0 / m2).sqrt(),
            t_e_s: m_minus1 / m0,
        })
    }
}

/// The root of what rounding may have made negative; NaN stays NaN.
fn root(square: f64) -> f64 {
    if square < 0.0 { 0.0 } else { square.sqrt() }
}

/// What a spectrum says about the waves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralStatistics {
    /// Variance, m².
    pub m0_m2: f64,
    /// H_m0 = 4 √m0, metres.
    pub h_m0_m: f64,
    /// Frequency of the highest density, hertz: one of the spectrum's own frequencies.
    pub f_p_hz: f64,
    /// Peak period 1/f_p, seconds.
    pub t_p_s: f64,
    /// Mean period m0/m1, seconds.
    pub t_m01_s: f64,
    /// Mean zero-crossing period √(m0/m2), seconds.
    pub t_m02_s: f64,
    /// Energy period m₋₁/m0, seconds.
    pub t_e_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::TAU;

    fn record(n: usize, rate_hz: f64, f: impl FnMut(usize) -> f64) -> Record {
        Record::new((0..n).map(f).collect::<Vec<_>>(), rate_hz).unwrap()
    }

    /// A whole number of periods in each segment: the sine's variance a²/2 is all in its line and the two beside it.
    #[test]
    fn a_sine_has_its_height_and_period() {
        let sine = record(4096, 4.0, |i| 7.0 + 0.5 * (TAU * 0.125 * i as f64 / 4.0).sin());
        for segment_samples in [512, 1024, 4096] {
            let found = Welch::new(segment_samples).spectrum(&sine).unwrap().statistics(0.0, 2.0).unwrap();
            assert_relative_eq!(found.h_m0_m, 4.0 * 0.5 / 2f64.sqrt(), max_relative = 1e-9);
            assert_relative_eq!(found.t_p_s, 8.0, max_relative = 1e-12);
            assert_relative_eq!(found.t_m01_s, 8.0, max_relative = 1e-3);
            assert_relative_eq!(found.t_e_s, 8.0, max_relative = 2e-3);
        }
    }

    /// White noise of unit variance at 10 Hz is 2/10 m²/Hz throughout (1.5 % is four standard errors over the whole band).
    #[test]
    fn white_noise_is_level_and_has_its_variance() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let noise = record(200_000, 10.0, |_| random.sample(rand_distr::StandardNormal));
        for segment_samples in [255, 256] {
            let spectrum = Welch::new(segment_samples).spectrum(&noise).unwrap();
            assert_relative_eq!(spectrum.moment(0, 0.0, 5.0), 1.0, max_relative = 0.02);
            assert_relative_eq!(spectrum.moment(0, 1.0, 2.0), 0.2, max_relative = 0.03);
        }
    }

    /// Without a taper the periodogram of a whole number of periods is one line: a²/2 over df.
    #[test]
    fn tapers_keep_a_sines_variance() {
        let sine = record(1000, 10.0, |i| 0.2 * (TAU * 0.5 * i as f64 / 10.0).sin());
        for taper in [Taper::Hann, Taper::Hamming, Taper::Rectangle] {
            for segment_samples in [200, 1000] {
                let spectrum = Welch { segment_samples, taper }.spectrum(&sine).unwrap();
                assert_relative_eq!(spectrum.moment(0, 0.0, 5.0), 0.02, max_relative = 1e-9);
            }
        }
        let line = Welch { segment_samples: 1000, taper: Taper::Rectangle }.spectrum(&sine).unwrap();
        assert_relative_eq!(line.density_m2_per_hz()[50], 0.02 / 0.01, max_relative = 1e-9);
    }

    /// Zeros add lines between the others, and no variance.
    #[test]
    fn padding_adds_lines_and_no_variance() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let noise = record(1000, 10.0, |_| random.sample(rand_distr::StandardNormal));
        let (plain, padded) =
            (Welch::new(100).spectrum(&noise).unwrap(), Welch::new(100).spectrum_padded(&noise, 400).unwrap());
        assert_relative_eq!(padded.df_hz(), plain.df_hz() / 4.0, max_relative = 1e-12);
        for (i, density) in plain.density_m2_per_hz().iter().enumerate() {
            assert_relative_eq!(padded.density_m2_per_hz()[4 * i], *density, max_relative = 1e-9);
        }
        assert_relative_eq!(padded.moment(0, 0.0, 5.0), plain.moment(0, 0.0, 5.0), max_relative = 0.02);
        assert_eq!(Welch::new(100).spectrum_padded(&noise, 0).unwrap(), plain);
    }

    /// Of a flat band from a to b: Q_p = (b + a)/(b − a), and mₙ = (bⁿ⁺¹ − aⁿ⁺¹)/(n + 1).
    #[test]
    fn widths_of_a_flat_band_are_closed_forms() {
        let (a, b) = (0.2_f64, 0.8_f64);
        let df_hz = 1e-4;
        let density = (0..10_000).map(|i| if (a..=b).contains(&(f64::from(i) * df_hz)) { 1.0 } else { 0.0 }).collect();
        let flat = SampledSpectrum { df_hz, density_m2_per_hz: density };
        let m = |n: i32| (b.powi(n + 1) - a.powi(n + 1)) / f64::from(n + 1);
        assert_relative_eq!(flat.peakedness(0.0, 1.0), (b + a) / (b - a), max_relative = 1e-3);
        assert_relative_eq!(flat.width_nu(0.0, 1.0), (m(0) * m(2) / m(1).powi(2) - 1.0).sqrt(), max_relative = 1e-3);
        assert_relative_eq!(flat.width_epsilon(0.0, 1.0), (1.0 - m(2).powi(2) / (m(0) * m(4))).sqrt(), max_relative = 1e-3);
        assert!(
            flat.peakedness(0.9, 1.0).is_nan() && flat.width_nu(0.9, 1.0).is_nan() && flat.width_epsilon(0.9, 1.0).is_nan()
        );
    }

    #[test]
    fn what_is_no_spectrum_is_refused_by_name() {
        for df_hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(SampledSpectrum::new(df_hz, vec![1.0; 9]), Err(SampledError::Step(_))));
        }
        assert_eq!(SampledSpectrum::new(0.1, vec![1.0]), Err(SampledError::TooShort(1)));
        for bad in [-1e-9, f64::NAN, f64::INFINITY, 1e99] {
            assert!(matches!(SampledSpectrum::new(0.1, vec![0.0, bad]), Err(SampledError::Density { index: 1, .. })));
        }
        assert_eq!(SampledSpectrum::new(0.1, vec![0.0, 2.0]).unwrap().moment(1, 0.0, 1.0), 0.1 * 2.0 * 0.1);
    }

    #[test]
    fn still_and_short_records() {
        let still = record(100, 2.0, |_| 3.0);
        assert_eq!(Welch::new(50).spectrum(&still).unwrap().statistics(0.0, 1.0), None);
        assert!(matches!(Welch::new(101).spectrum(&still), Err(RecordError::TooShort { .. })));
        assert!(matches!(Welch::new(0).spectrum(&still), Err(RecordError::TooShort { .. })));
        assert_eq!(Welch::with_segments_of_s(1e9, &still).segment_samples, 100);
        assert_eq!(Welch::with_segments_of_s(f64::NAN, &still).segment_samples, 4);
    }
}
