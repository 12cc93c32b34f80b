//! The command-line entry points with real files, and with everything that is wrong with files.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use std::path::Path;

use halcyon_model::{CameraIntrinsics, RigCalibration};
use halcyon_reconstruction::cli::{self, CalibrateCliError, CalibrateRequest, MatchCliError, MatchOptions};
use halcyon_reconstruction::core::calibrate::{CalibrateError, Options};
use halcyon_reconstruction::core::disparity::{Disparity, pfm};
use halcyon_reconstruction::core::matcher::{Engine, StudyMethod};
use halcyon_reconstruction::files::{self, FileError, OutputError, RigFileError, read_picture, read_rig};
use nalgebra::{Matrix3, Vector3};
use support::samples;

fn sample_glob(side: &str) -> String {
    samples().join(format!("{side}??.jpg")).to_string_lossy().into_owned()
}

fn request<'a>(left: &'a str, right: &'a str, board: &'a str, out: Option<&'a Path>) -> CalibrateRequest<'a> {
    CalibrateRequest { left, right, board, square_m: 0.025, options: Options::default(), out, ros: None }
}

fn calibrate(left: &str, right: &str, board: &str, out: Option<&Path>) -> Result<cli::CalibrateReport, CalibrateCliError> {
    cli::calibrate(&request(left, right, board, out), &mut |_, _| {}).map(|(report, _)| report)
}

#[test]
fn calibrate_writes_a_rig_that_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("rig.yaml");
    let ros = folder.path().join("made/ros");
    let mut steps = Vec::new();
    let (left, right) = (sample_glob("left"), sample_glob("right"));
    let request = CalibrateRequest { ros: Some(&ros), ..request(&left, &right, "9x6", Some(&out)) };
    let (report, calibration) = cli::calibrate(&request, &mut |done, total| steps.push((done, total))).unwrap();
    assert_eq!(steps, (1..=13).map(|done| (done, 13)).collect::<Vec<_>>());
    assert!(report.stereo_rms_px <= 0.2, "{report:?}");
    assert!(report.views[0].left.ends_with("left01.jpg") && report.views[12].right.ends_with("right14.jpg"));
    let rig = halcyon_model::rig_yaml::parse(&std::fs::read_to_string(&out).unwrap()).unwrap();
    assert_eq!((rig.width_px, rig.height_px), (640, 480));
    assert_eq!(rig.left.fx_px, report.left.fx_px);
    assert_eq!(rig.baseline_m(), report.baseline_m);
    assert_eq!(read_rig(&out).unwrap(), calibration.rig);
    // Through ROS's two files, and from there back to OpenCV's one.
    let back = folder.path().join("back.yaml");
    cli::convert_rig(&ros, Some(&back), None).unwrap();
    let through = read_rig(&back).unwrap();
    assert_eq!((through.left, through.right), (rig.left, rig.right));
    assert!((through.right_from_left - rig.right_from_left).norm() < 1e-12, "{}", through.right_from_left);
    assert!((through.right_from_left_m - rig.right_from_left_m).norm() < 1e-12, "{}", through.right_from_left_m);

    let json = serde_json::to_value(&report).unwrap();
    let low_value_high = |of: &serde_json::Value, key: &str| {
        let number = |key: String| of[&key].as_f64().unwrap_or_else(|| panic!("{key}"));
        (number(format!("{key}_low")), number(key.to_owned()), number(format!("{key}_high")))
    };
    for (of, key) in [(&json, "baseline_m"), (&json["left"], "fx_px"), (&json["right"], "cy_px")] {
        let (low, value, high) = low_value_high(of, key);
        assert!(low < value && value < high && high - low < 0.05 * value, "{key} {low} {value} {high}");
    }
    assert_eq!(json["error_by_views"].as_array().unwrap().len(), 11);
    assert_eq!(json["left"]["coverage_map"]["counts"].as_array().unwrap().len(), 48);
    assert!(json["board_warp_m"].is_array() && json["depth_uncertainty"]["median_m"].is_number());
    for key in [
        "views_total",
        "views_used",
        "corners_total",
        "corners_rejected",
        "stereo_rms_px",
        "baseline_m",
        "row_error_rms_px",
        "row_error_max_px",
    ] {
        assert!(json[key].is_number(), "{key}");
    }
    for side in ["left", "right"] {
        for key in ["fx_px", "fy_px", "cx_px", "cy_px", "rms_px"] {
            assert!(json[side][key].is_number(), "{side}.{key}");
        }
        assert_eq!(json[side]["distortion"].as_array().unwrap().len(), 5);
    }
}

