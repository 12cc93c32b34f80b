//! `halcyon features` and `halcyon self-calibrate` without their command line: real files, and everything that is wrong with files.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use std::path::{Path, PathBuf};

use halcyon_model::{Image, RigCalibration, rig_yaml};
use halcyon_reconstruction::cli::{
    self, FeaturesCliError, FeaturesOptions, SelfCalibrateCliError, SelfCalibrateOptions, SelfCalibrateReport,
};
use halcyon_reconstruction::core::features::FeatureError;
use halcyon_reconstruction::core::self_calibrate::SelfCalibrateError;
use halcyon_reconstruction::files::{FileError, OutputError};
use nalgebra::Rotation3;
use support::samples;
use support::scene::{default_rig, pose, render};

fn write_pgm(path: &Path, image: &Image) {
    let header = format!("P5\n{} {}\n255\n", image.width_px(), image.height_px());
    std::fs::write(path, [header.as_bytes(), image.pixels()].concat()).unwrap();
}

/// A rig whose right camera has pitched by a quarter of a degree since its calibration `rig.yaml`, over two places of a pond.
struct Bent {
    folder: tempfile::TempDir,
    truth: RigCalibration,
}

impl Bent {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let given = default_rig();
        std::fs::write(folder.path().join("rig.yaml"), rig_yaml::write(&given)).unwrap();
        let turn = Rotation3::from_euler_angles(0.25_f64.to_radians(), 0.0, 0.0);
        let truth = RigCalibration { right_from_left: turn.into_inner(), ..given };
        for i in 1..=2 {
            let at = pose(3.0 * i as f64, 0.0, 4.0, [4.0, -5.0, 20.0]);
            let pair = render(&truth, &at, &|n, e| 0.05 * (5.0 * n).sin() + 0.04 * (7.0 * e).cos(), 1.0, i);
            write_pgm(&folder.path().join(format!("left{i}.pgm")), &pair.left);
            write_pgm(&folder.path().join(format!("right{i}.pgm")), &pair.right);
        }
        Self { folder, truth }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn self_calibrate(
        &self,
        left: &str,
        right: &str,
        change: &dyn Fn(&mut SelfCalibrateOptions<'_>),
    ) -> Result<SelfCalibrateReport, SelfCalibrateCliError> {
        let (left, right) = (self.path(left), self.path(right));
        let rig = self.path("rig.yaml");
        let mut options = SelfCalibrateOptions {
            rig: &rig,
            left: left.to_str().unwrap(),
            right: right.to_str().unwrap(),
            method: "sift",
            solver: "five",
            baseline_m: None,
            altitude_m: None,
            refine_focal: false,
            ransac_px: 1.0,
            drift_px_max: 0.5,
            out: None,
        };
        change(&mut options);
        cli::self_calibrate(&options, &mut |_, _| {})
    }
}

#[test]
fn self_calibrate_finds_the_bend_and_writes_a_rig_that_reads_back() {
    let bent = Bent::new();
    let out = bent.path("new.yaml");
    let mut steps = Vec::new();
    let (rig, left, right) = (bent.path("rig.yaml"), bent.path("left*.pgm"), bent.path("right*.pgm"));
    let options = SelfCalibrateOptions {
        rig: &rig,
        left: left.to_str().unwrap(),
        right: right.to_str().unwrap(),
        method: "surf",
        solver: "five",
        baseline_m: Some(0.41),
        altitude_m: None,
        refine_focal: false,
        ransac_px: 1.0,
        drift_px_max: 0.5,
        out: Some(&out),
    };
    let report = cli::self_calibrate(&options, &mut |done, total| steps.push((done, total))).unwrap();
    println!("{report:?}");
    assert_eq!(steps, [(1, 2), (2, 2)]);
    assert!((report.pitch.deg - 0.25).abs() < (3.0 * report.pitch.sigma_deg).max(0.02), "{report:?}");
    assert!(report.has_drifted && (1.2..1.9).contains(&report.drift_px), "f · 0.0044 = 1.5 px: {report:?}");
    assert!(report.row_error_after_px < 0.4 && report.row_error_before_px > 1.2);
    assert_eq!((report.baseline_m, report.baseline_m_low), (0.41, 0.41));
    let new = rig_yaml::parse(&std::fs::read_to_string(&out).unwrap()).unwrap();
    let off = Rotation3::from_matrix_unchecked(new.right_from_left * bent.truth.right_from_left.transpose());
    assert!(off.angle().to_degrees() < 0.05 && new.left == bent.truth.left, "{}", off.angle().to_degrees());
    let json = serde_json::to_value(&report).unwrap();
    for key in ["matches", "inliers", "sigma_px", "row_error_before_px", "row_error_after_px", "drift_px", "baseline_m"] {
        assert!(json[key].is_number(), "{key}");
    }
    for key in ["pitch", "yaw", "roll", "baseline_down", "baseline_forward"] {
        assert!(json[key]["deg"].is_number() && json[key]["sigma_deg"].is_number(), "{key}");
    }
    assert!(json["has_drifted"].is_boolean());
    assert!((report.pitch.deg_high - report.pitch.deg - 1.96 * report.pitch.sigma_deg).abs() < 1e-4, "95 %");
    assert_eq!(report.warnings, [""; 0], "0.41 m are near the calibration's 0.4 m");
}

/// A length that does not suit the calibration in force scales every distance, and pictures cannot tell.
#[test]
fn a_length_far_from_the_calibrations_is_warned_of() {
    let bent = Bent::new();
    let warnings = |change: &dyn Fn(&mut SelfCalibrateOptions<'_>)| {
        bent.self_calibrate("left*.pgm", "right*.pgm", change).unwrap().warnings.join("\n")
    };
    let baseline = warnings(&|o| o.baseline_m = Some(4.0));
    assert!(baseline.contains("--baseline 4 m is 10.0") && baseline.contains("0.4000 m of the calibration"), "{baseline}");
    let altitude = warnings(&|o| o.altitude_m = Some(50.0));
    assert!(altitude.contains("with --altitude 50 m the baseline comes out at") && altitude.contains("95 %"), "{altitude}");
    assert_eq!((warnings(&|o| o.altitude_m = Some(4.0)), warnings(&|_| {})), (String::new(), String::new()));
}

#[test]
fn bad_input_to_self_calibrate_is_named() {
    let bent = Bent::new();
    let run = |left: &str, right: &str| bent.self_calibrate(left, right, &|_| {});
    let with = |change: &dyn Fn(&mut SelfCalibrateOptions<'_>)| bent.self_calibrate("left1.pgm", "right1.pgm", change);
    use SelfCalibrateCliError as E;
    use SelfCalibrateError as S;

    assert!(matches!(run("none*.pgm", "right*.pgm"), Err(E::Glob(_))));
    assert!(matches!(run("left*.pgm", "right1.pgm"), Err(E::Unpaired { left: 2, right: 1 })));
    assert!(matches!(run("left3.pgm", "right1.pgm"), Err(E::File(FileError::Read { .. }))));
    // Twice the same picture, left for right, and two places that share nothing.
    let same = run("left1.pgm", "left1.pgm");
    assert!(matches!(same, Err(E::SelfCalibrate(S::NoBaseline { .. }))), "{same:?}");
    let swapped = run("right1.pgm", "left1.pgm");
    assert!(matches!(swapped, Err(E::SelfCalibrate(S::Swapped))), "{swapped:?}");
    let strangers = run("left1.pgm", "right2.pgm");
    assert!(matches!(strangers, Err(E::SelfCalibrate(_))), "{strangers:?}");
    let blank = Image::new(320, 240, vec![90; 320 * 240].into()).unwrap();
    write_pgm(&bent.path("blank.pgm"), &blank);
    assert!(matches!(run("blank.pgm", "blank.pgm"), Err(E::SelfCalibrate(S::TooFew { matches: 0, .. }))));
    write_pgm(&bent.path("small.pgm"), &Image::new(64, 48, vec![90; 64 * 48].into()).unwrap());
    assert!(matches!(run("small.pgm", "right1.pgm"), Err(E::Size { width_px: 64, rig_width_px: 320, .. })));

    assert!(matches!(with(&|o| o.method = "fast"), Err(E::Method(_))));
    assert!(matches!(with(&|o| o.solver = "six"), Err(E::Solver(_))));
    assert!(matches!(
        with(&|o| {
            o.baseline_m = Some(1.0);
            o.altitude_m = Some(1.0);
        }),
        Err(E::TwoScales)
    ));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(matches!(with(&|o| o.baseline_m = Some(bad)), Err(E::Range { .. })), "{bad}");
        assert!(matches!(with(&|o| o.altitude_m = Some(bad)), Err(E::Range { .. })), "{bad}");
        assert!(matches!(with(&|o| o.ransac_px = bad), Err(E::Range { .. })), "{bad}");
    }
    assert!(matches!(with(&|o| o.drift_px_max = f64::NAN), Err(E::Range { .. })));
    assert!(matches!(with(&|o| o.rig = Path::new("/nowhere/rig.yaml")), Err(E::Rig(_))));
    let picture = bent.path("left1.pgm");
    let as_rig = bent.self_calibrate("left1.pgm", "right1.pgm", &|_| {});
    assert!(as_rig.is_ok(), "{as_rig:?}");
    let options = SelfCalibrateOptions { rig: &picture, ..options_of("left", "right") };
    assert!(matches!(cli::self_calibrate(&options, &mut |_, _| {}), Err(E::Rig(_))));
    assert!(matches!(
        with(&|o| o.out = Some(Path::new("/nowhere/new.yaml"))),
        Err(E::File(FileError::Output(OutputError::NoFolder { .. })))
    ));
}

fn options_of<'a>(left: &'a str, right: &'a str) -> SelfCalibrateOptions<'a> {
    SelfCalibrateOptions {
        rig: Path::new("rig.yaml"),
        left,
        right,
        method: "sift",
        solver: "five",
        baseline_m: None,
        altitude_m: None,
        refine_focal: false,
        ransac_px: 1.0,
        drift_px_max: 0.5,
        out: None,
    }
}

fn features_options<'a>(left: &'a Path, right: &'a Path) -> FeaturesOptions<'a> {
    FeaturesOptions {
        left,
        right,
        method: "sift",
        rig: None,
        ransac_px: 1.0,
        keypoints_max: 1000,
        ratio_max: 0.8,
        is_mutual: true,
        out: None,
        cloud: None,
    }
}

#[test]
fn features_of_a_pair_with_and_without_its_rig() {
    let bent = Bent::new();
    let (left, right) = (bent.path("left1.pgm"), bent.path("right1.pgm"));
    let rig = bent.path("true.yaml");
    std::fs::write(&rig, rig_yaml::write(&bent.truth)).unwrap();
    let (out, cloud) = (bent.path("matches.png"), bent.path("points.ply"));
    let options = FeaturesOptions {
        method: "all",
        rig: Some(&rig),
        out: Some(&out),
        cloud: Some(&cloud),
        ..features_options(&left, &right)
    };
    let report = cli::features(&options).unwrap();
    assert_eq!(report.rows.iter().map(|row| row.method).collect::<Vec<_>>(), ["sift", "surf", "orb", "akaze"]);
    assert_eq!(report.files.len(), 8);
    for row in &report.rows {
        let pose = row.pose.as_ref().unwrap();
        println!("{row:?}");
        assert!(row.left_after == row.right_after && row.left_after <= row.matches && row.matches <= row.left);
        // One look at gentle waves: depth enough for a rough pose.
        assert!(pose.points * 10 > row.left_after * 9 && row.left_after > 50, "{row:?}");
        assert_eq!((pose.left_projection[0][0], pose.left_projection[2]), (343.1, [0.0, 0.0, 1.0, 0.0]));
        assert!(report.files.contains(&bent.path(&format!("matches-{}.png", row.method))));
        let ply = std::fs::read_to_string(bent.path(&format!("points-{}.ply", row.method))).unwrap();
        assert!(ply.starts_with("ply\nformat ascii 1.0\n") && ply.contains(&format!("element vertex {}\n", pose.points)));
        assert_eq!(ply.lines().skip_while(|line| *line != "end_header").count(), pose.points + 1);
    }
    let json = serde_json::to_value(&report).unwrap();
    for key in ["left", "right", "matches", "left_after", "right_after"] {
        assert!(json["rows"][1][key].is_number(), "{key}");
    }
    assert_eq!(json["rows"][0]["fundamental"].as_array().unwrap().len(), 3);
    // The thesis's rule, every nearest neighbour, finds as many matches as there are keypoints.
    let thesis = FeaturesOptions { ratio_max: 1.0, is_mutual: false, ..features_options(&left, &right) };
    let row = &cli::features(&thesis).unwrap().rows[0];
    assert!(row.matches == row.left && row.left_after < row.matches && row.pose.is_none(), "{row:?}");
    // A picture against itself: F is open, or anything; the counts stand.
    let same = &cli::features(&features_options(&left, &left)).unwrap().rows[0];
    assert_eq!((same.left, same.matches), (same.right, same.left));
    // A cloud that does not come about is said, and the rest is there all the same.
    let blank = bent.path("blank.pgm");
    write_pgm(&blank, &Image::new(320, 240, vec![90; 320 * 240].into()).unwrap());
    let (picture, none) = (bent.path("blank.png"), bent.path("none.ply"));
    let nothing =
        FeaturesOptions { rig: Some(&rig), out: Some(&picture), cloud: Some(&none), ..features_options(&blank, &blank) };
    let report = cli::features(&nothing).unwrap();
    assert_eq!((report.files, report.missing[0].path.clone()), (vec![picture], none.clone()));
    assert!(!none.exists() && report.missing[0].why.starts_with("no epipolar geometry"));
}

#[test]
fn bad_input_to_features_is_named() {
    let bent = Bent::new();
    let (left, right) = (bent.path("left1.pgm"), bent.path("right1.pgm"));
    let run = |change: &dyn Fn(&mut FeaturesOptions<'_>)| {
        let mut options = features_options(&left, &right);
        change(&mut options);
        cli::features(&options)
    };
    use FeaturesCliError as E;
    assert!(matches!(run(&|o| o.method = "harris"), Err(E::Method(_))));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(run(&|o| o.ransac_px = bad), Err(E::Range { .. })), "{bad}");
        assert!(matches!(run(&|o| o.ratio_max = bad), Err(E::Range { .. })), "{bad}");
    }
    for bad in [0, 20_001, usize::MAX] {
        assert!(matches!(run(&|o| o.keypoints_max = bad), Err(E::Range { .. })), "{bad}");
    }
    assert!(matches!(run(&|o| o.cloud = Some(Path::new("a.ply"))), Err(E::CloudWithoutRig)));
    assert!(matches!(run(&|o| o.out = Some(Path::new("a.jpg"))), Err(E::File(FileError::Output(OutputError::Ending { .. })))));
    assert!(matches!(
        run(&|o| o.out = Some(Path::new("/nowhere/a.png"))),
        Err(E::File(FileError::Output(OutputError::NoFolder { .. })))
    ));
    assert!(matches!(run(&|o| o.left = Path::new("/nowhere.png")), Err(E::File(FileError::Read { .. }))));
    assert!(matches!(run(&|o| o.rig = Some(Path::new("/nowhere.yaml"))), Err(E::Rig(_))));
    let small = bent.path("small.pgm");
    write_pgm(&small, &Image::new(20, 20, vec![90; 400].into()).unwrap());
    assert!(matches!(
        cli::features(&features_options(&small, &small)),
        Err(E::Features(FeatureError::TooSmall { width_px: 20, .. }))
    ));
    let rig = bent.path("rig.yaml");
    let aloe = samples().join("aloeL.jpg");
    let of_another = FeaturesOptions { rig: Some(&rig), ..features_options(&aloe, &right) };
    assert!(matches!(cli::features(&of_another), Err(E::Size { width_px: 1282, rig_width_px: 320, .. })));
    assert!(!bent.path("matches.png").exists());
    // With all methods it is the files of each that must not be inputs.
    let (picture, out) = (bent.path("m-orb.png"), bent.path("m.png"));
    std::fs::copy(&left, &picture).unwrap();
    let all = FeaturesOptions { method: "all", out: Some(&out), ..features_options(&picture, &right) };
    let refused = cli::features(&all).unwrap_err().to_string();
    assert!(refused.contains("m-orb.png would overwrite an input, that of --left"), "{refused}");
    assert_eq!(std::fs::read(&picture).unwrap(), std::fs::read(&left).unwrap());
}
