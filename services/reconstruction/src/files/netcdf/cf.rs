//! The CF layout (Climate and Forecast conventions 1.8).

use ::netcdf::{Error, FileMut};
use halcyon_model::{Stamp, rig_yaml};

use super::spool::{Cells, Entry, Spool};
use super::{About, FillError, describe};
use crate::core::cloud::CloudFrame;

/// A chunk holds about so many values: a series at one place and a map at one time are both read quickly.
const CHUNK_VALUES: usize = 1 << 18;
const DEFLATE: i32 = 4;
/// The height of a water surface "above an arbitrary reference datum" (CF standard name table): here the patch's own mean level.
const HEIGHT: &str = "water_surface_height_above_reference_datum";
const HEIGHT_ERROR: &str = "water_surface_height_above_reference_datum standard_error";

pub(super) fn fill(file: &mut FileMut, spool: &mut Spool, about: &About) -> Result<(), FillError> {
    let (cell_m, extent) = spool.grid();
    let is_local = spool.frame == CloudFrame::Gravity;
    let has_level = spool.entries.iter().any(|entry| entry.level_m.is_some());
    let Some(first) = spool.entries.first().copied() else { return Ok(()) };
    about_file(file, about, cell_m, spool.frame, has_level)?;
    file.add_unlimited_dimension("time")?;
    let names = axis_names(is_local);
    file.add_dimension(names[0], extent.rows)?;
    file.add_dimension(names[1], extent.cols)?;
    file.add_dimension("axis", 3)?;
    axes(file, spool, is_local, names)?;
    for scalar in scalars(has_level, is_local) {
        let mut variable = file.add_variable::<f64>(scalar.name, &["time"])?;
        variable.set_fill_value(f64::NAN)?;
        describe(&mut variable, scalar.attributes)?;
        let values: Vec<f64> = spool.entries.iter().map(scalar.value).collect();
        variable.put_values(&values, [..values.len()])?;
    }
    normals_and_points(file, spool)?;
    times(file, spool, first.stamp)?;
    maps(file, spool, names)
}

/// Rows and columns. Where nobody knows where north is, the axes are the picture's, and must not be called anything else.
fn axis_names(is_local: bool) -> [&'static str; 2] {
    if is_local { ["north", "east"] } else { ["y", "x"] }
}

fn about_file(file: &mut FileMut, about: &About, cell_m: f64, frame: CloudFrame, has_level: bool) -> Result<(), Error> {
    let rig = &about.calibration;
    let comment = match (frame, has_level) {
        (CloudFrame::Gravity, _) => {
            "Elevation is above each patch's own mean level, which is the variable level: the autopilot's wander stays there"
        }
        (CloudFrame::Plane, true) => {
            "The rig stood still: level by the mean of all its planes; the mean level of each patch is the variable level"
        }
        (CloudFrame::Plane, false) => {
            "No attitude was known: each patch is level by its own mean plane, and y points to the top of the left picture"
        }
    };
    for (name, value) in [
        ("Conventions", "CF-1.8"),
        ("title", "Water surface elevation by stereo vision"),
        ("institution", "Halcyon"),
        ("source", &about.source),
        ("history", &about.history),
        ("references", "Sam-Odusina (thesis), chapters 4, 5 and 7"),
        ("comment", comment),
        ("frame", frame.name()),
        ("rig_calibration", &rig_yaml::write(rig)),
    ] {
        file.add_attribute(name, value)?;
    }
    file.add_attribute("cell_m", cell_m)?;
    file.add_attribute("rig_baseline_m", rig.baseline_m())?;
    file.add_attribute("rig_picture_px", vec![rig.width_px as i32, rig.height_px as i32])?;
    Ok(())
}

