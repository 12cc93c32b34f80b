//! An evenly sampled record of surface elevation, checked once so that nothing after has to.

/// Why a series is no record.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// The sampling rate is unusable.
    #[error("sampling rate must be finite and above 0 Hz, not {rate_hz} Hz")]
    Rate {
        /// As given, hertz.
        rate_hz: f64,
    },
    /// Too few samples, none included.
    #[error("record has {samples} samples, needs at least {samples_min}")]
    TooShort {
        /// Samples given.
        samples: usize,
        /// Samples needed.
        samples_min: usize,
    },
    /// NaN, infinite, or so large that its square would be.
    #[error("sample {index} of the record is {value}, which is no elevation")]
    NotFinite {
        /// Index of the first such sample.
        index: usize,
        /// The sample.
        value: f64,
    },
}

/// Elevation, metres positive up, at a constant rate. At least [`Record::SAMPLES_MIN`] samples, all finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    samples_m: Vec<f64>,
    rate_hz: f64,
}

impl Record {
    /// Fewer samples than this cannot hold one wave between two crossings.
    pub const SAMPLES_MIN: usize = 4;
    /// Larger magnitudes are refused: their squares would overflow.
    const MAGNITUDE_MAX: f64 = 1e100;

    /// Checks and wraps `samples_m` taken `rate_hz` times a second.
    ///
    /// # Errors
    /// [`RecordError`] for a rate that is not positive, fewer than four samples, or a sample that is not finite.
    pub fn new(samples_m: impl Into<Vec<f64>>, rate_hz: f64) -> Result<Self, RecordError> {
        let samples_m = samples_m.into();
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Err(RecordError::Rate { rate_hz });
        }
        if samples_m.len() < Self::SAMPLES_MIN {
            return Err(RecordError::TooShort { samples: samples_m.len(), samples_min: Self::SAMPLES_MIN });
        }
        let bad = |x: f64| x.is_nan() || x.abs() > Self::MAGNITUDE_MAX;
        // Counting first, which has no exit on the way, is many samples at a time.
        if samples_m.iter().map(|x| usize::from(bad(*x))).sum::<usize>() > 0
            && let Some((index, &value)) = samples_m.iter().enumerate().find(|(_, x)| bad(**x))
        {
            return Err(RecordError::NotFinite { index, value });
        }
        Ok(Self { samples_m, rate_hz })
    }

    /// The samples, metres, oldest first.
    #[must_use]
    pub fn samples_m(&self) -> &[f64] {
        &self.samples_m
    }

    /// Samples per second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Number of samples over the rate, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.samples_m.len() as f64 / self.rate_hz
    }

    /// Mean, metres.
    #[must_use]
    pub fn mean_m(&self) -> f64 {
        mean(&self.samples_m)
    }

    /// Mean square about the mean, m².
    #[must_use]
    pub fn variance_m2(&self) -> f64 {
        let mean_m = self.mean_m();
        self.samples_m.iter().map(|x| (x - mean_m).powi(2)).sum::<f64>() / self.samples_m.len() as f64
    }

    /// Skewness ⟨x³⟩/⟨x²⟩^1.5 about the mean: above 0 where crests are higher than troughs are deep; NaN for a flat record.
    #[must_use]
    pub fn skewness(&self) -> f64 {
        self.standard_moment(3)
    }

    /// Kurtosis ⟨x⁴⟩/⟨x²⟩² about the mean: 3 for a Gaussian sea, 1.5 for a sine; NaN for a flat record.
    #[must_use]
    pub fn kurtosis(&self) -> f64 {
        self.standard_moment(4)
    }

    fn standard_moment(&self, order: i32) -> f64 {
        let (mean_m, deviation_m) = (self.mean_m(), self.variance_m2().sqrt());
        self.samples_m.iter().map(|x| ((x - mean_m) / deviation_m).powi(order)).sum::<f64>() / self.samples_m.len() as f64
    }

    /// The record less its mean.
    #[must_use]
    pub fn without_mean(mut self) -> Self {
        let mean_m = self.mean_m();
        self.samples_m.iter_mut().for_each(|x| *x -= mean_m);
        self
    }

    /// The record less its least-squares straight line: tide, drift and mean level.
    #[must_use]
    pub fn without_trend(mut self) -> Self {
        remove_line(&mut self.samples_m);
        self
    }
}

pub(crate) fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// Subtracts the least-squares straight line in place.
pub(crate) fn remove_line(samples: &mut [f64]) {
    let n = samples.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let level = mean(samples);
    let (mut covariance, mut spread) = (0.0, 0.0);
    for (i, x) in samples.iter().enumerate() {
        let t = i as f64 - middle;
        covariance += t * (x - level);
        spread += t * t;
    }
    let slope = if spread > 0.0 { covariance / spread } else { 0.0 };
    for (i, x) in samples.iter_mut().enumerate() {
        *x -= level + slope * (i as f64 - middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_record_is_refused_by_name() {
        let good = vec![0.0; 10];
        for rate_hz in [0.0, -2.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Record::new(good.clone(), rate_hz), Err(RecordError::Rate { .. })));
        }
        assert_eq!(Record::new(Vec::new(), 2.0), Err(RecordError::TooShort { samples: 0, samples_min: 4 }));
        for bad in [f64::NAN, f64::INFINITY, -1e200] {
            let error = Record::new(vec![0.0, 0.0, 0.0, bad, f64::NAN], 2.0).unwrap_err();
            assert!(matches!(error, RecordError::NotFinite { index: 3, .. }), "{error}");
        }
    }

    /// Of a sine ⟨sin⁴⟩/⟨sin²⟩² = (3/8)/(1/4); of ones and zeros with share p: (1 − 2p)/√(p(1 − p)) and 1/(p(1 − p)) − 3.
    #[test]
    fn shapes_have_their_moments() {
        let sine: Vec<f64> = (0..1000).map(|i| 2.0 + 0.3 * (std::f64::consts::TAU * f64::from(i) / 50.0).sin()).collect();
        let sine = Record::new(sine, 5.0).unwrap();
        assert!(sine.skewness().abs() < 1e-9 && (sine.kurtosis() - 1.5).abs() < 1e-9);
        let steps: Vec<f64> = (0..1000).map(|i| if i % 5 == 0 { 1.0 } else { 0.0 }).collect();
        let steps = Record::new(steps, 5.0).unwrap();
        assert!((steps.skewness() - 0.6 / 0.4).abs() < 1e-9 && (steps.kurtosis() - (1.0 / 0.16 - 3.0)).abs() < 1e-9);
        assert!(Record::new(vec![1.0; 9], 5.0).unwrap().skewness().is_nan());
    }

    #[test]
    fn a_straight_line_is_no_sea() {
        let line: Vec<f64> = (0..101).map(|i| 3.0 - 0.25 * f64::from(i)).collect();
        let level = Record::new(line, 5.0).unwrap().without_trend();
        assert!(level.samples_m().iter().all(|x| x.abs() < 1e-12));
    }
}
