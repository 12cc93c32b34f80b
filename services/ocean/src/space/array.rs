//! S(f, θ) from an array of virtual gauges by the maximum likelihood method, extended to any linear gauge (Isobe, Kondo and Horikawa 1984:
//! EMLM) and iterated until it explains its own cross spectra (Pawka 1983; Krogstad, Gordon and Miller 1988: IMLM).
//!
//! A film of some metres is shorter than its waves, and shows how they bend the surface rather than how long they are; with the dispersion
//! relation known, that tells their directions. What has been taken off each frame is left out of the gauges and of what they make of each
//! wave alike, so that nothing has to be put back.

use std::f64::consts::TAU;

use rustfft::{FftPlanner, num_complex::Complex64};

use super::directional::DirectionalSpectrum;
use super::film::Film;
use super::gauges::{Gauges, Removed, Sensors};
use super::hermitian::Cholesky;
use super::water::Water;
use super::welch3::{SpaceError, Welch3};
use crate::welch::Taper;

/// An array of virtual gauges and how its cross spectra become directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Array {
    /// The gauges.
    pub gauges: Gauges,
    /// What is missing of each frame.
    pub removed: Removed,
    /// Frames in a segment (half-overlapping, Hann's taper). There should be more segments than gauges; what there is not is left to
    /// [`Self::loading`].
    pub segment_frames: usize,
    /// Frequencies looked at, hertz.
    pub band_hz: (f64, f64),
    /// Directions, evenly spaced.
    pub directions: usize,
    /// Iterations: 0 is EMLM, which spreads waves too far.
    pub iterations: usize,
    /// White noise allowed for, as a share of the gauges' mean variance: keeps cross spectra of few segments from being singular.
    pub loading: f64,
}

impl Array {
    /// Modes up to the third order, 90 directions, 30 iterations, and a loading of a thousandth; segments and band as given.
    #[must_use]
    pub fn new(removed: Removed, segment_frames: usize, band_hz: (f64, f64)) -> Self {
        let gauges = Gauges::Modes { order: 3 };
        Self { gauges, removed, segment_frames, band_hz, directions: 90, iterations: 30, loading: 1e-3 }
    }

    /// S(f, θ) of `film` in `water`. Frequencies at which no wave can run from some direction are left without energy.
    ///
    /// # Errors
    /// [`SpaceError`] where there are too few frames, gauges, or no energy in the band.
    pub fn spectrum(&self, film: &Film, water: &Water) -> Result<DirectionalSpectrum, SpaceError> {
        let (n, frames) = (self.segment_frames, film.shape().frames);
        if n < Welch3::SEGMENT_FRAMES_MIN || frames < n {
            return Err(SpaceError::TooShort { frames, frames_min: n.max(Welch3::SEGMENT_FRAMES_MIN) });
        }
        let sensors = Sensors::new(self.gauges, self.removed, film.shape(), film.cell_m())?;
        let directions = self.directions.clamp(8, 720);
        let df_hz = film.rate_hz() / n as f64;
        let first = (self.band_hz.0 / df_hz).ceil().max(1.0);
        let last = (self.band_hz.1 / df_hz).floor().min(((n - 1) / 2) as f64);
        if !(first <= last) {
            return Err(SpaceError::NoEnergy);
        }
        let bins = first as usize..=last as usize;
        let cross = cross_spectra(&sensors.read(film), frames, n, film.rate_hz(), bins.clone());
        let size = sensors.len();
        let mut density = Vec::with_capacity(directions * cross.len() / (size * size));
        for (m, cross) in bins.zip(cross.chunks_exact(size * size)) {
            let row = Steering::new(&sensors, water, TAU * m as f64 * df_hz, directions)
                .and_then(|steering| steering.solve(cross, self.iterations, self.loading));
            density.extend(row.unwrap_or_else(|| vec![0.0; directions]));
        }
        let all = DirectionalSpectrum::new(first * df_hz, df_hz, directions, density).ok_or(SpaceError::NoEnergy)?;
        if all.variance_m2() > 0.0 { Ok(all) } else { Err(SpaceError::NoEnergy) }
    }
}

