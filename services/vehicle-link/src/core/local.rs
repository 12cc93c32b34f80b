//! Where the autopilot's own local frame lies in the fleet's.
//!
//! ArduCopter takes an acceleration with a position only in its local frame (SET_POSITION_TARGET_LOCAL_NED), whose origin is its
//! estimator's and whose scale is its own approximation of the Earth: by two parts in a thousand another than ours, 6 cm at 30 m.
//! So the place of the frame is measured where the vehicle is, by what it says of itself in both frames at the same time; a
//! setpoint a few metres away is then right to millimetres, whatever the scale.

use halcyon_model::{Geodetic, Stamp};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::MavMessage;
use nalgebra::Vector3;

use super::encode::Datum;

/// Two messages further apart than this aren't of one moment, milliseconds of the autopilot's clock.
const APART_MS_MAX: i64 = 300;
/// A latitude's last digit is 11 mm: the mean of about ten pairs.
const GAIN: f64 = 0.1;
/// A step larger than this is the estimator's new origin, or its reset, metres.
const RESET_M: f64 = 0.3;
/// Not believed for longer than this without news, seconds.
const AGE_S_MAX: f64 = 2.0;

/// Finds the autopilot's local frame.
#[derive(Debug, Clone, Default)]
pub struct LocalFinder {
    /// Time since boot and fleet-local place by GLOBAL_POSITION_INT.
    fleet: Option<(u32, Vector3<f64>)>,
    /// Time since boot, place and velocity by LOCAL_POSITION_NED.
    local: Option<(u32, Vector3<f64>, Vector3<f64>)>,
    shift_ned_m: Option<(Vector3<f64>, Stamp)>,
}

impl LocalFinder {
    /// Takes a message of the autopilot.
    pub fn observe(&mut self, message: &MavMessage, datum: &Datum, now: Stamp) {
        match message {
            MavMessage::GLOBAL_POSITION_INT(data) => {
                self.fleet = fleet_place(data, datum).map(|ned_m| (data.time_boot_ms, ned_m));
            }
            MavMessage::LOCAL_POSITION_NED(data) => {
                let vector = |x: f32, y: f32, z: f32| Vector3::new(f64::from(x), f64::from(y), f64::from(z));
                let (place_m, velocity_mps) = (vector(data.x, data.y, data.z), vector(data.vx, data.vy, data.vz));
                let finite = place_m.iter().chain(velocity_mps.iter()).all(|number| number.is_finite());
                self.local = finite.then_some((data.time_boot_ms, place_m, velocity_mps));
            }
            _ => return,
        }
        let (Some((fleet_ms, fleet_m)), Some((local_ms, local_m, velocity_mps))) = (self.fleet, self.local) else { return };
        let apart_ms = i64::from(fleet_ms) - i64::from(local_ms);
        if apart_ms.abs() > APART_MS_MAX {
            return;
        }
        let measured_m = local_m + velocity_mps * (apart_ms as f64 * 1e-3) - fleet_m;
        let shift_m = match self.shift_ned_m {
            Some((shift_m, _)) if (measured_m - shift_m).norm() < RESET_M => shift_m + (measured_m - shift_m) * GAIN,
            _ => measured_m,
        };
        self.shift_ned_m = Some((shift_m, now));
    }

    /// What to add to a place in the fleet's frame near the vehicle, metres; `None` while it isn't known.
    #[must_use]
    pub fn shift_ned_m(&self, now: Stamp) -> Option<Vector3<f64>> {
        self.shift_ned_m.filter(|(_, at)| now.seconds_since(*at) <= AGE_S_MAX).map(|(shift_m, _)| shift_m)
    }
}

