//! What sea to simulate, and the wave components that it is made of.
//!
//! A JONSWAP sea is cut into frequency bins; each bin becomes one component with exactly the bin's energy, at the bin's mean
//! frequency, with a direction from the spreading function and a random phase. Amplitudes are not random, so that 4 √m0 is
//! exactly the height asked for whatever the seed: an estimator can then be judged against a known number.

use std::f64::consts::TAU;

use halcyon_ocean::{CosTwoS, Depth, Jonswap, Spectrum, dispersion};
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};

/// Lowest and highest frequency of a JONSWAP sea, as multiples of the peak's. Below is nothing; above is 1 % of the energy, in
/// waves shorter than a ninth of the peak's, which the cut-off hands to the rest.
const BAND: (f64, f64) = (0.5, 3.0);
/// Steeper than this a wave breaks in deep water (Michell, 1893): H/λ.
const STEEPNESS_MAX: f64 = 0.142;
/// Frequencies are whole multiples of 2⁻²⁴ Hz, so that phases at any Unix time are reduced without rounding.
pub(crate) const STEPS_PER_HZ: f64 = 16_777_216.0;

/// The kind of sea.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SeaKind {
    /// A mirror.
    Still,
    /// One long-crested sine wave.
    Regular,
    /// A wind sea: JONSWAP with directional spreading.
    Jonswap,
}

/// The simulated sea (`[sim.sea]`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SeaConfig {
    /// `still`, `regular` or `jonswap`.
    pub kind: SeaKind,
    /// Crest-to-trough height of regular waves, significant height H_s of a JONSWAP sea; metres.
    pub height_m: f64,
    /// Period of regular waves, peak period of a JONSWAP sea; seconds.
    pub period_s: f64,
    /// Where the waves come from, degrees clockwise from true north.
    pub direction_from_deg: f64,
    /// JONSWAP peak enhancement γ, 1 to 20; 3.3 is the usual one.
    pub gamma: f64,
    /// Exponent s of the cos-2s spreading, 0.5 to 1000: 10 for wind waves, 75 for old swell.
    pub spreading_s: f64,
    /// Water depth, metres.
    pub depth_m: f64,
    /// Wave components of a JONSWAP sea, 16 to 256. More cost more and repeat less.
    pub components: usize,
}

impl Default for SeaConfig {
    /// A small lake in a light breeze.
    fn default() -> Self {
        Self {
            kind: SeaKind::Jonswap,
            height_m: 0.05,
            period_s: 1.3,
            direction_from_deg: 240.0,
            gamma: 3.3,
            spreading_s: 10.0,
            depth_m: 10.0,
            components: 80,
        }
    }
}

/// Why a sea cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SeaError {
    /// A number out of its range.
    #[error("sea {key} must be {expected}, not {value}")]
    Range {
        /// Which key.
        key: &'static str,
        /// Its range.
        expected: &'static str,
        /// What it is.
        value: f64,
    },
    /// Waves that would break.
    #[error("waves of {height_m} m and {period_s} s are {steepness:.3} steep and would break: at most {STEEPNESS_MAX}")]
    Steep {
        /// Height, metres.
        height_m: f64,
        /// Period, seconds.
        period_s: f64,
        /// Height over wavelength.
        steepness: f64,
    },
}

impl SeaConfig {
    /// No waves at all.
    #[must_use]
    pub fn still() -> Self {
        Self { kind: SeaKind::Still, height_m: 0.0, ..Self::default() }
    }

    /// Regular waves of `height_m` and `period_s` from `direction_from_deg`.
    #[must_use]
    pub fn regular(height_m: f64, period_s: f64, direction_from_deg: f64) -> Self {
        Self { kind: SeaKind::Regular, height_m, period_s, direction_from_deg, ..Self::default() }
    }

