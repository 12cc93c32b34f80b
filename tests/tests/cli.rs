//! The command line on real pictures, and in careless hands: one clear line and exit code 2.

#![allow(clippy::expect_used, clippy::panic, reason = "tests fail by panicking")]

use std::path::PathBuf;
use std::process::{Command, Output};

use halcyon_tests::{program, root};
use serde_json::Value;

fn halcyon(arguments: &[&str]) -> Output {
    Command::new(program("halcyon")).args(arguments).current_dir(root()).output().expect("halcyon runs")
}

fn json(output: &Output) -> Value {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {stderr}"))
}

#[track_caller]
fn refused(arguments: &[&str], expected: &str) {
    let output = halcyon(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    assert!(stderr.to_lowercase().contains(&expected.to_lowercase()), "{arguments:?}: {stderr:?} should contain {expected:?}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "one line: {stderr}");
    assert!(output.stdout.is_empty(), "nothing on stdout");
}

const BOARD: [&str; 4] = ["--board", "9x6", "--square", "0.025"];

fn calibrate<'a>(left: &'a str, right: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    [&["calibrate", "--left", left, "--right", right], rest].concat()
}

#[test]
fn the_sample_checkerboards_calibrate_to_half_a_pixel() {
    assert!(root().join("samples/right14.jpg").is_file(), "no sample pictures: run `make samples`");
    let folder = tempfile::tempdir().expect("a folder");
    let rig = folder.path().join("rig.yaml");
    let arguments = calibrate("samples/left??.jpg", "samples/right??.jpg", &BOARD);
    let report = json(&halcyon(&[&arguments[..], &["--out", rig.to_str().expect("text"), "--json"]].concat()));
    assert_eq!(report["views_total"], 13);
    let rms_px = report["stereo_rms_px"].as_f64().expect("a number");
    assert!(rms_px <= 0.46, "{rms_px}");
    // The sample's squares are of unit size to OpenCV; its published stereo baseline is 3.33 squares.
    let baseline_m = report["baseline_m"].as_f64().expect("a number");
    assert!((baseline_m / 0.025 - 3.34).abs() < 0.05, "{baseline_m}");
    let text = std::fs::read_to_string(rig).expect("the rig is written");
    assert!(text.starts_with("%YAML") && text.contains("M1"), "{text}");
}

#[test]
fn the_aloe_pair_matches_its_ground_truth() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("d.pfm");
    let pair = ["match", "--left", "samples/aloeL.jpg", "--right", "samples/aloeR.jpg", "--max-disparity", "256"];
    let report = json(&halcyon(&[&pair[..], &["--out", out.to_str().expect("text"), "--json"]].concat()));
    assert!(report["density"].as_f64().expect("a number") > 0.5, "{report:#}");
    let pfm = std::fs::read(out).expect("the disparity is written");
    let (width, height) = (report["width_px"].as_u64().expect("a number"), report["height_px"].as_u64().expect("a number"));
    assert!(pfm.starts_with(format!("Pf\n{width} {height}\n-1").as_bytes()));
    assert!(pfm.len() as u64 > 4 * width * height);
}

#[test]
fn a_rendered_survey_becomes_elevation_maps() {
    let folder = tempfile::tempdir().expect("a folder");
    let survey = folder.path().join("survey");
    let survey = survey.to_str().expect("text");
    let (grid, wass) = (folder.path().join("g.nc"), folder.path().join("w.nc"));
    let rendered = halcyon(&["sim", "render", survey, "--seconds", "0.6", "--rate-hz", "5", "--sea", "jonswap:0.05,1.3"]);
    assert_eq!(rendered.status.code(), Some(0), "{}", String::from_utf8_lossy(&rendered.stderr));
    std::fs::remove_file(PathBuf::from(survey).join("right/000001.png")).expect("a picture");
    let outputs = ["--grid", grid.to_str().expect("text"), "--wass", wass.to_str().expect("text")];
    let report = json(&halcyon(&[&["reconstruct", survey, "--json"][..], &outputs].concat()));
    assert_eq!((&report["pairs"], &report["patches"], &report["frame"]), (&3.into(), &2.into(), &"gravity".into()));
    assert_eq!(report["failed"][0]["name"], "000001");
    assert!(report["patch"]["coverage"].as_f64().expect("a number") > 0.9, "{report:#}");
    // NetCDF-4 files are HDF5 files.
    for path in [&grid, &wass] {
        assert!(std::fs::read(path).expect("a file").starts_with(b"\x89HDF\r\n"), "{}", path.display());
    }
}

