//! Directions of greatest likelihood from cross spectra.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

use super::gauges::Sensors;
use super::hermitian::Cholesky;
use super::water::Water;

/// Noise allowed for where cross spectra are turned: what is less than that of a wave is not made up.
const FOCUS_LOADING: f64 = 1e-6;

/// One frequency: its cross spectra, and what the gauges make of waves of it from each direction.
pub(super) struct Steering<'a> {
    size: usize,
    vectors: Vec<Complex64>,
    dtheta_rad: f64,
    /// Measured, m²/Hz.
    cross: &'a [Complex64],
    loading: f64,
    /// The root of H Hᴴ, a little noise with it.
    gram: Option<Cholesky>,
}

impl<'a> Steering<'a> {
    /// `None` where waves of that frequency cannot run from some direction, or have no energy.
    pub(super) fn new(
        sensors: &Sensors,
        water: &Water,
        omega_radps: f64,
        directions: usize,
        cross: &'a [Complex64],
        loading: f64,
    ) -> Option<Self> {
        let dtheta_rad = TAU / directions as f64;
        let mut vectors = Vec::with_capacity(directions * sensors.len());
        for j in 0..directions {
            let from_rad = j as f64 * dtheta_rad;
            let k = water.wavenumber_radpm(omega_radps, from_rad)?;
            vectors.extend(sensors.transfer([k * from_rad.cos(), k * from_rad.sin()]));
        }
        let loading = if loading.is_finite() { loading.clamp(1e-9, 1.0) } else { 1e-3 };
        let mut new = Self { size: sensors.len(), vectors, dtheta_rad, cross, loading, gram: None };
        new.gram = new.loaded(new.model(&vec![1.0; directions]), FOCUS_LOADING);
        (new.trace(cross) > 0.0).then_some(new)
    }

    /// S(θ), m²/Hz/rad, by Capon's estimate from `cross`, and changed so many times by the ratio of what it should give to what it gives.
    pub(super) fn iterated(&self, cross: &[Complex64], iterations: usize) -> Option<Vec<f64>> {
        let measured = self.capon(cross)?;
        let mut found = measured.clone();
        for _ in 0..iterations {
            let explained = self.capon(&self.model(&found))?;
            let changed = found.iter().zip(&measured).zip(&explained);
            // Steps are held in: where hardly anything is, ratios are noise.
            found = changed.map(|((d, m), e)| d * (m / e.max(1e-12)).clamp(0.2, 5.0)).collect();
            self.normalise(&mut found)?;
        }
        self.scaled(&found)
    }

    /// As much of it as the gauges' variance is that of all waves together, less the noise allowed for.
    fn scaled(&self, density: &[f64]) -> Option<Vec<f64>> {
        let scale = self.trace(self.cross) / self.trace(&self.model(density));
        (scale > 0.0 && scale.is_finite()).then(|| density.iter().map(|d| d * scale).collect())
    }

    /// `cross` with the noise allowed for, as its root.
    fn loaded(&self, mut cross: Vec<Complex64>, loading: f64) -> Option<Cholesky> {
        let noise = loading * self.trace(&cross) / self.size as f64;
        (0..self.size).for_each(|i| cross[i * self.size + i] += noise);
        Cholesky::of(&cross, self.size)
    }

    /// Capon's estimate 1/hᴴ C⁻¹ h, made 1 over the circle.
    fn capon(&self, cross: &[Complex64]) -> Option<Vec<f64>> {
        let root = self.loaded(cross.to_vec(), self.loading)?;
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
    fn model(&self, density: &[f64]) -> Vec<Complex64> {
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

    /// The cross spectra of `self` and of its neighbours, as the gauges would have had them at this frequency (Wang and Kaveh 1985): each turned
    /// by the matrix that best makes what the gauges make of waves there what they make of them here.
    pub(super) fn focused<'b>(&self, near: impl Iterator<Item = &'b Self>) -> Option<Vec<Complex64>>
    where
        'a: 'b,
    {
        let n = self.size;
        let mut sum = vec![Complex64::default(); n * n];
        for other in near {
            // T = H₀ Hᴴ (H Hᴴ + ε)⁻¹, row by row: (H Hᴴ + ε)⁻¹ is Hermitian, and its product with the conjugate row is the row's conjugate.
            let root = other.gram.as_ref()?;
            let mut turn = vec![Complex64::default(); n * n];
            for (h0, h) in self.vectors.chunks_exact(n).zip(other.vectors.chunks_exact(n)) {
                for i in 0..n {
                    for j in 0..n {
                        turn[i * n + j] += h0[i].conj() * h[j];
                    }
                }
            }
            let mut work = vec![Complex64::default(); n];
            for row in turn.chunks_exact_mut(n) {
                root.solve(row, &mut work);
                row.iter_mut().zip(&work).for_each(|(t, w)| *t = w.conj() * self.dtheta_rad);
            }
            for i in 0..n {
                work.iter_mut()
                    .enumerate()
                    .for_each(|(j, w)| *w = (0..n).map(|k| turn[i * n + k] * other.cross[k * n + j]).sum());
                for j in 0..=i {
                    sum[i * n + j] += (0..n).map(|k| work[k] * turn[j * n + k].conj()).sum::<Complex64>();
                }
            }
        }
        Some(sum)
    }
}
