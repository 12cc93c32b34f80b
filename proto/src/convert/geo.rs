use halcyon_model::{Geodetic, LocalPoint};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::field::{FieldError, finite};
use crate::v1;

pub(super) fn vector_to(vector: &Vector3<f64>) -> v1::Vector3 {
    v1::Vector3 { x: vector.x, y: vector.y, z: vector.z }
}

pub(super) fn vector_from(proto: v1::Vector3) -> Result<Vector3<f64>, FieldError> {
    Ok(Vector3::new(finite("x", proto.x)?, finite("y", proto.y)?, finite("z", proto.z)?))
}

pub(super) fn rotation_to(rotation: &UnitQuaternion<f64>) -> v1::Quaternion {
    v1::Quaternion { w: rotation.w, x: rotation.i, y: rotation.j, z: rotation.k }
}

pub(super) fn rotation_from(proto: v1::Quaternion) -> Result<UnitQuaternion<f64>, FieldError> {
    let quaternion =
        Quaternion::new(finite("w", proto.w)?, finite("x", proto.x)?, finite("y", proto.y)?, finite("z", proto.z)?);
    if (quaternion.norm() - 1.0).abs() > 1e-3 {
        return Err(FieldError::new("w", format!("belongs to a quaternion of norm {}, not 1", quaternion.norm())));
    }
    Ok(UnitQuaternion::from_quaternion(quaternion))
}

pub(super) fn geodetic_to(position: &Geodetic) -> v1::Geodetic {
    v1::Geodetic { latitude_rad: position.latitude_rad, longitude_rad: position.longitude_rad, altitude_m: position.altitude_m }
}

pub(super) fn geodetic_from(proto: v1::Geodetic) -> Result<Geodetic, FieldError> {
    let position = Geodetic {
        latitude_rad: finite("latitude_rad", proto.latitude_rad)?,
        longitude_rad: finite("longitude_rad", proto.longitude_rad)?,
        altitude_m: finite("altitude_m", proto.altitude_m)?,
    };
    if position.is_valid() { Ok(position) } else { Err(FieldError::new("latitude_rad", "or longitude_rad is out of range")) }
}

pub(super) fn point_to(point: &LocalPoint) -> v1::LocalPoint {
    v1::LocalPoint { north_m: point.north_m, east_m: point.east_m }
}

pub(super) fn point_from(proto: v1::LocalPoint) -> Result<LocalPoint, FieldError> {
    Ok(LocalPoint::new(finite("north_m", proto.north_m)?, finite("east_m", proto.east_m)?))
}
