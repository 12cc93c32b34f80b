//! One picture of the sea: how long the waves are and along which axis they run. Which way, no single picture tells.

use std::f64::consts::{PI, TAU};

use realfft::RealFftPlanner;
use rustfft::{FftPlanner, num_complex::Complex32};

use super::film::Film;
use super::statistics::less_smear;
use super::welch3::SpaceError;
use crate::welch::Taper;

/// The axis that waves run along: they come from one of two opposite directions, and a picture does not tell from which.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveAxis {
    axis_rad: f64,
}

impl WaveAxis {
    /// Along `rad`, clockwise from north, or its opposite; `None` for what is not finite.
    #[must_use]
    pub fn along(rad: f64) -> Option<Self> {
        rad.is_finite().then(|| Self { axis_rad: rad.rem_euclid(PI) })
    }

    /// The two directions that waves may come from, radians clockwise from north: from 0 to π, and its opposite.
    #[must_use]
    pub fn either_from_rad(self) -> [f64; 2] {
        [self.axis_rad, self.axis_rad + PI]
    }

    /// That of the two which is nearer to a direction known otherwise (the wind's), radians clockwise from north.
    #[must_use]
    pub fn nearer_to_rad(self, from_rad: f64) -> f64 {
        let [one, other] = self.either_from_rad();
        if (from_rad - one).cos() >= 0.0 { one } else { other }
    }
}

/// What a picture says about the waves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot {
    /// Variance, m², under the taper: of a few waves only, and scattered accordingly.
    pub variance_m2: f64,
    /// 2π over the mean wavenumber, metres.
    pub wavelength_mean_m: f64,
    /// 2π over the mean wavenumber weighted by the wavenumber spectrum's fourth power, metres: where the spectrum is highest, to the coarse
    /// grid that a picture has.
    pub wavelength_peak_m: f64,
    /// The axis of the waves, each by its energy.
    pub axis: WaveAxis,
    /// Spread about the axis √((1 − m2)/2) with m2 = √(a2² + b2²) (Kuik et al. 1988, of second moments), radians: waves that run opposite to
    /// each other count as one direction.
    pub axis_spread_rad: f64,
    /// Mean square slope in all.
    pub mss: f64,
    /// Mean square slope along the axis of the steepest slopes.
    pub mss_along: f64,
    /// Mean square slope across it.
    pub mss_across: f64,
}

