//! The spectrum over wavenumber and frequency, S(k_north, k_east, f), of a film.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;
use rustfft::{FftPlanner, num_complex::Complex32};

use super::film::{Film, Shape};
use crate::welch::Taper;

/// Wavenumbers whose frames are taken through time together: a cache line or two of each frame.
const BLOCK: usize = 16;

/// Why a spectrum of a film cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SpaceError {
    /// Fewer frames than a segment, or a segment too short to hold a wave.
    #[error("film has {frames} frames, needs at least {frames_min}")]
    TooShort {
        /// Frames there are.
        frames: usize,
        /// Frames needed.
        frames_min: usize,
    },
    /// An array of no gauges, of more than are worth it, or of more than there are cells.
    #[error("an array needs from {gauges_min} to {gauges_max} gauges, not {gauges}")]
    Gauges {
        /// Asked for.
        gauges: usize,
        /// Fewest.
        gauges_min: usize,
        /// Most.
        gauges_max: usize,
    },
    /// A still sea, or no frequency within the limits.
    #[error("there is no wave energy at the frequencies looked at")]
    NoEnergy,
}

/// How the spectrum of a film is estimated: segments of so many frames that overlap by half, under Hann's taper in time and along both sides
/// of the film.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Welch3 {
    /// Frames in a segment: the resolution is about 1.5 times the rate over it.
    pub segment_frames: usize,
}

impl Welch3 {
    /// A segment of fewer frames cannot tell a wave from its mirror image.
    pub const SEGMENT_FRAMES_MIN: usize = 8;

    /// Segments of about `segment_s` seconds at the film's rate, at most the whole film.
    #[must_use]
    pub fn with_segments_of_s(segment_s: f64, film: &Film) -> Self {
        let frames = (segment_s * film.rate_hz()).round().max(0.0) as usize;
        Self { segment_frames: frames.max(Self::SEGMENT_FRAMES_MIN).min(film.shape().frames) }
    }

    /// The spectrum of `film`. Each segment's mean over time is taken off every wavenumber, so that what stands still (a camera's fault) is
    /// no wave. Frames that no longer fill a segment at the end are left out. Single precision: rounding is some 1e-6 of the variance.
    ///
    /// # Errors
    /// [`SpaceError::TooShort`] where the film is shorter than a segment, or that than eight frames.
    pub fn spectrum(&self, film: &Film) -> Result<Spectrum3, SpaceError> {
        let (shape, n) = (film.shape(), self.segment_frames);
        if n < Self::SEGMENT_FRAMES_MIN || shape.frames < n {
            return Err(SpaceError::TooShort { frames: shape.frames, frames_min: n.max(Self::SEGMENT_FRAMES_MIN) });
        }
        let mut spectrum = Spectrum3::empty(shape, n, film.cell_m(), film.rate_hz());
        let plane = spectrum.plane_len();
        // Space first, once for each frame: segments overlap, and share it.
        let frames = spatial(film).ok_or(SpaceError::TooShort { frames: shape.frames, frames_min: n })?;

        let taper = taper(n);
        let fft = FftPlanner::<f32>::new().plan_fft_forward(n);
        let mut scratch = vec![Complex32::default(); fft.get_inplace_scratch_len()];
        let mut series = vec![Complex32::default(); BLOCK * shape.frames];
        let mut segment = vec![Complex32::default(); n];
        let starts: Vec<usize> = (0..=shape.frames - n).step_by(n.div_ceil(2)).collect();
        let squares = |taper: &[f32]| taper.iter().map(|w| f64::from(*w).powi(2)).sum::<f64>();
        // Parseval: all cells together hold the mean square of what is tapered.
        let tapers = squares(&taper) * squares(&self::taper(shape.rows)) * squares(&self::taper(shape.cols));
        let scale = 1.0 / (tapers * (shape.frame_cells() * n) as f64 * starts.len() as f64);
        for first in (0..plane).step_by(BLOCK) {
            let width = BLOCK.min(plane - first);
            for (t, frame) in frames.chunks_exact(plane).enumerate() {
                for (b, x) in frame[first..first + width].iter().enumerate() {
                    series[b * shape.frames + t] = *x;
                }
            }
            for b in 0..width {
                let series = &series[b * shape.frames..(b + 1) * shape.frames];
                let scale = (scale * spectrum.sides(first + b)) as f32;
                let power = &mut spectrum.variance_m2[(first + b) * n..(first + b + 1) * n];
                for start in &starts {
                    let series = &series[*start..start + n];
                    let mean = series.iter().sum::<Complex32>() / n as f32;
                    segment.iter_mut().zip(series).zip(&taper).for_each(|((y, x), w)| *y = (x - mean) * w);
                    fft.process_with_scratch(&mut segment, &mut scratch);
                    power.iter_mut().zip(&segment).for_each(|(p, x)| *p += scale * x.norm_sqr());
                }
            }
        }
        Ok(spectrum)
    }
}

/// Hann's taper of n samples, the same from both ends.
fn taper(n: usize) -> Vec<f32> {
    (0..n).map(|i| Taper::Hann.at((i as f64 + 0.5) / n as f64) as f32).collect()
}

