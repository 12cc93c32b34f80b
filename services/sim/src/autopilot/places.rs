//! Places between the wire's degrees and the fleet's metres.

use halcyon_model::Geodetic;
use mavlink::dialects::ardupilotmega as mav;
use nalgebra::Vector3;

use super::{Autopilot, Param};

impl Autopilot {
    /// Where RTL goes: home, or a rally point that is nearer.
    pub(super) fn return_place(&self) -> Vector3<f64> {
        let here_m = self.sensed.estimate.position_ned_m;
        let home_m = self.home_ned_m.unwrap_or(here_m);
        let limit_m = self.params.get(Param::RallyLimit) * 1e3;
        let away_m = |place_m: &Vector3<f64>| (place_m - here_m).xy().norm();
        let points = self.rally.iter().filter_map(|point| {
            let altitude_m = self.frame.origin().altitude_m;
            let place = Geodetic::from_deg(f64::from(point.x) * 1e-7, f64::from(point.y) * 1e-7, altitude_m);
            let flat_m = self.frame.ned_from_geodetic(place);
            // It lands there; the point's height is only for fixed wings.
            place.is_valid().then(|| Vector3::new(flat_m.x, flat_m.y, home_m.z))
        });
        let nearest = points
            .filter(|point_m| limit_m <= 0.0 || away_m(point_m) <= limit_m)
            .min_by(|a, b| away_m(a).total_cmp(&away_m(b)));
        let home_counts = self.params.get(Param::RallyHome) != 0.0;
        match nearest {
            Some(point_m) if !home_counts || away_m(&point_m) < away_m(&home_m) => point_m,
            _ => home_m,
        }
    }

    /// A place as MAVLink's 10⁻⁷ degrees and metres.
    pub(super) fn global_e7(&self, ned_m: Vector3<f64>) -> (i32, i32, f64) {
        let place = self.frame.geodetic_from_ned(ned_m);
        // The plane's height, not the ellipsoid's: what the fleet calls height stays the same far from the origin.
        let altitude_m = self.frame.origin().altitude_m - ned_m.z;
        (tenths_of_micro_deg(place.latitude_deg()), tenths_of_micro_deg(place.longitude_deg()), altitude_m)
    }
}

/// Degrees as MAVLink's 10⁻⁷ degrees.
pub(super) fn tenths_of_micro_deg(deg: f64) -> i32 {
    (deg * 1e7).round() as i32
}

/// An item of floats as one of integers.
pub(super) fn as_integers(data: &mav::MISSION_ITEM_DATA) -> mav::MISSION_ITEM_INT_DATA {
    mav::MISSION_ITEM_INT_DATA {
        param1: data.param1,
        param2: data.param2,
        param3: data.param3,
        param4: data.param4,
        x: tenths_of_micro_deg(f64::from(data.x)),
        y: tenths_of_micro_deg(f64::from(data.y)),
        z: data.z,
        seq: data.seq,
        command: data.command,
        target_system: data.target_system,
        target_component: data.target_component,
        frame: data.frame,
        current: data.current,
        autocontinue: data.autocontinue,
        mission_type: data.mission_type,
    }
}

/// And back, with what a float can hold.
pub(super) fn as_floats(data: &mav::MISSION_ITEM_INT_DATA) -> mav::MISSION_ITEM_DATA {
    mav::MISSION_ITEM_DATA {
        param1: data.param1,
        param2: data.param2,
        param3: data.param3,
        param4: data.param4,
        x: (f64::from(data.x) * 1e-7) as f32,
        y: (f64::from(data.y) * 1e-7) as f32,
        z: data.z,
        seq: data.seq,
        command: data.command,
        target_system: data.target_system,
        target_component: data.target_component,
        frame: data.frame,
        current: data.current,
        autocontinue: data.autocontinue,
        mission_type: data.mission_type,
    }
}
