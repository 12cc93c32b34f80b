//! Ripples that the rotors made, told from the sea by their pattern.
//!
//! Rotors press on the water below them and send short rings outwards: capillary-gravity waves of some 5 to 40 cm, 2 to 6 Hz. (The waves of the
//! thesis's outdoor experiments were such, 8.2.2.) They say nothing of the sea and must not count as waves.
//!
//! *How they are told apart.* The Riesz transform R = F⁻¹\[i k/|k| F η\] gives each cell of a band-passed elevation η a vector along the
//! direction in which the waves there travel, of the wave's own variance. A sea is alike everywhere: its ⟨R Rᵀ⟩ is one matrix T, whatever its directions.
//! Rings at the azimuth of unit vector u from the point below the aircraft have q u uᵀ. So over cells i at radii of bin b
//!
//! ⟨R Rᵀ⟩ᵢ = T + q_b uᵢ uᵢᵀ,
//!
//! linear in T and q_b, solved by least squares. It needs to see the point from enough sides: from one alone a ring and a plane wave look alike.
//! The standard error comes from leaving out one of twelve sectors at a time (jackknife).

mod band;
mod fit;

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

pub use band::ElevationGrid;

use self::band::{Band, BandFilter};
use self::fit::{Sums, outward};
use super::{Finding, Flag, Test};
use crate::dispersion::GRAVITY_MPS2;

/// Where and how strong ripples are looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct DownwashLimits {
    /// Wavelengths of ripples, metres. 0.05 to 0.4. What is under 2.5 cells cannot be seen and is left out.
    pub wavelength_m: RangeInclusive<f64>,
    /// The fit starts so far from the point below, metres: nearer a ring has no direction yet. 0.2.
    pub radius_min_m: f64,
    /// Share of rings in the variance of these wavelengths, less two standard errors, that is suspect. 0.1.
    pub share_suspect: f64,
    /// Share of rings in the variance of all wavelengths that fails. 0.3.
    pub share_of_all_fail: f64,
    /// Height 4 √(ring variance) that does not matter, metres. 0.002.
    pub height_min_m: f64,
    /// Rings of a larger share in their surroundings are masked. 0.5.
    pub mask_share: f64,
}

impl Default for DownwashLimits {
    fn default() -> Self {
        Self {
            wavelength_m: 0.05..=0.4,
            radius_min_m: 0.2,
            share_suspect: 0.1,
            share_of_all_fail: 0.3,
            height_min_m: 0.002,
            mask_share: 0.5,
        }
    }
}

/// Why a pattern cannot be looked for.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum DownwashError {
    /// No frames, or too many.
    #[error("needs 1 to {frames_max} frames, not {frames}")]
    Frames {
        /// Given.
        frames: usize,
        /// Taken at most.
        frames_max: usize,
    },
    /// A grid that is no rectangle, too small, too large, or unlike the first.
    #[error(
        "frame {frame} has {cells} cells in rows of {columns}: needs a rectangle of at least {side_min} a side, as the first, and at most {cells_max} cells"
    )]
    Shape {
        /// Its index.
        frame: usize,
        /// Cells given.
        cells: usize,
        /// Cells in a row.
        columns: usize,
        /// Least number of rows and columns.
        side_min: usize,
        /// Largest number of cells.
        cells_max: usize,
    },
    /// Cells that cannot show the shortest ripples twice over.
    #[error("cells of {cell_m} m cannot show ripples of up to {wavelength_max_m} m")]
    Cell {
        /// As given, metres.
        cell_m: f64,
        /// The longest ripple asked for, metres.
        wavelength_max_m: f64,
    },
    /// The point below the aircraft is nowhere.
    #[error("the point below the aircraft, ({x_m}, {y_m}) m, is not finite")]
    Point {
        /// Along the columns, metres.
        x_m: f64,
        /// Along the rows, metres.
        y_m: f64,
    },
    /// Less than a quarter of the cells have an elevation.
    #[error("frame {frame} has elevations in {share:.2} of its cells, needs 0.25")]
    Empty {
        /// Its index.
        frame: usize,
        /// Share of cells with an elevation.
        share: f64,
    },
}

/// Rings at one distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingBin {
    /// Inner radius, metres.
    pub from_m: f64,
    /// Outer radius, metres.
    pub to_m: f64,
    /// Variance of the rings there, m².
    pub ring_variance_m2: f64,
    /// Its share in the variance of these wavelengths there.
    pub share: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Downwash {
    /// Variance of the ripple wavelengths, rings and sea, m².
    pub band_variance_m2: f64,
    /// Variance of the rings, m².
    pub ring_variance_m2: f64,
    /// Share of rings in the variance of the ripple wavelengths; slightly negative by chance where there are none.
    pub ring_share: f64,
    /// Its standard error.
    pub ring_share_sigma: f64,
    /// Share of rings in the variance of all wavelengths about the mean plane.
    pub ring_share_of_all: f64,
    /// By distance, nearest first.
    pub bins: Vec<RingBin>,
    /// For each cell whether rings make up most of its ripples: to be left out. All false unless rings were found.
    pub mask: Vec<bool>,
    /// Share of cells masked.
    pub masked_share: f64,
    /// Whether rings run outwards: positive for outwards, negative for inwards, near 0 for standing or none; `None` without a sequence that is fast enough.
    pub outward: Option<f64>,
    /// The flag with its words.
    pub finding: Finding,
}

/// Most frames that [`detect`] takes.
pub const FRAMES_MAX: usize = 256;

