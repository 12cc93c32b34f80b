//! The command-line entry points with real files, and with everything that is wrong with files.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use std::path::Path;

use halcyon_reconstruction::cli::{self, CalibrateCliError, MatchCliError, MatchOptions};
use halcyon_reconstruction::core::calibrate::CalibrateError;
use halcyon_reconstruction::core::disparity::{Disparity, pfm};
use halcyon_reconstruction::core::matcher::{Engine, StudyMethod};
use halcyon_reconstruction::files::{FileError, read_picture};
use support::samples;

fn sample_glob(side: &str) -> String {
    samples().join(format!("{side}??.jpg")).to_string_lossy().into_owned()
}

fn calibrate(left: &str, right: &str, board: &str, out: Option<&Path>) -> Result<cli::CalibrateReport, CalibrateCliError> {
    cli::calibrate(left, right, board, 0.025, out, &mut |_, _| {})
}

#[test]
fn calibrate_writes_a_rig_that_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("rig.yaml");
    let mut steps = Vec::new();
    let report = cli::calibrate(&sample_glob("left"), &sample_glob("right"), "9x6", 0.025, Some(&out), &mut |done, total| {
        steps.push((done, total));
    })
    .unwrap();
    assert_eq!(steps, (1..=13).map(|done| (done, 13)).collect::<Vec<_>>());
    assert!(report.stereo_rms_px <= 0.46, "{report:?}");
    assert!(report.views[0].left.ends_with("left01.jpg") && report.views[12].right.ends_with("right14.jpg"));
    let rig = halcyon_model::rig_yaml::parse(&std::fs::read_to_string(&out).unwrap()).unwrap();
    assert_eq!((rig.width_px, rig.height_px), (640, 480));
    assert_eq!(rig.left.fx_px, report.left.fx_px);
    assert_eq!(rig.baseline_m(), report.baseline_m);
    let json = serde_json::to_value(&report).unwrap();
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
    let seen = |seen_cols, seen_rows| (seen_cols, seen_rows) == (9, 6) || (seen_cols, seen_rows) == (6, 9);
    match other_board {
        Err(CalibrateCliError::Calibrate(CalibrateError::WrongBoard { cols: 8, rows: 5, seen_cols, seen_rows })) => {
            assert!(seen(seen_cols, seen_rows));
        }
        other => panic!("{other:?}"),
    }
    let mixed = calibrate(&first("left"), &samples().join("aloeL.jpg").to_string_lossy(), "9x6", None);
    assert!(matches!(mixed, Err(CalibrateCliError::Calibrate(CalibrateError::MixedSizes { view: 0, .. }))));
    let blank = write_pgm(folder.path(), "blank.pgm", 64, 48, &vec![90; 64 * 48]);
    let no_board = calibrate(&blank, &blank, "9x6", None);
    assert!(matches!(no_board, Err(CalibrateCliError::Calibrate(CalibrateError::NoBoard { pictures: 2, .. }))), "{no_board:?}");
    let nowhere_to_write = calibrate(&left, &right, "9x6", Some(Path::new("/nowhere/rig.yaml")));
    assert!(matches!(nowhere_to_write, Err(CalibrateCliError::File(FileError::Write { .. }))));
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
        let (engine, disparities) = (engine.name(), if matches!(engine, Engine::Study(_)) { 22 } else { 32 });
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

#[test]
fn bad_input_to_match_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (left, right) = shifted_pair(folder.path(), 20);
    let small = write_pgm(folder.path(), "small.pgm", 4, 4, &[7; 16]);
    let out = folder.path().join("d.pfm");
    let run = |left: &str, right: &str, max: f64, engine: &str, out: &Path| {
        cli::match_pair(left.as_ref(), right.as_ref(), max, engine, &MatchOptions::default(), out)
    };

    for max in [0.0, -16.0, f64::NAN, f64::INFINITY, 320.0, 1e12] {
        let refused = run(&left, &right, max, "sgbm", &out);
        assert!(matches!(refused, Err(MatchCliError::MaxDisparity { width_px: 320, .. })), "{max}: {refused:?}");
    }
    assert!(matches!(run(&left, &right, 32.0, "elas", &out), Err(MatchCliError::Engine(_))));
    assert!(matches!(run(&left, &small, 32.0, "bm", &out), Err(MatchCliError::Match(_))));
    assert!(matches!(run(&small, &small, 3.0, "sgbm", &out), Err(MatchCliError::Match(_))));
    assert!(matches!(
        run(&left, &right, 32.0, "bm", Path::new("/nowhere/d.pfm")),
        Err(MatchCliError::File(FileError::Write { .. }))
    ));
    assert!(matches!(
        run(&left, &right, 32.0, "bm", Path::new("d.tiff")),
        Err(MatchCliError::File(FileError::Extension { .. }))
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
