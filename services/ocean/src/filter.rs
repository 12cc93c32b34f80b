//! Splitting a record by frequency.

pub use realfft::num_complex::Complex;

use crate::plans;
use crate::record::{Record, remove_line};

/// The part of `record` between `low_hz` and `high_hz`, metres, without shift in time.
///
/// The trend is taken off, the record is continued by its mirror image at both ends (which shifts no mean level, as a point
/// reflection at a crest would, and lets no drift jump), and its Fourier components are kept between the two frequencies,
/// halved at each (raised-cosine edges a tenth of the frequency wide to either side). `low_hz` of 0 keeps all that is slow, `high_hz` of
/// infinity all that is fast.
#[must_use]
pub fn band_pass(record: &Record, low_hz: f64, high_hz: f64) -> Vec<f64> {
    let mirrored = Mirrored::of(record);
    let weighed = |(i, bin): (usize, &Complex<f64>)| bin * band(mirrored.frequency_hz(i), low_hz, high_hz);
    mirrored.rebuilt(mirrored.bins().iter().enumerate().map(weighed).collect())
}

/// The weight of a frequency in [`band_pass`].
#[must_use]
pub fn band(f_hz: f64, low_hz: f64, high_hz: f64) -> f64 {
    above(f_hz, low_hz) * (1.0 - above(f_hz, high_hz))
}

/// Fourier components of a record that its trend has been taken off and that its mirror image continues: what [`band_pass`] works on.
#[derive(Debug, Clone)]
pub struct Mirrored {
    middle: Vec<f64>,
    bins: Vec<Complex<f64>>,
    df_hz: f64,
}

impl Mirrored {
    /// Of a record.
    #[must_use]
    pub fn of(record: &Record) -> Self {
        let mut middle = record.samples_m().to_vec();
        remove_line(&mut middle);
        let mut extended = Vec::with_capacity(2 * middle.len());
        extended.extend_from_slice(&middle);
        extended.extend(middle.iter().rev());
        let df_hz = record.rate_hz() / extended.len() as f64;
        let forward = plans::forward(extended.len());
        let mut bins = forward.make_output_vec();
        if forward.process(&mut extended, &mut bins).is_err() {
            bins.clear();
        }
        Self { middle, bins, df_hz }
    }

    /// Components from 0 to half the rate.
    #[must_use]
    pub fn bins(&self) -> &[Complex<f64>] {
        &self.bins
    }

    /// Frequency of component `index`, hertz.
    #[must_use]
    pub fn frequency_hz(&self, index: usize) -> f64 {
        index as f64 * self.df_hz
    }

    /// Mean square of a component of white noise of unit variance.
    #[must_use]
    pub fn unit_power(&self) -> f64 {
        2.0 * self.middle.len() as f64
    }

    /// A record from other components, as many as [`Self::bins`].
    #[must_use]
    pub fn rebuilt(&self, mut bins: Vec<Complex<f64>>) -> Vec<f64> {
        let length = 2 * self.middle.len();
        let inverse = plans::inverse(length);
        bins.iter_mut().for_each(|bin| *bin /= length as f64);
        let mut extended = inverse.make_output_vec();
        // A real signal's mean and Nyquist components are real; the inverse insists on it.
        for end in [0, bins.len().saturating_sub(1)] {
            if let Some(bin) = bins.get_mut(end) {
                bin.im = 0.0;
            }
        }
        if inverse.process(&mut bins, &mut extended).is_err() {
            return self.middle.clone();
        }
        extended.truncate(self.middle.len());
        extended
    }
}

/// 0 well under `edge_hz`, 1 well above, a raised cosine between.
fn above(f_hz: f64, edge_hz: f64) -> f64 {
    if edge_hz <= 0.0 {
        return 1.0;
    }
    let place = ((f_hz / edge_hz - 0.9) / 0.2).clamp(0.0, 1.0);
    0.5 - 0.5 * (std::f64::consts::PI * place).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn check(signal: impl Fn(f64) -> f64, low_hz: f64, high_hz: f64, expected: impl Fn(f64) -> f64, tolerance: f64) {
        let samples: Vec<f64> = (0..600).map(|i| signal(f64::from(i) * 0.2)).collect();
        let found = band_pass(&Record::new(samples, 5.0).unwrap(), low_hz, high_hz);
        assert_eq!(found.len(), 600);
        // The ends are extrapolated by the filter; judge the rest.
        for (i, y) in found.iter().enumerate().skip(100).take(400) {
            let t = i as f64 * 0.2;
            assert!((y - expected(t)).abs() < tolerance, "at {t}: {y} for {}", expected(t));
        }
    }

    #[test]
    fn it_keeps_what_is_inside_and_drops_what_is_not() {
        let swell = |t: f64| (TAU * 0.25 * t + 0.3).sin();
        let ripple = |t: f64| (TAU * 1.1 * t).sin();
        let drift = |t: f64| 3.0 - 0.02 * t + 0.5 * (TAU * t / 200.0).sin();
        // The sine's own trend over the record goes too: up to 3 % of its amplitude at the ends.
        check(swell, 0.08, 0.6, swell, 0.04);
        check(|t| swell(t) + ripple(t) + drift(t), 0.08, 0.6, swell, 0.07);
        check(|t| swell(t) + ripple(t), 0.6, f64::INFINITY, ripple, 0.05);
        check(drift, 0.08, 0.6, |_| 0.0, 0.02);
        check(|_| 4.0, 0.08, 0.6, |_| 0.0, 1e-9);
    }

    #[test]
    fn the_shortest_record_does_no_harm() {
        assert_eq!(band_pass(&Record::new(vec![1.0, 1.0, 1.0, 1.0], 5.0).unwrap(), 0.1, 1.0).len(), 4);
    }
}
