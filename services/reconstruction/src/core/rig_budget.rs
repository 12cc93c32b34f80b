//! What can a rig measure, from which altitude? Footprint, elevation noise and resolvable waves in closed form, for a rig that
//! looks straight down at level water.
//!
//! With focal length f (px), baseline b and altitude h:
//! - disparity d = f b / h, pixel on the water h / f, picture on the water W h / f × H h / f; both cameras share
//!   (W h / f − b) × H h / f of it, the share 1 − d / W (thesis 4-22 and fig. 4-19's geometry; Hartley and Zisserman, ch. 9);
//! - a disparity error sigma_d is an elevation error sigma_z = h² / (f b) · sigma_d (Gallup et al. 2008), point by point;
//! - disparities are means over a window of side w, so that neighbours share their error: the mean over a cell of side c has
//!   the variance sigma_z² Γ(c)², Γ(c) = w/c (1 − w/(3c)) for c ≥ w, 1 − c/(3w) below (Vanmarcke 1983, the variance function
//!   of a triangular correlation, once for each axis);
//! - window and cell flatten waves of length L by sinc(w / L) sinc(c / L);
//! - against its own mean plane a footprint of side F keeps the share 1 − j0²(κ) − 3 j1²(κ), κ = π F / L, of the variance of
//!   a wave that runs along it: j_n are spherical Bessel functions, and this is what the constant and the linear Legendre
//!   polynomial take (Rayleigh's expansion of a plane wave). That is the worst case: height and attitude give some of it back.
//!
//! Still water reads 4 sigma_c, as H_m0 = 4 √m0 does; a wave height is measured with the relative error of both losses:
//! e² = (1 − √keep · sinc sinc)² + (√(1 + (4 sigma_c / H)²) − 1)².

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Where nobody says otherwise: what refined semi-global matching has on textured water through a camera with noise of two grey
/// levels. Weak texture, blur and glitter are worse.
pub const DISPARITY_SIGMA_PX: f64 = 0.05;
/// Wave length over height of a fully developed sea (Pierson and Moskowitz 1964: H_s = 0.21 U²/g, ω_p = 0.88 g/U). Young seas
/// are twice as steep.
pub const LENGTH_PER_HEIGHT: f64 = 39.0;
/// A wave height counts as measured with at most this relative error.
pub const ERROR_MAX: f64 = 0.1;
/// At least this share of the picture must be in common, as in the chain.
const OVERLAP_MIN: f64 = 0.25;
/// Altitudes that are tried for the best one: steps of 1 %.
const ALTITUDE_STEP: f64 = 1.01;
/// Nobody flies a stereo rig higher, metres.
const ALTITUDE_MAX_M: f64 = 1e4;

/// A rig as far as accuracy goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigGeometry {
    /// Width of the (rectified) pictures, pixels.
    pub width_px: u32,
    /// Their height, pixels.
    pub height_px: u32,
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Distance between the cameras, metres.
    pub baseline_m: f64,
    /// Side of the matching window, pixels.
    pub window_px: f64,
    /// One standard deviation of one disparity, pixels.
    pub disparity_sigma_px: f64,
    /// Side of the grid's cells; `None` takes the window's on the water.
    pub cell_m: Option<f64>,
    /// Largest disparity that is searched, pixels; `None` leaves the overlap to decide.
    pub disparity_max_px: Option<f64>,
}

/// Why a rig is none.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{name} must be {expected}, not {value}")]
pub struct RigGeometryError {
    /// Which number.
    pub name: &'static str,
    /// What it may be.
    pub expected: &'static str,
    /// What it is.
    pub value: f64,
}

/// What the rig measures from one altitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Height of the cameras above the water, metres.
    pub altitude_m: f64,
    /// Disparity of the water, pixels.
    pub disparity_px: f64,
    /// A pixel on the water, metres.
    pub pixel_m: f64,
    /// The left picture on the water, across the baseline and along it: width then height, metres.
    pub footprint_m: [f64; 2],
    /// What both cameras see of it, metres.
    pub shared_m: [f64; 2],
    /// Share of the picture that both cameras see, 0 to 1.
    pub overlap: f64,
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// One standard deviation of one point's elevation, metres.
    pub point_sigma_m: f64,
    /// One standard deviation of a cell's elevation, metres.
    pub cell_sigma_m: f64,
    /// The wave height that still water reads, 4 × the cell's standard deviation, metres.
    pub still_height_m: f64,
    /// Waves shorter than this lose half of their energy in window and cell, or fall between cells, metres.
    pub wavelength_min_m: f64,
    /// Longer waves do not fit into the shared footprint, metres.
    pub wavelength_max_m: f64,
    /// The lowest fully developed sea whose height is measured within 10 %, metres; `None` where none is.
    pub wave_height_min_m: Option<f64>,
    /// The highest one.
    pub wave_height_max_m: Option<f64>,
}

