//! Poses and planes that no camera over water has are refused, unlikely ones warned of: they come from a sign, a unit or a picture
//! of something else, and every number made from them would look like a measurement.

use halcyon_model::{PoseAtExposure, RigCalibration, SurfacePatch};
use nalgebra::Vector3;

use crate::core::reconstruct::WorldFromRectified;
use crate::core::rectify::RectifiedRig;

/// A camera that looks further off straight down than this has more sky than water in its picture.
const OFF_NADIR_DEG_MAX: f64 = 90.0;
/// Further than this off straight down only a rig on a shore or a mast looks.
const OFF_NADIR_DEG_USUAL: f64 = 70.0;
/// The mean plane of a footprint of water is never this steep: the steepest crest of a Stokes wave is a corner of 120°, 30° on
/// either side.
const TILT_DEG_MAX: f64 = 30.0;
/// A footprint much smaller than the wave may lean like this; most do not.
const TILT_DEG_USUAL: f64 = 10.0;
/// Without a pose all that is known is that the camera sees the plane's surface: closer to edge-on there is none to see.
const OBLIQUE_DEG_MAX: f64 = 80.0;
/// Rigs on shores and masts look down more steeply than this.
const OBLIQUE_DEG_USUAL: f64 = 60.0;
/// The mean plane takes out what is longer than the footprint. Waves that fit into it have a height of at most 0.142 of their length
/// (Michell 1893), and a sine's root mean square is its height over 2 √2: points on water do not scatter more.
const RMS_SHARE_MAX: f64 = 0.142 * 0.5 * std::f64::consts::FRAC_1_SQRT_2;
/// A height that differs from what the pair shows by more than this share, and by more than its own uncertainty, is another's.
const HEIGHT_SHARE_USUAL: f64 = 0.2;
/// Below this disparity, pixels, a pixel's error is the whole distance.
const DISPARITY_PX_MIN: f64 = 1.0;

/// What cannot be. Angles in degrees, lengths in metres.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImpossibleError {
    /// The optical axis does not meet the water.
    #[error(
        "with this roll and pitch, and the rig's body_from_camera, the left camera looks {off_nadir_deg:.0}° off straight down, at the \
         sky: at most {OFF_NADIR_DEG_MAX}° can see water"
    )]
    Sky {
        /// Angle between the optical axis and straight down.
        off_nadir_deg: f64,
    },
    /// The camera is below the mean water level.
    #[error("with this height, and the rig's camera_in_body_m, the left camera is {depth_m:.2} m under water")]
    Submerged {
        /// How deep.
        depth_m: f64,
    },
    /// With the pose, the plane is not level.
    #[error(
        "the plane leans {tilt_deg:.0}° against level, which water never does (at most {TILT_DEG_MAX}°): check roll, pitch and the rig's \
         body_from_camera, and whether this is water"
    )]
    Steep {
        /// Angle between the plane and the horizontal.
        tilt_deg: f64,
    },
    /// Without a pose, the plane is nearly edge-on.
    #[error(
        "the plane is {oblique_deg:.0}° off facing the left camera: at more than {OBLIQUE_DEG_MAX}° there is no water surface to \
         see"
    )]
    EdgeOn {
        /// Angle between the plane's normal and the optical axis.
        oblique_deg: f64,
    },
}

