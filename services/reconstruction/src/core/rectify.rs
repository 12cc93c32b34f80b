//! Rectification (thesis 4.5): both pictures warped as if taken by two equal, parallel cameras side by side, so that a match
//! lies on the same row. The maps depend on the calibration alone and are computed once for it.

use halcyon_model::{CameraIntrinsics, Image, RigCalibration};
use nalgebra::{Matrix3, Vector3};
use opencv::calib3d;
use opencv::core::{CV_8UC1, CV_32FC1, Mat, MatTraitConstManual, MatTraitManual, Scalar, Size};
use rayon::prelude::*;

use super::camera;
use super::cv;
use super::resample::{Row, Warp, shift, warp_row};

/// Why a calibration cannot be rectified.
#[derive(Debug, thiserror::Error)]
pub enum RectifyError {
    /// A number that is not one, or a focal length of nothing.
    #[error("the calibration's {0} is out of range")]
    Invalid(&'static str),
    /// The right camera is not beside the left one.
    #[error(
        "the right camera must be to the right of the left one: in the left camera's axes the calibration puts it at \
         x {x_m:.3} m, y {y_m:.3} m, z {z_m:.3} m"
    )]
    NotSideBySide {
        /// To the right of the left camera.
        x_m: f64,
        /// Below it.
        y_m: f64,
        /// In front of it.
        z_m: f64,
    },
    /// Pictures of another size than the calibration's.
    #[error(
        "a picture of {width_px}x{height_px} px does not belong to a calibration for {calibrated_width_px}x{calibrated_height_px}"
    )]
    Size {
        /// The picture's width.
        width_px: u32,
        /// The picture's height.
        height_px: u32,
        /// The calibration's.
        calibrated_width_px: u32,
        /// The calibration's.
        calibrated_height_px: u32,
    },
    /// OpenCV failed.
    #[error("OpenCV failed while rectifying")]
    OpenCv(#[from] opencv::Error),
}

/// The two equal cameras that rectification pretends. Points in the rectified left camera frame: x right, y down, z forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RectifiedRig {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Principal point x of both, pixels.
    pub cx_px: f64,
    /// Principal point y of both, pixels.
    pub cy_px: f64,
    /// Distance between the two centres, metres.
    pub baseline_m: f64,
    /// Left camera axes as calibrated from rectified ones; both share the left camera's centre.
    pub camera_from_rectified: Matrix3<f64>,
}

impl RectifiedRig {
    /// The ray (x/z, y/z, 1) through a pixel.
    #[must_use]
    pub fn ray(&self, x_px: f64, y_px: f64) -> Vector3<f64> {
        Vector3::new((x_px - self.cx_px) / self.focal_px, (y_px - self.cy_px) / self.focal_px, 1.0)
    }

    /// Depth z of a match, metres: z = f b / d (thesis 4-22 in closed form).
    #[must_use]
    pub fn depth_m(&self, disparity_px: f64) -> f64 {
        self.focal_px * self.baseline_m / disparity_px
    }

    /// The point seen at a pixel with a disparity, rectified left camera frame, metres.
    #[must_use]
    pub fn triangulate(&self, x_px: f64, y_px: f64, disparity_px: f64) -> Vector3<f64> {
        self.ray(x_px, y_px) * self.depth_m(disparity_px)
    }
}

/// Warps pairs of one rig. Keeps the warped pictures, so that nothing is allocated per pair.
pub struct Rectifier {
    calibration: RigCalibration,
    rig: RectifiedRig,
    left: Side,
    right: Side,
}

/// One camera: where each rectified pixel comes from, whether that is within the picture, and the last picture, rectified.
struct Side {
    /// As [`Warp`] has them, for each row.
    down_px: Vec<f32>,
    across_px: Vec<f32>,
    inside: Vec<bool>,
    grey: Mat,
    exact: Mat,
    /// One for each task.
    scratch: Vec<Row>,
}