/// The tapered transform of each frame: k_east from 0 up, in each k_north as a transform has it. `None` only if plans do not fit their own
/// buffers.
fn spatial(film: &Film) -> Option<Vec<Complex32>> {
    let Shape { rows, cols, .. } = film.shape();
    let along = RealFftPlanner::<f32>::new().plan_fft_forward(cols);
    let across = FftPlanner::<f32>::new().plan_fft_forward(rows);
    let (mut input, mut output, mut scratch) = (along.make_input_vec(), along.make_output_vec(), along.make_scratch_vec());
    let mut scratch_across = vec![Complex32::default(); across.get_inplace_scratch_len()];
    let (taper_rows, taper_cols) = (taper(rows), taper(cols));
    let plane = rows * output.len();
    let mut all = vec![Complex32::default(); plane * film.shape().frames];
    for (frame, out) in film.elevation_m().chunks_exact(rows * cols).zip(all.chunks_exact_mut(plane)) {
        for (i, row) in frame.chunks_exact(cols).enumerate() {
            let weight = taper_rows[i];
            input.iter_mut().zip(row).zip(&taper_cols).for_each(|((x, z), w)| *x = z * w * weight);
            along.process_with_scratch(&mut input, &mut output, &mut scratch).ok()?;
            for (j, x) in output.iter().enumerate() {
                out[j * rows + i] = *x;
            }
        }
        across.process_with_scratch(out, &mut scratch_across);
    }
    Some(all)
}

/// Variance over wavenumber and frequency, cell by cell.
///
/// A wave a cos(k·x − ωt), ω > 0, is at (−k, ω) of a transform and, the film being real, at (k, −ω). Half the wavenumbers hold all, then, and
/// the sign of the frequency tells the way a wave goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum3 {
    /// By k_east ≥ 0, then by k_north, then by frequency, the latter two as a transform has them: 0, 1, …, −2, −1.
    pub(super) variance_m2: Vec<f32>,
    pub(super) rows: usize,
    pub(super) cols: usize,
    pub(super) segment_frames: usize,
    pub(super) cell_m: f64,
    pub(super) rate_hz: f64,
}

impl Spectrum3 {
    fn empty(shape: Shape, segment_frames: usize, cell_m: f64, rate_hz: f64) -> Self {
        let variance_m2 = vec![0.0; (shape.cols / 2 + 1) * shape.rows * segment_frames];
        Self { variance_m2, rows: shape.rows, cols: shape.cols, segment_frames, cell_m, rate_hz }
    }

    fn plane_len(&self) -> usize {
        self.rows * (self.cols / 2 + 1)
    }

    /// How often a stored wavenumber counts: for itself and for its opposite, of which [`Self::grid`] tells one only.
    fn sides(&self, index: usize) -> f64 {
        let (i, j) = (index % self.rows, index / self.rows);
        if j == 0 && i == 0 { 1.0 } else { 2.0 }
    }

    /// Distances between wavenumbers to the north and to the east, radians per metre.
    #[must_use]
    pub fn dk_radpm(&self) -> [f64; 2] {
        [self.rows, self.cols].map(|n| TAU / (n as f64 * self.cell_m))
    }

    /// Distance between frequencies, hertz.
    #[must_use]
    pub fn df_hz(&self) -> f64 {
        self.rate_hz / self.segment_frames as f64
    }

    /// Frequencies above 0 and below half the rate: `df_hz` times 1, 2, …, this.
    #[must_use]
    pub fn frequencies(&self) -> usize {
        (self.segment_frames - 1) / 2
    }

    /// How much Hann's taper widens what is seen of one wavenumber: its mean square to the north and to the east, rad²/m². Each wave's line
    /// becomes three with a sixth, two thirds and a sixth of its variance.
    #[must_use]
    pub fn smear_rad2pm2(&self) -> [f64; 2] {
        self.dk_radpm().map(|dk| dk * dk / 3.0)
    }

    /// Every wavenumber stored, as the components to the north and to the east of where waves of positive frequency come **from**, radians
    /// per metre. `None` for those at half the sampling rate, whose sign is not known, and for those whose opposite takes it all.
    pub(super) fn grid(&self) -> impl Iterator<Item = Option<[f64; 2]>> + use<> {
        let [dk_north, dk_east] = self.dk_radpm();
        let (rows, cols) = (self.rows, self.cols);
        (0..self.plane_len()).map(move |index| {
            let (i, j) = (index % rows, index / rows);
            let north = if 2 * i < rows { i as f64 } else { i as f64 - rows as f64 };
            let known = 2 * i != rows && 2 * j != cols && (j > 0 || north >= 0.0);
            known.then_some([north * dk_north, j as f64 * dk_east])
        })
    }

    /// Every wavenumber of [`Self::grid`] with its variances by frequency as a transform has them.
    pub(super) fn wavenumbers(&self) -> impl Iterator<Item = ([f64; 2], &[f32])> {
        self.grid().zip(self.variance_m2.chunks_exact(self.segment_frames)).filter_map(|(k, variances)| Some((k?, variances)))
    }

    /// Every cell of non-zero frequency: wavenumber to the north and to the east of where its waves go **to**, radians per metre, frequency
    /// above 0, hertz, and variance, m².
    pub fn cells(&self) -> impl Iterator<Item = SpectralCell> {
        let (n, df_hz) = (self.segment_frames, self.df_hz());
        self.wavenumbers().flat_map(move |([north, east], variances)| {
            (1..=self.frequencies()).flat_map(move |m| {
                let cell = |sign: f64, variance_m2: f32| SpectralCell {
                    k_north_radpm: sign * north,
                    k_east_radpm: sign * east,
                    f_hz: m as f64 * df_hz,
                    variance_m2: f64::from(variance_m2),
                };
                [cell(-1.0, variances[m]), cell(1.0, variances[n - m])]
            })
        })
    }

    /// Variance of all cells, m².
    #[must_use]
    pub fn variance_m2(&self) -> f64 {
        self.cells().map(|cell| cell.variance_m2).sum()
    }
}

/// A cell of a [`Spectrum3`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralCell {
    /// Wavenumber to the north, of where the waves go to, radians per metre.
    pub k_north_radpm: f64,
    /// To the east.
    pub k_east_radpm: f64,
    /// Frequency, above 0, hertz.
    pub f_hz: f64,
    /// Variance, m².
    pub variance_m2: f64,
}