#[test]
fn a_rig_says_what_it_can_measure() {
    let folder = tempfile::tempdir().expect("a folder");
    let plot = folder.path().join("rig.html");
    // The thesis's rig: 640 pixels at f = 509 px, 9.2 cm apart.
    let rig = ["rig", "--fov-deg", "64.3", "--width", "640", "--height", "480", "--baseline-m", "0.092", "--json"];
    let more = ["--wave-height", "0.05", "--altitudes", "0.5..5", "--plot", plot.to_str().expect("text")];
    let report = json(&halcyon(&[&rig[..], &more].concat()));
    assert!((report["rig"]["focal_px"].as_f64().expect("a number") - 509.0).abs() < 1.0, "{report:#}");
    assert!(report["best"][0]["altitude_m"].as_f64().expect("a number") > 0.5, "{report:#}");
    let page = std::fs::read_to_string(plot).expect("the page is written");
    assert!(page.starts_with("<!doctype html>") && page.matches("<svg").count() == 3);
}

#[test]
fn careless_use_is_refused_with_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let text: PathBuf = folder.path().join("text.jpg");
    std::fs::write(&text, "this is no picture").expect("a file");
    let text = text.to_str().expect("text");
    refused(&calibrate("nothing*.jpg", "nothing*.jpg", &BOARD), "nothing*.jpg");
    refused(&calibrate("samples/left0?.jpg", "samples/right??.jpg", &BOARD), "");
    refused(&calibrate("samples/left??.jpg", "samples/right??.jpg", &["--board", "9", "--square", "1"]), "board");
    refused(&calibrate("samples/left??.jpg", "samples/right??.jpg", &["--board", "9x6", "--square", "nan"]), "square");
    refused(&calibrate("samples/left??.jpg", "samples/right??.jpg", &["--board", "5x4", "--square", "1"]), "");
    refused(&calibrate(text, text, &BOARD), "text.jpg");
    let pair =
        ["match", "--left", "samples/aloeL.jpg", "--right", "samples/aloeR.jpg", "--out", "/dev/null/d.pfm", "--max-disparity"];
    for bad in ["0", "-1", "nan", "1e9"] {
        refused(&[&pair[..], &[bad]].concat(), "disparity");
    }
    refused(&["match", "--left", text, "--right", text, "--out", "x.pfm", "--max-disparity", "64"], "text.jpg");
    let pair = ["reconstruct", "--left", text, "--right", text, "--rig"];
    refused(&[&pair[..], &["no-such-rig.yaml"]].concat(), "no-such-rig.yaml");
    refused(&[&pair[..], &[text]].concat(), "text.jpg");
    refused(&[&pair[..], &[text, "--height-m", "nan"]].concat(), "--height-m");
    refused(&[&pair[..], &[text, "--roll-deg", "3"]].concat(), "--height-m");
    refused(&["reconstruct"], "--left");
    refused(&["reconstruct", "no-such-folder"], "no-such-folder");
    refused(&["reconstruct", "no-such-folder", "--left", text], "cannot be used with");
    refused(&["rig"], "--fov-deg");
    refused(&["rig", "--rig", text], "text.jpg");
    let plan = ["rig", "--fov-deg", "60", "--width", "640", "--height", "480", "--baseline-m"];
    refused(&[&plan[..], &["-1"]].concat(), "baseline");
    refused(&[&plan[..], &["0.1", "--altitudes", "-5..nan"]].concat(), "altitudes");
    refused(&[&plan[..], &["0.1", "--plot", "rig.pdf"]].concat(), ".svg or .html");
    refused(&[&plan[..], &["0.1", "--wave-height", "1000"]].concat(), "--wave-height must be 0.0001 to 40 m, not 1000 m");
    refused(&[&plan[..], &["0.1", "--wave-height", "2", "--wavelength", "10"]].concat(), "breaks");
    refused(
        &calibrate("samples/left??.jpg", "samples/right??.jpg", &["--board", "9x6", "--square", "25"]),
        "25 mm are 0.025 m",
    );
    refused(&calibrate("samples/left01.jpg", "samples/left02.jpg", &["samples/left03.jpg"]), "quotes");
    refused(
        &[&calibrate("samples/left??.jpg", "samples/right??.jpg", &BOARD)[..], &["--distance", "nan"]].concat(),
        "--distance",
    );
    refused(&["up", "--sea", "lumpy"], "sea");
    refused(&["up", "--sea", "jonswap:nan,1"], "height");
    refused(&["up", "--speed", "0"], "speed");
    refused(&["up", "--config", "no-such-file.toml"], "no-such-file.toml");
    refused(&["config", "--set", "capture.rate=1"], "did you mean rate_hz?");
    refused(&["config", "--set", "captur.rate_hz=1"], "did you mean capture?");
    refused(&["run", "captain"], "there is no service");
    refused(&["mission", "--url", "not a url", "list"], "url");
    refused(&["frobnicate"], "unrecognized");
}

