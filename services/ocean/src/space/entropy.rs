//! The maximum entropy method: the smoothest direction function of given first moments (Lygre and Krogstad 1986, *J. Phys. Oceanogr.* 16).

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

use super::directional::DirectionalSpectrum;
use super::moments::FourierMoments;
use super::welch3::SpaceError;

/// Points in a direction's sector: the function's peaks may be narrower than that.
const POINTS: usize = 8;
/// Moments of one single direction leave no entropy; so near to it they are taken.
const NARROWEST: f64 = 0.9999;

/// Density per radian at each of `directions` evenly spaced directions from north on: mean of its sector, 1 over the circle.
///
/// Moments that no function has (sampling gives such) are drawn in to the nearest that one has.
#[must_use]
pub fn maximum_entropy(moments: &FourierMoments, directions: usize) -> Vec<f64> {
    let directions = directions.max(4);
    let finite =
        |re: f64, im: f64| if re.is_finite() && im.is_finite() { Complex64::new(re, im) } else { Complex64::default() };
    let (mut c1, mut c2) = (finite(moments.a1, moments.b1), finite(moments.a2, moments.b2));
    if c1.norm() > NARROWEST {
        c1 *= NARROWEST / c1.norm();
    }
    // |c2 − c1²| ≤ 1 − |c1|²: the covariance matrix of the moments has no negative value.
    let (off, room) = (c2 - c1 * c1, NARROWEST * (1.0 - c1.norm_sqr()));
    if off.norm() > room {
        c2 = c1 * c1 + off * (room / off.norm());
    }
    let phi1 = (c1 - c2 * c1.conj()) / (1.0 - c1.norm_sqr());
    let phi2 = c2 - c1 * phi1;
    let dtheta = TAU / directions as f64;
    let mut all: Vec<f64> = (0..directions)
        .map(|j| {
            let at = |i: usize| {
                let theta = (j as f64 + (i as f64 + 0.5) / POINTS as f64 - 0.5) * dtheta;
                let turn = Complex64::from_polar(1.0, -theta);
                1.0 / (1.0 - phi1 * turn - phi2 * turn * turn).norm_sqr().max(1e-12)
            };
            (0..POINTS).map(at).sum::<f64>()
        })
        .collect();
    let scale = 1.0 / (all.iter().sum::<f64>() * dtheta);
    all.iter_mut().for_each(|d| *d *= scale);
    all
}

impl DirectionalSpectrum {
    /// By maximum entropy from the moments of evenly spaced frequencies within `low_hz` and `high_hz`, over `directions` directions.
    ///
    /// # Errors
    /// [`SpaceError::NoEnergy`] where there are none, or none with energy.
    pub fn by_entropy(
        moments: &[FourierMoments],
        (low_hz, high_hz): (f64, f64),
        directions: usize,
    ) -> Result<Self, SpaceError> {
        let inside: Vec<_> = moments.iter().filter(|m| m.f_hz >= low_hz && m.f_hz <= high_hz).collect();
        let first = inside.first().ok_or(SpaceError::NoEnergy)?;
        let df_hz = inside.get(1).map_or(first.f_hz, |second| second.f_hz - first.f_hz);
        let density = inside.iter().flat_map(|m| {
            let energy = m.density_m2_per_hz.max(0.0);
            maximum_entropy(m, directions).into_iter().map(move |d| energy * d)
        });
        let all = Self::new(first.f_hz, df_hz, directions.max(4), density.collect()).ok_or(SpaceError::NoEnergy)?;
        if all.variance_m2() > 0.0 { Ok(all) } else { Err(SpaceError::NoEnergy) }
    }
}