/// Looks for rings about `below_m`, the point below the aircraft: metres along the columns and along the rows from the first cell's centre. It may lie outside the grid.
///
/// `frames` are grids of the same shape, `interval_s` apart where there are several (NaN where unknown): more frames make a steadier answer, and fast ones (twice the
/// ripples' frequency) say whether rings run outwards.
///
/// # Errors
/// [`DownwashError`] for frames that cannot be judged. Where the point is seen from too few sides the finding says so instead.
pub fn detect(
    frames: &[ElevationGrid<'_>],
    interval_s: f64,
    below_m: [f64; 2],
    limits: &DownwashLimits,
) -> Result<Downwash, DownwashError> {
    if frames.is_empty() || frames.len() > FRAMES_MAX {
        return Err(DownwashError::Frames { frames: frames.len(), frames_max: FRAMES_MAX });
    }
    if !below_m.iter().all(|x| x.is_finite()) {
        return Err(DownwashError::Point { x_m: below_m[0], y_m: below_m[1] });
    }
    let filter = BandFilter::new(&frames[0], &limits.wavelength_m)?;
    let (mut sums, mut all_m2, mut flow) = (Sums::new(&frames[0], below_m, limits.radius_min_m), 0.0, [0.0; 3]);
    let mut before: Option<Band> = None;
    let fast = fast_enough(interval_s, filter.wavelength_min_m());
    for (index, frame) in frames.iter().enumerate() {
        let band = filter.apply(frame, index)?;
        all_m2 += band.total_variance_m2 / frames.len() as f64;
        sums.add(&band, filter.weights());
        if let Some(before) = before.filter(|_| fast) {
            sums.add_flow(&before, &band, filter.weights(), &mut flow);
        }
        before = Some(band);
    }
    let found = sums.solve();
    let Some(found) = found else {
        let finding = Finding::new(
            Test::Downwash,
            Flag::NotEvaluated,
            "the point below is seen from too few sides, or there is nothing to see",
        );
        return Ok(Downwash {
            band_variance_m2: sums.band_variance_m2(),
            ring_variance_m2: f64::NAN,
            ring_share: f64::NAN,
            ring_share_sigma: f64::NAN,
            ring_share_of_all: f64::NAN,
            bins: Vec::new(),
            mask: vec![false; frames[0].elevation_m.len()],
            masked_share: 0.0,
            outward: None,
            finding,
        });
    };
    let outward = if fast && frames.len() > 1 { outward(&flow, found.ring_variance_m2) } else { None };
    Ok(report(found, all_m2, sums.band_variance_m2(), &sums, outward, limits))
}

fn report(
    found: fit::Rings,
    all_m2: f64,
    band_variance_m2: f64,
    sums: &Sums,
    outward: Option<f64>,
    limits: &DownwashLimits,
) -> Downwash {
    let ring_share_of_all = (found.ring_variance_m2 / all_m2).clamp(0.0, 1.0);
    let height_m = 4.0 * found.ring_variance_m2.max(0.0).sqrt();
    let sure = found.share - 2.0 * found.sigma;
    let flag = match () {
        () if !(found.share.is_finite() && found.sigma.is_finite()) => Flag::NotEvaluated,
        () if sure < limits.share_suspect || height_m < limits.height_min_m => Flag::Pass,
        () if ring_share_of_all >= limits.share_of_all_fail => Flag::Fail,
        () => Flag::Suspect,
    };
    let is_rippled = matches!(flag, Flag::Suspect | Flag::Fail);
    let mask: Vec<bool> =
        sums.cells().map(|bin| is_rippled && found.bins.get(bin).is_some_and(|b| b.share >= limits.mask_share)).collect();
    let masked_share = mask.iter().filter(|masked| **masked).count() as f64 / mask.len() as f64;
    let way = match outward {
        Some(x) if x > 0.1 => ", running outwards",
        Some(x) if x < -0.1 => ", but running inwards",
        _ => "",
    };
    let reason = format!(
        "rings about the point below hold {:.0} ± {:.0} % of the ripples' variance and {:.0} % of all (a height 4√m0 of {height_m:.4} m){way}; {:.0} % of the cells masked",
        100.0 * found.share,
        200.0 * found.sigma,
        100.0 * ring_share_of_all,
        100.0 * masked_share
    );
    Downwash {
        band_variance_m2,
        ring_variance_m2: found.ring_variance_m2,
        ring_share: found.share,
        ring_share_sigma: found.sigma,
        ring_share_of_all,
        bins: found.bins,
        mask,
        masked_share,
        outward,
        finding: Finding::new(Test::Downwash, flag, reason),
    }
}

/// Frequency, hertz, of deep capillary-gravity waves: ω² = g k + (σ/ρ) k³ with σ/ρ = 7.29·10⁻⁵ m³/s², of clean fresh water at 20 °C (Lamb, *Hydrodynamics*, § 267).
#[must_use]
pub fn ripple_frequency_hz(wavelength_m: f64) -> f64 {
    const TENSION_M3_PER_S2: f64 = 7.29e-5;
    let k_radpm = TAU / wavelength_m;
    (GRAVITY_MPS2 * k_radpm + TENSION_M3_PER_S2 * k_radpm.powi(3)).sqrt() / TAU
}

/// Whether frames come more than twice in a period of the shortest ripples.
fn fast_enough(interval_s: f64, wavelength_min_m: f64) -> bool {
    interval_s > 0.0 && interval_s * ripple_frequency_hz(wavelength_min_m) < 0.5
}

#[cfg(test)]
mod tests;
