//! Directions of greatest likelihood from cross spectra.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

use super::gauges::Sensors;
use super::hermitian::Cholesky;
use super::water::Water;

/// One frequency: its cross spectra, and what the gauges make of waves of it from each direction.
pub(super) struct Steering<'a> {
    size: usize,
    vectors: Vec<Complex64>,
    dtheta_rad: f64,
    /// Measured, m²/Hz.
    cross: &'a [Complex64],
    loading: f64,
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
        let new = Self { size: sensors.len(), vectors, dtheta_rad, cross, loading };
        (new.trace(cross) > 0.0).then_some(new)
    }

    /// S(θ), m²/Hz/rad, by Capon's estimate, and changed so many times by the ratio of what it should give to what it gives.
    pub(super) fn iterated(&self, iterations: usize) -> Option<Vec<f64>> {
        let measured = self.capon(self.cross)?;
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
    fn loaded(&self, mut cross: Vec<Complex64>) -> Option<Cholesky> {
        let noise = self.loading * self.trace(&cross) / self.size as f64;
        (0..self.size).for_each(|i| cross[i * self.size + i] += noise);
        Cholesky::of(&cross, self.size)
    }

    /// Capon's estimate 1/hᴴ C⁻¹ h, made 1 over the circle.
    fn capon(&self, cross: &[Complex64]) -> Option<Vec<f64>> {
        let root = self.loaded(cross.to_vec())?;
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

    /// The two sides of the likelihood's slope by the density from each direction, times the density's whole: hᴴ M⁻¹ C M⁻¹ h and hᴴ M⁻¹ h
    /// with the model's M. They are the same where the likelihood is greatest.
    fn slopes(&self, shape: &[f64], out: &mut [[f64; 2]]) -> Option<()> {
        let n = self.size;
        let model = self.model(shape);
        // The whole that gives the gauges their variance; M is that much larger than the model of the shape.
        let whole = self.trace(self.cross) / self.trace(&model);
        if !(whole > 0.0 && whole.is_finite()) {
            return None;
        }
        let root = self.loaded(model)?;
        let mut work = vec![Complex64::default(); n];
        for (h, out) in self.vectors.chunks_exact(n).zip(out) {
            let form = root.solve(h, &mut work);
            let mut measured = 0.0;
            for i in 0..n {
                let row = &self.cross[i * n..i * n + i];
                // Hermitian: twice the real part of the lower triangle.
                let sum = row.iter().zip(&work).map(|(c, y)| c * y).sum::<Complex64>();
                measured += 2.0 * (work[i].conj() * sum).re + self.cross[i * n + i].re * work[i].norm_sqr();
            }
            out[0] += measured / whole;
            out[1] += form;
        }
        Some(())
    }
}

/// The densities of greatest likelihood at each frequency, m²/Hz/rad: from the same in all directions by `iterations` multiplicative steps, with
/// the slopes of `shared` frequencies to either side.
pub(super) fn fit(all: &[Option<Steering<'_>>], iterations: usize, shared: usize) -> Vec<Option<Vec<f64>>> {
    let Some(first) = all.iter().flatten().next() else { return vec![None; all.len()] };
    let directions = first.vectors.len() / first.size;
    let mut shapes = vec![vec![1.0 / TAU; directions]; all.len()];
    for _ in 0..iterations {
        let slopes: Vec<Option<Vec<[f64; 2]>>> = all
            .iter()
            .zip(&shapes)
            .map(|(steering, shape)| {
                let mut slopes = vec![[0.0; 2]; directions];
                steering.as_ref()?.slopes(shape, &mut slopes)?;
                Some(slopes)
            })
            .collect();
        for (i, (shape, steering)) in shapes.iter_mut().zip(all).enumerate() {
            let near = &slopes[i.saturating_sub(shared)..(i + shared + 1).min(slopes.len())];
            for (j, d) in shape.iter_mut().enumerate() {
                let [measured, modelled] =
                    near.iter().flatten().fold([0.0, 0.0], |sum, slopes| [sum[0] + slopes[j][0], sum[1] + slopes[j][1]]);
                if modelled > 0.0 {
                    *d *= (measured / modelled).clamp(0.1, 10.0);
                }
            }
            if let Some(steering) = steering
                && steering.normalise(shape).is_none()
            {
                shape.fill(1.0 / TAU);
            }
        }
    }
    all.iter().zip(&shapes).map(|(steering, shape)| steering.as_ref()?.scaled(shape)).collect()
}