/// What is unlikely. Angles in degrees, lengths in metres.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Doubt {
    #[error("the left camera looks {off_nadir_deg:.0}° off straight down: unlikely for a rig that is flown")]
    Oblique { off_nadir_deg: f64 },
    #[error(
        "from {height_m:.1} m the water's disparity is {disparity_px:.2} px: too little to measure, so check --height-m and the rig's \
         baseline, {baseline_m:.4} m"
    )]
    Far { height_m: f64, disparity_px: f64, baseline_m: f64 },
    #[error("the plane leans {tilt_deg:.0}° against level: unlikely for water, so check roll, pitch and body_from_camera")]
    Leaning { tilt_deg: f64 },
    #[error("the plane is {oblique_deg:.0}° off facing the left camera: unlikely for a rig over water")]
    EdgeOn { oblique_deg: f64 },
    #[error(
        "by the height that was given the left camera is {given_m:.2} m above the water, by the pictures {seen_m:.2} m: one of them, or the rig, is wrong"
    )]
    Height { given_m: f64, seen_m: f64 },
    #[error(
        "the points scatter {rms_m:.2} m RMS over {extent_m:.1} m: waves so steep would break, so this is noise or no water"
    )]
    Scatter { rms_m: f64, extent_m: f64 },
}

/// The doubts of many pairs, one line for each sort.
#[derive(Debug, Default)]
pub(super) struct Doubts {
    sorts: Vec<(std::mem::Discriminant<Doubt>, String, usize)>,
}

impl Doubts {
    pub(super) fn add(&mut self, pair: &str, doubts: Vec<Doubt>) {
        for doubt in doubts {
            let sort = std::mem::discriminant(&doubt);
            match self.sorts.iter_mut().find(|(known, ..)| *known == sort) {
                Some((.., count)) => *count += 1,
                None => self.sorts.push((sort, format!("{pair}: {doubt}"), 1)),
            }
        }
    }

    pub(super) fn lines(self) -> Vec<String> {
        let line = |(_, first, count)| if count > 1 { format!("{first} ({count} pairs so)") } else { first };
        self.sorts.into_iter().map(line).collect()
    }
}

/// Looks at a pose before any work; gives what is unlikely about it.
///
/// # Errors
/// [`ImpossibleError`]
pub(super) fn check_pose(pose: &PoseAtExposure, calibration: &RigCalibration) -> Result<Vec<Doubt>, ImpossibleError> {
    let axis = pose.ned_from_body * (calibration.body_from_camera * Vector3::z());
    let off_nadir_deg = axis.z.clamp(-1.0, 1.0).acos().to_degrees();
    if off_nadir_deg > OFF_NADIR_DEG_MAX {
        return Err(ImpossibleError::Sky { off_nadir_deg });
    }
    let height_m = camera_height_m(pose, calibration);
    if height_m <= 0.0 {
        return Err(ImpossibleError::Submerged { depth_m: -height_m });
    }
    let mut doubts = Vec::new();
    if off_nadir_deg > OFF_NADIR_DEG_USUAL {
        doubts.push(Doubt::Oblique { off_nadir_deg });
    }
    let baseline_m = calibration.baseline_m();
    let disparity_px = calibration.left.fx_px * baseline_m / height_m;
    if disparity_px < DISPARITY_PX_MIN {
        doubts.push(Doubt::Far { height_m, disparity_px, baseline_m });
    }
    Ok(doubts)
}

/// Height of the left camera above the mean water level, metres.
fn camera_height_m(pose: &PoseAtExposure, calibration: &RigCalibration) -> f64 {
    -(pose.position_ned_m + pose.ned_from_body * calibration.camera_in_body_m).z
}

