//! The layout of WASS: what `wassgridsurface` writes and its users' scripts read. Names, units and order of the dimensions are
//! theirs (Bergamasco et al. 2017), so lengths are in millimetres here and nowhere else.

use ::netcdf::{Error, FileMut};
use halcyon_model::CameraIntrinsics;

use super::spool::{Cells, Spool};
use super::{About, FillError, describe};
use crate::core::cloud::CloudFrame;

const MM_PER_M: f64 = 1e3;

pub(super) fn fill(file: &mut FileMut, spool: &mut Spool, about: &About) -> Result<(), FillError> {
    let (_, extent) = spool.grid();
    let (rows, cols, count) = (extent.rows, extent.cols, spool.entries.len());
    file.add_attribute("source", about.source.as_str())?;
    file.add_attribute("history", about.history.as_str())?;
    file.add_dimension("X", rows)?;
    file.add_dimension("Y", cols)?;
    file.add_unlimited_dimension("count")?;
    let mut scale = file.add_variable::<f64>("scale", &[])?;
    describe(&mut scale, &[("long_name", "scale"), ("units", "meter")])?;
    scale.put_value(about.calibration.baseline_m(), ())?;

    let series = |name| [("units", name), ("field", "time, scalar, series")];
    let mut counts = file.add_variable::<u32>("count", &["count"])?;
    describe(&mut counts, &series("steps"))?;
    counts.put_values(&(0..count as u32).collect::<Vec<_>>(), [..count])?;
    let mut times = file.add_variable::<f64>("time", &["count"])?;
    describe(&mut times, &series("seconds"))?;
    let start = spool.entries.first().map(|entry| entry.stamp).unwrap_or_default();
    let seconds: Vec<f64> = spool.entries.iter().map(|entry| entry.stamp.seconds_since(start)).collect();
    times.put_values(&seconds, [..count])?;

    grids(file, spool)?;
    let range_and_mean_mm = heights(file, spool)?;
    meta(file, about, range_and_mean_mm)?;
    Ok(())
}

fn grids(file: &mut FileMut, spool: &Spool) -> Result<(), Error> {
    let (north_m, east_m) = spool.axes();
    let x: Vec<f64> = north_m.iter().flat_map(|_| east_m.iter().map(|m| m * MM_PER_M)).collect();
    let y: Vec<f64> = north_m.iter().flat_map(|north| east_m.iter().map(move |_| north * MM_PER_M)).collect();
    for (name, long_name, field, values) in
        [("X_grid", "X axis grid", "X_grid, scalar, series", &x), ("Y_grid", "Y axis grid", "Y_grid, scalar, series", &y)]
    {
        let mut variable = file.add_variable::<f64>(name, &["X", "Y"])?;
        describe(&mut variable, &[("units", "millimeter"), ("long_name", long_name), ("field", field)])?;
        variable.put_values(values, ..)?;
    }
    Ok(())
}

/// Writes `Z` and `maskZ` (1 where any patch has a value); returns the least, largest and mean `Z`, millimetres.
fn heights(file: &mut FileMut, spool: &mut Spool) -> Result<[f64; 3], FillError> {
    let (_, extent) = spool.grid();
    let (rows, cols) = (extent.rows, extent.cols);
    let mut z = file.add_variable::<f32>("Z", &["count", "X", "Y"])?;
    z.set_fill_value(f32::NAN)?;
    z.set_chunking(&[8.min(spool.entries.len()), rows, cols])?;
    z.set_compression(4, true)?;
    describe(
        &mut z,
        &[("units", "millimeter"), ("long_name", "Z data on time over the XY grid"), ("field", "Z, scalar, series")],
    )?;
    let fixed = spool.frame == CloudFrame::Plane;
    let mut mask = vec![0.0_f32; rows * cols];
    let (mut least, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut cells, entries) = (Cells::default(), spool.entries.clone());
    // Levels are above a datum that the first pair chose; `Z` is above the mean of all.
    let levels = || entries.iter().filter_map(|entry| entry.level_m);
    let datum_m = levels().sum::<f64>() / levels().count().max(1) as f64;
    let (mut sum, mut count) = (0.0, 0.0);
    for (time, entry) in entries.iter().enumerate() {
        spool.read(entry, &mut cells)?;
        let level_m = if fixed { (entry.level_m.unwrap_or(datum_m) - datum_m) as f32 } else { 0.0 };
        for (value, seen) in cells.elevation_m.iter_mut().zip(&mut mask) {
            *value = (*value + level_m) * MM_PER_M as f32;
            if value.is_finite() {
                *seen = 1.0;
                let value = f64::from(*value);
                (least, largest) = (least.min(value), largest.max(value));
                (sum, count) = (sum + value, count + 1.0);
            }
        }
        z.put_values(&cells.elevation_m, ([time, 0, 0], [1, rows, cols]))?;
    }
    let mut variable = file.add_variable::<f32>("maskZ", &["X", "Y"])?;
    describe(&mut variable, &[("units", ""), ("long_name", "Z mask over the XY grid"), ("field", "Z, scalar, series")])?;
    variable.put_values(&mask, ..)?;
    Ok([least, largest, if count > 0.0 { sum / count } else { 0.0 }])
}

/// The group `meta`: sizes and intrinsics; `zmin`, `zmax` and `zmean` are in metres there.
fn meta(file: &mut FileMut, about: &About, [least_mm, largest_mm, mean_mm]: [f64; 3]) -> Result<(), Error> {
    let rig = &about.calibration;
    let mut meta = file.add_group("meta")?;
    meta.add_attribute("image_width", rig.width_px as i32)?;
    meta.add_attribute("image_height", rig.height_px as i32)?;
    meta.add_attribute("zmin", least_mm / MM_PER_M)?;
    meta.add_attribute("zmax", largest_mm / MM_PER_M)?;
    meta.add_attribute("zmean", mean_mm / MM_PER_M)?;
    meta.add_dimension("V3", 3)?;
    meta.add_dimension("DistV", 5)?;
    let matrix = |camera: &CameraIntrinsics| camera.matrix().transpose().as_slice().to_vec();
    for (name, dimensions, values) in [
        ("intr0", &["V3", "V3"][..], matrix(&rig.left)),
        ("intr1", &["V3", "V3"][..], matrix(&rig.right)),
        ("dist0", &["DistV"][..], rig.left.distortion.to_vec()),
        ("dist1", &["DistV"][..], rig.right.distortion.to_vec()),
    ] {
        meta.add_variable::<f64>(name, dimensions)?.put_values(&values, ..)?;
    }
    Ok(())
}
