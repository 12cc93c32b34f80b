//! S(f, θ) from an array of virtual gauges of a film by the maximum likelihood method, extended to any linear gauge (Capon 1969; Isobe, Kondo
//! and Horikawa 1984: EMLM) and changed until it gives what was found (Pawka 1983; Krogstad, Gordon and Miller 1988: IMLM).
//!
//! A film of some metres is shorter than its waves, and shows how they bend the surface rather than how long they are; with the dispersion
//! relation known, that tells their directions. What has been taken off each frame is left out of the gauges and of what they make of each
//! wave alike, so that nothing has to be put back.

use std::f64::consts::TAU;

use rustfft::{FftPlanner, num_complex::Complex64};

use super::directional::DirectionalSpectrum;
use super::film::Film;
use super::gauges::{Gauges, Removed, Sensors};
use super::likelihood::Steering;
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
    /// Frames in a segment (half-overlapping, Hann's taper).
    pub segment_frames: usize,
    /// Frequencies looked at, hertz. Without planes little is left of long waves: what leaks to frequencies well below the peak is taken for
    /// large waves there.
    pub band_hz: (f64, f64),
    /// Directions, evenly spaced.
    pub directions: usize,
    /// Changes of the first estimate: 0 is EMLM, which spreads waves too far; 30 will do.
    pub iterations: usize,
    /// Frequencies to either side whose cross spectra are turned to each and added to its own (Wang and Kaveh 1985). The method wants more
    /// segments than gauges, or it spreads waves too far; turning spreads them by some percent itself. 2 for a minute's film of half-minute
    /// segments, 0 for one of four minutes.
    pub focused_bins: usize,
    /// White noise allowed for, as a share of the gauges' mean variance: keeps cross spectra of few segments from being singular.
    pub loading: f64,
}

impl Array {
    /// Four by four gauges of 3 x 3 cells, 90 directions, 30 iterations, two frequencies to either side; segments and band as given.
    #[must_use]
    pub fn new(removed: Removed, segment_frames: usize, band_hz: (f64, f64)) -> Self {
        Self {
            gauges: Gauges::Points { side: 4, cells: 3 },
            removed,
            segment_frames,
            band_hz,
            directions: 90,
            iterations: 30,
            focused_bins: 2,
            loading: 1e-3,
        }
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
        // Written so that a limit of NaN is none.
        if !(self.band_hz.0 <= self.band_hz.1 && first <= last) {
            return Err(SpaceError::NoEnergy);
        }
        let bins = first as usize..=last as usize;
        let cross = cross_spectra(&sensors.read(film), frames, n, film.rate_hz(), bins.clone());
        let steering: Vec<_> = bins
            .zip(cross.chunks_exact(sensors.len() * sensors.len()))
            .map(|(m, cross)| Steering::new(&sensors, water, TAU * m as f64 * df_hz, directions, cross, self.loading))
            .collect();
        let rows = steering.iter().enumerate().map(|(i, here)| {
            let here = here.as_ref()?;
            let near =
                i.saturating_sub(self.focused_bins)..i.saturating_add(self.focused_bins).saturating_add(1).min(steering.len());
            here.iterated(&here.focused(steering[near].iter().flatten())?, self.iterations)
        });
        let density = rows.flat_map(|row| row.unwrap_or_else(|| vec![0.0; directions])).collect();
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