impl Film {
    /// Frame `index` on its own, under Hann's taper along both sides, less its mean; [`SpaceError::NoEnergy`] where it shows none.
    ///
    /// The picture should be some wavelengths wide. What the taper adds to wavenumbers is taken off: from slopes exactly, from wavelengths
    /// and second moments to first order.
    ///
    /// # Errors
    /// [`SpaceError::TooShort`] where there is no such frame, [`SpaceError::NoEnergy`] where nothing is left of it.
    pub fn snapshot(&self, index: usize) -> Result<Snapshot, SpaceError> {
        let frames = self.shape().frames;
        let frame = self.frame_m(index).ok_or(SpaceError::TooShort { frames, frames_min: index.saturating_add(1) })?;
        let (rows, cols) = (self.shape().rows, self.shape().cols);
        let power = power(frame, rows, cols).ok_or(SpaceError::NoEnergy)?;
        let [dk_north, dk_east] = [rows, cols].map(|n| TAU / (n as f64 * self.cell_m()));
        let smear = [dk_north * dk_north / 3.0, dk_east * dk_east / 3.0];

        let step = dk_north.max(dk_east);
        let mut rings: Vec<[f64; 2]> = Vec::new();
        let (mut variance_m2, mut k_sum, mut axis, mut slopes) = (0.0, 0.0, [0.0; 2], [0.0; 3]);
        for (place, p) in power.iter().enumerate() {
            let (i, j) = (place % rows, place / rows);
            if place == 0 || 2 * i == rows || 2 * j == cols {
                continue;
            }
            let north = dk_north * if 2 * i < rows { i as f64 } else { i as f64 - rows as f64 };
            let east = dk_east * j as f64;
            // Opposite wavenumbers are one; along k_east = 0 both are there.
            let p = f64::from(*p) * if j == 0 { 1.0 } else { 2.0 };
            let square = north * north + east * east;
            let k = square.sqrt();
            variance_m2 += p;
            k_sum += p * k;
            axis[0] += p * (north * north - east * east - smear[0] + smear[1]) / square;
            axis[1] += p * 2.0 * north * east / square;
            slopes[0] += p * (north * north - smear[0]);
            slopes[1] += p * (east * east - smear[1]);
            slopes[2] += p * north * east;
            let ring = (k / step).round() as usize;
            if rings.len() <= ring {
                rings.resize(ring + 1, [0.0; 2]);
            }
            rings[ring][0] += p;
            rings[ring][1] += p * k;
        }
        if variance_m2.is_nan() || variance_m2 <= 0.0 {
            return Err(SpaceError::NoEnergy);
        }
        let fourth = rings.iter().map(|ring| ring[0].powi(4)).sum::<f64>();
        let k_peak = rings.iter().map(|ring| ring[0].powi(3) * ring[1]).sum::<f64>() / fourth;
        let wavelength = |k: f64| TAU / less_smear(k, smear);
        let k_mean = k_sum / variance_m2;
        // The taper turns wavenumbers by σ/k, which takes exp(−2 σ²/k²) of second moments.
        let turned = (-(smear[0] + smear[1]) / (k_mean * k_mean)).exp();
        let m2 = (axis[0].hypot(axis[1]) / variance_m2 / turned).min(1.0);
        let [nn, ee, ne] = slopes;
        let (half_sum, half_difference) = (0.5 * (nn + ee), (0.5 * (nn - ee)).hypot(ne));
        let axis = WaveAxis::along(0.5 * axis[1].atan2(axis[0])).ok_or(SpaceError::NoEnergy)?;
        Ok(Snapshot {
            variance_m2,
            wavelength_mean_m: wavelength(k_mean),
            wavelength_peak_m: wavelength(k_peak),
            axis,
            axis_spread_rad: (0.5 * (1.0 - m2)).sqrt(),
            mss: nn + ee,
            mss_along: half_sum + half_difference,
            mss_across: half_sum - half_difference,
        })
    }
}

/// The variance at each wavenumber, by k_east ≥ 0 and then by k_north as a transform has it.
fn power(frame: &[f32], rows: usize, cols: usize) -> Option<Vec<f32>> {
    let taper = |n: usize| -> Vec<f32> { (0..n).map(|i| Taper::Hann.at((i as f64 + 0.5) / n as f64) as f32).collect() };
    let (taper_rows, taper_cols) = (taper(rows), taper(cols));
    let mean = (frame.iter().map(|z| f64::from(*z)).sum::<f64>() / frame.len() as f64) as f32;
    let along = RealFftPlanner::<f32>::new().plan_fft_forward(cols);
    let (mut input, mut output) = (along.make_input_vec(), along.make_output_vec());
    let mut all = vec![Complex32::default(); rows * output.len()];
    for (i, row) in frame.chunks_exact(cols).enumerate() {
        let weight = taper_rows[i];
        input.iter_mut().zip(row).zip(&taper_cols).for_each(|((x, z), w)| *x = (z - mean) * w * weight);
        along.process(&mut input, &mut output).ok()?;
        output.iter().enumerate().for_each(|(j, x)| all[j * rows + i] = *x);
    }
    FftPlanner::<f32>::new().plan_fft_forward(rows).process(&mut all);
    let squares = |taper: &[f32]| taper.iter().map(|w| w * w).sum::<f32>();
    let scale = 1.0 / (squares(&taper_rows) * squares(&taper_cols) * frame.len() as f32);
    Some(all.iter().map(|x| scale * x.norm_sqr()).collect())
}

#[cfg(test)]
mod tests {
    use super::super::film::Shape;
    use super::super::synthetic::{PlaneWave, Sea, film, off_deg};
    use super::*;
    use crate::dispersion::{Depth, wavelength_m};

