//! Zhang's method with OpenCV, made hard to fool: every distortion model from several starts, and the best is kept.
//!
//! The joint problem has bad local minima: started from a guess, `stereoCalibrate` with the flags of OpenCV's own sample stops
//! at four times the error of the best solution. So: each camera alone first, then the rig with the cameras held fixed, then
//! everything together, from starts that differ in focal length, principal point and distortion. What no start improves is
//! taken; how many starts arrived there is reported.

use halcyon_model::CameraIntrinsics;
use nalgebra::{Matrix3, Vector3};
use opencv::core::{Mat, Point2f, Point3f, Size, TermCriteria, TermCriteria_Type, Vector};
use opencv::{Result, calib3d};

use super::board::BoardSpec;
use super::sighting::Sighting;
use crate::core::{camera, cv};

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

    /// Free coefficients.
    fn free(self) -> u32 {
        match self {
            Self::Radial2 => 2,
            Self::Radial2Tangential => 4,
            Self::Radial3 => 3,
            Self::Radial3Tangential => 5,
        }
    }

    fn flags(self) -> i32 {
        match self {
            Self::Radial2 => calib3d::CALIB_FIX_K3 | calib3d::CALIB_ZERO_TANGENT_DIST,
            Self::Radial2Tangential => calib3d::CALIB_FIX_K3,
            Self::Radial3 => calib3d::CALIB_ZERO_TANGENT_DIST,
            Self::Radial3Tangential => 0,
        }
    }
}

/// One solution of the whole rig.
#[derive(Debug, Clone)]
pub(super) struct RigFit {
    pub(super) model: DistortionModel,
    pub(super) left: CameraIntrinsics,
    pub(super) right: CameraIntrinsics,
    pub(super) right_from_left: Matrix3<f64>,
    pub(super) right_from_left_m: Vector3<f64>,
    pub(super) rms_px: f64,
    pub(super) starts: u32,
    pub(super) starts_agreeing: u32,
}

/// Corners of all views as OpenCV takes them.
pub(super) struct Points {
    object: Vector<Vector<Point3f>>,
    left: Vector<Vector<Point2f>>,
    right: Vector<Vector<Point2f>>,
    corners: usize,
    width_px: u32,
    height_px: u32,
}

impl Points {
    pub(super) fn new(sightings: &[Sighting], board: &BoardSpec, (width_px, height_px): (u32, u32)) -> Self {
        let mut points =
            Self { object: Vector::new(), left: Vector::new(), right: Vector::new(), corners: 0, width_px, height_px };
        for sighting in sightings.iter().filter(|sighting| sighting.is_used()) {
            let kept: Vec<usize> = sighting.kept_corners().collect();
            points.corners += kept.len();
            points.object.push(kept.iter().map(|&i| board.corner_point3f(i)).collect());
            points.left.push(kept.iter().map(|&i| sighting.left[i]).collect());
            points.right.push(kept.iter().map(|&i| sighting.right[i]).collect());
        }
        points
    }

    fn size(&self) -> Size {
        Size::new(self.width_px as i32, self.height_px as i32)
    }

    /// One camera alone (thesis 3.4).
    fn camera(&self, image: &Vector<Vector<Point2f>>, model: DistortionModel) -> Result<Option<CameraIntrinsics>> {
        let (mut matrix, mut distortion) = (Mat::default(), Mat::default());
        let (mut rotations, mut translations) = (Vector::<Mat>::new(), Vector::<Mat>::new());
        let outcome = calib3d::calibrate_camera(
            &self.object,
            image,
            self.size(),
            &mut matrix,
            &mut distortion,
            &mut rotations,
            &mut translations,
            model.flags(),
            until(100, 1e-9)?,
        );
        // Views that do not fix a camera make OpenCV throw or return nonsense: both mean "no start from here".
        if outcome.is_err() {
            return Ok(None);
        }
        let camera = cv::intrinsics_from_mats(&matrix, &distortion)?;
        Ok(self.is_plausible(&camera).then_some(camera))
    }

    /// Both cameras alone.
    pub(super) fn cameras(&self, model: DistortionModel) -> Result<Option<(CameraIntrinsics, CameraIntrinsics)>> {
        let left = self.camera(&self.left, model)?;
        let right = self.camera(&self.right, model)?;
        Ok(left.zip(right))
    }

    /// A solution that no lens could have is no solution, however small its error.
    fn is_plausible(&self, camera: &CameraIntrinsics) -> bool {
        let (width, height) = (f64::from(self.width_px), f64::from(self.height_px));
        let focal = 0.1 * width.max(height)..100.0 * width.max(height);
        focal.contains(&camera.fx_px)
            && focal.contains(&camera.fy_px)
            && (0.5..2.0).contains(&(camera.fx_px / camera.fy_px))
            && (0.0..width).contains(&camera.cx_px)
            && (0.0..height).contains(&camera.cy_px)
            && camera.distortion.iter().all(|coefficient| coefficient.is_finite())
            && camera::distortion_is_monotone(camera, self.width_px, self.height_px)
    }

