//! Where things are: WGS-84 positions and the local north-east-down frame about an origin.

use nalgebra::{Matrix3, Vector2, Vector3};

/// WGS-84 semi-major axis, metres (NIMA TR8350.2).
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// WGS-84 flattening.
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);

/// A WGS-84 position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodetic {
    /// Latitude, radians, positive north.
    pub latitude_rad: f64,
    /// Longitude, radians, positive east.
    pub longitude_rad: f64,
    /// Height, metres. Above the ellipsoid or mean sea level, as the source says; one fleet uses one of them throughout.
    pub altitude_m: f64,
}

impl Geodetic {
    /// From degrees, as MAVLink, REST and people write them.
    #[must_use]
    pub fn from_deg(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Self {
        Self { latitude_rad: latitude_deg.to_radians(), longitude_rad: longitude_deg.to_radians(), altitude_m }
    }

    /// Latitude, degrees.
    #[must_use]
    pub fn latitude_deg(&self) -> f64 {
        self.latitude_rad.to_degrees()
    }

    /// Longitude, degrees.
    #[must_use]
    pub fn longitude_deg(&self) -> f64 {
        self.longitude_rad.to_degrees()
    }

    /// Whether every number is finite and latitude and longitude are in range.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.latitude_rad.abs() <= std::f64::consts::FRAC_PI_2
            && self.longitude_rad.abs() <= std::f64::consts::PI
            && self.altitude_m.is_finite()
    }

    /// Earth-centred, earth-fixed position, metres.
    fn ecef_m(&self) -> Vector3<f64> {
        let (sin_lat, cos_lat) = self.latitude_rad.sin_cos();
        let (sin_lon, cos_lon) = self.longitude_rad.sin_cos();
        let normal_m = SEMI_MAJOR_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
        let radial_m = (normal_m + self.altitude_m) * cos_lat;
        Vector3::new(
            radial_m * cos_lon,
            radial_m * sin_lon,
            (normal_m * (1.0 - ECCENTRICITY_SQUARED) + self.altitude_m) * sin_lat,
        )
    }

    /// The inverse of [`Self::ecef_m`]: Bowring's start, then fixed-point iteration; under a nanometre near the surface.
    fn from_ecef_m(ecef_m: Vector3<f64>) -> Self {
        let radial_m = ecef_m.xy().norm();
        let mut latitude_rad = ecef_m.z.atan2(radial_m * (1.0 - ECCENTRICITY_SQUARED));
        let mut normal_m = SEMI_MAJOR_M;
        for _ in 0..8 {
            let sin_lat = latitude_rad.sin();
            normal_m = SEMI_MAJOR_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
            latitude_rad = (ecef_m.z + ECCENTRICITY_SQUARED * normal_m * sin_lat).atan2(radial_m);
        }
        let (sin_lat, cos_lat) = latitude_rad.sin_cos();
        // Well conditioned at every latitude, unlike radial / cos(latitude).
        let altitude_m = radial_m * cos_lat + ecef_m.z * sin_lat - normal_m * (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat);
        Self { latitude_rad, longitude_rad: ecef_m.y.atan2(ecef_m.x), altitude_m }
    }
}

/// A place on the water in the local frame: metres north and east of the fleet's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalPoint {
    /// Metres north of the origin.
    pub north_m: f64,
    /// Metres east of the origin.
    pub east_m: f64,
}

impl LocalPoint {
    /// From north and east, metres.
    #[must_use]
    pub const fn new(north_m: f64, east_m: f64) -> Self {
        Self { north_m, east_m }
    }

    /// As a vector (north, east), metres.
    #[must_use]
    pub fn vector(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }

    /// Horizontal distance to `other`, metres.
    #[must_use]
    pub fn distance_m(&self, other: &Self) -> f64 {
        (self.vector() - other.vector()).norm()
    }
}

impl From<Vector3<f64>> for LocalPoint {
    /// Drops the down component of a local NED position.
    fn from(position_ned_m: Vector3<f64>) -> Self {
        Self { north_m: position_ned_m.x, east_m: position_ned_m.y }
    }
}

/// A north-east-down frame tangent to the ellipsoid at an origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalFrame {
    origin: Geodetic,
    origin_ecef_m: Vector3<f64>,
    ned_from_ecef: Matrix3<f64>,
}

impl LocalFrame {
    /// The frame tangent at `origin`.
    #[must_use]
    pub fn new(origin: Geodetic) -> Self {
        let (sin_lat, cos_lat) = origin.latitude_rad.sin_cos();
        let (sin_lon, cos_lon) = origin.longitude_rad.sin_cos();
        let ned_from_ecef = Matrix3::new(
            -sin_lat * cos_lon,
            -sin_lat * sin_lon,
            cos_lat,
            -sin_lon,
            cos_lon,
            0.0,
            -cos_lat * cos_lon,
            -cos_lat * sin_lon,
            -sin_lat,
        );
        Self { origin, origin_ecef_m: origin.ecef_m(), ned_from_ecef }
    }

    /// The origin.
    #[must_use]
    pub fn origin(&self) -> Geodetic {
        self.origin
    }

    /// Local position (north, east, down), metres.
    #[must_use]
    pub fn ned_from_geodetic(&self, position: Geodetic) -> Vector3<f64> {
        self.ned_from_ecef * (position.ecef_m() - self.origin_ecef_m)
    }

    /// Geodetic position of a local one.
    #[must_use]
    pub fn geodetic_from_ned(&self, position_ned_m: Vector3<f64>) -> Geodetic {
        Geodetic::from_ecef_m(self.origin_ecef_m + self.ned_from_ecef.transpose() * position_ned_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Metres per degree at 45°: published series values (Snyder, Map Projections, USGS PP 1395).
    #[test]
    fn a_degree_at_45_has_its_published_length() {
        let frame = LocalFrame::new(Geodetic::from_deg(45.0, 7.0, 0.0));
        let north = frame.ned_from_geodetic(Geodetic::from_deg(45.001, 7.0, 0.0));
        let east = frame.ned_from_geodetic(Geodetic::from_deg(45.0, 7.001, 0.0));
        assert!((north.x - 111.131_779).abs() < 2e-3, "{}", north.x);
        assert!((east.y - 78.846_835).abs() < 2e-3, "{}", east.y);
    }

    proptest! {
        #[test]
        fn there_and_back(lat in -89.9f64..89.9, lon in -180.0f64..180.0, n in -5e3f64..5e3, e in -5e3f64..5e3, d in -500.0f64..500.0) {
            let frame = LocalFrame::new(Geodetic::from_deg(lat, lon, 12.0));
            let ned = Vector3::new(n, e, d);
            let back = frame.ned_from_geodetic(frame.geodetic_from_ned(ned));
            prop_assert!((back - ned).norm() < 1e-6, "{back} {ned}");
        }
    }
}
