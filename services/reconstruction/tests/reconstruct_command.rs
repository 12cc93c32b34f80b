//! What `halcyon reconstruct` does, on water that is known exactly and in careless hands.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

mod support;

use std::path::{Path, PathBuf};

use halcyon_model::{Image, PoseAtExposure, StereoPair, rig_yaml};
use halcyon_reconstruction::cli::{
    MeshOf, ReconstructCliError, ReconstructOptions, SurveyFrame, SurveyStep, given_pose, reconstruct_pair, reconstruct_survey,
};
use halcyon_reconstruction::files::{FileError, OutputError, RigFileError};
use support::scene::{default_rig, pose, render};

fn options() -> ReconstructOptions {
    ReconstructOptions { engine: "sgbm".into(), command: "halcyon reconstruct".into(), ..ReconstructOptions::default() }
}

fn write_pgm(path: &Path, image: &Image) {
    let mut bytes = format!("P5 {} {} 255\n", image.width_px(), image.height_px()).into_bytes();
    bytes.extend_from_slice(image.pixels());
    std::fs::write(path, bytes).unwrap();
}

/// A pair and its rig in a folder.
struct Scene {
    folder: tempfile::TempDir,
    pose: PoseAtExposure,
}

impl Scene {
    fn new(attitude_deg: [f64; 3]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let pose = pose(0.0, 0.0, 5.0, attitude_deg);
        let pair = render(&default_rig(), &pose, &|north, _| 0.02 * (std::f64::consts::TAU * north / 2.6).sin(), 2.0, 1);
        std::fs::write(folder.path().join("rig.yaml"), rig_yaml::write(&default_rig())).unwrap();
        let scene = Self { folder, pose };
        scene.put("0", &pair);
        scene
    }