    /// A JONSWAP sea of H_s `height_m` and T_p `period_s` from `direction_from_deg`, otherwise as the default.
    #[must_use]
    pub fn jonswap(height_m: f64, period_s: f64, direction_from_deg: f64) -> Self {
        Self { kind: SeaKind::Jonswap, height_m, period_s, direction_from_deg, ..Self::default() }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`SeaError`] for the first that is out of range (NaN is), or for waves steeper than water allows.
    pub fn validate(&self) -> Result<(), SeaError> {
        let range = |key, value: f64, low: f64, high: f64, expected| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(SeaError::Range { key, expected, value }) }
        };
        range("height_m", self.height_m, 0.0, 30.0, "from 0 to 30")?;
        range("period_s", self.period_s, 0.3, 30.0, "from 0.3 to 30")?;
        range("direction_from_deg", self.direction_from_deg, -360.0, 360.0, "from -360 to 360")?;
        range("gamma", self.gamma, 1.0, 20.0, "from 1 to 20")?;
        range("spreading_s", self.spreading_s, 0.5, 1000.0, "from 0.5 to 1000")?;
        range("depth_m", self.depth_m, 0.1, 11_000.0, "from 0.1 to 11000")?;
        range("components", self.components as f64, 16.0, 256.0, "from 16 to 256")?;
        let steepness = self.height_m / dispersion::wavelength_m(self.period_s, self.depth());
        if self.kind != SeaKind::Still && steepness > STEEPNESS_MAX {
            return Err(SeaError::Steep { height_m: self.height_m, period_s: self.period_s, steepness });
        }
        Ok(())
    }

    fn depth(&self) -> Depth {
        Depth::from_m(self.depth_m).unwrap_or(Depth::DEEP)
    }

    /// The wave components; none for still water. The same `seed` gives the same sea on every machine.
    ///
    /// # Errors
    /// As [`Self::validate`].
    pub(crate) fn components(&self, seed: u64) -> Result<Vec<Component>, SeaError> {
        self.validate()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let towards_rad = (self.direction_from_deg + 180.0).to_radians();
        let depth = self.depth();
        match self.kind {
            _ if self.height_m == 0.0 => Ok(Vec::new()),
            SeaKind::Still => Ok(Vec::new()),
            SeaKind::Regular => {
                let phase_rad = rng.random_range(0.0..TAU);
                Ok(vec![Component::new(0.5 * self.height_m, 1.0 / self.period_s, towards_rad, phase_rad, depth)])
            }
            SeaKind::Jonswap => {
                let bins = self.bins()?;
                // Mean of the direction distribution's slices, dealt to the frequencies at random: every seed has the same
                // spreading, and no seed has one frequency from two directions, which would stand still.
                let mut offsets_rad = self.direction_offsets_rad()?;
                offsets_rad.shuffle(&mut rng);
                let wave = |(bin, offset_rad): (Bin, f64)| {
                    let phase_rad = rng.random_range(0.0..TAU);
                    Component::new((2.0 * bin.variance_m2).sqrt(), bin.mean_hz, towards_rad + offset_rad, phase_rad, depth)
                };
                Ok(bins.into_iter().zip(offsets_rad).map(wave).collect())
            }
        }
    }

    /// Cuts the spectrum into bins: their edges are even half in energy and half in octaves, so that the peak is resolved and the
    /// tail isn't forgotten.
    fn bins(&self) -> Result<Vec<Bin>, SeaError> {
        const STEPS: usize = 8000;
        let range = |key, value| SeaError::Range { key, expected: "such that a JONSWAP spectrum exists", value };
        let spectrum = Jonswap::new(self.height_m, self.period_s, self.gamma)
            .map_err(|_| range("height_m, period_s, gamma", self.gamma))?;
        let (low_hz, high_hz) = (BAND.0 * spectrum.peak_hz(), BAND.1 * spectrum.peak_hz());
        let ratio = (high_hz / low_hz).powf(1.0 / STEPS as f64);
        let slices: Vec<(f64, f64)> = (0..STEPS)
            .map(|i| {
                let f_hz = low_hz * ratio.powf(i as f64 + 0.5);
                (f_hz, spectrum.density_m2_per_hz(f_hz) * f_hz * ratio.ln())
            })
            .collect();
        let total_m2: f64 = slices.iter().map(|slice| slice.1).sum();
        // The band's energy is stretched to that of the whole spectrum.
        let stretch = (self.height_m / 4.0).powi(2) / total_m2;
        let mut bins = vec![Bin { variance_m2: 0.0, mean_hz: 0.0 }; self.components];
        let mut below_m2 = 0.0;
        for (i, (f_hz, variance_m2)) in slices.into_iter().enumerate() {
            let place = 0.5 * (below_m2 + 0.5 * variance_m2) / total_m2 + 0.5 * (i as f64 + 0.5) / STEPS as f64;
            let bin = &mut bins[((place * self.components as f64) as usize).min(self.components - 1)];
            bin.variance_m2 += variance_m2 * stretch;
            bin.mean_hz += variance_m2 * stretch * f_hz;
            below_m2 += variance_m2;
        }
        // Far below the peak a bin may underflow to nothing; it is left out with the energy it doesn't have.
        bins.retain(|bin| bin.variance_m2 > 0.0);
        bins.iter_mut().for_each(|bin| bin.mean_hz /= bin.variance_m2);
        Ok(bins)
    }

    /// The middle of each of `components` equal slices of the spreading function, radians from the mean direction, ascending.
    fn direction_offsets_rad(&self) -> Result<Vec<f64>, SeaError> {
        const STEPS: u32 = 7200;
        let spreading = CosTwoS::new(self.spreading_s).map_err(|_| SeaError::Range {
            key: "spreading_s",
            expected: "from 0.5 to 1000",
            value: self.spreading_s,
        })?;
        let step_rad = TAU / f64::from(STEPS);
        let mut offsets_rad = Vec::with_capacity(self.components);
        let mut below = 0.0;
        for i in 0..STEPS {
            let offset_rad = (f64::from(i) + 0.5) * step_rad - 0.5 * TAU;
            below += spreading.density_per_rad(offset_rad) * step_rad;
            while offsets_rad.len() < self.components && below * self.components as f64 >= offsets_rad.len() as f64 + 0.5 {
                offsets_rad.push(offset_rad);
            }
        }
        // The sum may end a rounding error short of 1.
        offsets_rad.resize(self.components, 0.0);
        Ok(offsets_rad)
    }
}

