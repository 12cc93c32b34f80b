//! Every experiment of the lab that is not timed and not already in `accuracy.rs`, at its quick extent: it runs, it finds something, and
//! what it finds is what the method is known for.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use std::path::Path;

use halcyon::accuracy::Extent;
use halcyon::lab::{Exhibit, Experiment, Lab, LabError, Part, page, read_parts, select, write};

fn lab() -> Lab {
    Lab::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples"), Extent::Quick)
}

fn run(name: &str) -> (&'static Experiment, Exhibit) {
    let experiment = select(&[name.to_owned()]).unwrap()[0];
    (experiment, experiment.run(&lab()).unwrap())
}

#[track_caller]
fn found(exhibit: &Exhibit, figure: &str) -> f64 {
    let all: Vec<_> = exhibit.findings.iter().map(|finding| finding.figure.as_str()).collect();
    exhibit.findings.iter().find(|finding| finding.figure == figure).unwrap_or_else(|| panic!("{figure} in {all:?}")).value
}

/// Thesis: 0.465 px with forty views.
#[test]
fn calibration_and_rectification() {
    let (_, calibration) = run("table 3-1");
    assert!(found(&calibration, "mean reprojection error (3-20)") < 0.465);
    let (_, rectification) = run("rectification");
    assert!(found(&rectification, "row error after rectification, largest") < 1.0);
}

/// Hirschmüller and Scharstein (2009) rank census and rank before sums of differences; Hirschmüller (2008): paths beat windows.
#[test]
fn costs_rank_as_published() {
    let (_, costs) = run("costs");
    let bad = |name: &str| found(&costs, &format!("off by more than 1 px, {name}"));
    assert!(bad("census") < bad("sad") && bad("rank") < bad("sad") && bad("sad") < bad("ssd"));
    let (_, left_right) = run("left-right");
    assert!(
        found(&left_right, "off by more than 1 px, with the check")
            < found(&left_right, "off by more than 1 px, without the check")
    );
    assert!(found(&left_right, "matched, with the check") < found(&left_right, "matched, without the check"));
    let (_, paths) = run("paths");
    assert!(found(&paths, "off by more than 1 px, 8 paths") < bad("census"));
    run("windows");
}

/// The thesis's findings: RANSAC keeps some; dense methods find hundreds of times more points; the rotation is that of the board.
#[test]
fn sparse_and_dense() {
    let (_, keypoints) = run("keypoints");
    for method in ["SIFT", "SURF", "ORB", "AKAZE"] {
        let kept = found(&keypoints, &format!("{method}, aloe, kept by RANSAC"));
        assert!(kept > 50.0 && kept < found(&keypoints, &format!("{method}, aloe, keypoints left")), "{method}");
    }
    let (_, epipolar) = run("figure 4-20");
    assert!(found(&epipolar, "rotation against the calibration") < 0.5);
    let (_, dense) = run("dense");
    let sparse = found(&epipolar, "points of the sparse cloud (figure 4-20)");
    assert!(found(&dense, "points by sgbm (figure 4-24)") > 100.0 * sparse);
}

/// "The disparity map obtained was poor with many holes" (5.2.1); with a film it was dense.
#[test]
fn clear_water_shows_nothing_and_a_film_does() {
    let (_, water) = run("water-keypoints");
    let of = |what: &str| found(&water, &format!("SIFT, {what}"));
    assert!(of("clear water, keypoints left") > 10.0 && of("clear water, keypoints left") < 0.1 * of("film, keypoints left"));
    assert!(of("clear water, kept by RANSAC") < 0.1 * of("film, kept by RANSAC") && of("film, kept by RANSAC") > 200.0);
    let (_, film) = run("film");
    assert!(found(&film, "surface covered by the default chain, clear water") < 10.0, "what is not seen is not measured");
    assert!(found(&film, "surface covered by the default chain, film") > 90.0);
}

#[test]
fn a_report_stands_alone() {
    let folder = tempfile::tempdir().unwrap();
    for (experiment, exhibit) in [run("rectification"), run("film")] {
        write(folder.path(), &Part::new(experiment, &exhibit, "quick run"), &exhibit).unwrap();
    }
    let html = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
    assert!(html == page(&read_parts(folder.path())) && html.contains("<svg") && html.contains("data:image/jpeg;base64,"));
    assert!(
        !html.contains("http://") || html.matches("http://").count() == html.matches("http://www.w3.org").count(),
        "nothing is loaded"
    );
    let cloud = std::fs::read(folder.path().join("film.ply")).unwrap();
    assert!(cloud.starts_with(b"ply\n"));
}

#[test]
fn without_sample_pictures_it_says_how_to_get_them() {
    let nowhere = Lab::new("/nowhere".into(), Extent::Quick);
    for name in ["calibration", "costs", "keypoints", "epipolar", "dense"] {
        let outcome = select(&[name.to_owned()]).unwrap()[0].run(&nowhere);
        assert!(matches!(&outcome, Err(error @ LabError::Samples(_)) if error.to_string().contains("make samples")), "{name}");
    }
}
