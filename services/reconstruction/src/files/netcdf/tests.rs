//! Read back with the library that everybody's readers are made of.

use halcyon_model::{CameraIntrinsics, ElevationGrid, Plane, RigId, Stamp};
use nalgebra::{Matrix3, Vector3};

use super::*;

fn about() -> About {
    let camera =
        CameraIntrinsics { fx_px: 343.1, fy_px: 343.1, cx_px: 159.5, cy_px: 119.5, distortion: [0.1, 0.0, 0.0, 0.0, 0.0] };
    let calibration = RigCalibration {
        width_px: 320,
        height_px: 240,
        left: camera,
        right: camera,
        right_from_left: Matrix3::identity(),
        right_from_left_m: Vector3::new(-0.4, 0.0, 0.0),
        body_from_camera: RigCalibration::LOOKING_DOWN,
        camera_in_body_m: Vector3::zeros(),
    };
    About { calibration, source: "a test".into(), history: "2026-01-01T00:00:00Z test".into() }
}

/// A patch whose south-western cell has lattice row `row` and column `col`; elevations tell their own place: north + 10 east.
fn patch(stamp_ns: i64, row: i32, col: i32, rows: u32, cols: u32) -> SurfacePatch {
    let cell_m = 0.25;
    let centre = |index: i32| (f64::from(index) + 0.5) * cell_m;
    let mut elevation_m = Vec::new();
    for r in 0..rows as i32 {
        for c in 0..cols as i32 {
            elevation_m.push((centre(row + r) + 10.0 * centre(col + c)) as f32);
        }
    }
    elevation_m[0] = f32::NAN;
    let sigma_m = elevation_m.iter().map(|elevation| elevation * 0.0 + 0.003).collect();
    SurfacePatch {
        stamp: Stamp::from_nanos(stamp_ns),
        rig: RigId::new("rig").unwrap(),
        sequence: 0,
        grid: ElevationGrid {
            south_west_north_m: centre(row),
            south_west_east_m: centre(col),
            cell_m,
            rows,
            cols,
            elevation_m,
            sigma_m,
        },
        coverage: 0.9,
        plane: Plane { normal: Vector3::new(0.0, 0.6, 0.8), distance_m: 5.0, rms_m: 0.01 },
        points: 1234,
        level_m: Some(0.125),
        level_sigma_m: Some(0.02),
        level_thesis_m: Some(0.25),
        error_length_m: 0.16,
        slope_removed: [0.5, -0.25],
        slope_sigma: 0.125,
        attitude_sigma_rad: 0.01,
        processing_s: 0.0,
    }
}

const START_NS: i64 = 1_750_000_000_250_000_000;

/// Three patches that drift, also to the south and west, which no appending could have told beforehand.
fn drifting(folder: &Path) -> Series {
    drifting_in(folder, CloudFrame::Gravity)
}

fn drifting_in(folder: &Path, frame: CloudFrame) -> Series {
    let mut series = Series::beside(&folder.join("out.nc"), frame).unwrap();
    for (i, (row, col)) in [(0, 0), (-3, 1), (2, -2)].into_iter().enumerate() {
        series.push(&patch(START_NS + i as i64 * 500_000_001, row, col, 4, 3)).unwrap();
    }
    assert_eq!(series.len(), 3);
    series
}

fn text(variable: &::netcdf::Variable<'_>, name: &str) -> String {
    match variable.attribute_value(name).unwrap().unwrap() {
        ::netcdf::AttributeValue::Str(text) => text,
        other => panic!("{other:?}"),
    }
}

