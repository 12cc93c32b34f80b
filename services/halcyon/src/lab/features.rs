//! Tables 4-2, 4-3, 5-1, 5-2 and what belongs to them: features of a textured object and of clear water, and what follows from
//! matches alone.

use halcyon_model::Image;
use halcyon_reconstruction::cli::{FeaturesOptions, features};
use halcyon_reconstruction::core::epipolar::RansacSettings;
use halcyon_reconstruction::core::features::{FeatureCounts, MatchRule, Method, StudySettings, encode_png, study};
use halcyon_reconstruction::core::show;
use halcyon_reconstruction::files::write_rig;

use super::context::{Lab, LabError};
use super::dense::{draw, tank_pair};
use super::exhibit::{Exhibit, File, number};
use super::pictures::halved;
use crate::report::Bars;

/// The thesis's counts: left and right before RANSAC, and what stayed.
struct Thesis {
    method: Method,
    counts: [f64; 3],
}

const OBJECT: [Thesis; 3] = [
    Thesis { method: Method::Sift, counts: [243.0, 211.0, 56.0] },
    Thesis { method: Method::Surf, counts: [386.0, 396.0, 54.0] },
    Thesis { method: Method::Orb, counts: [300.0, 257.0, 40.0] },
];
const WATER: [Thesis; 3] = [
    Thesis { method: Method::Sift, counts: [100.0, 100.0, 9.0] },
    Thesis { method: Method::Surf, counts: [282.0, 243.0, 9.0] },
    Thesis { method: Method::Orb, counts: [131.0, 210.0, 10.0] },
];

/// What is left of a film's contrast in water so clear that detectors see little.
const CLEAR: f64 = 0.25;
/// More than any picture here has.
const KEYPOINTS_MAX: usize = 20_000;

pub(super) fn object(lab: &Lab) -> Result<Exhibit, LabError> {
    // About as large as the thesis's pictures.
    let object = halved(&lab.object()?)?;
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "The thesis's object is a bone on a dark table, 640 x 480; here it is the public aloe pair at half its size. As in the thesis every \
         nearest neighbour is a match and RANSAC alone takes out the wrong ones.",
    );
    counts(&mut exhibit, "aloe", &object.left, &object.right, &OBJECT)?;
    Ok(exhibit)
}

pub(super) fn water(lab: &Lab) -> Result<Exhibit, LabError> {
    let pair = tank_pair(lab, CLEAR)?;
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "Clear water shows next to nothing: simulated, with a quarter of the contrast of a patterned film, and the camera's noise. What \
         detectors see here is the water itself; much of what they saw in the thesis's tank were reflections, which no second camera sees in the \
         same place. The film itself follows: the thesis found too that water must be given something to see.",
    );
    exhibit.png(draw(show::grey_png(&super::pictures::side_by_side(&pair.left, &pair.right)?))?, "Figure 5-2: the pair");
    counts(&mut exhibit, "clear water", &pair.left, &pair.right, &WATER)?;
    let film = tank_pair(lab, 1.0)?;
    counts(&mut exhibit, "film", &film.left, &film.right, &[])?;
    Ok(exhibit)
}

