//! The measurement plane: pictures, rigs and patches of water surface.

use bytes::Bytes;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::id::RigId;
use crate::time::Stamp;

/// An 8-bit grey picture, row-major, `height_px × width_px`, no padding between rows.
#[derive(Clone, PartialEq)]
pub struct Image {
    width_px: u32,
    height_px: u32,
    pixels: Bytes,
}

/// A picture whose pixels do not fill its size.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a picture of {width_px} x {height_px} px needs as many bytes and has {bytes}")]
pub struct ImageError {
    width_px: u32,
    height_px: u32,
    bytes: usize,
}

impl Image {
    /// The longest side that any source may have.
    pub const SIDE_PX_MAX: u32 = 16_384;

    /// Wraps `pixels` without copying them.
    ///
    /// # Errors
    /// [`ImageError`] unless there are exactly `width_px × height_px` bytes and both sides are in 1 to [`Self::SIDE_PX_MAX`].
    pub fn new(width_px: u32, height_px: u32, pixels: Bytes) -> Result<Self, ImageError> {
        let sides = 1..=Self::SIDE_PX_MAX;
        let fits = sides.contains(&width_px)
            && sides.contains(&height_px)
            && pixels.len() as u64 == u64::from(width_px) * u64::from(height_px);
        if fits {
            Ok(Self { width_px, height_px, pixels })
        } else {
            Err(ImageError { width_px, height_px, bytes: pixels.len() })
        }
    }

    /// Width, pixels.
    #[must_use]
    pub fn width_px(&self) -> u32 {
        self.width_px
    }

    /// Height, pixels.
    #[must_use]
    pub fn height_px(&self) -> u32 {
        self.height_px
    }

    /// The pixels; cloning them copies nothing.
    #[must_use]
    pub fn pixels(&self) -> &Bytes {
        &self.pixels
    }
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Image({} x {} px)", self.width_px, self.height_px)
    }
}

/// One pinhole camera with OpenCV's five-coefficient distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraIntrinsics {
    /// Focal length along x, pixels.
    pub fx_px: f64,
    /// Focal length along y, pixels.
    pub fy_px: f64,
    /// Principal point x, pixels.
    pub cx_px: f64,
    /// Principal point y, pixels.
    pub cy_px: f64,
    /// k1, k2, p1, p2, k3 (thesis 3-8 … 3-11; OpenCV's order).
    pub distortion: [f64; 5],
}

impl CameraIntrinsics {
    /// The 3 × 3 camera matrix.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx_px, 0.0, self.cx_px, 0.0, self.fy_px, self.cy_px, 0.0, 0.0, 1.0)
    }
}

/// A calibrated pair of cameras and how it is mounted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigCalibration {
    /// Width of each picture, pixels.
    pub width_px: u32,
    /// Height of each picture, pixels.
    pub height_px: u32,
    /// The left camera.
    pub left: CameraIntrinsics,
    /// The right camera.
    pub right: CameraIntrinsics,
    /// Rotation of X_right = R X_left + T.
    pub right_from_left: Matrix3<f64>,
    /// T of X_right = R X_left + T, metres. A camera to the right has negative x here.
    pub right_from_left_m: Vector3<f64>,
    /// Left camera axes in body axes. Straight down with the picture's top forward is [`Self::LOOKING_DOWN`].
    pub body_from_camera: Matrix3<f64>,
    /// The left camera's centre in the body frame, metres.
    pub camera_in_body_m: Vector3<f64>,
}

impl RigCalibration {
    /// `body_from_camera` of a camera that looks straight down with the top of the picture forward.
    pub const LOOKING_DOWN: Matrix3<f64> = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);

    /// Distance between the two camera centres, metres.
    #[must_use]
    pub fn baseline_m(&self) -> f64 {
        self.right_from_left_m.norm()
    }
}

/// Where the rig's carrier was, and how it was turned, at mid-exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseAtExposure {
    /// Body origin in the fleet's local frame, metres. −z is the height above mean water by the autopilot.
    pub position_ned_m: Vector3<f64>,
    /// Attitude: rotates body axes into north, east, down.
    pub ned_from_body: UnitQuaternion<f64>,
    /// Standard deviation of the height, metres.
    pub height_sigma_m: f64,
    /// Standard deviation of roll and pitch, radians.
    pub attitude_sigma_rad: f64,
}