impl Side {
    fn new(maps: &(Mat, Mat), size: Size) -> opencv::Result<Self> {
        let (width, height) = (size.width as usize, size.height as usize);
        let (x, y) = (maps.0.data_typed::<f32>()?, maps.1.data_typed::<f32>()?);
        let (right, bottom) = (width as f32 - 0.5, height as f32 - 0.5);
        let mut down_px = vec![0.0; x.len()];
        let rows = x.chunks_exact(width).zip(y.chunks_exact(width)).zip(down_px.chunks_exact_mut(width)).enumerate();
        rows.for_each(|(row, ((x, y), down_px))| columns_meet(row, x, y, height, down_px));
        Ok(Self {
            down_px,
            across_px: x.iter().enumerate().map(|(i, x)| shift(i % width, *x, width)).collect(),
            inside: x.iter().zip(y).map(|(x, y)| (-0.5..=right).contains(x) && (-0.5..=bottom).contains(y)).collect(),
            grey: Mat::new_rows_cols_with_default(size.height, size.width, CV_8UC1, Scalar::default())?,
            exact: Mat::new_rows_cols_with_default(size.height, size.width, CV_32FC1, Scalar::default())?,
            scratch: vec![Row::default(); height.div_ceil(ROWS_A_TASK)],
        })
    }

    fn warp(&mut self, image: &Image) -> opencv::Result<()> {
        let width = image.width_px() as usize;
        let task = ROWS_A_TASK * width;
        let exact = self.exact.data_typed_mut::<f32>()?.par_chunks_mut(task);
        let grey = self.grey.data_typed_mut::<u8>()?.par_chunks_mut(task);
        let (down_px, across_px) = (&self.down_px, &self.across_px);
        exact.zip(grey).zip(&mut self.scratch).enumerate().for_each(|(task, ((exact, grey), scratch))| {
            let rows = exact.chunks_exact_mut(width).zip(grey.chunks_exact_mut(width)).enumerate();
            for (row, (exact, grey)) in rows.map(|(row, to)| (task * ROWS_A_TASK + row, to)) {
                let at = row * width..(row + 1) * width;
                let (down_px, across_px) = (&down_px[at.clone()], &across_px[at]);
                let warp = Warp { picture: image.pixels(), width, down_px, across_px };
                warp_row(&warp, row, scratch, exact, grey);
            }
        });
        Ok(())
    }

    fn memory_bytes(&self) -> usize {
        let pixels = self.across_px.len();
        let scratch: usize = self.scratch.iter().map(Row::memory_bytes).sum();
        pixels * (3 * size_of::<f32>() + size_of::<bool>() + size_of::<u8>()) + scratch
    }
}

/// Rows that are worth another thread.
const ROWS_A_TASK: usize = 16;

/// For each column of the picture, how far below `row` that row of the rectified picture meets it; `x` and `y` say where the row's pixels
/// come from. Between two pixels the row is straight, beyond its ends it goes on as it was.
fn columns_meet(row: usize, x: &[f32], y: &[f32], height: usize, down_px: &mut [f32]) {
    let mut from = 0;
    for (column, down_px) in down_px.iter_mut().enumerate() {
        let column_px = column as f32;
        while from + 2 < x.len() && x[from + 1] <= column_px {
            from += 1;
        }
        let to = (from + 1).min(x.len() - 1);
        let (across, down) = (x[to] - x[from], y[to] - y[from]);
        // Rows run to the right; where a map does not, nothing is known.
        let slope = if across > 0.1 { down / across } else { 0.0 };
        *down_px = shift(row, y[from] + slope * (column_px - x[from]), height);
    }
}

/// See [`Rectifier::seen`].
#[derive(Debug, Clone, Copy)]
pub struct SeenRow<'a> {
    left: &'a [bool],
    right: &'a [bool],
    margin_px: f32,
}

impl SeenRow<'_> {
    /// Whether both cameras saw what a match claims: pixel `x_px` of the left picture and, `disparity_px` further left, of the right one.
    #[must_use]
    #[inline]
    pub fn has(&self, x_px: u32, disparity_px: f32) -> bool {
        let x_px = x_px as f32;
        self.is_inside(self.right, x_px - disparity_px) && self.is_inside(self.left, x_px.max(self.margin_px))
    }

    #[inline]
    fn is_inside(&self, row: &[bool], at_px: f32) -> bool {
        let (from_px, to_px) = (at_px - self.margin_px, (at_px + self.margin_px).min((row.len() - 1) as f32));
        let is_inside = |at_px: f32| row.get((at_px + 0.5) as usize).copied().unwrap_or_default();
        // NaN is not positive.
        from_px >= 0.0 && is_inside(from_px) && is_inside(to_px)
    }
}