/// The altitude that suits a wave best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Best {
    /// Height of the waves, metres.
    pub wave_height_m: f64,
    /// Their length, metres.
    pub wavelength_m: f64,
    /// From here, metres …
    pub altitude_m: f64,
    /// … the height is measured with this relative error.
    pub error: f64,
    /// The lowest altitude with an error of at most 10 %, metres; `None` where there is none.
    pub altitude_m_min: Option<f64>,
    /// The highest one.
    pub altitude_m_max: Option<f64>,
}

impl RigGeometry {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`RigGeometryError`], naming the first that is out of range.
    pub fn check(&self) -> Result<(), RigGeometryError> {
        for (name, value, low, high, expected) in [
            ("width", f64::from(self.width_px), 16.0, 16_384.0, "16 to 16384 px"),
            ("height", f64::from(self.height_px), 16.0, 16_384.0, "16 to 16384 px"),
            ("focal length", self.focal_px, 1.0, 1e6, "1 to 1000000 px"),
            ("baseline", self.baseline_m, 1e-4, 100.0, "0.0001 to 100 m"),
            ("window", self.window_px, 1.0, 101.0, "1 to 101 px"),
            ("disparity sigma", self.disparity_sigma_px, 1e-4, 10.0, "0.0001 to 10 px"),
            ("cell", self.cell_m.unwrap_or(1.0), 1e-4, 100.0, "0.0001 to 100 m"),
            ("largest disparity", self.disparity_max_px.unwrap_or(1.0), 1.0, 16_384.0, "1 to 16384 px"),
        ] {
            // NaN is in no range.
            if !(low..=high).contains(&value) {
                return Err(RigGeometryError { name, expected, value });
            }
        }
        Ok(())
    }

    /// The focal length of a camera that sees `fov_rad` across `width_px`.
    #[must_use]
    pub fn focal_px(fov_rad: f64, width_px: u32) -> f64 {
        f64::from(width_px) / 2.0 / (fov_rad / 2.0).tan()
    }

    /// Horizontal field of view, radians.
    #[must_use]
    pub fn fov_rad(&self) -> f64 {
        2.0 * (f64::from(self.width_px) / 2.0 / self.focal_px).atan()
    }

    /// Below this altitude, metres, too little is in common, or disparities exceed what is searched.
    #[must_use]
    pub fn altitude_m_min(&self) -> f64 {
        let by_overlap_px = (1.0 - OVERLAP_MIN) * f64::from(self.width_px);
        self.focal_px * self.baseline_m / self.disparity_max_px.unwrap_or(by_overlap_px).min(by_overlap_px)
    }

    /// The budget at an altitude (positive, metres).
    #[must_use]
    pub fn at(&self, altitude_m: f64) -> Budget {
        let pixel_m = altitude_m / self.focal_px;
        let disparity_px = self.focal_px * self.baseline_m / altitude_m;
        let footprint_m = [f64::from(self.width_px) * pixel_m, f64::from(self.height_px) * pixel_m];
        let shared_m = [(footprint_m[0] - self.baseline_m).max(0.0), footprint_m[1]];
        let (window_m, cell_m) = self.smoothing_m(altitude_m);
        let point_sigma_m = altitude_m * altitude_m / (self.focal_px * self.baseline_m) * self.disparity_sigma_px;
        let cell_sigma_m = point_sigma_m * variance_function(cell_m, window_m);
        let (mut least, mut largest) = (None, None);
        // A millimetre to 100 m in steps of 2 %.
        for height_m in (0..582).map(|i| 1e-3 * 1.02_f64.powi(i)) {
            if self.error(altitude_m, height_m, height_m * LENGTH_PER_HEIGHT) <= ERROR_MAX {
                least = least.or(Some(height_m));
                largest = Some(height_m);
            }
        }
        Budget {
            altitude_m,
            disparity_px,
            pixel_m,
            footprint_m,
            shared_m,
            overlap: (1.0 - disparity_px / f64::from(self.width_px)).max(0.0),
            cell_m,
            point_sigma_m,
            cell_sigma_m,
            still_height_m: 4.0 * cell_sigma_m,
            wavelength_min_m: shortest_m(window_m, cell_m),
            wavelength_max_m: shared_m[0].min(shared_m[1]),
            wave_height_min_m: least,
            wave_height_max_m: largest,
        }
    }

    /// Relative error of the height of waves of this height and length from this altitude; 1 is a total loss.
    #[must_use]
    pub fn error(&self, altitude_m: f64, wave_height_m: f64, wavelength_m: f64) -> f64 {
        let (window_m, cell_m) = self.smoothing_m(altitude_m);
        let pixel_m = altitude_m / self.focal_px;
        let side_m = (f64::from(self.width_px) * pixel_m - self.baseline_m).min(f64::from(self.height_px) * pixel_m).max(0.0);
        let seen = kept_variance(side_m / wavelength_m).sqrt() * response(wavelength_m, window_m, cell_m);
        let point_sigma_m = altitude_m * altitude_m / (self.focal_px * self.baseline_m) * self.disparity_sigma_px;
        let still = 4.0 * point_sigma_m * variance_function(cell_m, window_m) / wave_height_m;
        (1.0 - seen).hypot((1.0 + still * still).sqrt() - 1.0)
    }

    /// The altitude from which waves of this height and length are measured best, and the range within 10 %.
    #[must_use]
    pub fn best(&self, wave_height_m: f64, wavelength_m: f64) -> Best {
        let mut best = Best {
            wave_height_m,
            wavelength_m,
            altitude_m: self.altitude_m_min(),
            error: f64::INFINITY,
            altitude_m_min: None,
            altitude_m_max: None,
        };
        let mut altitude_m = self.altitude_m_min();
        while altitude_m < ALTITUDE_MAX_M {
            let error = self.error(altitude_m, wave_height_m, wavelength_m);
            if error < best.error {
                (best.altitude_m, best.error) = (altitude_m, error);
            }
            if error <= ERROR_MAX {
                best.altitude_m_min = best.altitude_m_min.or(Some(altitude_m));
                best.altitude_m_max = Some(altitude_m);
            }
            altitude_m *= ALTITUDE_STEP;
        }
        best
    }

    /// Window and cell on the water, metres.
    fn smoothing_m(&self, altitude_m: f64) -> (f64, f64) {
        let window_m = self.window_px * altitude_m / self.focal_px;
        (window_m, self.cell_m.unwrap_or(window_m))
    }
}