fn counts(exhibit: &mut Exhibit, of: &str, left: &Image, right: &Image, thesis: &[Thesis]) -> Result<(), LabError> {
    let settings = StudySettings {
        rule: MatchRule { ratio_max: None, is_mutual: false },
        // The thesis reports agreements of 9: eight points fit any fundamental matrix, so a few more say little, and are counted all the same.
        ransac: RansacSettings { threshold_px: 1.0, inliers_min: 8, ..RansacSettings::default() },
        // None is cut off: counts are the experiment.
        keypoints_max: KEYPOINTS_MAX,
    };
    let (mut all, mut pictures): (Vec<FeatureCounts>, _) = (Vec::new(), Vec::new());
    for method in Method::ALL {
        let found = study(left, right, method, &settings, &|pairs| pairs.to_vec())?;
        let name = method.name().to_uppercase();
        pictures.push((draw(show::keypoints_png(left, &found.left))?, format!("{name}, {of}: keypoints of the left picture")));
        pictures.push((draw(encode_png(left, right, &found))?, format!("{name}, {of}: matches before and after RANSAC")));
        let counts = found.counts();
        let theirs = thesis.iter().find(|thesis| thesis.method == method).map(|thesis| thesis.counts);
        let figures = ["keypoints left", "keypoints right", "kept by RANSAC"].into_iter().zip([
            counts.left,
            counts.right,
            counts.inliers,
        ]);
        for (k, (figure, count)) in figures.enumerate() {
            exhibit.find(format!("{name}, {of}, {figure}"), "1", count as f64, theirs.map(|theirs| theirs[k]));
        }
        all.push(counts);
    }
    let names = || all.iter().map(|counts| counts.method.name().to_uppercase()).collect();
    let bars = |of: &dyn Fn(&FeatureCounts) -> usize| all.iter().map(|counts| of(counts) as f64).collect();
    let before = Bars::new("keypoints", names()).with("left", bars(&|c| c.left)).with("right", bars(&|c| c.right));
    exhibit.chart(before.svg(), format!("Keypoints of {of} before RANSAC"))?;
    let after = Bars::new("keypoints", names()).with("kept by RANSAC", bars(&|c| c.inliers));
    exhibit.chart(after.svg(), format!("Keypoints of {of} after RANSAC, the same in both pictures"))?;
    for (png, caption) in pictures {
        exhibit.png(png, caption);
    }
    Ok(())
}

pub(super) fn epipolar(lab: &Lab) -> Result<Exhibit, LabError> {
    let [left, right] = lab.board_pair()?;
    let (_, calibration) = lab.calibration()?;
    let work = tempfile::tempdir()?;
    let (rig, cloud) = (work.path().join("rig.yaml"), work.path().join("sparse.ply"));
    write_rig(&rig, &calibration.rig)?;
    let report = features(&FeaturesOptions {
        left: &left,
        right: &right,
        method: "sift",
        rig: Some(&rig),
        ransac_px: 1.0,
        keypoints_max: 2000,
        ratio_max: 0.8,
        is_mutual: true,
        out: None,
        cloud: Some(&cloud),
    })?;
    let mut exhibit = Exhibit::default();
    exhibit.text("From SIFT matches of one pair alone, judged by the calibration with the board, which knows where the cameras really stand.");
    for row in &report.rows {
        if let Some(fundamental) = &row.fundamental {
            exhibit.table(vec!["F (4-24)", "", ""], matrix(fundamental));
        }
        if let Some(pose) = &row.pose {
            exhibit.table(vec!["E (4-26)", "", ""], matrix(&pose.essential));
            exhibit.table(vec!["R", "", ""], matrix(&pose.rotation));
            exhibit.table(vec!["t, length 1", "", ""], matrix(&[pose.direction]));
            exhibit.table(vec!["M left (4-28)", "", "", ""], matrix(&pose.left_projection));
            exhibit.table(vec!["M right (4-30)", "", "", ""], matrix(&pose.right_projection));
            exhibit.find("rotation against the calibration", "degrees", pose.rotation_off_deg, None);
            exhibit.find("direction of the baseline against the calibration", "degrees", pose.direction_off_deg, None);
            exhibit.find("points of the sparse cloud (figure 4-20)", "1", pose.points as f64, Some(56.0));
        }
    }
    if cloud.is_file() {
        exhibit.files.push(File { name: "sparse-cloud.ply".into(), bytes: std::fs::read(&cloud)? });
    }
    // (4-27) as printed: an essential matrix has two equal singular values and none other.
    let theirs =
        nalgebra::Matrix3::new(-2.3892e-3, 0.66190, 0.28926, -0.67114, 4.6856e-2, 9.0805, -0.26476, -9.0821, 4.8590e-2);
    let values = theirs.singular_values();
    exhibit.text(format!(
        "The thesis's E (4-27) has singular values {}, {} and {}: nearly two equal ones and nearly nothing, as it should be.",
        number(values[0]),
        number(values[1]),
        number(values[2])
    ));
    Ok(exhibit)
}

fn matrix<const N: usize>(rows: &[[f64; N]]) -> Vec<Vec<String>> {
    rows.iter().map(|row| row.iter().map(|value| number(*value)).collect()).collect()
}
