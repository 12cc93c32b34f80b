//! Survey folders: written from simulated water and read back; every defect named.

use std::fs;
use std::path::Path;

use halcyon_capture::{RenderOptions, SurveyFolder, write_survey_folder};
use halcyon_model::Stamp;
use halcyon_sim::SimConfig;
use halcyon_sim::water::Water;
use nalgebra::Vector3;

fn small() -> SimConfig {
    let mut sim = SimConfig { seed: 7, ..SimConfig::default() };
    (sim.rig.width_px, sim.rig.height_px) = (64, 48);
    sim
}

#[allow(clippy::unwrap_used, reason = "a helper of tests")]
fn render(folder: &Path, frames: usize) {
    let options =
        RenderOptions { frames, rate_hz: 4.0, sway_deg: 3.0, sway_m: 0.2, heading_deg: 40.0, ..RenderOptions::default() };
    let mut seen = Vec::new();
    write_survey_folder(folder, &small(), &options, |done, total| seen.push((done, total))).unwrap();
    assert_eq!(seen.last(), Some(&(frames, frames)));
}

#[test]
fn what_is_rendered_is_read_back_and_true() {
    let folder = tempfile::tempdir().unwrap();
    render(folder.path(), 6);
    let survey = SurveyFolder::open(folder.path()).unwrap();
    assert_eq!(*survey.rig(), small().rig.calibration());
    assert_eq!(survey.frames().len(), 6);
    let water = Water::new(&small().sea, 7).unwrap();
    let truth = fs::read_to_string(folder.path().join("truth.csv")).unwrap();
    for (index, (frame, row)) in survey.frames().iter().zip(truth.lines().skip(1)).enumerate() {
        let (left, right) = survey.read(frame).unwrap();
        assert_eq!((left.width_px(), left.height_px()), (64, 48));
        assert_ne!(left, right);
        assert_eq!(frame.stamp().seconds_since(survey.frames()[0].stamp()), 0.25 * index as f64);
        // The truth once more, from the pose that the table tells: where the middle of the left picture looks.
        let pose = frame.pose(0.1, 0.01).unwrap();
        let rig = survey.rig();
        let camera_m = pose.position_ned_m + pose.ned_from_body * rig.camera_in_body_m;
        let axis = pose.ned_from_body * (rig.body_from_camera * Vector3::z());
        let range_m = -camera_m.z / axis.z;
        let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        assert!((fields[2] - (camera_m.x + axis.x * range_m)).abs() < 1e-5);
        assert!((fields[3] - (camera_m.y + axis.y * range_m)).abs() < 1e-5);
        assert!((fields[4] - water.elevation_m(fields[2], fields[3], frame.stamp())).abs() < 2e-6);
    }
    let json = fs::read_to_string(folder.path().join("truth.json")).unwrap();
    let h_s_m: f64 = json.trim_start_matches("{\"h_s_m\": ").split(',').next().unwrap().parse().unwrap();
    assert!((h_s_m - 0.05).abs() < 1e-12 && json.ends_with("\"seed\": 7}\n"), "{json}");
    let again = write_survey_folder(folder.path(), &small(), &RenderOptions::default(), |_, _| {}).unwrap_err();
    assert!(again.to_string().ends_with("is not empty; give a folder that is, or that does not exist"), "{again}");
}

#[test]
fn options_out_of_range_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let check = |options: RenderOptions, expected: &str| {
        let error = write_survey_folder(folder.path(), &small(), &options, |_, _| {}).unwrap_err();
        assert_eq!(error.to_string(), expected);
    };
    check(RenderOptions { rate_hz: f64::NAN, ..RenderOptions::default() }, "rate_hz must be from 0.1 to 200, not NaN");
    check(RenderOptions { frames: 0, ..RenderOptions::default() }, "frames must be from 1 to 100000, not 0");
    check(
        RenderOptions { start: Stamp::from_nanos(-1), ..RenderOptions::default() },
        "start must be from 1970 to 2255, not -0.000000001",
    );
}