/// Standard deviation of a cell's mean over that of one point: Γ of both axes, square root.
fn variance_function(cell_m: f64, window_m: f64) -> f64 {
    if cell_m >= window_m { window_m / cell_m * (1.0 - window_m / (3.0 * cell_m)) } else { 1.0 - cell_m / (3.0 * window_m) }
}

/// Amplitude that is left of a wave after the means over window and cell.
fn response(wavelength_m: f64, window_m: f64, cell_m: f64) -> f64 {
    (sinc(window_m / wavelength_m) * sinc(cell_m / wavelength_m)).abs()
}

/// sin(π x) / (π x).
fn sinc(x: f64) -> f64 {
    let angle = PI * x;
    if angle.abs() < 1e-6 { 1.0 } else { angle.sin() / angle }
}

/// The shortest wave that keeps half of its energy and has two cells.
fn shortest_m(window_m: f64, cell_m: f64) -> f64 {
    // Above the larger of the two the response rises; at eight times it nothing is lost.
    let (mut low_m, mut high_m) = (window_m.max(cell_m), 8.0 * window_m.max(cell_m));
    for _ in 0..60 {
        let middle_m = 0.5 * (low_m + high_m);
        if response(middle_m, window_m, cell_m) < FRAC_1_SQRT_2 { low_m = middle_m } else { high_m = middle_m }
    }
    high_m.max(2.0 * cell_m)
}