#[test]
fn drifting_patches_share_one_grid() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.nc");
    drifting(folder.path()).write_cf(&path, &about()).unwrap();
    let file = ::netcdf::open(&path).unwrap();
    let values = |name: &str| file.variable(name).unwrap().get_values::<f64, _>(..).unwrap();
    let (north, east, elevation) = (values("north"), values("east"), values("elevation"));
    // Rows −3 … 5, columns −2 … 3.
    assert_eq!((north.len(), east.len()), (9, 6));
    assert_eq!((north[0], east[0]), (-2.5 * 0.25, -1.5 * 0.25));
    let mut seen = [0; 3];
    for (i, value) in elevation.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let (time, row, col) = (i / 54, i / 6 % 9, i % 6);
        assert!((value - (north[row] + 10.0 * east[col])).abs() < 1e-5, "every value is in its own place");
        seen[time] += 1;
    }
    assert_eq!(seen, [11, 11, 11], "and none is lost");
    let sigma = values("elevation_sigma");
    assert!(sigma.iter().zip(&elevation).all(|(sigma, value)| sigma.is_finite() == value.is_finite()));
    let time = values("time");
    assert_eq!(text(&file.variable("time").unwrap(), "units"), "seconds since 2025-06-15 15:06:40");
    for (i, time_s) in time.iter().enumerate() {
        assert!((time_s - (0.25 + 0.500_000_001 * i as f64)).abs() < 1e-12, "to the nanosecond: {time_s}");
    }
    assert!(file.dimension("time").unwrap().is_unlimited());
    assert_eq!(
        (values("level"), values("points"), values("plane_normal")[3..6].to_vec()),
        (vec![0.125; 3], vec![1234.0; 3], vec![0.0, 0.6, 0.8])
    );
    let variable = file.variable("elevation").unwrap();
    assert_eq!(values("level_thesis"), [0.25; 3]);
    let slope = ["slope_removed_north", "slope_removed_east", "slope_sigma"].map(|name| values(name)[2]);
    assert_eq!(slope, [0.5, -0.25, 0.125], "what was taken out can be put back");
    assert_eq!(text(&variable, "units"), "m");
    assert_eq!(text(&variable, "ancillary_variables"), "elevation_sigma");
    assert!(variable.fill_value::<f32>().unwrap().unwrap().is_nan());
    let rig = match file.attribute("rig_calibration").unwrap().value().unwrap() {
        ::netcdf::AttributeValue::Str(text) => halcyon_model::rig_yaml::parse(&text).unwrap(),
        other => panic!("{other:?}"),
    };
    assert_eq!(rig, about().calibration, "a file can always be traced to its rig");
}

#[test]
fn wass_has_its_names_and_millimetres() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wass.nc");
    drifting(folder.path()).write_wass(&path, &about()).unwrap();
    let file = ::netcdf::open(&path).unwrap();
    let dimensions = |name: &str| -> Vec<String> {
        file.variable(name).unwrap().dimensions().iter().map(::netcdf::Dimension::name).collect()
    };
    assert_eq!(
        (dimensions("Z"), dimensions("X_grid")),
        (vec!["count".into(), "X".into(), "Y".into()], vec!["X".to_owned(), "Y".into()])
    );
    let values = |name: &str| file.variable(name).unwrap().get_values::<f64, _>(..).unwrap();
    let (x_mm, y_mm, z_mm) = (values("X_grid"), values("Y_grid"), values("Z"));
    for (i, z_mm) in z_mm.iter().enumerate().filter(|(_, z_mm)| z_mm.is_finite()) {
        assert!((z_mm - (y_mm[i % 54] + 10.0 * x_mm[i % 54])).abs() < 1e-2);
    }
    assert_eq!(values("scale"), [0.4]);
    assert!((values("time")[2] - 1.000_000_002).abs() < 1e-12);
    assert_eq!(values("maskZ").iter().sum::<f64>(), 29.0, "the union of three times eleven cells");
    // A rig that stands still has a level that is water's, not an autopilot's; its datum is whatever the first pair saw, here a crest.
    let fixed = folder.path().join("fixed.nc");
    let mut series = Series::beside(&folder.path().join("fixed-out.nc"), CloudFrame::Plane).unwrap();
    for (i, level_m) in [0.0, -0.02, -0.04].into_iter().enumerate() {
        series.push(&SurfacePatch { level_m: Some(level_m), ..patch(START_NS + i as i64 * 500_000_001, 0, 0, 4, 3) }).unwrap();
    }
    series.write_wass(&fixed, &about()).unwrap();
    let fixed = ::netcdf::open(&fixed).unwrap();
    let z_mm = fixed.variable("Z").unwrap().get_values::<f64, _>(..).unwrap();
    let (crest, trough) = (&z_mm[..12], &z_mm[24..]);
    let known = crest.iter().zip(trough).filter(|(crest_mm, trough_mm)| crest_mm.is_finite() && trough_mm.is_finite());
    let steps: Vec<f64> = known.map(|(crest_mm, trough_mm)| crest_mm - trough_mm).collect();
    assert!(!steps.is_empty() && steps.iter().all(|step_mm| (step_mm - 40.0).abs() < 1e-2));
    let all: Vec<f64> = z_mm.iter().copied().filter(|z_mm| z_mm.is_finite()).collect();
    let plain = patch(0, 0, 0, 4, 3);
    let first: Vec<f64> = plain.grid.elevation_m.iter().filter(|z| z.is_finite()).map(|z| 1e3 * f64::from(*z)).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    assert!((mean(&all) - mean(&first)).abs() < 1e-2, "levels are above their mean");
    let zmean: f64 = match fixed.group("meta").unwrap().unwrap().attribute("zmean").unwrap().value().unwrap() {
        ::netcdf::AttributeValue::Double(zmean) => zmean,
        other => panic!("{other:?}"),
    };
    assert!((1e3 * zmean - mean(&all)).abs() < 1e-2);
    let meta = file.group("meta").unwrap().unwrap();
    assert_eq!(meta.variable("intr0").unwrap().get_values::<f64, _>(..).unwrap()[..3], [343.1, 0.0, 159.5]);
}