    fn put(&self, name: &str, pair: &StereoPair) {
        write_pgm(&self.path(&format!("l{name}.pgm")), &pair.left);
        write_pgm(&self.path(&format!("r{name}.pgm")), &pair.right);
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(
        &self,
        pose: Option<PoseAtExposure>,
        options: &ReconstructOptions,
    ) -> Result<halcyon_reconstruction::cli::ReconstructReport, ReconstructCliError> {
        reconstruct_pair(&self.path("l0.pgm"), &self.path("r0.pgm"), &self.path("rig.yaml"), pose, options)
    }
}

/// Vertices (x, y, z, then whatever comes) and the number of faces of a binary PLY of floats and bytes.
fn ply(path: &Path) -> (Vec<[f64; 3]>, usize) {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |what: &str| header.lines().find_map(|l| l.strip_prefix(what)).map_or(0, |n| n.trim().parse().unwrap());
    let (vertices, faces): (usize, usize) = (count("element vertex"), count("element face"));
    let size: usize = header
        .lines()
        .map(|line| if line.starts_with("property float") { 4 } else { usize::from(line.starts_with("property uchar")) })
        .sum();
    assert_eq!(bytes.len(), end + vertices * size + faces * 13);
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let vertex = |i: usize| [0, 4, 8].map(|offset| float(end + i * size + offset));
    ((0..vertices).map(vertex).collect(), faces)
}

#[test]
fn a_pair_becomes_patch_cloud_mesh_and_files() {
    // Turned and tilted: the cloud must come out level, and the wave must run north.
    let scene = Scene::new([3.0, -4.0, 120.0]);
    let options = ReconstructOptions {
        cloud: Some(scene.path("c.ply")),
        mesh: Some(scene.path("m.ply")),
        disparity: Some(scene.path("d.pfm")),
        grid: Some(scene.path("g.nc")),
        wass: Some(scene.path("w.nc")),
        ..options()
    };
    let report = scene.run(Some(scene.pose), &options).unwrap();
    assert_eq!((report.frame, report.engine, report.width_px, report.height_px), ("gravity", "sgbm", 320, 240));
    assert!((report.plane.distance_m - 5.0).abs() < 0.05 && report.patch.coverage > 0.97, "{report:?}");
    assert!(
        (report.patch.cell_m - 0.1).abs() < 1e-12 || (report.patch.cell_m - 0.2).abs() < 1e-12,
        "about ten pixels of 15 mm"
    );
    assert!((report.patch.elevation_rms_m - 0.02 / 2f64.sqrt()).abs() < 0.003, "{report:?}");
    assert!(report.patch.level_m_low < report.patch.level_m && report.patch.level_m < report.patch.level_m_high);
    let (points, _) = ply(&scene.path("c.ply"));
    assert_eq!(points.len(), report.points as usize);
    assert!(points.len() > 40_000, "every pixel that both cameras see: {}", points.len());
    let error = |[_, north, up]: &[f64; 3]| up - 0.02 * (std::f64::consts::TAU * north / 2.6).sin();
    let rms_m = (points.iter().map(|p| error(p).powi(2)).sum::<f64>() / points.len() as f64).sqrt();
    // 0.05 px at 5 m are 9 mm.
    assert!(rms_m < 0.012, "{rms_m}");
    let (vertices, faces) = ply(&scene.path("m.ply"));
    assert!(vertices.len() > points.len() * 9 / 10 && faces > vertices.len() * 3 / 2, "{} {faces}", vertices.len());
    let of_grid = ReconstructOptions { mesh_of: MeshOf::Grid, ..options.clone() };
    scene.run(Some(scene.pose), &of_grid).unwrap();
    let (vertices, _) = ply(&scene.path("m.ply"));
    assert!(vertices.len() < 5000 && vertices.iter().all(|[_, _, up]| up.abs() < 0.05));
    let pfm = std::fs::read(scene.path("d.pfm")).unwrap();
    assert!(pfm.starts_with(b"Pf\n320 240\n-1"));
    assert!(scene.path("g.nc").exists() && scene.path("w.nc").exists());
}

#[test]
fn without_a_pose_the_plane_is_level() {
    let scene = Scene::new([4.0, 2.0, 0.0]);
    let options = ReconstructOptions { cloud: Some(scene.path("c.ply")), stride_px: Some(3), ..options() };
    let report = scene.run(None, &options).unwrap();
    assert_eq!((report.frame, report.patch.level_m), ("plane", None));
    let (points, _) = ply(&scene.path("c.ply"));
    let mean = points.iter().map(|point| point[2]).sum::<f64>() / points.len() as f64;
    assert!(mean.abs() < 1e-3, "{mean}");
}

#[test]
fn a_survey_names_its_bad_pairs_and_goes_on() {
    let scene = Scene::new([0.0; 3]);
    let mut frames = Vec::new();
    for i in 0..4_u32 {
        let name = i.to_string();
        let pair = render(&default_rig(), &scene.pose, &|_, _| 0.0, 2.0, u64::from(i));
        scene.put(&name, &pair);
        frames.push(SurveyFrame {
            stamp: pair.stamp,
            left: scene.path(&format!("l{name}.pgm")),
            right: scene.path(&format!("r{name}.pgm")),
            pose: Some(scene.pose),
            name,
        });
    }
    std::fs::write(&frames[1].left, b"P5 320 240 255\ncut").unwrap();
    write_pgm(&frames[2].right, &Image::new(320, 240, vec![0; 320 * 240].into()).unwrap());
    let options = ReconstructOptions { grid: Some(scene.path("g.nc")), ..options() };
    let mut heard = Vec::new();
    let mut progress =
        |step: SurveyStep<'_>| heard.push((step.done, step.total, step.outcome.is_some_and(|outcome| outcome.is_err())));
    let report = reconstruct_survey(&default_rig(), &frames, &options, &mut progress).unwrap();
    assert_eq!((report.pairs, report.patches, report.frame), (4, 2, "gravity"));
    let names: Vec<_> = report.failed.iter().map(|failed| failed.name.as_str()).collect();
    assert_eq!(names, ["1", "2"]);
    assert!(report.failed[0].why.contains("l1.pgm is a damaged PBM, PGM or PPM"), "{:?}", report.failed);
    assert!(
        report.failed[1].why.starts_with("no texture in ") && report.failed[1].why.contains("r2.pgm"),
        "{:?}",
        report.failed
    );
    assert!((report.duration_s - 3.0).abs() < 1e-9 && (report.plane.distance_m - 5.0).abs() < 2e-3);
    assert_eq!(heard, [(0, 4, false), (1, 4, false), (2, 4, true), (3, 4, true), (4, 4, false)]);
    let file = netcdf::open(scene.path("g.nc")).unwrap();
    assert_eq!(file.dimension_len("time"), Some(2));
    drop(file);

    let none = reconstruct_survey(&default_rig(), &frames[1..3], &options, &mut |_| {}).unwrap_err();
    assert!(none.to_string().starts_with("none of 2 pairs became a patch; the first, 1"), "{none}");
    let cloud = ReconstructOptions { cloud: Some(scene.path("c.ply")), ..options.clone() };
    let refused = reconstruct_survey(&default_rig(), &frames, &cloud, &mut |_| {});
    assert!(matches!(refused, Err(ReconstructCliError::OnePair("--cloud"))));
}

#[test]
fn outputs_are_neither_inputs_nor_each_other() {
    let scene = Scene::new([0.0; 3]);
    let before = std::fs::read(scene.path("l0.pgm")).unwrap();
    std::fs::hard_link(scene.path("l0.pgm"), scene.path("left.ply")).unwrap();
    let check = |change: &dyn Fn(&mut ReconstructOptions), expected: &str| {
        let mut options = options();
        change(&mut options);
        let refused = scene.run(Some(scene.pose), &options).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    };
    check(&|o| o.cloud = Some(scene.path("left.ply")), "--cloud");
    check(&|o| (o.cloud, o.mesh) = (Some(scene.path("x.ply")), Some(scene.path("./x.ply"))), "--mesh and --cloud would write");
    check(&|o| (o.grid, o.wass) = (Some(scene.path("x.nc")), Some(scene.path("x.nc"))), "--wass and --grid would write");
    assert_eq!(std::fs::read(scene.path("l0.pgm")).unwrap(), before);
    assert!(!scene.path("x.ply").exists() && !scene.path("x.nc").exists());
}

/// Cells too small for the points are the grid's trouble: a cloud, and a mesh of it, need none.
#[test]
fn only_what_needs_a_grid_needs_a_grid() {
    let scene = Scene::new([0.0; 3]);
    let fine = |change: &dyn Fn(&mut ReconstructOptions)| {
        let mut options = ReconstructOptions { cell_m: Some(0.001), ..options() };
        change(&mut options);
        scene.run(Some(scene.pose), &options)
    };
    for change in [
        &(|o: &mut ReconstructOptions| o.grid = Some(scene.path("g.nc"))) as &dyn Fn(&mut ReconstructOptions),
        &|o| (o.mesh, o.mesh_of) = (Some(scene.path("m.ply")), MeshOf::Grid),
        &|_| {},
    ] {
        let refused = fine(change).unwrap_err();
        assert!(matches!(refused, ReconstructCliError::Cell { .. }) && refused.to_string().contains("--cell"), "{refused}");
    }
    assert!(!scene.path("g.nc").exists() && !scene.path("m.ply").exists());
    let report = fine(&|o| (o.cloud, o.mesh) = (Some(scene.path("c.ply")), Some(scene.path("m.ply")))).unwrap();
    assert!(report.warnings[0].contains("cells of 0.001 m") && report.patch.cell_m > 0.05, "{report:?}");
    let (points, _) = ply(&scene.path("c.ply"));
    assert_eq!(points.len(), report.points as usize);
    assert!(scene.path("m.ply").exists());
}

#[test]
fn poses_and_planes_that_cannot_be_are_refused() {
    let scene = Scene::new([0.0; 3]);
    let at = |roll_deg, height_m| given_pose([roll_deg, 0.0, 0.0], height_m, 0.3, 0.5).unwrap();
    let sky = scene.run(Some(at(95.0, 5.0)), &options()).unwrap_err().to_string();
    assert!(sky.contains("looks 95° off straight down"), "{sky}");
    // The pictures were taken level: a roll of 40° makes the water lean by as much.
    let steep = scene.run(Some(at(40.0, 5.0)), &options());
    assert!(matches!(&steep, Err(ReconstructCliError::Impossible(_) | ReconstructCliError::Reconstruct(_))), "{steep:?}");
    let leaning = scene.run(Some(at(15.0, 5.0)), &options()).unwrap();
    assert!(leaning.warnings.iter().any(|warning| warning.contains("leans 15°")), "{:?}", leaning.warnings);
    assert_eq!(scene.run(Some(scene.pose), &options()).unwrap().warnings, [""; 0]);
}

#[test]
fn careless_use_is_refused() {
    let scene = Scene::new([0.0; 3]);
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(scene.path(name), bytes).unwrap();
        scene.path(name)
    };
    let (left, right, rig) = (scene.path("l0.pgm"), scene.path("r0.pgm"), scene.path("rig.yaml"));
    let refuse = |left: &Path, right: &Path, rig: &Path, options: &ReconstructOptions| {
        let error = reconstruct_pair(left, right, rig, None, options).unwrap_err();
        let (mut text, mut source) = (error.to_string(), std::error::Error::source(&error));
        while let Some(cause) = source {
            text = format!("{text}: {cause}");
            source = cause.source();
        }
        assert!(!text.contains('\n'), "{text}");
        (error, text)
    };
    let check = |left: &Path, right: &Path, rig: &Path, expected: &str| {
        let (_, text) = refuse(left, right, rig, &options());
        assert!(text.contains(expected), "{text}");
    };
    let black = Image::new(320, 240, vec![0; 320 * 240].into()).unwrap();
    write_pgm(&scene.path("black.pgm"), &black);
    write_pgm(&scene.path("small.pgm"), &Image::new(160, 120, vec![9; 160 * 120].into()).unwrap());
    check(&scene.path("black.pgm"), &scene.path("black.pgm"), &rig, "no texture in ");
    check(&scene.path("small.pgm"), &right, &rig, "160x120 px does not belong to a calibration for 320x240");
    check(&scene.path("no.pgm"), &right, &rig, "no.pgm");
    check(&left, &write("text.png", b"no picture"), &rig, "text.png is not a picture");
    check(&left, &right, &scene.path("no.yaml"), "no.yaml");
    check(&left, &right, &write("bad.yaml", b"M1: 3\n"), "bad.yaml");
    check(&left, &right, &write("binary.yaml", &[0xff, 0xfe, 0x00]), "binary.yaml is no calibration");
    check(&left, &right, &left, "l0.pgm");
    let with = |change: &dyn Fn(&mut ReconstructOptions)| {
        let mut options = options();
        change(&mut options);
        refuse(&left, &right, &rig, &options).0
    };
    assert!(matches!(with(&|o| o.engine = "elas".into()), ReconstructCliError::Engine(_)));
    for cell_m in [0.0, -1.0, f64::NAN, 1e9] {
        assert!(matches!(with(&|o| o.cell_m = Some(cell_m)), ReconstructCliError::Value { name: "--cell", .. }));
    }
    assert!(matches!(with(&|o| o.stride_px = Some(0)), ReconstructCliError::Value { name: "--stride", .. }));
    for max_px in [0, 320, u32::MAX] {
        assert!(matches!(with(&|o| o.max_disparity_px = Some(max_px)), ReconstructCliError::Value { .. }));
    }
    let extension = |error| {
        let is_ending = matches!(error, ReconstructCliError::File(FileError::Output(OutputError::Ending { .. })));
        assert!(is_ending, "{error}");
    };
    extension(with(&|o| o.cloud = Some("c.obj".into())));
    extension(with(&|o| o.disparity = Some("d".into())));
    extension(with(&|o| o.grid = Some("g.csv".into())));
    let unwritable = with(&|o| o.grid = Some("/nowhere/g.nc".into()));
    assert!(matches!(unwritable, ReconstructCliError::File(FileError::Output(OutputError::NoFolder { .. }))), "{unwritable}");
    let unwritable = with(&|o| o.cloud = Some("/nowhere/c.ply".into()));
    assert!(matches!(unwritable, ReconstructCliError::File(FileError::Output(OutputError::NoFolder { .. }))), "{unwritable}");
    assert!(matches!(
        reconstruct_pair(&left, &right, &scene.path("bad.yaml"), None, &options()),
        Err(ReconstructCliError::Rig(RigFileError::Content { .. }))
    ));
    for (attitude_deg, height_m, name) in [
        ([f64::NAN, 0.0, 0.0], 5.0, "--roll-deg"),
        ([0.0, 91.0, 0.0], 5.0, "--pitch-deg"),
        ([0.0, 0.0, 1e9], 5.0, "--heading-deg"),
        ([0.0; 3], -5.0, "--height-m"),
    ] {
        let error = given_pose(attitude_deg, height_m, 0.1, 0.1).unwrap_err().to_string();
        assert!(error.starts_with(name), "{error}");
    }
}