    const SHAPE: Shape = Shape { rows: 80, cols: 100, frames: 1 };

    /// One wave: its length, its slope (ka)²/2, all of it along the axis, from either end of which it may come.
    #[test]
    fn a_wave_has_its_length_and_its_axis() {
        for from_deg in [0.0, 30.0, 90.0, 135.0, 200.0, 300.0_f64] {
            let wave = PlaneWave::from(0.1, 0.7, from_deg.to_radians(), 0.4, Depth::DEEP);
            let found = film(&[wave], SHAPE, 0.2, 4.0).snapshot(0).unwrap();
            let length_m = wavelength_m(1.0 / 0.7, Depth::DEEP);
            assert!((found.wavelength_mean_m / length_m - 1.0).abs() < 0.01, "{found:?} {length_m}");
            assert!((found.wavelength_peak_m / length_m - 1.0).abs() < 0.05, "{found:?} {length_m}");
            assert!(off_deg(found.axis.nearer_to_rad(from_deg.to_radians()), from_deg.to_radians()).abs() < 0.5, "{found:?}");
            assert!(found.axis_spread_rad < 0.1, "{found:?}");
            let mss = 0.5 * (0.1 * TAU / length_m).powi(2);
            assert!((found.mss / mss - 1.0).abs() < 0.02 && (found.mss_along / mss - 1.0).abs() < 0.02, "{found:?} {mss}");
            let [one, other] = found.axis.either_from_rad();
            assert!((0.0..PI).contains(&one) && (other - one - PI).abs() < 1e-12);
        }
    }

    /// Twelve pictures of a sea (T_p 1.5 s, s 10) of 20 m: on average its mean length, slope, axis, and m2 = s(s − 1)/((s + 1)(s + 2)).
    #[test]
    fn pictures_of_a_sea_have_its_length_slope_and_axis() {
        let sea = Sea::new(0.1, 1.5, 10.0, 160.0);
        let shape = Shape { rows: 100, cols: 100, frames: 1 };
        let all: Vec<_> = (0..12).map(|seed| sea.film(shape, 0.2, 4.0, seed).snapshot(0).unwrap()).collect();
        let mean = |f: &dyn Fn(&Snapshot) -> f64| all.iter().map(f).sum::<f64>() / all.len() as f64;
        let k = mean(&|s| TAU / s.wavelength_mean_m * s.variance_m2) / mean(&|s| s.variance_m2);
        assert!((k / (sea.moment_k(1) / sea.moment_k(0)) - 1.0).abs() < 0.04, "{k}");
        let mss = mean(&|s| s.mss);
        assert!((mss / sea.moment_k(2) - 1.0).abs() < 0.1, "{mss} {}", sea.moment_k(2));
        let axis = mean(&|s| off_deg(s.axis.nearer_to_rad(sea.from_rad), sea.from_rad));
        assert!(axis.abs() < 3.0, "{axis}");
        let spread = mean(&|s| s.axis_spread_rad);
        let expected = (0.5 * (1.0 - 90.0 / 132.0_f64)).sqrt();
        println!(
            "pictures: k {k:.3} mss {mss:.5} axis {axis:.2} spread {spread:.3}, for {:.3} {:.5} 0 {expected:.3}",
            sea.moment_k(1) / sea.moment_k(0),
            sea.moment_k(2)
        );
        assert!((spread / expected - 1.0).abs() < 0.1, "{spread} {expected}");
    }

    #[test]
    fn still_pictures_and_none() {
        let still = Film::new(vec![3.0; 16], Shape { rows: 4, cols: 4, frames: 1 }, 0.1, 1.0).unwrap();
        assert_eq!(still.snapshot(0), Err(SpaceError::NoEnergy));
        assert!(matches!(still.snapshot(usize::MAX), Err(SpaceError::TooShort { frames: 1, .. })));
        assert!(WaveAxis::along(f64::NAN).is_none());
        assert_eq!(WaveAxis::along(1.0).unwrap().nearer_to_rad(4.0), 1.0 + PI);
    }
}
