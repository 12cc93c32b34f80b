//! Simulated water: a surface that is a pure function of place and time.
//!
//! Two processes with the same configuration and seed see the same water, so that simulated cameras need share no memory. Linear
//! theory: a sum of sine waves on water of uniform depth; elevation is positive up, about the mean level at 0.

use halcyon_model::Stamp;
use nalgebra::Vector2;

use crate::sea::{Component, SeaConfig, SeaError, SeaKind};

/// The water.
#[derive(Debug, Clone, PartialEq)]
pub struct Water {
    components: Vec<Component>,
    true_h_s_m: f64,
}

/// The surface at one place and time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Height above mean level, metres, positive up.
    pub elevation_m: f64,
    /// Rise over run towards north and east.
    pub slope: Vector2<f64>,
    /// Velocity of the surface upwards, metres per second.
    pub rise_mps: f64,
}

impl Water {
    /// The water of `config`, its phases from `seed`.
    ///
    /// # Errors
    /// [`SeaError`] for a configuration out of range.
    pub fn new(config: &SeaConfig, seed: u64) -> Result<Self, SeaError> {
        let components = config.components(seed)?;
        let true_h_s_m = match config.kind {
            SeaKind::Still => 0.0,
            SeaKind::Regular => config.height_m,
            SeaKind::Jonswap => 4.0 * components.iter().map(|c| 0.5 * c.amplitude_m * c.amplitude_m).sum::<f64>().sqrt(),
        };
        Ok(Self { components, true_h_s_m })
    }

    /// The true significant height, metres: H of regular waves, 4 √m0 of a JONSWAP sea, 0 of still water.
    #[must_use]
    pub fn true_h_s_m(&self) -> f64 {
        self.true_h_s_m
    }

    /// The waves that it is the sum of; none when still.
    #[must_use]
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// No elevation exceeds this, metres: the sum of all amplitudes.
    #[must_use]
    pub fn elevation_bound_m(&self) -> f64 {
        self.components.iter().map(|c| c.amplitude_m).sum()
    }

    /// Length of the shortest wave, metres; infinite when still.
    #[must_use]
    pub fn shortest_wavelength_m(&self) -> f64 {
        let k_radpm = self.components.iter().map(|c| c.north_radpm.hypot(c.east_radpm)).fold(0.0, f64::max);
        std::f64::consts::TAU / k_radpm
    }

    /// Height of the surface above mean level, metres, at a place in the fleet's local frame.
    #[must_use]
    pub fn elevation_m(&self, north_m: f64, east_m: f64, stamp: Stamp) -> f64 {
        let (whole_s, fraction_s) = split(stamp);
        self.components
            .iter()
            .map(|c| {
                let phase_rad = c.north_radpm * north_m + c.east_radpm * east_m + c.time_phase_rad(whole_s, fraction_s);
                c.amplitude_m * phase_rad.cos()
            })
            .sum()
    }

    /// Elevation with its derivatives at a place in the fleet's local frame.
    #[must_use]
    pub fn surface(&self, north_m: f64, east_m: f64, stamp: Stamp) -> SurfacePoint {
        let (whole_s, fraction_s) = split(stamp);
        let mut point = SurfacePoint { elevation_m: 0.0, slope: Vector2::zeros(), rise_mps: 0.0 };
        for c in &self.components {
            let phase_rad = c.north_radpm * north_m + c.east_radpm * east_m + c.time_phase_rad(whole_s, fraction_s);
            let (sin, cos) = phase_rad.sin_cos();
            point.elevation_m += c.amplitude_m * cos;
            point.slope -= c.amplitude_m * sin * Vector2::new(c.north_radpm, c.east_radpm);
            point.rise_mps += c.amplitude_m * std::f64::consts::TAU * c.frequency_hz() * sin;
        }
        point
    }
}

/// Whole seconds and the fraction in [0, 1) of Unix time.
pub(crate) fn split(stamp: Stamp) -> (i64, f64) {
    const NANOS: i64 = 1_000_000_000;
    (stamp.as_nanos().div_euclid(NANOS), stamp.as_nanos().rem_euclid(NANOS) as f64 * 1e-9)
}