    /// The rig with the cameras held fixed, then everything together. `None` where this start leads nowhere.
    fn rig(&self, model: DistortionModel, left: &CameraIntrinsics, right: &CameraIntrinsics) -> Result<Option<RigFit>> {
        let (mut left_matrix, mut left_distortion) = (cv::mat_from_matrix3(&left.matrix())?, cv::mat_from_distortion(left)?);
        let (mut right_matrix, mut right_distortion) =
            (cv::mat_from_matrix3(&right.matrix())?, cv::mat_from_distortion(right)?);
        let (mut rotation, mut translation) = (Mat::default(), Mat::default());
        let (mut essential, mut fundamental, mut per_view) = (Mat::default(), Mat::default(), Mat::default());
        let together = calib3d::CALIB_USE_INTRINSIC_GUESS | calib3d::CALIB_USE_EXTRINSIC_GUESS | model.flags();
        let mut rms_px = f64::INFINITY;
        for flags in [calib3d::CALIB_FIX_INTRINSIC, together] {
            let outcome = calib3d::stereo_calibrate_extended(
                &self.object,
                &self.left,
                &self.right,
                &mut left_matrix,
                &mut left_distortion,
                &mut right_matrix,
                &mut right_distortion,
                self.size(),
                &mut rotation,
                &mut translation,
                &mut essential,
                &mut fundamental,
                &mut per_view,
                flags,
                until(100, 1e-7)?,
            );
            let Ok(error_px) = outcome else { return Ok(None) };
            rms_px = error_px;
        }
        let fit = RigFit {
            model,
            left: cv::intrinsics_from_mats(&left_matrix, &left_distortion)?,
            right: cv::intrinsics_from_mats(&right_matrix, &right_distortion)?,
            right_from_left: cv::matrix3_from_mat(&rotation)?,
            right_from_left_m: cv::vector3_from_mat(&translation)?,
            rms_px,
            starts: 1,
            starts_agreeing: 1,
        };
        let sound = rms_px.is_finite() && self.is_plausible(&fit.left) && self.is_plausible(&fit.right);
        Ok(sound.then_some(fit))
    }

    /// The best of several starts with one distortion model.
    fn best_of_starts(&self, model: DistortionModel, alone: (CameraIntrinsics, CameraIntrinsics)) -> Result<Option<RigFit>> {
        let mut fits = Vec::new();
        let starts = self.starts(alone);
        for (left, right) in &starts {
            fits.extend(self.rig(model, left, right)?);
        }
        let Some(best) = fits.iter().min_by(|a, b| a.rms_px.total_cmp(&b.rms_px)) else { return Ok(None) };
        let agreeing = fits.iter().filter(|fit| fit.rms_px <= best.rms_px * 1.001).count();
        Ok(Some(RigFit { starts: starts.len() as u32, starts_agreeing: agreeing as u32, ..best.clone() }))
    }

    /// Where the joint search starts from: the cameras as found alone; the same without distortion; and a nominal camera,
    /// centred and square, with the mean focal length of both.
    fn starts(&self, (left, right): (CameraIntrinsics, CameraIntrinsics)) -> [(CameraIntrinsics, CameraIntrinsics); 3] {
        let plain = |camera: CameraIntrinsics| CameraIntrinsics { distortion: [0.0; 5], ..camera };
        let focal_px = (left.fx_px + left.fy_px + right.fx_px + right.fy_px) / 4.0;
        let nominal = CameraIntrinsics {
            fx_px: focal_px,
            fy_px: focal_px,
            cx_px: (f64::from(self.width_px) - 1.0) / 2.0,
            cy_px: (f64::from(self.height_px) - 1.0) / 2.0,
            distortion: [0.0; 5],
        };
        [(left, right), (plain(left), plain(right)), (nominal, nominal)]
    }

    /// The rig: all models from all starts; the richer model only where the data earn it (Bayesian information criterion).
    pub(super) fn solve(&self) -> Result<Option<RigFit>> {
        let mut best: Option<(f64, RigFit)> = None;
        let mut simplest: Option<(CameraIntrinsics, CameraIntrinsics)> = None;
        for model in DistortionModel::ALL {
            // A rich model may fail alone where the simple one holds: then start it from the simple one.
            let alone = self.cameras(model)?.or(simplest);
            let Some(alone) = alone else { continue };
            simplest.get_or_insert(alone);
            let Some(fit) = self.best_of_starts(model, alone)? else { continue };
            let score = self.information(&fit);
            if best.as_ref().is_none_or(|(least, _)| score < *least) {
                best = Some((score, fit));
            }
        }
        Ok(best.map(|(_, fit)| fit))
    }

    /// The same model again after a few points have gone, from the solution before.
    pub(super) fn refine(&self, fit: &RigFit) -> Result<Option<RigFit>> {
        self.rig(fit.model, &fit.left, &fit.right)
    }

    /// Bayesian information criterion, up to what all models share: n ln(mean square) + parameters · ln n.
    fn information(&self, fit: &RigFit) -> f64 {
        // Two coordinates of each corner in each of two cameras.
        let numbers = 4.0 * self.corners as f64;
        numbers * (fit.rms_px * fit.rms_px).ln() + 2.0 * f64::from(fit.model.free()) * numbers.ln()
    }
}

fn until(steps: i32, epsilon: f64) -> Result<TermCriteria> {
    TermCriteria::new(TermCriteria_Type::COUNT as i32 + TermCriteria_Type::EPS as i32, steps, epsilon)
}