/// Share of a sine's variance that is left after taking out mean and slope over `waves` wave lengths, averaged over its phase.
fn kept_variance(waves: f64) -> f64 {
    let k = PI * waves;
    // 1 − j0² − 3 j1² → k⁴/45 for small k, where the closed form cancels.
    if k < 0.05 {
        return k.powi(4) / 45.0;
    }
    let j0 = k.sin() / k;
    let j1 = k.sin() / (k * k) - k.cos() / k;
    (1.0 - j0 * j0 - 3.0 * j1 * j1).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The thesis's rig: 640 × 480, f = 509 px, 9.2 cm.
    const THESIS: RigGeometry = RigGeometry {
        width_px: 640,
        height_px: 480,
        focal_px: 509.0,
        baseline_m: 0.092,
        window_px: 11.0,
        disparity_sigma_px: 1.0,
        cell_m: None,
        disparity_max_px: None,
    };

    /// DESIGN: "at 1 m with f = 509 px and b = 9.2 cm one pixel is 21 mm".
    #[test]
    fn a_pixel_of_disparity_at_one_metre_is_twenty_one_millimetres() {
        let budget = THESIS.at(1.0);
        assert!((budget.point_sigma_m - 0.02135).abs() < 1e-5, "{budget:?}");
        assert!((budget.disparity_px - 46.828).abs() < 1e-3);
        assert!((budget.footprint_m[0] - 640.0 / 509.0).abs() < 1e-12);
        assert!((budget.shared_m[0] - (640.0 / 509.0 - 0.092)).abs() < 1e-12);
        assert!((budget.overlap - budget.shared_m[0] / budget.footprint_m[0]).abs() < 1e-12);
        // A cell of one window: (2/3) of a point's.
        assert!((budget.cell_sigma_m / budget.point_sigma_m - 2.0 / 3.0).abs() < 1e-12);
        assert!((THESIS.altitude_m_min() - 509.0 * 0.092 / 480.0).abs() < 1e-12);
        let narrow = RigGeometry { disparity_max_px: Some(64.0), ..THESIS };
        assert!((narrow.altitude_m_min() - 509.0 * 0.092 / 64.0).abs() < 1e-12);
    }

    /// Against least squares on sampled sines, averaged over their phase.
    #[test]
    fn a_footprint_keeps_what_least_squares_leaves() {
        for waves in [0.02, 0.1, 0.3, 0.7, 1.0, 1.6, 3.3] {
            let (steps, phases) = (2000, 40);
            let mut kept = 0.0;
            for phase in 0..phases {
                let value = |i: i32| {
                    let x = f64::from(i) / f64::from(steps) - 0.5 + 0.5 / f64::from(steps);
                    (x, (std::f64::consts::TAU * (waves * x + f64::from(phase) / f64::from(phases))).sin())
                };
                let (mut sy, mut sxy, mut sxx, mut syy) = (0.0, 0.0, 0.0, 0.0);
                for (x, y) in (0..steps).map(value) {
                    (sy, sxy, sxx, syy) = (sy + y, sxy + x * y, sxx + x * x, syy + y * y);
                }
                let n = f64::from(steps);
                kept += (syy - sy * sy / n - sxy * sxy / sxx) / n / f64::from(phases);
            }
            let expected = kept / 0.5;
            assert!((kept_variance(waves) - expected).abs() < 1e-4 + 0.01 * expected, "{waves}: {expected}");
        }
    }

    /// Against a direct mean over window and cell of a sampled sine.
    #[test]
    fn window_and_cell_flatten_short_waves() {
        let (window_m, cell_m) = (0.16, 0.1);
        let shortest = shortest_m(window_m, cell_m);
        let steps = 200;
        let at = |i: i32, side: f64| side * ((f64::from(i) + 0.5) / f64::from(steps) - 0.5);
        let mut sum = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                sum += (std::f64::consts::TAU * (at(i, window_m) + at(j, cell_m)) / shortest).cos();
            }
        }
        assert!((sum / f64::from(steps * steps) - FRAC_1_SQRT_2).abs() < 1e-4, "{shortest}");
        assert_eq!(shortest_m(1e-3, 0.1).max(0.2), shortest_m(1e-3, 0.1), "never below two cells");
    }

    #[test]
    fn the_best_altitude_is_a_compromise() {
        let rig = RigGeometry { disparity_sigma_px: 0.05, ..THESIS };
        let best = rig.best(0.05, 1.85);
        let beside = |factor: f64| rig.error(best.altitude_m * factor, 0.05, 1.85);
        assert!(best.error < beside(0.9) && best.error < beside(1.1), "{best:?}");
        assert!(best.altitude_m_min < Some(best.altitude_m) && best.altitude_m_max > Some(best.altitude_m), "{best:?}");
        // Half the noise lets the rig fly higher.
        let better = RigGeometry { disparity_sigma_px: 0.025, ..rig };
        assert!(better.best(0.05, 1.85).altitude_m_max > best.altitude_m_max);
        // From 100 m nothing of it is seen.
        assert!(rig.error(100.0, 0.05, 1.85) > 1.0);
    }

    #[test]
    fn nonsense_is_named() {
        let check = |rig: RigGeometry, name: &str| assert_eq!(rig.check().unwrap_err().name, name);
        assert_eq!(THESIS.check(), Ok(()));
        check(RigGeometry { width_px: 0, ..THESIS }, "width");
        check(RigGeometry { focal_px: f64::NAN, ..THESIS }, "focal length");
        check(RigGeometry { baseline_m: -0.1, ..THESIS }, "baseline");
        check(RigGeometry { disparity_sigma_px: 0.0, ..THESIS }, "disparity sigma");
        check(RigGeometry { cell_m: Some(f64::INFINITY), ..THESIS }, "cell");
    }
}