/// Two pictures of the same instant.
#[derive(Debug, Clone, PartialEq)]
pub struct StereoPair {
    /// Mid-exposure.
    pub stamp: Stamp,
    /// Which rig took it.
    pub rig: RigId,
    /// Counts pairs of this rig since its capture service started.
    pub sequence: u64,
    /// Left picture, as taken (not rectified).
    pub left: Image,
    /// Right picture, as taken, of the same size.
    pub right: Image,
    /// Exposure time, seconds.
    pub exposure_s: f64,
    /// The rig's calibration; travels along so that a patch can always be traced to it.
    pub calibration: RigCalibration,
    /// The carrier's pose, or `None` for a rig that is fixed or whose carrier is silent.
    pub pose: Option<PoseAtExposure>,
}

/// The mean water plane in the rectified left camera frame: points X with `normal · X = distance_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal, pointing away from the camera (positive z).
    pub normal: Vector3<f64>,
    /// Distance from the left camera, metres, positive.
    pub distance_m: f64,
    /// Root mean square distance of the inliers, metres: waves and noise together.
    pub rms_m: f64,
}

/// A regular grid of water elevation, gravity-aligned, rows to the north and columns to the east.
///
/// Element `row × cols + col` lies at `south_west + (row, col) × cell_m`, cell centres. For a rig without attitude, "north" is
/// the top of the rectified left picture.
#[derive(Debug, Clone, PartialEq)]
pub struct ElevationGrid {
    /// Centre of the cell at row 0, column 0: metres north in the local frame.
    pub south_west_north_m: f64,
    /// Centre of the cell at row 0, column 0: metres east in the local frame.
    pub south_west_east_m: f64,
    /// Cell side, metres.
    pub cell_m: f64,
    /// Rows, northwards.
    pub rows: u32,
    /// Columns, eastwards.
    pub cols: u32,
    /// Elevation above the patch's own mean level, metres, positive up, `rows × cols`; NaN where nothing was seen.
    pub elevation_m: Vec<f32>,
    /// One standard deviation of each elevation, metres; NaN where nothing was seen.
    pub sigma_m: Vec<f32>,
}

/// One measured patch of water.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePatch {
    /// Mid-exposure of the pair it was made from.
    pub stamp: Stamp,
    /// The rig.
    pub rig: RigId,
    /// Sequence number of the pair.
    pub sequence: u64,
    /// The surface.
    pub grid: ElevationGrid,
    /// Share of the cells with a measurement, 0 to 1.
    pub coverage: f64,
    /// The fitted mean plane.
    pub plane: Plane,
    /// Triangulated points that went in.
    pub points: u32,
    /// Mean water level under the patch, metres, positive up: above the fleet's datum by the autopilot's height, whose wander it
    /// carries, so that the grid is kept apart from it; above the first patch's level where the rig stands still. `None` for a
    /// carried rig without a pose.
    pub level_m: Option<f64>,
    /// One standard deviation of `level_m`, metres.
    pub level_sigma_m: Option<f64>,
    /// The same level as the thesis corrects it, S_z − D cos(pitch) cos(roll) (7-1): for comparison; nothing is decided by it.
    pub level_thesis_m: Option<f64>,
    /// Errors of cells closer than this are partly the same, metres: the matching window on the water (see [`crate::grid_error`]).
    pub error_length_m: f64,
    /// Slope (rise over run, north and east) that was taken out of the grid as the attitude's error; 0 where none was.
    pub slope_removed: [f64; 2],
    /// One standard deviation of the slope that is still wrong after that, each axis. Each cell's standard deviation holds what it does
    /// there: this times the distance from the middle of the patch.
    pub slope_sigma: f64,
    /// One standard deviation of roll and pitch that the pose stated, radians; 0 without a pose.
    pub attitude_sigma_rad: f64,
    /// What reconstruction spent on it, processor seconds of wall time.
    pub processing_s: f64,
}

/// Pictures for people, on demand.
#[derive(Debug, Clone, PartialEq)]
pub struct Preview {
    /// Mid-exposure of the pair.
    pub stamp: Stamp,
    /// The rig.
    pub rig: RigId,
    /// Rectified left picture, JPEG.
    pub left_jpeg: Bytes,
    /// Disparity in colour, PNG.
    pub disparity_png: Bytes,
}