#[test]
fn bad_input_to_calibrate_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (left, right) = (sample_glob("left"), sample_glob("right"));
    let first = |side: &str| samples().join(format!("{side}01.jpg")).to_string_lossy().into_owned();
    let nowhere = folder.path().join("none*.jpg").to_string_lossy().into_owned();

    assert!(matches!(calibrate(&nowhere, &right, "9x6", None), Err(CalibrateCliError::Glob(_))));
    assert!(matches!(calibrate(&left, &first("right"), "9x6", None), Err(CalibrateCliError::Unpaired { left: 13, right: 1 })));
    assert!(matches!(
        calibrate("/nowhere/a.jpg", "/nowhere/b.jpg", "9x6", None),
        Err(CalibrateCliError::File(FileError::Read { .. }))
    ));
    let too_few = calibrate(&first("left"), &first("right"), "9x6", None);
    assert!(
        matches!(too_few, Err(CalibrateCliError::Calibrate(CalibrateError::TooFewViews { views: 1, usable: 1 }))),
        "{too_few:?}"
    );
    let other_board = calibrate(&first("left"), &first("right"), "8x5", None);
    match other_board {
        Err(CalibrateCliError::Calibrate(CalibrateError::WrongBoard { cols: 8, rows: 5, seen_cols, seen_rows })) => {
            assert_eq!((seen_cols, seen_rows), (9, 6));
        }
        other => panic!("{other:?}"),
    }
    // A part of the board is found in most pictures, and is not the board.
    for (side, i) in ["left", "right"].into_iter().flat_map(|side| [3, 6, 7, 8].map(|i| (side, i))) {
        let name = format!("{side}{i:02}.jpg");
        std::fs::copy(samples().join(&name), folder.path().join(&name)).unwrap();
    }
    let few = |side: &str| folder.path().join(format!("{side}0?.jpg")).to_string_lossy().into_owned();
    let part = calibrate(&few("left"), &few("right"), "8x6", None);
    assert!(
        matches!(part, Err(CalibrateCliError::Calibrate(CalibrateError::WrongBoard { seen_cols: 9, seen_rows: 6, .. }))),
        "{part:?}"
    );
    let mixed = calibrate(&first("left"), &samples().join("aloeL.jpg").to_string_lossy(), "9x6", None);
    assert!(matches!(mixed, Err(CalibrateCliError::Calibrate(CalibrateError::MixedSizes { view: 0, .. }))));
    let blank = write_pgm(folder.path(), "blank.pgm", 64, 48, &vec![90; 64 * 48]);
    let no_board = calibrate(&blank, &blank, "9x6", None);
    assert!(matches!(no_board, Err(CalibrateCliError::Calibrate(CalibrateError::NoBoard { pictures: 2, .. }))), "{no_board:?}");
    for square_m in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        let refused = cli::calibrate(&CalibrateRequest { square_m, ..request(&left, &right, "9x6", None) }, &mut |_, _| {});
        assert!(matches!(refused, Err(CalibrateCliError::Range(_))), "{square_m}");
    }
    let with_itself = calibrate(&left, &left, "9x6", None);
    assert!(
        matches!(with_itself, Err(CalibrateCliError::Calibrate(CalibrateError::SamePicture { first: 0, second: 0, .. }))),
        "{with_itself:?}"
    );
    let text = folder.path().join("text.jpg");
    std::fs::write(&text, "no picture").unwrap();
    let text = calibrate(text.to_str().unwrap(), &first("right"), "9x6", None);
    assert!(matches!(text, Err(CalibrateCliError::File(FileError::NotAPicture { .. }))), "{text:?}");
    let nowhere_to_write = calibrate(&few("left"), &few("right"), "9x6", Some(Path::new("/nowhere/rig.yaml")));
    assert!(matches!(nowhere_to_write, Err(CalibrateCliError::File(FileError::Output(OutputError::NoFolder { .. })))));
    // What is wrong with a number or an output is said before a picture is read: none of these has a board.
    let options = Options { depth_at_m: f64::NAN, ..Options::default() };
    let refused = cli::calibrate(&CalibrateRequest { options, ..request(&blank, &blank, "9x6", None) }, &mut |_, _| {});
    assert!(refused.unwrap_err().to_string().starts_with("--distance must be 0.001 to 10000 m, not NaN"));
    let refused = calibrate(&blank, &blank, "9x6", Some(Path::new("rig.txt"))).unwrap_err().to_string();
    assert_eq!(refused, "--out rig.txt: the name must end in .yaml or .yml");
    let yaml = folder.path().join("left.yaml");
    std::fs::copy(&blank, &yaml).unwrap();
    let refused = calibrate(yaml.to_str().unwrap(), &blank, "9x6", Some(&yaml)).unwrap_err().to_string();
    assert!(refused.contains("overwrite an input, that of --left"), "{refused}");
    let report = folder.path().join("report.html");
    let ask = request(&blank, &blank, "9x6", None);
    assert!(ask.check(Some(&report)).is_ok());
    assert!(ask.check(Some(&folder.path().join("report.pdf"))).unwrap_err().to_string().contains("--report"));
}