/// One-sided cross spectra of `series` (each of so many frames) at each of `bins`, m²/Hz: matrices row by row.
fn cross_spectra(
    series: &[f64],
    frames: usize,
    n: usize,
    rate_hz: f64,
    bins: std::ops::RangeInclusive<usize>,
) -> Vec<Complex64> {
    let taper: Vec<f64> = (0..n).map(|i| Taper::Hann.at((i as f64 + 0.5) / n as f64)).collect();
    let fft = FftPlanner::<f64>::new().plan_fft_forward(n);
    let mut scratch = vec![Complex64::default(); fft.get_inplace_scratch_len()];
    let size = series.len() / frames;
    let mut segments = vec![Complex64::default(); size * n];
    let mut cross = vec![Complex64::default(); bins.clone().count() * size * size];
    let starts: Vec<usize> = (0..=frames - n).step_by(n.div_ceil(2)).collect();
    let scale = 2.0 / (rate_hz * taper.iter().map(|w| w * w).sum::<f64>() * starts.len() as f64);
    for start in starts {
        for (series, segment) in series.chunks_exact(frames).zip(segments.chunks_exact_mut(n)) {
            let series = &series[start..start + n];
            let mean = series.iter().sum::<f64>() / n as f64;
            segment.iter_mut().zip(series).zip(&taper).for_each(|((y, x), w)| *y = Complex64::new((x - mean) * w, 0.0));
        }
        fft.process_with_scratch(&mut segments, &mut scratch);
        for (m, cross) in bins.clone().zip(cross.chunks_exact_mut(size * size)) {
            for i in 0..size {
                for j in 0..size {
                    cross[i * size + j] += scale * segments[i * n + m] * segments[j * n + m].conj();
                }
            }
        }
    }
    cross
}

/// What the gauges make of waves of one frequency from each direction.
struct Steering {
    size: usize,
    vectors: Vec<Complex64>,
    dtheta_rad: f64,
}

impl Steering {
    fn new(sensors: &Sensors, water: &Water, omega_radps: f64, directions: usize) -> Option<Self> {
        let dtheta_rad = TAU / directions as f64;
        let mut vectors = Vec::with_capacity(directions * sensors.len());
        for j in 0..directions {
            let from_rad = j as f64 * dtheta_rad;
            let k = water.wavenumber_radpm(omega_radps, from_rad)?;
            vectors.extend(sensors.transfer([k * from_rad.cos(), k * from_rad.sin()]));
        }
        Some(Self { size: sensors.len(), vectors, dtheta_rad })
    }

    /// S(θ), m²/Hz/rad, of a matrix of cross spectra; `None` where it has no energy.
    fn solve(&self, cross: &[Complex64], iterations: usize, loading: f64) -> Option<Vec<f64>> {
        let measured = self.likelihood(cross, loading)?;
        let mut found = measured.clone();
        for _ in 0..iterations {
            let explained = self.likelihood(&self.cross(&found), loading)?;
            let changed = found.iter().zip(&measured).zip(&explained);
            found = changed.map(|((d, m), e)| d * (m / e.max(1e-12)).clamp(0.2, 5.0)).collect();
            self.normalise(&mut found)?;
        }
        // The gauges' variance is that of all waves together.
        let response: f64 = self.trace(&self.cross(&found));
        let scale = self.trace(cross) / response;
        (scale > 0.0 && scale.is_finite()).then(|| found.iter().map(|d| d * scale).collect())
    }

    /// Capon's estimate 1/hᴴ C⁻¹ h, made 1 over the circle.
    fn likelihood(&self, cross: &[Complex64], loading: f64) -> Option<Vec<f64>> {
        let mut loaded = cross.to_vec();
        let noise = loading.clamp(1e-9, 1.0) * self.trace(cross) / self.size as f64;
        (0..self.size).for_each(|i| loaded[i * self.size + i] += noise);
        let root = Cholesky::of(&loaded, self.size)?;
        let mut work = vec![Complex64::default(); self.size];
        let forms = self.vectors.chunks_exact(self.size).map(|h| 1.0 / root.inverse_form(h, &mut work));
        let mut all: Vec<f64> = forms.collect();
        self.normalise(&mut all)?;
        Some(all)
    }

    fn normalise(&self, all: &mut [f64]) -> Option<()> {
        let sum = all.iter().sum::<f64>() * self.dtheta_rad;
        all.iter_mut().for_each(|d| *d /= sum);
        (sum > 0.0 && sum.is_finite()).then_some(())
    }

    /// The cross spectra of a sea of these densities: the lower triangle.
    fn cross(&self, density: &[f64]) -> Vec<Complex64> {
        let n = self.size;
        let mut cross = vec![Complex64::default(); n * n];
        for (d, h) in density.iter().zip(self.vectors.chunks_exact(n)) {
            for i in 0..n {
                let weighed = h[i] * (d * self.dtheta_rad);
                (0..=i).for_each(|j| cross[i * n + j] += weighed * h[j].conj());
            }
        }
        cross
    }

    fn trace(&self, cross: &[Complex64]) -> f64 {
        (0..self.size).map(|i| cross[i * self.size + i].re).sum()
    }
}