/// Breaks a good folder one way and returns the one line that says so, without the folder's own path.
#[track_caller]
#[allow(clippy::unwrap_used, clippy::expect_used, reason = "a helper of tests")]
fn broken(how: impl FnOnce(&Path)) -> String {
    let folder = tempfile::tempdir().unwrap();
    render(folder.path(), 3);
    how(folder.path());
    let outcome = SurveyFolder::open(folder.path())
        .and_then(|survey| survey.frames().iter().try_for_each(|frame| survey.read(frame).map(|_| ())));
    let error = outcome.expect_err("a broken folder");
    let text = match std::error::Error::source(&error) {
        Some(source) => format!("{error}: {source}"),
        None => error.to_string(),
    };
    assert!(!text.contains('\n'), "{text}");
    text.replace(&format!("{}/", folder.path().display()), "")
}

#[test]
fn every_defect_is_named_with_its_file_and_line() {
    let edit = |folder: &Path, file: &str, from: &str, to: &str| {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        assert!(text.contains(from), "{file} has no {from}");
        fs::write(folder.join(file), text.replacen(from, to, 1)).unwrap();
    };
    assert_eq!(broken(|f| fs::remove_file(f.join("rig.yaml")).unwrap()), "rig.yaml: No such file or directory (os error 2)");
    assert_eq!(
        broken(|f| edit(f, "rig.yaml", "D2:", "D3:")),
        "rig.yaml: D2 is missing, and so are distCoeffs2, dist_coeffs_2, dist_coeffs2, distortion2, D_right"
    );
    assert_eq!(
        broken(|f| edit(f, "frames.csv", "000001,", "000001,x")),
        "frames.csv: line 3: stamp_s is \"x1750000000.250000000\", expected seconds since 1970, 0 to 9e9"
    );
    assert_eq!(
        broken(|f| edit(f, "frames.csv", ",40.000000,", ",NaN,")),
        "frames.csv: line 2: heading_deg is \"NaN\", expected -360 to 360"
    );
    assert_eq!(
        broken(|f| fs::write(f.join("frames.csv"), b"name,stamp_s\na,1\n\xff,2\n").unwrap()),
        "frames.csv: line 3: not UTF-8 text"
    );
    let missing = "right: no picture of frame \"000001\" here (looked for .png, .jpg, .jpeg, .bmp)";
    assert_eq!(broken(|f| fs::remove_file(f.join("right/000001.png")).unwrap()), missing);
    assert_eq!(
        broken(|f| fs::write(f.join("left/000002.png"), "no picture").unwrap()),
        "left/000002.png: not a picture that OpenCV can read"
    );
    assert_eq!(broken(|f| fs::write(f.join("left/000002.png"), "").unwrap()), "left/000002.png: the file is empty");
    let other_size = |f: &Path| edit(f, "rig.yaml", "[ 64, 48 ]", "[ 64, 50 ]");
    assert_eq!(broken(other_size), "left/000000.png: 64 x 48 px, but the rig takes 64 x 50 px");
}

#[test]
fn tolerance_leaves_a_missing_picture_to_its_reader() {
    let folder = tempfile::tempdir().unwrap();
    render(folder.path(), 3);
    fs::remove_file(folder.path().join("right/000001.png")).unwrap();
    assert!(SurveyFolder::open(folder.path()).is_err());
    let survey = SurveyFolder::open_tolerant(folder.path()).unwrap();
    let whole: Vec<bool> = survey.frames().iter().map(|frame| survey.read(frame).is_ok()).collect();
    assert_eq!(whole, [true, false, true]);
    assert_eq!(survey.frames()[1].right(), folder.path().join("right/000001.png"));
    assert_eq!(survey.frames()[1].left(), folder.path().join("left/000001.png"));
    fs::remove_file(folder.path().join("frames.csv")).unwrap();
    assert!(SurveyFolder::open_tolerant(folder.path()).is_err(), "without its table it is no survey");
}