#[test]
fn converting_a_rig_never_overwrites_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rig = calibrated_rig();
    files::write_rig(&at("rig.yaml"), &rig).unwrap();
    cli::convert_rig(&at("rig.yaml"), Some(&at("copy.yaml")), Some(&at("ros"))).unwrap();
    assert_eq!(files::read_rig(&at("copy.yaml")).unwrap(), rig);
    for (from, out, ros) in
        [("rig.yaml", Some("rig.yaml"), None), ("ros", None, Some("ros")), ("ros", Some("ros/left.yaml"), None)]
    {
        let before = std::fs::read(at("ros/left.yaml")).unwrap();
        let (out, ros) = (out.map(at), ros.map(at));
        let refused = cli::convert_rig(&at(from), out.as_deref(), ros.as_deref()).unwrap_err().to_string();
        assert!(refused.contains("overwrite an input, that of --from"), "{refused}");
        assert_eq!(std::fs::read(at("ros/left.yaml")).unwrap(), before);
    }
}

fn calibrated_rig() -> RigCalibration {
    let camera = CameraIntrinsics { fx_px: 509.0, fy_px: 509.0, cx_px: 319.5, cy_px: 239.5, distortion: [0.0; 5] };
    RigCalibration {
        width_px: 640,
        height_px: 480,
        left: camera,
        right: camera,
        right_from_left: Matrix3::identity(),
        right_from_left_m: Vector3::new(-0.092, 0.0, 0.0),
        body_from_camera: RigCalibration::LOOKING_DOWN,
        camera_in_body_m: Vector3::zeros(),
    }
}

#[test]
fn a_rig_of_impossible_numbers_is_refused_with_the_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.yaml");
    let mut rig = calibrated_rig();
    rig.left.fx_px = 1e308;
    files::write_rig(&path, &rig).unwrap();
    let refused = files::read_rig(&path).unwrap_err();
    assert!(matches!(refused, RigFileError::Impossible { .. }));
    assert!(std::error::Error::source(&refused).unwrap().to_string().contains("fx must be 32 to 64000 px"));
}

/// Opening a pipe that nobody writes to never returns.
#[cfg(unix)]
#[test]
fn a_named_pipe_is_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("left.png");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    assert!(matches!(read_picture(&pipe), Err(FileError::Device { .. })));
    let text = read_picture(&pipe).unwrap_err().to_string();
    assert!(text.contains("a device or a pipe, not a file"), "{text}");
    assert!(matches!(files::read_rig(&pipe), Err(RigFileError::File(FileError::Device { .. }))));
}

#[test]
fn a_file_that_is_no_calibration_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rig.yaml");
    std::fs::write(&file, [0xff, 0xfe, 0, b'\n']).unwrap();
    for path in [file.as_path(), folder.path(), Path::new("/nowhere/rig.yaml")] {
        let refused = cli::convert_rig(path, None, None).unwrap_err();
        assert!(matches!(refused, CalibrateCliError::Rig(RigFileError::Content { .. } | RigFileError::File(_))), "{refused:?}");
        assert_eq!(refused.to_string().lines().count(), 1, "{refused}");
    }
}

fn write_pgm(folder: &Path, name: &str, width: u32, height: u32, pixels: &[u8]) -> String {
    let path = folder.join(name);
    std::fs::write(&path, [format!("P5\n{width} {height}\n255\n").as_bytes(), pixels].concat()).unwrap();
    path.to_string_lossy().into_owned()
}

/// A right picture that is the left one moved by a known number of pixels.
fn shifted_pair(folder: &Path, shift: usize) -> (String, String) {
    let aloe = read_picture(&samples().join("aloeL.jpg")).unwrap();
    let (width, height) = (320, 120);
    let crop = |from: usize| -> Vec<u8> {
        let rows = aloe.pixels().chunks_exact(aloe.width_px() as usize).skip(300).take(height);
        rows.flat_map(|row| row[200 + from..][..width].to_vec()).collect()
    };
    (
        write_pgm(folder, "left.pgm", width as u32, height as u32, &crop(0)),
        write_pgm(folder, "right.pgm", width as u32, height as u32, &crop(shift)),
    )
}

