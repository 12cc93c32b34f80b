//! SURF: speeded-up robust features (Bay, Ess, Tuytelaars and Van Gool, *Computer Vision and Image Understanding* 110, 2008).
//!
//! Blobs are maxima, over place and scale, of the determinant of the Hessian, whose Gaussian second derivatives are stood in for
//! by box filters; boxes cost four look-ups in an integral image at any size ([`hessian`]). The descriptor sums responses of Haar
//! wavelets, also boxes, over a window turned to the blob's main direction ([`describe`]).

mod describe;
mod hessian;
mod integral;

use describe::{descriptor, orientation_rad};
use hessian::{Blob, find_blobs};
use integral::Integral;

use super::{Descriptors, Features, Keypoint};

/// Numbers in a descriptor.
pub const DESCRIPTOR_LENGTH: usize = 64;

/// What SURF can be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Octaves, 1 to 4: filters from 9 px to 27, 51, 99 and 195 px.
    pub octaves: u32,
    /// Least determinant of the Hessian, in grey levels (0 to 255) per squared filter side, squared.
    pub response_min: f32,
    /// Leave the orientation out (U-SURF): faster and more distinctive where the camera does not roll more than 15°.
    pub is_upright: bool,
    /// Only the strongest so many.
    pub keypoints_max: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { octaves: 4, response_min: 6.0, is_upright: false, keypoints_max: 2000 }
    }
}

/// Finds and describes features; `pixels` is row-major `height × width`. Strongest first.
pub fn detect(pixels: &[u8], width: usize, height: usize, settings: &Settings) -> Features {
    let integral = Integral::new(pixels, width, height);
    let mut blobs = find_blobs(&integral, settings.octaves.clamp(1, 4), settings.response_min);
    blobs.sort_by(|a, b| b.response.total_cmp(&a.response).then(a.y_px.total_cmp(&b.y_px)).then(a.x_px.total_cmp(&b.x_px)));
    blobs.truncate(settings.keypoints_max);
    let mut values = Vec::with_capacity(blobs.len() * DESCRIPTOR_LENGTH);
    let keypoints = blobs
        .iter()
        .map(|blob| {
            let angle_rad = if settings.is_upright { 0.0 } else { orientation_rad(&integral, blob) };
            values.extend(descriptor(&integral, blob, angle_rad));
            keypoint(blob, angle_rad)
        })
        .collect();
    Features { keypoints, descriptors: Descriptors::Float { length: DESCRIPTOR_LENGTH, values } }
}

fn keypoint(blob: &Blob, angle_rad: f32) -> Keypoint {
    Keypoint {
        x_px: blob.x_px,
        y_px: blob.y_px,
        // The filter's side, as OpenCV's SURF says it.
        size_px: blob.sigma_px * 9.0 / 1.2,
        angle_rad: angle_rad.rem_euclid(std::f32::consts::TAU),
        response: blob.response,
        is_dark: blob.is_dark,
    }
}

#[cfg(test)]
mod tests;