/// Looks at the mean plane that was found; gives what is unlikely about it.
///
/// # Errors
/// [`ImpossibleError`]
pub(super) fn check_plane(
    patch: &SurfacePatch,
    pose: Option<&PoseAtExposure>,
    calibration: &RigCalibration,
    rig: &RectifiedRig,
) -> Result<Vec<Doubt>, ImpossibleError> {
    let plane = &patch.plane;
    let angle_deg = |cosine: f64| cosine.clamp(-1.0, 1.0).acos().to_degrees();
    let mut doubts = Vec::new();
    if let Some(pose) = pose {
        let normal = WorldFromRectified::from_pose(pose, calibration, rig).rotation * plane.normal;
        let tilt_deg = angle_deg(normal.z);
        let slack_deg = 3.0 * pose.attitude_sigma_rad.to_degrees();
        if tilt_deg > TILT_DEG_MAX + slack_deg {
            return Err(ImpossibleError::Steep { tilt_deg });
        }
        if tilt_deg > TILT_DEG_USUAL + slack_deg {
            doubts.push(Doubt::Leaning { tilt_deg });
        }
        let given_m = camera_height_m(pose, calibration);
        let off_m = (given_m - plane.distance_m).abs();
        if off_m > HEIGHT_SHARE_USUAL * given_m && off_m > 5.0 * pose.height_sigma_m {
            doubts.push(Doubt::Height { given_m, seen_m: plane.distance_m });
        }
    } else {
        let oblique_deg = angle_deg(plane.normal.z);
        if oblique_deg > OBLIQUE_DEG_MAX {
            return Err(ImpossibleError::EdgeOn { oblique_deg });
        }
        if oblique_deg > OBLIQUE_DEG_USUAL {
            doubts.push(Doubt::EdgeOn { oblique_deg });
        }
    }
    let extent_m = patch.grid.cell_m * f64::from(patch.grid.rows).hypot(f64::from(patch.grid.cols));
    if plane.rms_m > RMS_SHARE_MAX * extent_m {
        doubts.push(Doubt::Scatter { rms_m: plane.rms_m, extent_m });
    }
    Ok(doubts)
}

#[cfg(test)]
mod tests {
    use halcyon_model::{CameraIntrinsics, ElevationGrid, Plane, RigId, Stamp};
    use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

    use super::*;
    use crate::core::rectify::Rectifier;

    fn calibration() -> RigCalibration {
        let camera = CameraIntrinsics { fx_px: 343.1, fy_px: 343.1, cx_px: 159.5, cy_px: 119.5, distortion: [0.0; 5] };
        RigCalibration {
            width_px: 320,
            height_px: 240,
            left: camera,
            right: camera,
            right_from_left: Matrix3::identity(),
            right_from_left_m: Vector3::new(-0.4, 0.0, 0.0),
            body_from_camera: RigCalibration::LOOKING_DOWN,
            camera_in_body_m: Vector3::new(0.0, 0.0, 0.1),
        }
    }

    fn pose(roll_deg: f64, pitch_deg: f64, height_m: f64) -> PoseAtExposure {
        PoseAtExposure {
            position_ned_m: Vector3::new(0.0, 0.0, -height_m),
            ned_from_body: UnitQuaternion::from_euler_angles(roll_deg.to_radians(), pitch_deg.to_radians(), 1.0),
            height_sigma_m: 0.1,
            attitude_sigma_rad: 0.0,
        }
    }

    #[test]
    fn a_camera_sees_no_water_in_the_sky_or_under_the_surface() {
        let check = |roll_deg, pitch_deg, height_m| check_pose(&pose(roll_deg, pitch_deg, height_m), &calibration());
        assert_eq!(check(3.0, -4.0, 5.0), Ok(vec![]));
        match check(95.0, 0.0, 5.0) {
            Err(ImpossibleError::Sky { off_nadir_deg }) => assert!((off_nadir_deg - 95.0).abs() < 1e-9),
            other => panic!("{other:?}"),
        }
        // cos a = cos roll cos pitch.
        match check(170.0, 60.0, 5.0) {
            Err(ImpossibleError::Sky { off_nadir_deg }) => {
                let expected = (170f64.to_radians().cos() * 0.5).acos().to_degrees();
                assert!((off_nadir_deg - expected).abs() < 1e-9);
            }
            other => panic!("{other:?}"),
        }
        assert!(
            matches!(check(0.0, 0.0, 0.05), Err(ImpossibleError::Submerged { .. })),
            "the camera hangs 0.1 m below the body"
        );
        assert!(check(75.0, 0.0, 5.0).unwrap()[0].to_string().contains("75° off straight down"));
        // f b = 137 px m.
        assert!(check(0.0, 0.0, 1000.0).unwrap()[0].to_string().contains("disparity is 0.14 px"));
    }