#[test]
fn match_finds_a_known_shift_with_every_engine_and_both_formats() {
    let folder = tempfile::tempdir().unwrap();
    let (left, right) = shifted_pair(folder.path(), 20);
    for engine in Engine::ALL.into_iter().chain(StudyMethod::ALL.map(Engine::Study)) {
        let (engine, disparities) =
            (engine.name(), if matches!(engine, Engine::Guided | Engine::Sgm(_) | Engine::Study(_)) { 22 } else { 32 });
        let out = folder.path().join("d.pfm");
        // 21 is no multiple of 16: rounded up, not refused.
        let report = cli::match_pair(left.as_ref(), right.as_ref(), 21.0, engine, &MatchOptions::default(), &out).unwrap();
        assert_eq!((report.engine, report.width_px, report.height_px, report.disparities), (engine, 320, 120, disparities));
        let map = pfm::decode(&std::fs::read(&out).unwrap()).unwrap();
        assert!((map.density() - report.density).abs() < 1e-12);
        let right_ones = map.values_px.iter().filter(|value| (**value - 20.0).abs() < 0.5).count();
        let matched = map.values_px.iter().filter(|value| value.is_finite()).count();
        assert!(right_ones as f64 > 0.97 * matched as f64 && report.density > 0.6, "{engine} {right_ones} of {matched}");
        // The 20 columns whose match would lie outside the right picture are no match.
        assert!((0..120).all(|row| map.values_px[row * 320..][..19].iter().all(|value| value.is_nan() || *value < 20.0)));
    }
    let png = folder.path().join("d.png");
    cli::match_pair(left.as_ref(), right.as_ref(), 32.0, "sgbm", &MatchOptions::default(), &png).unwrap();
    assert_eq!(read_picture(&png).map(|image| (image.width_px(), image.height_px())).unwrap(), (320, 120));
}

/// OpenCV searches multiples of 16 disparities: with at most 17 px it looks up to 31, and would find the shift of 20 px.
#[test]
fn what_lies_beyond_the_range_is_no_match() {
    let folder = tempfile::tempdir().unwrap();
    let (left, right) = shifted_pair(folder.path(), 20);
    let out = folder.path().join("d.pfm");
    for (engine, is_opencv) in [("bm", true), ("sgbm", true), ("sgbm-3way", true), ("sgm", false), ("guided", false)] {
        let run = |max| cli::match_pair(left.as_ref(), right.as_ref(), max, engine, &MatchOptions::default(), &out).unwrap();
        let report = run(17.0);
        let map = pfm::decode(&std::fs::read(&out).unwrap()).unwrap();
        assert!(map.values_px.iter().all(|value| value.is_nan() || *value <= 17.0), "{engine}");
        assert!((map.density() - report.density).abs() < 1e-12, "{engine}: what is dropped is not counted");
        assert!(run(21.0).density > 0.6, "{engine}");
        // Ours never look beyond; what they take for matches within is another matter.
        assert!(!is_opencv || report.density < 0.2, "{engine} {}", report.density);
    }
}

#[test]
fn blank_pictures_have_no_matches() {
    let folder = tempfile::tempdir().unwrap();
    let (left, _) = shifted_pair(folder.path(), 20);
    let out = folder.path().join("d.pfm");
    let black = write_pgm(folder.path(), "black.pgm", 320, 120, &vec![0; 320 * 120]);
    for (left, right) in [(&black, &black), (&left, &black), (&black, &left)] {
        for engine in Engine::ALL {
            let report =
                cli::match_pair(left.as_ref(), right.as_ref(), 32.0, engine.name(), &MatchOptions::default(), &out).unwrap();
            assert_eq!((report.points, report.density), (0, 0.0), "{}", engine.name());
            assert!(report.warnings[0].starts_with("no texture in ") && report.warnings[0].contains("black.pgm"));
            assert_eq!(pfm::decode(&std::fs::read(&out).unwrap()).unwrap().matched(), 0);
        }
    }
}