fn axes(file: &mut FileMut, spool: &Spool, is_local: bool, names: [&str; 2]) -> Result<(), Error> {
    let (north_m, east_m) = spool.axes();
    let long_names = if is_local {
        ["distance north of the local origin", "distance east of the local origin"]
    } else {
        ["distance towards the top of the left picture", "distance towards the right of the left picture"]
    };
    // Without `axis`: CF then asks for longitudes and latitudes, and a rig does not know where on Earth its origin is.
    for (name, long_name, values) in [(names[0], long_names[0], &north_m), (names[1], long_names[1], &east_m)] {
        let mut variable = file.add_variable::<f64>(name, &[name])?;
        describe(&mut variable, &[("long_name", long_name), ("units", "m")])?;
        variable.put_values(values, ..)?;
    }
    Ok(())
}

/// A number for each time.
struct Scalar {
    name: &'static str,
    attributes: &'static [(&'static str, &'static str)],
    value: fn(&Entry) -> f64,
}

fn scalars(has_level: bool, is_local: bool) -> impl Iterator<Item = Scalar> {
    let always = [
        Scalar {
            name: "coverage",
            attributes: &[("long_name", "share of the cells in view of both cameras that were measured"), ("units", "1")],
            value: |entry| entry.coverage,
        },
        Scalar {
            name: "error_length",
            attributes: &[
                ("long_name", "errors of cells closer than this are partly the same: the matching window on the water"),
                ("units", "m"),
            ],
            value: |entry| entry.error_length_m,
        },
        Scalar {
            name: "plane_distance",
            attributes: &[("long_name", "distance of the mean water plane from the left camera"), ("units", "m")],
            value: |entry| entry.plane.distance_m,
        },
        Scalar {
            name: "plane_rms",
            attributes: &[
                ("long_name", "root mean square distance of the points from the mean water plane, waves and noise together"),
                ("units", "m"),
            ],
            value: |entry| entry.plane.rms_m,
        },
    ];
    let level = [
        Scalar {
            name: "level",
            attributes: &[
                ("standard_name", HEIGHT),
                ("long_name", "mean water level of the patch above the datum"),
                ("units", "m"),
                ("ancillary_variables", "level_sigma"),
            ],
            value: |entry| entry.level_m.unwrap_or(f64::NAN),
        },
        Scalar {
            name: "level_sigma",
            attributes: &[
                ("standard_name", HEIGHT_ERROR),
                ("long_name", "one standard deviation of the level"),
                ("units", "m"),
            ],
            value: |entry| entry.level_sigma_m.unwrap_or(f64::NAN),
        },
    ];
    let carried = [
        Scalar {
            name: "level_thesis",
            attributes: &[
                (
                    "long_name",
                    "mean level by the thesis's correction, height - distance cos(pitch) cos(roll) (7-1), for comparison",
                ),
                ("units", "m"),
            ],
            value: |entry| entry.level_thesis_m.unwrap_or(f64::NAN),
        },
        Scalar {
            name: "slope_removed_north",
            attributes: &[
                ("long_name", "rise per metre north taken out of the elevation as the attitude's error"),
                ("units", "1"),
            ],
            value: |entry| entry.slope_removed[0],
        },
        Scalar {
            name: "slope_removed_east",
            attributes: &[
                ("long_name", "rise per metre east taken out of the elevation as the attitude's error"),
                ("units", "1"),
            ],
            value: |entry| entry.slope_removed[1],
        },
        Scalar {
            name: "slope_sigma",
            attributes: &[("long_name", "one standard deviation of the slope that is still wrong, each axis"), ("units", "1")],
            value: |entry| entry.slope_sigma,
        },
    ];
    let level = level.into_iter().filter(move |_| has_level);
    always.into_iter().chain(level).chain(carried.into_iter().filter(move |_| is_local))
}

fn normals_and_points(file: &mut FileMut, spool: &Spool) -> Result<(), Error> {
    let count = spool.entries.len();
    let mut variable = file.add_variable::<f64>("plane_normal", &["time", "axis"])?;
    let long_name = "unit normal of the mean water plane in the rectified left camera frame: x right, y down, z forward";
    describe(&mut variable, &[("long_name", long_name), ("units", "1")])?;
    let values: Vec<f64> = spool.entries.iter().flat_map(|entry| entry.plane.normal.data.0[0]).collect();
    variable.put_values(&values, ([0, 0], [count, 3]))?;
    let mut variable = file.add_variable::<i32>("points", &["time"])?;
    describe(&mut variable, &[("long_name", "triangulated points that went into the patch"), ("units", "1")])?;
    let values: Vec<i32> = spool.entries.iter().map(|entry| i32::try_from(entry.points).unwrap_or(i32::MAX)).collect();
    variable.put_values(&values, [..count])
}