impl Rectifier {
    /// Computes the maps.
    ///
    /// # Errors
    /// [`RectifyError`] for numbers out of range, or cameras that are not side by side, left one left.
    pub fn new(calibration: &RigCalibration) -> Result<Self, RectifyError> {
        check(calibration)?;
        let size = picture_size(calibration);
        let rectification = cv::rectification(calibration, cv::View::Natural)?;
        let (left, right) =
            (rectification.left_projection.data_typed::<f64>()?, rectification.right_projection.data_typed::<f64>()?);
        let rig = RectifiedRig {
            width_px: calibration.width_px,
            height_px: calibration.height_px,
            focal_px: left[0],
            cx_px: left[2],
            cy_px: left[6],
            baseline_m: -right[3] / right[0],
            camera_from_rectified: cv::matrix3_from_mat(&rectification.left_rotation)?.transpose(),
        };
        let [left, right] = maps(calibration, &rectification)?;
        let (left, right) = (Side::new(&left, size)?, Side::new(&right, size)?);
        Ok(Self { calibration: *calibration, rig, left, right })
    }

    /// The calibration that the maps belong to.
    #[must_use]
    pub fn calibration(&self) -> &RigCalibration {
        &self.calibration
    }

    /// The rectified cameras.
    #[must_use]
    pub fn rig(&self) -> &RectifiedRig {
        &self.rig
    }

    /// What both cameras saw of row `y_px` of the rectified pictures, with `margin_px` to both sides along the row: beyond the edges of a
    /// picture, warping invents pixels. `None` below the last row.
    #[must_use]
    pub fn seen(&self, y_px: u32, margin_px: u32) -> Option<SeenRow<'_>> {
        let width = self.rig.width_px as usize;
        let from = y_px as usize * width;
        Some(SeenRow {
            left: self.left.inside.get(from..from + width)?,
            right: self.right.inside.get(from..from + width)?,
            margin_px: margin_px as f32,
        })
    }

    /// Warps a pair. The results live in the rectifier until the next call.
    ///
    /// # Errors
    /// [`RectifyError::Size`] for pictures of another size than the calibration's.
    pub fn rectify(&mut self, left: &Image, right: &Image) -> Result<(), RectifyError> {
        for image in [left, right] {
            if (image.width_px(), image.height_px()) != (self.rig.width_px, self.rig.height_px) {
                return Err(RectifyError::Size {
                    width_px: image.width_px(),
                    height_px: image.height_px(),
                    calibrated_width_px: self.rig.width_px,
                    calibrated_height_px: self.rig.height_px,
                });
            }
        }
        let (one, other) = rayon::join(|| self.left.warp(left), || self.right.warp(right));
        Ok(one.and(other)?)
    }

    /// How many bytes maps and pictures hold.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.left.memory_bytes() + self.right.memory_bytes()
    }

    /// The last pair, rectified, left then right, 8-bit: for matchers and people.
    #[must_use]
    pub fn grey(&self) -> (&Mat, &Mat) {
        (&self.left.grey, &self.right.grey)
    }

    /// The last pair, rectified, left then right, `f32` grey levels without rounding: for sub-pixel work.
    #[must_use]
    pub fn exact(&self) -> (&Mat, &Mat) {
        (&self.left.exact, &self.right.exact)
    }
}

/// Refuses what OpenCV would turn into NaN maps.
fn check(calibration: &RigCalibration) -> Result<(), RectifyError> {
    for (camera, name) in [(&calibration.left, "left camera"), (&calibration.right, "right camera")] {
        let finite = camera.matrix().iter().chain(&camera.distortion).all(|number| number.is_finite());
        let sound = finite && camera.fx_px > 0.0 && camera.fy_px > 0.0;
        if !sound || !camera::distortion_is_monotone(camera, calibration.width_px, calibration.height_px) {
            return Err(RectifyError::Invalid(name));
        }
    }
    let rotation = &calibration.right_from_left;
    let off = (rotation * rotation.transpose() - Matrix3::identity()).norm();
    // NaN is in no range, so that it is refused, too.
    if !(0.0..1e-3).contains(&off) || rotation.determinant() < 0.0 {
        return Err(RectifyError::Invalid("rotation between the cameras"));
    }
    if !(calibration.baseline_m() > 0.0 && calibration.baseline_m().is_finite()) {
        return Err(RectifyError::Invalid("baseline"));
    }
    if calibration.width_px == 0 || calibration.height_px == 0 {
        return Err(RectifyError::Invalid("picture size"));
    }
    // The right camera's centre in left axes.
    let centre_m = -(rotation.transpose() * calibration.right_from_left_m);
    if centre_m.x <= centre_m.y.abs().max(centre_m.z.abs()) {
        return Err(RectifyError::NotSideBySide { x_m: centre_m.x, y_m: centre_m.y, z_m: centre_m.z });
    }
    Ok(())
}

