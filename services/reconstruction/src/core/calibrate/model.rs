//! Which distortion a calibration may use.

use halcyon_model::CameraIntrinsics;

use crate::core::camera;

/// Which distortion coefficients are free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DistortionModel {
    /// k1, k2.
    Radial2,
    /// k1, k2, p1, p2.
    Radial2Tangential,
    /// k1, k2, k3.
    Radial3,
    /// k1, k2, p1, p2, k3: all that [`CameraIntrinsics`] can hold.
    Radial3Tangential,
}

impl DistortionModel {
    /// From simple to rich.
    pub const ALL: [Self; 4] = [Self::Radial2, Self::Radial2Tangential, Self::Radial3, Self::Radial3Tangential];

    /// For reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Radial2 => "k1 k2",
            Self::Radial2Tangential => "k1 k2 p1 p2",
            Self::Radial3 => "k1 k2 k3",
            Self::Radial3Tangential => "k1 k2 p1 p2 k3",
        }
    }

    /// Which of k1, k2, p1, p2, k3 are free.
    #[must_use]
    pub fn frees(self) -> [bool; 5] {
        match self {
            Self::Radial2 => [true, true, false, false, false],
            Self::Radial2Tangential => [true, true, true, true, false],
            Self::Radial3 => [true, true, false, false, true],
            Self::Radial3Tangential => [true; 5],
        }
    }
}

/// A solution that no lens could have is no solution, however small its error.
pub(super) fn is_plausible(camera: &CameraIntrinsics, (width_px, height_px): (u32, u32)) -> bool {
    let (width, height) = (f64::from(width_px), f64::from(height_px));
    let focal = 0.1 * width.max(height)..100.0 * width.max(height);
    focal.contains(&camera.fx_px)
        && focal.contains(&camera.fy_px)
        && (0.5..2.0).contains(&(camera.fx_px / camera.fy_px))
        && (0.0..width).contains(&camera.cx_px)
        && (0.0..height).contains(&camera.cy_px)
        && camera.distortion.iter().all(|coefficient| coefficient.is_finite())
        && camera::distortion_is_monotone(camera, width_px, height_px)
}