/// Stamps before this (1973) are no date: whoever made them counts from the start of a recording.
const DATED_S_MIN: i64 = 100_000_000;

/// Seconds since the whole second of the first patch: exact to a nanosecond over months. Without a date they are seconds since the
/// first patch; without any stamp at all there is no such variable, as CF allows, rather than a time that nobody measured.
fn times(file: &mut FileMut, spool: &Spool, first: Stamp) -> Result<(), Error> {
    if spool.entries.iter().all(|entry| entry.stamp == Stamp::default()) {
        return file.add_attribute("time_comment", "when the pictures were taken is not known").map(|_| ());
    }
    let since_s = first.as_nanos().div_euclid(1_000_000_000);
    let is_dated = since_s >= DATED_S_MIN;
    let start_ns = if is_dated { since_s.saturating_mul(1_000_000_000) } else { first.as_nanos() };
    let mut variable = file.add_variable::<f64>("time", &["time"])?;
    if is_dated {
        let since = jiff::Timestamp::from_second(since_s).unwrap_or_default();
        let units = format!("seconds since {}", since.strftime("%Y-%m-%d %H:%M:%S"));
        let known = [("standard_name", "time"), ("long_name", "middle of the exposure (UTC)"), ("units", &units)];
        describe(&mut variable, &known)?;
        describe(&mut variable, &[("calendar", "standard"), ("axis", "T")])?;
    } else {
        let long_name = "middle of the exposure, after that of the first patch; the date is not known";
        describe(&mut variable, &[("long_name", long_name), ("units", "s")])?;
    }
    let nanos = |entry: &Entry| entry.stamp.as_nanos().saturating_sub(start_ns);
    let values: Vec<f64> = spool.entries.iter().map(|entry| nanos(entry) as f64 * 1e-9).collect();
    variable.put_values(&values, [..values.len()])
}

fn maps(file: &mut FileMut, spool: &mut Spool, names: [&str; 2]) -> Result<(), FillError> {
    let (_, extent) = spool.grid();
    let (rows, cols) = (extent.rows, extent.cols);
    let chunk = [(CHUNK_VALUES / (rows * cols)).clamp(1, spool.entries.len()), rows, cols];
    for (name, attributes) in [
        (
            "elevation",
            [
                ("standard_name", HEIGHT),
                ("long_name", "water surface elevation above the patch's own mean level, positive up"),
                ("units", "m"),
                ("ancillary_variables", "elevation_sigma"),
            ],
        ),
        (
            "elevation_sigma",
            [
                ("standard_name", HEIGHT_ERROR),
                ("long_name", "one standard deviation of the elevation"),
                ("units", "m"),
                ("comment", "from the matching noise, the correlation of neighbouring matches and the attitude's error"),
            ],
        ),
    ] {
        let mut variable = file.add_variable::<f32>(name, &["time", names[0], names[1]])?;
        variable.set_fill_value(f32::NAN)?;
        variable.set_chunking(&chunk)?;
        variable.set_compression(DEFLATE, true)?;
        describe(&mut variable, &attributes)?;
        variable.put_attribute("cell_methods", "time: point area: mean")?;
    }
    let (mut cells, entries) = (Cells::default(), spool.entries.clone());
    for (time, entry) in entries.iter().enumerate() {
        spool.read(entry, &mut cells)?;
        for (name, values) in [("elevation", &cells.elevation_m), ("elevation_sigma", &cells.sigma_m)] {
            if let Some(mut variable) = file.variable_mut(name) {
                variable.put_values(values, ([time, 0, 0], [1, rows, cols]))?;
            }
        }
    }
    Ok(())
}