#[test]
fn bad_input_to_match_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (left, right) = shifted_pair(folder.path(), 20);
    let small = write_pgm(folder.path(), "small.pgm", 4, 4, &[7; 16]);
    let out = folder.path().join("d.pfm");
    let run = |left: &str, right: &str, max: f64, engine: &str, out: &Path| {
        cli::match_pair(left.as_ref(), right.as_ref(), max, engine, &MatchOptions::default(), out)
    };

    for max in [0.0, -16.0, f64::NAN, f64::INFINITY, 1e12] {
        let refused = run("/nowhere.png", &right, max, "sgbm", &out);
        assert!(matches!(refused, Err(MatchCliError::Range(_))), "{max}: before a picture is read: {refused:?}");
    }
    let refused = run(&left, &right, 320.0, "sgbm", &out);
    assert!(matches!(refused, Err(MatchCliError::MaxDisparity { width_px: 320, .. })), "{refused:?}");
    for output in [&left, &right] {
        let before = std::fs::read(output).unwrap();
        let link = folder.path().join("link.pfm");
        std::fs::hard_link(output, &link).unwrap();
        let refused = run(&left, &right, 32.0, "bm", &link).unwrap_err().to_string();
        assert!(refused.contains("overwrite an input"), "{refused}");
        std::fs::remove_file(&link).unwrap();
        assert_eq!(std::fs::read(output).unwrap(), before);
    }
    assert!(matches!(run(&left, &right, 32.0, "elas", &out), Err(MatchCliError::Engine(_))));
    assert!(matches!(run(&left, &small, 32.0, "bm", &out), Err(MatchCliError::Match(_))));
    assert!(matches!(run(&small, &small, 3.0, "sgbm", &out), Err(MatchCliError::Match(_))));
    assert!(matches!(
        run(&left, &right, 32.0, "bm", Path::new("/nowhere/d.pfm")),
        Err(MatchCliError::File(FileError::Output(OutputError::NoFolder { .. })))
    ));
    assert!(matches!(
        run(&left, &right, 32.0, "bm", Path::new("d.tiff")),
        Err(MatchCliError::File(FileError::Output(OutputError::Ending { .. })))
    ));
    assert!(matches!(run(&left, "/nowhere.jpg", 32.0, "bm", &out), Err(MatchCliError::File(FileError::Read { .. }))));
    assert!(matches!(
        run(&left, folder.path().to_str().unwrap(), 32.0, "bm", &out),
        Err(MatchCliError::File(FileError::Read { .. }))
    ));
    assert!(!out.exists(), "nothing is written for bad input");
}

#[test]
fn match_counts_bad_pixels_against_a_truth() {
    let folder = tempfile::tempdir().unwrap();
    let (left, right) = shifted_pair(folder.path(), 20);
    let out = folder.path().join("d.pfm");
    let run = |truth: &str, scale: f32| {
        let options = MatchOptions { truth: Some(truth.into()), truth_scale_px: scale, ..MatchOptions::default() };
        cli::match_pair(left.as_ref(), right.as_ref(), 32.0, "wta-census", &options, &out)
    };
    // 20 px at half a pixel a grey level, unknown in the left half.
    let levels: Vec<u8> = (0..320 * 120).map(|i| if i % 320 < 160 { 0 } else { 40 }).collect();
    let picture = write_pgm(folder.path(), "truth.pgm", 320, 120, &levels);
    let truth = run(&picture, 0.5).unwrap().truth.unwrap();
    assert!(truth.known == 160 * 120 && truth.density > 0.9 && truth.bad1 < 0.01 && truth.mean_error_px < 0.05, "{truth:?}");
    let wrong = run(&picture, 0.6).unwrap().truth.unwrap();
    assert!(wrong.bad1 > 0.99 && wrong.bad2 > 0.99 && (wrong.mean_error_px - 4.0).abs() < 0.1, "{wrong:?}");

    let numbers = folder.path().join("truth.pfm");
    let map = Disparity { width_px: 320, height_px: 120, values_px: vec![20.0; 320 * 120] };
    std::fs::write(&numbers, pfm::encode(&map)).unwrap();
    let report = run(&numbers.to_string_lossy(), 1.0).unwrap();
    assert!(report.truth.unwrap().bad1 < 0.01);
    assert_eq!(report.points as f64 / (320.0 * 120.0), report.density);
    let json = serde_json::to_value(&report).unwrap();
    for key in ["known", "density", "bad1", "bad2", "mean_error_px"] {
        assert!(json["truth"][key].is_number(), "{key}");
    }
    for key in ["width_px", "height_px", "disparities", "window_px", "points", "density", "wall_ms"] {
        assert!(json[key].is_number(), "{key}");
    }

    let small = write_pgm(folder.path(), "small.pgm", 4, 4, &[7; 16]);
    assert!(matches!(run(&small, 1.0), Err(MatchCliError::Truth(_))));
    std::fs::write(&numbers, b"Pf 320 120 -1\nabc").unwrap();
    assert!(matches!(run(&numbers.to_string_lossy(), 1.0), Err(MatchCliError::File(FileError::Pfm { .. }))));
    assert!(matches!(run(&picture, f32::NAN), Err(MatchCliError::Option(_))));
}
