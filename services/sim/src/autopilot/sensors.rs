//! What the sensors measured, as messages.

use std::f64::consts::TAU;

use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::MavMessage;
use nalgebra::Vector3;

use super::{Autopilot, Param};
use crate::copter::GRAVITY_MPS2;

/// Pressure at sea level (ISA), hectopascals.
const SEA_LEVEL_HPA: f64 = 1013.25;
/// The earth's field in mid-latitudes, towards true north: headings are true here; milligauss.
const MAGNETIC_NED_MGAUSS: Vector3<f64> = Vector3::new(190.0, 0.0, 450.0);
/// Sensors' own temperature, hundredths of a degree Celsius.
const TEMPERATURE_CDEG: i16 = 3500;

impl Autopilot {
    pub(super) fn gps_raw(&self) -> MavMessage {
        let Some(gnss) = self.sensed.gnss else {
            return MavMessage::GPS_RAW_INT(mav::GPS_RAW_INT_DATA {
                time_usec: self.boot_us(),
                fix_type: mav::GpsFixType::GPS_FIX_TYPE_NO_FIX,
                eph: u16::MAX,
                epv: u16::MAX,
                ..Default::default()
            });
        };
        let (lat, lon, altitude_m) = self.global_e7(gnss.position_ned_m);
        let velocity_mps = gnss.velocity_ned_mps;
        let course_rad = velocity_mps.y.atan2(velocity_mps.x).rem_euclid(TAU);
        let (horizontal_m, vertical_m) = self.sensed.gnss_sigma_m;
        // Dilution of precision of a good sky: it shrinks with the satellites in use.
        let hdop = 2.0 / f64::from(self.sensed.satellites.max(4)).sqrt();
        MavMessage::GPS_RAW_INT(mav::GPS_RAW_INT_DATA {
            time_usec: self.boot_us(),
            lat,
            lon,
            alt: (altitude_m * 1e3) as i32,
            eph: (hdop * 100.0) as u16,
            epv: (hdop * 160.0) as u16,
            vel: (velocity_mps.xy().norm() * 100.0) as u16,
            cog: (course_rad.to_degrees() * 100.0) as u16,
            fix_type: mav::GpsFixType::GPS_FIX_TYPE_3D_FIX,
            satellites_visible: self.sensed.satellites,
            alt_ellipsoid: (altitude_m * 1e3) as i32,
            h_acc: (horizontal_m * 1e3) as u32,
            v_acc: (vertical_m * 1e3) as u32,
            vel_acc: 100,
            ..Default::default()
        })
    }

    /// Accelerometer in thousandths of g, gyroscope in milliradians per second, magnetometer in milligauss.
    fn imu(&self) -> [[i16; 3]; 3] {
        let whole = |vector: Vector3<f64>| [vector.x as i16, vector.y as i16, vector.z as i16];
        let force = self.sensed.specific_force_body_mps2 * (1e3 / GRAVITY_MPS2);
        let field = self.sensed.estimate.ned_from_body.inverse_transform_vector(&MAGNETIC_NED_MGAUSS);
        [whole(force), whole(self.sensed.estimate.rate_body_radps * 1e3), whole(field)]
    }

    pub(super) fn raw_imu(&self) -> MavMessage {
        let [[xacc, yacc, zacc], [xgyro, ygyro, zgyro], [xmag, ymag, zmag]] = self.imu();
        MavMessage::RAW_IMU(mav::RAW_IMU_DATA {
            time_usec: self.boot_us(),
            xacc,
            yacc,
            zacc,
            xgyro,
            ygyro,
            zgyro,
            xmag,
            ymag,
            zmag,
            id: 0,
            temperature: TEMPERATURE_CDEG,
        })
    }

    pub(super) fn scaled_imu(&self) -> MavMessage {
        let [[xacc, yacc, zacc], [xgyro, ygyro, zgyro], [xmag, ymag, zmag]] = self.imu();
        MavMessage::SCALED_IMU(mav::SCALED_IMU_DATA {
            time_boot_ms: self.boot_ms(),
            xacc,
            yacc,
            zacc,
            xgyro,
            ygyro,
            zgyro,
            xmag,
            ymag,
            zmag,
            temperature: TEMPERATURE_CDEG,
        })
    }

    /// Of a second unit, which sees the same.
    pub(super) fn scaled_imu2(&self) -> MavMessage {
        let [[xacc, yacc, zacc], [xgyro, ygyro, zgyro], [xmag, ymag, zmag]] = self.imu();
        MavMessage::SCALED_IMU2(mav::SCALED_IMU2_DATA {
            time_boot_ms: self.boot_ms(),
            xacc,
            yacc,
            zacc,
            xgyro,
            ygyro,
            zgyro,
            xmag,
            ymag,
            zmag,
            temperature: TEMPERATURE_CDEG,
        })
    }

    /// What the rangefinder measured, in its range or not, while one is set up; centimetres.
    pub(super) fn distance_sensor(&self) -> Option<MavMessage> {
        let orientation = match self.params.get(Param::RangefinderOrientation) as u32 {
            25 => mav::MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270,
            24 => mav::MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_90,
            _ => mav::MavSensorOrientation::MAV_SENSOR_ROTATION_NONE,
        };
        Some(MavMessage::DISTANCE_SENSOR(mav::DISTANCE_SENSOR_DATA {
            time_boot_ms: self.boot_ms(),
            min_distance: self.params.get(Param::RangefinderMin) as u16,
            max_distance: self.params.get(Param::RangefinderMax) as u16,
            current_distance: (self.measured_m()? * 100.0).round() as u16,
            mavtype: mav::MavDistanceSensor::MAV_DISTANCE_SENSOR_LASER,
            id: 0,
            orientation,
            covariance: 0,
            ..Default::default()
        }))
    }

    /// The old message of the same: metres, and only of one that looks down.
    pub(super) fn rangefinder(&self) -> Option<MavMessage> {
        let looks_down = self.params.get(Param::RangefinderOrientation) == 25.0;
        let distance = self.measured_m().filter(|_| looks_down)? as f32;
        Some(MavMessage::RANGEFINDER(mav::RANGEFINDER_DATA { distance, voltage: 0.0 }))
    }

    fn measured_m(&self) -> Option<f64> {
        self.sensed.range_m.filter(|_| self.params.get(Param::RangefinderType) != 0.0)
    }

    pub(super) fn pressure(&self) -> MavMessage {
        // The standard atmosphere below 11 km.
        let altitude_m = self.frame.origin().altitude_m - self.sensed.estimate.position_ned_m.z;
        let press_abs = SEA_LEVEL_HPA * (1.0 - 2.255_77e-5 * altitude_m).max(0.0).powf(5.255_88);
        MavMessage::SCALED_PRESSURE(mav::SCALED_PRESSURE_DATA {
            time_boot_ms: self.boot_ms(),
            press_abs: press_abs as f32,
            temperature: 3500,
            ..Default::default()
        })
    }
}