/// Whatever stands under the name of an output, no input is lost, and what cannot be written is said before the work.
#[test]
fn outputs_that_would_cost_something_are_refused_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("text").to_owned();
    for (name, sample) in [("left.png", "aloeL.jpg"), ("right.png", "aloeR.jpg"), ("left.yaml", "left01.jpg")] {
        std::fs::copy(root().join("samples").join(sample), at(name)).expect("a copy");
    }
    std::os::unix::fs::symlink(at("left.png"), at("link.png")).expect("a link");
    let before = std::fs::read(at("left.png")).expect("a picture");
    let (left, right, link, yaml) = (at("left.png"), at("right.png"), at("link.png"), at("left.yaml"));
    let nowhere = at("nowhere/x.png");
    let pair = ["--left", &left, "--right", &right];
    let run = |command: &[&str], rest: &[&str], expected: &str| refused(&[command, &pair, rest].concat(), expected);
    for out in [&left, &link] {
        run(&["match", "--max-disparity", "64"], &["--out", out], "would overwrite an input, that of --left");
        run(&["features"], &["--out", out], "would overwrite an input, that of --left");
    }
    run(&["match", "--max-disparity", "64"], &["--out", &nowhere], "--out");
    run(&["features"], &["--out", &nowhere], "there is no folder");
    run(&["reconstruct", "--rig", &yaml], &["--disparity", &right], "would overwrite an input, that of --right");
    run(&["reconstruct", "--rig", &yaml], &["--grid", &at("x.nc"), "--wass", &at("x.nc")], "the same file");
    run(&["self-calibrate", "--rig", &yaml], &["--out", &yaml], "would overwrite an input, that of --rig");
    refused(&[&calibrate(&yaml, &right, &BOARD)[..], &["--out", &yaml]].concat(), "would overwrite an input, that of --left");
    refused(&[&calibrate(&left, &right, &BOARD)[..], &["--report", &at("r.pdf")]].concat(), ".html");
    refused(&["rig", "--rig", &at("left.yaml"), "--plot", &at("nowhere/x.svg")], "--plot");
    assert_eq!(std::fs::read(at("left.png")).expect("a picture"), before);
    assert!(std::fs::symlink_metadata(&link).expect("the link").is_symlink());
    assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 4, "nothing is left behind");
}