    #[test]
    fn a_plane_is_level_with_a_pose_and_faces_the_camera_without() {
        let calibration = calibration();
        let rig = *Rectifier::new(&calibration).unwrap().rig();
        let plane = |tilt_deg: f64, rms_m| {
            let normal = Rotation3::from_euler_angles(f64::to_radians(tilt_deg), 0.0, 0.0) * Vector3::z();
            // Four by three metres.
            let grid = ElevationGrid {
                south_west_north_m: 0.0,
                south_west_east_m: 0.0,
                cell_m: 1.0,
                rows: 4,
                cols: 3,
                elevation_m: vec![0.0; 12],
                sigma_m: vec![0.01; 12],
            };
            SurfacePatch {
                stamp: Stamp::default(),
                rig: RigId::new("rig").unwrap(),
                sequence: 0,
                grid,
                coverage: 1.0,
                plane: Plane { normal, distance_m: 5.0, rms_m },
                points: 1000,
                level_m: None,
                level_sigma_m: None,
                level_thesis_m: None,
                error_length_m: 0.1,
                slope_removed: [0.0; 2],
                slope_sigma: 0.0,
                attitude_sigma_rad: 0.0,
                processing_s: 0.0,
            }
        };
        let check = |tilt_deg, pose: Option<&PoseAtExposure>| check_plane(&plane(tilt_deg, 0.01), pose, &calibration, &rig);
        let level = pose(0.0, 0.0, 5.0);
        assert_eq!((check(5.0, Some(&level)), check(50.0, None)), (Ok(vec![]), Ok(vec![])));
        assert!(check(15.0, Some(&level)).unwrap()[0].to_string().contains("leans 15° against level"));
        assert!(check(75.0, None).unwrap()[0].to_string().contains("75° off facing"));
        assert!(matches!(check(31.0, Some(&level)), Err(ImpossibleError::Steep { .. })));
        assert!(matches!(check(81.0, None), Err(ImpossibleError::EdgeOn { .. })));
        // A camera that leans sees the water lean by as much in its own frame, and that is level.
        let leaning = pose(0.0, 40.0, 5.0);
        assert!(
            check(40.0, Some(&leaning)).is_ok_and(|doubts| doubts.is_empty())
                || check(-40.0, Some(&leaning)).is_ok_and(|doubts| doubts.is_empty())
        );
        let vague = PoseAtExposure { attitude_sigma_rad: 0.1, ..level };
        assert_eq!(check(15.0, Some(&vague)), Ok(vec![]), "within three standard deviations of the attitude");
        // 5 m are seen, from a camera 0.1 m below the body.
        let high = PoseAtExposure { position_ned_m: Vector3::new(0.0, 0.0, -50.0), ..level };
        assert!(check(0.0, Some(&high)).unwrap()[0].to_string().contains("is 49.90 m above the water, by the pictures 5.00 m"));
        let unsure = PoseAtExposure { height_sigma_m: 10.0, ..high };
        assert_eq!(check(0.0, Some(&unsure)), Ok(vec![]), "within five standard deviations of the height");
        let mut doubts = Doubts::default();
        for pair in ["a", "b"] {
            doubts.add(pair, check(15.0, Some(&level)).unwrap());
        }
        doubts.add("c", check(75.0, None).unwrap());
        let lines = doubts.lines();
        assert!(lines[0].starts_with("a: ") && lines[0].ends_with("(2 pairs so)") && lines[1].starts_with("c: "), "{lines:?}");
        // 5 m of diagonal hold waves of at most 0.142 × 5 m / (2 √2) = 0.251 m RMS.
        let steep = |rms_m| check_plane(&plane(0.0, rms_m), None, &calibration, &rig).unwrap();
        assert!(steep(0.26)[0].to_string().contains("scatter 0.26 m RMS over 5.0 m"));
        assert_eq!(steep(0.24), []);
    }
}