/// As [`super::telemetry`] has it: north and east by the map, down by the height above home.
fn fleet_place(data: &ardu::GLOBAL_POSITION_INT_DATA, datum: &Datum) -> Option<Vector3<f64>> {
    let height_m = f64::from(data.relative_alt) * 1e-3 + datum.home_height_m;
    let altitude_m = datum.frame.origin().altitude_m + height_m;
    let place = Geodetic::from_deg(f64::from(data.lat) * 1e-7, f64::from(data.lon) * 1e-7, altitude_m);
    if !place.is_valid() || (data.lat == 0 && data.lon == 0) {
        return None;
    }
    let ned_m = datum.frame.ned_from_geodetic(place);
    Some(Vector3::new(ned_m.x, ned_m.y, -height_m))
}

#[cfg(test)]
mod tests {
    use halcyon_model::FleetOrigin;

    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    fn datum() -> Datum {
        Datum { frame: FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0)).frame(), home_height_m: 1.5 }
    }

    fn pair(finder: &mut LocalFinder, boot_ms: u32, north_m: f64, speed_mps: f32, local_north_m: f32, now: Stamp) {
        let place = datum().frame.geodetic_from_ned(Vector3::new(north_m, 20.0, -8.0));
        let global = ardu::GLOBAL_POSITION_INT_DATA {
            time_boot_ms: boot_ms,
            lat: (place.latitude_deg() * 1e7).round() as i32,
            lon: (place.longitude_deg() * 1e7).round() as i32,
            relative_alt: 6_500,
            ..Default::default()
        };
        // Said 40 ms earlier, at 3 m/s 12 cm short of it.
        let local = ardu::LOCAL_POSITION_NED_DATA {
            time_boot_ms: boot_ms - 40,
            x: local_north_m - 0.04 * speed_mps,
            y: 17.0,
            z: -6.4,
            vx: speed_mps,
            ..Default::default()
        };
        finder.observe(&MavMessage::LOCAL_POSITION_NED(local), &datum(), now);
        finder.observe(&MavMessage::GLOBAL_POSITION_INT(global), &datum(), now);
    }

    #[test]
    fn a_vehicle_on_the_move_shows_where_its_frame_lies() {
        let mut finder = LocalFinder::default();
        assert_eq!(finder.shift_ned_m(t(0.0)), None);
        for step in 0..100u32 {
            let north_m = 3.0 * 0.1 * f64::from(step);
            pair(&mut finder, 5_000 + 100 * step, north_m, 3.0, (north_m + 4.0) as f32, t(0.1 * f64::from(step)));
        }
        let shift_m = finder.shift_ned_m(t(10.0)).unwrap();
        assert!((shift_m - Vector3::new(4.0, -3.0, 1.6)).norm() < 0.01, "{shift_m}");
        assert_eq!(finder.shift_ned_m(t(13.0)), None, "long ago");
        // The estimator has set a new origin, 30 m further south.
        pair(&mut finder, 20_000, 30.0, 3.0, 64.0, t(15.0));
        assert!((finder.shift_ned_m(t(15.0)).unwrap().x - 34.0).abs() < 0.01);
    }

    #[test]
    fn messages_of_different_moments_and_nonsense_say_nothing() {
        let mut finder = LocalFinder::default();
        let nan = ardu::LOCAL_POSITION_NED_DATA { x: f32::NAN, time_boot_ms: 5_000, ..Default::default() };
        let global =
            ardu::GLOBAL_POSITION_INT_DATA { lat: 531_000_000, lon: -29_000_000, time_boot_ms: 5_000, ..Default::default() };
        finder.observe(&MavMessage::GLOBAL_POSITION_INT(global.clone()), &datum(), t(0.0));
        finder.observe(&MavMessage::LOCAL_POSITION_NED(nan), &datum(), t(0.0));
        assert_eq!(finder.shift_ned_m(t(0.0)), None);
        let late = ardu::LOCAL_POSITION_NED_DATA { time_boot_ms: 9_000, ..Default::default() };
        finder.observe(&MavMessage::LOCAL_POSITION_NED(late), &datum(), t(0.0));
        assert_eq!(finder.shift_ned_m(t(0.0)), None);
    }
}