fn picture_size(calibration: &RigCalibration) -> Size {
    Size::new(calibration.width_px as i32, calibration.height_px as i32)
}

/// Where each rectified pixel of the left and of the right picture comes from: x and y, `f32`.
fn maps(calibration: &RigCalibration, rectification: &cv::Rectification) -> opencv::Result<[(Mat, Mat); 2]> {
    let one = |camera: &CameraIntrinsics, rotation: &Mat, projection: &Mat| -> opencv::Result<(Mat, Mat)> {
        let (matrix, distortion) = (cv::mat_from_matrix3(&camera.matrix())?, cv::mat_from_distortion(camera)?);
        let (mut x, mut y) = (Mat::default(), Mat::default());
        let size = picture_size(calibration);
        calib3d::init_undistort_rectify_map(&matrix, &distortion, rotation, projection, size, CV_32FC1, &mut x, &mut y)?;
        Ok((x, y))
    };
    Ok([
        one(&calibration.left, &rectification.left_rotation, &rectification.left_projection)?,
        one(&calibration.right, &rectification.right_rotation, &rectification.right_projection)?,
    ])
}

/// The maps of a rig, left then right, for peers that warp with them.
///
/// # Errors
/// As [`Rectifier::new`].
pub(super) fn maps_of(calibration: &RigCalibration) -> Result<[(Mat, Mat); 2], RectifyError> {
    check(calibration)?;
    Ok(maps(calibration, &cv::rectification(calibration, cv::View::Natural)?)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Waves of 6 to 9 px per period in all directions, taken by a camera that is turned about its axis and whose lens bends.
    #[test]
    fn turned_pictures_are_sampled_where_they_are() {
        let (width, height) = (320_usize, 240_usize);
        let texture = |x: f64, y: f64| {
            let wave = |i: u32| {
                let (turn, length_px) = (0.7 * f64::from(i), 6.0 + f64::from(i % 4));
                (TAU / length_px * (turn.cos() * x + turn.sin() * y) + f64::from(i)).sin()
            };
            128.0 + 12.0 * (0..9).map(wave).sum::<f64>()
        };
        let pixels: Vec<u8> =
            (0..width * height).map(|i| texture((i % width) as f64, (i / width) as f64).round() as u8).collect();
        let image = Image::new(width as u32, height as u32, pixels.into()).unwrap();
        for turn_deg in [0.0, 1.0, -5.0, 15.0, 40.0] {
            let (sin, cos) = f64::to_radians(turn_deg).sin_cos();
            let place = |i: usize| {
                let (x, y) = ((i % width) as f64 - 159.5, (i / width) as f64 - 119.5);
                let bent = 0.93 + 2e-7 * (x * x + y * y);
                (bent * (cos * x - sin * y) + 160.1, bent * (sin * x + cos * y) + 119.3)
            };
            let map = |value: &dyn Fn(usize) -> f64| {
                let mut mat =
                    Mat::new_rows_cols_with_default(height as i32, width as i32, CV_32FC1, Scalar::default()).unwrap();
                let values: Vec<f32> = (0..width * height).map(|i| value(i) as f32).collect();
                mat.data_typed_mut::<f32>().unwrap().copy_from_slice(&values);
                mat
            };
            let maps = (map(&|i| place(i).0), map(&|i| place(i).1));
            let mut side = Side::new(&maps, Size::new(width as i32, height as i32)).unwrap();
            side.warp(&image).unwrap();
            let exact = side.exact.data_typed::<f32>().unwrap();
            let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
            for (i, value) in exact.iter().enumerate() {
                let (x, y) = place(i);
                if (4.0..316.0).contains(&x) && (4.0..236.0).contains(&y) {
                    let error = f64::from(*value) - texture(x, y);
                    (squares, count, worst) = (squares + error * error, count + 1.0, worst.max(error.abs()));
                }
            }
            let rms = f64::sqrt(squares / count);
            // Rounding to whole grey levels alone makes 0.29 where a pixel is met, less between pixels.
            assert!(rms < 0.3 && count > 50_000.0, "{turn_deg} degrees: {rms} grey levels RMS, {worst} at most");
        }
    }
}