#[test]
fn what_cannot_be_written_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.nc");
    assert!(matches!(Series::beside(&path, CloudFrame::Gravity).unwrap().write_cf(&path, &about()), Err(SeriesError::Empty)));
    assert!(matches!(Series::beside(Path::new("/nowhere/out.nc"), CloudFrame::Plane), Err(FileError::Write { .. })));
    let mut series = drifting(folder.path());
    assert!(matches!(series.push(&patch(0, 4_000_000, 0, 4, 3)), Err(SeriesError::TooLarge { .. })));
    assert!(matches!(series.push(&patch(0, i32::MAX - 9, i32::MIN, 4, 3)), Err(SeriesError::TooLarge { .. })));
    let mut other = patch(0, 0, 0, 4, 3);
    other.grid.cell_m = 0.3;
    assert!(matches!(series.push(&other), Err(SeriesError::Mixed(_))));
    other.grid.cell_m = f64::NAN;
    assert!(matches!(series.push(&other), Err(SeriesError::Mixed(_))));
    let directory = folder.path().join("directory.nc");
    std::fs::create_dir(&directory).unwrap();
    assert!(matches!(series.write_cf(&directory, &about()), Err(SeriesError::File(FileError::Write { .. }))));
    series.write_cf(&path, &about()).unwrap();
    assert_eq!(series.len(), 3, "what was refused is not in it");
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names.len(), 2, "no leftovers: {names:?}");
}

/// Other tools may append: the time dimension has no end.
#[test]
fn more_times_can_be_appended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.nc");
    drifting(folder.path()).write_cf(&path, &about()).unwrap();
    let mut file = ::netcdf::append(&path).unwrap();
    file.variable_mut("time").unwrap().put_value(9.0, [3]).unwrap();
    file.close().unwrap();
    let file = ::netcdf::open(&path).unwrap();
    assert_eq!(file.dimension_len("time"), Some(4));
    let last = file.variable("elevation").unwrap().get_values::<f32, _>(([3, 0, 0], [1, 9, 6])).unwrap();
    assert!(last.iter().all(|value| value.is_nan()));
}

#[test]
fn axes_without_north_and_times_without_a_date_claim_neither() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.nc");
    let written = |stamps_ns: &[i64]| {
        let mut series = Series::beside(&path, CloudFrame::Plane).unwrap();
        for stamp_ns in stamps_ns {
            series.push(&patch(*stamp_ns, 0, 0, 4, 3)).unwrap();
        }
        series.write_cf(&path, &about()).unwrap();
        ::netcdf::open(&path).unwrap()
    };
    let file = written(&[0]);
    assert!(file.variable("time").is_none() && file.dimension_len("time") == Some(1));
    let elevation = file.variable("elevation").unwrap();
    let names: Vec<String> = elevation.dimensions().iter().map(::netcdf::Dimension::name).collect();
    assert_eq!(names, ["time", "y", "x"]);
    let (y, x) = (file.variable("y").unwrap(), file.variable("x").unwrap());
    assert_eq!((text(&y, "units"), text(&x, "units")), ("m".into(), "m".into()));
    assert!(text(&y, "long_name").contains("top of the left picture") && file.variable("north").is_none());
    drop(file);
    // A recording that counts from its own start.
    let file = written(&[12_250_000_000, 12_500_000_000]);
    let time = file.variable("time").unwrap();
    assert_eq!((time.get_values::<f64, _>(..).unwrap(), text(&time, "units")), (vec![0.0, 0.25], "s".into()));
    assert!(time.attribute("standard_name").is_none() && time.attribute("calendar").is_none());
}