/// One slice of the spectrum.
#[derive(Debug, Clone)]
struct Bin {
    variance_m2: f64,
    /// While it is being filled: the sum of frequency times variance.
    mean_hz: f64,
}

/// One long-crested wave: a cos(k · x − ω t + ε), t in seconds of Unix time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Amplitude a, metres.
    pub amplitude_m: f64,
    /// Wavenumber towards the north, radians per metre.
    pub north_radpm: f64,
    /// Wavenumber towards the east, radians per metre.
    pub east_radpm: f64,
    /// Phase ε, radians.
    pub phase_rad: f64,
    /// Frequency in steps of 2⁻²⁴ Hz.
    frequency_steps: u64,
}

impl Component {
    fn new(amplitude_m: f64, frequency_hz: f64, towards_rad: f64, phase_rad: f64, depth: Depth) -> Self {
        let frequency_steps = (frequency_hz * STEPS_PER_HZ).round() as u64;
        let omega_radps = TAU * frequency_steps as f64 / STEPS_PER_HZ;
        let k_radpm = dispersion::wavenumber_radpm(omega_radps, depth);
        let (east, north) = towards_rad.sin_cos();
        Self { amplitude_m, north_radpm: k_radpm * north, east_radpm: k_radpm * east, phase_rad, frequency_steps }
    }

    /// Frequency, hertz.
    #[must_use]
    pub fn frequency_hz(&self) -> f64 {
        self.frequency_steps as f64 / STEPS_PER_HZ
    }

    /// ε − ω t, radians, in (−2π, 2π) and a bit: reduced in whole numbers, since Unix nanoseconds times a frequency does not fit a
    /// double's 53 bits.
    #[must_use]
    pub(crate) fn time_phase_rad(&self, whole_s: i64, fraction_s: f64) -> f64 {
        // Modulo 2⁶⁴ and then modulo 2²⁴ (whole turns): exact, for times before 1970 too.
        let steps = self.frequency_steps.wrapping_mul(whole_s as u64) & (STEPS_PER_HZ as u64 - 1);
        let turns = steps as f64 / STEPS_PER_HZ + self.frequency_hz() * fraction_s;
        self.phase_rad - TAU * turns.fract()
    }
}
