//! The highest crest over an area and a time, not just at a point.
//!
//! A probe sees the highest wave that passes it; over an area the highest is higher, since somewhere a group is at its focus. The number of
//! excursions above a high level z (in √m0) is on average the Euler characteristic of the set above it (Adler 1981; Adler & Taylor 2007), which for
//! a box of sides X, Y, D of a Gaussian field is (Fedele 2012, *J. Phys. Oceanogr.* 42; Piterbarg 1996 for its leading term)
//!
//! χ(z) = \[N_V (z² − 1) + N_S z + N_B\] exp(−z²/2) + Q(z),
//!
//! with N_V waves in the volume, N_S on its faces, N_B along its edges, and the normal tail Q. The highest is under z where there is no such excursion:
//! exp(−χ), as for rare events (Poisson).

use std::f64::consts::TAU;

use super::distribution::normal_exceedance;
use super::maximum::Extreme;
use crate::dispersion::{Depth, wavenumber_radpm};

/// One plane wave of a directional sea.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveComponent {
    /// Frequency, hertz.
    pub f_hz: f64,
    /// Where it goes, radians from the region's first side towards its second.
    pub towards_rad: f64,
    /// Its variance, m².
    pub variance_m2: f64,
}

/// A box in space and time; a side of 0 takes that dimension away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// First side X, metres.
    pub x_m: f64,
    /// Second side Y, metres.
    pub y_m: f64,
    /// Duration D, seconds.
    pub duration_s: f64,
}

/// The highest crest of a sea over a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpaceTime {
    /// √m0, metres.
    pub sigma_m: f64,
    /// Waves in the volume N_V.
    pub waves_in_volume: f64,
    /// Waves on the faces N_S.
    pub waves_on_faces: f64,
    /// Waves along the edges N_B.
    pub waves_on_edges: f64,
    /// Tayfun's steepness μ: a linear z becomes a crest z + ½ μ z². 0 is a linear sea.
    pub steepness: f64,
}

impl SpaceTime {
    /// Of the components of a sea over `depth`, by their moments m_ijl = Σ kₓⁱ k_yʲ ωˡ m²; `None` without energy or where the region is not finite and at
    /// least 0 in each side.
    ///
    /// Moments with k² need the spectrum's tail: give components up to the shortest waves that count as crests, and no further.
    #[must_use]
    pub fn of(
        components: impl IntoIterator<Item = WaveComponent>,
        depth: Depth,
        region: Region,
        steepness: f64,
    ) -> Option<Self> {
        let sides = [region.x_m, region.y_m, region.duration_s];
        if sides.iter().any(|side| !(side.is_finite() && *side >= 0.0)) {
            return None;
        }
        let mut m0 = 0.0;
        let mut gradient = [[0.0; 3]; 3];
        for c in components {
            let omega_radps = TAU * c.f_hz;
            let k_radpm = wavenumber_radpm(omega_radps, depth);
            let rates = [k_radpm * c.towards_rad.cos(), k_radpm * c.towards_rad.sin(), -omega_radps];
            if !(c.variance_m2 > 0.0 && c.variance_m2.is_finite() && rates.iter().all(|r| r.is_finite())) {
                continue;
            }
            m0 += c.variance_m2;
            for (row, a) in gradient.iter_mut().zip(rates) {
                row.iter_mut().zip(rates).for_each(|(sum, b)| *sum += a * b * c.variance_m2);
            }
        }
        if m0 <= 0.0 {
            return None;
        }
        // Covariance of the field's rates of change over its variance.
        let g = gradient.map(|row| row.map(|x| x / m0));
        let minor = |i: usize, j: usize| (g[i][i] * g[j][j] - g[i][j] * g[j][i]).max(0.0).sqrt();
        let determinant = g[0][0] * (g[1][1] * g[2][2] - g[1][2] * g[2][1]) - g[0][1] * (g[1][0] * g[2][2] - g[1][2] * g[2][0])
            + g[0][2] * (g[1][0] * g[2][1] - g[1][1] * g[2][0]);
        let edges: f64 = (0..3).map(|i| g[i][i].sqrt() * sides[i]).sum();
        let faces: f64 = [(0, 1), (0, 2), (1, 2)].iter().map(|&(i, j)| minor(i, j) * sides[i] * sides[j]).sum();
        Some(Self {
            sigma_m: m0.sqrt(),
            waves_in_volume: determinant.max(0.0).sqrt() * sides.iter().product::<f64>() / TAU.powi(2),
            waves_on_faces: faces / TAU.powf(1.5),
            waves_on_edges: edges / TAU,
            steepness: steepness.max(0.0),
        })
    }

    /// χ(z), the expected Euler characteristic of what is above z √m0.
    #[must_use]
    pub fn euler_characteristic(&self, z: f64) -> f64 {
        let waves = self.waves_in_volume * (z * z - 1.0) + self.waves_on_faces * z + self.waves_on_edges;
        waves * (-0.5 * z * z).exp() + normal_exceedance(z)
    }

    /// The highest crest: its expectation and interval. Good where the region holds a few waves; at a point it is meaningless.
    #[must_use]
    pub fn highest(&self) -> Extreme {
        // Below its peak χ says nothing of maxima: lower levels are exceeded at least as surely.
        let peak = (0..600)
            .map(|i| f64::from(i) * 0.01)
            .max_by(|a, b| self.euler_characteristic(*a).total_cmp(&self.euler_characteristic(*b)));
        let peak = peak.unwrap_or(0.0);
        let survival = |crest: f64| {
            let z = 2.0 * crest / (1.0 + (1.0 + 2.0 * self.steepness * crest).sqrt());
            -(-self.euler_characteristic(z.max(peak))).exp_m1()
        };
        let found = Extreme::of(&survival);
        Extreme {
            expected_m: found.expected_m * self.sigma_m,
            low_m: found.low_m * self.sigma_m,
            high_m: found.high_m * self.sigma_m,
        }
    }
}

#[cfg(test)]
mod tests;
