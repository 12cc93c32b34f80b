//! The simulated pair of cameras.

use halcyon_model::{CameraIntrinsics, RigCalibration};
use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

/// The simulated rig (`[sim.rig]`): two equal cameras side by side that look down, mounted as well as hands do it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigConfig {
    /// Width of each picture, pixels.
    pub width_px: u32,
    /// Height of each picture, pixels.
    pub height_px: u32,
    /// Field of view across the picture's width, without distortion, degrees.
    pub horizontal_fov_deg: f64,
    /// Distance between the two cameras, metres.
    pub baseline_m: f64,
    /// How far the cameras look forward from straight down, degrees.
    pub tilt_deg: f64,
    /// Midpoint between the cameras in the body frame (forward, right, down), metres.
    pub mount_m: [f64; 3],
    /// How the right camera is turned against the left one, degrees about the left camera's x, y and z axes.
    pub misalignment_deg: [f64; 3],
    /// Lens distortion of both cameras: k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Light lost in the corners of the picture, 0 to 0.9 of it.
    pub vignetting: f64,
    /// Sensor noise, one standard deviation, grey levels; independent in every pixel.
    pub noise_sigma_grey: f64,
    /// Exposure time, seconds. Within it nothing moves: there is no motion blur.
    pub exposure_s: f64,
    /// Grey levels of a white sheet per second of exposure.
    pub exposure_gain: f64,
}

impl Default for RigConfig {
    fn default() -> Self {
        Self {
            width_px: 320,
            height_px: 240,
            horizontal_fov_deg: 50.0,
            baseline_m: 0.40,
            tilt_deg: 0.0,
            mount_m: [0.10, 0.0, 0.05],
            misalignment_deg: [0.15, -0.20, 0.10],
            distortion: [-0.08, 0.02, 3e-4, -2e-4, 0.0],
            vignetting: 0.15,
            noise_sigma_grey: 1.5,
            exposure_s: 0.001,
            exposure_gain: 2.2e6,
        }
    }
}

/// Why a rig cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("rig {key} must be {expected}, not {value}")]
pub struct RigError {
    key: &'static str,
    expected: &'static str,
    value: f64,
}

impl RigConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// [`RigError`] for the first that is out of range; NaN is.
    pub fn validate(&self) -> Result<(), RigError> {
        let range = |key, value: f64, low: f64, high: f64, expected| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(RigError { key, expected, value }) }
        };
        range("width_px", f64::from(self.width_px), 16.0, 4096.0, "from 16 to 4096")?;
        range("height_px", f64::from(self.height_px), 16.0, 4096.0, "from 16 to 4096")?;
        range("horizontal_fov_deg", self.horizontal_fov_deg, 5.0, 120.0, "from 5 to 120")?;
        range("baseline_m", self.baseline_m, 0.01, 10.0, "from 0.01 to 10")?;
        range("tilt_deg", self.tilt_deg, -60.0, 60.0, "from -60 to 60")?;
        range("vignetting", self.vignetting, 0.0, 0.9, "from 0 to 0.9")?;
        range("noise_sigma_grey", self.noise_sigma_grey, 0.0, 50.0, "from 0 to 50")?;
        range("exposure_s", self.exposure_s, 1e-6, 1.0, "from 0.000001 to 1")?;
        range("exposure_gain", self.exposure_gain, 0.0, 1e12, "from 0 to 1e12")?;
        for value in self.mount_m {
            range("mount_m", value, -10.0, 10.0, "from -10 to 10")?;
        }
        for value in self.misalignment_deg {
            range("misalignment_deg", value, -10.0, 10.0, "from -10 to 10")?;
        }
        for value in self.distortion {
            range("distortion", value, -1.0, 1.0, "from -1 to 1")?;
        }
        // Past the radius where the distorted one stops growing the lens would fold the picture over itself.
        let focal_px = self.focal_px();
        let corner = f64::from(self.width_px).hypot(f64::from(self.height_px)) * 0.5 / focal_px;
        let [k1, k2, _, _, k3] = self.distortion;
        let folds = (0..=100).map(|i| corner * 1.1 * f64::from(i) / 100.0).any(|r| {
            let q = r * r;
            1.0 + q * (3.0 * k1 + q * (5.0 * k2 + q * 7.0 * k3)) <= 0.1
        });
        if folds {
            return Err(RigError { key: "distortion", expected: "small enough not to fold the picture's corners", value: k1 });
        }
        Ok(())
    }

    /// Focal length, pixels.
    #[must_use]
    pub fn focal_px(&self) -> f64 {
        0.5 * f64::from(self.width_px) / (0.5 * self.horizontal_fov_deg.to_radians()).tan()
    }

    /// The exact calibration of this rig.
    #[must_use]
    pub fn calibration(&self) -> RigCalibration {
        let focal_px = self.focal_px();
        let camera = CameraIntrinsics {
            fx_px: focal_px,
            fy_px: focal_px,
            cx_px: 0.5 * (f64::from(self.width_px) - 1.0),
            cy_px: 0.5 * (f64::from(self.height_px) - 1.0),
            distortion: self.distortion,
        };
        // Tilting forward turns the optical axis from down towards forward: about the body's right axis, positive nose-up.
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), self.tilt_deg.to_radians());
        let body_from_camera = tilt.into_inner() * RigCalibration::LOOKING_DOWN;
        let [roll, pitch, yaw] = self.misalignment_deg.map(f64::to_radians);
        let left_from_right = Rotation3::from_euler_angles(roll, pitch, yaw);
        let right_from_left = left_from_right.inverse().into_inner();
        // The right camera stands a baseline along the left one's x axis.
        let right_in_left_m = Vector3::new(self.baseline_m, 0.0, 0.0);
        RigCalibration {
            width_px: self.width_px,
            height_px: self.height_px,
            left: camera,
            right: camera,
            right_from_left,
            right_from_left_m: -(right_from_left * right_in_left_m),
            body_from_camera,
            camera_in_body_m: Vector3::from(self.mount_m) - body_from_camera * (0.5 * right_in_left_m),
        }
    }
}