#[test]
fn a_blank_pair_has_no_texture_and_a_cloud_that_is_missing_is_a_failure() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("text").to_owned();
    std::fs::write(at("black.pgm"), [b"P5 640 480 255\n".as_slice(), &[0; 640 * 480]].concat()).expect("a picture");
    let (black, rig) = (at("black.pgm"), at("rig.yaml"));
    let pair = ["--left", &black, "--right", &black];
    let output = halcyon(&[&["match", "--max-disparity", "64", "--out", &at("d.pfm"), "--json"][..], &pair].concat());
    let report = json(&output);
    assert_eq!((&report["density"], &report["points"]), (&0.0.into(), &0.into()));
    assert!(String::from_utf8_lossy(&output.stderr).starts_with("warning: no texture in "));
    let board = [&BOARD[..], &["--out", &rig, "--json"]].concat();
    json(&halcyon(&calibrate("samples/left??.jpg", "samples/right??.jpg", &board)));
    let cloud = at("c.ply");
    let output = halcyon(&[&["features", "--rig", &rig, "--cloud", &cloud, "--json"][..], &pair].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("c.ply is not written"));
    assert!(!std::path::Path::new(&cloud).exists());
    refused(&[&["reconstruct", "--rig", &rig][..], &pair].concat(), "no texture in");
}

#[test]
fn every_command_explains_itself_with_an_example() {
    for command in [
        &["up"][..],
        &["run"],
        &["calibrate"],
        &["match"],
        &["reconstruct"],
        &["rig"],
        &["bench"],
        &["mission"],
        &["vehicle"],
        &["vehicle", "show"],
        &["vehicle", "command"],
        &["vehicle", "parameters"],
        &["vehicle", "mission"],
        &["vehicle", "fence"],
        &["vehicle", "rally"],
        &["vehicle", "release"],
        &["config"],
        &["sim", "render"],
        &["sim", "serve"],
    ] {
        let output = halcyon(&[command, &["--help"]].concat());
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("Example") && text.contains("halcyon"), "{command:?}: {text}");
    }
}

#[test]
fn features_and_self_calibration_work_on_the_samples() {
    for command in ["features", "self-calibrate"] {
        let output = halcyon(&[command, "--help"]);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("Example") && text.contains("halcyon"), "{command}: {text}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let (rig, png) = (folder.path().join("rig.yaml"), folder.path().join("m.png"));
    let (rig, png) = (rig.to_str().expect("text"), png.to_str().expect("text"));
    let board = [&BOARD[..], &["--out", rig, "--json"]].concat();
    json(&halcyon(&calibrate("samples/left??.jpg", "samples/right??.jpg", &board)));
    let pair = ["--left", "samples/left01.jpg", "--right", "samples/right01.jpg"];
    let report =
        json(&halcyon(&[&["features"][..], &pair, &["--method", "surf", "--rig", rig, "--out", png, "--json"]].concat()));
    let row = &report["rows"][0];
    assert!(row["left"].as_u64() > Some(300) && row["left_after"].as_u64() > Some(50), "{report:#}");
    assert!(row["pose"]["rotation_off_deg"].as_f64().expect("a number") < 2.0, "{report:#}");
    assert!(std::fs::read(png).expect("a picture").starts_with(b"\x89PNG"));
    let all = ["--left", "samples/left0?.jpg", "--right", "samples/right0?.jpg"];
    let report = json(&halcyon(&[&["self-calibrate", "--rig", rig, "--json"][..], &all].concat()));
    assert_eq!((&report["has_drifted"], report["views"].as_array().map(Vec::len)), (&false.into(), Some(9)));
    assert!(report["row_error_after_px"].as_f64().expect("a number") < 0.6, "{report:#}");

    let same = ["--left", "samples/left01.jpg", "--right", "samples/left01.jpg"];
    refused(&[&["self-calibrate", "--rig", rig][..], &same].concat(), "from one place");
    refused(&[&["self-calibrate", "--rig", rig][..], &pair, &["--baseline", "nan"]].concat(), "baseline");
    refused(&[&["self-calibrate", "--rig", "nowhere.yaml"][..], &pair].concat(), "nowhere.yaml");
    refused(&[&["features"][..], &pair, &["--method", "harris"]].concat(), "harris");
    refused(&[&["features"][..], &pair, &["--out", "m.jpg"]].concat(), ".png");
    refused(&["features", "--left", "samples/left01.jpg", "--right", rig], "rig.yaml");
}
