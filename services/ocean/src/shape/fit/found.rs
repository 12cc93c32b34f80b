//! What a fit gives, or why there is none.

use crate::interval::Interval;
use crate::spectrum::{Jonswap, PiersonMoskowitz, SpectrumError};

/// Why there is no fit.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few lines in the band.
    #[error("{lines} lines of the spectrum are from 0.6 of its peak on in the band, a fit needs {lines_min}")]
    Lines {
        /// Lines there are.
        lines: usize,
        /// Lines needed.
        lines_min: usize,
    },
    /// No energy in the band, or densities that are not finite.
    #[error("the band holds no energy")]
    Still,
    /// The noise given is negative or not finite.
    #[error("noise must be finite and not negative, not {0} m²/Hz")]
    Noise(f64),
    /// The likelihood has no top, or a flat one.
    #[error("the spectrum does not tell the parameters")]
    Undetermined,
}

impl From<SpectrumError> for FitError {
    fn from(_: SpectrumError) -> Self {
        Self::Undetermined
    }
}

/// How well a fit agrees with its estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goodness {
    /// Mean of (ν/2)(Ŝ/E − 1)²: 1 where the estimate scatters about the fit as it should, more where the sea has another shape.
    pub misfit: f64,
    /// What [`Self::misfit`] is above 1, in its own standard deviations: above 3 the shape is wrong. (Neighbouring lines under
    /// one taper resemble each other: counted as if the lines were `joint_dof`/`line_dof` as many.)
    pub misfit_sigmas: f64,
    /// Lines fitted.
    pub lines: usize,
}

/// A JONSWAP spectrum fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JonswapFit {
    /// The likeliest.
    pub sea: Jonswap,
    /// 95 % of H_m0, metres.
    pub h_m0_m: Interval,
    /// 95 % of the peak period, seconds.
    pub t_p_s: Interval,
    /// 95 % of γ, within its range of 1 to 20.
    pub gamma: Interval,
    /// Whether it is one at all.
    pub goodness: Goodness,
}

/// A Pierson-Moskowitz spectrum fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiersonMoskowitzFit {
    /// The likeliest.
    pub sea: PiersonMoskowitz,
    /// 95 % of H_m0, metres.
    pub h_m0_m: Interval,
    /// 95 % of the peak period, seconds.
    pub t_p_s: Interval,
    /// Whether it is one at all.
    pub goodness: Goodness,
}
